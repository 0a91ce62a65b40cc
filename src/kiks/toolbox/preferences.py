"""What the user's preferences say of the next world."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field

from kiks.model.arena import Arena
from kiks.model.data_file import Number, OneOf, Rule, Switch, Text, Whole, check, record
from kiks.model.project import TURRETS, Project, ProjectRobot, Seed, ThinkingPolicy
from kiks.model.robot import Brightness, Response


def _number(given: object) -> object:
    """Return the number that a text is, a whole one if it is; anything else as it came."""
    try:
        number = float(given) if isinstance(given, str) else given
    except ValueError:
        return given
    return int(number) if isinstance(number, float) and number.is_integer() else number


def _switch(given: object) -> object:
    return {"0": False, "1": True}.get(given, given) if isinstance(given, str) else given


def _words(given: object) -> object:
    return given.split() if isinstance(given, str) else given


_NUMBER = BeforeValidator(_number)
Count = Annotated[Whole, Field(ge=1, le=1000)]


@record
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

    seed: Annotated[Seed, _NUMBER] = 0
    thinking: ThinkingPolicy = "live"
    robot: Text = "khepera"
    robots: Annotated[Count, _NUMBER] | None = None
    response: Response | None = None
    noise: Annotated[Switch, BeforeValidator(_switch), Rule("0 or 1")] = True
    turrets: Annotated[
        tuple[Annotated[str, OneOf(TURRETS)], ...], Field(max_length=len(TURRETS)), BeforeValidator(_words)
    ] = ("k213", "radio", "battle")
    wall: Annotated[Brightness, _NUMBER] = 255
    ball: Annotated[Brightness, _NUMBER] | None = None
    cylinder: Annotated[Brightness, _NUMBER] | None = None
    brightness: Annotated[Brightness, _NUMBER] | None = None
    programs: Annotated[Count, _NUMBER] = 1
    latency_s: Annotated[Number, Field(ge=0, le=10), _NUMBER] = 0.0

    def changed(self, name: str, value: str) -> Settings:
        """Return a copy with one value that the user has written; the usual one if that is nothing.

        Raises:
            ParameterError: If there is no such setting, or the value is none of its kind.

        Example:
            >>> Settings().changed("seed", "7").seed
            7
        """
        values = {known: given for known, given in asdict(self).items() if known != name}
        return check(Settings, values | ({name: value} if value else {}), "kiks_preferences")

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
