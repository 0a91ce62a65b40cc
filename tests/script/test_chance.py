"""Chance in programs: it follows from the world's seed, alone and among others, and differs between programs."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from tests.cli.test_cli import KIKS
from tests.guard import GUARD_S

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
