"""What stands or hangs in a sketch."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple, TypeVar

from kiks.model.places import Ball, Cylinder, Lamp
from kiks.model.robot import RobotSpec


class SketchRobot(NamedTuple):
    """A robot that is going to start somewhere: its place [mm], heading [rad], and what `RobotSpec.load` calls it."""

    x_mm: float
    y_mm: float
    heading_rad: float = math.pi / 2
    kind: str = "khepera"


Thing = SketchRobot | Ball | Cylinder | Lamp
AnyThing = TypeVar("AnyThing", SketchRobot, Ball, Cylinder, Lamp)

_NAMES: dict[type, str] = {SketchRobot: "robot", Ball: "ball", Cylinder: "cylinder", Lamp: "lamp"}


def name_of(kind: type[Thing]) -> str:
    """Return what people call a kind of thing."""
    return _NAMES[kind]


def radius_of(thing: SketchRobot | Ball | Cylinder) -> float:
    """Return the radius of what stands on the floor [mm].

    Raises:
        ParameterError: If there is no such kind of robot.
    """
    return robot_radius_mm(thing.kind) if isinstance(thing, SketchRobot) else thing.radius_mm


@lru_cache(maxsize=64)
def robot_radius_mm(kind: str) -> float:
    """Return the radius of a kind of robot [mm].

    Raises:
        ParameterError: If there is no such kind.
    """
    return RobotSpec.load(kind).body.radius_mm
