"""An exercise: a project with a text, a template of a program, and cases in which programs are tried."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import product
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from kiks.errors import ParameterError
from kiks.model.arena_file import StartEntry
from kiks.model.arena_objects import Pose
from kiks.model.data_file import Switch, Text, Whole, record
from kiks.model.robot import Baud
from kiks.model.settings import LinkName, Seed, ThinkingPolicy

CASES_MAX = 10_000
"""Most cases of a project."""

LISTED_MAX = 1000
"""Most values in a list of a `[[case]]`."""

LONG_TEXT_MAX = 200_000
"""Most characters of an exercise's text, or of its template."""

MEMBER_MAX = 10_000
"""Highest number of an imperfect robot."""

STUDENT = 1
"""The robot that a student's program drives."""

LongText = Annotated[str, Field(strict=True, max_length=LONG_TEXT_MAX, pattern=r"^[^\x00]*$")]
Member = Annotated[Whole, Field(ge=0, le=MEMBER_MAX, description="0 is the exact robot.")]


@record
class Exercise:
    """What makes an exercise of a project.

    Args:
        title: Its title.
        text: What is to be done, in Markdown. A section whose heading begins with 'Hint' is folded until it is wanted.
        template: The program with which a student begins.
        is_locked: Whether students may not change walls and settings.

    Example:
        >>> Exercise("Drive a square", text="Drive a square of 20 cm.").is_locked
        True
    """

    title: Text = ""
    text: LongText = ""
    template: LongText = ""
    is_locked: Switch = True


@dataclass(frozen=True)
class Case:
    """A way in which a program is tried: what differs from the project; None for what does not.

    Attributes:
        name: Its name for people, each of a project another.
        seed: The seed.
        start: Where robot 1 starts.
        arena: The arena, by its name or file.
        baud: Speed of the serial lines [bit/s], whatever programs set.
        thinking: The thinking policy.
        link: What is between programs and robots.
        family: Number of the imperfect robot that all robots are; 0 for the exact one.
        is_hidden: Whether only the lecturer's file has it.
    """

    name: str = ""
    seed: int | None = None
    start: Pose | None = None
    arena: str | None = None
    baud: int | None = None
    thinking: str | None = None
    link: str | None = None
    family: int = 0
    is_hidden: bool = False


def _listed(kind: Any) -> Any:
    return Annotated[tuple[kind, ...], Field(max_length=LISTED_MAX)]


@record
class Cases:
    """Cases of a project: each value of one list with each of the others; the project's own for an empty list.

    Args:
        name: Their name for people.
        seed: Seeds.
        start: Places where robot 1 starts.
        arena: Arenas in place of the project's: names of those that come with KiKS, or files in its folder.
        baud: Speeds of the serial lines [bit/s], whatever programs set.
        thinking: Thinking policies.
        link: What is between programs and robots, such as 'wifi'.
        family: Numbers of imperfect robots, as `kiks.family` makes them; 0 is the exact one.
        is_hidden: Whether only the lecturer's file has these cases.

    Example:
        >>> [case.name for case in Cases("home", seed=(1, 2), baud=(9600,)).each()]
        ['home, seed 1', 'home, seed 2']
    """

    name: Text = ""
    seed: _listed(Seed) = ()  # type: ignore[valid-type]
    start: _listed(StartEntry) = ()  # type: ignore[valid-type]
    arena: _listed(Text) = ()  # type: ignore[valid-type]
    baud: _listed(Baud) = ()  # type: ignore[valid-type]
    thinking: _listed(ThinkingPolicy) = ()  # type: ignore[valid-type]
    link: _listed(LinkName) = ()  # type: ignore[valid-type]
    family: _listed(Member) = ()  # type: ignore[valid-type]
    is_hidden: Switch = False

    def __post_init__(self) -> None:
        if (count := math.prod(len(values) or 1 for values in self._lists().values())) > CASES_MAX:
            raise ParameterError(f"cases must be at most {CASES_MAX}, but these lists make {count}. Shorten one.")

    def _lists(self) -> dict[str, tuple[Any, ...]]:
        return {each.name: value for each in fields(self) if isinstance(value := getattr(self, each.name), tuple)}

    def each(self) -> list[Case]:
        """Return the cases, the last list changing fastest."""
        lists = self._lists()
        cases = []
        for values in product(*(value or (None,) for value in lists.values())):
            given = {name: value for name, value in zip(lists, values, strict=True) if value is not None}
            words = [self.name] * bool(self.name)
            # A single value says nothing that the name does not say.
            words += [_WORDS[name](value) for name, value in given.items() if len(lists[name]) > 1 or not self.name]
            if (start := given.get("start")) is not None:
                x_mm, y_mm = start.at_mm
                given["start"] = Pose(x_mm, y_mm, math.radians(start.heading_deg))
            cases.append(Case(", ".join(words), is_hidden=self.is_hidden, **given))
        return cases


_WORDS: dict[str, Any] = {
    "seed": lambda seed: f"seed {seed}",
    "start": lambda start: f"from {start.at_mm[0]:g}, {start.at_mm[1]:g} at {start.heading_deg:g} deg",
    "arena": lambda arena: Path(arena).stem,
    "baud": lambda baud: f"{baud} baud",
    "thinking": lambda thinking: f"thinking {thinking}",
    "link": lambda link: f"link {link}",
    "family": lambda number: f"robot {number} of the family" if number else "the exact robot",
}


def cases_of(tables: Sequence[Cases]) -> list[Case]:
    """Return all cases, with names that differ; one that is the project itself if there is no table.

    Example:
        >>> [case.name for case in cases_of([])]
        ['as it is']
    """
    cases = [case for table in tables for case in table.each()] or [Case()]
    if len(cases) > CASES_MAX:
        raise ParameterError(f"cases must be at most {CASES_MAX}, but there are {len(cases)}. Shorten a list.")
    seen: dict[str, int] = {}
    named = []
    for case in cases:
        name = case.name or "as it is"
        seen[name] = seen.get(name, 0) + 1
        named.append(Case(**{**vars(case), "name": name if seen[name] == 1 else f"{name} ({seen[name]})"}))
    return named
