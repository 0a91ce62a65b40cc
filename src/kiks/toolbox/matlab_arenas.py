"""Arenas of the Matlab KiKS: matrices with row 1 on top, one element per millimetre, and codes for walls and things.

Source: kiks-behaviour.md, sections 0 and 1.1. In the user's coordinates x is a column and y a row, both from 1: the
middle of column x is x - 0.5 mm from the left edge. Angles need no conversion, as both turn counter-clockwise on the
screen. Only this module converts coordinates.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.free_disc import free_place
from kiks.sim.free_space import PRESSED_MM

WALL, LIGHT, BALL, CYLINDER = 1, 2, 3, 4
"""Codes of positive elements; negative ones are starts of robots, with the heading in degrees."""

OBJECTS_MAX = 10_000
"""Maximum number of robots, lights, balls and cylinders in an arena."""

MOVED_MAX = 10
"""Maximum number of things that get another place: with more, the matrix is drawn wrongly, such as a ball as a disc."""

Thing = TypeVar("Thing", Pose, Ball, Cylinder)


def place_mm(arena: Arena, x: float, y: float) -> tuple[float, float]:
    """Convert the user's coordinates to KiKS's [mm from the lower left corner]."""
    return x - 0.5, arena.height_mm + 0.5 - y


def user_place(arena: Arena, x_mm: float, y_mm: float) -> tuple[float, float]:
    """Convert KiKS's coordinates [mm] to the user's."""
    return x_mm + 0.5, arena.height_mm + 0.5 - y_mm


def arena_from_matrix(
    codes: NDArray[Any],
    greys: NDArray[Any] | None = None,
    *,
    wall: int = 255,
    ball: int | None = None,
    cylinder: int | None = None,
) -> Arena:
    """Return the arena of a matrix.

    Args:
        codes: Codes of walls, things and starts, [row, column].
        greys: Brightness of the walls, 1 to 255, in a matrix of the same size; 0 stands for `wall`.
        wall: Brightness of walls without an own one.
        ball: Brightness of balls; the default if left out.
        cylinder: Brightness of cylinders; the default if left out.

    Example:
        >>> codes = np.zeros((200, 300)); codes[49, 99] = -270; codes[0] = 1
        >>> arena = arena_from_matrix(codes)
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
        """Return the places of elements [mm] in column-major order."""
        columns, rows = np.nonzero(elements.T)
        return [place_mm(arena, x + 1.0, y + 1.0) for x, y in zip(columns.tolist(), rows.tolist(), strict=True)]

    headings = codes.T[codes.T < 0]
    starts = [
        Pose(x_mm, y_mm, math.radians(-heading_deg % 360))
        for (x_mm, y_mm), heading_deg in zip(places(codes < 0), headings.tolist(), strict=True)
    ]
    # The most negative element is the start of robot 1.
    order = np.argsort(headings, kind="stable")
    return replace(
        arena,
        starts=tuple(starts[index] for index in order.tolist()),
        lamps=tuple(Lamp(*place) for place in places(codes == LIGHT)),
        balls=tuple(Ball(*place, **_grey(ball)) for place in places(codes == BALL)),
        cylinders=tuple(Cylinder(*place, **_grey(cylinder)) for place in places(codes == CYLINDER)),
    )


def settled(arena: Arena, robot_radius_mm: float) -> tuple[Arena, list[str]]:
    """Move robots, balls and cylinders without room to the nearest free places, as programs count on going on.

    KiKS 2.2.0 took random ones (kiks-behaviour.md 3.6).

    Args:
        arena: The arena of a matrix.
        robot_radius_mm: Radius of the robots [mm].

    Returns:
        The arena, and a sentence for each thing that was moved, in the user's coordinates. If there are more than
        `MOVED_MAX` of these, the arena as it was.

    Example:
        >>> codes = np.zeros((200, 300)); codes[9, 99] = -90
        >>> settled(arena_from_matrix(codes), 27.5)[1]
        ['A robot has no room at x = 100, y = 10 and is placed at x = 100, y = 28.']
    """
    discs: list[tuple[float, float, float]] = []
    moves: list[str] = []

    def placed(thing: Thing, what: str, radius_mm: float) -> Thing:
        x_mm, y_mm = thing.x_mm, thing.y_mm
        room_mm = arena.clearance_at_mm(x_mm, y_mm)
        for x, y, radius in discs:
            room_mm = min(room_mm, math.hypot(x_mm - x, y_mm - y) - radius)
        if room_mm < radius_mm - PRESSED_MM and len(moves) <= MOVED_MAX:
            x_mm, y_mm = free_place(arena, discs, radius_mm, (x_mm, y_mm), f"a {what}")
            old, new = (
                "x = {:g}, y = {:g}".format(*user_place(arena, *place))
                for place in ((thing.x_mm, thing.y_mm), (x_mm, y_mm))
            )
            moves.append(f"A {what} has no room at {old} and is placed at {new}.")
        discs.append((x_mm, y_mm, radius_mm))
        return thing._replace(x_mm=x_mm, y_mm=y_mm)

    settled_arena = replace(
        arena,
        starts=tuple(placed(start, "robot", robot_radius_mm) for start in arena.starts),
        balls=tuple(placed(ball, "ball", ball.radius_mm) for ball in arena.balls),
        cylinders=tuple(placed(cylinder, "cylinder", cylinder.radius_mm) for cylinder in arena.cylinders),
    )
    return (arena, []) if len(moves) > MOVED_MAX else (settled_arena, moves)


def _grey(brightness: int | None) -> dict[str, Any]:
    return {} if brightness is None else {"brightness": brightness}
