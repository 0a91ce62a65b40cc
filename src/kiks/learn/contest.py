"""A contest: two sides of robots in one world, each with a controller and a fitness of its own."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated

import numpy as np
from pydantic import Field

from kiks.batch.batch import Batch
from kiks.batch.initial_state import Arenas, Starts
from kiks.batch.loop_timing import Timing
from kiks.control.controller import Controller
from kiks.control.measure import Measure
from kiks.errors import ParameterError, shown
from kiks.learn.candidate_worlds import (
    Fitness,
    InWorlds,
    check_even,
    digest_of,
    fitness_of,
)
from kiks.learn.evaluation import Floats, Integers
from kiks.learn.task import MEASURES_MAX, SPREAD, WORLDS_MAX, Seconds
from kiks.model.checks import ROBOTS_MAX
from kiks.model.data_file import Number, Rule, Text, Whole, record
from kiks.model.robot import RobotSpec, specs_of

POPULATION, GENERATIONS = 100, 100
"""Default number of candidates of a side, and of generations: those of Floreano and Nolfi (1997)."""


@record
class Side:
    """A side of a contest.

    Args:
        name: Its name, with which its champion's file and its columns in the log begin.
        controller: The controller of its robots; it must state the number of its parameters.
        fitness: Maps the measures of its robots, by name float64 [pair, world], to its fitness, float64 [pair]; more is
            better. Left out, it is `kiks.learn.task.cautious_mean` of the first measure.
        robot: Kind of its robots: a name or a robot file.
        robots: Number of its robots in each world.
    """

    name: Annotated[Text, Field(pattern=r"^[^\W\d]\w{0,29}$"), Rule("1 to 30 letters, digits and _, no digit first")]
    controller: Annotated[Controller, Field(description="Write @kiks.controller(parameters=COUNT) over the function.")]
    fitness: Fitness | None = None
    robot: Text = "khepera"
    robots: Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)] = 1

    # Functions cannot be compared: a side equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __post_init__(self) -> None:
        if not self.controller.parameter_count:
            raise ParameterError(
                f"the controller of a side must state the number of its parameters, but {shown(self.controller)} does "
                "not. Write @kiks.controller(parameters=COUNT) over the function."
            )

    @property
    def parameter_count(self) -> int:
        """Number of parameters of its controller."""
        return self.controller.parameter_count or 0


@record
class Contest(InWorlds):
    """A contest of two sides: which evaluates pairs.

    A candidate of the evaluation is a pair: the parameters of the first side's controller, then those of the second
    side's. In each world the robots of the first side come first.

    Args:
        name: Its name.
        sides: The two sides, with different names.
        arenas: Arenas of the contests.
        measures: The measures, each with a different name. Each robot is measured.
        seconds: Time for which the robots drive in each world [s].
        worlds: Number of worlds of a pair; a multiple of the number of arenas.
        apart_mm: Least distance between the edges of two robots at a random start [mm].
        timing: Timing of the control loop; that of a program on a line of 9600 baud if left out.
        starts: 'random' for free places anywhere, or 'arena' for the starts of the arena.
        spread: Standard deviation of each parameter in the first generation.
        population: How many candidates each side has, unless the user says otherwise.
        generations: How many generations a co-evolution has, unless the user says otherwise.
        about: A description in one line.
        file: The user's file that defines it.

    Example:
        >>> import kiks
        >>> @kiks.controller(parameters=2)
        ... def ahead(sensors, memory, parameters, wheels):
        ...     wheels[:] = parameters
        >>> contest = Contest("race", (Side("left", ahead), Side("right", ahead)), [kiks.Arena.box(500, 500)],
        ...                   [kiks.measures.path_mm], seconds=1)
        >>> contest.evaluate(np.array([[3.0, 3.0, 0.0, 0.0]]), np.zeros(1, np.int64), 1)[:, :2].round(1)
        array([[20.4,  0. ]])
    """

    name: Text
    sides: tuple[Side, Side]
    arenas: Arenas
    measures: Annotated[tuple[Measure, ...], Field(min_length=1, max_length=MEASURES_MAX)]
    seconds: Seconds = 30.0
    worlds: Annotated[Whole, Field(ge=1, le=WORLDS_MAX)] = 1
    apart_mm: Annotated[Number, Field(ge=0, le=1e6)] = 0.0
    timing: Timing = field(default_factory=Timing)
    starts: Starts = "random"
    spread: Annotated[Number, Field(gt=0, le=1000)] = SPREAD
    population: Annotated[Whole, Field(ge=4)] = POPULATION
    generations: Annotated[Whole, Field(ge=1)] = GENERATIONS
    about: Text = ""
    file: str = ""

    # Functions cannot be compared: a contest equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __post_init__(self) -> None:
        check_even("worlds", self.worlds, self.arenas)
        for what, names in (("sides", self.side_names), ("values of sides", self.value_names)):
            if len(set(names)) != len(names):
                raise ParameterError(f"{what} must have different names, but they were {shown(names)}.")

    @property
    def side_names(self) -> tuple[str, str]:
        """Names of the sides."""
        first, second = self.sides
        return first.name, second.name

    @property
    def value_names(self) -> tuple[str, ...]:
        """Names of the values of a pair: the fitness of both sides, then the measures of the first, of the second."""
        return (*self.side_names, *(f"{side}_{name}" for side in self.side_names for name in self.measure_names))

    @property
    def controllers(self) -> list[Controller]:
        """The controller of each robot of a world."""
        return [side.controller for side in self.sides for _ in range(side.robots)]

    @property
    def robot_kinds(self) -> list[str]:
        """The kind of each robot of a world."""
        return [side.robot for side in self.sides for _ in range(side.robots)]

    @property
    def specs(self) -> list[RobotSpec]:
        """What each robot of a world is."""
        return specs_of(self.robot_kinds, None, None)

    @property
    def robots(self) -> int:
        """Number of robots in a world."""
        return len(self.robot_kinds)

    @property
    def parameter_count(self) -> int:
        """Number of parameters of a pair."""
        return sum(side.parameter_count for side in self.sides)

    def parameters_of(self, pairs: Floats) -> list[Floats]:
        """Return the parameters of each robot of a world, float64 [..., parameter] of pairs [..., parameter]."""
        first, second = self.sides
        parts = pairs[..., : first.parameter_count], pairs[..., first.parameter_count :]
        return [part for side, part in zip((first, second), parts, strict=True) for _ in range(side.robots)]

    def digest(self) -> dict[str, str]:
        """Return the fingerprint of each argument on which values depend, by its name, as `Task.digest` does."""
        return digest_of(self, sides=[vars(side) | {"robot": RobotSpec.load(side.robot)} for side in self.sides])

    def _evaluate(self, pairs: Floats, seeds: Integers, threads: int | None, seconds: float) -> Floats:
        if pairs.shape[1] != self.parameter_count:
            counts = " and ".join(f"{side.parameter_count} of the {side.name}" for side in self.sides)
            raise ParameterError(
                f"a pair must have {self.parameter_count} parameters ({counts}), but their number was {pairs.shape[1]}."
            )
        count, specs = len(pairs), self.specs
        batch = Batch(
            self.arenas,
            count * self.worlds,
            robot=[specs] * (count * self.worlds) if len(set(specs)) > 1 else specs[0],
            robots=self.robots,
            seed=(seeds[:, None] + np.arange(self.worlds)).ravel(),
            starts=self.start_poses(seeds),
            timing=self.timing,
            threads=threads,
        )
        given = self.parameters_of(np.repeat(pairs, self.worlds, axis=0))
        values = batch.run(self.controllers, given, seconds=seconds, measures=self.measures).values
        values = values.reshape(count, self.worlds, self.robots, len(self.measures))
        parts = np.split(values, [self.sides[0].robots], axis=2)
        of_sides = [part.mean(axis=2) for part in parts]
        scores = [
            fitness_of(side.fitness, self.measure_names, each) for side, each in zip(self.sides, of_sides, strict=True)
        ]
        return np.column_stack([*scores, *(each.mean(axis=1) for each in of_sides)])
