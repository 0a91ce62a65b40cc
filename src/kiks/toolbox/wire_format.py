r"""Text format of requests and answers; `framing.py` transports them.

A request is a name and words. The answer is `+` or `-`, the number of the port and its time in 19 characters, and the
result or an error message; or `?` and an order for a turret that the program itself must carry out; or `!` and a typed
command, without a time. Texts have the escape sequences `\n`, `\r` and `\\`. Matrices are run lengths in column-major
order, as MATLAB stores them: most of an arena is floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, shown

NUMBER_MAX = 1e9
"""Largest number in a request."""

CELLS_MAX = 64_000_000
"""Maximum number of elements of a matrix."""


def escape(text: str) -> str:
    r"""Escape backslashes and line ends.

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
    """Return a number with 15 significant digits, or `NaN`."""
    return "NaN" if math.isnan(value) else f"{value:.15g}"


def numbers_text(values: Iterable[float]) -> str:
    """Return numbers separated by blanks."""
    return " ".join(map(number_text, values))


def parse_numbers(words: Sequence[str], count: int, what: str) -> list[float]:
    """Convert words to numbers; `NaN` stands for a value that is not given."""
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
    """Return the number of rows, that of columns, and the run lengths of a matrix.

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


def parse_matrices(text: str) -> list[NDArray[Any]]:
    """Return the one or two matrices of a text, each of int16 or float64.

    Example:
        >>> [matrix.tolist() for matrix in parse_matrices("2 2 2 0 2 1 1 1 1 -7.5")]
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
    """Return the first matrix, None if it is not valid, and the numbers after it."""
    sizes, values = numbers[:2], numbers[3::2]
    if len(sizes) < 2 or not _are_whole(sizes, 0) or sizes.prod() > CELLS_MAX:
        return None, numbers
    ends = np.cumsum(numbers[2::2][: len(values)])
    count = int(np.argmax(ends == sizes.prod())) + 1 if len(ends) and sizes.prod() else 0
    counts = numbers[2 : 2 + 2 * count : 2]
    if counts.sum() != sizes.prod() or not _are_whole(counts, 1):
        return None, numbers
    # Allocate memory only after all checks.
    filled = np.repeat(_narrowed(values[:count]), counts.astype(np.int64))
    rows, columns = sizes.astype(np.int64).tolist()
    return filled.reshape((rows, columns), order="F"), numbers[2 + 2 * count :]


def _are_whole(numbers: NDArray[np.float64], low: int) -> bool:
    return bool(((numbers >= low) & (numbers % 1 == 0)).all())


def _all_numbers(text: str) -> NDArray[np.float64]:
    """Return the numbers of a text, separated by single blanks; none if one is too large or not a number."""
    try:
        numbers = np.fromstring(text if text.isascii() else "", np.float64, sep=" ")
    except (ValueError, DeprecationWarning):
        numbers = np.empty(0)
    is_good = len(numbers) == text.count(" ") + 1 and bool((np.abs(numbers) <= NUMBER_MAX).all())
    return numbers if is_good else np.empty(0)


def _narrowed(values: NDArray[np.float64]) -> NDArray[Any]:
    small = values.astype(np.int16, casting="unsafe") if (np.abs(values) < 1 << 15).all() else values
    return small if (small == values).all() else values
