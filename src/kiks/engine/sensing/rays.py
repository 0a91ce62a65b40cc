"""Rays in an arena: the distance to a wall, exact to a hundredth of a millimetre, and the brightness of that wall.

Method: the clearance of a cell (distance from its centre to the nearest wall cell's centre), less the diagonal of a
cell, is a distance that any point of the cell may go freely in any direction: empty space is crossed in a few leaps.
Next to a wall the ray goes to the edge of its cell instead, so no corner is missed.

Places and lengths of the kernels are in cells of the raster with its border.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from kiks.engine.compiling import kernel
from kiks.engine.sensing.disc_rays import hides
from kiks.engine.simd.lanes import LANES, floor, load, store
from kiks.engine.simd.masks import anywhere, choose, opposite
from kiks.engine.simd.rasters import pick
from kiks.model.arena import PAD, Arena
from kiks.model.raster import LEAPS_PER_CELL

_DIAGONAL = 1.4142135623730951
_WALK = 2.5  # up to this clearance a ray goes from cell to cell [cells]
_NUDGE = 1e-3  # over the edge of a cell [cells]
_FAR = 1e30
_FLAT = 1e-24  # square of a direction's part along an axis below which a ray never gets to the next cell there

ENDLESS = 1e9
"""Length of rays that only a wall ends [cells]: the border of the world is nearer."""

Walls: Any = namedtuple("Walls", ("clearance", "rooms", "brightness", "leaps", "faces", "cell_mm", "pad"))
"""The walls as rays see them.

* clearance: distance of cells to the nearest wall [mm], 0 in a wall, float32 [rows, columns];
* rooms: the least clearance in blocks of cells [mm], float32 (`kiks.model.arena.Arena.rooms`);
* brightness: brightness of cells, 0 for floor, uint8 [rows, columns];
* leaps: how far one may go from anywhere in a cell, int16 [rows, columns] (`kiks.model.arena.Arena.leaps`);
* faces: the smooth surface of the wall beside free cells that touch one, int32 [rows, columns] (`Arena.faces` there);
* cell_mm: edge of a cell [mm];
* pad: cells of the border around the arena.
"""


def walls_of(arena: Arena) -> tuple[Any, ...]:
    """Return the parts of `Walls`; a plain tuple, which Numba opens faster."""
    tables = arena.clearance, arena.rooms, arena.surface, arena.leaps, arena.faces
    return *tables, float(arena.mm_per_cell), PAD


@kernel
def cell_at(raster: Any, column: Any, row: Any) -> Any:
    """Return the column and row of the cell that a place is in; outside the raster, of the nearest one."""
    i, j = min(max(0.0, column), raster.shape[1] - 1.0), min(max(0.0, row), raster.shape[0] - 1.0)
    return np.int64(i), np.int64(j)


@kernel
def free_cells(walls: Any, column: Any, row: Any) -> Any:
    """Return how far a point may go in any direction without meeting a wall [cells]; at most 0 next to one."""
    field, cell = walls.clearance, walls.cell_mm
    return pick(field, column, row) * (1.0 / cell) - _DIAGONAL


@kernel
def leap_at(walls: Any, column: Any, row: Any) -> Any:
    """Return how far a point, or eight, may go in any direction [cells]; less than 0 in a wall and beyond."""
    return pick(walls.leaps, column, row) * (1.0 / LEAPS_PER_CELL)


@kernel
def cast(walls: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Follow a ray to the first wall, or eight, in lanes; a lane that has met its wall stays where it is.

    Args:
        walls: The walls as rays see them.
        column: Origin [cells], a number or `Lanes`, as are the next three.
        row: Origin [cells].
        cosine: Direction.
        sine: Direction.
        reach: Longest length followed [cells].

    Returns:
        Length of the ray [cells], `reach` if it meets nothing, and whether it met a wall: a boolean, or a mask.
    """
    field, per_cell = walls.clearance, 1.0 / walls.cell_mm
    last_column, last_row = field.shape[1] - 1.0, field.shape[0] - 1.0
    per_column = choose(cosine * cosine > _FLAT, 1.0 / cosine, _FAR)
    per_row = choose(sine * sine > _FLAT, 1.0 / sine, _FAR)
    right, up = choose(cosine > 0.0, 1.0, 0.0), choose(sine > 0.0, 1.0, 0.0)
    length = 0.0 * cosine
    goes_on, is_met = length < reach, length < 0.0
    while anywhere(goes_on):
        px, py = column + length * cosine, row + length * sine
        i, j = floor(min(max(0.0, px), last_column)), floor(min(max(0.0, py), last_row))
        clearance = pick(field, i, j) * per_cell
        is_met = is_met | (goes_on & (clearance == 0.0))
        to_column = choose(per_column < _FAR, (i + right - px) * per_column, _FAR)
        to_row = choose(per_row < _FAR, (j + up - py) * per_row, _FAR)
        walk = max(min(to_column, to_row), 0.0) + _NUDGE
        goes_on = goes_on & opposite(is_met)
        length = choose(goes_on, length + choose(clearance > _WALK, clearance - _DIAGONAL, walk), length)
        goes_on = goes_on & (length < reach)
    return choose(is_met, length, reach), is_met


@kernel
def brightness_at(walls: Any, column: Any, row: Any) -> Any:
    """Return the brightness of the wall at a place [cells], 0 for floor."""
    i, j = cell_at(walls.brightness, column, row)
    return np.int64(walls.brightness[j, i])


@kernel
def brightness_met(walls: Any, column: Any, row: Any, cosine: Any, sine: Any, length: Any, is_met: Any) -> Any:
    """Return the brightness of the wall that a ray met, 0 for none; arguments and results of `cast`."""
    return brightness_at(walls, column + length * cosine, row + length * sine) if is_met else 0


@kernel
def cast_many(walls: Any, columns: Any, rows: Any, cosines: Any, sines: Any, lengths: Any) -> Any:
    """Write the lengths of many rays, each to the first wall, into `lengths`: `cast` without a limit of the length.

    All arrays are float64 of one length, which is a multiple of eight; places and lengths are in cells.
    """
    for first in range(0, lengths.shape[0], LANES):
        origins, directions = (load(columns[first:]), load(rows[first:])), (load(cosines[first:]), load(sines[first:]))
        store(lengths[first:], cast(walls, *origins, *directions, ENDLESS)[0])


@kernel
def is_lit(walls: Any, seen: Any, seen_count: Any, x: Any, y: Any, lamp_x: Any, lamp_y: Any) -> Any:
    """Return whether nothing stands between a place and a lamp [mm].

    A lamp may hang over a wall or a thing, which hides nothing then.

    Args:
        walls: The walls as rays see them.
        seen: Discs that may stand between (`kiks.engine.sensing.disc_rays`).
        seen_count: Number of discs.
        x: The place [mm].
        y: The place [mm].
        lamp_x: The lamp [mm].
        lamp_y: The lamp [mm].
    """
    field, cell, pad = walls.clearance, walls.cell_mm, walls.pad
    per_cell = 1.0 / cell
    column, row = x * per_cell + pad, y * per_cell + pad
    dx, dy = (lamp_x - x) * per_cell, (lamp_y - y) * per_cell
    reach = math.sqrt(dx * dx + dy * dy)
    if reach == 0.0:
        return True
    for k in range(seen_count):
        if hides(seen, k, column, row, dx / reach, dy / reach, reach):
            return False
    length, is_met = cast(walls, column, row, dx / reach, dy / reach, reach)
    if not is_met:
        return True
    # Beyond the raster all is wall, however far the lamp hangs.
    end = min(reach, length + field.shape[0] + field.shape[1])
    while length < end:
        i, j = cell_at(field, column + dx * length / reach, row + dy * length / reach)
        if field[j, i] > 0.0:
            return False
        length += 0.5
    return True
