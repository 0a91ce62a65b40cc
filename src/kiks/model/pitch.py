"""The pitch of `kiks demo soccer` and of the contest `football`."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.model.arena import Arena, Pose

WIDTH_MM, HEIGHT_MM = 1230, 700
"""The picture."""

LEFT_LINE_MM, RIGHT_LINE_MM = 90, 1140
"""x of the goal lines."""

MIDDLE_X_MM, MIDDLE_Y_MM = 615.0, 350.0

WALL, LEFT_GOAL, RIGHT_GOAL, JERSEY, BALL = 40, 95, 150, 20, 255
"""Brightnesses."""

FRICTION_MM_S2 = 60.0
"""Friction of felt: three times that of a smooth floor, so a shot rolls half across the pitch."""

_CORNER_MM = 140


def picture() -> NDArray[np.uint8]:
    """Draw a pitch of 1050 x 680 mm with round corners, and at each end a goal of 300 x 80 mm.

    The goals are lined in greys of their own. The lining begins 6 mm behind the goal line, so that the posts, which are
    what a camera takes its bearings from, are edges of the wall.
    """
    rows, columns = np.indices((HEIGHT_MM, WIDTH_MM)) + 0.5
    x, y = abs(columns - MIDDLE_X_MM), abs(rows - MIDDLE_Y_MM)
    from_corner = np.hypot(np.maximum(x - 525 + _CORNER_MM, 0), np.maximum(y - 340 + _CORNER_MM, 0))
    lining = np.where(columns < MIDDLE_X_MM, LEFT_GOAL, RIGHT_GOAL)
    drawn = np.where((x > 531) & (y < 160), lining, WALL)
    is_floor = (from_corner <= _CORNER_MM) | ((x > 520) & (x < 605) & (y < 150))
    return np.where(is_floor, 0, drawn).astype(np.uint8)


def arena(**changes: Any) -> Arena:
    """Return the pitch with both players on their marks, 250 mm before the middle."""
    starts = (Pose(365.0, MIDDLE_Y_MM, 0.0), Pose(865.0, MIDDLE_Y_MM, pi))
    return replace(Arena.from_array(picture(), name="Pitch"), starts=starts, **changes)


def goal_at(x_mm: float, radius_mm: float) -> int:
    """Return where a ball at x scores, for all of it must be behind the line: 1 on the right, -1 on the left, or 0."""
    return int(x_mm > RIGHT_LINE_MM + radius_mm) - int(x_mm < LEFT_LINE_MM - radius_mm)
