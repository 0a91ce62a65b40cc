"""What a caller gives: each number has a range, each object a type, and one line says so where it is another.

All that enters the engine from Python passes one of these checks, so no kernel needs to ask. `name` is what messages
call the value, and `advice` what they say at the end.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from numbers import Integral, Real
from typing import TypeVar

from kiks.errors import ParameterError, figure, shown
from kiks.meant import nearest

ROBOTS_MAX = 1000
"""Most robots of a world."""

SECONDS_MAX = 1e9
"""Longest time that may pass at once [s]: a clock of 64 bits counts nine of them in nanoseconds."""

CLOCK_END_NS = 4 * 10**18
"""Last time that a clock may be told to reach [ns]; four times `SECONDS_MAX`, and less than its 64 bits hold."""

HEADING_KEPT_RAD = 1e6
"""Headings up to this are not wrapped: their sines are exact (`kiks.engine.numbers`), and turns can be counted."""


def check_number(
    name: str, number: object, least: float = -math.inf, most: float = math.inf, advice: str = ""
) -> float:
    """Return a finite number as a float."""
    is_number = isinstance(number, int | float | Real) and not isinstance(number, bool)
    if is_number:
        try:
            value = float(number)  # type: ignore[arg-type] # mypy forgets what is_number says
        except OverflowError:  # a whole number of more than 308 digits
            value = math.inf
        if math.isfinite(value) and least <= value <= most:
            return value
    rule = "a finite number" if math.isinf(most) else f"from {figure(least)} to {figure(most)}"
    if math.isinf(most) and math.isfinite(least):
        rule += f" of at least {figure(least)}"
    if not is_number and math.isfinite(most):
        rule, advice = f"a number {rule}", ""
    raise ParameterError(f"{name} must be {rule}, but it was {shown(number)}.{advice and ' ' + advice}")


def check_count(name: str, count: object, least: int = 0, most: int = 1_000_000, advice: str = "") -> int:
    """Return a whole number as an int."""
    if isinstance(count, int | Integral) and not isinstance(count, bool) and least <= (whole := int(count)) <= most:
        return whole
    raise ParameterError(
        f"{name} must be a whole number from {least} to {most}, but it was {shown(count)}.{advice and ' ' + advice}"
    )


_Kind = TypeVar("_Kind")


def check_kind(name: str, value: object, kind: type[_Kind], advice: str = "") -> _Kind:
    """Return a value of a type."""
    if isinstance(value, kind):
        return value
    wanted = _KINDS.get(kind, f"a {kind.__module__.partition('.')[0]}.{kind.__name__}")
    raise ParameterError(f"{name} must be {wanted}, but it was {shown(value)}.{advice and ' ' + advice}")


def check_choice(name: str, value: object, choices: Collection[str], rule: str = "", advice: str = "") -> None:
    """Check that a value is one of some names; `rule` says so where messages do not just list them."""
    if not isinstance(value, str) or value not in choices:
        rule = rule or f"one of {', '.join(map(repr, choices))}"
        hint = f"{nearest(value, choices)}{advice and ' ' + advice}"
        raise ParameterError(f"{name} must be {rule}, but it was {shown(value)}.{hint}")


_KINDS: dict[type, str] = {str: "a text", bytes: "bytes", bool: "True or False"}


DEGREES_FROM = 10
"""From here on a heading without other digits than .5 is taken for one in degrees."""


def check_heading(name: str, heading_rad: object) -> float:
    """Return a heading [rad], wrapped to one turn if it is beyond `HEADING_KEPT_RAD`.

    A multiple of 0.5 from 10 on is a slip: a heading in degrees. A program that counts turns never meets one.
    """
    value = check_number(name, heading_rad)
    if DEGREES_FROM <= abs(value) <= HEADING_KEPT_RAD and value % 0.5 == 0:
        raise ParameterError(
            f"{name} must be in radians, but it was {shown(heading_rad)}: {value:g} degrees are "
            f"math.radians({value:g}). For radians beyond one turn write {value:g} % math.tau."
        )
    return wrapped(value)


def wrapped(heading_rad: float) -> float:
    """Return a finite heading [rad], wrapped to one turn if it is beyond `HEADING_KEPT_RAD`."""
    return heading_rad if abs(heading_rad) <= HEADING_KEPT_RAD else math.remainder(heading_rad, 2 * math.pi)
