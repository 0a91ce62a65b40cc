"""Compiled functions of the user: the common base of controllers and measures."""

from __future__ import annotations

import functools
import inspect
import linecache
import pickle
import re
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from traceback import FrameSummary
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar, overload

from kiks.control.checked_code import checked, is_trusted
from kiks.engine import compiling

# isort: split
from numba import cloudpickle, extending, types

from kiks.errors import KiksError, ParameterError, counted, shown

# Numba annotates these in part, and not as they are used.
_intrinsic: Any = extending.intrinsic
_types: Any = types

_Options = ParamSpec("_Options")
_Made = TypeVar("_Made", covariant=True)

RETURNS = "it returns something, where it must write into its arguments and return nothing."
"""What is wrong with a function that returns its values."""


@functools.lru_cache(maxsize=256)
def _unpickled(kind: type[Compiled], parts: bytes) -> Compiled:
    """Return a compiled function: the same for the same bytes, so that a process compiles it once."""
    made = kind.__new__(kind)
    vars(made).update(pickle.loads(parts))
    made.kernel = checked(made.function)
    return made


class Compiled:
    """A plain Python function that Numba compiles when it is first needed.

    Args:
        function: The function.

    Attributes:
        what: Its name in messages, and that of its decorator.
        arguments: Names of the arguments that it is called with.
        options: The arrays among them whose sizes its decorator takes.
        function: The function as it was written.
        name: Its name.
        kernel: The same, compiled; other kernels call it.
    """

    what: str
    arguments: tuple[str, ...]
    options: tuple[str, ...]

    def __init__(self, function: Callable[..., Any]) -> None:
        wanted = f"{self.what}({', '.join(self.arguments)})"
        if not inspect.isfunction(function):
            raise ParameterError(
                f"a {self.what} must be a function {wanted}, but it was {shown(function)}. Define one with def."
            )
        count = len(inspect.signature(function).parameters)
        if count != len(self.arguments):
            raise ParameterError(
                f"a {self.what} must be a function {wanted}, but {function.__name__} takes {count} arguments. "
                f"Let it take these {len(self.arguments)}."
            )
        functools.update_wrapper(self, function, updated=())  # type: ignore[arg-type]  # for `help` and the reference
        self.function = function
        self.name = function.__name__
        self.kernel = checked(function)

    def __deepcopy__(self, memo: dict[int, Any]) -> Compiled:
        return self  # as it never changes

    def __reduce__(self) -> tuple[Any, ...]:
        # Machine code, and where it lies, are of this process.
        parts = {name: part for name, part in vars(self).items() if name not in ("kernel", "address")}
        # By value, as another process may not have the user's file.
        dumps: Any = cloudpickle.dumps
        return _unpickled, (type(self), dumps(parts))

    @property
    def sizes(self) -> dict[str, int | None]:
        """How many numbers each array has that it is called with; None if any number will do."""
        return {}

    def refused(self, error: Exception) -> ParameterError:
        """Return the message if Numba cannot compile it."""
        reasons = [line.strip() for line in str(error).splitlines() if line.strip()]
        reason = next((line for line in reasons if "Failed in" not in line), type(error).__name__)
        path = self._code.co_filename
        named = re.search(re.escape(Path(path).name) + r'(?:", line | \()(\d+)', str(error))
        place = _place(path, int(named[1]) if named else self._code.co_firstlineno)
        return ParameterError(
            f"the {self.what} {self.name!r} must be Python that Numba compiles (numbers, arrays, loops, math), but "
            f"{place}: {reason} Simplify what it names there."
        )

    def check(self, argument_types: tuple[Any, ...]) -> Any:
        """Compile it for arguments of these types; return what Numba knows of the result."""
        try:
            return compiled_for(self.kernel, argument_types)
        except Exception as error:
            raise self.refused(error) from None

    def failed(self, error: Exception, place: FrameSummary) -> ParameterError:
        """Return the message if the compiled function has raised an error at a place in its source or a helper's."""
        subject, where = f"the {self.what} {self.name!r}", _place(place.filename, place.lineno)
        if not isinstance(error, IndexError) or len(error.args) != 2:
            # Numba's own functions raise without the place that has called them.
            at = "" if place.name == "impl" else f" {where}:"
            return ParameterError(f"{subject} must not fail, but{at} {type(error).__name__}: {error}")
        given, index = error.args
        own = {**dict(zip(self._code.co_varnames, self.arguments, strict=False)), "moment.sensors": "sensors"}
        array = own.get(given, "") if place.name == self._code.co_name else ""
        size = self.sizes.get(array)
        if array in self.options:
            advice = f"Write @kiks.{self.what}({array}={'...' if index is None or index < 0 else index + 1})."
        else:
            advice = "Use an index that it has."
        has = "" if size is None else f", which has {counted(size, 'number')}"
        return ParameterError(f"{subject} must stay within its arrays, but {where} leaves {given}{has}. {advice}")

    @property
    def _code(self) -> Any:
        return self.function.__code__


class Decorator(Protocol[_Options, _Made]):
    """Makes an object of a function; with options alone it returns what does."""

    @overload
    def __call__(self, *args: _Options.args, **options: _Options.kwargs) -> Callable[[Callable[..., Any]], _Made]: ...
    @overload
    def __call__(self, function: Callable[..., Any], /) -> _Made: ...


def decorator(kind: Callable[Concatenate[Callable[..., Any], _Options], _Made]) -> Decorator[_Options, _Made]:
    """Return a decorator, with or without options, that makes objects of a class."""

    @functools.wraps(kind)
    def decorate(*function: Any, **options: Any) -> Any:
        return kind(*function, **options) if function else functools.partial(kind, **options)

    return decorate


def explained(error: Exception, functions: Iterable[Compiled]) -> Exception:
    """Return the message for an error that one of some functions has raised; the error itself if none has."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    users = [each for each in functions if not is_trusted(each.function)]
    own = [each for each in users if (each._code.co_filename, each._code.co_name) == (place.filename, place.name)]
    found = own or users
    if not found or isinstance(error, KiksError):
        return error
    return found[0].refused(error) if type(error).__module__.startswith("numba.") else found[0].failed(error, place)


def _place(path: str, line: int | None) -> str:
    """Return a line for a message: where it is, and what it says."""
    source = linecache.getline(path, line or 0).strip()
    return f"line {line} of {Path(path).name}" + (f" ({shown(source)[1:-1]})" if source else "")


def compiled_for(function: Any, argument_types: tuple[Any, ...]) -> Any:
    """Compile a function without a return value for arguments of these types; return what Numba knows of the result.

    Raises:
        Exception: If it cannot be compiled, or returns something: Numba raises of many kinds.
    """
    result = compiling.compiled_for(function, argument_types)
    if result.signature.return_type != types.none:
        raise TypeError(RETURNS)
    return result


def caller_of(argument_types: tuple[Any, ...]) -> Any:
    """Return a function `(address, arguments)` with which kernels call what is compiled for these types."""

    @_intrinsic
    def call(typing: Any, address: Any, arguments: Any) -> Any:
        assert tuple(arguments) == argument_types, f"arguments must have the types {argument_types}, not {arguments}"

        def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
            function_type = context.call_conv.get_function_type(types.none, argument_types).as_pointer()
            function = builder.inttoptr(values[0], function_type)
            given = [builder.extract_value(values[1], k) for k in range(len(argument_types))]
            return compiling.call_at(function, types.none(*argument_types), context, builder, given)

        return types.none(types.int64, arguments), generate

    return call
