"""`kiks arena`: files made, files described, files left alone."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.cli.test_cli import kiks

from kiks.errors import KiksError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose, Wall
from kiks.model.arena_file import save_arena

MAZE = Path(__file__).parents[2] / "examples" / "arenas" / "maze.toml"


def kiks_arena(*arguments: object) -> str:
    return kiks("arena", *arguments).output


def test_maze_writes_the_arena_that_python_makes(tmp_path):
    out = tmp_path / "mine.toml"
    said = kiks_arena("maze", out, "--columns", 3, "--rows", 2, "--path-mm", 130, "--wall-mm", 20, "--seed", 5)
    assert "mine.toml" in said
    assert "mine.png" in said
    arena, expected = Arena.load(out), Arena.maze(columns=3, rows=2, path_mm=130, wall_mm=20, seed=5)
    assert np.array_equal(arena.brightness, expected.brightness)
    assert (arena.name, arena.starts, arena.lamps) == ("mine", expected.starts, expected.lamps)


@pytest.mark.parametrize(("given", "expected"), [("wood", 190), ("40", 40)])
def test_new_writes_a_box_to_draw_in(tmp_path, given, expected):
    out = tmp_path / "room.toml"
    size = ("--width-mm", 300, "--height-mm", 200, "--wall-mm", 5, "--rounded-mm", 30)
    kiks_arena("new", out, *size, "--brightness", given)
    box = Arena.box(300, 200, wall_mm=5, rounded_mm=30, brightness=expected)
    assert np.array_equal(Arena.load(out).brightness, box.brightness)
    # What somebody draws into the picture is in the arena.
    with Image.open(tmp_path / "room.png") as image:
        picture = np.array(image)
    picture[50, 100] = 77
    Image.fromarray(picture).save(tmp_path / "room.png")
    assert Arena.load(out).brightness[200 - 1 - 50, 100] == 77


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("maze", "m.toml", "--path-mm", 80), "path_mm must be a whole number from 97 to 10000, but it was 80."),
        (("new", "n.toml", "--width-mm", 50, "--height-mm", 200), "width_mm must be at least 100"),
        (("new", "n.toml", "--width-mm", 200, "--height-mm", 200, "--brightness", "wod"), "Did you mean 'wood'?"),
        (("new", "n.toml", "--width-mm", 200, "--height-mm", 200, "--brightness=-3"), "but it was -3. 1 is black"),
        (("new", "n.toml", "--width-mm", 200, "--height-mm", 200, "--brightness=--3"), "but it was '--3'."),
    ],
)
def test_errors_are_clear_and_nothing_is_written(tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(KiksError) as error:
        kiks_arena(*arguments)
    assert words in str(error.value)
    assert not list(tmp_path.iterdir())


def test_info_of_an_example():
    assert kiks_arena("info", MAZE).splitlines() == [
        "Maze: 920 x 660 mm, cells of 1 mm, 10 % of it wall",
        "Widest place: room for 149.0 mm across",
        "Start 1: (70, 590) mm, heading 0 degrees, room for 119.0 mm across: a Khepera (55 mm) fits",
        "Lamp 1: (850, 70) mm, 1 W, on",
    ]


def test_info_tells_all_that_stands_in_it(tmp_path):
    parts = {"starts": (Pose(75, 50, 0), Pose(20, 50, 1.5)), "lamps": (Lamp(10, 20, 2.5, False),)}
    parts |= {"balls": (Ball(30, 40),), "cylinders": (Cylinder(50, 60),)}
    walls = (Wall(box_mm=((100, 90), (120, 95))),)
    arena = Arena(Arena.box(300, 201, wall_mm=0).brightness, 0.5, "room", walls=walls, **parts)
    save_arena(arena, tmp_path / "room.toml")
    room, widest, first, second, *things = kiks_arena("info", tmp_path / "room.toml").splitlines()
    assert room == "room: 150 x 100.5 mm, cells of 0.5 mm, 1 % of it wall"
    assert widest.startswith("Widest place: room for ")
    assert first.endswith("a Khepera (55 mm) fits")
    assert second.startswith("Start 2: (20, 50) mm")
    assert second.endswith("room for 40.0 mm across: a Khepera (55 mm) does not fit")
    assert things == [
        "Lamp 1: (10, 20) mm, 2.5 W, off",
        "Ball 1: (30, 40) mm, radius 32 mm, brightness 255",
        "Cylinder 1: (50, 60) mm, radius 16 mm, brightness 190",
        "Wall 1: box_mm = [[100.0, 90.0], [120.0, 95.0]], brightness = 255",
    ]


@pytest.mark.parametrize(
    ("wall_mm", "words"),
    [(10, "Start: none; a Khepera (55 mm) starts at (100.5, 60.5) mm"), (40, "a Khepera (55 mm) fits nowhere")],
)
def test_info_without_a_start_pose(tmp_path, wall_mm, words):
    save_arena(Arena.box(201, 121, wall_mm=wall_mm), tmp_path / "box.toml")
    assert words in kiks_arena("info", tmp_path / "box.toml")
