"""Numbers as people type them: lists and ranges, such as 9600,19200 and 0..40:5."""

from __future__ import annotations

import math

from kiks.errors import ParameterError, shown

NUMBERS_MAX = 1000
"""Most numbers of a list."""

STEPS_MAX = 10
"""Most steps of a range that names no step."""


def numbers_of(text: str, name: str, *, step: float | None = None) -> tuple[float, ...]:
    """Return the numbers of a list of numbers and ranges, rising, each once.

    Args:
        text: The list.
        name: What messages call it.
        step: The step of a range that names none; one that makes at most `STEPS_MAX` of it if left out.

    Example:
        >>> numbers_of("9600,19200", "--baud"), numbers_of("0..40", "--think"), numbers_of("0..1:0.25,2", "--think")
        ((9600, 19200), (0, 5, 10, 15, 20, 25, 30, 35, 40), (0, 0.25, 0.5, 0.75, 1, 2))
        >>> numbers_of("1..3, 7", "the seeds", step=1)
        (1, 2, 3, 7)
    """
    found: set[float] = set()
    for part in text.split(","):
        low, dots, rest = part.partition("..")
        high, colon, own_step = rest.partition(":")
        try:
            begin, end = _number(low), _number(high if dots else low)
            stride = _number(own_step) if colon else step or _step(end - begin)
            if not (0 <= begin <= end < math.inf and stride > 0):
                raise ValueError
        except ValueError:
            raise ParameterError(
                f"{name} must be numbers or rising ranges, but one was {shown(part)}. Examples: 0,10; 0..40; 0..40:5."
            ) from None
        if (end - begin) / stride >= NUMBERS_MAX or len(found) > NUMBERS_MAX:
            raise ParameterError(
                f"{name} must be at most {NUMBERS_MAX} numbers, but there were more. Take larger steps."
            )
        count = int((end - begin) / stride + 1e-9) + 1
        found |= {round(begin + k * stride, 9) for k in range(count)}
    return tuple(int(value) if isinstance(value, float) and value.is_integer() else value for value in sorted(found))


def seeds_in(text: str) -> list[int]:
    """Return the seeds of a list of whole numbers and ranges, rising, each once.

    Example:
        >>> seeds_in("1-3,7")
        [1, 2, 3, 7]
    """
    numbers = numbers_of(text.replace("-", ".."), "seeds", step=1)
    if not all(isinstance(number, int) for number in numbers):
        raise ParameterError(f"seeds must be whole numbers, but they were {shown(text)}. Examples: 1-10; 1,4,7.")
    return [int(number) for number in numbers]


def _number(word: str) -> float:
    """Return a number; a whole one keeps all its digits."""
    return int(word) if word.strip().isdigit() and len(word) <= 20 else float(word)


def _step(span: float) -> float:
    """Return the smallest step of 1, 2 or 5 times a power of ten that makes at most `STEPS_MAX` of a span."""
    if not 0 < span < math.inf:
        return 1
    power = 10.0 ** math.floor(math.log10(span / STEPS_MAX))
    return next(step for step in (power, 2 * power, 5 * power, 10 * power) if span / step <= STEPS_MAX + 1e-9)
