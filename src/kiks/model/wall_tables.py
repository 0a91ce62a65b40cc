"""What follows from the raster of an arena, such as distances from walls: shared by arenas with the same raster."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from kiks import upwards
from kiks.model.raster import PAD, ROOM_CELLS

SHARED_CELLS = 1_000_000
"""Largest raster whose tables other arenas with the same raster share [cells]."""

SHARED_COUNT = 8
"""Number of rasters whose tables are kept: at most 100 MB."""


class WallTables:
    """Tables of a raster, computed at their first use by the kernels of the engine; `Arena` says what they hold.

    Threads that race for one may compute it twice; the arrays are equal, and one of the two is kept.
    """

    def __init__(self, brightness: npt.NDArray[np.uint8], mm_per_cell: float) -> None:
        self._brightness, self._mm_per_cell = brightness, mm_per_cell

    @cached_property
    def surface(self) -> npt.NDArray[np.uint8]:
        """See `Arena.surface`."""
        return _read_only(np.pad(self._brightness, PAD, constant_values=255))

    @cached_property
    def _distances(self) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], npt.NDArray[np.int16]]:
        row_count, column_count = self.surface.shape
        clearance = np.empty((row_count, column_count), np.float32)
        rooms = np.empty((-(-row_count // ROOM_CELLS), -(-column_count // ROOM_CELLS)), np.float32)
        leaps = np.empty((row_count, column_count), np.int16)
        upwards.fill_distances(self.surface, self._mm_per_cell, clearance, rooms, leaps)
        return _read_only(clearance), _read_only(rooms), _read_only(leaps)

    @property
    def clearance(self) -> npt.NDArray[np.float32]:
        """See `Arena.clearance`."""
        return self._distances[0]

    @property
    def rooms(self) -> npt.NDArray[np.float32]:
        """See `Arena.rooms`."""
        return self._distances[1]

    @property
    def leaps(self) -> npt.NDArray[np.int16]:
        """See `Arena.leaps`."""
        return self._distances[2]

    @cached_property
    def faces(self) -> npt.NDArray[np.int32]:
        """See `Arena.faces`."""
        faces = np.empty(self.leaps.shape, np.int32)
        upwards.fill_faces(self.leaps, self._mm_per_cell, faces)
        return _read_only(faces)


def _read_only(table: npt.NDArray[Any]) -> npt.NDArray[Any]:
    table.setflags(write=False)
    return table


def wall_tables(brightness: npt.NDArray[np.uint8], mm_per_cell: float) -> WallTables:
    """Return the tables of a raster that never changes: those of an earlier arena with the same one, if it is small."""
    if brightness.size > SHARED_CELLS:
        return WallTables(brightness, mm_per_cell)
    return _shared(brightness.tobytes(), brightness.shape, mm_per_cell)


@lru_cache(maxsize=SHARED_COUNT)
def _shared(cells: bytes, shape: tuple[int, int], mm_per_cell: float) -> WallTables:
    return WallTables(np.frombuffer(cells, np.uint8).reshape(shape), mm_per_cell)
