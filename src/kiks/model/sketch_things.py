"""The objects of a sketch."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple, TypeVar

from kiks.model.arena_objects import Ball, Cylinder, Lamp
from kiks.model.free_disc import OVERLAP_MM
from kiks.model.robot import RobotSpec


class SketchRobot(NamedTuple):
    """A robot at its start: place [mm], heading [rad], and kind for `RobotSpec.load`."""

    x_mm: float
    y_mm: float
    heading_rad: float = math.pi / 2
    kind: str = "khepera"


Thing = SketchRobot | Ball | Cylinder | Lamp
AnyThing = TypeVar("AnyThing", SketchRobot, Ball, Cylinder, Lamp)

_NAMES: dict[type, str] = {SketchRobot: "robot", Ball: "ball", Cylinder: "cylinder", Lamp: "lamp"}


def name_of(kind: type[Thing]) -> str:
    """Return the name of a kind of thing."""
    return _NAMES[kind]


def numbered(things: Mapping[int, Thing], number: int) -> str:
    """Return the name of one of several things: 'ball 2', the second ball."""
    kind = type(things[number])
    alike = [each for each, thing in sorted(things.items()) if isinstance(thing, kind)]
    return f"{name_of(kind)} {alike.index(number) + 1}"


def overlap_of(thing: SketchRobot | Ball | Cylinder, things: Mapping[int, Thing], but: int = 0) -> str | None:
    """Return as text which other thing overlaps a thing on the floor; None if none does."""
    for number, other in things.items():
        if number == but or isinstance(other, Lamp):
            continue
        apart_mm = math.hypot(thing.x_mm - other.x_mm, thing.y_mm - other.y_mm)
        overlap_mm = radius_of(thing) + radius_of(other) - apart_mm
        if overlap_mm > OVERLAP_MM:
            return f"{numbered(things, number)} is {overlap_mm:.1f} mm inside it"
    return None


def radius_of(thing: SketchRobot | Ball | Cylinder) -> float:
    """Return the radius of what stands on the floor [mm]."""
    return robot_radius_mm(thing.kind) if isinstance(thing, SketchRobot) else thing.radius_mm


@lru_cache(maxsize=64)
def robot_radius_mm(kind: str) -> float:
    """Return the radius of a kind of robot [mm]."""
    return RobotSpec.load(kind).body.radius_mm
