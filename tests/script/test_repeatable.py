"""The same program is the same run, whatever Python draws by chance, and whatever has become of compiled code."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from tests.at_length import cases
from tests.cli.test_cli import KIKS
from tests.guard import GUARD_S

from kiks.engine import code_cache

pytestmark = pytest.mark.slow

WANDER = """
import random, time, uuid
import serial
port = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)
for _ in range(5):
    port.write(b"D,%d,%d\\n" % (random.randint(-5, 5), random.randint(-5, 5)))
    port.readline()
    time.sleep(0.3)
port.write(b"H\\n")
print(port.readline(), list({"left", "right", "front", "back"}), uuid.uuid4())
"""


def run(folder: Path, **surroundings: str) -> tuple[int, str, list[str]]:
    """Run a program that wanders by chance; return its exit code, what it has said, and the lines of KiKS."""
    (folder / "wander.py").write_text(WANDER)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONHASHSEED"} | surroundings
    command = [*KIKS, "run", str(folder / "wander.py")]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=3 * GUARD_S, check=False)
    return done.returncode, done.stdout, done.stderr.splitlines()


@pytest.mark.parametrize("is_there", cases([True, False]))
def test_a_kernel_is_compiled_while_a_program_runs(is_there: bool, tmp_path: Path) -> None:
    cache = next(code_cache.cache_folders())
    shutil.copytree(cache, tmp_path / "cache" / "kiks" / cache.name)
    name = f"kiks.engine.physics.motor.set_speed-{code_cache.digest_of('kiks.engine.physics.motor')}-*.code"
    (file,) = (tmp_path / "cache").rglob(name)
    if is_there:
        file.write_bytes(file.read_bytes() + b"x")
    else:
        file.unlink()
    code, said, told = run(tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    expected = ["kiks: Damaged files"] * is_there + ["kiks: Compiling the engine"]
    assert [line.split(" in ")[0].split(" for ")[0] for line in told[: len(expected)]] == expected
    assert (code, said, told[len(expected) :]) == run(tmp_path)
    assert list((tmp_path / "cache").rglob(name))


DRAWS = """
import numpy as np, os, random, secrets, uuid
print([random.random(), str(uuid.uuid4()), os.urandom(3), secrets.token_hex(4), np.random.rand(),
       np.random.default_rng().random(), random.Random().random(), random.SystemRandom().random(), random.random()],
      list({"left", "right", "front", "back", "none"}))
"""


def said(folder: Path, *words: str) -> list[str]:
    """Return what programs print, by the number of the program, without labels."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONHASHSEED"}
    done = subprocess.run(
        [*KIKS, "run", *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=GUARD_S, check=True
    )
    return [line.partition("| ")[2] or line for line in sorted(done.stdout.splitlines())]


def test_chance_follows_from_the_seed(tmp_path: Path) -> None:
    (tmp_path / "draws.py").write_text(DRAWS)
    (alone,), (again,) = said(tmp_path, "draws.py"), said(tmp_path, "draws.py")
    first, second = said(tmp_path, "draws.py", "draws.py")
    (other,) = said(tmp_path, "--seed", "1", "draws.py")
    assert alone == again == first
    assert len({alone.partition("]")[0], second.partition("]")[0], other.partition("]")[0]}) == 3
    assert len({each.partition("]")[2] for each in (alone, second, other)}) == 1
