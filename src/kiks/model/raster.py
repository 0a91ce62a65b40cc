"""The raster below an arena: how large it may be, and the numbers that its tables are made with."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError
from kiks.model.checks import check_number

PAD = 2
"""Wall cells that stand around the raster in `Arena.surface` and `Arena.clearance`: the world outside is wall.

Two of them, so that interpolating between neighbours never needs a test at the raster's edge.
"""

MAX_CELLS = 64_000_000
"""Most cells of a raster: 8 m x 8 m at 1 mm. Squared distances then stay below 2**24, exact in float32."""

SIZE_MIN_MM = 100
"""Least width and height of an arena [mm]: less leaves a Khepera of 55 mm no room (kiks-behaviour.md, section 1.1)."""

MM_PER_PIXEL_MIN, MM_PER_PIXEL_MAX = 0.1, 100.0
"""Finest and coarsest picture [mm per pixel]; beyond them the number is more likely a slip than a wish."""

LEAPS_PER_CELL = 16
"""Units of `Arena.leaps` in the edge of a cell."""

ROOM_CELLS = 16
"""Edge of a block of `Arena.rooms` [cells]."""

FACE_UNITS = (1023.0, 1023.0, 256.0)
"""Units of the three parts of `Arena.faces`: in a vector's length, twice, and in the edge of a cell."""

FACE_BITS = (11, 11, 10)
"""Bits of each of them, from the highest on."""


def cells_per_pixel(row_count: int, column_count: int, mm_per_pixel: float) -> int:
    """Return into how many cells each edge of a pixel is cut so that no cell is larger than 1 mm."""
    advice = "Most arenas are drawn with 1 mm per pixel."
    check_number("mm_per_pixel", mm_per_pixel, MM_PER_PIXEL_MIN, MM_PER_PIXEL_MAX, advice)
    shape = f"{column_count} x {row_count} pixels of {mm_per_pixel:g} mm"
    # The tiny allowance is for products such as 1429 * 0.07 that fall a rounding error short.
    if min(row_count, column_count) * mm_per_pixel < SIZE_MIN_MM - 1e-9:
        raise ArenaError(
            f"An arena must be at least {SIZE_MIN_MM} x {SIZE_MIN_MM} mm, but this one has {shape}. "
            "Draw it larger or give a larger mm_per_pixel."
        )
    cells = math.ceil(mm_per_pixel)
    if row_count * column_count * cells**2 > MAX_CELLS:
        raise ArenaError(
            f"An arena must have at most {MAX_CELLS // 1_000_000} million cells, none larger than 1 mm, but this one "
            f"has {shape}, which makes {row_count * column_count * cells**2 / 1e6:.1f} million. Draw a smaller one."
        )
    return cells


def unpack_faces(faces: npt.NDArray[np.int32]) -> npt.NDArray[np.float64]:
    """Return the three parts of `Arena.faces`, shape [..., 3]: x and y of unit vectors, and distances [cells]."""
    parts = [faces >> 21, faces << 11 >> 21, faces << 22 >> 22]
    unpacked: npt.NDArray[np.float64] = np.stack(parts, axis=-1) / FACE_UNITS
    return unpacked


def between(position: float, count: int) -> tuple[int, float]:
    """Return the lower neighbour of a position among `count` cell centres, and the upper one's share 0..1."""
    position = min(max(position, 0.0), count - 1.0)
    lower = min(int(position), count - 2)
    return lower, position - lower
