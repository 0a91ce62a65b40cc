"""The tables that follow from an arena's walls and floor: kernels, so that all who need them compute the same bits.

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
from kiks.engine.sensing.floor_spots import BLOCK, SPOT_MM
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
    rooms[:] = np.float32(np.inf)
    clearance[0] = np.float32(0.0)
    for row in range(1, row_count):
        for column in range(column_count):
            further = clearance[row - 1, column] + np.float32(1.0)
            clearance[row, column] = np.float32(0.0) if surface[row, column] else further
    for row in range(row_count - 2, -1, -1):
        for column in range(column_count):
            clearance[row, column] = min(clearance[row, column], clearance[row + 1, column] + np.float32(1.0))
    gaps, squares = np.empty(column_count, np.int64), np.empty(column_count, np.int64)
    kept, heights = np.empty(column_count, np.int64), np.empty(column_count, np.int64)
    for row in range(row_count):
        for column in range(column_count):
            gaps[column] = np.int64(clearance[row, column])
        for is_between_edges in (False, True):
            for column in range(column_count):
                gap = gaps[column]
                if is_between_edges:
                    # The squares of two cells are a cell nearer than their centres, in each direction.
                    gap = max(min(gaps[max(column - 1, 0)], gap, gaps[min(column + 1, column_count - 1)]) - 1, 0)
                squares[column] = gap * gap
            _envelope(squares, kept, heights)
            for column in range(column_count):
                distance = np.sqrt(np.float32(squares[column]))
                if is_between_edges:
                    leap = min(distance * np.float32(LEAPS_PER_CELL), np.float32(FARTHEST_LEAP))
                    leaps[row, column] = -np.int16(surface[row, column]) if surface[row, column] else np.int16(leap)
                else:
                    distance *= scale
                    clearance[row, column] = distance
                    block = column // ROOM_CELLS
                    rooms[row // ROOM_CELLS, block] = min(rooms[row // ROOM_CELLS, block], distance)


@kernel
def _envelope(squares: Any, kept: Any, heights: Any) -> Any:
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
            # The last one is nowhere nearest if the new one reaches below the one before it at an earlier place.
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
        least = heights[at] + (kept[at] - column) ** 2
        while at + 1 < count:
            other = heights[at + 1] + (kept[at + 1] - column) ** 2
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
    block = max(np.int64(np.rint(1.0 / mm_per_cell)), 1)
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
                distance = -FILL_REACH * _place_of(filled / whole) * block
                distance = min(max(distance, -_FARTHEST_FACE), _FARTHEST_FACE)
                packed = np.int64(0)
                parts = along_x / length, along_y / length, distance
                for part in range(3):
                    units = np.int64(np.rint(parts[part] * FACE_UNITS[part]))
                    packed = packed << FACE_BITS[part] | units & ((1 << FACE_BITS[part]) - 1)
                faces[row, column] = np.int32(packed)


@kernel
def _place_of(share: Any) -> Any:
    """Return where a straight wall ends that fills such a share of the surroundings [reaches]."""
    low, high = 0, len(_SHARES) - 1
    if share >= _SHARES[high]:
        return _PLACES[high]
    while high - low > 1:
        middle = (low + high) // 2
        if _SHARES[middle] <= share:
            low = middle
        else:
            high = middle
    slope = (_PLACES[high] - _PLACES[low]) / (_SHARES[high] - _SHARES[low])
    return slope * (share - _SHARES[low]) + _PLACES[low]


@entry
def fill_plains(floor: Any, cell_mm: Any, plains: Any) -> Any:
    """Write down the brightness of a spot whose middle is anywhere in a block; -1 where it varies.

    Beyond its edges the floor goes on as there.

    Args:
        floor: Brightness of the floor, uint8 [row, column].
        cell_mm: Edge of a cell [mm].
        plains: int16, a row and a column for each `BLOCK`.
    """
    row_count, column_count = floor.shape
    # A cell counts if its middle is less than half a cell beyond the spot, whose own is up to half a cell aside.
    reach = np.int64(SPOT_MM / cell_mm + 1.0)
    starts = np.empty(column_count, np.int64)  # where the cells of one brightness that end here begin
    bands = np.full(plains.shape[1], np.int16(-2))  # brightness of the row in the width of a block's spots
    tops = np.zeros(plains.shape[1], np.int64)  # the first of the rows that have it
    row = 0
    for block_row in range(plains.shape[0]):
        while row <= min(BLOCK * block_row + BLOCK - 1 + reach, row_count - 1):
            for column in range(column_count):
                is_same = column > 0 and floor[row, column] == floor[row, column - 1]
                starts[column] = starts[column - 1] if is_same else column
            for block in range(plains.shape[1]):
                last = min(BLOCK * block + BLOCK - 1 + reach, column_count - 1)
                is_plain = starts[last] <= max(BLOCK * block - reach, 0)
                band = np.int16(floor[row, last]) if is_plain else np.int16(-1)
                if band != bands[block]:
                    bands[block], tops[block] = band, row
            row += 1
        for block in range(plains.shape[1]):
            is_plain = tops[block] <= max(BLOCK * block_row - reach, 0)
            plains[block_row, block] = bands[block] if is_plain else np.int16(-1)
