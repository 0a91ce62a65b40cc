"""Functions that say by their annotations what their arguments must be: all controllers and measures with arguments.

A declaration stands once: the call checks by it, and so does a file that names the function and its arguments.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, Literal, ParamSpec, TypeVar, cast, get_type_hints

from kiks.meant import nearest
from kiks.model.data_file import record

_Arguments = ParamSpec("_Arguments")
_Made = TypeVar("_Made")


def record_of(function: Callable[..., Any], **constants: Any) -> Any:
    """Return the record (`kiks.model.data_file`) of a function's arguments, which has its name.

    Args:
        function: The function.
        constants: Further fields that stand first, each with its only value.
    """
    hints: dict[str, Any] = {name: Literal[value] for name, value in constants.items()}
    hints |= get_type_hints(function, include_extras=True)
    del hints["return"]
    given = inspect.signature(function).parameters.values()
    defaults = constants | {each.name: each.default for each in given if each.default is not each.empty}
    described = f"Arguments of `{function.__module__}.{function.__name__}`."
    return record(type(function.__name__, (), {"__doc__": described, "__annotations__": hints, **defaults}))


def made_once(function: Callable[_Arguments, _Made]) -> Callable[_Arguments, _Made]:
    """Check the arguments of a function by its annotations, and return the same object for the same ones."""
    make = cast(Callable[..., _Made], function)
    return checked_call(function, record_of(function), lru_cache(maxsize=256)(lambda given: make(**vars(given))))


def checked_call(
    function: Callable[_Arguments, Any], arguments: Any, make: Callable[[Any], _Made]
) -> Callable[_Arguments, _Made]:
    """Return a function with the signature of another that makes an object of the record of its arguments."""
    signature = inspect.signature(function)

    @wraps(function)
    def call(*args: _Arguments.args, **named: _Arguments.kwargs) -> _Made:
        try:
            given = signature.bind(*args, **named).arguments
        except TypeError as error:
            hint = "".join(nearest(name, signature.parameters) for name in named if name not in signature.parameters)
            raise TypeError(f"{function.__name__}() {error}.{hint}") from None
        return make(arguments(**given))

    return call
