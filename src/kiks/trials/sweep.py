"""A sweep: a program with more and more thinking time, on several lines, robots of a family and seeds.

It answers whether a program survives the real link and the next robot: up to which thinking time it holds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from statistics import median
from typing import Any

from kiks.errors import ParameterError
from kiks.model.exercise import Case, Cases
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.model.thinking_policy import split_thinking
from kiks.ports.program_command import ProgramCommand
from kiks.sim.from_project import in_case
from kiks.trials.runner import run_trials
from kiks.trials.trial import Outcome, ProgramEnd, Trial

GETTING_ABOUT = Goal(
    "Touch nothing, and get about",
    solved="is_over and roaming > 0.05",
    failed="contacts > 0",
    points="80 * roaming * is_solved",
)
"""The goal of a program without one: on average it gets away at 4 mm/s; the points are its speed in doing so [mm/s]."""

SECONDS = 60.0
"""Time limit of a program without one [s]."""


@dataclass(frozen=True)
class Axes:
    """What a sweep varies: each value of one with each of the others.

    Args:
        thinking_ms: Thinking times [ms], rising.
        baud: Speeds of the line [bit/s]; none for what the program sets.
        family: Numbers of imperfect robots; 0 is the exact one.
        seed: Seeds.

    Example:
        >>> len(Axes(thinking_ms=(0, 10, 20), baud=(9600,), family=(1, 2), seed=(0,)).cases())
        6
    """

    thinking_ms: tuple[float, ...]
    baud: tuple[int, ...] = ()
    family: tuple[int, ...] = (0,)
    seed: tuple[int, ...] = (0,)

    def cases(self) -> list[Case]:
        """Return the cases."""
        thinking = tuple(f"fixed:{value:g}" for value in self.thinking_ms)
        return Cases(seed=self.seed, baud=self.baud, thinking=thinking, family=self.family).each()


@dataclass(frozen=True)
class Tried:
    """A case of a sweep with its outcome.

    Attributes:
        baud: Speed of the line [bit/s]; None for what the program sets.
        thinking_ms: Thinking time [ms].
        robot: Number of the imperfect robot.
        seed: The seed.
        outcome: What has come out.
    """

    baud: int | None
    thinking_ms: float
    robot: int
    seed: int
    outcome: Outcome

    @property
    def is_solved(self) -> bool:
        """Whether the goal was reached, and no program has failed."""
        return self.outcome.is_solved and self._failure is None

    @property
    def _failure(self) -> ProgramEnd | None:
        return next((end for end in self.outcome.ends if end.has_failed), None)

    @property
    def how(self) -> str:
        """How it has ended."""
        if (end := self._failure) is not None:
            return f"{end.name} {end}"
        return f"{self.outcome.points:.4g} points" if self.is_solved else str(self.outcome.judgement)

    def __str__(self) -> str:
        return f"seed {self.seed}, {f'robot {self.robot}' if self.robot else 'the exact robot'}"


@dataclass(frozen=True)
class Row:
    """All cases with one thinking time on one line.

    Attributes:
        baud: Speed of the line [bit/s]; None for what the program sets.
        thinking_ms: Thinking time [ms].
        tried: The cases, the worst first.
    """

    baud: int | None
    thinking_ms: float
    tried: tuple[Tried, ...]

    @property
    def solved(self) -> int:
        """How many are solved."""
        return sum(each.is_solved for each in self.tried)

    @property
    def share(self) -> float:
        """Share of those that are solved."""
        return self.solved / len(self.tried)

    @property
    def points(self) -> list[float]:
        """The points, rising."""
        return sorted(each.outcome.points for each in self.tried)

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        worst = self.tried[0]
        return {
            "baud": self.baud,
            "thinking_ms": self.thinking_ms,
            "runs": len(self.tried),
            "solved": self.solved,
            "points": {"least": self.points[0], "median": median(self.points), "most": self.points[-1]},
            "worst": {"seed": worst.seed, "robot": worst.robot, "how": worst.how, "recording": worst.outcome.recording},
        }


@dataclass(frozen=True)
class Sweep:
    """What a sweep has found.

    Attributes:
        tried: All cases.
        share: Share of the runs that must be solved where a program holds.
    """

    tried: tuple[Tried, ...]
    share: float = 1.0

    @cached_property
    def rows(self) -> list[Row]:
        """The rows, by lines and by rising thinking times."""
        found: dict[tuple[int | None, float], list[Tried]] = {}
        for each in self.tried:
            found.setdefault((each.baud, each.thinking_ms), []).append(each)
        return [
            Row(*place, tuple(sorted(cases, key=lambda each: (each.is_solved, each.outcome.points))))
            for place, cases in sorted(found.items(), key=lambda item: (item[0][0] or 0, item[0][1]))
        ]

    @property
    def bauds(self) -> list[int | None]:
        """The speeds of lines [bit/s], rising; None for what the program sets."""
        return list(dict.fromkeys(row.baud for row in self.rows))

    def of(self, baud: int | None) -> list[Row]:
        """Return the rows of a line."""
        return [row for row in self.rows if row.baud == baud]

    def holds_up_to_ms(self, baud: int | None) -> float | None:
        """Return the longest thinking time up to which the program holds on a line [ms]; None if it never does."""
        held = None
        for row in self.of(baud):
            if row.share < self.share:
                break
            held = row.thinking_ms
        return held

    @property
    def worst(self) -> Tried:
        """The worst case of the first row in which the program does not hold; of all cases if it holds everywhere."""
        for row in self.rows:
            if row.share < self.share:
                return row.tried[0]
        return min(self.tried, key=lambda each: each.outcome.points)

    @property
    def verdict(self) -> str:
        """What the sweep says, in a line for people."""
        lines: dict[float | None, list[str]] = {}
        for baud in self.bauds:
            lines.setdefault(self.holds_up_to_ms(baud), []).append("" if baud is None else str(baud))
        first, last = self.rows[0].thinking_ms, self.rows[-1].thinking_ms
        texts = []
        for held, bauds in lines.items():
            at = f" at {' and '.join(bauds)} baud" if any(bauds) else ""
            if held is None:
                texts.append(f"does not hold{at}, not even with {first:g} ms of thinking")
            else:
                texts.append(f"holds up to {held:g} ms of thinking{at}{', the most that was tried' * (held == last)}")
        among = "" if self.share == 1.0 else f" (in {100 * self.share:g} % of the runs)"
        worst = self.worst
        place = f"{worst} with {worst.thinking_ms:g} ms" + ("" if worst.baud is None else f" at {worst.baud} baud")
        return f"{', and '.join(texts)}{among}; worst: {place} ({worst.how})"


def sweep(
    project: Project,
    folder: Path,
    commands: Sequence[ProgramCommand | None],
    axes: Axes,
    out: Path,
    *,
    share: float = 1.0,
    on_outcome: Callable[[Outcome, int], object] = lambda outcome, count: None,
    on_taken: Callable[[int], object] = lambda count: None,
) -> Sweep:
    """Try programs in all cases, on all cores, and return what has come out. A second call goes on where one ended.

    Args:
        project: The world, with a goal and a time limit.
        folder: Where it lies.
        commands: The program of each robot, which run as they are, outside the sandbox.
        axes: What varies.
        out: The folder of outcomes and recordings.
        share: Share of the runs that must be solved where a program holds.
        on_outcome: Called with each outcome as it comes, and with how many there are by then.
        on_taken: See `run_trials`.
    """
    if project.goal is None or project.seconds is None:
        raise ParameterError("a sweep must have a goal and a time limit, but the project has not both.")
    plain = replace(project, speed=None)
    trials = [
        Trial(_name_of(case), in_case(plain, case, folder), folder, tuple(commands), is_trusted=True)
        for case in axes.cases()
    ]
    outcomes = run_trials(trials, out, on_outcome=on_outcome, on_taken=on_taken)
    found = [
        Tried(case.baud, _thinking_ms(case), case.family, case.seed or 0, outcome)
        for case, outcome in zip(axes.cases(), outcomes, strict=True)
    ]
    return Sweep(tuple(found), share)


def _thinking_ms(case: Case) -> float:
    return float(split_thinking(case.thinking or "none")[1])


def _name_of(case: Case) -> str:
    """Return the name of a case's trial, and of its recording."""
    line = "" if case.baud is None else f"{case.baud}-baud-"
    return f"{line}{_thinking_ms(case):g}-ms/robot-{case.family}-seed-{case.seed}"
