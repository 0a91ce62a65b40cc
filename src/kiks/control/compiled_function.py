"""Compiled functions of the user: the common base of controllers and measures."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from kiks.engine.compiling import callable_kernel

# isort: split
from numba import extending, types
from numba.core import errors

from kiks.errors import ParameterError, shown

# Numba annotates these in part, and not as they are used.
_intrinsic: Any = extending.intrinsic
_types: Any = types


class Compiled:
    """A plain Python function that Numba compiles when it is first needed.

    Args:
        function: The function.
        what: Its name in messages.
        arguments: Names of the arguments that it is called with.

    Attributes:
        function: The function as it was written.
        name: Its name.
        kernel: The same, compiled; other kernels call it.

    Raises:
        ParameterError: If it is no function of so many arguments.
    """

    def __init__(self, function: Callable[..., Any], *, what: str, arguments: tuple[str, ...]) -> None:
        wanted = f"{what}({', '.join(arguments)})"
        if not inspect.isfunction(function):
            raise ParameterError(
                f"a {what} must be a function {wanted}, but it was {shown(function)}. Define one with def."
            )
        count = len(inspect.signature(function).parameters)
        if count != len(arguments):
            raise ParameterError(
                f"a {what} must be a function {wanted}, but {function.__name__} takes {count} arguments. "
                f"Let it take these {len(arguments)}."
            )
        self.function = function
        self.name = function.__name__
        self._what = what
        self.kernel = callable_kernel(function)

    def refused(self, error: Exception) -> ParameterError:
        """Return the message if Numba cannot compile it."""
        reasons = [line.strip() for line in str(error).splitlines() if line.strip()]
        reason = next((line for line in reasons if "Failed in" not in line), type(error).__name__)
        return ParameterError(
            f"the {self._what} {self.name!r} must be Python that Numba compiles (numbers, arrays, loops, math), but: "
            f"{reason} Simplify what it names there."
        )


def address_of(function: Any, argument_types: tuple[Any, ...]) -> int:
    """Return the address of a kernel without a return value, for `caller_of`; valid while the kernel lives.

    Raises:
        numba.core.errors.NumbaError: If it cannot be compiled for these types, or returns something.
    """
    result = function.get_compile_result(_types.void(*argument_types))
    if result.signature.return_type != types.none:
        raise errors.TypingError("it returns something, where it must write into its arguments and return nothing.")
    return int(result.library.get_pointer_to_function(result.fndesc.llvm_func_name))


def caller_of(argument_types: tuple[Any, ...]) -> Any:
    """Return a function `(address, arguments)` with which kernels call what `address_of` has for these types."""

    @_intrinsic
    def call(typing: Any, address: Any, arguments: Any) -> Any:
        assert tuple(arguments) == argument_types, f"arguments must have the types {argument_types}, not {arguments}"

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            convention = context.call_conv
            function_type = convention.get_function_type(types.none, argument_types).as_pointer()
            function = builder.inttoptr(values[0], function_type)
            given = [builder.extract_value(values[1], k) for k in range(len(argument_types))]
            status, _ = convention.call_function(builder, function, types.none, argument_types, given)
            with builder.if_then(status.is_error, likely=False):
                convention.return_status_propagate(builder, status)
            return context.get_dummy_value()

        return types.none(types.int64, arguments), generate

    return call
