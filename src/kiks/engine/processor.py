"""The processor that kernels are compiled for: a level of x86-64, the same for many computers.

Need: machine code for one model of processor fits no other. It can neither be in a wheel nor in a home that computers
share. A level is a set of instructions that processors of a generation have in common.
Method: Numba compiles for the highest level of this computer, unless the user has set another processor, or code for
this very one has already been compiled. No bit of a result depends on it.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numba
from llvmlite import binding
from numba.core.registry import cpu_target

_BASE = ("cx16", "popcnt", "sahf", "sse3", "sse4.1", "sse4.2", "ssse3")
_WIDE = ("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe", "xsave")
_WIDEST = ("avx512bw", "avx512cd", "avx512dq", "avx512f", "avx512vl")

LEVELS = {"x86-64-v2": _BASE, "x86-64-v3": _BASE + _WIDE, "x86-64-v4": _BASE + _WIDE + _WIDEST}
"""The levels, lowest first, with the features that each demands (x86-64 psABI, section 3.1.1), by LLVM's names."""


def level_of(features: Mapping[str, bool]) -> str | None:
    """Return the highest level of a processor; None if it has none of them.

    Args:
        features: Whether it has each feature, by LLVM's names.
    """
    levels = [level for level, needed in LEVELS.items() if all(features.get(each) for each in needed)]
    return levels[-1] if levels else None


@functools.cache
def processor() -> tuple[str, str]:
    """Settle what this process compiles for; return the name and the features of that processor, as LLVM knows them."""
    config: Any = numba.config
    level = level_of(binding.get_host_cpu_features())
    chooses = level is not None and config.CPU_NAME is None and config.CPU_FEATURES is None
    if chooses:
        config.CPU_NAME, config.CPU_FEATURES = level, ""
    # The compiler is made here, or it was when the user compiled something before: then it stays as it is.
    features: str = cpu_target.target_context.codegen().magic_tuple()[2]
    if chooses and features:
        config.CPU_NAME = config.CPU_FEATURES = None
    return config.CPU_NAME or binding.get_host_cpu_name(), features
