"""Walls and floors with shapes: in memory, in files, drawn by hand and on paper."""

import copy
import pickle
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.model.refusals import refused

from kiks.errors import ArenaError, KiksError
from kiks.export.pictures import Picture
from kiks.export.sheet import DARKEST, FLOOR
from kiks.model import brush
from kiks.model.arena import Arena, Lamp, Pose, Wall, Zone
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


def test_bad_shapes_and_walls_that_would_take_minutes_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
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
        ("box_mm = [[0, 0], [400, 300]]", r"must have floor, but every cell is wall"),
        ("disc_mm = [9, 9]\nradius_mm = 5\n" + "[[wall]]\ndisc_mm = [9, 9]\nradius_mm = 5\n" * 1000, r"wall must "),
    ):
        refused(words, decode_arena, f"size_mm = [400, 300]\n[[wall]]\n{keys}\n".encode(), error=ArenaError)
    many = (Wall(disc_mm=(100, 100), radius_mm=5),) * 1001
    words = r"the number of walls must be .* 1000, but it was 1001"
    refused(words, lambda: replace(BOX, walls=many), error=KiksError)
    refused("walls must be a list of Wall, but it has 3", lambda: replace(BOX, walls=(3,)))  # type: ignore[arg-type]
    monkeypatch.setattr("kiks.model.walls.EXAMINED_MAX", 3 * BOX.ground.size)
    wide = Wall(line_mm=((10, 10), (390, 290)), width_mm=1000, brightness=0)
    replace(BOX, walls=(wide,) * 3)
    words = r"at most \d+ cells together, but these have more"
    refused(words, lambda: replace(BOX, walls=(wide,) * 4), error=ArenaError)


def test_drawing_makes_shapes_that_hide_those_below_and_a_freehand_stroke_a_part_of_the_picture() -> None:
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


def test_an_arena_with_the_same_walls_has_the_same_raster_and_one_with_others_has_its_own() -> None:
    arena = replace(Arena.box(200, 200), walls=(Wall(box_mm=((50, 50), (80, 80))),))
    assert replace(arena, name="other").brightness is arena.brightness
    moved = replace(arena, walls=(Wall(box_mm=((50, 60), (80, 90))),))
    assert (arena.brightness[55, 60], moved.brightness[55, 60]) == (255, 0)


DISC = Zone(disc_mm=(300, 200), radius_mm=60)
STRIPE = Zone(line_mm=((20, 20), (280, 20)), width_mm=12, brightness=128)
SHADES = np.random.default_rng(1).integers(0, 256, (200, 300), np.uint8)


def drawn() -> Arena:
    return replace(Arena.box(300, 200), floor=SHADES, zones=(DISC, STRIPE))


def test_zones_lie_over_the_floor_and_change_no_wall() -> None:
    plain, zoned = Arena.box(300, 200), replace(Arena.box(300, 200), zones=(DISC, STRIPE))
    assert plain.shades is None
    assert zoned.brightness is plain.brightness or np.array_equal(zoned.brightness, plain.brightness)
    rows, columns = np.indices((200, 300)) + 0.5
    disc = np.hypot(columns - 300, rows - 200) <= 60
    stripe = (np.abs(rows - 20) <= 6) & (columns >= 20) & (columns <= 280)
    assert zoned.shades is not None
    assert (zoned.shades[disc] == 0).all()
    assert (zoned.shades[stripe] == 128).all()
    assert (zoned.shades[199:, 0] == 255).all()
    shades = drawn().shades
    assert shades is not None
    assert np.array_equal(shades[~disc & ~(np.abs(rows - 20) <= 6)], SHADES[~disc & ~(np.abs(rows - 20) <= 6)])


def test_a_floor_comes_back_from_files_and_pickles(tmp_path: Path) -> None:
    arena = drawn()
    save_arena(arena, tmp_path / "den.toml")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["den.png", "den.toml", "den_floor.png"]
    coarse = Arena.from_array(np.zeros((60, 70), np.uint8), mm_per_pixel=2.5)
    coarse = replace(coarse, floor=np.kron(SHADES[:60, :70], np.ones((3, 3), np.uint8)))
    for given, found in (
        (arena, Arena.load(tmp_path / "den.toml")),
        (arena, Project.from_bytes(Project(arena).to_bytes()).arena),
        (arena, pickle.loads(pickle.dumps(arena))),
        (arena, copy.deepcopy(arena)),
        (coarse, Project.from_bytes(Project(coarse).to_bytes()).arena),
    ):
        assert given.shades is not None
        assert found.shades is not None
        assert found.zones == given.zones
        assert np.array_equal(found.shades, given.shades)
    assert repr(arena) == "<Arena 'box': 300 x 200 mm, 2 zones, a floor>"


def test_the_picture_of_a_floor_has_row_0_on_top_and_the_scale_of_the_walls(tmp_path: Path) -> None:
    walls, floor = np.zeros((60, 80), np.uint8), np.full((60, 80), 255, np.uint8)
    walls[:, 0] = 200
    floor[0, -1] = 0
    for name, pixels in (("walls.png", walls), ("zones.png", floor)):
        Image.fromarray(pixels).save(tmp_path / name)
    (tmp_path / "a.toml").write_text('picture = "walls.png"\nmm_per_pixel = 2.0\nfloor = "zones.png"\n')
    arena = Arena.load(tmp_path / "a.toml")
    assert arena.floor is not None
    assert [arena.floor[-1, -1], arena.floor[-2, -2], arena.floor[-3, -3], arena.floor[0, 0]] == [0, 0, 255, 255]


def test_a_floor_that_is_wrong_is_one_line(tmp_path: Path) -> None:
    Image.fromarray(SHADES).save(tmp_path / "zones.png")
    for text, words in (
        ('size_mm = [300, 201]\nfloor = "zones.png"', "as large as the arena, 300 x 201 pixels of 1 mm, but it"),
        ('size_mm = [300, 200]\nfloor = "none.png"', "none.png"),
        ('size_mm = [300, 200]\nfloor = "../zones.png"', "floor"),
        ("size_mm = [300, 200]\n[[zone]]\nradius_mm = 3", "a zone must have one of line_mm, box_mm and disc_mm"),
        ("size_mm = [300, 200]\n[[zone]]\ndisc_mm = [900, 0]\nradius_mm = 3", "zone 1 must cover a part of the arena"),
        ("size_mm = [300, 200]\n[[zone]]\nbox_mm = [[0, 0], [9, 9]]\nbrightness = 256", "brightness"),
    ):
        (tmp_path / "a.toml").write_text(text)
        refused(words, Arena.load, tmp_path / "a.toml", error=KiksError)
    for floor in (SHADES[:-1], SHADES.astype(float), "white", SHADES[None]):
        refused("floor must", lambda floor=floor: replace(Arena.box(300, 200), floor=floor), error=KiksError)
    file = b'size_mm = [300, 200]\nfloor = "zones.png"'
    refused("no floor beside it", decode_arena, file, error=KiksError)


def test_a_floor_never_changes() -> None:
    shades = SHADES.copy()
    arena = replace(Arena.box(300, 200), floor=shades)
    shades[:] = 0
    assert arena.floor is not None
    assert np.array_equal(arena.floor, SHADES)
    with pytest.raises(ValueError, match="read-only"):
        arena.floor[0, 0] = 1


def test_zones_are_drawn_darker(tmp_path: Path) -> None:
    picture = Picture.of_arena(replace(Arena.box(300, 200), zones=(DISC,)))
    pixels = np.asarray(picture.image(longest_side=600))
    seen = pixels[30 * 2, 270 * 2], pixels[150 * 2, 50 * 2]
    np.testing.assert_allclose(seen, [np.multiply(FLOOR, DARKEST), FLOOR], atol=2)
    picture.save(tmp_path / "zones.svg")
    assert (tmp_path / "zones.svg").stat().st_size > 1000
