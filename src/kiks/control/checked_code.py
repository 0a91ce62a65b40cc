"""Compiles functions of users so that they cannot leave their arrays: each index is checked, in their helpers, too.

Need: Numba checks no index unless it is asked to. Then a slip writes into the arrays of another robot or world, no hash
is worth anything, and a far index ends Python. If it is asked to, the error says neither which line nor which array.
Method: what is raised without a place gets the line at work, and what an index raises gets the name of the array.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from types import ModuleType
from typing import Any

from kiks.engine.compiling import announce, callable_kernel

# isort: split
from numba.core import callconv, compiler, compiler_machinery, cpu, dispatcher, ir, lowering, typed_passes
from numba.core.untyped_passes import TranslateByteCode

# Numba annotates these in part, and not as they are used here.
_callconv: Any = callconv
_compiler: Any = compiler
_cpu: Any = cpu
_ir: Any = ir
_lowering: Any = lowering
_machinery: Any = compiler_machinery
_typed_passes: Any = typed_passes

TRUSTED = ("kiks", "numba")
"""Packages whose functions are compiled without checks."""


@functools.lru_cache(maxsize=1024)
def checked(function: Callable[..., Any]) -> Any:
    """Compile a function so that an index outside its array raises an `IndexError`, if it is a user's.

    The traceback's last entry is the line, and the error's arguments are the name of the array and the index, None
    where that is not a number in the source.
    """
    options = {} if is_trusted(function) else {"pipeline_class": _Checked, "boundscheck": True, "forceinline": True}
    return callable_kernel(function, **options)


class _CallConv(_callconv.CPUCallConv):  # type: ignore[misc, unused-ignore]
    """Raises errors as Numba does, with the line at work if they would have none."""

    def set_static_user_exc(
        self, builder: Any, exc: Any, exc_args: Any = None, loc: Any = None, func_name: str | None = None
    ) -> None:
        if loc is None:
            loc, func_name = self.context.line, self.context.function_name
            exc_args = self.context.access if exc is IndexError else exc_args
        super().set_static_user_exc(builder, exc, exc_args=exc_args, loc=loc, func_name=func_name)


class _Context(_cpu.CPUContext):  # type: ignore[misc, unused-ignore]
    """A target that knows which line is being lowered.

    Attributes:
        line: The line, as Numba knows it.
        access: The name of the array and the index in that line.
        function_name: The function.
    """

    line: Any = None
    access: tuple[str, int | None] = ("an array", None)
    function_name = ""

    @property
    def call_conv(self) -> Any:
        return _CallConv(self)


class _Lower(_lowering.Lower):  # type: ignore[misc, unused-ignore]
    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        # The context is this function's own copy.
        self.context.__class__ = _Context
        self.context.function_name = self.func_ir.func_id.func_name

    def lower_inst(self, inst: Any) -> None:
        self.context.line = inst.loc
        given = inst.value if isinstance(inst, _ir.Assign) else inst
        if isinstance(given, _ir.SetItem | _ir.StaticSetItem):
            self.context.access = self._array_name(given.target), self._constant_index(given.index)
        elif isinstance(given, _ir.Expr) and given.op in ("getitem", "static_getitem"):
            self.context.access = self._array_name(given.value), self._constant_index(given.index)
        super().lower_inst(inst)

    def _array_name(self, variable: Any) -> str:
        """Return the name of an array in the source: of an argument, of a variable, or of a field of one."""
        found = self._definition(variable)
        if isinstance(found, _ir.Arg):
            return str(found.name)
        if isinstance(found, _ir.Expr) and found.op == "getattr":
            return f"{self._array_name(found.value)}.{found.attr}"
        return "an array" if variable.name.startswith("$") else str(variable.unversioned_name)

    def _constant_index(self, index: Any) -> int | None:
        found = self._definition(index) if isinstance(index, _ir.Var) else index
        found = found.value if isinstance(found, _ir.Const) else found
        return found if type(found) is int else None

    def _definition(self, variable: Any) -> Any:
        try:
            return self.func_ir.get_definition(variable)
        except KeyError:  # it has several
            return None


@_machinery.register_pass(mutates_CFG=True, analysis_only=False)
class _CheckedLowering(_typed_passes.BaseNativeLowering):  # type: ignore[misc, unused-ignore]
    _name = "checked_lowering"

    @property
    def lowering_class(self) -> Any:
        return _Lower


@_machinery.register_pass(mutates_CFG=False, analysis_only=False)
class _CheckHelpers(_machinery.FunctionPass):  # type: ignore[misc, unused-ignore]
    """Replaces what users have compiled by themselves, and call by name, by the same, checked."""

    _name = "check_helpers"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        for block in state.func_ir.blocks.values():
            for assign in block.find_insts(_ir.Assign):
                value = self._global_value(state.func_ir, assign.value)
                if isinstance(value, dispatcher.Dispatcher) and not is_trusted(value.py_func):
                    assign.value = _ir.Global(value.py_func.__name__, checked(value.py_func), assign.loc)
        return True

    def _global_value(self, func_ir: Any, given: Any) -> Any:
        if isinstance(given, _ir.Global | _ir.FreeVar):
            return given.value
        if isinstance(given, _ir.Expr) and given.op == "getattr":
            owner = self._global_value(func_ir, func_ir.get_definition(given.value, lhs_only=False))
            return getattr(owner, given.attr, None) if isinstance(owner, ModuleType) else None
        return None


def is_trusted(function: Any) -> bool:
    """Return whether a function comes with KiKS or Numba, so that its indices have been tested."""
    return function.__module__.partition(".")[0] in TRUSTED


class _Checked(_compiler.CompilerBase):  # type: ignore[misc, unused-ignore]
    """Numba's passes, with those above."""

    def define_pipelines(self) -> list[Any]:
        passes = _compiler.DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_CheckHelpers, TranslateByteCode)
        plain, ours = _typed_passes.NativeLowering, _CheckedLowering
        passes.passes = [(ours if each is plain else each, why) for each, why in passes.passes]
        passes.finalize()
        return [passes]


announce(_Checked, "Compiling functions of yours: some seconds at each start ...")
