"""How kernels are compiled: the same bits on every machine, and from the disk cache at the second start.

Need: `fastmath` would let the compiler reorder sums, and then the bits depend on the width of the processor's vectors.
Method: entries and linked kernels get machine code, which contains all the other kernels that they call. Those are kept
as LLVM's code, and optimized where they end up: passes and machine code of their own would take half of a first start.
A linked kernel is called at an address that stands in a cell, so neither it nor its callers are compiled again when the
other changes, and it is compiled once for all its callers. They only know the cell's name.
"""

from __future__ import annotations

import ctypes
import gc
import hashlib
import inspect
from collections.abc import Callable
from typing import Any

from llvmlite import binding, ir
from numba import extending, njit
from numba.core import cgutils, codegen, compiler
from numba.core.event import TimingListener, register

from kiks.ending import send_again_what_is_dropped
from kiks.engine.code_cache import CodeCache, at_load, tell
from kiks.engine.processor import processor

# The first function that Numba is shown makes its compiler, which stays as it is.
processor()
# Numba and LLVM call back while they compile and load.
send_again_what_is_dropped()

LAST = "fill_table"
"""The function that `kiks warmup` compiles last: where it is, a start that was interrupted has not left others out."""

# Numba annotates these in part, and not as they are used here.
_njit: Any = njit
_intrinsic: Any = extending.intrinsic
_Library: Any = codegen.JITCodeLibrary
_Pipeline: Any = compiler.Compiler
_Listener: Any = TimingListener
_register: Any = register
_is_null: Any = cgutils.is_null


class _Whole(_Library):  # type: ignore[misc, unused-ignore]
    """The code of a function with all that it calls."""

    def _optimize_final_module(self) -> None:
        super()._optimize_final_module()
        # What was inlined can be optimized further: batches are a tenth faster.
        super()._optimize_final_module()


class _WholePipeline(_Pipeline):  # type: ignore[misc, unused-ignore]
    def define_pipelines(self) -> Any:
        """Return Numba's passes."""
        self.state.library = _Whole(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return super().define_pipelines()


class _QuickPipeline(_WholePipeline):
    """That of functions which take a second at most, so that nothing is said of it."""


class _Part(_Library):  # type: ignore[misc, unused-ignore]
    """The code of a kernel, neither optimized nor machine code: that is made of what the kernel is linked into."""

    def _optimize_final_module(self) -> None:
        pass

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


class _Compiling(_Listener):  # type: ignore[misc, unused-ignore]
    """Notices when something is compiled: says so, once, measures it, and lets no garbage be looked for meanwhile.

    The compiler makes some million objects, which live long: to look through them takes an eighth of its time.
    """

    had_garbage_collected = False

    def on_start(self, event: Any) -> None:
        """Begin."""
        is_first = not self._depth
        super().on_start(event)
        if is_first:
            if line := _LINES.get(event.data["dispatcher"]._compiler.pipeline_class):
                tell(line)
            self.had_garbage_collected = gc.isenabled()
            gc.disable()

    def on_end(self, event: Any) -> None:
        """End; Numba calls it whatever has happened."""
        if self._depth:  # a signal may have come before the beginning
            super().on_end(event)
        if not self._depth and self.had_garbage_collected:
            gc.enable()


# The lock of Numba's compiler lets one thread in, and that one waits until what it compiles within is done.
_compiling = _Compiling()
_register("numba:compile", _compiling)

_LINES = {_WholePipeline: "Compiling the engine for this computer: once, half a minute or so ..."}


def compiling_s() -> float:
    """Return how long this process has been compiling [s]: no measured speed counts that."""
    return float(_compiling.duration) if _compiling.done else 0.0


def announce(pipeline_class: Any, line: str) -> None:
    """Say a line, once, when a function with a pipeline of Numba's is compiled."""
    _LINES[pipeline_class] = line


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


def entry(function: Callable[..., Any], **options: Any) -> Any:
    """Compile a function that Python calls, and keep the machine code on disk; with more options of Numba's."""
    options = {"pipeline_class": _WholePipeline, "no_cfunc_wrapper": True, **_OPTIONS, **options}
    dispatcher: Any = _njit(**options)(function)
    dispatcher._cache = CodeCache(function)
    return dispatcher


def quick_entry(function: Callable[..., Any]) -> Any:
    """Compile an entry that also those call who need nothing else of the engine: without a word, as it is quick."""
    return entry(function, pipeline_class=_QuickPipeline)


def linked(signature: Any, *, part: str = "", _nrt: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Compile a kernel that other kernels call to machine code of its own, and keep that on disk.

    For large kernels: a call costs as much as passing all its arguments, and nothing is optimized across it.

    Args:
        signature: Types of its arguments and of what it returns, as Numba writes them.
        part: Of what it is a part that not every run needs: then callers do not make it ready, `make_ready` does.
        _nrt: Whether it allocates memory.
    """

    def make(function: Callable[..., Any]) -> Any:
        dispatcher = entry(function, no_cpython_wrapper=True, _nrt=_nrt)
        cell, types = ctypes.c_void_p(), tuple(signature.args)
        # The types are part of the name: code of callers that take it for another is of no use.
        digest = hashlib.sha256(str(signature).encode()).hexdigest()[:16]
        name = f"{function.__module__}.{function.__qualname__}.{digest}"
        binding.add_symbol(name, ctypes.addressof(cell))

        def ready() -> None:
            if not cell.value:
                cell.value = address_of(compiled_for(dispatcher, types))

        def call(typing: Any, *given: Any) -> Any:
            assert given == types, f"{name} takes {types}, not {given}"
            if not part:
                ready()

            def generate(context: Any, builder: Any, _: Any, values: Any) -> Any:
                kind = context.call_conv.get_function_type(signature.return_type, types).as_pointer()
                address = builder.load(
                    builder.module.globals.get(name) or ir.GlobalVariable(builder.module, kind, name)
                )
                with builder.if_then(_is_null(builder, address), likely=False):
                    context.call_conv.return_user_exc(builder, RuntimeError, (f"{name} is not ready",))
                return call_at(address, signature, context, builder, values)

            return signature, generate

        if part:
            _PARTS.setdefault(part, []).append(ready)
        at_load(name, ready if not part else lambda: None)
        # Numba counts the parameters.
        names = ["typing", *inspect.signature(function).parameters]
        called: Any = call
        called.__signature__ = inspect.Signature([inspect.Parameter(name, _POSITIONAL) for name in names])
        called = _intrinsic(called)
        called.compile = dispatcher.compile
        return called

    return make


_POSITIONAL = inspect.Parameter.POSITIONAL_OR_KEYWORD
_PARTS: dict[str, list[Callable[[], None]]] = {}


def make_ready(part: str) -> None:
    """Compile, or load, the linked kernels of a part that not every run needs."""
    for ready in _PARTS.get(part, ()):
        ready()


def compiled_for(function: Any, argument_types: tuple[Any, ...]) -> Any:
    """Compile a function for arguments of these types; return what Numba knows of the result."""
    function.compile(argument_types)
    return function.overloads[argument_types]


def address_of(result: Any) -> int:
    """Return the address of what `compiled_for` has compiled, for `call_at`; valid while the function lives."""
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def call_at(address: Any, signature: Any, context: Any, builder: Any, values: Any) -> Any:
    """Write the call of a compiled function at an address, within an intrinsic; return its result."""
    convention, (result, types) = context.call_conv, (signature.return_type, signature.args)
    status, value = convention.call_function(builder, address, result, types, values)
    with builder.if_then(status.is_error, likely=False):
        convention.return_status_propagate(builder, status)
    return value
