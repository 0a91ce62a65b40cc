"""A task: the worlds, measures and fitness for which a controller is evolved, or two that meet in these worlds."""

from __future__ import annotations

import pickle
from collections.abc import Collection, Iterable, Sequence
from dataclasses import field, fields, replace
from functools import cached_property, lru_cache
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from kiks.batch.batch import Batch
from kiks.batch.initial_state import Arenas, Starts, random_starts
from kiks.batch.loop_timing import Timing
from kiks.control.controller import Controller
from kiks.control.controllers import SPEED_LIMIT
from kiks.control.measure import Measure
from kiks.control.measures import trajectory
from kiks.errors import ParameterError, counted, shown
from kiks.learn.algorithm_name import AlgorithmName, parse_algorithm
from kiks.learn.champion import Champion
from kiks.learn.evaluation import Floats, Integers, check_candidates, check_seeds
from kiks.learn.exam import Exam, project_in
from kiks.learn.experiment import CLEAR_MM, Experiment, Fitness, fitness_of
from kiks.learn.fingerprint import fingerprints
from kiks.meant import nearest
from kiks.model.arena import Arena, Pose
from kiks.model.checks import ROBOTS_MAX, check_count, check_number
from kiks.model.data_file import Number, Rule, Text, Whole, record
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import RobotSpec, specs_of

GENERATIONS, POPULATION = 60, 40
"""Default numbers of generations, and of candidates in a generation."""

SPREAD = 3.0
"""Standard deviation of each parameter at the beginning: three times the usual scale of controllers, so that some of
the first candidates react sharply."""

WORLDS_MAX, MEASURES_MAX = 100_000, 100
"""Largest number of worlds of a candidate, and of measures."""

BATCH_WORLDS_MAX = 20_000
"""Largest number of worlds in a batch: more need more memory and run no faster."""

SECONDS_MIN, SECONDS_MAX = 1e-3, 1e6
"""Shortest and longest time for which candidates drive [s]."""

LOGGED = ("generation", "candidate", "is_trial", "seed", "fitness", "champion_fitness", "seconds", "evaluations")
"""Columns of the log of an evolution beside the measures."""

_UNCOUNTED = {"name", "side", "reward", "file", "algorithm", "population", "generations"}
"""Arguments on which no value depends."""

Seconds = Annotated[Number, Field(ge=SECONDS_MIN, le=SECONDS_MAX)]

Kinds = Annotated[
    Text | RobotSpec | Annotated[tuple[Text | RobotSpec, ...], Field(min_length=1)],
    Rule("the name of a robot, a robot file or a kiks.RobotSpec, or a list of them"),
]
Evolvable = Annotated[Controller, Field(description="Write @kiks.controller(parameters=COUNT) over the function.")]
Watched = Annotated[Measure, Field(description="Write @kiks.measure over the function.")]
SideName = Annotated[
    Text, Field(pattern=r"^([^\W\d]\w{0,29})?$"), Rule("1 to 30 letters, digits and _, no digit first")
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

    Example:
        >>> import kiks
        >>> kiks.Axis("path_mm", 0, 2000, cells=10)
        Axis(measure='path_mm', low=0.0, high=2000.0, cells=10)
    """

    measure: Text
    low: Number
    high: Number
    cells: Annotated[Whole, Field(ge=1, le=10_000)] = 20

    def __post_init__(self) -> None:
        if self.low >= self.high:
            raise ParameterError(f"an axis must lead from low to high, but it led from {self.low:g} to {self.high:g}.")


def check_axes(axes: Iterable[Axis], names: Collection[str]) -> None:
    """Check that axes lead along some of the measures of these names."""
    for axis in axes:
        if axis.measure not in names:
            named = f"it named {shown(axis.measure)}.{nearest(axis.measure, names)}"
            raise ParameterError(f"an axis must name one of {', '.join(names)}, but {named}")


@record
class Side:
    """One side of a task: robots with one controller.

    Args:
        name: Its name, with which its champion's file and its columns in the log begin.
        controller: The controller of its robots; it must state the number of its parameters.
        fitness: Maps the measures of its robots, by name float64 [candidate, world], to its fitness, float64
            [candidate]; more is better. Left out, it is `cautious_mean` of the first measure.
        robot: Kind of its robots: a name, a robot file or a `RobotSpec`; or several, which worlds take in turn.
        robots: Number of its robots in each world.

    Example:
        >>> import kiks
        >>> kiks.Side("prey", kiks.controllers.linear(speed_limit=12), robots=2).parameter_count
        18
    """

    name: SideName
    controller: Evolvable
    fitness: Fitness | None = None
    robot: Kinds = "khepera"
    robots: Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)] = 1

    # Functions cannot be compared: a side equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __repr__(self) -> str:
        return f"<Side {self.name!r}: {counted(self.robots, 'robot')} with {self.controller!r}>"

    def __post_init__(self) -> None:
        if not self.controller.parameter_count:
            raise ParameterError(
                f"a controller that evolves must state the number of its parameters, but {shown(self.controller)} does "
                "not. Write @kiks.controller(parameters=COUNT) over the function."
            )

    @property
    def parameter_count(self) -> int:
        """Number of parameters of its controller."""
        return self.controller.parameter_count or 0

    @cached_property
    def specs(self) -> tuple[RobotSpec, ...]:
        """What the robots are that worlds take in turn."""
        return tuple(specs_of(self.robot if isinstance(self.robot, tuple) else (self.robot,), None, None))


@record
class Task(Experiment):
    """A task for which controllers are evolved.

    A candidate is the parameters of a controller. It drives in `worlds` worlds, which the arenas share evenly; or each
    world has another of many arenas. The measures, averaged over a world's robots, become one number, its fitness.

    A task with another side `against` evolves two controllers, which meet in these worlds. A candidate is then a pair:
    the parameters of the first side's controller, followed by those of the other side's. The robots of the first side
    come first in each world.

    Args:
        name: Its name.
        arenas: Arenas for training. If they are more than the worlds, each generation draws others of them, all
            different.
        controller: The controller to evolve; it must state the number of its parameters.
        measures: The measures, each with a different name.
        fitness: Maps the measures, by name float64 [candidate, world], to the fitness, float64 [candidate]; more is
            better. Left out, it is `cautious_mean` of the first measure.
        seconds: Time for which a candidate drives in each world [s].
        worlds: Number of worlds; a multiple of the number of arenas, or fewer than these.
        axes: Axes along which behaviours differ, for algorithms that look for many of them.
        objectives: Names of fitness or measures of which more is better, or less with a minus before the name, for
            algorithms with several objectives. Fitness still decides who is the champion.
        robot: Kind of robot: a name, a robot file or a `RobotSpec`. Or several, such as a `family`: the worlds of a
            candidate take them in turn, each generation from another one on. Champions drive the first.
        robots: Number of robots in each world, all with the same controller.
        against: The other side, which evolves as well; None if there is none.
        side: Name of the first side, if there are two.
        apart_mm: Least distance between the edges of two robots at a random start [mm].
        timing: Timing of the control loop; that of a program on a line of 9600 baud if left out. Or several, which
            the worlds take in turn like the robots.
        starts: 'random' for free places anywhere, or 'arena' for the starts of the arena. If generations draw arenas, a
            lone robot takes a start that is drawn from those of its arena.
        spread: Standard deviation of each parameter in the first generation.
        algorithm: The algorithm of an evolution, unless the user says otherwise.
        generations: How many generations an evolution has, unless the user says otherwise.
        population: How many candidates of a side a generation has, unless the user says otherwise.
        exam: The exam of its champions.
        reward: A measure whose first note accumulates: in the task's environment (`kiks.learn.environments`), its gain
            in a step is the reward of that step. Evolutions do not use it.
        until: A measure that ends the trial of a world before `seconds` are over, and an episode of the environment:
            no further control step begins there once its first note is above zero for one of its robots.
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
        >>> [each.shape for each in task.parameters_of(np.zeros((5, 2)))], len(task.arenas_of(seed=1))
        ([(5, 2)], 2)
        >>> task.individual(np.array([3.0, 3.0]), seed=1, world=1)
        <Champion of 'far': <Controller 'ahead': proximity; 2 parameters>, fitness 0>
        >>> list(task.digest())[:3]
        ['arenas', 'controller', 'measures']
        >>> race = task.with_changes(side="left", against=Side("right", ahead))
        >>> race.evaluate(np.array([[3.0, 3.0, 0.0, 0.0]]), np.zeros(1, np.int64), 1).round(1)
        array([[20.4, 20.4,  0. ,  0. ]])
    """

    name: Text
    arenas: Arenas
    controller: Evolvable
    measures: Annotated[tuple[Measure, ...], Field(min_length=1, max_length=MEASURES_MAX)]
    fitness: Fitness | None = None
    seconds: Seconds = 30.0
    worlds: Annotated[Whole, Field(ge=1, le=WORLDS_MAX)] = 1
    axes: tuple[Axis, ...] = ()
    objectives: Annotated[tuple[Text, ...], Field(max_length=MEASURES_MAX)] = ()
    robot: Kinds = "khepera"
    robots: Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)] = 1
    against: Side | None = None
    side: SideName = ""
    apart_mm: Annotated[Number, Field(ge=0, le=1e6)] = CLEAR_MM
    timing: Timings = field(default_factory=Timing)
    starts: Starts = "random"
    spread: Annotated[Number, Field(gt=0, le=1000)] = SPREAD
    algorithm: Text = AlgorithmName.CMA.value
    generations: Annotated[Whole, Field(ge=1)] = GENERATIONS
    population: Annotated[Whole, Field(ge=4)] = POPULATION
    exam: Annotated[Exam | None, Field(description="kiks.Exam(arenas, measures, solved) makes one.")] = None
    reward: Watched | None = None
    until: Watched | None = None
    file: str = ""
    other_columns: ClassVar = LOGGED

    # Functions cannot be compared: a task equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __repr__(self) -> str:
        worlds = counted(self.worlds, "world")
        return f"<{type(self).__name__} {self.name!r}: {self.controller!r} in {worlds} of {self.seconds:g} s>"

    def __post_init__(self) -> None:
        Experiment.__post_init__(self)
        sides = [side.name for side in self.sides]
        if self.against is not None and ("" in sides or sides[0] == sides[1]):
            raise ParameterError(f"sides must have different names, but they were {shown(tuple(sides))}.")
        names = self.measure_names
        check_axes(self.axes, names)
        for objective in self.objectives:
            if objective.removeprefix("-") not in (known := ("fitness", *names)):
                raise ParameterError(
                    f"an objective must name one of {', '.join(known)}, with a minus before it if less is better, but "
                    f"it named {shown(objective)}.{nearest(objective, known)}"
                )
        parse_algorithm(self.algorithm)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickled, (_pickled(self),)

    def __deepcopy__(self, memo: dict[int, Any]) -> Task:
        return self  # as it never changes

    def with_changes(self, **changes: Any) -> Task:
        """Return a copy with some arguments changed; another kind of robot brings the speed of its lines with it."""
        if "robot" in changes and "timing" not in changes:
            robot = changes["robot"]
            spec, *_ = specs_of(robot if isinstance(robot, list | tuple) else [robot], None, None)
            if spec.kind != self.sides[0].specs[0].kind:
                timings = (replace(each, baud=each.baud and spec.firmware.baud) for each in self.timings)
                changes["timing"] = timing if len(timing := tuple(timings)) > 1 else timing[0]
        return super().with_changes(**changes)

    @cached_property
    def sides(self) -> tuple[Side, ...]:
        """Its sides: one or two."""
        first = Side(self.side, self.controller, self.fitness, self.robot, self.robots)
        return (first,) if self.against is None else (first, self.against)

    @property
    def value_names(self) -> tuple[str, ...]:
        """Names of the values of a candidate: fitness, then the measures; of two sides, one after the other."""
        names = ("fitness", *self.measure_names)
        return names if self.against is None else tuple(f"{side.name}_{name}" for side in self.sides for name in names)

    @property
    def timings(self) -> tuple[Timing, ...]:
        """The timings that worlds take in turn."""
        return self.timing if isinstance(self.timing, tuple) else (self.timing,)

    @property
    def speed_limit(self) -> float:
        """Wheel speed of an output of 1 [pulses/10 ms]: that of its controller."""
        limit: float = (self.controller.recipe or {}).get("speed_limit", SPEED_LIMIT)
        return limit

    @property
    def controllers(self) -> list[Controller]:
        """The controller of each robot of a world."""
        return [side.controller for side in self.sides for _ in range(side.robots)]

    @property
    def parameter_count(self) -> int:
        """Number of parameters of a candidate."""
        return sum(side.parameter_count for side in self.sides)

    @property
    def driven_s(self) -> float:
        """Total time for which the robots of a candidate drive [s]."""
        return float(self.worlds * len(self.controllers) * self.seconds)

    def parameters_of(self, candidates: Floats) -> list[Floats]:
        """Return the parameters of each robot of a world, float64 [..., parameter] of candidates [..., parameter]."""
        parts = np.split(candidates, [self.sides[0].parameter_count], axis=-1)
        return [part for side, part in zip(self.sides, parts, strict=False) for _ in range(side.robots)]

    @property
    def draws_arenas(self) -> bool:
        """Whether there are more arenas than worlds, of which each generation draws others."""
        return len(self.arenas) > self.worlds

    def arenas_of(self, seed: int) -> list[Arena]:
        """Return the arena of each world of a candidate with such a seed, always the same for the same seed."""
        count, seed = len(self.arenas), check_count("seed", seed, most=2**63 - 1)
        numbers = np.random.default_rng((seed, count)).permutation(count) if self.draws_arenas else range(count)
        return [self.arenas[numbers[world % count]] for world in range(self.worlds)]

    def start_poses(self, seeds: Integers) -> Floats | None:
        """Return the starts of candidates with such seeds, float64 [candidate and world, robot, 3].

        They are the same for the same seed; None for those that the arena gives all seeds.

        Example:
            >>> import numpy as np
            >>> import kiks
            >>> task = kiks.tasks.avoid(seconds=1, worlds=4)
            >>> task.start_poses(np.array([1, 2])).shape
            (8, 1, 3)
        """
        every = check_seeds(seeds).tolist()
        if self.starts == "arena" and not self._draws_starts:
            return None
        poses = {seed: self._starts_of(seed) for seed in dict.fromkeys(every)}
        return np.concatenate([np.empty((0, len(self.controllers), 3)), *(poses[seed] for seed in every)])

    @property
    def _draws_starts(self) -> bool:
        """Whether a lone robot takes a start that is drawn from those of its arena, which is drawn itself."""
        is_lone = self.robots == 1 and self.against is None
        return self.draws_arenas and is_lone and all(arena.starts for arena in self.arenas)

    def _starts_of(self, seed: int) -> Floats:
        """Return the starts of a candidate with a seed, float64 [world, robot, 3]."""
        if self.starts == "arena":
            rng = np.random.default_rng((seed, len(self.arenas), 1))
            drawn = [arena.starts[rng.integers(len(arena.starts))] for arena in self.arenas_of(seed)]
            return np.array(drawn).reshape(-1, 1, 3)
        radius_mm = max(spec.body.radius_mm for side in self.sides for spec in side.specs)
        given: dict[str, Any] = {"robots": len(self.controllers), "radius_mm": radius_mm, "apart_mm": self.apart_mm}
        if not self.draws_arenas:
            return self.random_starts(seed, **given)
        each = enumerate(self.arenas_of(seed))
        return np.concatenate([random_starts(arena, 1, seed=seed + k, clear_mm=CLEAR_MM, **given) for k, arena in each])

    def project(self) -> Project:
        """Return the project in which its champions are shown: that of their exam, or of training if there is none.

        Example:
            >>> import kiks
            >>> kiks.tasks.maze().project().arena.name
            'kheperax'
        """
        if self.exam is not None:
            return self.exam.project(self.sides[0].specs[0], self.robots)
        arenas, poses, robots = self.arenas_of(0), self.start_poses(np.zeros(1, np.int64)), len(self.controllers)
        here = [each is arenas[0] for each in arenas]
        return project_in(arenas[0], None if poses is None else poses[here].reshape(-1, 3), robots, 0)

    def individual(self, parameters: Floats, seed: int, world: int = 0) -> Champion:
        """Return a candidate of a task of one side as a champion, whose world is one of those of its evaluation.

        On a line, the world then takes the course that it takes in the evaluation, to the bit.

        Args:
            parameters: Its parameters, float64 [parameter].
            seed: Its seed.
            world: Number of the world, from 0.
        """
        if self.against is not None:
            raise ParameterError(f"the task must have one side, but {self.name} has two. Show its champions instead.")
        world, seeds = check_count("world", world, 0, self.worlds - 1), np.array([seed])
        turns, timings = self._turns(seeds)
        arena = self.arenas_of(seed)[world]
        if (starts := self.start_poses(seeds)) is not None:
            arena = replace(arena, starts=tuple(Pose(*each) for each in starts[world].tolist()))
        specs = self.sides[0].specs
        return Champion(
            controller=self.controller,
            parameters=tuple(parameters.tolist()),
            task=self.name,
            robot=specs[turns[world] % len(specs)],
            timing=self.timings[timings[world]],
            world=Project(arena, robots=(ProjectRobot(),) * self.robots, seed=seed + world, seconds=self.seconds),
        )

    def digest(self) -> dict[str, str]:
        """Return the fingerprint of each argument on which the values of candidates or the exam depend, by its name.

        They are the same in each process, in each folder and on each computer (`kiks.learn.fingerprint`).
        """
        counted = {each.name: getattr(self, each.name) for each in fields(self) if each.name not in _UNCOUNTED}
        first, *others = (
            {"controller": side.controller, "fitness": side.fitness, "robot": side.specs, "robots": side.robots}
            for side in self.sides
        )
        return fingerprints(counted | first | {"timing": self.timings, "against": others})

    # ---- evaluation ----

    def evaluate(
        self, candidates: Floats, seeds: Integers, threads: int | None = None, seconds: float | None = None
    ) -> Floats:
        """Return the values of candidates.

        Args:
            candidates: Parameters [candidate, parameter].
            seeds: A seed for each [candidate]: of its worlds and its starts.
            threads: Number of threads; the number of cores if left out.
            seconds: Time for which they drive [s], if not that of the task.

        Returns:
            The values that `value_names` lists, the measures averaged over worlds, float64 [candidate, value].

        Example:
            >>> import kiks
            >>> task = kiks.tasks.avoid()
            >>> import numpy as np
            >>> values = task.with_changes(seconds=1, worlds=3).evaluate(np.zeros((2, 18)), np.zeros(2, np.int64), 1)
            >>> values.shape
            (2, 6)
        """
        candidates, seeds = check_candidates(candidates, seeds)
        if candidates.shape[1] != self.parameter_count:
            counts = " and ".join(f"{side.parameter_count} of the {side.name}" for side in self.sides if side.name)
            raise ParameterError(
                f"a candidate must have {counted(self.parameter_count, 'parameter')}{counts and f' ({counts})'}, but "
                f"their number was {candidates.shape[1]}."
            )
        seconds = self.seconds if seconds is None else check_number("seconds", seconds, SECONDS_MIN, SECONDS_MAX)
        size = max(1, BATCH_WORLDS_MAX // self.worlds)
        parts = [slice(first, first + size) for first in range(0, len(candidates), size)]
        values = [self._evaluate(candidates[part], seeds[part], threads, seconds) for part in parts]
        return np.concatenate([np.empty((0, len(self.value_names))), *values])

    def _evaluate(self, candidates: Floats, seeds: Integers, threads: int | None, seconds: float) -> Floats:
        measured = self._measured(candidates, seeds, threads, seconds, self.measures)
        values = []
        for side, part in zip(self.sides, np.split(measured, [self.robots], axis=1), strict=False):
            means = part.mean(axis=1).reshape(len(candidates), self.worlds, -1)
            values += [fitness_of(side.fitness, self.measures, means), means.mean(axis=1)]
        return np.column_stack(values)

    def trajectories(self, candidates: Floats, seeds: Integers, points: int, threads: int | None = None) -> Floats:
        """Return where the robots of candidates drive in their evaluation.

        Args:
            candidates: Parameters [candidate, parameter].
            seeds: A seed for each [candidate]: of its worlds and its starts.
            points: Number of poses, at the last control step of each of as many equal intervals.
            threads: Number of threads; the number of cores if left out.

        Returns:
            x_mm, y_mm and heading_rad, float64 [candidate, world, robot, point, 3].

        Example:
            >>> import numpy as np
            >>> import kiks
            >>> task = kiks.tasks.avoid(seconds=1, worlds=4)
            >>> task.trajectories(np.zeros((2, 18)), np.zeros(2, np.int64), points=5).shape
            (2, 4, 1, 5, 3)
        """
        candidates, seeds = check_candidates(candidates, seeds)
        way = trajectory(seconds=self.seconds, points=points)
        measured = self._measured(candidates, seeds, threads, self.seconds, [way])
        return measured.reshape(len(candidates), self.worlds, -1, points, 3)

    def _measured(
        self, candidates: Floats, seeds: Integers, threads: int | None, seconds: float, measures: Sequence[Measure]
    ) -> Floats:
        """Return what measures see, float64 [candidate and world, robot, value]."""
        starts, (turns, timings) = self.start_poses(seeds), self._turns(seeds)
        drawn = {seed: self.arenas_of(seed) for seed in dict.fromkeys(seeds.tolist())}
        arenas = [arena for seed in seeds.tolist() for arena in drawn[seed]]
        world_seeds = (seeds[:, None] + np.arange(self.worlds)).ravel()
        given = self.parameters_of(np.repeat(candidates, self.worlds, axis=0))
        robots = [side.specs for side in self.sides for _ in range(side.robots)]
        is_one_kind = len({spec for specs in robots for spec in specs}) == 1
        measured = np.zeros((len(turns), len(robots), sum(len(each.value_names) for each in measures)))
        for number in np.unique(timings).tolist():
            here = np.flatnonzero(timings == number)
            each = [tuple(specs[turn % len(specs)] for specs in robots) for turn in turns[here].tolist()]
            batch = Batch(
                [arenas[world] for world in here.tolist()],
                len(here),
                robot=robots[0][0] if is_one_kind else each,
                robots=len(robots),
                seed=world_seeds[here],
                starts=None if starts is None else starts[here],
                timing=self.timings[number],
                threads=threads,
            )
            parameters = [part[here] for part in given]
            ends: dict[str, Any] = {"seconds": seconds, "until": self.until}
            measured[here] = batch.run(self.controllers, parameters, measures=measures, **ends).values
        return measured

    def _turns(self, seeds: Integers) -> tuple[Integers, Integers]:
        """Return the turn of each world's kinds of robots and the number of its timing, int64 [world].

        The arenas' turn comes round faster than the others': each arena gets all robots, each robot all timings.
        """
        world = np.arange(self.worlds)
        turn = (seeds[:, None] % 2**32 + world // len(self.arenas)).ravel()
        kinds = max(len(side.specs) for side in self.sides)
        return turn + np.tile(world % len(self.arenas), len(seeds)), turn // kinds % len(self.timings)


@lru_cache(maxsize=4)
def _pickled(task: Task) -> bytes:
    """Return the arguments of a task. Functions are pickled by value: other computers do not have the user's file."""
    from numba import cloudpickle

    dumps: Any = cloudpickle.dumps
    pickled: bytes = dumps({each.name: getattr(task, each.name) for each in fields(task)})
    return pickled


@lru_cache(maxsize=4)
def _unpickled(pickled: bytes) -> Task:
    """Return a task: the same for the same bytes, so that a worker compiles its functions once."""
    return Task(**pickle.loads(pickled))
