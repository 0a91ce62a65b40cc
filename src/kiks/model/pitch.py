"""The pitch of `kiks demo soccer` and of the task `football`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from kiks.model.arena import Arena
from kiks.model.shipped import shipped_arena

WIDTH_MM, HEIGHT_MM = 1230, 700
"""The picture."""

LEFT_LINE_MM, RIGHT_LINE_MM = 90, 1140
"""x of the goal lines."""

MIDDLE_X_MM, MIDDLE_Y_MM = 615.0, 350.0

BALL = 255
"""Brightness of the ball."""

FRICTION_MM_S2 = 60.0
"""Friction of felt: three times that of a smooth floor, so a shot rolls half across the pitch."""


def arena(**changes: Any) -> Arena:
    """Return the pitch, `examples/arenas/pitch.toml`, with both players on their marks, 250 mm before the middle."""
    return replace(shipped_arena("pitch"), **changes)


def goal_at(x_mm: float, radius_mm: float) -> int:
    """Return where a ball at x scores, for all of it must be behind the line: 1 on the right, -1 on the left, or 0."""
    return int(x_mm > RIGHT_LINE_MM + radius_mm) - int(x_mm < LEFT_LINE_MM - radius_mm)
