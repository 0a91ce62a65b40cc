"""The world of a recording in space, for films (VTK) and photos (Mitsuba): which solids there are, and the camera.

Each robot has on its top how it looks from above.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import BALL
from kiks.export.looks import lit_leds, robot_looks
from kiks.export.sheet import INK, coarse_cells, wall_grey
from kiks.export.stage import Canvas, Pixels
from kiks.model.arena import Arena
from kiks.model.robot import Body, RobotSpec
from kiks.recording.moments import Moment
from kiks.sim.colours import Colour, body_colour, robot_colour

WALL_MM, CYLINDER_MM, CHASSIS_MM, LIFTED_MM = 36.0, 50.0, 4.0, 32.0
"""Heights [mm], low enough that walls hide little; the chassis of a robot begins above the floor."""

CELLS_MAX = 400
"""Most cells of the walls in each direction."""

TOP_PIXELS = 192
"""Pixels of a side of the picture on top of a robot."""

ELEVATION_DEG, VIEW_DEG, MARGIN = 56.0, 30.0, 1.04
"""Angle of the camera above the floor, its angle of view, and how much more than the arena it sees."""

ROUND = 40
"""Corners of a circle."""

Point = tuple[float, float, float]


class Solid(NamedTuple):
    """A body of one material.

    Attributes:
        shape: 'box', 'ball', 'upright' (a cylinder), 'wheel' (one whose axis is y), or 'plate' (a picture that lies).
        middle: Its middle [mm], in the frame of its thing.
        size: Its extents along x, y and z [mm].
        colour: Its colour.
        pixels: The picture on a plate, with opacity; or the greys of equal parts around an upright, counter-clockwise
            from ahead.
    """

    shape: str
    middle: Point
    size: Point
    colour: Colour
    pixels: NDArray[np.uint8] | None = None


class Thing(NamedTuple):
    """A robot, ball or cylinder.

    Attributes:
        key: What it is, its number, and which LEDs are lit.
        solids: What it consists of.
        place: Of its origin [mm].
        heading_rad: Its heading [rad].
    """

    key: tuple[str, int, int]
    solids: tuple[Solid, ...]
    place: Point
    heading_rad: float


def things(moment: Moment) -> Iterator[Thing]:
    """Yield all that moves."""
    specs = moment.saved.specs
    robots = zip(moment.poses.tolist(), specs, lit_leds(specs, moment.robots).tolist(), strict=False)
    for index, ((x_mm, y_mm, heading_rad), spec, lit) in enumerate(robots):
        yield Thing(("robot", index, lit), _robot(spec, index, lit), (x_mm, y_mm, 0.0), heading_rad)
    for body in moment.bodies:
        solids = _body(float(body["radius_mm"]), body_colour(body), is_ball=bool(body["what"] == BALL))
        place = float(body["x_mm"]), float(body["y_mm"]), LIFTED_MM if body["is_lifted"] else 0.0
        yield Thing(("body", int(body["number"]), 0), solids, place, 0.0)


@lru_cache(1000)
def _robot(spec: RobotSpec, index: int, lit: int) -> tuple[Solid, ...]:
    """Return a robot that heads along x."""
    body, looks = spec.body, robot_looks(spec)
    radius_mm, wheel_mm, height_mm = body.radius_mm, looks.wheel_mm, looks.height_mm
    middle_mm = (CHASSIS_MM + height_mm) / 2
    chassis = 1.94 * radius_mm, 1.94 * radius_mm, height_mm - CHASSIS_MM
    greys = _stripes(body) if body.stripe_count else None
    # Large wheels stick out no further.
    aside_mm = min(0.9 * radius_mm, math.sqrt(max(radius_mm**2 - (wheel_mm / 2) ** 2, 0.0)))
    wheels = [
        Solid("wheel", (0.0, side * aside_mm, wheel_mm / 2), (wheel_mm, 0.2 * radius_mm, wheel_mm), INK)
        for side in (-1, 1)
    ]
    seen = _top(spec, index, lit)
    top = Solid("plate", (0.0, 0.0, height_mm + 0.5), (2 * radius_mm, 2 * radius_mm, 0.0), INK, seen)
    return Solid("upright", (0.0, 0.0, middle_mm), chassis, robot_colour(index), greys), *wheels, top


@lru_cache(1000)
def _body(radius_mm: float, colour: Colour, *, is_ball: bool) -> tuple[Solid, ...]:
    width_mm = 2 * radius_mm
    height_mm = width_mm if is_ball else CYLINDER_MM
    shape = "ball" if is_ball else "upright"
    return (Solid(shape, (0.0, 0.0, height_mm / 2), (width_mm, width_mm, height_mm), colour),)


def _stripes(body: Body) -> NDArray[np.uint8]:
    """Return the greys of equal parts around a striped robot, uint8 [part]."""
    each = 4 * body.stripe_count
    count = each * -(-ROUND // each)
    middles_rad = (np.arange(count) + 0.5) * (2 * math.pi / count)
    begins_rad, ends_rad = np.array(body.white_stripes_rad).T[..., np.newaxis]
    is_white = ((begins_rad < middles_rad) & (middles_rad < ends_rad)).any(axis=0)
    return np.where(is_white, 255, 0).astype(np.uint8)


def _top(spec: RobotSpec, index: int, lit: int) -> Pixels:
    """Return how a robot that heads to the right looks from above; the fourth part says where it is."""
    radius_mm = spec.body.radius_mm
    scale = TOP_PIXELS / (2 * radius_mm)
    canvas = Canvas(np.zeros((TOP_PIXELS, TOP_PIXELS, 3), np.uint8), scale, -radius_mm, radius_mm)
    with canvas.patch([(0.0, 0.0)], radius_mm) as sheet:
        sheet.robot((0.0, 0.0, 0.0), spec, index, lit)
    rows, columns = np.indices((TOP_PIXELS, TOP_PIXELS)) - (TOP_PIXELS - 1) / 2
    return np.dstack([canvas.pixels, np.uint8(255) * (np.hypot(rows, columns) < TOP_PIXELS / 2 - 1)])


def walls(arena: Arena) -> dict[Colour, list[Solid]]:
    """Return boxes that make the walls of an arena, by their colour."""
    cells, cell_mm = coarse_cells(arena.brightness, arena.mm_per_cell, CELLS_MAX)
    rows = len(cells)
    found: dict[Colour, list[Solid]] = {}
    growing: dict[tuple[int, int, int], int] = {}  # left, right and brightness of runs that go on, and their first row
    for row in range(rows + 1):
        runs: dict[tuple[int, int, int], int] = {}
        if row < rows:
            edges = np.flatnonzero(np.diff(cells[row].astype(int), prepend=-1, append=-1)).tolist()
            for left, right in pairwise(edges):
                if cells[row, left]:
                    key = left, right, int(cells[row, left])
                    runs[key] = growing.pop(key, row)
        for (left, right, brightness), first in growing.items():
            x_mm, y_mm = left * cell_mm, first * cell_mm
            length_mm = min(right * cell_mm, arena.width_mm) - x_mm
            width_mm = min(row * cell_mm, arena.height_mm) - y_mm
            middle = x_mm + length_mm / 2, y_mm + width_mm / 2, WALL_MM / 2
            colour = (wall_grey(brightness),) * 3
            found.setdefault(colour, []).append(Solid("box", middle, (length_mm, width_mm, WALL_MM), colour))
        growing = runs
    return found


def camera_places(moment: Moment, follow: int | None, zoom: float, aspect: float) -> tuple[Point, Point]:
    """Return what a camera in the south looks at, the arena or a followed robot, and where it is [mm]."""
    arena = moment.saved.arena
    x_mm, y_mm = arena.width_mm / 2, arena.height_mm / 2
    if follow is not None and follow < len(moment.poses):
        x_mm, y_mm = moment.poses[follow, :2].tolist()
    half = math.tan(math.radians(VIEW_DEG) / 2)
    sine, cosine = math.sin(math.radians(ELEVATION_DEG)), math.cos(math.radians(ELEVATION_DEG))
    # The near edge of the floor is the widest, and the floor is foreshortened.
    wide = arena.width_mm / (2 * half * aspect) + arena.height_mm / 2 * cosine
    high = arena.height_mm / 2 * (sine / half + cosine)
    away_mm = MARGIN * max(wide, high) / zoom
    return (x_mm, y_mm, LIFTED_MM), (x_mm, y_mm - away_mm * cosine, LIFTED_MM + away_mm * sine)
