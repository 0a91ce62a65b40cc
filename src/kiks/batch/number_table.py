"""Tables of numbers for people: the first rows, then the statistics of all of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kiks.errors import counted
from kiks.table import Table

FIRST = 10
"""Number of rows that a table shows before it summarizes the others."""

DIGITS = 4
"""Least number of digits of a number in a table."""

_SUMS = (("mean", np.mean), ("std", np.std), ("min", np.min), ("max", np.max))


class NumberTable:
    """A table of numbers, whose `str` has a line for each row.

    Args:
        indices: Names of the indices of a row, and how many each has: the last runs fastest.
        columns: Names of the columns.
        values: float64 [row, column].

    Attributes:
        row_count: The number of rows.
        head: The first row: names.
        rows: The first `FIRST` rows.
        sums: The rows with the statistics of all.
        left_out: A text with the number of rows that are left out, or an empty text.

    Example:
        >>> print(NumberTable({"start": 2}, ["path_mm"], np.array([[120.5], [80.25]])))
        start  path_mm
            0   120.50
            1    80.25
         mean   100.38
          std    20.12
          min    80.25
          max   120.50
    """

    def __init__(self, indices: dict[str, int], columns: Sequence[str], values: NDArray[np.float64]) -> None:
        self.row_count = len(values)
        texts = [_column(numbers) for numbers in values.T]
        count = min(FIRST, len(values))
        places = np.array(np.unravel_index(np.arange(count), tuple(indices.values()))).T.tolist()
        none = [""] * (len(indices) - 1)
        self.head = [*indices, *columns]
        self.rows = [[*map(str, place), *(numbers[k] for numbers, _ in texts)] for k, place in enumerate(places)]
        self.sums = [[name, *none, *(summed[k] for _, summed in texts)] for k, (name, _) in enumerate(_SUMS)]
        self.left_out = f"{len(values) - FIRST} more" if len(values) > FIRST else ""

    def __repr__(self) -> str:
        return f"<NumberTable: {counted(self.row_count, 'row')} of {', '.join(self.head)}>"

    def __str__(self) -> str:
        lines = str(Table(self.head, (*self.rows, *self.sums), left_count=0)).splitlines()
        if self.left_out:
            lines.insert(len(self.rows) + 1, f"... {self.left_out}")
        return "\n".join(lines)


def _column(numbers: NDArray[np.float64]) -> tuple[list[str], list[str]]:
    """Return the first numbers of a column and the statistics of all of them, formatted."""
    finite = np.abs(numbers[np.isfinite(numbers)])
    is_whole = bool((finite == np.rint(finite)).all())
    greatest = float(finite.max(initial=0.0))
    places = max(DIGITS - 1 - (math.floor(math.log10(greatest)) if greatest else 0), 2)
    style = f".{places}f" if 1e-6 < greatest < 1e9 or not greatest else f".{DIGITS - 1}e"
    plain = ".0f" if is_whole and greatest < 1e9 else style
    # NaN stays NaN, without a warning of NumPy.
    with np.errstate(all="ignore"):
        summed = [float(sum_up(numbers)) for _, sum_up in _SUMS]
    return (
        [format(number, plain) for number in numbers[:FIRST].tolist()],
        [format(number, style) for number in summed[:2]] + [format(number, plain) for number in summed[2:]],
    )
