"""Arenas as the Matlab KiKS has them: matrices with row 1 on top, an element a millimetre, numbers for what is where.

Source: kiks-behaviour.md, sections 0 and 1.1. A user's x is the number of a column, y that of a row, both from 1: the
middle of column x is x - 0.5 mm from the left edge. Angles are those of KiKS everywhere, as both turn counter-clockwise
on the screen. Here alone the two are converted.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose

WALL, LIGHT, BALL, CYLINDER = 1, 2, 3, 4
"""What positive elements stand for; negative ones are starts of robots, with the heading in degrees."""

OBJECTS_MAX = 10_000
"""Most elements of an arena that are not walls or floor."""


def place_mm(arena: Arena, x: float, y: float) -> tuple[float, float]:
    """Return where a user's place is [mm], from the lower left corner."""
    return x - 0.5, arena.height_mm + 0.5 - y


def user_place(arena: Arena, x_mm: float, y_mm: float) -> tuple[float, float]:
    """Return what the user calls a place [mm]."""
    return x_mm + 0.5, arena.height_mm + 0.5 - y_mm


def arena_of(
    codes: NDArray[Any],
    greys: NDArray[Any] | None = None,
    *,
    wall: int = 255,
    ball: int | None = None,
    cylinder: int | None = None,
) -> Arena:
    """Return the arena of a matrix.

    Args:
        codes: What is where, [row, column].
        greys: Brightness of the walls, 1 to 255, in a matrix of the same size; where it has 0 they are as all.
        wall: Brightness of the walls for which there is no other.
        ball: Brightness of balls; the usual one if left out.
        cylinder: Brightness of cylinders; the usual one if left out.

    Raises:
        ParameterError: If an element stands for nothing, or the sizes differ.
        ArenaError: If the arena is too small or too large, or something stands where it cannot.

    Example:
        >>> codes = np.zeros((200, 300)); codes[49, 99] = -270; codes[0] = 1
        >>> arena = arena_of(codes)
        >>> arena.starts[0][:2], round(math.degrees(arena.starts[0].heading_rad))
        ((99.5, 150.5), 270)
    """
    known = (codes <= CYLINDER) & ((codes < 0) | (np.floor(codes) == codes))
    if not known.all():
        row, column = np.argwhere(~known)[0]
        raise ParameterError(
            f"an arena's elements must be 0 (free), 1 (wall), 2 (light), 3 (ball), 4 (cylinder) or negative (a robot's "
            f"heading in degrees), but ARENA({row + 1},{column + 1}) is {codes[row, column]:g}. Correct it there."
        )
    count = np.count_nonzero(codes) - np.count_nonzero(codes == WALL)
    if count > OBJECTS_MAX:
        raise ParameterError(
            f"an arena must have at most {OBJECTS_MAX} robots, lights, balls and cylinders, but it has {count}. Walls "
            "are 1."
        )
    picture = np.where(codes == WALL, np.uint8(wall), np.uint8(0))
    if greys is not None:
        if greys.shape != codes.shape:
            raise ParameterError(
                f"a colour mask must be of the arena's size, {codes.shape[0]} x {codes.shape[1]}, but it is "
                f"{greys.shape[0]} x {greys.shape[1]}. Make it with zeros(size(ARENA))."
            )
        if not ((greys >= 0) & (greys <= 255) & (np.floor(greys) == greys)).all():
            raise ParameterError(
                "greys of walls must be whole numbers from 1 to 255, but others were given. 255 is white."
            )
        np.copyto(picture, greys, where=(codes == WALL) & (greys != 0), casting="unsafe")
    arena = Arena.from_array(picture, name="matrix")

    def places(elements: NDArray[np.bool_]) -> list[tuple[float, float]]:
        """Return where elements are, down the columns, from the left."""
        columns, rows = np.nonzero(elements.T)
        return [place_mm(arena, x + 1.0, y + 1.0) for x, y in zip(columns.tolist(), rows.tolist(), strict=True)]

    headings = codes.T[codes.T < 0]
    starts = [
        Pose(x_mm, y_mm, math.radians(-heading_deg % 360))
        for (x_mm, y_mm), heading_deg in zip(places(codes < 0), headings.tolist(), strict=True)
    ]
    # The most negative element is the first robot's.
    order = np.argsort(headings, kind="stable")
    return replace(
        arena,
        starts=tuple(starts[index] for index in order.tolist()),
        lamps=tuple(Lamp(*place) for place in places(codes == LIGHT)),
        balls=tuple(Ball(*place, **_grey(ball)) for place in places(codes == BALL)),
        cylinders=tuple(Cylinder(*place, **_grey(cylinder)) for place in places(codes == CYLINDER)),
    )


def _grey(brightness: int | None) -> dict[str, Any]:
    return {} if brightness is None else {"brightness": brightness}
