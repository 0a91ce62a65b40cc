"""The results of a batch, and their table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kiks.batch.number_table import NumberTable
from kiks.errors import counted
from kiks.upwards import shown_in_notebooks


@shown_in_notebooks("kiks.export.notebook", "table")
@dataclass(frozen=True, repr=False)
class Rollouts:
    """The results of `Batch.run`.

    `print` and notebooks show a table: the first robots, by their indices in `values`, then the mean, the standard
    deviation, the minimum and the maximum over all robots.

    Attributes:
        values: Values of the measures, float64 [world, robot, value].
        step_counts: Number of control steps, int64 [world].
        measures: Names of the values: of the measures, or of those that a measure has several of.

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
        return str(self.table())

    def table(self) -> NumberTable:
        """Return the table.

        Example:
            >>> Rollouts(np.array([[[120.5]], [[80.25]]]), np.array([10, 10]), ("path_mm",)).table().head
            ['world', 'steps', 'path_mm']
        """
        worlds, robots, measures = self.values.shape
        steps = np.repeat(self.step_counts, robots).astype(np.float64)
        values = np.column_stack([steps, self.values.reshape(worlds * robots, measures)])
        return NumberTable(
            {"world": worlds, **({"robot": robots} if robots > 1 else {})}, ("steps", *self.measures), values
        )
