"""How a kind of robot looks, from above and in space: what browsers, pictures and films draw of it.

What all robots share is drawn without it: the ring in a robot's own colour, stripes, sensors, the arrow that points
ahead, and turrets.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from kiks.firmware.turret import Shape
from kiks.model.robot import Body


@dataclass(frozen=True)
class Led:
    """An LED on a robot.

    Attributes:
        name: What people call it.
        ahead_mm: Its place ahead of the robot's centre [mm].
        left_mm: And to the left [mm].
        height_mm: And above the floor [mm].
        colour: Of its light.
    """

    name: str
    ahead_mm: float
    left_mm: float
    height_mm: float
    colour: Literal["red", "green"] = "red"


@dataclass(frozen=True)
class Slab:
    """A shape that stands upright in space.

    Attributes:
        shape: Its outline.
        low_mm: Where it begins above the floor [mm].
        high_mm: Where it ends [mm].
    """

    shape: Shape
    low_mm: float
    high_mm: float


@dataclass(frozen=True)
class RobotLooks:
    """How robots of a kind look that have a body.

    Attributes:
        board: What is within the ring: its colour, as HTML has it.
        shapes: What is seen on it from above, the lowest first.
        slabs: The body in space, without its wheels.
        leds: Its LEDs: at most 16.
        wheel_mm: Diameter of the wheels [mm].
        height_mm: Height of the robot [mm].
        low_mm: Height of the board under which the sensors are [mm].
        high_mm: Height of what turrets stand on [mm].

    Example:
        >>> RobotLooks(leds=(Led("front", 30.0, 0.0, 20.0),)).leds[0].colour
        'red'
    """

    board: str = "#3a4048"
    shapes: tuple[Shape, ...] = ()
    slabs: tuple[Slab, ...] = ()
    leds: tuple[Led, ...] = ()
    wheel_mm: float = 16.0
    height_mm: float = 32.0
    low_mm: float = 15.0
    high_mm: float = 27.6


def plain_looks(body: Body) -> RobotLooks:
    """Return the looks of a robot that has none of its own: a drum."""
    looks = RobotLooks()
    return RobotLooks(slabs=(Slab(disc(body.radius_mm, looks.board), 4.0, looks.high_mm),))


def disc(radius_mm: float, colour: str) -> Shape:
    """Return a disc around the robot's centre."""
    return Shape(((0.0, 0.0),), colour, radius_mm)


def box(ahead_mm: float, left_mm: float, length_mm: float, width_mm: float, colour: str, size: float = 1.0) -> Shape:
    """Return a rectangle by its corner behind on the right, and its sides; all of it is multiplied by `size`."""
    corners = (0.0, 0.0), (length_mm, 0.0), (length_mm, width_mm), (0.0, width_mm)
    return Shape(tuple((size * (ahead_mm + x), size * (left_mm + y)) for x, y in corners), colour)
