"""Films and photos in space show the same world as pictures from above."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence
from tests import forked
from tests.at_length import at_length

from kiks import Arena, Khepera, ParameterError, Recording, RobotSpec, Simulation
from kiks.export.photo import save_photo
from kiks.export.sheet import wall_grey
from kiks.export.space import CELLS_MAX, walls
from kiks.model.arena import Pose
from kiks.sim.colours import robot_colour

Pixels = NDArray[np.uint8]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
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
    return file


def exported(recording: Path, file: Path, **values: object) -> None:
    """Export in a process of its own, as VTK and Mitsuba would stay in memory with 250 MB."""
    code = f"import kiks; kiks.Recording({str(recording)!r}).export({str(file)!r}, **{values!r})"
    done = forked.run(code=code)
    assert not done.returncode, done.stderr


def filmed(recording: Path, folder: Path, **values: object) -> list[Pixels]:
    file = folder / "film.webp"
    exported(recording, file, **{"size": (320, 240), "fps": 2, "view": "3d", "is_plain": True} | values)
    with Image.open(file) as image:
        return [np.asarray(each.convert("RGB")) for each in ImageSequence.Iterator(image)]


def place_of(picture: Pixels, colour: tuple[int, ...]) -> tuple[float, float]:
    """Return the middle of what has a colour on its top: column and row."""
    rows, columns = np.nonzero(np.abs(picture.astype(int) - colour[:3]).max(axis=-1) < 30)
    assert len(rows) > 20
    return float(columns.mean()), float(rows.mean())


def test_things_are_where_they_are(recording: Path, tmp_path: Path) -> None:
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


def test_the_followed_robot_stays_in_the_middle(recording: Path, tmp_path: Path) -> None:
    for picture in filmed(recording, tmp_path, follow=1):
        column, row = place_of(picture, robot_colour(0))
        assert column == pytest.approx(160, abs=12)
        assert row == pytest.approx(120, abs=25)


@pytest.fixture(scope="module")
def striped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One robot whose front is black shows it to the camera, one its white back."""
    arena = replace(Arena.box(400, 300), starts=(Pose(100, 150, -math.pi / 2), Pose(300, 150, math.pi / 2)))
    sim = Simulation(arena, robot=RobotSpec.load("khepera").with_changes(body__stripe_count=1), robots=2)
    file = tmp_path_factory.mktemp("striped") / "run.mcap"
    with sim.record(file):
        sim.run(0.1)
    return file


def test_stripes_stand_around_robots(striped: Path, tmp_path: Path) -> None:
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
            half = np.array(box.size[:2]) / 2
            corners = (np.array(box.middle[:2]) - half, np.array(box.middle[:2]) + half)
            (left, low), (right, high) = np.rint(np.array(corners) / arena.mm_per_cell).astype(int).tolist()
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


@pytest.fixture(scope="module")
def lit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball on the left; a lamp on the right goes out after a second."""
    file = tmp_path_factory.mktemp("lit") / "run.mcap"
    sim = Simulation(Arena.box(400, 300), seed=3)
    sim.place(1, 200, 150, 0.0)
    sim.add_ball(80, 150)
    sim.add_lamp(330, 150, 2.0)
    with sim.record(file):
        sim.run(1.0)
        sim.lamps[0, 3] = 0
        sim.run(1.0)
    return file


def taken(recording: Path, folder: Path, **values: object) -> NDArray[np.float64]:
    exported(recording, folder / "photo.png", kind="photo", size=(160, 120), samples=16, **values)
    with Image.open(folder / "photo.png") as image:
        return np.asarray(image.convert("RGB")).astype(float)


def test_lamps_light_the_floor(lit: Path, tmp_path: Path) -> None:
    bright, dark = taken(lit, tmp_path, time_s=0.5), taken(lit, tmp_path)
    assert bright.shape == (120, 160, 3)
    right, left = np.s_[50:80, 110:135], np.s_[50:80, 5:25]
    assert bright[right].mean() > dark[right].mean() + 15
    assert abs(bright[left].mean() - dark[left].mean()) < bright[right].mean() - dark[right].mean()
    # The ball is orange, the robot in the middle green.
    ball, robot = dark[50:75, 25:45], dark[55:65, 74:86]
    assert (ball[..., 0] - ball[..., 2]).max() > 80
    assert (robot[..., 1] - robot[..., 0]).max() > 15


@at_length
def test_photos_have_stripes_and_names_as_films(striped: Path, tmp_path: Path) -> None:
    black, white = (taken(striped, tmp_path, follow=number) for number in (1, 2))
    assert black[86:89, 75:85].max() < 40, "the front of one, towards the camera"
    assert white[86:89, 75:85].min() > 120, "the back of the other"
    name = filmed(striped, tmp_path, size=(160, 120), follow=1)[0].astype(float)[50:64, 66:94, 0]
    seen = black[50:64, 66:94, 0]
    alike, mirrored = (np.corrcoef(each.ravel(), name.ravel())[0, 1] for each in (seen, seen[:, ::-1]))
    assert alike > max(mirrored + 0.2, 0.7)


def test_a_photo_that_cannot_be_taken_says_so(recording: Path, tmp_path: Path) -> None:
    for values, words in (
        ({"time_s": 9}, "time_s must be from 0 to 2"),
        ({"samples": 0}, "samples must be a whole number from 1 to 4096"),
    ):
        with pytest.raises(ParameterError, match=words):
            save_photo(Recording(recording), tmp_path / "photo.png", **values)
    assert not list(tmp_path.iterdir())


def test_the_error_for_a_missing_library_names_its_extra(recording: Path, tmp_path: Path) -> None:
    for library, extra, name, options in (
        ("av", "film", "film.mp4", {"view": "3d"}),
        ("vtk", "render", "film.mp4", {"view": "3d"}),
        ("mitsuba", "render", "photo.png", {"kind": "photo"}),
    ):
        words = rf"This needs {library}, but it cannot be imported .*\[{extra}\]"
        with pytest.MonkeyPatch.context() as patch:
            patch.setitem(sys.modules, library, None)
            with pytest.raises(ParameterError, match=words):
                Recording(recording).export(tmp_path / name, **options)
    assert not list(tmp_path.iterdir())
