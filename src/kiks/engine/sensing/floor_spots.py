"""The spot that a floor sensor sees, and a raster of the places where it is of one brightness.

Most readings see one brightness all over the spot, and a look into the raster tells them which.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.compiling import entry

SPOT_MM = 3.0
"""Radius of the spot that a sensor sees [mm]."""

BLOCK = 4
"""Edge of a block [cells]: a raster of blocks stays in the memory that is near the processor."""


def plains_of(floor: NDArray[np.uint8], cell_mm: float) -> NDArray[np.int16]:
    """Return the brightness of a spot whose middle is anywhere in a block, int16 [row, column]; -1 where it varies.

    Args:
        floor: Brightness of the floor, uint8 [row, column].
        cell_mm: Edge of a cell [mm].

    Example:
        >>> plains_of(np.array([[7] * 9 + [8]], np.uint8), cell_mm=1.0)
        array([[ 7, -1, -1]], dtype=int16)
    """
    if floor.size == 1:  # as most are: no kernel is loaded for them
        return floor.astype(np.int16)
    cells = np.ascontiguousarray(floor)[:]
    cells.setflags(write=False)  # for Numba that is another type, and one is enough
    plains = np.empty([-(-count // BLOCK) for count in floor.shape], np.int16)
    fill_plains(cells, float(cell_mm), plains)
    return plains


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
    bands = np.empty(plains.shape[1], np.int64)  # brightness of the row in the width of a block's spots
    tops = np.empty(plains.shape[1], np.int64)  # the first of the rows that have it
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
                if row == 0 or band != bands[block]:
                    bands[block], tops[block] = band, row
            row += 1
        for block in range(plains.shape[1]):
            is_plain = tops[block] <= max(BLOCK * block_row - reach, 0)
            plains[block_row, block] = bands[block] if is_plain else np.int16(-1)
