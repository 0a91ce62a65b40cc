"""Walls with shapes: in files, on arenas, and drawn by hand."""

from __future__ import annotations

import copy
import pickle
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.model.refusals import refused

from kiks.errors import ArenaError, KiksError
from kiks.model import brush
from kiks.model.arena import Arena, Lamp, Pose, Wall
from kiks.model.arena_file import decode_arena, save_arena
from kiks.model.project import Project

BOX = Arena.box(400, 300)
FILE = """
size_mm = [400, 300]

[[wall]]
line_mm = [[200, 10], [200, 200], [300, 200]]
brightness = "wood"

[[wall]]
box_mm = [[50, 50], [100, 80]]

[[wall]]
disc_mm = [320, 80]
radius_mm = 25

[[wall]]                 # a door
line_mm = [[200, 60], [200, 140]]
width_mm = 12
brightness = 0
"""


def at(arena: Arena, x_mm: float, y_mm: float) -> int:
    return int(arena.brightness[int(y_mm / arena.mm_per_cell), int(x_mm / arena.mm_per_cell)])


def test_file_draws_lines_boxes_and_discs_over_the_box_the_later_ones_on_top() -> None:
    arena = decode_arena(FILE.encode())
    for brightness, places in (
        (190, ((196, 30), (200, 30), (250, 204))),
        (255, ((51, 51), (99, 79), (340, 80))),
        (0, ((205, 30), (206, 30), (101, 79), (346, 80), (200, 100))),  # the last is the door
    ):
        assert {at(arena, *place) for place in places} == {brightness}
    assert np.array_equal(arena.ground, BOX.brightness)
    assert len(arena.walls) == 4


def test_files_and_copies_keep_shapes_and_what_is_below_them(tmp_path: Path) -> None:
    arena = replace(decode_arena(FILE.encode(), "shapes"), lamps=(Lamp(50, 50),), starts=(Pose(100, 200, 0.0),))
    save_arena(arena, tmp_path / "shapes.toml")
    data = Project(arena).to_bytes()
    box = {"size_mm": [400, 300], "wall_mm": 10, "rounded_mm": 0, "brightness": 255}
    assert tomllib.loads(data.decode())["walls"] == box
    assert b"line_mm = [[200.0, 60.0], [200.0, 140.0]]\nwidth_mm = 12.0\nbrightness = 0\n" in data
    for again in (
        Arena.load(tmp_path / "shapes.toml"),
        Project.from_bytes(data).arena,
        pickle.loads(pickle.dumps(arena)),
        copy.deepcopy(arena),
        replace(arena, name="other"),
    ):
        assert again.walls == arena.walls
        assert np.array_equal(again.brightness, arena.brightness)
        assert np.array_equal(again.ground, arena.ground)
        assert again.lamps == arena.lamps


def test_a_bad_shape_is_refused_in_one_line() -> None:
    for keys, words in (
        ("box_mm = [[50, 50], [50, 80]]", r"wall 1 must cover a part .* covers no cell .* 400 x 300 mm"),
        ("disc_mm = [900, 80]\nradius_mm = 5", r"wall 1 must cover a part of the arena"),
        ("disc_mm = [100, 80]", r"wall 1: radius_mm must come with disc_mm"),
        ("disc_mm = [100, 80]\nradius_mm = 0", r"wall 1: radius_mm must be greater than 0, but it was 0"),
        ("line_mm = [[nan, 5], [5, 5]]", r"wall 1: line_mm\S* must be .*, but it was nan"),
        ("line_mm = [[1, 5]]", r"wall 1: line_mm must be a list of 2 to 100 points.*Give line_mm = \[\[x, y\]"),
        ("line_mm = [1, 5]", r"wall 1: line_mm"),
        ("line_mm = [[1, 5], [5, 5]]\nwidth_mm = -1", r"wall 1: width_mm must be greater than 0"),
        ("box_mm = [[1, 5], [5, 5]]\nwidth_mm = 1", r"wall 1: width_mm must come with line_mm"),
        ("brightness = 3", r"wall 1: a wall must have one of line_mm, box_mm and disc_mm, but it has none"),
        ("box_mm = [[1, 5], [5, 50]]\ndisc_mm = [1, 1]", r"it has box_mm and disc_mm"),
        ("box_mm = [[1, 5], [5, 50]]\nbrightness = 256", r"wall 1: brightness must be .*, but it was 256"),
        ("boxmm = 3", r"wall 1 must have known keys only, .* Did you mean 'box_mm'\?"),
        ("box_mm = [[0, 0], [400, 300]]", r"must have floor, but every cell is wall"),
        ("disc_mm = [9, 9]\nradius_mm = 5\n" + "[[wall]]\ndisc_mm = [9, 9]\nradius_mm = 5\n" * 1000, r"wall must "),
    ):
        refused(words, decode_arena, f"size_mm = [400, 300]\n[[wall]]\n{keys}\n".encode(), error=ArenaError)
    many = (Wall(disc_mm=(100, 100), radius_mm=5),) * 1001
    words = r"the number of walls must be .* 1000, but it was 1001"
    refused(words, lambda: replace(BOX, walls=many), error=KiksError)
    refused("walls must be a list of Wall, but it has 3", lambda: replace(BOX, walls=(3,)))  # type: ignore[arg-type]


def test_drawing_makes_shapes_and_hides_those_below() -> None:
    arena = brush.rectangle(BOX, 50, 50, 100, 80)
    arena = brush.line(arena, [(200, 20), (200, 200)], width_mm=6, brightness="wood")
    arena = brush.line(arena, [(300, 100)], width_mm=20)
    arena = brush.disc(arena, (300, 200), 30, 7)
    assert arena.walls == (
        Wall(box_mm=((50, 50), (100, 80))),
        Wall(line_mm=((200, 20), (200, 200)), width_mm=6, brightness=190),
        Wall(disc_mm=(300, 100), radius_mm=10),
        Wall(disc_mm=(300, 200), radius_mm=30, brightness=7),
    )
    assert brush.rectangle(arena, 55, 55, 60, 60) is arena
    erased = brush.rectangle(arena, 40, 40, 110, 90, 0)
    assert erased.walls == arena.walls[1:]
    door = brush.rectangle(arena, 190, 40, 210, 90, 0)
    assert door.walls == (*arena.walls, Wall(box_mm=((190, 40), (210, 90)), brightness=0))


def test_a_freehand_stroke_becomes_a_part_of_the_picture_with_the_walls_below_it() -> None:
    arena = brush.rectangle(BOX, 50, 50, 100, 80)
    arena = brush.line(arena, [(200, 20), (200, 200)], width_mm=6, brightness=9)
    arena = brush.disc(arena, (300, 200), 30, 7)
    stroke = [(150, 100), (180, 120), (230, 100)]
    drawn = brush.line(arena, stroke, width_mm=5, brightness=33)
    assert drawn.walls == arena.walls[2:]
    assert np.array_equal(
        drawn.brightness,
        replace(arena, walls=(*arena.walls, Wall(line_mm=stroke, width_mm=5, brightness=33))).brightness,
    )
    beside = brush.line(arena, [(20, 200), (30, 220), (40, 200)], width_mm=5)
    assert beside.walls == arena.walls
    assert np.count_nonzero(beside.ground != arena.ground) > 50


def test_walls_that_would_take_minutes_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kiks.model.walls.EXAMINED_MAX", 3 * BOX.ground.size)
    wide = Wall(line_mm=((10, 10), (390, 290)), width_mm=1000, brightness=0)
    replace(BOX, walls=(wide,) * 3)
    words = r"at most \d+ cells together, but these have more"
    refused(words, lambda: replace(BOX, walls=(wide,) * 4), error=ArenaError)


def test_an_arena_with_the_same_walls_has_the_same_raster_and_one_with_others_has_its_own() -> None:
    arena = replace(Arena.box(200, 200), walls=(Wall(box_mm=((50, 50), (80, 80))),))
    assert replace(arena, name="other").brightness is arena.brightness
    moved = replace(arena, walls=(Wall(box_mm=((50, 60), (80, 90))),))
    assert (arena.brightness[55, 60], moved.brightness[55, 60]) == (255, 0)
