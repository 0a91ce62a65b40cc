"""The demonstrations: what they achieve on several seeds, that they repeat, and that a real robot could run them."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path
from statistics import mean
from typing import Any

import numpy as np
import pytest
from tests import forked
from tests.at_length import share

from kiks import Arena, ArenaError
from kiks.demos import scenes
from kiks.demos.scenes import SCENES
from kiks.demos.swarm import Swarm

# Whole demonstrations.
pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
SEEDS = range(share(2, 10))

# The state after the first twenty seconds with seed 1. To renew: python tests/demos/test_demos.py
HASHES = {
    "avoid": "a06c9cd61940109c",
    "follow": "3d1b7ec06f60d15e",
    "clean": "e6c5574f4731f7ba",
    "maze": "548492f58d2a11ed",
    "camera": "3015cda774d517f5",
    "race": "9b2dbb58da99e908",
    "swarm": "109a2ecfb1721dc9",
}


@pytest.mark.parametrize("name", SCENES)
def test_a_run_is_the_same_on_every_computer(name: str) -> None:
    assert state_after_20_s(name) == HASHES[name]


def state_after_20_s(name: str) -> str:
    scene = SCENES[name](seed=1)
    scene.run(20)
    return scene.sim.state_hash()


# ---- what they achieve -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["avoid", "follow"])
def test_one_robot_about_walls_goes_far_and_touches_nothing(name: str) -> None:
    for seed in SEEDS:
        scene = SCENES[name](seed=seed)
        scene.run(60)
        assert scene.sim.travelled_mm(1) > 2000
        assert scene.contact_count() == 0


def test_cylinders_are_pushed_to_the_walls() -> None:
    runs = [scenes.CleanScene(seed=seed) for seed in SEEDS]
    for scene in runs:
        scene.run()
    # By chance a sixth is there at the start.
    assert mean(scene.tidy_at_start for scene in runs) < 4
    assert sum(scene.tidy_count() >= 9 for scene in runs) >= 0.8 * len(runs)
    assert mean(scene.tidy_count() for scene in runs) > 11


def test_random_mazes_are_left() -> None:
    runs = [scenes.MazeScene(seed=seed) for seed in SEEDS]
    for scene in runs:
        scene.run()
    assert sum(scene.is_over and scene.lamp_mm() < 60 for scene in runs) >= 0.9 * len(runs)


def test_the_ball_stays_in_the_picture() -> None:
    for seed in range(4):
        scene = scenes.CameraScene(seed=seed)
        scene.run(60)
        off = np.array(scene.off_deg[150:])  # after the search
        assert (off < scene.IN_SIGHT_DEG).mean() > 0.9
        assert off.mean() < 6
        assert 150 < np.mean(scene.distances_mm[150:]) < 350


def test_the_race_is_fast_and_touches_nothing() -> None:
    for seed in range(4):
        scene = scenes.RaceScene(seed=seed)
        scene.run(30)
        assert scene.best_s() < 2.5
        assert len(scene.laps_s) >= 12
        assert scene.contact_count() == 0


def test_the_robots_of_a_swarm_spread_out_and_do_not_touch() -> None:
    runs = [scenes.SwarmScene(seed=seed) for seed in range(share(2, 5))]
    for scene in runs:
        scene.run()
    assert mean(scene.apart_mm() for scene in runs) > 1.6 * runs[0].apart_at_start_mm
    assert sum(scene.contact_count() for scene in runs) <= 5


# ---- how they are made -----------------------------------------------------------------------------------------------


def test_programs_know_only_what_a_robot_tells() -> None:
    folder = ROOT / "src" / "kiks" / "demos"
    outside = {"scene", "scenes", "champion", "contest", "__init__"}
    programs = [path for path in folder.glob("*.py") if path.stem not in outside]
    assert {path.stem for path in programs} == set(SCENES)
    programs += [ROOT / "examples/soccer" / f"{name}.py" for name in ("player", "sight", "whereabouts")]
    allowed = {f"kiks.{name}" for name in ("client.khepera", "client.port", "demos.follow")}
    for path in programs:
        modules = [node.module for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)]
        ours = {module for module in modules if module and module.startswith("kiks")}
        assert ours <= allowed, path


def test_a_program_runs_by_itself_on_a_port() -> None:
    port = f"kiks://1?arena={ROOT / 'examples' / 'arenas' / 'maze.toml'}"
    command = [sys.executable, "-m", "kiks.demos.maze", port]
    result = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_the_swarm_sends_all_requests_before_it_reads_replies() -> None:
    log: list[str] = []

    class Line:
        def __init__(self, name: str) -> None:
            self.name, self.request = name, b""

        def write(self, data: bytes) -> int:
            log.append(f"{self.name}<{data[:1].decode()}")
            self.request = data
            return len(data)

        def read_until(self, expected: bytes = b"\n") -> bytes:
            log.append(f"{self.name}>")
            return b"n,0,0,0,0,0,0,0,0\r\n" if self.request == b"N\n" else b"d\r\n"

        def close(self) -> None:
            pass

    Swarm([Line("a"), Line("b")]).step()
    assert log == ["a<N", "b<N", "a>", "b>", "a<D", "b<D", "a>", "b>"]


def test_twenty_robots_take_no_longer_for_a_step_than_one() -> None:
    scene = scenes.SwarmScene()
    scene.swarm = Swarm(scene.ports[:1])
    alone_s = time_of_step(scene)
    scene.swarm = Swarm(scene.ports)
    assert time_of_step(scene) < 1.3 * alone_s


def time_of_step(scene: Any) -> float:
    before_s = scene.sim.time_s
    scene.step()
    return float(scene.sim.time_s - before_s)


def test_the_track_is_that_of_the_examples() -> None:
    there = Arena.load(ROOT / "examples" / "arenas" / "track.toml")
    own = scenes.RaceScene().sim.arena
    assert np.array_equal(own.brightness, there.brightness)
    assert own.starts[0] == there.starts[0]


def test_a_scene_takes_another_arena_if_there_is_room() -> None:
    scene = scenes.CleanScene(Arena.box(600, 500), seed=2)
    assert (scene.sim.arena.width_mm, len(scene.sim.bodies())) == (600, 12)
    with pytest.raises(ArenaError, match=r"must have room for everything, .* Take a larger one"):
        scenes.CleanScene(Arena.box(250, 200))


# ---- the command -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("clean", r"\d+ of 12 cylinders at the walls, \d at the start"),
        ("maze", r"not out after 3\.\d s, \d+ mm from the lamp   0 contacts"),
        ("camera", r"ball in sight \d+% of the time|never saw the ball"),
        ("race", r"1 laps, the best in \d\.\d\d s   0 contacts"),
        ("swarm", r"nearest neighbours \d+ mm apart, 66 mm at the start   0 contacts"),
    ],
)
def test_the_command_prints_a_result_and_leaves_a_picture(name: str, words: str, tmp_path: Path) -> None:
    result = forked.run("demo", name, "--seconds", "3", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    line, picture, *_ = result.stdout.strip().splitlines()
    assert re.fullmatch(rf"{name}: 3\.\d s +\d+ x real time   ({words}).*", line), line
    assert re.fullmatch(rf"Picture: kiks-{name}\.png   Seed 0, state [0-9a-f]{{16}}: .*", picture), picture
    assert (tmp_path / f"kiks-{name}.png").stat().st_size > 5000


if __name__ == "__main__":
    print("\n".join(f'    "{name}": "{state_after_20_s(name)}",' for name in SCENES))
