"""How points in an exercise become the grade of a grade book: another maximum, and less for what comes late."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import datetime, timedelta

from kiks.errors import ParameterError, shown
from kiks.model.formula_range import range_of
from kiks.model.project import Project
from kiks.trials.submissions import Submission


@dataclass(frozen=True)
class Marking:
    """How points become a grade.

    Attributes:
        most: The grade for full points; None if points are the grade.
        full: Full points in the exercise.
        due_s: When hand-ins were due, in seconds since 1970; None if they may come at any time.
        penalty: How much of the grade each day costs that has begun since [%].

    Example:
        >>> Marking(most=100.0, full=10.0).grade_of(7.5, days_late=0)
        75.0
        >>> Marking(due_s=0.0, penalty=10.0).grade_of(7.5, days_late=2)
        6.0
    """

    most: float | None = None
    full: float = 1.0
    due_s: float | None = None
    penalty: float = 0.0

    def days_late(self, submission: Submission) -> int | None:
        """Return how many days have begun between the due time and a hand-in; None if its time is not known."""
        if self.due_s is None or submission.time_s is None:
            return None
        handed_in, due = map(datetime.fromtimestamp, (submission.time_s, self.due_s))  # by clocks: a day may have 25 h
        return max(0, math.ceil((handed_in - due) / timedelta(days=1)))

    def grade_of(self, points: float, days_late: int | None) -> float:
        """Return the grade for points, from 0 to the maximum, if there is one."""
        kept = max(0.0, 1 - (days_late or 0) * self.penalty / 100)
        if self.most is None:
            return round(points * kept, 3)
        return round(min(max(points / self.full, 0.0), 1.0) * self.most * kept, 2)


AS_POINTS = Marking()
"""The points are the grade."""


def marking_for(project: Project, most: float | None, full: float | None, due: str | None, penalty: float) -> Marking:
    """Return how grades are made in an exercise.

    Args:
        project: The exercise.
        most: See `Marking`.
        full: Full points; if left out, the most that the goal's formula can give.
        due: See `due_time_s`.
        penalty: See `Marking`.

    Raises:
        ParameterError: If full points are needed, but neither given nor known.
    """
    if most is None and full is not None:
        raise ParameterError("--full must come with --max, the grade for full points. Write --max 100, for instance.")
    if most is not None and full is None:
        full = (
            math.inf if project.goal is None else range_of(project.goal.formulas()["points"], project.seconds or 0)[1]
        )
        if not 0 < full < math.inf:
            raise ParameterError(
                "--max must come with --full where the formula of points has no maximum. Say how many points of the "
                "exercise are full ones: --full 10."
            )
    full = full or 1.0
    return Marking(most, full) if due is None else Marking(most, full, due_time_s(due), penalty)


def due_time_s(text: str) -> float:
    """Return a time in seconds since 1970; a date alone means the end of that day.

    Example:
        >>> due_time_s("2026-11-28T12:00Z")
        1795867200.0
    """
    try:
        time = datetime.fromisoformat(text.strip())
    except ValueError:
        raise ParameterError(
            f"--due must be a date and a time, but it was {shown(text)}. Write 2026-11-28T23:59, for instance."
        ) from None
    return (time + timedelta(days=len(text.strip()) <= len("2026-11-28"))).timestamp()
