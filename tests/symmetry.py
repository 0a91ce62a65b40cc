"""A robot whose right side is the mirror image of its left one, which no real robot's is."""

from dataclasses import fields
from typing import Any

from kiks.model.robot import SENSOR_COUNT, RobotSpec

PARTNERS = (5, 4, 3, 2, 1, 0, 7, 6)
"""Of each sensor the one on the other side."""


def mirrored(values: Any) -> list[Any]:
    """Return what belongs to sensors in the order of their partners."""
    return [values[partner] for partner in PARTNERS]


def symmetric(robot: RobotSpec) -> RobotSpec:
    """Return a robot like this one in which each sensor has the mean of its own and its partner's numbers."""
    changes = {}
    for section in ("proximity", "reflection", "ambient"):
        for key in fields(getattr(robot, section)):
            values = getattr(getattr(robot, section), key.name)
            if isinstance(values, tuple) and len(values) == SENSOR_COUNT and key.name != "slots":
                sign = -1 if key.name in ("mount_angle_deg", "direction_deg") else 1
                pairs = zip(values, mirrored(values), strict=True)
                changes[f"{section}__{key.name}"] = tuple((own + sign * other) / 2 for own, other in pairs)
    return robot.with_changes(**changes)
