"""Soccer: what the player sees and knows, what the referee does, and that a match is the same again."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
import sight
from player import BAUD, Player
from soccer_command import player
from soccer_match import FullTime, Match, play, scorer
from soccer_picture import draw_match
from tests import forked
from tests.at_length import at_length
from tests.busy import busy_computer
from whereabouts import Whereabouts

from kiks import Arena, Khepera, ParameterError
from kiks.model import pitch

# Whole matches.
pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
CHASER = str(ROOT / "examples/players/chaser.py")

# States after twenty seconds with seed 1, by the programs of both sides. To renew: python tests/demos/test_soccer.py
HASHES = {"own": "a12ddc206aca8100", "chaser": "0d0c8453d0ba36aa"}


def run(match: Match, right: str | None = None) -> Match:
    assert play(match, [player(None, 1, "left"), player(right, 2, "right")]) == ""
    return match


def hashes() -> dict[str, str]:
    return {"own": run(Match(20, 1)).state_hash(), "chaser": run(Match(20, 1), CHASER).state_hash()}


def test_a_match_is_the_same_on_every_computer() -> None:
    assert hashes() == HASHES


@at_length
def test_a_match_is_the_same_on_a_busy_computer() -> None:
    with busy_computer(3):
        assert run(Match(20, 1)).state_hash() == HASHES["own"]


@at_length
def test_goals_fall_on_both_sides() -> None:
    scores = np.array([run(Match(300, seed)).report.score() for seed in (0, 1)])
    assert scores.sum(axis=1).min() >= 2
    assert scores.sum(axis=0).min() >= 1


# ---- the eye ---------------------------------------------------------------------------------------------------------


def take(scene: list[float], *, shift: float = 0.0) -> list[int]:
    """Return the answer to order S when a scene of true greys is seen through exposure, lens and line."""
    return [round(0.9 * min(grey + shift, sight.ceiling(i)) + 12.75) for i, grey in enumerate(scene)]


def light(scene: list[float]) -> int:
    return round(7 * (255 - max(scene)) + 200 + max(scene) - sum(scene) / len(scene))


def ball_at(bearing_deg: float, distance_mm: float, ground: list[float]) -> list[float]:
    half_deg = math.degrees(math.asin(32.0 / distance_mm))
    degrees = [math.degrees(sight.bearing(i)) for i in range(sight.COUNT)]
    return [sight.BALL if abs(at - bearing_deg) < half_deg else grey for at, grey in zip(degrees, ground, strict=True)]


def seen(scene: list[float], shift: float = 0.0) -> list[float]:
    greys = sight.smooth(take(scene, shift=shift))
    sight.undarken(greys)
    return [grey - shift for grey in greys]


WALL = [sight.WALL] * sight.COUNT


@pytest.mark.parametrize("ground", [sight.WALL, sight.DIM, sight.BRIGHT])
@pytest.mark.parametrize("distance_mm", [200.0, 300.0, 450.0, 600.0])
@pytest.mark.parametrize("bearing_deg", [-2.0, 0.0, 3.0])
def test_the_ball_is_where_it_is(ground: float, distance_mm: float, bearing_deg: float) -> None:
    ball = sight.find_ball(seen(ball_at(bearing_deg, distance_mm, [ground] * sight.COUNT)))
    assert ball is not None
    assert ball.is_whole
    distance, bearing = ball.where(None)
    assert distance == pytest.approx(distance_mm, rel=0.3)
    assert math.degrees(bearing) == pytest.approx(bearing_deg, abs=1.0)


@pytest.mark.parametrize("grey", [sight.WALL, sight.DIM, sight.BRIGHT])
def test_what_the_exposure_makes_white_is_no_ball(grey: float) -> None:
    assert sight.find_ball(seen([grey] * sight.COUNT, shift=sight.BALL - grey)) is None


@pytest.mark.parametrize("grey", [sight.WALL, sight.DIM, sight.BRIGHT])
def test_the_light_level_undoes_the_exposure(grey: float) -> None:
    scene = [sight.WALL] * 10 + [grey] * 12 + [sight.WALL] * 10
    shift = sight.BALL - grey
    greys = sight.smooth(take(scene, shift=shift - 10.0))
    assert sight.exposure(greys, light(scene)) == pytest.approx(shift - 10.0, abs=8.0)


def test_a_ball_that_fills_the_picture_touches() -> None:
    ball = sight.find_ball(seen([sight.BALL] * sight.COUNT))
    assert ball is not None
    assert ball.where(None) == (sight.TOUCHING_MM, 0.0)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_of_a_ball_at_the_edge_the_distance_is_as_remembered(side: float) -> None:
    ball = sight.find_ball(seen(ball_at(16.0 * side, 200.0, WALL)))
    assert ball is not None
    assert not ball.is_whole
    distance, bearing = ball.where(200.0)
    assert distance == pytest.approx(200.0)
    assert math.degrees(bearing) == pytest.approx(16.0 * side, abs=1.5)


def test_the_light_level_of_another_picture_makes_no_ball() -> None:
    goal = [sight.WALL] * 16 + [sight.BRIGHT] * 16
    assert sight.find_ball([grey + 110.0 for grey in goal]) is None


@pytest.mark.parametrize(("grey", "name"), [(sight.DIM, "dim"), (sight.BRIGHT, "bright")])
def test_posts_are_told_by_their_goal_and_side(grey: float, name: str) -> None:
    scene = [sight.WALL] * 12 + [grey] * 9 + [sight.WALL] * 11
    left, right = sight.find_edges(seen(scene), 0.0)
    assert (left.goal, left.is_left, right.goal, right.is_left) == (name, True, name, False)
    assert left.bearing_rad == pytest.approx(sight.bearing(11.5), abs=0.01)
    assert right.bearing_rad == pytest.approx(sight.bearing(20.5), abs=0.01)


def test_where_the_lens_is_dark_there_is_no_post() -> None:
    scene = [sight.BRIGHT] * sight.COUNT
    assert sight.find_edges(seen(scene, shift=70.0), 70.0) == ()


def test_the_constants_are_those_of_the_camera() -> None:
    match = Match(10)
    match.move_body(match.ball, 900, 100)
    greys = {}
    for name, pose in {"dim": (300, 350, math.pi), "bright": (930, 350, 0), "wall": (400, 200, -math.pi / 2)}.items():
        match.place(2, 600, 600, 0)
        match.place(1, *pose)
        match.run(0.1)
        answer = Khepera(match.port(1)).turret(2, "S")
        high, low = Khepera(match.port(1)).turret(2, "L")
        middle = sight.smooth(answer)[12:20]
        greys[name] = np.mean(middle) - sight.exposure(sight.smooth(answer), 256 * high + low)
    assert greys["wall"] == pytest.approx(sight.WALL, abs=12)
    assert greys["dim"] == pytest.approx(sight.DIM, abs=12)
    assert greys["bright"] == pytest.approx(sight.BRIGHT, abs=12)


# ---- the place -------------------------------------------------------------------------------------------------------


class Wheels:
    """Two counters."""

    def __init__(self) -> None:
        self.at = (0, 0)

    def encoders(self) -> tuple[int, int]:
        return self.at


def test_wheels_lead_round_a_circle_and_back() -> None:
    wheels = Wheels()
    place = Whereabouts(wheels, 10.0, 20.0, 0.5)  # type: ignore[arg-type]
    turn_pulses = math.pi * Whereabouts.BASE_MM / Whereabouts.PULSE_MM
    for step in range(1, 101):
        wheels.at = (round(5000 * step / 100), round((5000 + 2 * turn_pulses) * step / 100))
        place.read_wheels()
    assert (place.x, place.y) == pytest.approx((10.0, 20.0), abs=1.0)
    assert place.heading == pytest.approx(0.5 + 2 * math.pi, abs=0.01)
    assert place.spread[0][0] > 25.0


def test_posts_put_the_heading_right() -> None:
    place = Whereabouts(Wheels(), 0.0, 0.0, 0.1)  # type: ignore[arg-type]
    place.spread[2][2] = 0.02
    for _ in range(40):
        for y in (-150.0, 150.0):
            assert place.see(525.0, y, math.atan2(y, 525.0))
    assert place.heading == pytest.approx(0.0, abs=0.01)
    assert math.hypot(place.x, place.y) < 10.0


def test_what_cannot_be_a_post_changes_nothing() -> None:
    place = Whereabouts(Wheels(), 0.0, 0.0, 0.0)  # type: ignore[arg-type]
    assert not place.see(525.0, 150.0, -0.3)
    assert (place.x, place.y, place.heading) == (0.0, 0.0, 0.0)


def test_a_player_alone_scores_and_knows_where_it_is() -> None:
    match = Match(60, seed=2)
    match.place(2, 1000, 620, 0)
    port = match.port(1)
    port.baudrate = BAUD
    one = Player(Khepera(port))
    with pytest.raises(FullTime):
        play_on(one)
    assert match.report.score()[0] >= 1
    x_mm, y_mm, _ = match.pose(1)
    assert math.hypot(one.place.x + 615 - x_mm, one.place.y + 350 - y_mm) < 80


def play_on(one: Player) -> None:
    while True:
        one.step()


# ---- the referee -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("x_mm", "side"), [(1172.1, "left"), (1171.9, None), (58.1, None), (57.9, "right")])
def test_all_of_the_ball_must_be_behind_the_line(x_mm: float, side: str | None) -> None:
    assert scorer(x_mm, 32.0) == side


def test_after_a_goal_the_ball_falls_near_the_middle_and_robots_stay() -> None:
    told = []
    match = Match(20, seed=5, on_goal=lambda report: told.append(report.score()))
    poses = match.poses()
    match.move_body(match.ball, 1000, 300, speed_mm_s=300)
    match.run(3)
    assert [goal.side for goal in match.report.goals] == ["left"]
    assert told == [(1, 0)]
    ball = match.bodies()[0]
    assert abs(ball["x_mm"] - pitch.MIDDLE_X_MM) <= 40
    assert abs(ball["y_mm"] - pitch.MIDDLE_Y_MM) <= 120
    assert ball["velocity_x"] == 0
    assert np.array_equal(match.poses(), poses)


def test_a_ball_that_lies_still_is_dropped_and_not_onto_a_robot() -> None:
    match = Match(30)
    match.move_body(match.ball, 1080, 150)
    match.place(1, pitch.MIDDLE_X_MM, pitch.MIDDLE_Y_MM, 0)
    match.run(9)
    assert match.report.drops_s == []
    match.run(3)
    assert len(match.report.drops_s) == 1
    ball = match.bodies()[0]
    assert 59.5 < math.hypot(ball["x_mm"] - pitch.MIDDLE_X_MM, ball["y_mm"] - pitch.MIDDLE_Y_MM) < 130


def run_on(match: Match, step_s: float) -> None:
    while True:
        match.run(step_s)


@pytest.mark.parametrize("slice_s", [0.013, 0.1, 7.0])
def test_it_does_not_matter_how_time_is_cut(slice_s: float) -> None:
    def state(step_s: float) -> tuple[str, list[tuple[float, ...]]]:
        match = Match(5.05, seed=1)
        match.move_body(match.ball, 1000, 300, speed_mm_s=300)
        match.port(1).write(b"D,20,18\n")
        with pytest.raises(FullTime):
            run_on(match, step_s)
        assert match.time_s == 5.05
        return match.state_hash(), match.report.trail

    assert state(slice_s) == state(0.25)


def test_a_program_that_ends_leaves_the_other_to_play(tmp_path: Path) -> None:
    (tmp_path / "brief.py").write_text("raise SystemExit(3)")
    said: list[str] = []
    match = Match(8, seed=1)
    play(match, [player(str(tmp_path / "brief.py"), 1, "left"), player(None, 2, "right")], said.append)
    assert said == ["program 1 (brief.py) has ended with exit code 3."]
    assert match.time_s == 8
    assert match.travelled_mm(1) == 0
    assert match.travelled_mm(2) > 100


# ---- what people see -------------------------------------------------------------------------------------------------


def test_the_pitch_is_the_example_arena() -> None:
    example, drawn = Arena.load(ROOT / "examples/arenas/pitch.toml"), pitch.arena()
    assert np.array_equal(example.brightness, drawn.brightness)
    assert np.allclose(np.array(example.starts), np.array(drawn.starts))


def test_the_picture_has_a_row_for_four_goals() -> None:
    match = Match(5)
    without = draw_match(match).size
    match.move_body(match.ball, 1000, 300, speed_mm_s=300)
    match.run(3)
    width, height = draw_match(match).size
    assert (width, height > without[1]) == (without[0], True)


def test_the_command_tells_score_speed_seed_and_state(tmp_path: Path) -> None:
    result = forked.run("demo", "soccer", "--seconds", "20", "--seed", "1", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    *goals, score, state = result.stdout.splitlines()
    assert all(re.fullmatch(r" *\d+\.\d s   \d:\d   (left|right)", line) for line in goals)
    assert re.fullmatch(r"soccer: left \d, right \d   20\.0 s   \d+ x real time   \d dropped balls", score)
    own = HASHES["own"]
    assert state == f"Picture: kiks-soccer.png   Seed 1, state {own}: the same on every computer."
    assert (tmp_path / "kiks-soccer.png").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("soccer", "--left", "none.py"),
            "--left must be a Python file, with its arguments behind it in quotes, but it",
        ),
        (("soccer", "--right", ""), "--right must be a Python file"),
        (("soccer", "--baud", "9600"), "--baud must be left out with soccer, but it was 9600."),
        (("follow", "--left", "x.py"), "--left must be left out with follow, but it was 'x.py'."),
    ],
)
def test_wrong_words_are_explained(words: tuple[str, ...], said: str, tmp_path: Path) -> None:
    result = forked.run("demo", *words, cwd=tmp_path)
    assert result.returncode == 2
    assert said in result.stderr


def test_a_match_takes_some_time() -> None:
    with pytest.raises(ParameterError, match=r"seconds must be a number of at least 0.1, but it was 0. Take 300."):
        Match(0)


if __name__ == "__main__":
    print(hashes())
