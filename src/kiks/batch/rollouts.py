"""The results of a batch, and their table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kiks.batch.number_table import NumberTable
from kiks.control.measure import check_names
from kiks.errors import counted
from kiks.model.columns import Columns
from kiks.upwards import save_columns, shown_in_notebooks


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
        seeds: Seed of each world, int64 [world]; None if they are not known.

    Example:
        >>> import tempfile
        >>> rollouts = Rollouts(np.array([[[120.5]], [[80.25]]]), np.array([10, 10]), ("path_mm",))
        >>> print(rollouts.table())
        world  steps  path_mm
            0     10   120.50
            1     10    80.25
         mean  10.00   100.38
          std   0.00    20.12
          min     10    80.25
          max     10   120.50
        >>> file = Path(tempfile.mkdtemp(), "rollouts.csv")
        >>> rollouts.save(file)
        >>> file.read_text().split()
        ['world,robot,steps,path_mm', '0,0,10,120.5', '1,0,10,80.25']
    """

    values: NDArray[np.float64]
    step_counts: NDArray[np.int64]
    measures: tuple[str, ...]
    seeds: NDArray[np.int64] | None = None

    def __repr__(self) -> str:
        worlds, robots, _ = self.values.shape
        names = ", ".join(self.measures) or "no measures"
        return f"<Rollouts: {counted(worlds, 'world')} of {counted(robots, 'robot')}, {names}>"

    def __str__(self) -> str:
        return str(self.table())

    def table(self) -> NumberTable:
        """Return the table."""
        worlds, robots, measures = self.values.shape
        steps = np.repeat(self.step_counts, robots).astype(np.float64)
        values = np.column_stack([steps, self.values.reshape(worlds * robots, measures)])
        return NumberTable(
            {"world": worlds, **({"robot": robots} if robots > 1 else {})}, ("steps", *self.measures), values
        )

    def columns(self) -> Columns:
        """Return all values as columns, [world and robot] each, as `pandas.DataFrame` takes them.

        They are world, robot (both from 0), seed, steps, and a column for each value.

        Example:
            >>> values, seeds = np.array([[[120.5]], [[80.25]]]), np.array([7, 8])
            >>> rollouts = Rollouts(values, np.array([10, 10]), ("path_mm",), seeds)
            >>> {name: column.tolist() for name, column in rollouts.columns().items()}
            {'world': [0, 1], 'robot': [0, 0], 'seed': [7, 8], 'steps': [10, 10], 'path_mm': [120.5, 80.25]}
        """
        worlds, robots, _ = self.values.shape
        of_worlds = {"seed": self.seeds, "steps": self.step_counts}
        check_names(self.measures, ("world", "robot", *of_worlds))
        numbers = {name: np.repeat(each, robots) for name, each in of_worlds.items() if each is not None}
        world, robot = np.indices((worlds, robots)).reshape(2, -1)
        named = dict(zip(self.measures, self.values.reshape(worlds * robots, -1).T, strict=True))
        return {"world": world, "robot": robot, **numbers, **named}

    def save(self, path: str | Path) -> None:
        """Write all values as a table, a row for each robot of each world: see `columns`.

        Args:
            path: The file: .csv, .parquet, or .mat for Octave and MATLAB.
        """
        save_columns(self.columns(), path)
