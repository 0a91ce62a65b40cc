"""Films in space show the same world as those from above."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence

from kiks import Arena, Khepera, ParameterError, Recording, RobotSpec, Simulation
from kiks.export.film import save_film
from kiks.export.looks import robot_colour
from kiks.export.sheet import wall_grey
from kiks.export.space import CELLS_MAX, walls
from kiks.model.arena import Pose

Pixels = NDArray[np.uint8]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """One robot drives to the right, one stands above it; a ball and a cylinder stand on the right."""
    file = tmp_path_factory.mktemp("recording") / "run.mcap"
    sim = Simulation(Arena.box(600, 400), robots=2, seed=3)
    sim.place(1, 100, 100, 0.0)
    sim.place(2, 100, 300, 0.0)
    sim.add_ball(500, 100)
    sim.add_cylinder(500, 300)
    robot = Khepera(sim.port(1))
    with sim.record(file):
        robot.set_speed(12, 12)
        sim.run(2.0)
    return Recording(file)


def filmed(recording: Recording, folder: Path, **values: object) -> list[Pixels]:
    file = folder / "film.webp"
    save_film(recording, file, size=(320, 240), fps=2, view="3d", is_plain=True, **values)
    with Image.open(file) as image:
        return [np.asarray(each.convert("RGB")) for each in ImageSequence.Iterator(image)]


def place_of(picture: Pixels, colour: tuple[int, ...]) -> tuple[float, float]:
    """Return the middle of what has a colour on its top: column and row."""
    rows, columns = np.nonzero(np.abs(picture.astype(int) - colour[:3]).max(axis=-1) < 30)
    assert len(rows) > 20
    return float(columns.mean()), float(rows.mean())


def test_things_are_where_they_are(recording: Recording, tmp_path: Path) -> None:
    first, *_, last = filmed(recording, tmp_path)
    driving, standing = robot_colour(0), robot_colour(1)
    (column, row), (_, row_above) = place_of(first, driving), place_of(first, standing)
    assert row_above < row - 20  # what is up in the arena is far away
    assert column < 130
    # 192 mm of 600, on a picture of which the arena takes nearly all.
    assert place_of(last, driving)[0] - column == pytest.approx(192 / 600 * 320 * 0.92, rel=0.12)
    assert place_of(last, standing) == pytest.approx(place_of(first, standing), abs=1.5)
    right = first[:, 220:]
    reddish = (right[..., 0].astype(int) - right[..., 2] > 60) & (right[..., 0] > 120)
    assert np.count_nonzero(reddish[:120]) > 40  # the cylinder
    assert np.count_nonzero(reddish[120:]) > 100  # the ball


def test_the_followed_robot_stays_in_the_middle(recording: Recording, tmp_path: Path) -> None:
    for picture in filmed(recording, tmp_path, follow=1):
        column, row = place_of(picture, robot_colour(0))
        assert column == pytest.approx(160, abs=12)
        assert row == pytest.approx(120, abs=25)


@pytest.fixture(scope="module")
def striped(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """One robot whose front is black shows it to the camera, one its white back."""
    arena = replace(Arena.box(400, 300), starts=(Pose(100, 150, -math.pi / 2), Pose(300, 150, math.pi / 2)))
    sim = Simulation(arena, robot=RobotSpec.load("khepera").with_changes(body__stripe_count=1), robots=2)
    file = tmp_path_factory.mktemp("striped") / "run.mcap"
    with sim.record(file):
        sim.run(0.1)
    return Recording(file)


def test_stripes_stand_around_robots(striped: Recording, tmp_path: Path) -> None:
    for number, is_seen in ((1, lambda side: side.max() < 20), (2, lambda side: side.min() > 120)):
        side = filmed(striped, tmp_path, follow=number)[0][172:178, 150:170]
        assert is_seen(side), number


@pytest.mark.parametrize("name", ["maze", "track", "office", "default"])
def test_boxes_of_walls_cover_what_is_wall(name: str) -> None:
    arena = Arena.load(Path(__file__).parents[2] / "examples" / "arenas" / f"{name}.toml")
    cells = np.zeros_like(arena.brightness)
    step = -(-max(cells.shape) // CELLS_MAX)
    for (grey, *_), boxes in walls(arena).items():
        for box in boxes:
            ends = [
                (middle - size / 2, middle + size / 2) for middle, size in zip(box.middle[:2], box.size, strict=False)
            ]
            (left, right), (low, high) = (tuple(round(edge / arena.mm_per_cell) for edge in pair) for pair in ends)
            assert not cells[low:high, left:right].any()  # no box lies in another one
            cells[low:high, left:right] = grey
    assert (cells[arena.brightness > 0] >= wall_grey(arena.brightness[arena.brightness > 0].astype(int))).all()
    # A box begins at most a coarse cell before its wall.
    grown = np.zeros_like(cells)
    greys = np.where(arena.brightness > 0, wall_grey(arena.brightness.astype(int)), 0)
    for down in range(-step, step + 1):
        for aside in range(-step, step + 1):
            grown = np.maximum(grown, np.roll(greys, (down, aside), (0, 1)))
    assert (cells <= grown).all()


@pytest.mark.parametrize(("library", "extra"), [("av", "film"), ("vtk", "render")])
def test_the_error_for_a_missing_library_names_its_extra(
    library: str, extra: str, recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(ParameterError, match=rf"This needs {library}, but it cannot be imported .*\[{extra}\]"):
        save_film(recording, tmp_path / "film.mp4", view="3d")
