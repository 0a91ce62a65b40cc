"""How kernels are compiled: the same bits on every machine, and from the disk cache at the second start.

Need: `fastmath` would let the compiler reorder sums, and then the bits depend on the width of the processor's vectors.
Method: only entries get machine code, for they contain all that they call. What Numba would make of each other kernel
besides takes a quarter of the time of a first start.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit
from numba.core import codegen, compiler

from kiks.ending import send_again_what_is_dropped
from kiks.engine.code_cache import CodeCache
from kiks.engine.processor import processor

# The first function that Numba is shown makes its compiler, which stays as it is.
processor()
# Numba and LLVM call back while they compile and load.
send_again_what_is_dropped()

LAST = "fill_table"
"""The function that `kiks warmup` compiles last: where it is, a start that was interrupted has not left others out."""

# Numba annotates these in part, and not as they are used here.
_njit: Any = njit
_Library: Any = codegen.JITCodeLibrary
_Pipeline: Any = compiler.Compiler


class _Part(_Library):  # type: ignore[misc, unused-ignore]
    """The code of a kernel, without machine code: that is made of what the kernel is linked into."""

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _PartPipeline(_Pipeline):  # type: ignore[misc, unused-ignore]
    def define_pipelines(self) -> Any:
        """Return Numba's passes; the last one shall only keep the code."""
        state = self.state
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        # Numba knows each function by what Python would call: this is one that raises.
        refusal = f"{{{state.func_id.func_name} is for kernels}}".format
        state.targetctx.get_executable = lambda library, description, environment: refusal
        return super().define_pipelines()


_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": False, "nogil": True, "_nrt": True}
_PART: dict[str, Any] = _OPTIONS | {
    "pipeline_class": _PartPipeline,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
_UNCOUNTED: dict[str, Any] = _PART | {"_nrt": False}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function that only other kernels call.

    It counts no references to arrays, which would take a sixth of a batch's time: entries keep arrays alive while
    kernels work. So it allocates no memory, and returns arrays to other kernels of this sort only.
    """
    return _njit(**_UNCOUNTED)(function)


def allocating(function: Callable[..., Any]) -> Any:
    """Compile a kernel that allocates memory, or calls a kernel that returns some."""
    return _njit(**_PART)(function)


def callable_kernel(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function that is called by Python or at its address as well; with more options of Numba's."""
    return _njit(**_OPTIONS | options)(function)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function into each kernel that calls it.

    For pieces of a sensor's reading: called, they would cost a sixth of it more, as lanes then go by way of memory.
    """
    return _njit(forceinline=True, **_UNCOUNTED)(function)


def spliced(function: Callable[..., Any]) -> Any:
    """Compile a function as a piece of the kernel that calls it, and never by itself.

    For large ones with one caller: what they call is then linked and compiled once, not again at each level.
    """
    return _njit(inline="always", **_OPTIONS)(function)


def entry(function: Callable[..., Any]) -> Any:
    """Compile a function that Python calls, and keep the machine code on disk."""
    dispatcher: Any = _njit(no_cfunc_wrapper=True, **_OPTIONS)(function)
    dispatcher._cache = CodeCache(function)
    return dispatcher
