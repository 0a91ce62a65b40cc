"""The tables that follow from an arena's walls: kernels, so that all who need them compute the same bits.

The method of the distances is of two passes. The first finds how far it is to the nearest wall in the same column. In
the second, a column with a wall at distance g is as far from the cell at column c as the square root of
(c - column)^2 + g^2: of all columns of a row, those are kept that are nearest to some cell, the lower envelope of
parabolas. It takes whole numbers, and a time that grows as the number of cells.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.compiling import entry, kernel
from kiks.model.raster import FACE_BITS, FACE_UNITS, LEAPS_PER_CELL, ROOM_CELLS

FARTHEST_LEAP = np.iinfo(np.int16).max
"""Largest number in `Arena.leaps`."""

WAY_REACH, FILL_REACH = 9.0, 3.5
"""Surroundings of a cell that tell which way its wall is, and how far [blocks]."""

_REACH = math.ceil(WAY_REACH) + 1  # a cell is up to 0.7 blocks from the middle of its own
_DIRECTION_MIN = 1e-9
_FARTHEST_FACE = 1.99  # [cells]: no kernel uses distances beyond two


def _filled_shares() -> NDArray[np.float64]:
    """Return which share of its surroundings is wall where a straight one is `FILL_REACH` .. -`FILL_REACH` away.

    What lies x reaches away counts (1 - x^2)^(5/2), the integral of the weights (1 - x^2 - y^2)^2 over y.
    """
    x = np.linspace(-1.0, 1.0, 401)
    rest = 1.0 - x * x
    density = rest * rest * np.sqrt(rest)
    filled = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
    shares: NDArray[np.float64] = filled / filled[-1]
    return shares


_SHARES = _filled_shares()
_PLACES = np.linspace(-1.0, 1.0, len(_SHARES))


@entry
def fill_distances(surface: Any, mm_per_cell: Any, clearance: Any, rooms: Any, leaps: Any) -> Any:
    """Write down how far cells are from walls.

    Args:
        surface: `Arena.surface`, uint8 [row, column], with walls along its edges.
        mm_per_cell: Edge of a cell [mm].
        clearance: `Arena.clearance`, float32 of the same shape.
        rooms: `Arena.rooms`, float32: a row and a column for each `ROOM_CELLS`.
        leaps: `Arena.leaps`, int16 of the same shape as `surface`.
    """
    row_count, column_count = surface.shape
    scale = np.float32(mm_per_cell)
    for row in range(row_count):
        for column in range(column_count):
            # The distance to the next wall in lower rows, as the first row is wall; a whole number in float32.
            clearance[row, column] = 0.0 if surface[row, column] else clearance[row - 1, column] + 1.0
    for row in range(rooms.shape[0]):
        for column in range(rooms.shape[1]):
            rooms[row, column] = np.inf
    gaps, squares = np.empty(column_count, np.int64), np.empty(column_count, np.int64)
    kept, heights = np.empty(column_count, np.int64), np.empty(column_count, np.int64)
    for row in range(row_count - 1, -1, -1):
        for column in range(column_count):
            gaps[column] = 0 if surface[row, column] else min(gaps[column] + 1, np.int64(clearance[row, column]))
        for column in range(column_count):
            # The squares of two cells are a cell nearer than their centres, in each direction.
            left, right = gaps[max(column - 1, 0)], gaps[min(column + 1, column_count - 1)]
            gap = max(min(left, right, gaps[column]) - 1, 0)
            squares[column] = gap * gap
        _add_along_row(squares, kept, heights)
        for column in range(column_count):
            leap = np.float32(math.sqrt(squares[column])) * LEAPS_PER_CELL
            leaps[row, column] = -np.int64(surface[row, column]) if surface[row, column] else min(leap, FARTHEST_LEAP)
            squares[column] = gaps[column] * gaps[column]
        _add_along_row(squares, kept, heights)
        for column in range(column_count):
            distance = np.float32(math.sqrt(squares[column])) * scale
            clearance[row, column] = distance
            if distance < rooms[row // ROOM_CELLS, column // ROOM_CELLS]:
                rooms[row // ROOM_CELLS, column // ROOM_CELLS] = distance


@kernel
def _add_along_row(squares: Any, kept: Any, heights: Any) -> Any:
    """Add to squares of distances those along the row, where that leads to a smaller sum.

    Args:
        squares: Square of the distance to the nearest wall in the column of each cell, then to the nearest of all.
        kept: Room for the columns that are nearest to some cell.
        heights: Room for their squares.
    """
    count = 0
    for column in range(len(squares)):
        height = squares[column]
        while count >= 2:
            # The last one is nowhere nearest if the new one is as near where the one before it ceases to be nearer.
            before, last = column - kept[count - 1], kept[count - 1] - kept[count - 2]
            whole = before + last
            risen = whole * heights[count - 1] - before * heights[count - 2] - last * height
            if risen <= before * last * whole:
                break
            count -= 1
        kept[count], heights[count] = column, height
        count += 1
    at = 0
    for column in range(len(squares)):
        away = column - kept[at]
        least = away * away + heights[at]
        while at + 1 < count:
            away = column - kept[at + 1]
            other = away * away + heights[at + 1]
            if other >= least:
                break
            at, least = at + 1, other
        squares[column] = least


@entry
def fill_faces(leaps: Any, mm_per_cell: Any, faces: Any) -> Any:
    """Write down where the surface of the wall runs beside free cells that touch one, as if it were not in steps.

    The way into the wall is the gradient of how much wall is around, and the distance to its surface is that at which a
    straight one would fill as much of a smaller surrounding; so a disc drawn in cells is round. Cells much smaller than
    a millimetre are combined in blocks; the share of wall in each block counts.

    Args:
        leaps: `Arena.leaps`, int16 [row, column].
        mm_per_cell: Edge of a cell [mm].
        faces: `Arena.faces`, int32 of the same shape.
    """
    row_count, column_count = leaps.shape
    block: Any = max(np.int64(np.rint(1.0 / mm_per_cell)), 1)
    last_row, last_column = (row_count - 1) // block, (column_count - 1) // block
    walls = np.zeros((last_row + 1, last_column + 1), np.uint8)  # cells of each block that are wall, at most 10 x 10
    for row in range(row_count):
        for column in range(column_count):
            walls[row // block, column // block] += leaps[row, column] < 0
    for row in range(row_count):
        for column in range(column_count):
            faces[row, column] = 0
            if leaps[row, column] != 0:
                continue
            # Places in blocks; the middle of the block that the cell is in, and how far the cell is from there.
            y, x = (row + 0.5) / block - 0.5, (column + 0.5) / block - 0.5
            middle_row, middle_column = np.int64(np.rint(y)), np.int64(np.rint(x))
            along_x = along_y = filled = whole = 0.0
            for up in range(-_REACH, _REACH + 1):
                at_row = min(max(middle_row + up, 0), last_row)
                dy = middle_row + up - y
                for right in range(-_REACH, _REACH + 1):
                    at_column = min(max(middle_column + right, 0), last_column)
                    dx = middle_column + right - x
                    square = dx * dx + dy * dy
                    if square >= WAY_REACH * WAY_REACH:
                        continue
                    near = max(1.0 - square / (FILL_REACH * FILL_REACH), 0.0)
                    near *= near
                    whole += near
                    if walls[at_row, at_column] == 0:
                        continue
                    height = min(block, row_count - at_row * block)
                    width = min(block, column_count - at_column * block)
                    wall = walls[at_row, at_column] / (height * width)
                    weight = 1.0 - square / (WAY_REACH * WAY_REACH)
                    weight = weight * weight * wall
                    along_x += dx * weight
                    along_y += dy * weight
                    filled += near * wall
            length = math.sqrt(along_x * along_x + along_y * along_y)
            # In the middle of a gap as narrow as a cell both sides are as near: any way is as good.
            if length > _DIRECTION_MIN:
                share, at = filled / whole, 0
                while at + 2 < len(_SHARES) and _SHARES[at + 1] <= share:
                    at += 1
                slope = (_PLACES[at + 1] - _PLACES[at]) / (_SHARES[at + 1] - _SHARES[at])
                distance = -FILL_REACH * (slope * (share - _SHARES[at]) + _PLACES[at]) * block
                distance = min(max(distance, -_FARTHEST_FACE), _FARTHEST_FACE)
                packed = np.int64(0)
                parts = along_x / length, along_y / length, distance
                for part in range(3):
                    units = np.int64(np.rint(parts[part] * FACE_UNITS[part]))
                    packed = packed << FACE_BITS[part] | units & ((1 << FACE_BITS[part]) - 1)
                faces[row, column] = np.int32(packed)
