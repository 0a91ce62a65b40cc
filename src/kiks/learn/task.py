"""A task: the worlds, measures and fitness for which a controller is evolved."""

from __future__ import annotations

from dataclasses import field, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from kiks.batch.batch import Batch
from kiks.batch.initial_state import Arenas, Starts
from kiks.batch.loop_timing import Timing
from kiks.control.controller import Controller
from kiks.control.measure import Measure
from kiks.errors import ParameterError, shown
from kiks.learn.algorithm_name import AlgorithmName
from kiks.learn.candidate_worlds import (
    SECONDS_MAX,
    SECONDS_MIN,
    Fitness,
    InWorlds,
    check_even,
    digest_of,
    fitness_of,
)
from kiks.learn.champion import Champion
from kiks.learn.evaluation import Floats, Integers
from kiks.learn.exam import Exam, world_of
from kiks.model.arena import Pose
from kiks.model.checks import ROBOTS_MAX, check_count
from kiks.model.data_file import Number, OneOf, Rule, Text, Whole, record
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import RobotSpec, specs_of

GENERATIONS, POPULATION = 60, 40
"""Default numbers of generations, and of candidates in a generation."""

SPREAD = 3.0
"""Standard deviation of each parameter at the beginning: three times the usual scale of controllers, so that some of
the first candidates react sharply."""

WORLDS_MAX, MEASURES_MAX = 100_000, 100
"""Largest number of worlds of a candidate, and of measures."""

Seconds = Annotated[Number, Field(ge=SECONDS_MIN, le=SECONDS_MAX)]

Kind = Text | RobotSpec
Kinds = Annotated[
    Kind | Annotated[tuple[Kind, ...], Field(min_length=1)],
    Rule("the name of a robot, a robot file or a kiks.RobotSpec, or a list of them"),
]
Timings = Annotated[
    Timing | Annotated[tuple[Timing, ...], Field(min_length=1)], Rule("a kiks.Timing or a list of them")
]


@record
class Axis:
    """An axis of a map of behaviours, divided into cells.

    Args:
        measure: Name of the measure along the axis.
        low: Its lower end.
        high: Its upper end; values beyond an end belong to the last cell.
        cells: Number of cells.
    """

    measure: Text
    low: Number
    high: Number
    cells: Annotated[Whole, Field(ge=1, le=10_000)] = 20

    def __post_init__(self) -> None:
        if self.low >= self.high:
            raise ParameterError(f"an axis must lead from low to high, but it led from {self.low:g} to {self.high:g}.")


@record
class Task(InWorlds):
    """A task for which controllers are evolved: see `evaluate`.

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
        robot: Kind of robot: a name, a robot file or a `RobotSpec`. Or several, such as a `family`: the worlds of a
            candidate take them in turn, each generation from another one on. Champions drive the first.
        robots: Number of robots in each world, all with the same controller.
        timing: Timing of the control loop; that of a program on a line of 9600 baud if left out. Or several, which
            the worlds take in turn like the robots.
        starts: 'random' for free places anywhere, or 'arena' for the starts of the arena.
        spread: Standard deviation of each parameter in the first generation.
        algorithm: The algorithm of an evolution, unless the user says otherwise.
        generations: How many generations an evolution has, unless the user says otherwise.
        population: How many candidates a generation has, unless the user says otherwise.
        exam: The exam of its champions.
        about: A description in one line.
        file: The user's file that defines it.

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
    robot: Kinds = "khepera"
    robots: Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)] = 1
    timing: Timings = field(default_factory=Timing)
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
        check_even("worlds", self.worlds, self.arenas)
        names = self.measure_names
        if len(set(names)) != len(names):
            raise ParameterError(f"measures must have different names, but they were {shown(names)}.")
        for axis in self.axes:
            if axis.measure not in names:
                raise ParameterError(
                    f"an axis must name one of {', '.join(names)}, but it named {shown(axis.measure)}."
                )

    @property
    def value_names(self) -> tuple[str, ...]:
        """Names of the values of a candidate: fitness, then the measures."""
        return ("fitness", *self.measure_names)

    @property
    def kinds(self) -> tuple[Kind, ...]:
        """The kinds of robots that worlds take in turn."""
        return self.robot if isinstance(self.robot, tuple) else (self.robot,)

    @property
    def timings(self) -> tuple[Timing, ...]:
        """The timings that worlds take in turn."""
        return self.timing if isinstance(self.timing, tuple) else (self.timing,)

    @property
    def specs(self) -> tuple[RobotSpec, ...]:
        """What the robots are that worlds take in turn."""
        return tuple(specs_of(self.kinds, None, None))

    @property
    def parameter_count(self) -> int:
        """Number of parameters of a candidate."""
        return self.controller.parameter_count or 0

    def world(self) -> Project:
        """Return the world in which its champions are shown: that of their exam, or of training if there is none."""
        if self.exam is not None:
            return self.exam.world(self.kinds[0], self.robots)
        poses = self.start_poses(np.zeros(1, np.int64))
        return world_of(
            self.arenas[0], None if poses is None else poses[:: len(self.arenas)].reshape(-1, 3), self.robots, 0
        )

    def individual(self, parameters: Floats, seed: int, world: int = 0) -> Champion:
        """Return a candidate as a champion, whose world is one of those in which it is evaluated.

        On a line, the world then takes the course that it takes in the evaluation, to the bit.

        Args:
            parameters: Its parameters, float64 [parameter].
            seed: Its seed.
            world: Number of the world, from 0.
        """
        world, seeds = check_count("world", world, 0, self.worlds - 1), np.array([seed])
        kinds, timings = self._turns(seeds)
        arena = self.arenas[world % len(self.arenas)]
        if (starts := self.start_poses(seeds)) is not None:
            arena = replace(arena, starts=tuple(Pose(*each) for each in starts[world].tolist()))
        return Champion(
            controller=self.controller,
            parameters=tuple(parameters.tolist()),
            task=self.name,
            robot=self.specs[kinds[world]],
            timing=self.timings[timings[world]],
            world=Project(arena, robots=(ProjectRobot(),) * self.robots, seed=seed + world),
        )

    def digest(self) -> dict[str, str]:
        """Return the fingerprint of each argument on which the values of candidates or the exam depend, by its name.

        They are the same in each process, in each folder and on each computer (`kiks.learn.fingerprint`).
        """
        return digest_of(self, robot=self.specs, timing=self.timings)

    # ---- evaluation ----

    def _evaluate(self, candidates: Floats, seeds: Integers, threads: int | None, seconds: float) -> Floats:
        count = len(candidates)
        world_seeds = (seeds[:, None] + np.arange(self.worlds)).ravel()
        starts = self.start_poses(seeds)
        specs, (kinds, timings) = self.specs, self._turns(seeds)
        given = np.repeat(candidates, self.worlds, axis=0)
        means = np.zeros((count * self.worlds, len(self.measures)))
        for number in np.unique(timings).tolist():
            here = np.flatnonzero(timings == number)
            each = [(specs[kind],) * self.robots for kind in kinds[here].tolist()]
            batch = Batch(
                self.arenas,
                len(here),
                robot=specs[0] if len(specs) == 1 else each,
                robots=self.robots,
                seed=world_seeds[here],
                starts=None if starts is None else starts[here],
                senses=self.controller.senses,
                timing=self.timings[number],
                threads=threads,
            )
            driven = batch.run(self.controller, given[here], seconds=seconds, measures=self.measures)
            means[here] = driven.values.mean(axis=1)
        values = means.reshape(count, self.worlds, len(self.measures))
        fitness = fitness_of(self.fitness, self.measure_names, values)
        return np.column_stack([fitness, values.mean(axis=1)])

    def _turns(self, seeds: Integers) -> tuple[Integers, Integers]:
        """Return the number of each world's robot and of its timing, int64 [world].

        The arenas' turn comes round faster than the others': each arena gets all robots, each robot all timings. Worlds
        with the same timing are whole rounds of the arenas, as a batch takes them.
        """
        world = np.arange(self.worlds)
        turn = (seeds[:, None] % 2**32 + world // len(self.arenas)).ravel()
        kinds = (turn + np.tile(world % len(self.arenas), len(seeds))) % len(self.kinds)
        return kinds, turn // len(self.kinds) % len(self.timings)
