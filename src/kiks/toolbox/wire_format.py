r"""What the toolbox and the simulator say to each other, word by word; `framing.py` has how it gets there.

A request is a name and words. The answer is `+` or `-`, the number of the port that was asked and its time in 19
characters, and what was asked for or why not. Texts of several lines are one line with `\n`, `\r` and `\\`; matrices
are run lengths down their columns, as MATLAB keeps them: most of an arena is floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, shown

NUMBER_MAX = 1e9
"""Largest number of a request: no place, angle, speed or time needs a larger one."""

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
    """Return as many numbers as words must be: `NaN` where none is given, and none beyond `NUMBER_MAX`.

    Raises:
        ParameterError: If they are others.
    """
    try:
        numbers = [float(word) for word in words] if len(words) == count else []
    except ValueError:
        numbers = []
    if len(numbers) != count or any(abs(number) > NUMBER_MAX for number in numbers):
        raise ParameterError(
            f"{what} must be {count} finite numbers from -{NUMBER_MAX:g} to {NUMBER_MAX:g}, but "
            f"{shown(' '.join(words[:9]))} was given."
        )
    return numbers


def matrix_text(matrix: NDArray[Any]) -> str:
    """Return a matrix as rows, columns and run lengths.

    Example:
        >>> matrix_text(np.array([[0, 1], [0, 1]]))
        '2 2 2 0 2 1'
    """
    values = matrix.ravel(order="F")
    is_first = np.ones(len(values), np.bool_)
    is_first[1:] = values[1:] != values[:-1]
    firsts = np.flatnonzero(is_first)
    counts = np.diff(np.append(firsts, len(values)))
    runs = zip(counts.tolist(), values[firsts].tolist(), strict=True)
    return " ".join(
        [f"{matrix.shape[0]} {matrix.shape[1]}", *(f"{count} {number_text(value)}" for count, value in runs)]
    )


def matrices_of(text: str) -> list[NDArray[Any]]:
    """Return the matrices of a text, one or two, each of as small a type as holds it.

    Raises:
        ParameterError: If there are others than matrices in it.

    Example:
        >>> [matrix.tolist() for matrix in matrices_of("2 2 2 0 2 1 1 1 1 -7.5")]
        [[[0, 1], [0, 1]], [[-7.5]]]
    """
    numbers = _all_numbers(text)
    matrices: list[NDArray[Any]] = []
    while len(numbers):
        matrix, numbers = _take_matrix(numbers)
        if matrix is None or len(matrices) == 2:
            matrices.clear()
            break
        matrices.append(matrix)
    if not matrices:
        raise ParameterError(
            "a matrix must be rows, columns and run lengths that fill it, of finite numbers, at most "
            f"{CELLS_MAX} elements, and one more may follow, but {shown(text)} was given."
        )
    return matrices


def _take_matrix(numbers: NDArray[np.float64]) -> tuple[NDArray[Any] | None, NDArray[np.float64]]:
    """Return the matrix with which numbers begin, and the numbers behind it; None if there is none."""
    sizes, values = numbers[:2], numbers[3::2]
    if len(sizes) < 2 or not _are_whole(sizes, 0) or sizes.prod() > CELLS_MAX:
        return None, numbers
    ends = np.cumsum(numbers[2::2][: len(values)])
    count = int(np.argmax(ends == sizes.prod())) + 1 if len(ends) and sizes.prod() else 0
    counts = numbers[2 : 2 + 2 * count : 2]
    if counts.sum() != sizes.prod() or not _are_whole(counts, 1):
        return None, numbers
    # All of it has been looked at by now: only here is memory asked for.
    filled = np.repeat(_narrowed(values[:count]), counts.astype(np.int64))
    rows, columns = sizes.astype(np.int64).tolist()
    return filled.reshape((rows, columns), order="F"), numbers[2 + 2 * count :]


def _are_whole(numbers: NDArray[np.float64], low: int) -> bool:
    return bool(((numbers >= low) & (numbers % 1 == 0)).all())


def _all_numbers(text: str) -> NDArray[np.float64]:
    """Return the numbers of a text, with one blank between two; none if there is anything else, or too large a one."""
    try:
        numbers = np.fromstring(text if text.isascii() else "", np.float64, sep=" ")
    except (ValueError, DeprecationWarning):
        numbers = np.empty(0)
    is_good = len(numbers) == text.count(" ") + 1 and bool((np.abs(numbers) <= NUMBER_MAX).all())
    return numbers if is_good else np.empty(0)


def _narrowed(values: NDArray[np.float64]) -> NDArray[Any]:
    small = values.astype(np.int16, casting="unsafe") if (np.abs(values) < 1 << 15).all() else values
    return small if (small == values).all() else values
