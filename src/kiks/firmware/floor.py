"""The floor sensor, number 31: how bright the floor is under the middle of the robot.

Robots of experiments with a charging zone had such a sensor of their users' making, so it has one of the numbers that
K-Team left to users (khepera-protocol.md 10.1): the last one, as users begin with the first. `engine/sensing/floor.py`
says what it sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from kiks.firmware.turret import USER_NUMBERS, Orders, Shape, Turret, Values


def _read(sensor: Floor) -> Values:
    """F: read the brightness of the floor, 0 black to 1023 white."""
    return (sensor.site.floor(),)


class Floor(Turret):
    """An infrared sensor under the base of a robot.

    Example:
        >>> from dataclasses import replace
        >>> import kiks
        >>> from kiks.model.arena import Zone
        >>> arena = replace(kiks.Arena.box(500, 500), zones=(Zone(disc_mm=(0, 0), radius_mm=200),))
        >>> sim = kiks.Simulation(arena, robot=kiks.RobotSpec.load("khepera").without_noise())
        >>> floor = sim.fit(1, "floor")
        >>> robot = kiks.Khepera(sim.port(1))
        >>> robot.turret(31, "F")
        [1023]
        >>> sim.place(1, 80, 80, 0.0)
        >>> robot.turret(31, "F")
        [0]
    """

    number = USER_NUMBERS[-1]
    name = "Floor sensor"
    orders: ClassVar[Orders] = {"F": (0, _read)}

    def status(self) -> str:
        """Return what it reads now."""
        return f"reads {self.site.floor()} of 1023"

    def shapes(self) -> Sequence[Shape]:
        """Return nothing: it is under the robot."""
        return ()
