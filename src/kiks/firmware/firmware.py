"""What the firmware of every kind of robot has: registers, sensors, turrets, and the speed of its line."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import ROBOT, State
from kiks.firmware.receiver import Receiver
from kiks.firmware.turret import Turret
from kiks.model.robot import RobotSpec
from kiks.model.window import Window


class Firmware(ABC):
    """The firmware of one robot: a command comes in, a reply goes out; never an exception.

    Args:
        spec: The robot's constants.
        state: The world's state, which has a record for each robot.
        number: Index of the robot's record.
        sense: Returns what a sense of `kiks.control.senses.SENSES` reads at this time, in whole numbers.

    Attributes:
        receiver: Makes commands of the characters that arrive.
        fitted: All turrets.
        turrets: Those that answer orders, by their numbers.
        dictated: An order for a turret, and the robot's reply to it, if the program that sends it says that, too.
        now_ns: The time of the command that acts [ns].
        baud: Speed of the line now [bit/s].
        selected_baud: Speed that the mode selector asks for [bit/s]: the robot reads it at a reset.
        wakes_ns: When the robot acts next without a command [ns]; None if it never does.
        gives_hints: Whether a person gets hints beside the robot's replies, as the first run of a recording gave them.
        hinted: What a person has had a hint about: it comes once.
        unread_count: Returns how many characters the program has not read, for a robot that sends by itself.
        picture: Returns what a camera sees in a window: red, green, blue, uint8 [height, width, 3].
    """

    receiver: Receiver
    picture: Callable[[Window], NDArray[np.uint8]]

    def __init__(self, spec: RobotSpec, state: State, number: int, sense: Callable[[str], list[int]]) -> None:
        self.spec = spec
        self.number = number
        self.sense = sense
        self.fitted: list[Turret] = []
        self.turrets: dict[int, Turret] = {}
        self.dictated: tuple[bytes, bytes] | None = None
        self.gives_hints = True
        self.hinted: set[bytes] = set()
        self.now_ns = 0
        self.baud = self.selected_baud = spec.firmware.baud
        self.wakes_ns: int | None = None
        self.unread_count: Callable[[], int] = lambda: 0
        self.take(state)
        # Also of motors that never use it, the speed profile must be as saved states want it.
        self.view.profile_speed[:] = spec.reset.profile_speed_pulses
        self.view.profile_acceleration[:] = spec.reset.profile_acceleration
        self.reset()

    @abstractmethod
    def execute(self, line: bytes, now_ns: int) -> bytes:
        """Carry out a command, as `receiver` makes it, at a time [ns]; return the reply, which may be empty."""

    @abstractmethod
    def reset(self) -> None:
        """Reset the firmware to its defaults; the body stays where it is."""

    @abstractmethod
    def wake(self, now_ns: int) -> bytes:
        """Act without a command, as `wakes_ns` has come, and choose a later one; return what the robot sends."""

    @property
    def will_speak(self) -> bool:
        """Whether it sends something before it gets another command."""
        return False

    def leave(self) -> None:
        """Take notice that the program is gone; only a robot that sends by itself needs to."""
        return

    def busy_ns(self, command: bytes) -> int:
        """Return for how long the robot takes no other command once it has begun to carry one out [ns]."""
        return 0

    def take(self, state: State) -> None:
        """Use the arrays of a state; call again when they are replaced."""
        self.robots = state.robots
        # Writable views of this robot's fields: a field of one number has shape [1], the others keep their own.
        fields: dict[str, Any] = {}
        for name in ROBOT.names or ():
            column = state.robots[name][0]
            fields[name] = column[self.number] if column.ndim > 1 else column[self.number : self.number + 1]
        self.view = SimpleNamespace(**fields)

    def fit(self, turret: Turret) -> None:
        """Add a turret; one without a number answers no orders."""
        self.fitted.append(turret)
        if turret.number >= 0:
            self.turrets[turret.number] = turret
