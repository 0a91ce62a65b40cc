"""The floor of an arena: its picture and its zones, in memory, in files and on paper."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.model.refusals import refused

from kiks.errors import KiksError
from kiks.export.pictures import Picture
from kiks.export.sheet import DARKEST, FLOOR
from kiks.model.arena import Arena, Zone
from kiks.model.arena_file import decode_arena, save_arena
from kiks.model.project import Project

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
