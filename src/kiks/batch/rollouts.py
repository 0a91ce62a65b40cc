"""The results of a batch, and their table."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kiks.errors import counted

FIRST = 10
"""Number of robots that a table shows before it summarizes the others."""

DIGITS = 4
"""Least number of digits of a number in a table."""

_SUMS = (("mean", np.mean), ("std", np.std), ("min", np.min), ("max", np.max))


@dataclass(frozen=True, repr=False)
class Rollouts:
    """The results of `Batch.run`.

    `print` and notebooks show a table: the first robots, by their indices in `values`, then the mean, the standard
    deviation, the minimum and the maximum over all robots.

    Attributes:
        values: Values of the measures, float64 [world, robot, measure].
        step_counts: Number of control steps, int64 [world].
        measures: Names of the measures.

    Example:
        >>> print(Rollouts(np.array([[[120.5]], [[80.25]]]), np.array([10, 10]), ("path_mm",)))
        world  steps  path_mm
            0     10   120.50
            1     10    80.25
         mean  10.00   100.38
          std   0.00    20.12
          min     10    80.25
          max     10   120.50
    """

    values: NDArray[np.float64]
    step_counts: NDArray[np.int64]
    measures: tuple[str, ...]

    def __repr__(self) -> str:
        worlds, robots, _ = self.values.shape
        names = ", ".join(self.measures) or "no measures"
        return f"<Rollouts: {counted(worlds, 'world')} of {counted(robots, 'robot')}, {names}>"

    def __str__(self) -> str:
        head, rows, sums = self._table()
        widths = [max(map(len, column)) for column in zip(head, *rows, *sums, strict=True)]
        lines = ["  ".join(map(str.rjust, row, widths)) for row in (head, *rows, *sums)]
        if left := self._left_out():
            lines.insert(len(rows) + 1, f"... {left}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Return the table, which notebooks show."""
        head, rows, sums = self._table()
        left = self._left_out()
        body = [_row(row) for row in rows] + ([f'<tr><td colspan="{len(head)}">... {left}</td></tr>'] if left else [])
        return (
            f"<table><thead>{_row(head, 'th')}</thead><tbody>{''.join(body)}</tbody>"
            f"<tfoot>{''.join(_row(row, 'th') for row in sums)}</tfoot></table>"
        )

    def _table(self) -> tuple[list[str], list[list[str]], list[list[str]]]:
        """Return the head of the table, the rows of the first robots, and the rows with the statistics of all."""
        world_count, robot_count, measure_count = self.values.shape
        index_names = ["world", "robot"] if robot_count > 1 else ["world"]
        steps = np.repeat(self.step_counts, robot_count).astype(np.float64)
        values = self.values.reshape(world_count * robot_count, measure_count)
        columns = [_column(numbers) for numbers in (steps, *values.T)]
        rows = []
        for k in range(min(FIRST, len(steps))):
            indices = [str(index) for index in divmod(k, robot_count)]
            rows.append([*indices[: len(index_names)], *(numbers[k] for numbers, _ in columns)])
        none = [""] * (len(index_names) - 1)
        sums = [[name, *none, *(summed[k] for _, summed in columns)] for k, (name, _) in enumerate(_SUMS)]
        return [*index_names, "steps", *self.measures], rows, sums

    def _left_out(self) -> str:
        """Return a text with the number of robots that the table leaves out, or an empty text."""
        count = self.values.shape[0] * self.values.shape[1] - FIRST
        return f"{count} more" if count > 0 else ""


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


def _row(words: list[str], tag: str = "td") -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(word)}</{tag}>' for word in words)}</tr>"
