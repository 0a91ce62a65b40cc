"""Free places for a disc: near a given place, and anywhere in an arena."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError, shown
from kiks.model.arena import PAD, Arena
from kiks.model.raster import between, clearance_mm

OVERLAP_MM = 0.01
"""Largest overlap of placed objects [mm], so that touching objects can be restored."""


def room_mm(brightness: npt.NDArray[np.uint8], mm_per_cell: float, x_mm: float, y_mm: float, reach_mm: float) -> float:
    """Return the distance of a place from the nearest wall [mm], like `Arena.clearance_at_mm`; infinite beyond a reach.

    Args:
        brightness: The raster, uint8 [row, column], row 0 at the bottom.
        mm_per_cell: Edge of a cell [mm].
        x_mm: The place.
        y_mm: The place.
        reach_mm: The reach.
    """
    margin = math.ceil(reach_mm / mm_per_cell) + 3
    places = (y_mm / mm_per_cell, x_mm / mm_per_cell)
    firsts = [math.floor(place) - margin for place in places]
    size = 2 * margin + 1
    window = np.full((size, size), 255, np.uint8)
    inside = [
        slice(max(first, 0), max(min(first + size, count), 0))
        for first, count in zip(firsts, brightness.shape, strict=True)
    ]
    part = brightness[inside[0], inside[1]]
    if part.size:
        top, left = (piece.start - first for piece, first in zip(inside, firsts, strict=True))
        window[top : top + part.shape[0], left : left + part.shape[1]] = part
    if not window.any():
        return math.inf
    clearance = clearance_mm(window, mm_per_cell)
    row, row_share = between(places[0] - firsts[0] - 0.5, size)
    column, column_share = between(places[1] - firsts[1] - 0.5, size)
    square = clearance[row : row + 2, column : column + 2].astype(np.float64)
    upright = square[0] + row_share * (square[1] - square[0])
    return float(upright[0] + column_share * (upright[1] - upright[0]) - 0.5 * mm_per_cell)


def free_place(
    arena: Arena,
    discs: Iterable[tuple[float, float, float]],
    radius_mm: float,
    near: tuple[float, float] | None,
    what: str,
) -> tuple[float, float]:
    """Return the free place for a disc that is nearest to a given one; without one, the place with most room.

    Args:
        arena: Walls.
        discs: x, y and radius of obstacles [mm].
        radius_mm: Radius of the disc [mm].
        near: x and y of the wanted place [mm].
        what: Name of the disc in messages.
    """
    cell = arena.mm_per_cell
    rows, columns = arena.brightness.shape
    y, x = (np.arange(rows) + 0.5)[:, None] * cell, (np.arange(columns) + 0.5) * cell
    room = arena.clearance[PAD:-PAD, PAD:-PAD] - np.float32(0.5 * cell)
    for disc_x, disc_y, disc_radius in discs:
        np.minimum(room, (np.hypot(y - disc_y, x - disc_x) - disc_radius).astype(np.float32), out=room)
    is_free = room >= radius_mm
    if not is_free.any():
        raise ArenaError(
            f"There must be room for {what}, {2 * radius_mm:g} mm across, but in arena {shown(arena.name)} is none. "
            "Take a "
            "larger one, or take something away."
        )
    if near is None:
        best = room.argmax()
    else:
        best = np.where(is_free, np.hypot(y - near[1], x - near[0]), np.inf).argmin()
    row, column = divmod(int(best), columns)
    return (column + 0.5) * cell, (row + 0.5) * cell
