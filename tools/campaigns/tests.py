"""The tests of `make test` in random order, beside programs that keep every processor busy.

A case is one run of all tests. Its number decides the order of the tests and the examples that hypothesis draws.
"""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests.busy import busy_computer
from tools.campaigns.processes import compile_engine
from tools.campaigns.runner import WAIT_FACTOR, Broken, Campaign, Play

ROOT = Path(__file__).parents[2]

RUNS = 5
LIMIT_S = 3600.0
"""Longest time of a run [s]."""


def _run(rng: random.Random) -> int:
    """Run the tests; return how many passed.

    Raises:
        Broken: If one failed.
    """
    seed, processors = str(rng.randrange(1 << 32)), os.cpu_count() or 1
    command = [sys.executable, "-m", "pytest", "-n", str(1 + processors), "--dist", "worksteal"]
    command += ["-p", "pytest_randomly", f"--randomly-seed={seed}", f"--hypothesis-seed={seed}"]
    log = Path(tempfile.gettempdir()) / f"kiks-tests-{seed}.log"
    with busy_computer(processors), log.open("w") as output:
        code = subprocess.run(command, cwd=ROOT, stdout=output, stderr=subprocess.STDOUT, check=False).returncode
    said = log.read_text()
    if code:
        failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE) or ["pytest"]
        raise Broken("foreign", f"see {log}: {', '.join(failed)}", failed[0])
    log.unlink()
    passed = re.search(r"(\d+) passed", said)
    return int(passed[1]) if passed else 0


def _prepare() -> Play:
    compile_engine()
    return _run


def campaigns() -> Iterator[Campaign]:
    """Yield the only one."""
    yield Campaign("tests.busy", RUNS, _prepare, limit_s=LIMIT_S / WAIT_FACTOR, is_named_only=True, jobs=1)
