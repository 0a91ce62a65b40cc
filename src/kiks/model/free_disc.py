"""Free places for a disc: near a given place, and anywhere in an arena."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from kiks.errors import ArenaError, shown
from kiks.model.arena import PAD, Arena

OVERLAP_MM = 0.01
"""Largest overlap of placed objects [mm], so that touching objects can be restored."""


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
    discs, cell = list(discs), arena.mm_per_cell
    if near is not None and _is_free(arena, discs, radius_mm, *near):
        return near
    rows, columns = arena.brightness.shape
    y, x = (np.arange(rows) + 0.5)[:, None] * cell, (np.arange(columns) + 0.5) * cell
    room = arena.clearance[PAD:-PAD, PAD:-PAD] - np.float32(0.5 * cell)
    for disc_x, disc_y, disc_radius in discs:
        np.minimum(room, (np.hypot(y - disc_y, x - disc_x) - disc_radius).astype(np.float32), out=room)
    is_free = room >= radius_mm
    if not is_free.any():
        raise ArenaError(
            f"There must be room for {what}, {2 * radius_mm:g} mm across, but in arena {shown(arena.name)} is none. "
            "Use a larger one, or remove something."
        )
    if near is None:
        best = room.argmax()
    else:
        best = np.where(is_free, np.hypot(y - near[1], x - near[0]), np.inf).argmin()
    row, column = divmod(int(best), columns)
    return (column + 0.5) * cell, (row + 0.5) * cell


def _is_free(
    arena: Arena, discs: Iterable[tuple[float, float, float]], radius_mm: float, x_mm: float, y_mm: float
) -> bool:
    is_inside = 0 <= x_mm <= arena.width_mm and 0 <= y_mm <= arena.height_mm
    return (
        is_inside
        and arena.clearance_at_mm(x_mm, y_mm) >= radius_mm - OVERLAP_MM
        and all(math.hypot(x - x_mm, y - y_mm) >= radius + radius_mm - OVERLAP_MM for x, y, radius in discs)
    )
