"""The spot that a floor sensor sees, and a raster of the places where it is of one brightness.

Most readings see one brightness all over the spot, and a look into the raster tells them which.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

SPOT_MM = 3.0
"""Radius of the spot that a sensor sees [mm]."""

BLOCK = 4
"""Edge of a block [cells]: a raster of blocks stays in the memory that is near the processor."""


def plains_of(floor: NDArray[np.uint8], cell_mm: float) -> NDArray[np.int16]:
    """Return the brightness of a spot whose middle is anywhere in a block, int16 [row, column]; -1 where it varies.

    Beyond its edges the floor goes on as there.

    Args:
        floor: Brightness of the floor, uint8 [row, column].
        cell_mm: Edge of a cell [mm].

    Example:
        >>> plains_of(np.array([[7] * 9 + [8]], np.uint8), cell_mm=1.0)
        array([[ 7, -1, -1]], dtype=int16)
    """
    # A cell counts if its middle is less than half a cell beyond the spot, whose own is up to half a cell aside.
    reach = math.floor(SPOT_MM / cell_mm + 1.0)
    wide, count = np.pad(floor, (reach, reach + BLOCK - 1), mode="edge"), 2 * reach + BLOCK
    least, largest = (_among(choose, _among(choose, wide, count).T, count).T for choose in (np.minimum, np.maximum))
    plains = np.where(least == largest, floor, np.int16(-1))
    return np.ascontiguousarray(plains[::BLOCK, ::BLOCK], np.int16)


def _among(choose: Any, cells: NDArray[np.uint8], count: int) -> NDArray[np.uint8]:
    """Return the least, or the largest, of each `count` rows that follow each other."""
    width = 1
    while width < count:
        step = min(width, count - width)
        cells, width = choose(cells[:-step], cells[step:]), width + step
    return cells
