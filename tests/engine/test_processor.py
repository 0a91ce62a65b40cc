"""The processor that kernels are compiled for."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from llvmlite import binding

from kiks.engine.processor import LEVELS, level_of

pytestmark = pytest.mark.slow

SHOWN = """
from kiks.engine import step
from kiks.engine.processor import processor
compiler = step.advance.targetctx.codegen()
assert processor()[1] == compiler.magic_tuple()[2]
print('/'.join(processor()))
"""


def shown(program: str, **settings: str) -> tuple[str, str]:
    """Return what a new process compiles for."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_CPU")}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment | settings, capture_output=True, text=True, check=True)
    name, _, features = done.stdout.strip().partition("/")
    return name, features


def test_a_processor_has_a_level_if_it_has_all_its_features() -> None:
    for level, needed in LEVELS.items():
        assert level_of(dict.fromkeys(needed, True)) == level
        assert level_of(dict.fromkeys(needed, True) | {"amx-tile": True, "sse4a": False}) == level
        assert all(level_of(dict.fromkeys(needed, True) | {each: False}) != level for each in needed)
    assert level_of({"neon": True}) is None


@pytest.mark.skipif(level_of(binding.get_host_cpu_features()) is None, reason="this computer's processor has no level")
def test_kernels_are_compiled_for_the_level_of_this_computer() -> None:
    assert shown(SHOWN) == (level_of(binding.get_host_cpu_features()), "")


def test_a_processor_that_the_user_has_set_stays() -> None:
    assert shown(SHOWN, NUMBA_CPU_NAME="x86-64", NUMBA_CPU_FEATURES="+sse3") == ("x86-64", "+sse3")
    assert shown(SHOWN, NUMBA_CPU_NAME="generic") == ("generic", "")


def test_a_compiler_that_the_user_has_used_before_stays() -> None:
    before = "from numba import njit\nassert njit(lambda x: x + 1)(1) == 2\n"
    assert shown(before + SHOWN) == (binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())
