"""What the user's preferences say of the next world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, nearest, shown
from kiks.model.arena import Arena
from kiks.model.project import Project, ProjectRobot

TEXT_MAX = 1000
"""Longest text of a setting: a path has fewer characters."""

PROGRAMS_MAX = 1000
"""Most robots, and most programs, that a setting may ask for."""


@dataclass(frozen=True)
class Settings:
    """Preferences, as far as the simulator has to know them.

    Attributes:
        seed: Seed of all random numbers.
        thinking: What the user's program costs between a reply and its next command.
        robot: Kind of all robots.
        robots: How many there are; as many as there are starts if None.
        response: What makes counts of proximity sensors' rays; what the robot's file says if None.
        noise: Whether chance has a say in what sensors read.
        turrets: What each robot carries.
        wall: Brightness of walls for which there is no other.
        ball: Brightness of balls; the usual one if None.
        cylinder: Brightness of cylinders; the usual one if None.
        brightness: Brightness of robots; that of their file if None.
        programs: How many programs begin together; with 1 whoever comes begins.
        latency_s: What each exchange takes on top of all else [s], as a calibration has measured it.
    """

    seed: int = 0
    thinking: str = "live"
    robot: str = "khepera"
    robots: int | None = None
    response: str | None = None
    noise: bool = True
    turrets: tuple[str, ...] = ("k213", "radio", "battle")
    wall: int = 255
    ball: int | None = None
    cylinder: int | None = None
    brightness: int | None = None
    programs: int = 1
    latency_s: float = 0.0

    def changed(self, name: str, value: str) -> Settings:
        """Return a copy with one value that the user has written; the usual one if that is nothing.

        Raises:
            ParameterError: If there is no such setting, or the value is none of its kind.

        Example:
            >>> Settings().changed("seed", "7").seed
            7
        """
        if name not in _READERS:
            raise ParameterError(
                f"a setting must be one of {list(_READERS)}, but it was {shown(name)}.{nearest(name[:100], _READERS)}"
            )
        read, what = _READERS[name]
        try:
            return replace(self, **{name: read(value) if value else getattr(Settings(), name)})
        except (ValueError, OverflowError):
            raise ParameterError(
                f"{name} must be {what}, but it was {shown(value)}. Look into kiks_preferences."
            ) from None

    @property
    def folder(self) -> Path:
        """Where the robot's file lies, if it is one."""
        return Path(self.robot).parent

    def project_of(self, arena: Arena) -> Project:
        """Return the world of an arena with these settings; files in it are looked for in `folder`.

        Raises:
            ParameterError: If a value is out of range.
        """
        # A world has a robot, even where the first program is to bring one.
        count = max(len(arena.starts) if self.robots is None else self.robots, 1)
        robot = ProjectRobot(kind=Path(self.robot).name, turrets=self.turrets, brightness=self.brightness)
        return Project(
            arena,
            robots=(robot,) * count,
            seed=self.seed,
            thinking=self.thinking,
            response=self.response,
            noise=self.noise,
        )


def _whole(low: int, high: int) -> tuple[Callable[[str], int], str]:
    """Return how a whole number of a range is read, and what it has to be."""

    def read(text: str) -> int:
        number = float(text)
        if not low <= number <= high or number % 1:
            raise ValueError
        return int(number)

    return read, f"a whole number from {low} to {high}"


def _switch(text: str) -> bool:
    if text not in ("0", "1"):
        raise ValueError
    return text == "1"


def _seconds(text: str) -> float:
    number = float(text)
    if not 0 <= number <= 10:
        raise ValueError
    return number


def _text(text: str) -> str:
    if len(text) > TEXT_MAX or not text.isprintable():
        raise ValueError
    return text


def _words(text: str) -> tuple[str, ...]:
    return tuple(_text(text).split())


_READERS: dict[str, tuple[Callable[[str], Any], str]] = {
    "seed": _whole(0, 1 << 53),
    "thinking": (_text, f"a text of one line and at most {TEXT_MAX} characters"),
    "robot": (_text, f"a text of one line and at most {TEXT_MAX} characters"),
    "robots": _whole(1, PROGRAMS_MAX),
    "response": (_text, f"a text of one line and at most {TEXT_MAX} characters"),
    "noise": (_switch, "0 or 1"),
    "turrets": (_words, "names with blanks between them"),
    "wall": _whole(1, 255),
    "ball": _whole(1, 255),
    "cylinder": _whole(1, 255),
    "brightness": _whole(1, 255),
    "programs": _whole(1, PROGRAMS_MAX),
    "latency_s": (_seconds, "a time from 0 to 10 s"),
}
"""How the value of each setting is read, and what it has to be."""
