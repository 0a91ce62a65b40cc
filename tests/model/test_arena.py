"""Laws of the arena: its raster, its distance field and the places in it."""

import copy
import math
import pickle
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.model.refusals import refused

from kiks.errors import ArenaError, ParameterError
from kiks.model.arena import PAD, Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.materials import REFLECTANCES
from kiks.model.raster import LEAPS_PER_CELL, ROOM_CELLS

ROBOT_MM = 27.5


SHARES = (0.0, 0.0005, 0.01, 0.3, 0.98)
"""Shares of cells that are wall."""


def random_picture(seed: int, shape: tuple[int, int] = (104, 101), share: float = 0.01) -> np.ndarray:
    rng = np.random.default_rng(seed)
    walls = rng.random(shape) < share
    return np.where(walls, rng.integers(1, 256, shape), 0).astype(np.uint8)


def from_zeros(shape: tuple[int, int], mm_per_pixel: float) -> Arena:
    return Arena.from_array(np.zeros(shape, np.uint8), mm_per_pixel=mm_per_pixel)


def test_row_zero_is_on_top_integers_of_any_type_are_taken_and_coarse_pixels_cut_without_moving_a_wall():
    picture = random_picture(1) % 128
    for dtype in (np.uint8, np.int8, np.uint16, np.int64):
        arena = Arena.from_array(picture.astype(dtype))
        assert np.array_equal(arena.brightness, picture[::-1])
        assert (arena.width_mm, arena.height_mm, arena.mm_per_cell) == (101, 104, 1)
    assert np.array_equal(Arena.from_array(picture > 0).brightness, (picture[::-1] > 0) * 255)
    picture = random_picture(4, (220, 230))
    for mm_per_pixel, cells in ((0.5, 1), (1, 1), (1.01, 2), (2, 2), (2.5, 3), (7, 7)):
        arena = Arena.from_array(picture, mm_per_pixel=mm_per_pixel)
        assert arena.mm_per_cell <= 1
        assert arena.mm_per_cell * cells == pytest.approx(mm_per_pixel)
        assert arena.width_mm == pytest.approx(230 * mm_per_pixel)
        assert arena.height_mm == pytest.approx(220 * mm_per_pixel)
        for row, column in np.ndindex(cells, cells):
            assert np.array_equal(arena.brightness[row::cells, column::cells], picture[::-1])


def test_clearance_to_a_straight_wall_does_not_depend_on_the_cells_and_the_world_outside_is_wall():
    picture = np.zeros((60, 60), np.uint8)
    picture[:, :20] = 255
    arena = Arena.from_array(picture, mm_per_pixel=2.5)
    # The wall ends at x = 50 mm; the opposite border begins at 150 mm.
    for x_mm in (51.0, 60.0, 83.3):
        assert arena.clearance_at_mm(x_mm, 75) == pytest.approx(x_mm - 50, abs=1e-4)
    arena = Arena.from_array(np.zeros((100, 120), np.uint8))
    assert arena.surface.shape == arena.clearance.shape == (100 + 2 * PAD, 120 + 2 * PAD)
    assert (arena.surface == 255).sum() == (100 + 2 * PAD) * (120 + 2 * PAD) - 100 * 120
    assert arena.clearance_at_mm(10, 50) == 10
    for place in ((-1, 50), (121, 50), (60, -1e6), (60, 1e6)):
        assert arena.clearance_at_mm(*place) < 0
        assert not arena.free_for(*place, ROBOT_MM)


@settings(max_examples=share(10, 20))
@given(st.integers(0, 2**32), st.tuples(st.integers(100, 140), st.integers(100, 140)), st.sampled_from(SHARES))
def test_clearance_leap_and_room_of_cells_are_those_of_geometry(seed, shape, share):
    """Clearance is the exact distance to the nearest wall cell.

    A leap is the gap between the squares of the two, a room the least clearance of a block.
    """
    arena = Arena.from_array(random_picture(seed, shape, share), mm_per_pixel=1.0)
    rows, columns = np.nonzero(arena.surface)
    rng = np.random.default_rng(seed)
    for _ in range(50):
        row, column = rng.integers(arena.clearance.shape[0]), rng.integers(arena.clearance.shape[1])
        expected = math.sqrt(((rows - row) ** 2 + (columns - column) ** 2).min())
        assert arena.clearance[row, column] == np.float32(expected)
        up, right = (np.maximum(abs(gap) - 1, 0) for gap in (rows - row, columns - column))
        leap = math.floor(LEAPS_PER_CELL * math.sqrt((up**2 + right**2).min()))
        assert arena.leaps[row, column] == (-int(arena.surface[row, column]) or leap)
    for block, room in np.ndenumerate(arena.rooms):
        rows_of, columns_of = (slice(ROOM_CELLS * index, ROOM_CELLS * (index + 1)) for index in block)
        assert room == arena.clearance[rows_of, columns_of].min()
    assert arena.rooms.shape == tuple(-(-side // ROOM_CELLS) for side in arena.clearance.shape)


def test_arrays_are_read_only_shared_and_computed_once_and_copies_are_equal():
    picture = random_picture(8)
    arena = replace(Arena(picture, 1.0, "mine"), lamps=(Lamp(50, 60, 2.0, False),))
    picture[:] = 255
    assert not arena.brightness.all()
    for array in (arena.brightness, arena.surface, arena.clearance):
        assert array.flags.writeable is False
    assert arena.clearance is arena.clearance
    assert arena.surface is arena.surface
    assert replace(arena, name="other").brightness is arena.brightness
    assert arena == arena
    assert arena != Arena.default()
    for other in (pickle.loads(pickle.dumps(arena)), copy.deepcopy(arena)):
        assert np.array_equal(other.brightness, arena.brightness)
        assert (other.name, other.starts, other.lamps) == (arena.name, arena.starts, arena.lamps)
        assert other.brightness.flags.writeable is False


def test_the_default_arena_is_the_classic_one():
    arena = Arena.default()
    assert (arena.width_mm, arena.height_mm) == (500, 650)
    assert arena.starts == (Pose(250, 325, math.pi / 2),)
    assert set(np.unique(arena.brightness)) == {0, 255}
    assert arena.clearance_at_mm(249.5, 325) == 239.5
    for picture in (arena.brightness[::-1], arena.brightness[:, ::-1]):
        assert np.array_equal(picture, arena.brightness)
    # The floor of a corner is a quarter disc of radius 100 mm.
    corner = arena.brightness[10:110, 10:110]
    assert (corner == 0).sum() == pytest.approx(math.pi * 100**2 / 4, rel=0.005)


def test_a_box_keeps_its_rules_and_has_its_walls_of_a_brightness_or_a_material():
    for change, words in (
        ({"width_mm": 300.5}, "width_mm must be a whole number, but it was 300.5"),
        ({"height_mm": "1"}, "height_mm must be a whole number, but it was '1'"),
        ({"wall_mm": 100}, "wall_mm must be a whole number from 0 to 99, but it was 100"),
        ({"rounded_mm": 91}, "rounded_mm must be a whole number from 0 to 90, but it was 91"),
        ({"brightness": 0}, "brightness must be at least 1, but it was 0. 1 is black, 255 white"),
        ({"brightness": True}, "brightness must be a whole number, but it was True"),
        ({"brightness": "woods"}, r"one of \['white', 'wood', .*\], but it was 'woods'. Did you mean 'wood'"),
    ):
        refused(words, partial(Arena.box, **({"width_mm": 300, "height_mm": 200} | change)))
    arena = Arena.box(300, 200, wall_mm=20, brightness=7)
    assert (arena.brightness[20:-20, 20:-20] == 0).all()
    assert (arena.brightness == 7).sum() == 300 * 200 - 260 * 160
    assert not Arena.box(300, 200, wall_mm=0).brightness.any()
    assert Arena.box(300, 200, rounded_mm=90).brightness.any(axis=1).all()
    # A material's is the brightness c whose reflectance is 0.02 + 0.98 c/255, to half a step of c.
    for name, reflectance in REFLECTANCES.items():
        brightness = int(Arena.box(300, 200, brightness=name).brightness.max())
        assert 0.02 + 0.98 * brightness / 255 == pytest.approx(reflectance, abs=0.004)
    assert Arena.box(300, 200, brightness="black").brightness.max() == 1


def test_a_robot_starts_at_the_first_start_pose_or_in_the_middle_of_the_widest_place():
    starts = (Pose(100, 100, 1.0), Pose(200, 200, 2.0))
    assert replace(Arena.box(400, 400), starts=starts).find_start(ROBOT_MM) == starts[0]
    arena = Arena.box(401, 301)
    assert arena.find_start(ROBOT_MM) == Pose(200.5, 150.5, math.pi / 2)
    raster = arena.brightness.copy()
    raster[:, 130] = 255
    pose = replace(arena, ground=raster).find_start(ROBOT_MM)
    assert (pose.x_mm, pose.y_mm) == (pytest.approx(261, abs=10), 150.5)
    narrow = np.zeros((200, 200), np.uint8)
    narrow[:, ::40] = 255
    words = r"'array' must have room for a robot 55 mm across, but its widest place has room for \d+"
    refused(words, Arena.from_array(narrow).find_start, ROBOT_MM, error=ArenaError)
    arena = replace(arena, starts=(Pose(20, 50, 0),))
    words = r"but start 1 at \(20, 50\) mm has room for 20.0 mm only. Move the start"
    refused(words, arena.find_start, ROBOT_MM, error=ArenaError)


def test_from_array_and_the_constructor_keep_their_rules():
    square = np.zeros((200, 200), np.uint8)
    for brightness in (np.zeros((200, 200)), np.zeros(200, np.uint8), square[..., None], [[0, 1]], "maze.png", None):
        refused(r"brightness must be an array .* but it was .* Convert it", Arena.from_array, brightness)
    picture = np.zeros((200, 200), int)
    picture[3, 3] = 256
    refused(r"must lie within 0..255, but it spans 0..256. Scale it", Arena.from_array, picture)
    refused(r"spans -256..0", Arena.from_array, -picture)
    for scale in (0, -1, 0.05, 101, math.nan, math.inf, "1", None, True, 10**400):
        refused(r"mm_per_pixel must be (a number )?from 0\.1 to 100, but it was", from_zeros, (200, 200), scale)
    for words, call, *rest in (
        (r"must be a uint8 array \[row, column\], but it was an array of int64", Arena, picture, 1.0, "x"),
        (r"mm_per_cell must be at most 1, but it was 2", Arena, square, 2.0, "x"),
        ("x_mm must be a finite number", Arena.default().clearance_at_mm, math.nan, 0),
        ("radius_mm must be positive, but it was 0", Arena.default().free_for, 100, 100, 0),
    ):
        refused(words, call, *rest)
    for shape, scale, words in (
        ((99, 100), 1, r"at least 100 x 100 mm, but this one has 100 x 99 pixels of 1 mm. Draw it larger"),
        ((0, 100), 1, r"at least 100 x 100 mm, but this one has 100 x 0 pixels"),
        ((100, 199), 0.5, r"at least 100 x 100 mm"),
        ((1001, 1000), 8, r"at most 64 million cells, .* which makes 64.1 million. Draw a smaller one"),
    ):
        refused(words, from_zeros, shape, scale, error=ArenaError)
    full = np.ones((200, 200), bool)
    refused(r"must have floor, but every cell is wall. Black", Arena.from_array, full, error=ArenaError)


def test_entries_stand_where_they_can_and_become_places():
    box = Arena.box(200, 300)
    for name, places, error, words in (
        (
            "starts",
            [(50, 50, 0), (5, 50, 0)],
            ArenaError,
            r"start 2 must stand on floor, but at \(5, 50\) mm is a wall",
        ),
        ("starts", [(50, 300, 0)], ArenaError, r"start 1 must lie inside the arena, .*\(0, 0\) is its lower left"),
        ("lamps", [(-1, 50)], ArenaError, r"lamp 1 must lie inside the arena"),
        (
            "lamps",
            [(50, 50, 0.0)],
            ParameterError,
            r"lamp 1: power_w must be greater than 0, but it was 0.0. .* Switch",
        ),
        ("balls", [(1, 1)], ArenaError, r"ball 1 must stand on floor"),
        ("cylinders", [(50, 50), (1, 1)], ArenaError, r"cylinder 2 must stand on floor"),
        ("starts", [(math.nan, 50, 0)], ParameterError, r"start 1: x_mm must be .* but it was nan"),
        ("balls", [("a", 50)], ParameterError, r"ball 1: x_mm must be a number, but it was 'a'"),
    ):
        refused(words, partial(replace, box, **{name: places}), error=error)
    arena = replace(Arena.box(200, 300), lamps=[(5, 5)], balls=[(50, 60)], cylinders=[(50, 70)], starts=[(50, 80, 1)])
    assert (arena.lamps, arena.balls) == ((Lamp(5.0, 5.0, 1.0, True),), (Ball(50.0, 60.0),))
    assert (arena.cylinders, arena.starts) == ((Cylinder(50.0, 70.0),), (Pose(50.0, 80.0, 1.0),))
