"""No kernel reads outside its arrays, and none depends on the processor or on the build."""

import numba
import pytest
from tests.at_length import at_length
from tests.engine.processes import python
from tests.engine.test_determinism import record_of_process, run_record

from kiks.engine import code_cache

PLAIN_AND_CHECKED = {
    "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_BOUNDSCHECK": "1", "NUMBA_OPT": "1",
}  # fmt: skip
"""Compile for a processor without wide vectors and check every index; without LLVM's slowest optimisations, which take
two thirds of the time."""


def said_by_process(**environment: str) -> str:
    """Run all worlds in a process whose kernels are compiled as its environment says."""
    done = python("-X", "faulthandler", "-m", "tests.engine.checked_worlds", **environment)
    assert done.returncode == 0, done.stderr[-3000:]
    assert done.stdout.endswith("\nall within their arrays\n")
    return done.stdout


@at_length
def test_no_index_leaves_its_array_and_no_bit_depends_on_the_build() -> None:
    """An index outside its array is an IndexError with the checks; without them the process may end."""
    assert record_of_process(**PLAIN_AND_CHECKED) == run_record()
    assert said_by_process(**PLAIN_AND_CHECKED) == said_by_process()


def test_code_with_checks_has_a_cache_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    folders = {}
    for setting in (0, 1, None):
        monkeypatch.setattr(numba.config, "BOUNDSCHECK", setting)
        code_cache._version.cache_clear()
        folders[setting] = next(code_cache.cache_folders())
    code_cache._version.cache_clear()
    assert folders[0] == folders[None] != folders[1]
