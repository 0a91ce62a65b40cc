"""The same program is the same run, whatever Python draws by chance, and whatever has become of compiled code."""

import os
import shutil
from pathlib import Path

import pytest
from tests.at_length import cases
from tests.cli.test_cli import KIKS
from tests.served import GUARD_S, called

from kiks.engine import code_cache

pytestmark = pytest.mark.slow

WANDER = """
import numpy as np, os, random, secrets, serial, time, uuid
port = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)
for _ in range(5):
    port.write(b"D,%d,%d\\n" % (random.randint(-5, 5), random.randint(-5, 5)))
    port.readline()
    time.sleep(0.3)
port.write(b"H\\n")
print([port.readline(), random.random(), str(uuid.uuid4()), os.urandom(3), secrets.token_hex(4), np.random.rand(),
       np.random.default_rng().random(), random.Random().random(), random.SystemRandom().random(), random.random()],
      list({"left", "right", "front", "back", "none"}))
"""


def run(folder: Path, *words: str, **surroundings: str) -> tuple[int, list[str], list[str]]:
    """Run programs in processes of their own; return the exit code, the lines that they say, and those of KiKS."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONHASHSEED"} | surroundings
    done = called(*KIKS, "run", *words, cwd=folder, env=environment, timeout=3 * GUARD_S)
    return done.returncode, sorted(done.stdout.splitlines()), done.stderr.splitlines()


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
    (tmp_path / "wander.py").write_text(WANDER)
    code, said, told = run(tmp_path, "wander.py", NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    expected = ["kiks: Damaged files"] * is_there + ["kiks: Compiling the engine"]
    assert [line.split(" in ")[0].split(" for ")[0] for line in told[: len(expected)]] == expected
    assert (code, said, told[len(expected) :]) == run(tmp_path, "wander.py")
    assert list((tmp_path / "cache").rglob(name))


def test_chance_follows_from_the_seed(tmp_path: Path) -> None:
    (tmp_path / "wander.py").write_text(WANDER)

    def said(*words: str) -> list[str]:
        """Return what each program says, without its label."""
        code, lines, told = run(tmp_path, *words)
        assert code == 0, told
        return [line.partition("| ")[2] or line for line in lines]

    (alone,), (other,) = said("wander.py"), said("--seed", "1", "wander.py")
    first, second = said("wander.py", "wander.py")
    assert alone == first
    assert len({each.partition("]")[0] for each in (alone, second, other)}) == 3
    assert len({each.partition("]")[2] for each in (alone, second, other)}) == 1


STAND_INS = {
    "torch": "def manual_seed(seed): print(seed)",
    "tensorflow": "class random:\n    def set_seed(seed): print(seed)",
    "paddle": "version = 'without a seed'",
    "cupy/__init__": "",
    "cupy/random": "def seed(seed): raise RuntimeError('no device')",
    "duckdb": "",
}
"""Libraries with chance of their own: their files, with the names that matter."""


@pytest.mark.parametrize(
    ("library", "doubted"),
    cases(
        [("torch", ""), ("duckdb", "duckdb"), ("paddle", "paddle"), ("cupy", "cupy"), ("tensorflow", "")], normally=2
    ),
)
def test_chance_of_compiled_libraries_is_seeded_or_told(library: str, doubted: str, tmp_path: Path) -> None:
    (tmp_path / "cupy").mkdir()
    for name, text in STAND_INS.items():
        (tmp_path / f"{name}.py").write_text(text)
    (tmp_path / "loads.py").write_text(f"import {library}.random\n" if library == "cupy" else f"import {library}\n")
    (tmp_path / "waits.py").write_text("import time\ntime.sleep(1)\n")

    def ended(*words: str) -> tuple[list[str], str]:
        code, lines, told = run(tmp_path, *words)
        assert code == 0, told
        (last,) = [line for line in told if "simulated" in line]
        return lines, last.partition("seed 0, ")[2]

    ends = f"not repeatable: {doubted} has random numbers or a clock of its own" if doubted else "state "
    lines, alone = ended("loads.py")
    assert len(lines) == (not doubted)
    assert alone.startswith(ends)
    assert ended("loads.py") == (lines, alone)
    # The process of a program tells the world.
    assert ended("loads.py", "waits.py")[1].startswith(ends)
