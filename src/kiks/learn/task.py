"""A task: the worlds, measures and fitness for which a controller is evolved."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Mapping
from dataclasses import field, fields, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from kiks.batch.batch import Batch
from kiks.batch.initial_state import Arenas, Starts
from kiks.batch.loop_timing import Timing
from kiks.control.controller import Controller
from kiks.control.measure import Measure
from kiks.errors import ParameterError, shown
from kiks.learn.algorithm_name import AlgorithmName
from kiks.learn.evaluation import Floats, Integers, check_candidates
from kiks.learn.exam import Exam, spread_starts
from kiks.model.checks import check_number
from kiks.model.data_file import Number, OneOf, Text, Whole, read_file, record
from kiks.model.robot import RobotSpec

Fitness = Callable[[Mapping[str, Floats]], Floats]

BATCH_WORLDS_MAX = 20_000
"""Largest number of worlds in a batch: more need more memory and run no faster."""

GENERATIONS, POPULATION = 60, 40
"""Default numbers of generations, and of candidates in a generation."""

SPREAD = 3.0
"""Standard deviation of each parameter at the beginning: three times the usual scale of controllers, so that some of
the first candidates react sharply."""

WORLDS_MAX, ROBOTS_MAX, MEASURES_MAX = 100_000, 1000, 100
"""Largest number of worlds of a candidate, of robots in each world, and of measures."""

Seconds = Annotated[Number, Field(ge=1e-3, le=1e6)]


@record
class Axis:
    """An axis of a map of behaviours, divided into cells.

    Args:
        measure: Name of the measure along the axis.
        low: Its lower end.
        high: Its upper end; values beyond an end belong to the last cell.
        cells: Number of cells.

    Raises:
        ParameterError: If an argument is out of range.
    """

    measure: Text
    low: Number
    high: Number
    cells: Annotated[Whole, Field(ge=1, le=10_000)] = 20

    def __post_init__(self) -> None:
        if self.low >= self.high:
            raise ParameterError(f"an axis must lead from low to high, but it led from {self.low:g} to {self.high:g}.")


@record
class Task:
    """A task for which controllers are evolved: a `kiks.learn.evaluation.Evaluation`.

    A candidate is the parameters of a controller. It drives in `worlds` worlds, which the arenas share evenly. The
    measures, averaged over a world's robots, become one number, its fitness.

    Args:
        name: Its name.
        arenas: Arenas for training.
        controller: The controller to evolve; it must state the number of its parameters.
        measures: The measures, each with a different name.
        fitness: Maps the measures, by name float64 [candidate, world], to the fitness, float64 [candidate]; more is
            better. Left out, it is `cautious_mean` of the first measure.
        seconds: Time for which a candidate drives in each world [s].
        worlds: Number of worlds; a multiple of the number of arenas.
        axes: Axes along which behaviours differ, for algorithms that look for many of them.
        robot: Kind of robot: a name or a robot file.
        robots: Number of robots in each world, all with the same controller.
        timing: Timing of the control loop; that of a program on a line of 9600 baud if left out.
        starts: 'random' for free places anywhere, or 'arena' for the starts of the arena.
        spread: Standard deviation of each parameter in the first generation.
        algorithm: The algorithm of an evolution, unless the user says otherwise.
        generations: How many generations an evolution has, unless the user says otherwise.
        population: How many candidates a generation has, unless the user says otherwise.
        exam: The exam of its champions.
        about: A description in one line.
        file: The user's file that defines it.

    Raises:
        ParameterError: If an argument is out of range.

    Example:
        >>> import kiks
        >>> @kiks.controller(parameters=2)
        ... def ahead(sensors, memory, parameters, wheels):
        ...     wheels[:] = parameters
        >>> task = Task("far", [kiks.Arena.box(500, 500)], ahead, [kiks.measures.path_mm], seconds=1, worlds=2)
        >>> task.evaluate(np.array([[0.0, 0.0], [3.0, 3.0]]), np.zeros(2, np.int64), 1).round(1)
        array([[ 0. ,  0. ],
               [20.4, 20.4]])
    """

    name: Text
    arenas: Arenas
    controller: Annotated[Controller, Field(description="Write @kiks.controller(parameters=COUNT) over the function.")]
    measures: Annotated[tuple[Measure, ...], Field(min_length=1, max_length=MEASURES_MAX)]
    fitness: Fitness | None = None
    seconds: Seconds = 30.0
    worlds: Annotated[Whole, Field(ge=1, le=WORLDS_MAX)] = 1
    axes: tuple[Axis, ...] = ()
    robot: Text = "khepera"
    robots: Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)] = 1
    timing: Timing = field(default_factory=Timing)
    starts: Starts = "random"
    spread: Annotated[Number, Field(gt=0, le=1000)] = SPREAD
    algorithm: Annotated[str, OneOf(tuple(name.value for name in AlgorithmName))] = AlgorithmName.CMA.value
    generations: Annotated[Whole, Field(ge=1)] = GENERATIONS
    population: Annotated[Whole, Field(ge=4)] = POPULATION
    exam: Annotated[Exam | None, Field(description="kiks.Exam(arenas, measures, solved) makes one.")] = None
    about: Text = ""
    file: str = ""

    # Functions cannot be compared: a task equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __post_init__(self) -> None:
        if not self.controller.parameter_count:
            raise ParameterError(
                f"the controller of a task must state the number of its parameters, but {shown(self.controller)} does "
                "not. Write @kiks.controller(parameters=COUNT) over the function."
            )
        if self.worlds % len(self.arenas):
            raise ParameterError(
                f"worlds must be a multiple of the number of arenas, {len(self.arenas)}, but it was {self.worlds}."
            )
        if self.starts == "random" and self.robots > 1:
            raise ParameterError("starts must be 'arena' with several robots, but it was 'random'.")
        names = self.measure_names
        if len(set(names)) != len(names):
            raise ParameterError(f"measures must have different names, but they were {shown(names)}.")
        for axis in self.axes:
            if axis.measure not in names:
                raise ParameterError(
                    f"an axis must name one of {', '.join(names)}, but it named {shown(axis.measure)}."
                )

    def __reduce__(self) -> tuple[Any, ...]:
        # Functions are pickled by value, because a worker on another computer does not have the user's file.
        from numba import cloudpickle

        dumps: Any = cloudpickle.dumps
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return _task_of, (dumps(values),)

    def with_changes(self, **changes: Any) -> Task:
        """Return a copy with some arguments changed.

        Raises:
            ParameterError: If an argument is out of range.
        """
        return replace(self, **changes)

    @property
    def measure_names(self) -> tuple[str, ...]:
        """Names of the measures."""
        return tuple(each.name for each in self.measures)

    @property
    def value_names(self) -> tuple[str, ...]:
        """Names of the values of a candidate: fitness, then the measures."""
        return ("fitness", *self.measure_names)

    @property
    def parameter_count(self) -> int:
        """Number of parameters of a candidate."""
        return self.controller.parameter_count or 0

    @property
    def driven_s(self) -> float:
        """Total time for which the robots of a candidate drive [s]."""
        return self.worlds * self.robots * self.seconds

    def digest(self) -> str:
        """Return 16 hexadecimal digits that differ between tasks whose evolutions differ."""
        digest = hashlib.sha256()
        for each in self.arenas:
            digest.update(each.brightness.tobytes())
            digest.update(repr((each.mm_per_cell, each.starts, each.lamps, each.balls, each.cylinders)).encode())
        evaluated = (
            self.controller.recipe,
            self.controller.name,
            self.parameter_count,
            self.measure_names,
            self.seconds,
        )
        worlds = (self.worlds, self.axes, self.robots, self.timing, self.starts, self.spread)
        digest.update(repr((self.name, evaluated, worlds, RobotSpec.load(self.robot))).encode())
        if self.file:
            digest.update(read_file(Path(self.file), "the task's file"))
        return digest.hexdigest()[:16]

    # ---- evaluation ----

    def prepare(self) -> None:
        """Compile the controller and the measures."""
        self.evaluate(np.zeros((1, self.parameter_count)), np.zeros(1, np.int64), 1, seconds=self.timing.period_s)

    def evaluate(self, candidates: Floats, seeds: Integers, threads: int, seconds: float | None = None) -> Floats:
        """Return the values of candidates.

        Args:
            candidates: Parameters [candidate, parameter].
            seeds: A seed for each [candidate]: of its worlds and its starts.
            threads: Number of threads.
            seconds: Time for which they drive [s], if not that of the task.

        Returns:
            Fitness, then the mean of each measure, float64 [candidate, 1 + measure].

        Raises:
            ParameterError: If candidates, seeds or fitness have the wrong shape, or a measure or the fitness is not
                finite.
        """
        candidates, seeds = check_candidates(candidates, seeds)
        if not len(candidates):
            return np.empty((0, len(self.value_names)))
        seconds = self.seconds if seconds is None else check_number("seconds", seconds, 1e-3, 1e6)
        batch_size = max(1, BATCH_WORLDS_MAX // self.worlds)
        parts = []
        for first in range(0, len(candidates), batch_size):
            part = slice(first, first + batch_size)
            parts.append(self._evaluate(candidates[part], seeds[part], threads, seconds))
        return np.concatenate(parts)

    def _evaluate(self, candidates: Floats, seeds: Integers, threads: int, seconds: float) -> Floats:
        count = len(candidates)
        batch = Batch(
            self.arenas,
            count * self.worlds,
            robot=self.robot,
            robots=self.robots,
            seed=(seeds[:, None] + np.arange(self.worlds)).ravel(),
            starts=self._starts(seeds) if self.starts == "random" else None,
            senses=self.controller.senses,
            timing=self.timing,
            threads=threads,
        )
        given = np.repeat(candidates, self.worlds, axis=0)
        values = batch.run(self.controller, given, seconds=seconds, measures=self.measures).values
        values = values.mean(axis=1).reshape(count, self.worlds, len(self.measures))
        for number, name in enumerate(self.measure_names):
            if not np.isfinite(values[:, :, number]).all():
                raise ParameterError(f"measures must be finite, but {shown(name)} was not. Check its divisions.")
        named = {name: values[:, :, number] for number, name in enumerate(self.measure_names)}
        result = cautious_mean(values[:, :, 0]) if self.fitness is None else self.fitness(named)
        fitness = np.asarray(result, np.float64)
        if fitness.shape != (count,) or not np.isfinite(fitness).all():
            raise ParameterError(
                f"fitness must return a finite number for each of {count} candidates, but returned {shown(result)}. "
                "The measures have the shape [candidate, world]: take a mean over axis 1."
            )
        return np.column_stack([fitness, values.mean(axis=1)])

    def _starts(self, seeds: Integers) -> Floats:
        """Return random start poses, float64 [world, 1, 3]: the same for the same seed."""
        poses = {
            seed: spread_starts(self.arenas, self.worlds, seed=seed, robot=self.robot)
            for seed in dict.fromkeys(seeds.tolist())
        }
        return np.concatenate([poses[seed] for seed in seeds.tolist()])


def _task_of(pickled: bytes) -> Task:
    """Return a pickled task."""
    return Task(**pickle.loads(pickled))


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
