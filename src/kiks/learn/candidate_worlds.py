"""What evaluations of candidates in batches of worlds have in common: batches, starts, fitness, pickling."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from kiks.batch.initial_state import random_starts
from kiks.errors import ParameterError, shown
from kiks.learn.evaluation import Floats, Integers
from kiks.learn.exam import CLEAR_MM
from kiks.learn.task import BATCH_WORLDS_MAX, Fitness, cautious_mean
from kiks.model.arena import Arena


def reduced_by_value(entry: Any) -> tuple[Any, ...]:
    """Return what `__reduce__` returns of a record whose functions are pickled by value.

    A worker on another computer does not have the user's file.
    """
    from numba import cloudpickle

    dumps: Any = cloudpickle.dumps
    return _unpickled, (type(entry), dumps({each.name: getattr(entry, each.name) for each in fields(entry)}))


def _unpickled(kind: type[Any], pickled: bytes) -> Any:
    """Return a record of a kind."""
    return kind(**pickle.loads(pickled))


def bytes_of(arenas: Sequence[Arena]) -> bytes:
    """Return bytes that differ between arenas in which robots may drive differently."""
    return b"".join(
        each.brightness.tobytes()
        + repr((each.mm_per_cell, each.starts, each.lamps, each.balls, each.cylinders)).encode()
        for each in arenas
    )


def batches_of(count: int, worlds: int) -> list[slice]:
    """Return the candidates of each batch, of so many worlds each."""
    size = max(1, BATCH_WORLDS_MAX // worlds)
    return [slice(first, first + size) for first in range(0, count, size)]


def starts_of(
    seeds: Integers, arenas: Sequence[Arena], worlds: int, *, radius_mm: float, robots: int, apart_mm: float
) -> Floats:
    """Return random start poses for candidates, float64 [candidate and world, robot, 3]: the same for the same seed.

    Args:
        seeds: A seed for each [candidate].
        arenas: The arenas, which the worlds of a candidate take in turn.
        worlds: Number of worlds of a candidate, a multiple of the number of arenas.
        radius_mm: Radius of a robot [mm].
        robots: Number of robots in each world.
        apart_mm: Least distance between the edges of two robots [mm].
    """
    given: dict[str, Any] = {"robots": robots, "radius_mm": radius_mm, "clear_mm": CLEAR_MM, "apart_mm": apart_mm}
    count = worlds // len(arenas)
    poses: dict[int, Floats] = {}
    for seed in dict.fromkeys(seeds.tolist()):
        each = [random_starts(arena, count, seed=seed, **given) for arena in arenas]
        poses[seed] = np.stack(each, axis=1).reshape(worlds, robots, 3)
    return np.concatenate([poses[seed] for seed in seeds.tolist()])


def fitness_of(fitness: Fitness | None, measure_names: Sequence[str], values: Floats) -> Floats:
    """Return the fitness of candidates, float64 [candidate].

    Args:
        fitness: The fitness function; None for `cautious_mean` of the first measure.
        measure_names: Names of the measures.
        values: Values of the measures, float64 [candidate, world, measure].

    Raises:
        ParameterError: If a value or a fitness is not finite, or the fitness has another shape.
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
