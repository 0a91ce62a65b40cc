"""An exam: a champion drives where it was not trained, from many starts, and each start is solved or not.

A batch whose loops have the timing of a serial line is that line to the bit. So an exam says how the champion does on
a line, and takes a fraction of a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.batch.batch import Batch
from kiks.batch.initial_state import Arenas, Starts
from kiks.batch.number_table import NumberTable
from kiks.control.measure import Measure
from kiks.errors import ParameterError, counted, shown
from kiks.learn.champion import Champion
from kiks.learn.evaluation import Floats
from kiks.learn.experiment import Experiment
from kiks.meant import nearest
from kiks.model.arena import Arena
from kiks.model.arena_objects import THINGS_MAX
from kiks.model.checks import check_kind
from kiks.model.columns import Columns
from kiks.model.data_file import Number, Text, Whole, record
from kiks.model.family import family
from kiks.model.formula import Formula
from kiks.model.goal import FormulaText, number_of
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import RobotSpec, specs_of
from kiks.sim.from_project import rounded_pose
from kiks.upwards import save_columns, shown_in_notebooks

PASS_SHARE = 0.9
"""Share of the starts that a champion must solve to pass."""

EXAM_SEED = 2**40
"""Seed of the first start of each exam; evolutions draw theirs from others."""

IMPERFECT = 10
"""Number of imperfect robots with which an exam is taken again."""

STARTS_MAX, MEASURES_MAX = 10_000, 100
"""Most starts and measures of an exam."""


@shown_in_notebooks("kiks.export.notebook", "table")
@dataclass(frozen=True, repr=False)
class ExamResult:
    """How a champion did in an exam.

    Attributes:
        solved: Whether each start was solved, bool [start].
        values: The measures of each start, float64 [start, measure]; of several robots, their mean.
        measures: Names of the measures.
        goal: What a solved start shows.
    """

    solved: NDArray[np.bool_]
    values: Floats
    measures: tuple[str, ...]
    goal: str

    @property
    def is_passed(self) -> bool:
        """Whether enough starts were solved."""
        return bool(self.solved.sum() >= PASS_SHARE * len(self.solved))

    def __repr__(self) -> str:
        return f"<{self}>"

    def __str__(self) -> str:
        verdict = "solved" if self.is_passed else "not solved"
        goal = f" ({self.goal})" if self.goal else ""
        return f"Exam: {verdict}, {int(self.solved.sum())} of {len(self.solved)} starts{goal}"

    def table(self) -> NumberTable:
        """Return a table of all starts: whether each was solved, 1 or 0, and its measures."""
        values = np.column_stack([self.solved, self.values])
        return NumberTable({"start": len(self.solved)}, ("solved", *self.measures), values)

    def columns(self) -> Columns:
        """Return all starts as columns, [start] each, as `pandas.DataFrame` takes them: start, solved, the measures."""
        numbers = dict(zip(self.measures, self.values.T, strict=True))
        return {"start": np.arange(len(self.solved)), "solved": self.solved, **numbers}

    def save(self, path: str | Path) -> None:
        """Write all starts as a table, a .csv, .parquet or .mat file: see `columns`."""
        save_columns(self.columns(), path)


@record
class Exam(Experiment):
    """An exam for champions.

    Args:
        arenas: Arenas, which the starts take in turn; best such in which none trained.
        measures: What is measured, each with a different name.
        solved: Formula over the measures that says whether a start is solved, as that of a `goal` of a project.
        goal: What a solved start shows, in some words.
        seconds: Time for which the champion drives from each start [s].
        until: A measure that ends the drive from a start earlier, as that of a task.
        worlds: Number of starts; a multiple of the number of arenas.
        starts: 'random' for free places anywhere, or 'arena' for the start poses of the arenas: lone robots take those
            of an arena in turn, each with noise of its own.

    Example:
        >>> import kiks
        >>> @kiks.controller(parameters=2)
        ... def ahead(sensors, memory, parameters, wheels):
        ...     wheels[:] = parameters
        >>> exam = Exam([kiks.Arena.box(900, 900)], [kiks.measures.path_mm], "path_mm > 30", goal="drove 30 mm",
        ...             seconds=2, worlds=4)
        >>> print(exam.examine(kiks.Champion(ahead, (3, 3))))
        Exam: solved, 4 of 4 starts (drove 30 mm)
        >>> exam.solved_in(np.array([[20.0], [40.0]])).tolist()
        [False, True]
        >>> exam.project("khepera").arena.width_mm
        900.0
    """

    arenas: Arenas
    measures: Annotated[tuple[Measure, ...], Field(min_length=1, max_length=MEASURES_MAX)]
    solved: Annotated[FormulaText, Field(description="Such as 'contacts == 0 and path_mm > 500'.")]
    goal: Text = ""
    seconds: Annotated[Number, Field(ge=1e-3, le=1e5)] = 180.0
    worlds: Annotated[Whole, Field(ge=1, le=STARTS_MAX)] = 20
    starts: Starts = "random"
    until: Annotated[Measure | None, Field(description="Write @kiks.measure over the function.")] = None
    other_columns: ClassVar = ("start", "solved")

    # Functions cannot be compared: an exam equals itself only.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def __post_init__(self) -> None:
        Experiment.__post_init__(self)
        for term in Formula(self.solved).all_terms():
            if str(term) not in self.measure_names:
                known = ", ".join(self.measure_names)
                raise ParameterError(
                    f"solved must use the measures of the exam, {known}, but {shown(str(term))} is none of them."
                    f"{nearest(str(term), self.measure_names)}"
                )

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {counted(self.worlds, 'start')} of {self.seconds:g} s, {self.goal!r}>"

    def examine(self, champion: Champion, *, robots: int = 1, kinds: Sequence[RobotSpec] | None = None) -> ExamResult:
        """Let a champion drive from all starts, with the timing of its own control loop.

        Args:
            champion: The champion.
            robots: Number of robots in each world, all driven by it. A start is that of all of them.
            kinds: Kinds of robots, such as those of `imperfect_robots`. All starts are taken with each, so the result
                has as many times more starts. Left out, the champion's own.
        """
        check_kind("champion", champion, Champion, "kiks.Champion.load() returns one.")
        named = specs_of(champion.robot if kinds is None else kinds, None, None)
        count, poses = self.worlds * len(named), self._poses(champion.robot, robots)
        batch = Batch(
            self.arenas,
            count,
            robot=[(each,) * robots for each in named for _ in range(self.worlds)],
            robots=robots,
            seed=np.tile(EXAM_SEED + np.arange(self.worlds), len(named)),
            starts=None if poses is None else np.tile(poses, (len(named), 1, 1)),
            timing=champion.timing,
        )
        ends: dict[str, Any] = {"seconds": self.seconds, "until": self.until}
        rollouts = batch.run(champion.controller, champion.parameters, measures=self.measures, **ends)
        values = rollouts.values.mean(axis=1)
        return ExamResult(self.solved_in(values), values, rollouts.measures, self.goal)

    def solved_in(self, values: Floats) -> NDArray[np.bool_]:
        """Return whether each start is solved, bool [start], for its measures, float64 [start, measure]."""
        formula = Formula(self.solved)
        columns = [self.measure_names.index(str(term)) for term in formula.terms]
        rows = enumerate(values[:, columns].tolist())
        return np.array([number_of(formula, row, "solved", f"in start {start}") != 0 for start, row in rows], np.bool_)

    def project(self, robot: str | RobotSpec, robots: int = 1) -> Project:
        """Return the project of the first start, in the first arena; the other starts there come after it.

        Args:
            robot: Kind of the robots.
            robots: Number of robots.
        """
        poses = self._poses(robot, robots) if self.starts == "random" else None
        return project_in(
            self.arenas[0], None if poses is None else poses[:: len(self.arenas)].reshape(-1, 3), robots, EXAM_SEED
        )

    def _poses(self, robot: str | RobotSpec, robots: int) -> Floats | None:
        """Return the start poses, float64 [start, robot, 3]; None for those that arenas give several robots."""
        if self.starts == "random":
            (spec,) = specs_of(robot, 1, None)
            return self.random_starts(EXAM_SEED, robots=robots, radius_mm=spec.body.radius_mm)
        if robots > 1 or not all(arena.starts for arena in self.arenas):
            return None
        places = [cycle(arena.starts) for arena in self.arenas]
        return np.array([next(places[k % len(places)]) for k in range(self.worlds)])[:, None]


def imperfect_robots(champion: Champion) -> list[RobotSpec]:
    """Return the family of the champion's robot, for exams: `IMPERFECT` robots, the same for the same kind."""
    (spec,) = specs_of(champion.robot, 1, None)
    return family(spec, IMPERFECT, seed=EXAM_SEED)


def project_in(arena: Arena, poses: Floats | None, robots: int, seed: int) -> Project:
    """Return a project in an arena that fits in a champion's file, which holds headings in degrees.

    Args:
        arena: The arena.
        poses: Start poses [start, 3], which are rounded like those of projects from the desk; the arena's own if None.
        robots: Number of robots.
        seed: Seed of all random numbers.
    """
    starts = tuple(rounded_pose(*pose) for pose in (arena.starts if poses is None else poses[:THINGS_MAX].tolist()))
    return Project(replace(arena, starts=starts), robots=(ProjectRobot(),) * robots, seed=seed)
