"""Mazes and random rooms: sizes of the Matlab KiKS, every place within a robot's reach, the same for the same seed."""

import hashlib
from collections import Counter
from functools import partial

import numpy as np
import pytest
from tests.at_length import share
from tests.model.refusals import refused

from kiks.errors import ArenaError
from kiks.model.arena import PAD, Arena, Lamp, Pose
from kiks.model.room import GAP_MM, draw_room

KHEPERA_MM = 55.0

SIZES = [
    {},
    {"columns": 5, "rows": 5},
    {"columns": 1, "rows": 1},
    {"columns": 1, "rows": 6},
    {"columns": 9, "rows": 1, "path_mm": 100},
    {"columns": 7, "rows": 3, "path_mm": 79, "wall_mm": 1},
    {"columns": 3, "rows": 4, "path_mm": 97, "wall_mm": 10},
    {"columns": 3, "rows": 4, "path_mm": 98, "wall_mm": 10},
    {"columns": 4, "rows": 3, "path_mm": 277, "wall_mm": 100},
]


def parts_for_a_robot(arena: Arena) -> np.ndarray:
    """Number the connected places where a Khepera's centre may be, 0 for none: [row, column], row 0 at the bottom."""
    from scipy.ndimage import label

    from_wall_mm = arena.clearance[PAD:-PAD, PAD:-PAD] - 0.5
    return label(from_wall_mm >= KHEPERA_MM / 2)[0]


def open_doors(arena: Arena, columns: int, rows: int, path_mm: int = 120, wall_mm: int = 10) -> frozenset[tuple]:
    """Return between which neighbouring cells there is floor, read from the raster."""
    picture, step = arena.brightness[::-1], path_mm + wall_mm
    doors = set()
    for column in range(columns):
        for row in range(rows):
            x, y = path_mm + column * step + path_mm // 2, row * step + path_mm // 2
            if column + 1 < columns and picture[y, x + step // 2] == 0:
                doors.add((column, row, "right"))
            if row + 1 < rows and picture[y + step // 2, x] == 0:
                doors.add((column, row, "down"))
    return frozenset(doors)


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES, ids=str)
def test_a_khepera_reaches_every_cell_from_the_start(size):
    given, size = size, {"columns": 4, "rows": 4, "path_mm": 120, "wall_mm": 10} | size
    columns, rows, path, wall = size.values()
    for seed in range(share(4, 12)):
        arena = Arena.maze(**given, seed=seed)
        shape = rows * path + (rows - 1) * wall, (columns + 2) * path + (columns + 1) * wall - 2 * wall
        assert arena.brightness.shape == shape
        parts, (start,), (lamp,) = parts_for_a_robot(arena), arena.starts, arena.lamps
        assert arena.free_for(start.x_mm, start.y_mm, KHEPERA_MM / 2)
        here = parts[int(start.y_mm), int(start.x_mm)]
        assert here > 0
        assert parts[int(lamp.y_mm), int(lamp.x_mm)] == here
        for column, row in np.ndindex(columns, rows):
            x, y = path + column * (path + wall) + path / 2, arena.height_mm - row * (path + wall) - path / 2
            assert parts[int(y), int(x)] == here, (column, row)


def test_one_way_leads_from_each_cell_to_each_other():
    for seed in range(20):
        columns, rows = 3 + seed % 5, 2 + seed % 4
        # All cells are joined, as the test above says; one door fewer than cells leaves no loop.
        doors = open_doors(Arena.maze(columns=columns, rows=rows, seed=seed), columns, rows)
        assert len(doors) == columns * rows - 1


def test_every_maze_is_as_likely():
    # Two by two cells have four spanning trees; of 400 draws each gets 100 with a standard deviation of 9.
    counts = Counter(open_doors(Arena.maze(columns=2, rows=2, seed=seed), 2, 2) for seed in range(400))
    assert len(counts) == 4
    assert all(65 <= count <= 135 for count in counts.values()), counts


def test_sizes_and_places_are_those_of_the_matlab_maze_demo_and_the_frame_is_wall():
    # kiks-behaviour.md, section 1.9: 640 rows x 880 columns, start (55, 60), light (830, 580), y counted from the top.
    arena = Arena.maze(columns=5, rows=5)
    assert (arena.brightness.shape, arena.starts) == ((640, 880), (Pose(55.0, 640.0 - 60.0, 0.0),))
    assert arena.lamps == (Lamp(830.0, 640.0 - 580.0),)
    picture = Arena.maze(columns=3, rows=2).brightness[::-1]
    for frame in (picture[:10], picture[-11:], picture[:, :10], picture[:, -11:]):
        assert (frame == 255).all()
    # Entrance and exit begin right behind it, and there is nothing else left and right of the maze's cells.
    assert picture[60, 10] == picture[190, -12] == 0
    assert picture[125:, :120].all()
    assert picture[:125, -120:].all()


def test_the_same_seed_is_the_same_maze_or_room_on_every_computer():
    arena = Arena.maze(columns=6, rows=5, seed=7)
    assert np.array_equal(arena.brightness, Arena.maze(columns=6, rows=5, seed=7).brightness)
    assert not np.array_equal(arena.brightness, Arena.maze(columns=6, rows=5, seed=8).brightness)
    assert hashlib.sha256(arena.brightness.tobytes()).hexdigest()[:16] == "de27aa544cbcf8d3"
    digests = [hashlib.sha256(repr(draw_room(1100, 900, 4, 3, 1, seed)).encode()).hexdigest() for seed in range(30)]
    assert len(set(digests)) == 30
    assert digests[3][:16] == "5cebfcfc44d13d6c"


def test_bad_numbers_and_rooms_that_cannot_be_drawn_are_named():
    for given, words in (
        ({"columns": 0}, "columns must be a whole number from 1 to 100, but it was 0. It counts the cells side by"),
        ({"rows": 101}, "rows must be a whole number from 1 to 100, but it was 101. It counts the cells one above"),
        ({"wall_mm": 0}, "wall_mm must be a whole number from 1 to 1000, but it was 0. Mazes are drawn in whole"),
        ({"path_mm": 96}, "path_mm must be a whole number from 97 to 10000, but it was 96. A Khepera is 55 mm across"),
        ({"wall_mm": 50}, "path_mm must be a whole number from 177 to 10000, but it was 120."),
        ({"seed": -1}, "seed must be a whole number from 0 to 9223372036854775807, but it was -1. Any small number"),
    ):
        refused(words, partial(Arena.maze, **given))
    refused("at most 64 million cells", partial(Arena.maze, columns=100, rows=100), error=ArenaError)
    refused("at least 100 x 100 mm", partial(Arena.maze, rows=1, path_mm=97), error=ArenaError)
    for wrong, words in (
        ({"walls": 9, "width_mm": 500, "height_mm": 500}, "rooms of 500 x 500 mm were full before they had 9 walls"),
        ({"width_mm": 300}, "width_mm must be a whole number from 500 to 3000"),
        ({"lamps": -1}, "lamps must be a whole number from 0 to 20"),
        ({"seed": -1}, "seed must be a whole number"),
    ):
        refused(words, partial(Arena.room, **wrong))


WITH_ROOM_MM = 27.5 + 20


@pytest.mark.parametrize("seed", range(share(2, 4)))
def test_a_robot_reaches_every_place_of_a_room(seed: int) -> None:
    from scipy.ndimage import label

    narrow = {"width_mm": 700, "height_mm": 600, "walls": 2, "pillars": 2}
    for sizes in ({}, {"walls": 6, "pillars": 0, "lamps": 2}, narrow):
        arena = Arena.room(**sizes, seed=seed)
        wanted = {"walls": 4, "pillars": 3, "lamps": 1} | sizes
        assert [wall.disc_mm is None for wall in arena.walls] == [True] * wanted["walls"] + [False] * wanted["pillars"]
        free = arena.clearance[PAD:-PAD, PAD:-PAD] >= WITH_ROOM_MM
        parts, count = label(free)
        # Corners of the floor that only the edge of a robot fits in are no places.
        assert count == 1 or np.bincount(parts[free])[1:].max() > 0.999 * free.sum()
        assert len(arena.lamps) == wanted["lamps"]
        assert all(free[int(lamp.y_mm), int(lamp.x_mm)] for lamp in arena.lamps)


def test_free_standing_things_are_as_far_apart_as_promised() -> None:
    arena = Arena.room(walls=0, pillars=6, seed=5)
    discs = [(*wall.disc_mm, wall.radius_mm) for wall in arena.walls if wall.disc_mm and wall.radius_mm]
    for number, (x_mm, y_mm, radius_mm) in enumerate(discs):
        for other_x_mm, other_y_mm, other_mm in discs[:number]:
            assert np.hypot(x_mm - other_x_mm, y_mm - other_y_mm) >= GAP_MM + radius_mm + other_mm
