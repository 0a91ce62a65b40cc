"""A sweep: a program with more and more thinking time, on several lines, robots of a family and seeds.

It answers whether a program survives the real link and the next robot: up to which thinking time it holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from statistics import median
from typing import Any

from kiks.model.exercise import Case, cases_of
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.model.radio_link import parse_link
from kiks.model.thinking_policy import split_thinking
from kiks.ports.program_command import ProgramCommand
from kiks.sim.from_project import in_case
from kiks.trials.trial import Outcome, Trial

DEFAULT_GOAL = Goal(
    "Touch nothing, and get about",
    solved="is_over and roaming > 0.05",
    failed="contacts > 0",
    points="80 * roaming * is_solved",
)
"""The goal of a program without one: on average it gets away at 4 mm/s; the points are its speed in doing so [mm/s]."""

SECONDS = 60.0
"""Time limit of a program without one [s]."""


@dataclass(frozen=True)
class Tried:
    """A case of a sweep with its outcome."""

    case: Case
    outcome: Outcome

    @property
    def thinking_ms(self) -> float:
        """Thinking time [ms]."""
        return float(split_thinking(self.case.thinking or "none")[1])

    @property
    def latency_ms(self) -> float | None:
        """Least delay of the link, each way [ms]; None if thinking times are tried."""
        return None if self.case.link is None else parse_link(self.case.link).latency_ms

    @property
    def is_solved(self) -> bool:
        """Whether the goal was reached, and no program has failed."""
        return self.outcome.is_solved and not self.outcome.failures

    @property
    def how(self) -> str:
        """How it has ended."""
        for end in self.outcome.failures.values():
            return f"{end.name} {end}"
        return f"{self.outcome.points:.4g} points" if self.is_solved else str(self.outcome.judgement)

    def __str__(self) -> str:
        robot = self.case.family
        return f"seed {self.case.seed}, {f'robot {robot}' if robot else 'the exact robot'}"


@dataclass(frozen=True)
class Row:
    """All cases with one thinking time on one line.

    Attributes:
        baud: Speed of the line [bit/s]; None for what the program sets.
        thinking_ms: Thinking time [ms].
        latency_ms: Least delay of the link, each way [ms]; None if thinking times are tried.
        tried: The cases, the worst first.
    """

    baud: int | None
    thinking_ms: float
    latency_ms: float | None
    tried: tuple[Tried, ...]

    @property
    def place_ms(self) -> float:
        """Its place among the rows: the latency or the thinking time [ms]."""
        return self.thinking_ms if self.latency_ms is None else self.latency_ms

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
            "latency_ms": self.latency_ms,
            "runs": len(self.tried),
            "solved": self.solved,
            "points": {"least": self.points[0], "median": median(self.points), "most": self.points[-1]},
            "worst": {
                "seed": worst.case.seed,
                "robot": worst.case.family,
                "how": worst.how,
                "recording": worst.outcome.recording,
            },
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
        """The rows, by lines and by rising thinking times or latencies."""
        found: dict[tuple[int | None, float, float | None], list[Tried]] = {}
        for each in self.tried:
            found.setdefault((each.case.baud, each.thinking_ms, each.latency_ms), []).append(each)
        return [
            Row(*place, tuple(sorted(cases, key=lambda each: (each.is_solved, each.outcome.points))))
            for place, cases in sorted(found.items(), key=lambda item: tuple(map(float, (k or 0 for k in item[0]))))
        ]

    @property
    def what(self) -> str:
        """What rises from row to row."""
        return "thinking" if self.rows[0].latency_ms is None else "latency"

    @property
    def bauds(self) -> list[int | None]:
        """The speeds of lines [bit/s], rising; None for what the program sets."""
        return list(dict.fromkeys(row.baud for row in self.rows))

    def of(self, baud: int | None) -> list[Row]:
        """Return the rows of a line."""
        return [row for row in self.rows if row.baud == baud]

    def holds_up_to_ms(self, baud: int | None) -> float | None:
        """Return the longest time of `what` up to which the program holds on a line [ms]; None if it never does."""
        held = None
        for row in self.of(baud):
            if row.share < self.share:
                break
            held = row.place_ms
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
        first, last, what = self.rows[0].place_ms, self.rows[-1].place_ms, self.what
        texts = []
        for held, bauds in lines.items():
            at = f" at {' and '.join(bauds)} baud" if any(bauds) else ""
            if held is None:
                texts.append(f"does not hold{at}, not even with {first:g} ms of {what}")
            else:
                texts.append(f"holds up to {held:g} ms of {what}{at}{', the most that was tried' * (held == last)}")
        among = "" if self.share == 1.0 else f" (in {100 * self.share:g} % of the runs)"
        worst, ms = self.worst, next(row.place_ms for row in self.rows if self.worst in row.tried)
        at = "" if worst.case.baud is None else f" at {worst.case.baud} baud"
        return f"{', and '.join(texts)}{among}; worst: {worst} with {ms:g} ms{at} ({worst.how})"


def sweep_trials(project: Project, folder: Path, commands: Sequence[ProgramCommand | None]) -> list[Trial]:
    """Return a trial of programs in each case of a project.

    Args:
        project: The world, with a goal, a time limit, and cases, each with a seed and a fixed thinking time.
        folder: Where it lies.
        commands: The program of each robot, which run as they are, outside the sandbox.
    """
    plain, trials = replace(project, speed=None), []
    for case in cases_of(project.cases):
        line = "" if case.baud is None else f"{case.baud}-baud-"
        thinking_ms = (case.thinking or "").removeprefix("fixed:")
        ms = f"{thinking_ms}-ms" if case.link is None else f"{parse_link(case.link).latency_ms:g}-ms-of-latency"
        name = f"{line}{ms}/robot-{case.family}-seed-{case.seed}"
        trials.append(Trial(name, in_case(plain, case, folder), folder, tuple(commands), is_trusted=True))
    return trials
