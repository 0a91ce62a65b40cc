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

from kiks.engine.compiling import entry, kernel
from kiks.engine.sensing.disc_rays import hides
from kiks.engine.simd.f64x8 import pick
from kiks.engine.simd.stack_arrays import element, pointer_to, stack_floats
from kiks.model.arena import PAD, Arena
from kiks.model.raster import LEAPS_PER_CELL

_DIAGONAL = 1.4142135623730951
_WALK = 2.5  # up to this clearance a ray goes from cell to cell [cells]
_NUDGE = 1e-3  # over the edge of a cell [cells]
_FAR = 1e30
_LANES = 32  # of whole pictures: while some wait for the memory, others go on
_FLAT = 1e-24  # square of a direction's part along an axis below which a ray never gets to the next cell there


Walls: Any = namedtuple("Walls", ("clearance", "brightness", "leaps", "faces", "cell_mm", "pad"))
"""The walls as rays see them.

* clearance: distance of cells to the nearest wall [mm], 0 in a wall, float32 [rows, columns];
* brightness: brightness of cells, 0 for floor, uint8 [rows, columns];
* leaps: how far one may go from anywhere in a cell, int16 [rows, columns] (`kiks.model.arena.Arena.leaps`);
* faces: the smooth surface of the wall beside free cells that touch one, int32 [rows, columns] (`Arena.faces` there);
* cell_mm: edge of a cell [mm];
* pad: cells of the border around the arena.
"""


def walls_of(arena: Arena) -> tuple[Any, ...]:
    """Return the parts of `Walls`; a plain tuple, which Numba opens faster."""
    return arena.clearance, arena.surface, arena.leaps, arena.faces, float(arena.mm_per_cell), PAD


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
def cast(walls: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any, begin: Any = 0.0) -> Any:
    """Follow one ray.

    Args:
        walls: The walls as rays see them.
        column: Origin [cells].
        row: Origin [cells].
        cosine: Direction.
        sine: Direction.
        reach: Longest length followed [cells].
        begin: Length that is known to be free [cells].

    Returns:
        Length of the ray [cells], `reach` if it meets nothing, and the brightness of what it met, 0 for nothing.
    """
    field, surface, cell = walls.clearance, walls.brightness, walls.cell_mm
    per_cell = 1.0 / cell
    per_column = 1.0 / cosine if cosine * cosine > _FLAT else _FAR
    per_row = 1.0 / sine if sine * sine > _FLAT else _FAR
    right = 1 if cosine > 0.0 else 0
    up = 1 if sine > 0.0 else 0
    length = begin
    while length < reach:
        px = column + length * cosine
        py = row + length * sine
        i, j = cell_at(field, px, py)
        clearance = field[j, i] * per_cell
        if clearance == 0.0:
            return length, np.int64(surface[j, i])
        if clearance > _WALK:
            length += clearance - _DIAGONAL
        else:
            to_column = (i + right - px) * per_column if per_column < _FAR else _FAR
            to_row = (j + up - py) * per_row if per_row < _FAR else _FAR
            length += max(min(to_column, to_row), 0.0) + _NUDGE
    return reach, np.int64(0)


@kernel
def cast_many(walls: Any, columns: Any, rows: Any, cosines: Any, sines: Any, lengths: Any, brightnesses: Any) -> Any:
    """Follow many rays, each to the first wall: the lengths and brightnesses of `cast` to the bit, in less time.

    Neighbours step together, one lane each, until the last of them has met its wall; a lane that has stays where it is.

    Args:
        walls: The walls as rays see them.
        columns: Origins [cells], shape [rays].
        rows: Origins [cells], shape [rays].
        cosines: Directions, shape [rays].
        sines: Directions, shape [rays].
        lengths: Where the lengths of the rays go [cells], shape [rays].
        brightnesses: Where the brightnesses of the walls go, shape [rays].
    """
    field, surface, cell = walls.clearance, walls.brightness, walls.cell_mm
    per_cell = 1.0 / cell
    clearances, width = pointer_to(field), np.int32(field.shape[1])
    last_column, last_row = field.shape[1] - 1.0, field.shape[0] - 1.0
    column, row = stack_floats(_LANES), stack_floats(_LANES)
    cosine, sine = stack_floats(_LANES), stack_floats(_LANES)
    per_column, per_row = stack_floats(_LANES), stack_floats(_LANES)
    right, up = stack_floats(_LANES), stack_floats(_LANES)
    length = stack_floats(_LANES)
    for first in range(0, lengths.shape[0], _LANES):
        for lane in range(_LANES):
            ray = min(first + lane, lengths.shape[0] - 1)
            column[lane], row[lane], cosine[lane], sine[lane] = columns[ray], rows[ray], cosines[ray], sines[ray]
            per_column[lane] = 1.0 / cosine[lane] if cosine[lane] * cosine[lane] > _FLAT else _FAR
            per_row[lane] = 1.0 / sine[lane] if sine[lane] * sine[lane] > _FLAT else _FAR
            right[lane] = 1.0 if cosine[lane] > 0.0 else 0.0
            up[lane] = 1.0 if sine[lane] > 0.0 else 0.0
            length[lane] = 0.0
        under_way = np.int32(1)
        while under_way != 0:
            under_way = np.int32(0)
            for lane in range(_LANES):
                px = column[lane] + length[lane] * cosine[lane]
                py = row[lane] + length[lane] * sine[lane]
                i, j = np.int32(min(max(0.0, px), last_column)), np.int32(min(max(0.0, py), last_row))
                clearance = element(clearances, np.int32(j * width + i)) * per_cell
                to_column = (i + right[lane] - px) * per_column[lane] if per_column[lane] < _FAR else _FAR
                to_row = (j + up[lane] - py) * per_row[lane] if per_row[lane] < _FAR else _FAR
                walk = max(min(to_column, to_row), 0.0) + _NUDGE
                step = clearance - _DIAGONAL if clearance > _WALK else walk
                length[lane] += step if clearance > 0.0 else 0.0
                under_way |= np.int32(clearance > 0.0)
        for lane in range(min(_LANES, lengths.shape[0] - first)):
            ray = first + lane
            i, j = cell_at(field, column[lane] + length[lane] * cosine[lane], row[lane] + length[lane] * sine[lane])
            lengths[ray], brightnesses[ray] = length[lane], surface[j, i]


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
    length, brightness = cast(walls, column, row, dx / reach, dy / reach, reach)
    if brightness == 0:
        return True
    # Beyond the raster all is wall, however far the lamp hangs.
    end = min(reach, length + field.shape[0] + field.shape[1])
    while length < end:
        i, j = cell_at(field, column + dx * length / reach, row + dy * length / reach)
        if field[j, i] > 0.0:
            return False
        length += 0.5
    return True


@entry
def cast_ray(walls: Any, x: Any, y: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Follow one ray from Python; lengths and places in mm of the arena."""
    walls = Walls(*walls)
    cell, pad = walls.cell_mm, walls.pad
    per_cell = 1.0 / cell
    length, brightness = cast(walls, x * per_cell + pad, y * per_cell + pad, cosine, sine, reach * per_cell)
    return (length * cell if brightness > 0 else reach), brightness


@entry
def cast_rays(walls: Any, columns: Any, rows: Any, cosines: Any, sines: Any, lengths: Any, brightnesses: Any) -> Any:
    """Follow many rays from Python, each to the first wall; lengths and places in cells."""
    cast_many(Walls(*walls), columns, rows, cosines, sines, lengths, brightnesses)
