"""Which cells of a raster a shape covers.

Need: what is drawn mirrored comes out mirrored, to the cell, and a stroke over 8 m must not take the memory of 8 x 8 m.
Method: a cell is covered if its centre is, borders included. Everything is counted in whole 64ths of a cell, so that no
rounding decides about a centre on the border; and a stroke is cut into pieces of a few rows, of which only the columns
near the stroke are examined.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError
from kiks.model.raster import MAX_CELLS

PER_CELL = 64
"""Units in a cell."""

EXAMINED_MAX = 4 * MAX_CELLS
"""Most cells that are examined to draw all walls of an arena: some seconds of work."""

_STRIP_ROWS, _STRIP_COLUMNS = 64, 8192

Point = tuple[float, float]


def paint(raster: npt.NDArray[Any], areas: Iterable[Area], value: int, examined_max: int = EXAMINED_MAX) -> int:
    """Give cells of a raster a value.

    Args:
        raster: The raster [row, column].
        areas: The cells.
        value: Their value.
        examined_max: Most cells that are examined.

    Returns:
        Number of cells that were examined.
    """
    examined = 0
    for rows, columns, mask in areas:
        part = raster[rows, columns]
        part[... if mask is None else mask] = value
        examined += part.size
        if examined > examined_max:
            raise ArenaError(
                f"lines, boxes and discs must have at most {EXAMINED_MAX} cells together, but these have more. Make "
                "them smaller or fewer, or draw a picture."
            )
    return examined


def covered(shape: tuple[int, int], areas: Iterable[Area]) -> npt.NDArray[np.bool_]:
    """Return which cells of a raster are in one of the areas, bool [row, column]."""
    found = np.zeros(shape, np.bool_)
    paint(found, areas, True)
    return found


class Area(NamedTuple):
    """Cells of a raster: a box of rows and columns, and which of them, all if `mask` is None."""

    rows: slice
    columns: slice
    mask: npt.NDArray[np.bool_] | None = None


def rectangle_cells(shape: tuple[int, int], corner: Point, opposite: Point) -> list[Area]:
    """Return the cells of a raster whose centres lie in a rectangle.

    Args:
        shape: Rows and columns of the raster.
        corner: x and y of a corner [cells], (0, 0) the lower left corner of the raster.
        opposite: x and y of the opposite corner [cells].
    """
    columns, rows = (
        _centres(_units(min(a, b)), _units(max(a, b)), count)
        for a, b, count in zip(corner, opposite, shape[::-1], strict=True)
    )
    return [Area(rows, columns)] if rows.start < rows.stop and columns.start < columns.stop else []


def stroke_cells(shape: tuple[int, int], points: Sequence[Point], width: float) -> Iterator[Area]:
    """Yield the cells of a raster whose centres are at most half a width from a line through points.

    Args:
        shape: Rows and columns of the raster.
        points: x and y of at least one point [cells], (0, 0) the lower left corner of the raster.
        width: Width of the brush [cells].
    """
    whole = [(_units(x), _units(y)) for x, y in points]
    radius = _units(width) / 2
    for begin, end in pairwise(whole) if len(whole) > 1 else [(whole[0], whole[0])]:
        yield from _segment_cells(shape, begin, end, radius)


def _segment_cells(
    shape: tuple[int, int], begin: tuple[int, int], end: tuple[int, int], radius: float
) -> Iterator[Area]:
    low, high = sorted((begin[1], end[1]))
    rows = _centres(math.ceil(low - radius), math.floor(high + radius), shape[0])
    for first in range(rows.start, rows.stop, _STRIP_ROWS):
        strip = slice(first, min(first + _STRIP_ROWS, rows.stop))
        left, right = _reach(begin, end, strip.start * PER_CELL - radius, strip.stop * PER_CELL + radius)
        reached = _centres(math.floor(left - radius), math.ceil(right + radius), shape[1])
        y = (np.arange(strip.start, strip.stop)[:, None] * 2 + 1) * (PER_CELL // 2)
        for start in range(reached.start, reached.stop, _STRIP_COLUMNS):
            columns = slice(start, min(start + _STRIP_COLUMNS, reached.stop))
            x = (np.arange(columns.start, columns.stop) * 2 + 1) * (PER_CELL // 2)
            mask = _near(x, y, begin, end, radius)
            if mask.any():
                yield Area(strip, columns, mask)


def _near(
    x: npt.NDArray[np.int64], y: npt.NDArray[np.int64], begin: tuple[int, int], end: tuple[int, int], radius: float
) -> npt.NDArray[np.bool_]:
    """Return which places are at most a radius from a line between two points."""
    way_x, way_y = end[0] - begin[0], end[1] - begin[1]
    from_begin_x, from_begin_y = x - begin[0], y - begin[1]
    square = int(4 * radius * radius) // 4
    near: npt.NDArray[np.bool_] = from_begin_x**2 + from_begin_y**2 <= square
    near |= (x - end[0]) ** 2 + (y - end[1]) ** 2 <= square
    length_2 = way_x * way_x + way_y * way_y
    if length_2:
        along = from_begin_x * way_x + from_begin_y * way_y
        aside = np.abs(from_begin_x * way_y - from_begin_y * way_x)
        # aside <= radius length, in whole numbers.
        most = math.isqrt(int(4 * radius * radius) * length_2 // 4)
        near |= (along >= 0) & (along <= length_2) & (aside <= most)
    return near


def _reach(begin: tuple[int, int], end: tuple[int, int], low: float, high: float) -> tuple[float, float]:
    """Return the least and the largest x of that part of a line which lies between two heights."""
    if begin[1] == end[1]:
        return min(begin[0], end[0]), max(begin[0], end[0])
    shares = (min(max((y - begin[1]) / (end[1] - begin[1]), 0.0), 1.0) for y in (low, high))
    one, other = (begin[0] + share * (end[0] - begin[0]) for share in shares)
    return min(one, other) - 1.0, max(one, other) + 1.0


def _units(cells: float) -> int:
    return round(cells * PER_CELL)


def _centres(low: int, high: int, count: int) -> slice:
    """Return those of `count` cells whose centres lie between two places [units], both included."""
    half = PER_CELL // 2
    first = max(-((half - low) // PER_CELL), 0)
    last = min((high - half) // PER_CELL, count - 1)
    return slice(first, max(last + 1, first))
