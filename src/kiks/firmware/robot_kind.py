"""A kind of robot: what programs, ports and tools must know of it besides the constants of its file."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kiks.errors import ParameterError
from kiks.firmware.firmware import Firmware
from kiks.firmware.robot_looks import RobotLooks, plain_looks
from kiks.model.robot import SENSOR_COUNT, Body
from kiks.model.robot_kinds import ROBOT_KINDS


@dataclass(frozen=True)
class RobotCommand:
    """A row of a table of commands, which a person may type.

    Attributes:
        letter: What the request begins with; the reply begins with the same in lower case.
        name: What the command does, in two or three words.
        parameters: Names of the numbers that the request takes.
        reply: Names of the values in the reply.
        limits: Units and ranges of both, and what becomes of a number outside.
        act: Carries the command out: takes the firmware and the numbers, returns the values of the reply.
        sense: The sense of `kiks.control.senses.SENSES` that it reads; empty if none.
    """

    letter: str
    name: str
    parameters: tuple[str, ...]
    reply: tuple[str, ...]
    limits: str
    act: Callable[..., tuple[object, ...]]
    sense: str = ""

    @property
    def syntax(self) -> str:
        """How it is written, such as 'D,left,right'."""
        return ",".join((self.letter, *self.parameters))

    @property
    def help(self) -> str:
        """How it is written and what it does, in a line."""
        return f"{self.syntax}: {self.name}" + (f" ({self.limits})" if self.limits else "")


@dataclass(frozen=True, eq=False)
class RobotKind:
    """A kind of robot: a protocol, and what is said of its sensors.

    Attributes:
        firmware: The class of its firmware.
        commands: Its commands; none if they are no lines of text.
        usual: The letters of those that a person begins with.
        speeds: The command that turns the wheels, with places for the two speeds; or the function that returns it.
        speeds_reply: The reply to it.
        speed_max: The largest speed in it.
        speed_scale: What it says for a speed of 8 mm/s. Controllers have this unit, whatever they drive, and the two
            following: so one controller, task or measure is for robots of several kinds.
        scales: What the readings of a sense are multiplied by for controllers, to be the Khepera's; 1 if left out.
        sensor_order: Which of the infra-red sensors in a reply comes first for controllers, second and so on: those
            have them clockwise from the left, the last two behind.
        senses: For each sense of `kiks.control.senses.SENSES` that it has the command that reads it.
        counts_max: The largest reading of its infra-red sensors.
        sensor_names: What these are called, by their index in a reply.
        looks: Returns how a robot with a body looks.
        lit: Returns which of its LEDs are lit: takes records of `kiks.engine.state.ROBOT` [robot], and returns numbers
            that are 0 for a dark one [robot, LED].
    """

    firmware: type[Firmware]
    commands: tuple[RobotCommand, ...]
    usual: str
    speeds: bytes | Callable[[float, float], bytes]
    speeds_reply: bytes
    speed_max: int
    senses: Mapping[str, str]
    counts_max: int
    sensor_names: tuple[str, ...]
    speed_scale: float = 1.0
    scales: Mapping[str, float] = field(default_factory=dict)
    sensor_order: tuple[int, ...] = tuple(range(SENSOR_COUNT))
    looks: Callable[[Body], RobotLooks] = plain_looks
    lit: Callable[[Any], Any] = lambda records: np.zeros((len(records), 0))

    def set_speeds(self, left: float, right: float) -> bytes:
        r"""Return the command that turns the wheels at some speeds.

        Example:
            >>> robot_kind("khepera").set_speeds(5, -5)
            b'D,5,-5\n'
        """
        return self.speeds % (left, right) if isinstance(self.speeds, bytes) else self.speeds(left, right)

    @property
    def stop(self) -> bytes:
        """The command that stops the wheels."""
        return self.set_speeds(0, 0)

    def must_take_lines(self, what: str) -> None:
        """Raise a ParameterError if its commands are no lines of text."""
        if not self.commands:
            raise ParameterError(
                f"{what} must have robots that take lines of text, but this one takes bytes. "
                "Take another robot, write a program for its port, or make a batch with timing=kiks.Timing(baud=None)."
            )


def robot_kind(name: str) -> RobotKind:
    """Return a kind by the name that robots' files have for it."""
    kind: RobotKind = pkgutil.resolve_name(ROBOT_KINDS[name])
    return kind
