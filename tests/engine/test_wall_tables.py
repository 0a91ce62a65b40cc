"""The tables of walls: brute force and SciPy as peers, and the same tables for threads."""

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

from kiks.engine.wall_tables import FARTHEST_LEAP, FILL_REACH, WAY_REACH
from kiks.model.arena import PAD
from kiks.model.raster import FACE_UNITS, LEAPS_PER_CELL, ROOM_CELLS, unpack_faces
from kiks.model.wall_tables import WallTables


def rasters() -> list[Any]:
    """Return dense and sparse dots, blocks, a disc, walls only, and no wall at all; wide and high, odd and even."""
    rng = np.random.default_rng(1)
    y, x = np.ogrid[:60, :77]
    disc = (y - 30.2) ** 2 + (x - 33.7) ** 2 < 20.5**2
    dots = [rng.random(shape) < share for shape, share in (((40, 31), 0.3), ((50, 97), 0.02), ((33, 64), 0.003))]
    blocks = np.kron(rng.random((7, 9)) < 0.3, np.ones((8, 6), bool))
    masks = [*dots, blocks, disc, ~disc, np.ones((5, 40), bool), np.zeros((70, 45), bool), np.zeros((1, 1), bool)]
    return [np.where(mask, rng.integers(1, 256, mask.shape), 0).astype(np.uint8) for mask in masks]


@pytest.mark.parametrize("brightness", rasters())
def test_distances_are_the_least_of_all(brightness: Any) -> None:
    tables = WallTables(brightness, 0.7)
    walls = np.argwhere(tables.surface)
    for (row, column), light in np.ndenumerate(tables.surface):
        away = np.abs(walls - (row, column))
        square = (away**2).sum(axis=1).min()
        assert tables.clearance[row, column] == np.sqrt(np.float32(square)) * np.float32(0.7)
        between = (np.maximum(away - 1, 0) ** 2).sum(axis=1).min()
        leap = math.isqrt(LEAPS_PER_CELL**2 * between)
        assert tables.leaps[row, column] == (-int(light) if light else leap)
    for (row, column), room in np.ndenumerate(tables.rooms):
        block = tables.clearance[ROOM_CELLS * row :, ROOM_CELLS * column :][:ROOM_CELLS, :ROOM_CELLS]
        assert room == block.min()


@pytest.mark.parametrize("shape", [(700, 900), (100, 20_000), (20_000, 100)])
def test_distances_in_large_rasters_are_those_of_scipy(shape: tuple[int, int]) -> None:
    from scipy.ndimage import distance_transform_edt

    rng = np.random.default_rng(2)
    tables = WallTables((rng.random(shape) < 1e-4).astype(np.uint8), 1.0)
    assert np.array_equal(tables.clearance, distance_transform_edt(tables.surface == 0).astype(np.float32))


def test_a_leap_ends_at_the_largest_number() -> None:
    tables = WallTables(np.zeros((4200, 4200), np.uint8), 1.0)
    assert tables.leaps[2100, 2100] == FARTHEST_LEAP
    assert tables.clearance.max() == 2100


def slow_face(walls: Any, row: int, column: int, block: int) -> tuple[float, ...]:
    """Return what one of `Arena.faces` means, by sums over the blocks near a cell."""
    y, x = (row + 0.5) / block - 0.5, (column + 0.5) / block - 0.5
    along_x = along_y = filled = whole = 0.0
    for up in range(round(y) - 12, round(y) + 13):
        for right in range(round(x) - 12, round(x) + 13):
            j, i = np.clip((up, right), 0, [-(-count // block) - 1 for count in walls.shape])
            share = walls[block * j : block * (j + 1), block * i : block * (i + 1)].mean()
            away = math.hypot(up - y, right - x)
            weight, near = (max(1 - (away / reach) ** 2, 0) ** 2 for reach in (WAY_REACH, FILL_REACH))
            along_x, along_y = along_x + (right - x) * weight * share, along_y + (up - y) * weight * share
            filled, whole = filled + near * share, whole + near
    reaches = np.linspace(-1, 1, 401)
    density = (1 - reaches**2) ** 2.5
    shares = np.concatenate([[0], np.cumsum(density[1:] + density[:-1])])
    distance = -FILL_REACH * block * float(np.interp(filled / whole, shares / shares[-1], reaches))
    length = math.hypot(along_x, along_y)
    return along_x / length, along_y / length, min(max(distance, -1.99), 1.99)


@pytest.mark.parametrize("mm_per_cell", [1.0, 0.5, 0.3, 0.1])
def test_faces_beside_walls_are_those_of_sums(mm_per_cell: float) -> None:
    rng = np.random.default_rng(3)
    for brightness in rasters()[:6]:
        tables = WallTables(brightness, mm_per_cell)
        walls = tables.surface > 0
        touching = np.zeros_like(walls)
        for up, right in np.ndindex(3, 3):
            touching[1:-1, 1:-1] |= walls[up : up + walls.shape[0] - 2, right : right + walls.shape[1] - 2]
        touching &= ~walls
        assert not tables.faces[~touching].any()
        assert np.mean(tables.faces[touching] != 0) > 0.99
        for row, column in rng.permutation(np.argwhere(tables.faces))[:20].tolist():
            expected = np.array(slow_face(walls, row, column, round(1 / mm_per_cell)))
            found = unpack_faces(tables.faces)[row, column]
            assert (np.abs(found - expected) * FACE_UNITS <= 0.5 + 1e-6).all()


def test_a_gap_between_equal_walls_has_no_face() -> None:
    brightness = np.zeros((60, 61), np.uint8)
    brightness[:, 10:30] = brightness[:, 31:51] = 9
    tables = WallTables(brightness, 1.0)
    assert not tables.faces[PAD + 15 : PAD + 45, PAD + 30].any()


def test_threads_get_the_same_tables() -> None:
    shared = WallTables(rasters()[1], 0.5)

    def made(number: int) -> bytes:
        tables = shared if number % 2 else WallTables(rasters()[1], 0.5)
        return tables.clearance.tobytes() + tables.faces.tobytes()

    with ThreadPoolExecutor(8) as threads:
        assert set(threads.map(made, range(32))) == {made(0)}
