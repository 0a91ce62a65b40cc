"""The demonstrations: what they achieve on several seeds, that they repeat, and that a real robot could run them."""

import ast
import math
import re
from pathlib import Path
from statistics import mean

import numpy as np
import pytest
from tests import forked
from tests.at_length import cases, share
from tests.demos.shown import run, shown, world_of

from kiks import Arena, ArenaError, Recording
from kiks.model.project import Project
from kiks.model.shipped import demonstrations
from kiks.run import Run
from kiks.script.runner import run_here
from kiks.sim.supervision import Supervision

# Whole demonstrations.
pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
DEMOS = ROOT / "examples/demos"
SEEDS = range(share(1, 10))

# The state after the first twenty seconds with seed 1. To renew: python -m tests.demos.test_demos
HASHES = {
    "avoid": "578deb18311f78a9",
    "camera": "3e82121a273e079f",
    "clean": "bf93c9c87084f383",
    "epuck_avoid": "07c0a70fb7aa67e3",
    "epuck_formation": "2f5bd3fa0d587450",
    "epuck_light": "6b9c0cf1301ec9d7",
    "epuck_line": "b19aec35a3905dee",
    "first_steps": "a4b111f587a17671",
    "follow": "caf591d5941f6c7e",
    "maze": "731aaf379d809e97",
    "pictures": "1750069ddd58deac",
    "race": "6df4fa018b9068cf",
    "square": "61c1edeb8a13691d",
    "swarm": "f5e3b017e62f2180",
    "to_the_light": "ea8aafe8c90f2016",
}


@pytest.mark.parametrize("name", HASHES)
def test_a_run_is_the_same_on_every_computer(name: str) -> None:
    assert shown(name, 20.0, seed=1).state_hash() == HASHES[name]


def test_each_program_belongs_to_a_demonstration() -> None:
    programs = {path.stem for path in DEMOS.glob("*.py")}
    here = {name for name, path in demonstrations().items() if path.parent == DEMOS}
    assert programs == here == set(HASHES)
    assert all((DEMOS / f"{name}.py").read_text().startswith('"""') for name in programs)


def number(pattern: str, text: str) -> float:
    found = re.search(pattern, text)
    assert found, text
    return float(found[1])


@pytest.mark.parametrize("name", ["avoid", "follow", "epuck_avoid"])
def test_one_robot_about_walls_goes_far_and_touches_nothing(name: str) -> None:
    for seed in SEEDS:
        sim = shown(name, 60.0, seed=seed)
        assert sim.travelled_mm(1) > 2000
        assert sim.contacts(1) == 0


def test_follow_keeps_its_distance() -> None:
    sim = world_of("follow", arena=Arena.box(500, 500), seed=1)
    sim.record_paths(0.5)
    run(sim, "follow", 60.0)
    path = sim.paths()[0, -75:]
    x_mm, y_mm = path[:, 1], path[:, 2]
    from_wall = np.minimum(np.minimum(x_mm, y_mm), np.minimum(500 - x_mm, 500 - y_mm)) - 10
    assert from_wall.max() < 27 + 40
    assert np.ptp(np.arctan2(y_mm - 250, x_mm - 250)) > 5


def test_cylinders_are_pushed_to_the_walls(capsys: pytest.CaptureFixture[str]) -> None:
    for seed in SEEDS:
        shown("clean", seed=seed)
    found = re.findall(r"(\d+) of 12 cylinders at the walls, (\d+) at the start", capsys.readouterr().out)
    tidy, at_start = np.array(found, int).T
    assert len(tidy) == len(SEEDS)
    # By chance a sixth is there at the start.
    assert at_start.mean() < 4.5
    assert (tidy >= 9).mean() >= 0.8
    assert tidy.mean() > 11


def test_random_mazes_are_left(capsys: pytest.CaptureFixture[str]) -> None:
    for seed in SEEDS:
        sim = shown("maze", arena=Arena.maze(columns=5, rows=5, seed=seed), seed=seed)
        x_mm, y_mm, _ = sim.pose(1)
        if "At the lamp after" in capsys.readouterr().out:
            assert min(math.dist(lamp[:2], (x_mm, y_mm)) for lamp in sim.lamps.tolist()) < 60


def test_the_ball_stays_in_the_picture(capsys: pytest.CaptureFixture[str]) -> None:
    for seed in range(share(1, 4)):
        shown("camera", 60.0, seed=seed)
        said = capsys.readouterr().out
        assert number(r"in sight (\d+)%", said) > 80
        assert number(r"([\d.]+) degrees off", said) < 6
        assert 150 < number(r"(\d+) \+-", said) < 350


def test_the_race_is_fast_and_touches_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    for seed in range(share(1, 4)):
        sim = shown("race", 30.0, seed=seed)
        said = capsys.readouterr().out
        assert number(r"the best in ([\d.]+) s", said) < 2.5
        assert number(r"(\d+) laps", said) >= 12
        assert sim.contacts(1) == 0


def test_the_robots_of_a_swarm_spread_out_and_do_not_touch(capsys: pytest.CaptureFixture[str]) -> None:
    sims = [shown("swarm", seed=seed) for seed in range(share(1, 5))]
    found = re.findall(r"neighbours (\d+) mm apart, 66 mm at the start", capsys.readouterr().out)
    assert mean(map(int, found)) > 1.6 * 66
    assert sum(sim.contacts(robot) for sim in sims for robot in range(1, 21)) <= 5


def test_first_steps(capsys: pytest.CaptureFixture[str]) -> None:
    sim = shown("first_steps")
    out = capsys.readouterr().out
    assert "Version of the robot: b," in out
    assert "from the left clockwise: n," in out
    assert sim.distances_mm()[0, 0] == pytest.approx(80, abs=10)


@pytest.mark.parametrize("heading_rad", cases([4.0, 0.0, 2.0]))
def test_to_the_light(heading_rad: float) -> None:
    sim = world_of("to_the_light")
    sim.place(1, 200, 200, heading_rad)
    sim.record_paths(0.1)
    run(sim, "to_the_light")
    path = sim.paths()[0]
    assert np.hypot(path[:, 1] - 450, path[:, 2] - 450).min() < 60
    assert sim.contacts(1) == 0


def test_an_e_puck_stays_on_its_line() -> None:
    for seed in SEEDS:
        sim = world_of("epuck_line", seed=seed)
        sim.record_paths(0.1)
        run(sim, "epuck_line")
        (zone,) = sim.arena.zones
        line = np.array(zone.line_mm)
        off_mm = [np.hypot(*(line - place).T).min() for place in sim.paths()[0, :, 1:3]]
        assert max(off_mm) < 30  # the points of the line are up to 31 mm apart
        assert sim.travelled_mm(1) > 3000


def test_an_e_puck_drives_to_the_light() -> None:
    for seed in SEEDS:
        sim = world_of("epuck_light", seed=seed)
        sim.record_paths(0.1)
        run(sim, "epuck_light")
        path = sim.paths()[0]
        assert np.hypot(path[:, 1] - 800, path[:, 2] - 700).min() < 40
        assert sim.contacts(1) == 0


def test_a_column_of_e_pucks_keeps_together() -> None:
    for seed in SEEDS:
        sim = world_of("epuck_formation", seed=seed)
        sim.record_paths(0.5)
        run(sim, "epuck_formation")
        places = sim.paths()[:, 20:, 1:3]
        apart_mm = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0))
        assert apart_mm.max() < 74 + 60
        assert sum(map(sim.contacts, range(1, 6))) == 0
        assert sim.travelled_mm(5) > 1500


def test_square_ends_where_it_began(capsys: pytest.CaptureFixture[str]) -> None:
    sim = world_of("square")
    sim.record_paths(0.1)
    assert run(sim, "square") == 0
    assert capsys.readouterr().out.count("is done") == 4
    x_mm, y_mm, heading_rad = sim.pose(1)
    assert (x_mm, y_mm) == pytest.approx((150, 300), abs=12)
    assert math.cos(heading_rad) > 0.98
    path = sim.paths()[0]
    assert path[:, 1].max() == pytest.approx(250, abs=8)
    assert path[:, 2].min() == pytest.approx(200, abs=8)


def test_pictures(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(world_of("avoid"), "pictures") == 1
    assert "has no K213" in capsys.readouterr().err
    shown("pictures")
    pictures = capsys.readouterr().out.splitlines()
    assert len(pictures) == 60
    assert {len(picture) for picture in pictures} == {64}
    assert len(set("".join(pictures))) > 3


def test_programs_know_only_what_a_robot_tells() -> None:
    player = [ROOT / "examples/soccer" / f"{name}.py" for name in ("player", "sight", "whereabouts")]
    for path in (*DEMOS.glob("*.py"), *player):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        modules = {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
        modules |= {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        assert {name for name in modules if name and name.startswith("kiks")} <= {"kiks.client.khepera"}, path


def test_twenty_robots_take_no_longer_for_a_step_than_one(tmp_path: Path) -> None:
    """The program sends all requests before it reads replies."""
    counts = []
    for robots in (1, 20):
        sim = world_of("swarm")
        run = Run(Project(seconds=2.0), DEMOS, sim=sim)
        with sim.record(tmp_path / f"{robots}.mcap"):
            ports = [f"kiks://{robot}" for robot in range(1, robots + 1)]
            run_here(sim, DEMOS / "swarm.py", ports, {}, limited=run.limited)
        counts.append(len(Recording(tmp_path / f"{robots}.mcap").table("readings", 1)))
    assert counts[1] > 0.7 * counts[0] > 20  # the longest of twenty replies takes longer than one


def test_a_demonstration_takes_another_arena_if_there_is_room() -> None:
    supervisor = DEMOS / "supervisors/clean.py"
    sim = world_of("clean", arena=Arena.box(600, 500), seed=2)
    Supervision(sim, supervisor)
    assert len(sim.bodies()) == 12
    with pytest.raises(ArenaError, match=r"must have room for 12 cylinders, .* Take a larger one"):
        Supervision(world_of("clean", arena=Arena.box(250, 200)), supervisor)


PRINTED = [
    ("swarm", r"nearest neighbours \d+ mm apart, 66 mm at the start"),
    ("clean", r"\d+ of 12 cylinders at the walls, \d at the start"),
    ("race", r"1 laps, the best in \d\.\d\d s"),
]


@pytest.mark.parametrize(("name", "words"), cases(PRINTED))
def test_the_command_prints_a_result_and_leaves_a_picture(name: str, words: str, tmp_path: Path) -> None:
    result = forked.run("demo", name, "--seconds", "3", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert re.fullmatch(words, result.stdout.strip()), result.stdout
    assert re.search(r"3\.000 s simulated, seed 0, state [0-9a-f]{16}\n", result.stderr)
    assert (tmp_path / f"kiks-{name}.png").stat().st_size > 5000


if __name__ == "__main__":
    for name in HASHES:
        print(f'    "{name}": "{shown(name, 20.0, seed=1).state_hash()}",')
