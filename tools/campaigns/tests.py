"""The tests of `make test` in random order, beside programs that keep every processor busy.

A case is one run of all tests. Its number decides the order of the tests and the examples that hypothesis draws.
"""

from __future__ import annotations

import os
import random
import re
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests.busy import busy_computer
from tools.campaigns.runner import WAIT_FACTOR, Broken, Campaign

ROOT = Path(__file__).parents[2]

RUNS = 5
LIMIT_S = 3600.0
"""Longest time of a run [s]."""


def _run(rng: random.Random) -> int:
    """Run the tests; return how many passed.

    Raises:
        Broken: If one failed.
    """
    seed = rng.randrange(1 << 32)
    options = (
        f"-p pytest_randomly --randomly-seed={seed} --hypothesis-seed={seed} {os.environ.get('PYTEST_ADDOPTS', '')}"
    )
    log = Path(tempfile.gettempdir()) / f"kiks-tests-{seed}.log"
    with busy_computer(os.cpu_count() or 1), log.open("w") as output:
        streams = {"stdout": output, "stderr": subprocess.STDOUT}
        environment = os.environ | {"PYTEST_ADDOPTS": options}
        code = subprocess.run(["make", "test"], cwd=ROOT, env=environment, check=False, **streams).returncode
    said = log.read_text()
    if code:
        failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE) or ["pytest"]
        raise Broken("foreign", f"see {log}: {', '.join(failed)}", failed[0])
    log.unlink()
    passed = re.search(r"(\d+) passed", said)
    return int(passed[1]) if passed else 0


def campaigns() -> Iterator[Campaign]:
    """Yield the only one."""
    yield Campaign("tests.busy", RUNS, lambda: _run, limit_s=LIMIT_S / WAIT_FACTOR, is_named_only=True, jobs=1)
