"""The archive of an evolution: the best candidate of each cell of a map whose axes are measures.

It follows from the candidates and their values alone, so the algorithm does not matter, and archives of different
algorithms can be compared.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, counted, shown
from kiks.export.tables import write_parquet
from kiks.learn.champion import Champion
from kiks.learn.evolution_log import EvolutionFolder
from kiks.learn.task import Axis, check_axes
from kiks.model.atomic_files import path_of
from kiks.model.checks import check_number
from kiks.upwards import shown_in_notebooks

Floats = NDArray[np.float64]

ARCHIVE = "archive.parquet"
"""Name in the folder of an evolution, of two sides after the name of the side."""

CELLS_MAX = 2**53
"""Most cells of an archive."""


@dataclass(frozen=True)
class Elite:
    """The best candidate of a cell.

    Attributes:
        cell: Number of the cell along each axis.
        generation: The generation that found it.
        values: Its values by name: fitness, then the measures.
        parameters: Its parameters.
    """

    cell: tuple[int, ...]
    generation: int
    values: Mapping[str, float]
    parameters: tuple[float, ...]

    def __repr__(self) -> str:
        return f"<Elite of cell {self.cell}: fitness {self.fitness:.4g}, of generation {self.generation}>"

    @property
    def fitness(self) -> float:
        """Its fitness."""
        return self.values["fitness"]


@shown_in_notebooks("kiks.learn.notebook", "archive")
class Archive:
    """An archive: the best candidate of each cell.

    Args:
        axes: Axes of the map; each names one of the values.
        value_names: Names of the values of a candidate: fitness, then the measures.
        champion: The champion of the evolution, or one like it: it lends controller, robot and timing to the elites.

    Attributes:
        axes: Axes of the map.
        value_names: Names of the values of a candidate.
        champion: The champion.

    Example:
        >>> import os, tempfile
        >>> import kiks
        >>> task = kiks.tasks.avoid(seconds=1, worlds=4)
        >>> evolution = kiks.Evolution(task, "map-elites", seed=1, population=8)
        >>> _ = evolution.run(generations=2)
        >>> archive = evolution.archive
        >>> archive.coverage == len(archive.elites) / archive.cell_count
        True
        >>> archive.heat_map().shape
        (20, 20)
        >>> archive.champion_of(archive.best_first()[0]).task
        'avoid'
        >>> elite = archive.elite_at(100, 0.5)  # path_mm, straightness
        >>> archive.champion_at(100, 0.5).parameters == elite.parameters
        True
        >>> folder = tempfile.mkdtemp()
        >>> archive.save(folder)
        >>> os.listdir(folder)
        ['archive.parquet']
    """

    def __init__(self, axes: Sequence[Axis], value_names: Sequence[str], champion: Champion) -> None:
        self.axes, self.value_names, self.champion = tuple(axes), tuple(value_names), champion
        check_axes(self.axes, self.value_names)
        self.shape = tuple(axis.cells for axis in self.axes)
        self.cell_count = int(np.prod([float(cells) for cells in self.shape]))
        if self.cell_count > CELLS_MAX:
            raise ParameterError(f"an archive must have at most 2^53 cells, but it had {self.cell_count}.")
        self._elites: dict[tuple[int, ...], Elite] = {}

    def __repr__(self) -> str:
        axes = " x ".join(axis.measure for axis in self.axes)
        elites = counted(len(self._elites), "elite")
        return f"<{type(self).__name__}: {elites} in {counted(self.cell_count, 'cell')} of {axes}>"

    def add(self, candidates: Floats, values: Floats, generation: int) -> None:
        """Take candidates: each stays that is better than the elite of its cell.

        Args:
            candidates: Their parameters, float64 [candidate, parameter].
            values: Their values, float64 [candidate, value].
            generation: The generation that found them.

        Example:
            >>> import numpy as np
            >>> import kiks
            >>> champion = kiks.Champion(kiks.controllers.linear(), [0.0] * 18)
            >>> archive = kiks.Archive([kiks.Axis("path_mm", 0, 100, 10)], ["fitness", "path_mm"], champion)
            >>> archive.add(np.zeros((3, 18)), np.array([[0.1, 5.0], [0.2, 6.0], [0.1, 95.0]]), generation=1)
            >>> archive.elites
            (<Elite of cell (0,): fitness 0.2, of generation 1>, <Elite of cell (9,): fitness 0.1, of generation 1>)
        """
        places = values[:, [self.value_names.index(axis.measure) for axis in self.axes]]
        fitness = values[:, self.value_names.index("fitness")]
        for number, cell in enumerate(self._cells(places)):
            elite = self._elites.get(cell)
            if elite is None or fitness[number] > elite.fitness:
                named = dict(zip(self.value_names, values[number].tolist(), strict=True))
                self._elites[cell] = Elite(cell, generation, named, tuple(candidates[number].tolist()))

    def _cells(self, places: Floats) -> Iterator[tuple[int, ...]]:
        """Yield the cells of places, float64 [place, axis]; places beyond an end belong to the last cell."""
        low, high, cells = (np.array([getattr(axis, name) for axis in self.axes]) for name in ("low", "high", "cells"))
        shares = np.clip((places - low) / (high - low), 0.0, 1.0)
        yield from map(tuple, np.minimum((shares * cells).astype(np.int64), cells - 1).tolist())

    # ---- elites ----

    @property
    def elites(self) -> tuple[Elite, ...]:
        """The elites, in the order of their cells."""
        return tuple(self._elites[cell] for cell in sorted(self._elites))

    def best_first(self) -> list[Elite]:
        """Return the elites by their fitness, the best first; ties by cell."""
        return sorted(self.elites, key=lambda elite: -elite.fitness)

    def elite_at(self, *place: float) -> Elite:
        """Return the elite of the cell of a place; if it is empty, that of the nearest filled one, counted in cells.

        Args:
            place: The place along each axis.
        """
        if len(place) != len(self.axes):
            names = ", ".join(axis.measure for axis in self.axes)
            raise ParameterError(f"a place must be {len(self.axes)} numbers ({names}), but it was {shown(place)}.")
        if not self._elites:
            raise ParameterError("the archive must hold an elite, but it is empty. Tell a generation first.")
        numbers = [check_number(axis.measure, number) for axis, number in zip(self.axes, place, strict=True)]
        (cell,) = self._cells(np.array([numbers]))
        elites = self.elites
        away = np.array([elite.cell for elite in elites]) - np.array(cell)
        return elites[int((away**2).sum(axis=1).argmin())]

    def champion_of(self, elite: Elite) -> Champion:
        """Return an elite as a champion."""
        measures = {name: value for name, value in elite.values.items() if name != "fitness"}
        return replace(
            self.champion,
            parameters=elite.parameters,
            fitness=elite.fitness,
            measures=measures,
            generation=elite.generation,
        )

    def champion_at(self, *place: float) -> Champion:
        """Return the elite of a place, as `elite_at` finds it, as a champion."""
        return self.champion_of(self.elite_at(*place))

    # ---- the whole ----

    @property
    def coverage(self) -> float:
        """Share of the cells that are filled."""
        return len(self._elites) / self.cell_count

    @property
    def qd_score(self) -> float:
        """Sum of the fitness of all elites; a fitness below zero makes an elite count against it."""
        return float(sum(elite.fitness for elite in self.elites))

    def heat_map(self) -> Floats:
        """Return the fitness in each cell, NaN in empty ones, float64 [cell of axis 0, ...]."""
        heat: Floats = np.full(self.shape, np.nan)
        for elite in self.elites:
            heat[elite.cell] = elite.fitness
        return heat

    # ---- files ----

    def save(self, folder: str | Path, side: str = "") -> None:
        """Write `archive.parquet`, or that of a side of two, into a folder: a table with a row for each elite."""
        elites = self.elites
        columns: dict[str, Any] = {"generation": np.array([elite.generation for elite in elites], np.int64)}
        for number, axis in enumerate(self.axes):
            columns[f"cell_{axis.measure}"] = np.array([elite.cell[number] for elite in elites], np.int64)
        values = np.array([list(elite.values.values()) for elite in elites]).reshape(-1, len(self.value_names))
        columns |= dict(zip(self.value_names, values.T, strict=True))
        parameters = np.array([elite.parameters for elite in elites]).reshape(len(elites), -1)
        columns |= {f"parameter_{number}": column for number, column in enumerate(parameters.T, 1)}
        write_parquet(columns, path_of(folder, "folder") / (f"{side}_{ARCHIVE}" if side else ARCHIVE), "the archive")

    @classmethod
    def load(cls, folder: str | Path, side: str = "") -> Archive:
        """Return the archive of the evolution in a folder. The controller of its champion may run code.

        Args:
            folder: The folder.
            side: Name of the side, if there are two.

        Example:
            >>> import tempfile
            >>> import kiks
            >>> task = kiks.tasks.avoid(seconds=1, worlds=4)
            >>> evolution = kiks.Evolution(task, "map-elites", seed=1, population=8)
            >>> _ = evolution.run(generations=2)
            >>> folder = tempfile.mkdtemp()
            >>> evolution = kiks.Evolution(task, "map-elites", seed=1, population=8, folder=folder)
            >>> _ = evolution.run(generations=2)
            >>> len(kiks.Archive.load(folder).elites) == len(evolution.archive.elites)
            True
        """
        files = EvolutionFolder(folder)
        identity, champion = files.identity(), Champion.load(files.champion_file(side))
        if not identity.axes or side not in identity.sides:
            raise ParameterError(
                f"the evolution in {str(files.path)!r} must have axes and the side {shown(side)} for an archive, but "
                f"it has {len(identity.axes)} axes and the sides {shown(list(identity.sides))}."
            )
        archive = cls(identity.axes, ("fitness", *identity.measures), champion)
        number, value_count = list(identity.sides).index(side), len(archive.value_names)
        first = sum(list(identity.sides.values())[:number])
        own = slice(first, first + identity.sides[side])
        for generation in range(files.generation_count()):
            saved = files.generation(generation, identity)
            candidates, values = (saved[name][: identity.population] for name in ("candidates", "values"))
            if values.shape[1] == len(identity.sides) * value_count:
                part = values[:, number * value_count : (number + 1) * value_count]
                archive.add(candidates[:, own], part, generation + 1)
        return archive
