"""The ready matches: a whole one of each is the same everywhere, and referees keep their rules."""

import math
import re
from pathlib import Path

import pytest
from tests import forked
from tests.at_length import at_length
from tests.cli.test_cli import state_of
from tests.demos.shown import world_of

from kiks import Khepera, Simulation
from kiks.model.shipped import demonstrations
from kiks.sim.supervision import Supervision

# Whole matches.
pytestmark = pytest.mark.slow

MATCHES = Path(__file__).parents[2] / "examples/matches"

# The state after thirty seconds with seed 1.
HASHES = {"sumo": "061966340c04ce31", "battle": "09a7fc9544a8bbcd", "hide_and_seek": "cd3b789acf09b4e0"}


def match(name: str, seed: int = 0) -> Simulation:
    """Return a match at its start, with its referee and standing robots."""
    sim = world_of(name, seed=seed)
    Supervision(sim, MATCHES / f"{name}_referee.py")
    return sim


def test_each_match_has_a_player_and_a_referee() -> None:
    names = {path.stem for path in MATCHES.glob("*.kiks")}
    assert names == set(HASHES) < set(demonstrations())
    assert {path.stem for path in MATCHES.glob("*.py")} == names | {f"{name}_referee" for name in names}


@pytest.mark.parametrize("name", HASHES)
def test_a_match_is_the_same_on_every_computer(name: str, tmp_path: Path) -> None:
    result = forked.run("demo", name, "--seconds", "30", "--seed", "1", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert state_of(result.stderr) == HASHES[name]


@at_length
@pytest.mark.parametrize("name", HASHES)
def test_a_whole_match_of_equals_has_points_on_both_sides(name: str, tmp_path: Path) -> None:
    result = forked.run("demo", name, "--seed", "1", cwd=tmp_path)
    points = [int(value) for value in re.findall(r"\d+", result.stdout.splitlines()[-1])[:2]]
    assert min(points) >= 1, result.stdout


def test_the_robot_that_touches_the_wall_has_lost_the_round() -> None:
    sim = match("sumo")
    sim.place(1, 320, 38, 0.0)
    sim.run(0.2)
    assert sim.score == {1: 0, 2: 1}
    one, two = sim.pose(1), sim.pose(2)
    assert math.dist(one[:2], two[:2]) == pytest.approx(240)
    assert math.dist(one[:2], (320, 320)) == pytest.approx(120)
    # Neither has the other nearer to its front.
    left, right = (math.atan2(b[1] - a[1], b[0] - a[0]) - a[2] for a, b in ((one, two), (two, one)))
    assert math.remainder(left - right, 2 * math.pi) == pytest.approx(0, abs=1e-6)
    sim.place(2, 602, 320, 0.0)
    sim.run(0.2)
    assert sim.score == {1: 1, 2: 1}


def test_no_point_where_both_touch_the_wall_or_nothing_happens() -> None:
    sim = match("sumo")
    sim.place(1, 320, 38, 0.0)
    sim.place(2, 602, 320, 0.0)
    sim.run(0.2)
    place = sim.pose(1)
    for seconds, is_new_round in ((0.0, False), (19.5, False), (1.0, True)):
        sim.run(seconds)
        assert sim.score == {1: 0, 2: 0}
        assert (sim.pose(1) != place) == is_new_round


def test_the_faster_pushes_the_other_out() -> None:
    sim = match("sumo")
    for robot, speed in ((1, 16), (2, 6)):
        Khepera(sim.port(robot)).set_speed(speed, speed)
    sim.run(8.0)
    assert sim.score == {1: 1, 2: 0}


def test_three_hits_knock_a_robot_out_and_it_recovers_far_away() -> None:
    sim = match("battle")
    sim.place(1, 100, 300, 0.0)
    sim.place(2, 300, 300, math.pi)
    robot = Khepera(sim.port(1))
    assert [robot.turret(99, "F")[0] for _ in range(2)] == [2, 2]
    sim.run(0.3)
    assert sim.score == {1: 0, 2: 0}
    assert robot.turret(99, "F")[0] == 2
    sim.run(0.3)
    assert sim.score == {1: 1, 2: 0}
    assert sim.pose(2)[:2] in ((700, 100), (700, 500))
    # It has not recovered: a fourth hit is no point.
    sim.run(6.0)
    sim.place(2, 300, 300, math.pi)
    robot.turret(99, "F")
    sim.run(0.3)
    assert sim.score == {1: 1, 2: 0}


def test_a_robot_that_shoots_with_its_last_points_is_out() -> None:
    sim = match("battle")
    robot = Khepera(sim.port(1))
    sim.place(1, 100, 500, math.pi)
    for _ in range(5):
        assert robot.turret(99, "F")[1] >= 0
    sim.run(2.0)
    assert sim.score == {1: 0, 2: 0}
    while robot.turret(99, "S")[5] < 5:
        sim.run(0.02)
    robot.turret(99, "F")
    sim.run(0.3)
    assert sim.score == {1: 0, 2: 1}


def test_the_hider_is_caught_where_the_seeker_is_near_and_sees_it() -> None:
    for seeker, hider, is_caught in (
        ((300, 300, 0.0), (380, 300), True),
        ((300, 300, 0.7), (380, 300), True),
        ((300, 300, 0.9), (380, 300), False),  # it is not in sight
        ((300, 300, 0.0), (395, 300), False),  # it is too far
        ((212, 100, 0.0), (288, 100), False),  # a wall is between
    ):
        sim = match("hide_and_seek")
        sim.place(1, *seeker)
        sim.place(2, *hider, 0.0)
        sim.run(0.2)
        assert sim.score == {1: int(is_caught), 2: 0}
        assert (sim.pose(1)[:2] == (100, 350)) == is_caught


def test_the_round_is_the_hider_s_after_its_time() -> None:
    sim = match("hide_and_seek")
    sim.run(39.5)
    assert sim.score == {1: 0, 2: 0}
    sim.run(1.0)
    assert sim.score == {1: 0, 2: 1}
