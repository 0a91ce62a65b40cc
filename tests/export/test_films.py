"""Films of recordings show what was recorded."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageSequence
from tests.model.test_atomic_files import full_disk

from kiks import Arena, Khepera, ParameterError, Recording, Simulation
from kiks.cli import app
from kiks.export import film as film_of_recording
from kiks.export.film import save_film
from kiks.export.stage import MARGIN, OUTSIDE
from kiks.recording import recorder

WIDTH_MM, HEIGHT_MM, SECONDS = 400.0, 300.0, 6.0

Pixels = NDArray[np.uint8]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A robot drives around a cylinder; after 3 s a wall is drawn. Each second is a chunk."""
    file = tmp_path_factory.mktemp("recording") / "run.mcap"
    sim = Simulation(Arena.box(int(WIDTH_MM), int(HEIGHT_MM)), seed=3)
    sim.place(1, 100, 80, 0.3)
    sim.add_cylinder(200, 150)
    robot = Khepera(sim.port(1))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "CHUNK_S", 0.0)
        with sim.record(file):
            robot.set_speed(9, 5)
            while sim.time_s < SECONDS:
                robot.proximity()
                if sim.time_s > 3 and sim.arena.brightness[40, 350] == 0:
                    walls = np.flipud(sim.arena.brightness).copy()
                    walls[240:280, 330:370] = 100
                    sim.set_arena(Arena.from_array(walls))
    return Recording(file)


def frames_of(file: Path) -> list[Any]:
    import av

    with av.open(str(file)) as container:
        return list(container.decode(video=0))


def pictures(file: Path) -> list[Pixels]:
    """Return the pictures of a film, decoded by a library of its own for each kind."""
    if file.suffix == ".webp":  # FFmpeg decodes no WebP that moves
        with Image.open(file) as image:
            return [np.asarray(each.convert("RGB")) for each in ImageSequence.Iterator(image)]
    return [frame.to_ndarray(format="rgb24") for frame in frames_of(file)]


def pixel(picture: Pixels, x_mm: float, y_mm: float) -> tuple[float, float]:
    """Return where a place is in a film of the whole arena: column and row."""
    height, width = picture.shape[:2]
    scale = (1 - 2 * MARGIN) * min(width / WIDTH_MM, height / HEIGHT_MM)
    return width / 2 + (x_mm - WIDTH_MM / 2) * scale, height / 2 - (y_mm - HEIGHT_MM / 2) * scale


def is_robot(picture: Pixels) -> NDArray[np.bool_]:
    """Return which pixels have the colour of the robot, which alone is blue."""
    return picture[..., 2].astype(int) - picture[..., 0] > 50


def robot_place(picture: Pixels) -> tuple[float, float]:
    """Return the middle of what has the colour of the robot: column and row."""
    rows, columns = np.nonzero(is_robot(picture))
    assert len(rows) > 50
    return float(columns.mean()), float(rows.mean())


def pose_at(recording: Recording, time_s: float) -> tuple[float, float]:
    poses = recording.table("poses")
    row = poses[np.searchsorted(poses["time_s"], time_s + 1e-9) - 1]
    return float(row["x_mm"]), float(row["y_mm"])


@pytest.mark.parametrize("ending", ["mp4", "gif", "webp"])
def test_the_robot_is_where_the_recording_has_it(ending: str, recording: Recording, tmp_path: Path) -> None:
    file = tmp_path / f"film.{ending}"
    count = save_film(recording, file, size=(321, 241), fps=5, is_plain=True, start_s=1.0, end_s=5.0)
    seen = pictures(file)
    assert count == len(seen) == 21
    for index in (0, 7, 20):
        assert seen[index].shape == ((240, 320, 3) if ending == "mp4" else (241, 321, 3))
        wanted = pixel(seen[index], *pose_at(recording, 1.0 + index / 5))
        assert robot_place(seen[index]) == pytest.approx(wanted, abs=2.0)


@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_a_film_lasts_as_long_as_its_pictures(ending: str, recording: Recording, tmp_path: Path) -> None:
    for fps, speed, size in ((25, 1.0, (65, 333)), (30, 4.0, (333, 65)), (7, 0.5, (96, 64))):
        file = tmp_path / f"film.{ending}"
        count = save_film(recording, file, size=size, fps=fps, speed=speed, end_s=2.0)
        assert count == int(2.0 / speed * fps) + 1
        frames = frames_of(file)
        assert len(frames) == count
        even = 2 if ending == "mp4" else 1
        assert (frames[-1].width, frames[-1].height) == tuple(length // even * even for length in size)
        # The clock of a GIF has hundredths.
        times_s = [float(frame.pts * frame.time_base) for frame in frames]
        np.testing.assert_allclose(times_s, np.arange(count) / fps, atol=0.0051 if ending == "gif" else 1e-4)


def test_a_webp_lasts_as_long_as_its_pictures(recording: Recording, tmp_path: Path) -> None:
    save_film(recording, tmp_path / "film.webp", size=(333, 65), fps=20, end_s=2.0)
    with Image.open(tmp_path / "film.webp") as image:
        durations_ms = [each.load() and each.info["duration"] for each in ImageSequence.Iterator(image)]
        assert (image.size, image.info["loop"]) == ((333, 65), 0)
    # What does not change between pictures is one longer picture.
    assert sum(durations_ms) == pytest.approx(41 * 50, abs=51)


def test_the_followed_robot_stays_in_the_middle_and_zoom_makes_it_larger(recording: Recording, tmp_path: Path) -> None:
    areas, options = [], {"size": (200, 150), "follow": 1, "is_plain": True}
    for zoom in (2, 4):
        save_film(recording, tmp_path / "film.webp", fps=3, zoom=zoom, **options)
        seen = pictures(tmp_path / "film.webp")
        np.testing.assert_allclose([robot_place(each) for each in seen], [(99.5, 74.5)] * len(seen), atol=2.0)
        areas.append(np.count_nonzero(is_robot(seen[0])))
    assert areas[1] / areas[0] == pytest.approx(4, rel=0.15)


def test_walls_and_trails_come_as_they_came(recording: Recording, tmp_path: Path) -> None:
    save_film(recording, tmp_path / "film.webp", size=(320, 240), fps=2)
    seen = pictures(tmp_path / "film.webp")
    column, row = map(round, pixel(seen[0], 350, 40))
    assert min(seen[5][row, column]) > 200
    assert max(seen[7][row, column]) < 150
    # The floor where the robot was at 2 s: under the robot then, its trail later, also after the wall came.
    column, row = map(round, pixel(seen[0], *pose_at(recording, 0.0)))
    colour = np.abs(seen[-1][row - 1 : row + 2, column - 1 : column + 2].astype(int) - (246, 243, 236)).max()
    assert colour > 40


def test_readings_stand_beside_it(recording: Recording, tmp_path: Path) -> None:
    save_film(recording, tmp_path / "film.webp", size=(1280, 720), fps=2, start_s=0.5, end_s=2.0)
    readings = recording.table("readings")
    for index, picture in enumerate(pictures(tmp_path / "film.webp"), 1):
        wanted = readings["counts"][np.searchsorted(readings["time_s"], index / 2, side="right") - 1]
        panel = picture[200:340, 1030:].astype(int)
        for sensor, count in enumerate(wanted.tolist()):
            bar = panel[:, round(20 + (sensor + 0.5) * 210 / 8)]
            is_filled = bar.max(axis=-1) - bar.min(axis=-1) > 60
            assert np.count_nonzero(is_filled) == pytest.approx(min(count / 1023, 1) * 140, abs=1.5)


def test_the_same_recording_gives_the_same_film_and_progress_is_told(recording: Recording, tmp_path: Path) -> None:
    for ending in ("mp4", "gif", "webp"):
        files = [tmp_path / f"{name}.{ending}" for name in ("one", "two")]
        for file in files:
            told: list[float] = []
            count = save_film(recording, file, size=(160, 120), fps=5, on_progress=told.append)
        assert files[0].read_bytes() == files[1].read_bytes()
        assert told == [number / count for number in range(1, count + 1)]


@pytest.mark.parametrize("ending", ["mp4", "gif", "webp"])
def test_on_a_full_disk_the_earlier_file_stays(ending: str, recording: Recording, tmp_path: Path) -> None:
    file = tmp_path / f"film.{ending}"
    file.write_bytes(b"earlier")
    for bytes_left in (0, 1000, 6000):
        with full_disk(bytes_left), pytest.raises(ParameterError, match="a film must go to a file that can be written"):
            save_film(recording, file, size=(320, 240), fps=10)
        assert [path.name for path in tmp_path.iterdir()] == [file.name]
        assert file.read_bytes() == b"earlier"


MISTAKES = [
    ("film.avi", {}, r"a film must end in .mp4, .gif or .webp, but it was"),
    ("no/film.mp4", {}, "a film must go to a file that can be written"),
    ("film.mp4", {"size": (63, 64)}, "the width of size must be a whole number from 64 to 4096, but it was 63"),
    ("film.mp4", {"size": (64, 5000)}, "the height of size must be"),
    ("film.mp4", {"size": 7}, "size must be a width and a height"),
    ("film.mp4", {"fps": 0}, "fps must be a whole number from 1 to 120"),
    ("film.gif", {"fps": 51}, "fps must be a whole number from 1 to 50"),
    ("film.mp4", {"speed": 0}, "speed must be from 0.001 to 1000"),
    ("film.mp4", {"view": ["top"]}, "view must be one of 'top', '3d'"),
    ("film.mp4", {"robot": 2}, "robot must be a whole number from 1 to 1, but it was 2"),
    ("film.mp4", {"robot": 1, "is_plain": True}, "robot must be left out of a plain film, but it was 1"),
    ("film.mp4", {"follow": 2}, "follow must be a whole number from 1 to 1, but it was 2"),
    ("film.mp4", {"zoom": 2}, "zoom must be left out where no robot is followed"),
    ("film.mp4", {"zoom": 0.5, "follow": 1}, "zoom must be from 1 to 20"),
    ("film.mp4", {"zoom": 20, "follow": 1, "size": (4096, 4096)}, "the whole arena must have at most"),
    ("film.mp4", {"start_s": 7}, "start_s must be from 0 to"),
    ("film.mp4", {"end_s": 100}, "end_s must be from 0 to"),
    ("film.mp4", {"start_s": 2, "end_s": 2}, "a film must end after it begins, but it begins at 2 s and ends at 2 s"),
]


def test_mistakes_get_a_clear_error(recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, values, words in MISTAKES:
        with pytest.raises(ParameterError, match=words):
            save_film(recording, tmp_path / name, **values)
        assert not list(tmp_path.iterdir())
    monkeypatch.setattr(film_of_recording, "PICTURES_MAX", 100)
    with pytest.raises(ParameterError, match="a film must have at most 100 pictures, but it would have 151"):
        save_film(recording, tmp_path / "film.mp4", start_s=0.5, end_s=2.0, fps=100)


def test_the_command(recording: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", str(recording.log.reader.path), str(tmp_path / "film.mp4")]
    app([*words, "--size", "200x100", "--start", "1", "--end", "1.4"], standalone_mode=False)
    assert re.fullmatch(rf"Film: {tmp_path}/film.mp4, \d+ kB\n", capsys.readouterr().out)
    seen = pictures(tmp_path / "film.mp4")
    assert (len(seen), seen[0].shape) == (11, (100, 200, 3))
    np.testing.assert_allclose(seen[0][0, 0], OUTSIDE, atol=4)
    for size in ("200", "x", "axb", "-1x5", "1280x720x3"):
        with pytest.raises(ParameterError, match="--size must be a width and a height like 1280x720"):
            app([*words, "--size", size], standalone_mode=False)


def test_colours_that_a_gif_has_are_those_of_the_picture(recording: Recording, tmp_path: Path) -> None:
    for ending in ("gif", "webp"):
        save_film(recording, tmp_path / f"film.{ending}", size=(640, 400), fps=1)
    for lossy, exact in zip(pictures(tmp_path / "film.gif"), pictures(tmp_path / "film.webp"), strict=True):
        errors = np.abs(lossy.astype(int) - exact).max(axis=-1)
        assert np.count_nonzero(errors > 2) < 0.01 * errors.size
        assert errors.max() < 40
