"""What a task and its exam have in common: arenas, measures and starts; and the fitness of measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Self

import numpy as np

from kiks.batch.initial_state import random_starts
from kiks.control.measure import Measure, check_names
from kiks.errors import ParameterError, counted, shown
from kiks.learn.evaluation import Floats
from kiks.model.arena import Arena
from kiks.upwards import shown_in_notebooks

Fitness = Callable[[Mapping[str, Floats]], Floats]

CLEAR_MM = 8.0
"""Smallest gap between a random start and anything else [mm]."""


@shown_in_notebooks("kiks.export.notebook", "arenas")
class Experiment:
    """The common base of tasks and exams: robots drive in worlds, which arenas share evenly, and are measured.

    Attributes:
        other_columns: Columns of the table of its results beside the measures.
    """

    arenas: tuple[Arena, ...]
    measures: tuple[Measure, ...]
    worlds: int
    other_columns: ClassVar[tuple[str, ...]]

    def __post_init__(self) -> None:
        if self.worlds % len(self.arenas) and not self.draws_arenas:
            raise ParameterError(
                f"worlds must be a multiple of the number of arenas, {len(self.arenas)}, but it was {self.worlds}."
            )
        check_names(self.measure_names, self.other_columns)

    @property
    def draws_arenas(self) -> bool:
        """Whether there are more arenas than worlds, from which each evaluation draws some."""
        return False

    @property
    def measure_names(self) -> tuple[str, ...]:
        """Names of the values of the measures."""
        return tuple(name for each in self.measures for name in each.value_names)

    def with_changes(self, **changes: Any) -> Self:
        """Return a copy with some arguments changed."""
        changed: Any = self
        return replace(changed, **changes)  # type: ignore[no-any-return]

    def random_starts(self, seed: int, *, robots: int, radius_mm: float, apart_mm: float = CLEAR_MM) -> Floats:
        """Return random start poses in its worlds, float64 [world, robot, 3].

        Args:
            seed: Seed of the random generator.
            robots: Number of robots in each world.
            radius_mm: Radius of the largest robot [mm].
            apart_mm: Least distance between the edges of two robots [mm].
        """
        given: dict[str, Any] = {"robots": robots, "radius_mm": radius_mm, "clear_mm": CLEAR_MM, "apart_mm": apart_mm}
        count = self.worlds // len(self.arenas)
        poses = [random_starts(arena, count, seed=seed, **given) for arena in self.arenas]
        return np.stack(poses, axis=1).reshape(self.worlds, robots, 3)


def fitness_of(fitness: Fitness | None, measures: Sequence[Measure], values: Floats) -> Floats:
    """Return the fitness of candidates, float64 [candidate].

    Args:
        fitness: The fitness function; None for `cautious_mean` of the first measure.
        measures: The measures.
        values: Their values, float64 [candidate, world, value].
    """
    named: dict[str, Floats] = {}
    for each in measures:
        for name in each.value_names:
            found = named[name] = values[:, :, len(named)]
            if not np.isfinite(found).all():
                number = found[~np.isfinite(found)][0]
                raise ParameterError(f"measures must be finite, but {shown(name)} was {number}. {each.advice}")
    result = cautious_mean(values[:, :, 0]) if fitness is None else fitness(named)
    numbers = np.asarray(result, np.float64)
    if numbers.shape != (len(values),) or not np.isfinite(numbers).all():
        raise ParameterError(
            f"fitness must return a finite number for each of {counted(len(values), 'candidate')}, but returned "
            f"{shown(result)}. The measures have the shape [candidate, world]: take a mean over axis 1."
        )
    return numbers


def cautious_mean(scores: Floats, caution: float = 0.5) -> Floats:
    """Return the mean of scores over worlds, weighted with the mean of the worse half.

    The worse half shows how a controller does in worlds that do not suit it. Accidents count there, but no single one
    decides, as it would in the worst world.

    Args:
        scores: [candidate, world].
        caution: From 0, the mean, to 1, the mean of the worse half.

    Example:
        >>> cautious_mean(np.array([[1.0, 1.0, 0.0, 1.0]]))
        array([0.625])
    """
    worse = np.sort(scores, axis=1)[:, : (scores.shape[1] + 1) // 2]
    mean: Floats = (1 - caution) * scores.mean(axis=1) + caution * worse.mean(axis=1)
    return mean
