"""What evaluations of candidates in batches of worlds have in common: batches, starts, fitness, pickling."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any, Self

import numpy as np

from kiks.batch.initial_state import random_starts
from kiks.errors import ParameterError, shown
from kiks.learn.evaluation import Floats, Integers, check_candidates
from kiks.learn.fingerprint import fingerprints
from kiks.model.arena import Arena
from kiks.model.checks import check_number

Fitness = Callable[[Mapping[str, Floats]], Floats]

_UNCOUNTED = {"name", "about", "file", "algorithm", "population", "generations"}
"""Arguments on which no value depends."""

BATCH_WORLDS_MAX = 20_000
"""Largest number of worlds in a batch: more need more memory and run no faster."""

SECONDS_MIN, SECONDS_MAX = 1e-3, 1e6
"""Shortest and longest time for which candidates drive [s]."""

CLEAR_MM = 8.0
"""Smallest gap between a random start and anything else [mm]."""


class InWorlds:
    """The common base of tasks and contests: records of which candidates are evaluated in batches of worlds."""

    apart_mm = CLEAR_MM
    """Least distance between the edges of two robots at a random start [mm]."""

    def __reduce__(self: Any) -> tuple[Any, ...]:
        return _unpickled, (type(self), _pickled(self))

    def with_changes(self, **changes: Any) -> Self:
        """Return a copy with some arguments changed."""
        changed: Any = self
        return replace(changed, **changes)  # type: ignore[no-any-return]

    @property
    def measure_names(self: Any) -> tuple[str, ...]:
        """Names of the measures."""
        return tuple(each.name for each in self.measures)

    @property
    def driven_s(self: Any) -> float:
        """Total time for which the robots of a candidate drive [s]."""
        return float(self.worlds * self.robots * self.seconds)

    # ---- evaluation ----

    def start_poses(self: Any, seeds: Integers) -> Floats | None:
        """Return the starts of candidates with such seeds, float64 [candidate and world, robot, 3].

        They are the same for the same seed; None for those of the arena.
        """
        if self.starts == "arena":
            return None
        given = {"radius_mm": max(spec.body.radius_mm for spec in self.specs), "apart_mm": self.apart_mm}
        seen = dict.fromkeys(seeds.tolist())
        poses = {seed: spread_starts(self.arenas, self.worlds, seed=seed, robots=self.robots, **given) for seed in seen}
        return np.concatenate([poses[seed] for seed in seeds.tolist()])

    def evaluate(
        self: Any, candidates: Floats, seeds: Integers, threads: int | None = None, seconds: float | None = None
    ) -> Floats:
        """Return the values of candidates; a candidate of a contest is a pair.

        Args:
            candidates: Parameters [candidate, parameter].
            seeds: A seed for each [candidate]: of its worlds and its starts.
            threads: Number of threads; the number of cores if left out.
            seconds: Time for which they drive [s], if not that of the task.

        Returns:
            The values that `value_names` lists, the measures averaged over worlds, float64 [candidate, value].
        """
        candidates, seeds = check_candidates(candidates, seeds)
        seconds = self.seconds if seconds is None else check_number("seconds", seconds, SECONDS_MIN, SECONDS_MAX)
        size = max(1, BATCH_WORLDS_MAX // self.worlds)
        parts = [slice(first, first + size) for first in range(0, len(candidates), size)]
        values = [self._evaluate(candidates[part], seeds[part], threads, seconds) for part in parts]
        return np.concatenate([np.empty((0, len(self.value_names))), *values])


@lru_cache(maxsize=4)
def _pickled(work: Any) -> bytes:
    """Return the arguments of a task. Functions are pickled by value: other computers do not have the user's file."""
    from numba import cloudpickle

    dumps: Any = cloudpickle.dumps
    pickled: bytes = dumps({each.name: getattr(work, each.name) for each in fields(work)})
    return pickled


@lru_cache(maxsize=4)
def _unpickled(kind: type[Any], pickled: bytes) -> Any:
    """Return a record of a kind: the same for the same bytes, so that a worker compiles its functions once."""
    return kind(**pickle.loads(pickled))


def digest_of(work: Any, **loaded: Any) -> dict[str, str]:
    """Return the fingerprint of each argument of a task or a contest on which values depend, by its name.

    Args:
        work: The task or the contest.
        loaded: What arguments lead to that name files, or may be given in two forms.
    """
    counted = {each.name: getattr(work, each.name) for each in fields(work) if each.name not in _UNCOUNTED}
    return fingerprints(counted | loaded)


def check_even(name: str, count: int, arenas: Sequence[Arena]) -> None:
    """Check that arenas share worlds or starts evenly."""
    if count % len(arenas):
        raise ParameterError(f"{name} must be a multiple of the number of arenas, {len(arenas)}, but it was {count}.")


def spread_starts(
    arenas: Sequence[Arena], count: int, *, seed: int, radius_mm: float, robots: int = 1, apart_mm: float = CLEAR_MM
) -> Floats:
    """Return random start poses in worlds that take arenas in turn, float64 [count, robot, 3].

    Args:
        arenas: The arenas.
        count: Number of worlds, a multiple of the number of arenas.
        seed: Seed of the random generator.
        radius_mm: Radius of a robot [mm].
        robots: Number of robots in each world.
        apart_mm: Least distance between the edges of two robots [mm].
    """
    given: dict[str, Any] = {"robots": robots, "radius_mm": radius_mm, "clear_mm": CLEAR_MM, "apart_mm": apart_mm}
    poses = [random_starts(arena, count // len(arenas), seed=seed, **given) for arena in arenas]
    return np.stack(poses, axis=1).reshape(count, robots, 3)


def fitness_of(fitness: Fitness | None, measure_names: Sequence[str], values: Floats) -> Floats:
    """Return the fitness of candidates, float64 [candidate].

    Args:
        fitness: The fitness function; None for `cautious_mean` of the first measure.
        measure_names: Names of the measures.
        values: Values of the measures, float64 [candidate, world, measure].
    """
    for number, name in enumerate(measure_names):
        if not np.isfinite(values[:, :, number]).all():
            raise ParameterError(f"measures must be finite, but {shown(name)} was not. Check its divisions.")
    named = {name: values[:, :, number] for number, name in enumerate(measure_names)}
    result = cautious_mean(values[:, :, 0]) if fitness is None else fitness(named)
    numbers = np.asarray(result, np.float64)
    if numbers.shape != (len(values),) or not np.isfinite(numbers).all():
        raise ParameterError(
            f"fitness must return a finite number for each of {len(values)} candidates, but returned {shown(result)}. "
            "The measures have the shape [candidate, world]: take a mean over axis 1."
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
