"""No kernel reads outside its arrays: worlds of all kinds in a process, as they are and with every index checked."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from tests.engine.compiled import PLAIN_AND_CHECKED

from kiks.engine import code_cache

ROOT = Path(__file__).parent.parent.parent


@pytest.mark.timeout(470)  # it compiles engine and batch, with the checks for the first time
@pytest.mark.parametrize("compiled", [{}, pytest.param(PLAIN_AND_CHECKED, marks=pytest.mark.slow)], ids=["", "checked"])
def test_every_index_is_within_its_array(compiled: dict[str, str]) -> None:
    """Where it is not, Numba raises an IndexError with the checks, and without them the process may end."""
    command = [sys.executable, "-X", "faulthandler", "-m", "tests.engine.checked_worlds"]
    done = subprocess.run(command, cwd=ROOT, env=os.environ | compiled, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout == "all within their arrays\n"


def test_code_with_checks_has_a_cache_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    folders = {}
    for setting in (0, 1, None):
        monkeypatch.setattr(numba.config, "BOUNDSCHECK", setting)
        code_cache._version.cache_clear()
        folders[setting] = next(code_cache.cache_folders())
    code_cache._version.cache_clear()
    assert folders[0] == folders[None] != folders[1]
