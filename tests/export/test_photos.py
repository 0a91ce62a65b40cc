"""Photos of recordings have the light of their world."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from tests.at_length import at_length

from kiks import Arena, ParameterError, Recording, RobotSpec, Simulation
from kiks.export.film import save_film
from kiks.export.photo import save_photo
from kiks.model.arena import Pose

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A ball on the left; a lamp on the right goes out after a second."""
    file = tmp_path_factory.mktemp("recording") / "run.mcap"
    sim = Simulation(Arena.box(400, 300), seed=3)
    sim.place(1, 200, 150, 0.0)
    sim.add_ball(80, 150)
    sim.add_lamp(330, 150, 2.0)
    with sim.record(file):
        sim.run(1.0)
        sim.lamps[0, 3] = 0
        sim.run(1.0)
    return Recording(file)


def taken(recording: Recording, folder: Path, **values: object) -> NDArray[np.float64]:
    save_photo(recording, folder / "photo.png", size=(160, 120), samples=16, **values)
    with Image.open(folder / "photo.png") as image:
        return np.asarray(image.convert("RGB")).astype(float)


def test_lamps_light_the_floor(recording: Recording, tmp_path: Path) -> None:
    lit, dark = taken(recording, tmp_path, time_s=0.5), taken(recording, tmp_path)
    assert lit.shape == (120, 160, 3)
    right, left = np.s_[50:80, 110:135], np.s_[50:80, 5:25]
    assert lit[right].mean() > dark[right].mean() + 15
    assert abs(lit[left].mean() - dark[left].mean()) < lit[right].mean() - dark[right].mean()
    # The ball is orange, the robot in the middle green.
    ball, robot = dark[50:75, 25:45], dark[55:65, 74:86]
    assert (ball[..., 0] - ball[..., 2]).max() > 80
    assert (robot[..., 1] - robot[..., 0]).max() > 15


@at_length
def test_robots_have_stripes_and_names_as_in_films(tmp_path: Path) -> None:
    arena = replace(Arena.box(400, 300), starts=(Pose(100, 150, -math.pi / 2), Pose(300, 150, math.pi / 2)))
    sim = Simulation(arena, robot=RobotSpec.load("khepera").with_changes(body__stripe_count=1), robots=2)
    with sim.record(tmp_path / "run.mcap"):
        sim.run(0.1)
    recording = Recording(tmp_path / "run.mcap")
    black, white = (taken(recording, tmp_path, follow=number) for number in (1, 2))
    assert black[86:89, 75:85].max() < 40, "the front of one, towards the camera"
    assert white[86:89, 75:85].min() > 120, "the back of the other"
    save_film(recording, tmp_path / "film.webp", size=(160, 120), view="3d", is_plain=True, follow=1)
    with Image.open(tmp_path / "film.webp") as film:
        name = np.asarray(film.convert("RGB")).astype(float)[50:64, 66:94, 0]
    seen = black[50:64, 66:94, 0]
    alike, mirrored = (np.corrcoef(each.ravel(), name.ravel())[0, 1] for each in (seen, seen[:, ::-1]))
    assert alike > max(mirrored + 0.2, 0.7)


def test_mistakes_get_a_clear_error(recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for values, words in (
        ({"time_s": 9}, "time_s must be from 0 to 2"),
        ({"samples": 0}, "samples must be a whole number from 1 to 4096"),
    ):
        with pytest.raises(ParameterError, match=words):
            save_photo(recording, tmp_path / "photo.png", **values)
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(ParameterError, match=r"This needs mitsuba, but it cannot be imported .*\[render\]"):
        save_photo(recording, tmp_path / "photo.png")
    assert not list(tmp_path.iterdir())
