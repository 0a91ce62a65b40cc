r"""What the toolbox and the simulator say to each other, word by word; `exchange.py` has how it gets there.

A request is a name and words. The answer is `+` or `-`, the number of the port that was asked and its time in 19
characters, and what was asked for or why not. Texts of several lines are one line with `\n`, `\r` and `\\`; matrices are
run lengths down their columns, as MATLAB keeps them: most of an arena is floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError

CELLS_MAX = 64_000_000
"""Most elements of a matrix."""


def escape(text: str) -> str:
    r"""Return a text as a part of a line.

    Example:
        >>> escape("a\nb") == r"a\nb" and unescape(escape("\\n\r\n")) == "\\n\r\n"
        True
    """
    return text.replace("\\", "\\\\").replace("\n", "\\n").replace("\r", "\\r")


def unescape(text: str) -> str:
    """Undo `escape`."""
    parts = [part.replace("\\n", "\n").replace("\\r", "\r") for part in text.split("\\\\")]
    return "\\".join(parts)


def number_text(value: float) -> str:
    """Return a number as both sides write it: `NaN` for none, and every digit that it has."""
    return "NaN" if math.isnan(value) else f"{value:.15g}"


def numbers_text(values: Iterable[float]) -> str:
    """Return numbers with blanks between them."""
    return " ".join(map(number_text, values))


def numbers_of(words: Sequence[str], count: int, what: str) -> list[float]:
    """Return as many numbers as words must be.

    Raises:
        ParameterError: If they are others.
    """
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count or any(math.isinf(number) for number in numbers):
        raise ParameterError(f"{what} must be {count} finite numbers, but {' '.join(words)!r} was given.")
    return numbers


def matrix_text(matrix: NDArray[Any]) -> str:
    """Return a matrix as rows, columns and run lengths.

    Example:
        >>> matrix_text(np.array([[0, 1], [0, 1]]))
        '2 2 2 0 2 1'
    """
    values = np.asarray(matrix, np.float64).ravel(order="F")
    firsts = np.flatnonzero(np.diff(values, prepend=np.nan) != 0)
    counts = np.diff(np.append(firsts, len(values)))
    runs = (f"{count} {number_text(value)}" for count, value in zip(counts.tolist(), values[firsts], strict=True))
    return " ".join([f"{matrix.shape[0]} {matrix.shape[1]}", *runs])


def take_matrix(words: Sequence[str]) -> tuple[NDArray[np.float64], list[str]]:
    """Return the matrix that words begin with, and the words behind it.

    Raises:
        ParameterError: If there is none.
    """
    try:
        rows, columns = int(words[0]), int(words[1])
        if not (rows >= 0 and columns >= 0 and rows * columns <= CELLS_MAX):
            raise ValueError
        left, place, counts, values = rows * columns, 2, [], []
        while left > 0:
            counts.append(int(words[place]))
            values.append(float(words[place + 1]))
            left -= counts[-1]
            place += 2
            if counts[-1] < 1:
                raise ValueError
        if left:
            raise ValueError
    except (ValueError, IndexError):
        raise ParameterError(
            f"a matrix must be rows, columns and run lengths that fill it, at most {CELLS_MAX} elements, but "
            f"{' '.join(words[:9])!r}... was given."
        ) from None
    filled = np.repeat(np.array(values, np.float64), counts).reshape((rows, columns), order="F")
    return filled, list(words[place:])
