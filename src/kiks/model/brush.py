"""Drawing walls by hand: functions from an arena to an arena. Brightness 0 is floor, so drawing with it erases.

Rectangles, straight lines and dots become walls with a shape (`kiks.model.walls`). A freehand stroke becomes a part of
the picture below them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from kiks.model.arena import Arena
from kiks.model.cells import PER_CELL, Area, Point, covered, stroke_cells
from kiks.model.checks import check_count, check_number
from kiks.model.materials import brightness_of
from kiks.model.walls import WIDTH_MAX_MM, Wall, painted

POINTS_MAX = 10_000
"""Most points of one stroke."""

_FAR_MM = 1e5


def rectangle(
    arena: Arena, x0_mm: float, y0_mm: float, x1_mm: float, y1_mm: float, brightness: int | str = 255
) -> Arena:
    """Return an arena with a box between two corners [mm], the same one if that changes nothing."""
    return draw(arena, Wall(box_mm=_checked([(x0_mm, y0_mm), (x1_mm, y1_mm)]), brightness=_grey(brightness)))


def line(arena: Arena, points_mm: Sequence[Point], *, width_mm: float, brightness: int | str = 255) -> Arena:
    """Return an arena with a line of a round brush: from one point to another, freehand through many, a dot at one.

    Example:
        >>> int(line(Arena.box(400, 300), [(100, 50), (100, 250)], width_mm=10, brightness="wood").brightness[150, 100])
        190
    """
    width_mm = check_number("width_mm", width_mm, 1 / PER_CELL, WIDTH_MAX_MM)
    check_count("the number of points", len(points_mm), 1, POINTS_MAX, "Draw in shorter strokes.")
    points, grey = _checked(points_mm), _grey(brightness)
    if len(set(points)) == 1:
        return draw(arena, Wall(disc_mm=points[0], radius_mm=width_mm / 2, brightness=grey))
    if len(points) == 2:
        return draw(arena, Wall(line_mm=points, width_mm=width_mm, brightness=grey))
    in_cells = [(x_mm / arena.mm_per_cell, y_mm / arena.mm_per_cell) for x_mm, y_mm in points]
    return _paint_ground(arena, stroke_cells(arena.ground.shape, in_cells, width_mm / arena.mm_per_cell), grey)


def disc(arena: Arena, centre_mm: Point, radius_mm: float, brightness: int | str = 255) -> Arena:
    """Return an arena with a disc around a point [mm], the same one if that changes nothing."""
    (centre,) = _checked([centre_mm])
    return draw(arena, Wall(disc_mm=centre, radius_mm=radius_mm, brightness=_grey(brightness)))


def draw(arena: Arena, wall: Wall) -> Arena:
    """Return an arena with one more wall, without those that it hides; the same arena if nothing looks different."""
    mask = covered(arena.ground.shape, wall.cells(arena.ground.shape, arena.mm_per_cell))
    raster = np.where(mask, np.uint8(wall.brightness), arena.brightness)
    if np.array_equal(raster, arena.brightness):
        return arena
    seen = tuple(each for each in arena.walls if not all(part.all() for part in _parts(mask, each, arena.mm_per_cell)))
    without = replace(arena, walls=seen)
    return without if np.array_equal(without.brightness, raster) else replace(arena, walls=(*seen, wall))


def _paint_ground(arena: Arena, areas: Iterable[Area], grey: int) -> Arena:
    """Return an arena with cells of the picture in a grey: the walls that lie below them become a part of it, too."""
    mask = covered(arena.ground.shape, areas)
    touched = [
        number
        for number, each in enumerate(arena.walls, start=1)
        if any(part.any() for part in _parts(mask, each, arena.mm_per_cell))
    ]
    below = max(touched, default=0)
    ground = np.where(mask, np.uint8(grey), painted(arena.ground, arena.mm_per_cell, arena.walls[:below]))
    after = replace(arena, ground=ground, walls=arena.walls[below:])
    return arena if np.array_equal(after.brightness, arena.brightness) else after


def _parts(mask: npt.NDArray[np.bool_], wall: Wall, mm_per_cell: float) -> Iterator[npt.NDArray[np.bool_]]:
    """Yield what of a mask the parts of a wall cover."""
    for rows, columns, cells in wall.cells((mask.shape[0], mask.shape[1]), mm_per_cell):
        yield mask[rows, columns][... if cells is None else cells]


def _checked(points_mm: Sequence[Point]) -> tuple[Point, ...]:
    limits = (-_FAR_MM, _FAR_MM)
    return tuple((check_number("x_mm", x_mm, *limits), check_number("y_mm", y_mm, *limits)) for x_mm, y_mm in points_mm)


def _grey(brightness: int | str) -> int:
    return check_count("brightness", brightness_of(brightness), 0, 255, "0 is floor.")
