"""The user's preferences for the next world."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field

from kiks.model.arena import Arena
from kiks.model.checks import ROBOTS_MAX
from kiks.model.data_file import Number, OneOf, Rule, Switch, Text, Whole, check, record
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import Brightness, Response, RobotSpec
from kiks.model.settings import Seed, ThinkingPolicy
from kiks.model.turrets import TURRETS
from kiks.toolbox.old_constants import NUMBER as _NUMBER
from kiks.toolbox.old_constants import SWITCH, OldConstants


def _words(given: object) -> object:
    return given.split() if isinstance(given, str) else given


Count = Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)]
Points = Annotated[Whole, Field(ge=2, le=10**6)]


@record
class Settings(OldConstants):
    """The preferences that the simulator needs, besides the constants of KiKS 2.2.0 that change robots.

    Attributes:
        seed: Seed of all random numbers.
        thinking: Policy for the program's thinking time.
        robot: Kind of all robots.
        robots: Number of robots, 0 for none; None for the number of starts, or 1 without a start.
        response: Model of the proximity sensors; None for that of the robot's file.
        noise: Whether sensors are noisy.
        turrets: Turrets of each robot.
        wall: Brightness of walls without an own one.
        ball: Brightness of balls; None for the default.
        cylinder: Brightness of cylinders; None for the default.
        brightness: Brightness of robots; None for that of their file.
        programs: Number of programs that start together; with 1, each starts as it joins.
        latency_s: Extra time of each exchange [s], as measured by a calibration.
        log_lines: Number of lines of the log that the desk keeps, from the first world on.
        path_points: Most points of a path; a longer path has points at larger distances.
    """

    seed: Annotated[Seed, _NUMBER] = 0
    thinking: ThinkingPolicy = "live"
    robot: Text = "khepera"
    robots: Annotated[Whole, Field(ge=0, le=ROBOTS_MAX), _NUMBER] | None = None
    response: Response | None = None
    noise: Annotated[Switch, SWITCH, Rule("0 or 1")] = True
    turrets: Annotated[
        tuple[Annotated[str, OneOf(tuple(TURRETS))], ...], Field(max_length=len(TURRETS)), BeforeValidator(_words)
    ] = ("k213", "radio", "battle")
    wall: Annotated[Brightness, _NUMBER] = 255
    ball: Annotated[Brightness, _NUMBER] | None = None
    cylinder: Annotated[Brightness, _NUMBER] | None = None
    brightness: Annotated[Brightness, _NUMBER] | None = None
    programs: Annotated[Count, _NUMBER] = 1
    latency_s: Annotated[Number, Field(ge=0, le=10), _NUMBER] = 0.0
    log_lines: Annotated[Whole, Field(ge=1, le=1_000_000), _NUMBER] = 1000
    path_points: Annotated[Points, _NUMBER] = 8**5

    def changed(self, name: str, value: str) -> Settings:
        """Return a copy with one changed value; an empty text stands for the default.

        Example:
            >>> Settings().changed("seed", "7").seed
            7
        """
        values = {known: given for known, given in asdict(self).items() if known != name}
        return check(Settings, values | ({name: value} if value else {}), "kiks_preferences")

    @property
    def folder(self) -> Path:
        """The folder of the robot's file."""
        return Path(self.robot).parent

    @property
    def project_robot(self) -> ProjectRobot:
        """Each robot of a world; the path of its file is relative to `folder`."""
        return ProjectRobot(
            kind=Path(self.robot).name,
            turrets=self.turrets,
            brightness=self.brightness,
            changes=self.changes(RobotSpec.load(self.robot)),
        )

    def project_of(self, arena: Arena) -> Project:
        """Return the project of an arena with these settings; its paths are relative to `folder`."""
        count = max(len(arena.starts), 1) if self.robots is None else self.robots
        return Project(
            arena,
            robots=(self.project_robot,) * count,
            seed=self.seed,
            thinking=self.thinking,
            response=self.response,
            noise=self.noise,
        )
