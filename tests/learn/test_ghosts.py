"""Whole generations as ghosts: each candidate drives as in its evaluation, and all are seen in one arena."""

from pathlib import Path

import numpy as np
import pytest
from tests.learn.small import refused, small
from typer.testing import CliRunner

import kiks
from kiks.cli import app
from kiks.learn.ghosts import load_ghosts, save_ghost_page, save_ghosts

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("runs") / "small"
    kiks.Evolution(kiks.tasks.avoid(), "ga", seed=2, population=5, folder=home).run(generations=2)
    return home


def test_ghosts_drive_as_individuals_do_on_the_wire(folder: Path) -> None:
    from kiks.learn.individual import load_individual

    for generation, scene in zip((1, 2), load_ghosts(folder, [1, 2], world=4), strict=True):
        assert len(scene.trajectories) == 5
        for rank in (1, 4):
            champion, _ = load_individual(folder, generation, rank=rank, world=4)
            sim, ports = champion.simulation()
            assert sim.pose(1) == pytest.approx(tuple(scene.trajectories[rank - 1, 0]))
            assert sim.arena.name == scene.arena.name
            champion.drive(ports, seconds=champion.world.seconds)
            # The last pose is that of the last control step, shortly before the end.
            away_mm = np.hypot(*(scene.trajectories[rank - 1, -1, :2] - np.array(sim.pose(1)[:2])))
            assert away_mm < 10.0
        assert f"generation {generation}" in scene.title


def test_ways_end_where_measures_say(folder: Path) -> None:
    task = small(measures=(kiks.measures.final_x_mm, kiks.measures.final_y_mm), axes=(), fitness=None)
    candidates = kiks.controllers.random_parameters(task.controller, 3, seed=1)
    seeds = np.arange(3)
    ways, values = task.trajectories(candidates, seeds, points=9), task.evaluate(candidates, seeds)
    assert ways.shape == (3, task.worlds, 1, 9, 3)
    np.testing.assert_allclose(ways[:, :, 0, -1, :2].mean(axis=1), values[:, 1:])


def test_a_picture_and_a_film_show_generations(folder: Path, tmp_path: Path) -> None:
    from PIL import Image

    words = ["export", str(folder), "--size", "160x120"]
    done = CliRunner().invoke(app, [*words, str(tmp_path / "ghosts.png")])
    assert done.exit_code == 0, done.output
    with Image.open(tmp_path / "ghosts.png") as opened:
        picture = np.asarray(opened)
    assert picture.shape == (120, 160, 3)
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
    done = CliRunner().invoke(app, [*words, str(tmp_path / "ghosts.webp"), "--speed", "12", "--fps", "5"])
    assert done.exit_code == 0, done.output
    assert f"Ghosts: {tmp_path / 'ghosts.webp'}, " in done.output
    with Image.open(tmp_path / "ghosts.webp") as film:
        assert getattr(film, "n_frames", 1) > 10


def test_the_frames_of_a_page_have_the_poses_of_all_generations(folder: Path, tmp_path: Path) -> None:
    from kiks.engine.sensing.frame_parts import SHOWN_ROBOT
    from kiks.export.frames import HEAD
    from kiks.export.ghost_frames import GhostFrames

    scenes = load_ghosts(folder, [1, 2])
    frames = GhostFrames(scenes)
    heads = [np.frombuffer(each, HEAD, 1)[0] for each in frames.frames]
    assert [int(each["scene"]) for each in heads] == sorted([0, 1] * (len(heads) // 2))
    assert {int(each["robot_count"]) for each in heads} == {5}
    for first, scene in zip((0, len(heads) // 2), scenes, strict=True):
        poses = np.frombuffer(frames.frames[first], SHOWN_ROBOT, 5, HEAD.itemsize)["pose"]
        np.testing.assert_allclose(poses, scene.trajectories[:, 0], atol=1e-3)
    done = CliRunner().invoke(app, ["export", str(folder), str(tmp_path / "ghosts.html")])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "ghosts.html").read_text("utf-8")
    assert page.count("generation 1 ") == page.count("generation 2 ") == 1
    assert "SECTION" not in page


def test_what_cannot_be_shown_is_refused_in_one_line(folder: Path, tmp_path: Path) -> None:
    refused("generation must be a whole number from 1 to 2", load_ghosts, folder, [3])
    refused("world must be", load_ghosts, folder, [1], world=1000)
    for words, told in (
        ("a.png --generations 1,x", "--generations must be numbers or rising ranges, but one was 'x'"),
        ("a.html --fps 5", "--fps must be left out of a ghost page, but it was 5"),
        ("a.mp4 --title Ann", "--title must be left out of ghosts, but it was 'Ann'"),
        ("a.csv", "the file must end in .mp4, .gif, .webp, .png or .html"),
        ("a.png --kind photo", "kind must be one of 'ghosts', 'ghost page', but it was 'photo'"),
    ):
        failed = CliRunner().invoke(app, ["export", str(folder), *words.replace("a.", f"{tmp_path}/a.").split()])
        assert told in str(failed.exception)
    task = kiks.tasks.pursuit(seconds=1)
    kiks.Evolution(task, seed=1, population=4, opponents=2, folder=tmp_path / "two").run(generations=1)
    refused("must have one side and a generation for ghosts", load_ghosts, tmp_path / "two", [1], task=task)
    for save, name in ((save_ghosts, "ghosts.png"), (save_ghosts, "ghosts.gif"), (save_ghost_page, "ghosts.html")):
        refused("ghosts must be of one generation at least", save, folder, tmp_path / name, generations=())
