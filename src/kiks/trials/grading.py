"""Grades: an exercise, its cases and what students have handed in become trials, and outcomes become grades."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Literal

from kiks.errors import ParameterError, shown
from kiks.model.exercise import STUDENT, Case, Exercise, cases_of
from kiks.model.goal import Goal
from kiks.model.project import Project, project_file
from kiks.ports.program_command import project_commands
from kiks.sim.from_project import in_case
from kiks.trials.marking import AS_POINTS, Marking
from kiks.trials.similarity import Likeness, alike
from kiks.trials.students import identities
from kiks.trials.submissions import Submission
from kiks.trials.trial import Outcome, Outcomes, Trial, limit_of

Attempts = Literal["best", "last"]
"""Which one counts of the submissions of a student."""


@dataclass(frozen=True)
class Grade:
    """What a submission has got.

    Attributes:
        submission: The submission.
        outcomes: What came out in each case; none if it could not be graded.
        days_late: How many days after the due time have begun when it came; None if that is not known.
        mark: What the grade book gets; None if it was not graded.
        like: Names of submissions that are alike, and how much.
    """

    submission: Submission
    outcomes: Outcomes
    days_late: int | None = None
    mark: float | None = None
    like: tuple[tuple[str, float], ...] = ()

    @property
    def problem(self) -> str:
        """Why it was not graded: it cannot be, or a run was lost; empty if it was."""
        return self.submission.problem or next((each.doubt for each in self.outcomes if not each.recording), "")


@dataclass(frozen=True)
class Graded:
    """An exercise with all grades.

    Attributes:
        title: The exercise's title.
        text: Its goal in a line.
        seconds: Its time limit [s of simulated time].
        cases: The cases in which programs were tried.
        grades: The grades, in the order of the submissions.
        likenesses: Pairs of programs that are alike.
        marking: How points became grades.
        is_trusted: Whether the programs ran without a sandbox, which would keep them from what hidden cases tell.
    """

    title: str
    text: str
    seconds: float
    cases: tuple[Case, ...]
    grades: tuple[Grade, ...]
    likenesses: tuple[Likeness, ...]
    marking: Marking = AS_POINTS
    is_trusted: bool = False

    def seen_by(self, grade: Grade) -> Graded:
        """Return what the student of a grade may see: nothing of hidden cases and of others."""
        tried = zip(self.cases, grade.outcomes, strict=False)
        outcomes = Outcomes(outcome for case, outcome in tried if not case.is_hidden)
        cases = tuple(case for case in self.cases if not case.is_hidden)
        return replace(self, cases=cases, grades=(replace(grade, outcomes=outcomes, like=()),), likenesses=())

    @property
    def faults(self) -> list[str]:
        """Sentences about the exercise's own programs that have failed, for which no student is to blame."""
        outcomes = [outcome for grade in self.grades for outcome in grade.outcomes if not outcome.doubt]
        failed = Counter(
            (robot, end.name, str(end))
            for outcome in outcomes
            for robot, end in outcome.failures.items()
            if robot != STUDENT
        )
        return [
            f"{name}, the exercise's program of robot {robot}, failed in {count} of {len(outcomes)} runs ({how}). No "
            "student is to blame: mend it, and grade again."
            for (robot, name, how), count in failed.items()
        ]


def load_exercise(path: Path) -> tuple[Project, Path]:
    """Return a project in which programs can be graded, and its folder.

    Raises:
        ParameterError: If it says neither what is solved nor how long a run may take.
    """
    project = Project.load(path)
    what = shown(str(path))
    if project.goal is None and project.supervisor is None:
        raise ParameterError(
            f"EXERCISE must have a goal, but {what} has none. Write [goal] with solved and points, or name a "
            "supervisor."
        )
    limit_of(project, "EXERCISE", what)
    if not project.robots:
        raise ParameterError(f"EXERCISE must have a robot, but {what} has none. Write [[robot]].")
    return project, project_file(path).parent


def trials_of(
    project: Project,
    folder: Path,
    submissions: Sequence[Submission],
    *,
    is_trusted: bool = False,
    command: str = "",
    user: str = "",
) -> list[Trial]:
    """Return a trial for each submission in each case of an exercise; the submission drives robot 1.

    Args:
        project: The exercise.
        folder: Where it lies.
        submissions: What was handed in.
        is_trusted: Whether the programs run without a sandbox.
        command: The command that has begun it, for the recordings.
        user: See `Trial`.
    """
    cases = cases_of(project.cases)
    worlds = [in_case(project, case, folder) for case in cases]
    width = len(str(len(cases)))
    trials = []
    for submission in submissions:
        if submission.command is None:
            continue
        for number, world in enumerate(worlds, 1):
            others = project_commands(world, folder)[1:]
            name = f"{submission.id}/{number:0{width}}"
            trials.append(Trial(name, world, folder, (submission.command, *others), is_trusted, command, user))
    return trials


def grade(
    project: Project,
    submissions: Sequence[Submission],
    outcomes: Sequence[Outcome],
    *,
    title: str = "",
    marking: Marking = AS_POINTS,
    attempts: Attempts | None = None,
    is_trusted: bool = False,
) -> Graded:
    """Grade submissions by what has come out of their trials.

    Args:
        project: The exercise.
        submissions: What was handed in.
        outcomes: Those of the trials that `trials_of` returned for these submissions.
        title: Its title if it says none.
        marking: How points become grades.
        attempts: Which one of the submissions of a student counts; each is a grade of its own if left out.
        is_trusted: Whether the programs ran without a sandbox.
    """
    rest = iter(outcomes)
    cases = cases_of(project.cases)
    grades = []
    for submission in submissions:
        count = 0 if submission.command is None else len(cases)
        made = Grade(submission, Outcomes(islice(rest, count)), marking.days_late(submission))
        if not made.problem:
            made = replace(made, mark=marking.grade_of(made.outcomes.points, made.days_late))
        grades.append(made)
    if attempts is not None:
        grades = _chosen(grades, attempts)
    exercise, goal = project.exercise or Exercise(), project.goal or Goal()
    names = {each.submission.id: each.submission.name for each in grades}
    like: dict[str, list[tuple[str, float]]] = {id: [] for id in names}
    likenesses = alike(
        {each.submission.id: "\n".join(each.submission.files.values()) for each in grades}, exercise.template
    )
    for pair in likenesses:
        like[pair.first].append((names[pair.second], pair.share))
        like[pair.second].append((names[pair.first], pair.share))
    return Graded(
        exercise.title or title or project.arena.name,
        goal.text,
        project.seconds or 0.0,
        tuple(cases),
        tuple(replace(each, like=tuple(like[each.submission.id])) for each in grades),
        tuple(Likeness(names[each.first], names[each.second], each.share) for each in likenesses),
        marking,
        is_trusted,
    )


def _chosen(grades: Sequence[Grade], attempts: Attempts) -> list[Grade]:
    """Return of each student the grade that counts; one that was not graded does so only if there is no other."""

    def rank(grade: Grade) -> tuple[bool, float]:
        return grade.mark is not None, (grade.mark if attempts == "best" else grade.submission.time_s) or 0.0

    chosen: dict[str, Grade] = {}
    for grade in grades:
        student = identities(grade.submission)[0]
        chosen[student] = max(grade, chosen.get(student, grade), key=rank)  # the later one of equal ones
    return [*chosen.values()]
