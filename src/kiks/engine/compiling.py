"""How kernels are compiled: the same bits on every machine, and from the disk cache at the second start.

Need: `fastmath` would let the compiler reorder sums, and then the bits depend on the width of the processor's vectors.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

from kiks.ending import send_again_what_is_dropped
from kiks.engine.code_cache import CodeCache
from kiks.engine.processor import processor

# The first function that Numba is shown makes its compiler, which stays as it is.
processor()
# Numba and LLVM call back while they compile and load.
send_again_what_is_dropped()

LAST = "fill_table"
"""The function that `kiks warmup` compiles last: where it is, a start that was interrupted has not left others out."""

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": False, "nogil": True}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that only other kernels call."""
    return njit(**_OPTIONS)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function into each kernel that calls it.

    For pieces of a sensor's reading: called, they would cost a sixth of it more, as lanes then go by way of memory.
    """
    return njit(forceinline=True, **_OPTIONS)(function)


def spliced(function: Callable[..., Any]) -> Any:
    """Compile a function as a piece of the kernel that calls it, and never by itself.

    For large ones with one caller: what they call is then linked and compiled once, not again at each level.
    """
    return njit(inline="always", **_OPTIONS)(function)


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, and keep the machine code on disk."""
    dispatcher: Any = njit(**_OPTIONS)(function)
    dispatcher._cache = CodeCache(function)
    return dispatcher
