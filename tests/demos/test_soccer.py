"""Soccer: what the player sees and knows, what the referee does, and that a match is the same again."""

import itertools
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import numpy as np
import pytest
import sight
from player import BAUD, Player
from tests import forked
from tests.at_length import at_length
from tests.busy import busy_computer
from tests.cli.test_cli import state_of
from tests.demos.shown import world_of
from whereabouts import Whereabouts

from kiks import Khepera, Simulation
from kiks.model import pitch
from kiks.sim.supervision import Supervision
from kiks.units import ns_from_s

# Whole matches.
pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
SOCCER = ROOT / "examples/soccer"
CHASER = ROOT / "examples/players/chaser.py"

# States with seed 1, by the programs of both sides: after twenty seconds, and after eight.
HASHES = {"own": "a12ddc206aca8100", "chaser": "46036bb4da35382d"}


def match(seed: int = 0) -> Simulation:
    """Return a match at its start, with its referee."""
    sim = world_of("soccer", seed=seed)
    Supervision(sim, SOCCER / "referee.py")
    return sim


def played(*words: str, seconds: float = 20.0, cwd: Path) -> tuple[str, str]:
    """Return what a match with seed 1 printed, and its state."""
    result = forked.run("demo", "soccer", "--seconds", f"{seconds:g}", "--seed", "1", *words, cwd=cwd)
    assert result.returncode == 0, result.stderr
    return result.stdout, state_of(result.stderr)


def test_a_match_is_the_same_on_every_computer(tmp_path: Path) -> None:
    said, state = played(cwd=tmp_path)
    assert state == HASHES["own"]
    *goals, score = said.splitlines()
    assert all(re.fullmatch(r" *\d+\.\d s   \d:\d   (left|right)", line) for line in goals)
    assert re.fullmatch(r"left \d, right \d, \d dropped balls", score)
    assert (tmp_path / "kiks-soccer.png").exists()
    own = [str(SOCCER / "player.py"), "kiks://1", "left"]
    assert played(*own, str(CHASER), "kiks://2", seconds=8, cwd=tmp_path)[1] == HASHES["chaser"]


@at_length
def test_a_match_is_the_same_on_a_busy_computer(tmp_path: Path) -> None:
    with busy_computer(3):
        assert played("--when-silent", "wait", cwd=tmp_path)[1] == HASHES["own"]


@at_length
def test_goals_fall_on_both_sides(tmp_path: Path) -> None:
    found = re.search(r"left (\d+), right (\d+)", played(seconds=300.0, cwd=tmp_path)[0])
    assert min(map(int, found.groups())) >= 1


def test_a_program_that_ends_leaves_the_other_to_play(tmp_path: Path) -> None:
    (tmp_path / "brief.py").write_text("raise SystemExit(3)")
    result = forked.run("demo", "soccer", "--seconds", "8", "brief.py", cwd=tmp_path)
    assert "program 1 (brief.py) has ended with exit code 3." in result.stderr
    assert "robot 1: 0.00 m driven" in result.stderr
    assert "8.000 s simulated" in result.stderr
    assert "robot 2: 0.00 m driven" not in result.stderr


def take(scene: list[float], *, shift: float = 0.0) -> list[int]:
    """Return the answer to order S when a scene of true greys is seen through exposure, lens and line."""
    return [round(0.9 * min(grey + shift, sight.ceiling(i)) + 12.75) for i, grey in enumerate(scene)]


def light(scene: list[float]) -> int:
    return round(7 * (255 - max(scene)) + 200 + max(scene) - sum(scene) / len(scene))


def ball_at(bearing_deg: float, distance_mm: float, ground: list[float]) -> list[float]:
    half_deg = math.degrees(math.asin(32.0 / distance_mm))
    degrees = [math.degrees(sight.bearing(i)) for i in range(sight.COUNT)]
    return [sight.BALL if abs(at - bearing_deg) < half_deg else grey for at, grey in zip(degrees, ground, strict=True)]


def seen(scene: list[float]) -> list[float]:
    greys = sight.smooth(take(scene))
    sight.undarken(greys)
    return greys


@pytest.mark.parametrize("ground", [sight.WALL, sight.DIM, sight.BRIGHT])
def test_the_ball_is_where_it_is(ground: float) -> None:
    for distance_mm, bearing_deg in itertools.product((200.0, 300.0, 450.0, 600.0), (-2.0, 0.0, 3.0)):
        ball = sight.find_ball(seen(ball_at(bearing_deg, distance_mm, [ground] * sight.COUNT)))
        assert ball.is_whole
        distance, bearing = ball.where(None)
        assert distance == pytest.approx(distance_mm, rel=0.3)
        assert math.degrees(bearing) == pytest.approx(bearing_deg, abs=1.0)


def test_the_light_level_undoes_the_exposure() -> None:
    for grey in (sight.WALL, sight.DIM, sight.BRIGHT):
        scene = [sight.WALL] * 10 + [grey] * 12 + [sight.WALL] * 10
        shift = sight.BALL - grey - 10.0
        assert sight.exposure(sight.smooth(take(scene, shift=shift)), light(scene)) == pytest.approx(shift, abs=8.0)


def test_posts_are_told_by_their_goal_and_side() -> None:
    for grey, name in ((sight.DIM, "dim"), (sight.BRIGHT, "bright")):
        left, right = sight.find_edges(seen([sight.WALL] * 12 + [grey] * 9 + [sight.WALL] * 11), 0.0)
        assert (left.goal, left.is_left, right.goal, right.is_left) == (name, True, name, False)
        assert left.bearing_rad == pytest.approx(sight.bearing(11.5), abs=0.01)
        assert right.bearing_rad == pytest.approx(sight.bearing(20.5), abs=0.01)


def test_the_constants_are_those_of_the_camera() -> None:
    sim = world_of("soccer")
    sim.move_body(ball_of(sim)["number"], 900, 100)
    for grey, pose in (
        (sight.DIM, (300, 350, math.pi)),
        (sight.BRIGHT, (930, 350, 0)),
        (sight.WALL, (400, 200, -math.pi / 2)),
    ):
        sim.place(2, 600, 600, 0)
        sim.place(1, *pose)
        sim.run(0.1)
        answer = Khepera(sim.port(1)).turret(2, "S")
        high, low = Khepera(sim.port(1)).turret(2, "L")
        middle = sight.smooth(answer)[12:20]
        mean = np.mean(middle) - sight.exposure(sight.smooth(answer), 256 * high + low)
        assert mean == pytest.approx(grey, abs=12)


def whereabouts(at: list[int], *pose: float) -> Whereabouts:
    """Return the place of a robot whose wheels have turned by the pulses of a list."""
    return Whereabouts(SimpleNamespace(encoders=lambda: tuple(at)), *pose)  # type: ignore[arg-type]


def test_wheels_lead_round_a_circle_and_back() -> None:
    at = [0, 0]
    place = whereabouts(at, 10.0, 20.0, 0.5)
    turn_pulses = math.pi * Whereabouts.BASE_MM / Whereabouts.PULSE_MM
    for step in range(1, 101):
        at[:] = round(5000 * step / 100), round((5000 + 2 * turn_pulses) * step / 100)
        place.read_wheels()
    assert (place.x, place.y) == pytest.approx((10.0, 20.0), abs=1.0)
    assert place.heading == pytest.approx(0.5 + 2 * math.pi, abs=0.01)
    assert place.spread[0][0] > 25.0


def test_posts_put_the_heading_right() -> None:
    place = whereabouts([0, 0], 0.0, 0.0, 0.1)
    place.spread[2][2] = 0.02
    for _ in range(40):
        for y in (-150.0, 150.0):
            assert place.see(525.0, y, math.atan2(y, 525.0))
    assert place.heading == pytest.approx(0.0, abs=0.01)
    assert math.hypot(place.x, place.y) < 10.0


def full_time() -> NoReturn:
    raise TimeoutError


def test_a_player_alone_scores_and_knows_where_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    sim = match(seed=2)
    sim.place(2, 1000, 620, 0)
    sim.loop.end_at(ns_from_s(60), full_time)
    port = sim.port(1)
    port.baudrate = BAUD
    one = Player(Khepera(port))
    with pytest.raises(TimeoutError):
        all(one.step() is None for _ in itertools.count())
    assert re.search(r" [1-9]:\d   left\n", capsys.readouterr().out)
    x_mm, y_mm, _ = sim.pose(1)
    assert math.hypot(one.place.x + 615 - x_mm, one.place.y + 350 - y_mm) < 80


def test_all_of_the_ball_must_be_behind_the_line() -> None:
    assert [pitch.goal_at(x_mm, 32.0) for x_mm in (1172.1, 1171.9, 58.1, 57.9)] == [1, 0, 0, -1]


def ball_of(sim: Simulation) -> Any:
    return sim.bodies()[0]


def test_after_a_goal_the_ball_falls_near_the_middle_and_robots_stay(capsys: pytest.CaptureFixture[str]) -> None:
    sim = match(seed=5)
    poses = sim.poses()
    sim.move_body(ball_of(sim)["number"], 1000, 300, speed_mm_s=300)
    sim.run(3)
    assert capsys.readouterr().out.endswith("1:0   left\n")
    ball = ball_of(sim)
    assert abs(ball["x_mm"] - pitch.MIDDLE_X_MM) <= 40
    assert abs(ball["y_mm"] - pitch.MIDDLE_Y_MM) <= 120
    assert ball["velocity_x"] == 0
    assert np.array_equal(sim.poses(), poses)


def test_a_ball_that_lies_still_is_dropped_and_not_onto_a_robot() -> None:
    sim = match()
    sim.move_body(ball_of(sim)["number"], 1080, 150)
    sim.place(1, pitch.MIDDLE_X_MM, pitch.MIDDLE_Y_MM, 0)
    sim.run(9)
    assert ball_of(sim)["x_mm"] == 1080
    sim.run(3)
    ball = ball_of(sim)
    assert 59.5 < math.hypot(ball["x_mm"] - pitch.MIDDLE_X_MM, ball["y_mm"] - pitch.MIDDLE_Y_MM) < 130


def test_it_does_not_matter_how_time_is_cut() -> None:
    def state(step_s: float) -> str:
        sim = match(seed=1)
        sim.move_body(ball_of(sim)["number"], 1000, 300, speed_mm_s=300)
        sim.port(1).write(b"D,20,18\n")
        while sim.time_s < 5.05:
            sim.advance_to(min(sim.now_ns + ns_from_s(step_s), ns_from_s(5.05)))
        return sim.state_hash()

    assert len({state(step_s) for step_s in (0.013, 0.1, 0.25, 7.0)}) == 1


def test_the_pitch_is_the_example_arena() -> None:
    example, own = pitch.arena(), world_of("soccer").arena
    assert np.array_equal(own.brightness, example.brightness)
    assert own.starts == example.starts
