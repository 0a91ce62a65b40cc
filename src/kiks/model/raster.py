"""The raster below an arena: how large it may be, how a box is drawn into it, how far its cells are from a wall."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from functools import cache
from importlib.machinery import PathFinder
from itertools import product
from typing import Any

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

_BLOCK_ROWS = 64
_WAY_REACH, _FILL_REACH = 9.0, 3.5  # surroundings of a cell that tell which way its wall is, and how far [blocks]


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


def clearance_mm(surface: npt.NDArray[Any], mm_per_cell: float) -> npt.NDArray[np.float32]:
    """Return the distance to the nearest wall cell, between centres [mm].

    SciPy tells which wall cell is nearest; the distances are ours, in blocks that stay in the processor's cache,
    because SciPy's own come in float64 and take three times as long.
    """
    nearest = np.zeros((2, *surface.shape), np.int32)
    _feature_transform()((surface == 0).astype(np.int8), None, nearest)
    rows, columns = (np.arange(count, dtype=np.int32) for count in surface.shape)
    clearance = np.empty(surface.shape, np.float32)
    for first in range(0, len(rows), _BLOCK_ROWS):
        block = slice(first, first + _BLOCK_ROWS)
        up, right = nearest[0, block] - rows[block, None], nearest[1, block] - columns
        np.sqrt((up * up + right * right).astype(np.float32), out=clearance[block])
    clearance *= np.float32(mm_per_cell)
    return clearance


@cache
def _feature_transform() -> Callable[[npt.NDArray[np.int8], None, npt.NDArray[np.int32]], None]:
    """Return SciPy's function that writes down row and column of the zero nearest to each cell.

    `scipy.ndimage` takes an eighth of the time to the first reading of a sensor to import, and this function is in one
    file of it, which needs nothing else.
    """
    import scipy

    spec = PathFinder.find_spec("_nd_image", [f"{folder}/ndimage" for folder in scipy.__path__])
    if spec is None or spec.loader is None:
        from scipy.ndimage import _nd_image

        return _nd_image.euclidean_feature_transform  # type: ignore[no-any-return]
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.euclidean_feature_transform  # type: ignore[no-any-return]


def free_leaps(surface: npt.NDArray[np.uint8]) -> npt.NDArray[np.int16]:
    """Return how far it is from anywhere in a cell to the edge of the nearest wall cell [1/`LEAPS_PER_CELL` cells].

    That is how far their squares are apart: as far as the centre of the one is from that of the nearest cell that is a
    wall or touches one. Rounded down; walls have their brightness, negative.
    """
    above, near = surface > 0, surface > 0
    above[1:] |= near[:-1]
    above[:-1] |= near[1:]
    near[:] = above
    near[:, 1:] |= above[:, :-1]
    near[:, :-1] |= above[:, 1:]
    apart = clearance_mm(near, 1.0)
    leaps = np.minimum(apart * LEAPS_PER_CELL, np.iinfo(np.int16).max).astype(np.int16)
    np.negative(surface, out=leaps, where=surface > 0, dtype=np.int16)
    return leaps


def block_rooms(clearance: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the least clearance in each block of `ROOM_CELLS` x `ROOM_CELLS` cells; the last ones may be smaller."""
    rows, columns = (np.arange(0, size, ROOM_CELLS) for size in clearance.shape)
    return np.minimum.reduceat(np.minimum.reduceat(clearance, rows, axis=0), columns, axis=1)


def wall_faces(
    surface: npt.NDArray[np.uint8], clearance: npt.NDArray[np.float32], mm_per_cell: float
) -> npt.NDArray[np.int32]:
    """Return where the surface of the wall runs beside every free cell that touches one, as if it were not in steps.

    The way into the wall is the gradient of how much wall is around, and the distance to its surface is that at which a
    straight one would fill as much of a smaller surrounding; so a disc drawn in cells is round. Cells much smaller than
    a millimetre are combined in blocks; the share of wall in each block counts.

    Returns:
        What `Arena.faces` is.
    """
    faces = np.zeros(surface.shape, np.int32)
    rows, columns = np.nonzero((clearance > 0.0) & (clearance < 1.5 * mm_per_cell))
    block = max(round(1.0 / mm_per_cell), 1)
    walls = _block_means(surface > 0, block)
    # Places in blocks; the middle of the block that a cell is in, and how far the cell is from there.
    row, column = (rows + 0.5) / block - 0.5, (columns + 0.5) / block - 0.5
    middle_row, middle_column = np.rint(row).astype(np.int64), np.rint(column).astype(np.int64)
    gradient, filled, whole = np.zeros((len(rows), 2)), np.zeros(len(rows)), np.zeros(len(rows))
    steps = range(-math.ceil(_WAY_REACH), math.ceil(_WAY_REACH) + 1)
    for up, right in product(steps, steps):
        if math.hypot(up, right) > _WAY_REACH + 1.0:
            continue
        dy, dx = middle_row + up - row, middle_column + right - column
        square = dx * dx + dy * dy
        wall = walls[
            np.clip(middle_row + up, 0, walls.shape[0] - 1), np.clip(middle_column + right, 0, walls.shape[1] - 1)
        ]
        weight = np.maximum(1.0 - square / _WAY_REACH**2, 0.0) ** 2 * wall
        gradient[:, 0] += dx * weight
        gradient[:, 1] += dy * weight
        near = np.maximum(1.0 - square / _FILL_REACH**2, 0.0) ** 2
        filled += near * wall
        whole += near
    length = np.hypot(gradient[:, 0], gradient[:, 1])
    # In the middle of a gap as narrow as a cell both sides are as near: any way is as good.
    vectors = gradient / np.where(length > 1e-9, length, np.inf)[:, None]
    # No kernel uses distances beyond two cells.
    distance = np.clip(_distance_of_share(filled / whole) * block, -1.99, 1.99)
    whole_numbers = np.rint(np.column_stack([vectors, distance]) * FACE_UNITS).astype(np.int32)
    packed = np.zeros(len(rows), np.int32)
    for part, bits in enumerate(FACE_BITS):
        packed = packed << bits | whole_numbers[:, part] & ((1 << bits) - 1)
    faces[rows, columns] = np.where(length > 1e-9, packed, 0)
    return faces


def unpack_faces(faces: npt.NDArray[np.int32]) -> npt.NDArray[np.float64]:
    """Return the three parts of `Arena.faces`, shape [..., 3]: x and y of unit vectors, and distances [cells]."""
    parts = [faces >> 21, faces << 11 >> 21, faces << 22 >> 22]
    unpacked: npt.NDArray[np.float64] = np.stack(parts, axis=-1) / FACE_UNITS
    return unpacked


def _distance_of_share(share: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return how far from a straight wall a place is whose surrounding is filled to such a share [blocks].

    What lies x reaches away counts (1 - x^2)^(5/2), the integral of the weights (1 - x^2 - y^2)^2 over y.
    """
    x = np.linspace(-1.0, 1.0, 401)
    density = (1.0 - x * x) ** 2.5
    filled = np.concatenate([[0.0], np.cumsum(density[1:] + density[:-1])])
    distance: npt.NDArray[np.float64] = -_FILL_REACH * np.interp(share, filled / filled[-1], x)
    return distance


def _block_means(values: npt.NDArray[np.bool_], block: int) -> npt.NDArray[np.float64]:
    """Return which share of each square block of cells is true; those at the end may be smaller."""
    if block == 1:
        return values.astype(np.float64)
    rows, columns = (np.arange(0, count, block) for count in values.shape)
    sums = np.add.reduceat(np.add.reduceat(values, rows, axis=0, dtype=np.int64), columns, axis=1)
    cells = np.outer(
        *(np.diff(starts, append=count) for starts, count in zip((rows, columns), values.shape, strict=True))
    )
    means: npt.NDArray[np.float64] = sums / cells
    return means


def between(position: float, count: int) -> tuple[int, float]:
    """Return the lower neighbour of a position among `count` cell centres, and the upper one's share 0..1."""
    position = min(max(position, 0.0), count - 1.0)
    lower = min(int(position), count - 2)
    return lower, position - lower
