"""Football: what counts in a game, as a contest and as an environment for two agents."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import forked
from tests.learn.small import ahead

import kiks
from kiks.cli.job import TWO_SIDED
from kiks.learn.football import GOAL_REWARD, ball_ahead, ball_gain, goals, kick_offs
from kiks.learn.tasks import football
from kiks.model import pitch
from kiks.model.arena import Arena, Ball, Pose
from kiks.model.arena_file import save_arena
from kiks.model.package import shipped

pytestmark = pytest.mark.slow

MEASURES = (goals, ball_ahead, ball_gain)


def before_goal(side: int) -> Arena:
    """Return a pitch where a player of a side, 0 or 1, has the ball before it and the other's goal behind that."""
    away, heading = (1.0, 0.0) if side == 0 else (-1.0, np.pi)
    scorer = Pose(pitch.MIDDLE_X_MM + 300.0 * away, pitch.MIDDLE_Y_MM, heading)
    other = Pose(pitch.MIDDLE_X_MM, 150.0, np.pi / 2)
    ball = Ball(pitch.MIDDLE_X_MM + 400.0 * away, pitch.MIDDLE_Y_MM, friction_mm_s2=pitch.FRICTION_MM_S2)
    return replace(pitch.arena(), starts=(scorer, other) if side == 0 else (other, scorer), balls=(ball,))


def values_of(arena: Arena, speeds: tuple[float, float], seconds: float) -> Any:
    """Return the measures of both robots of a world [robot, measure]; the robots drive ahead at these speeds."""
    given = [np.full((1, 2), speed) for speed in speeds]
    batch = kiks.Batch(arena, 1, robots=2, seed=3)
    return batch.run([ahead, ahead], given, seconds=seconds, measures=MEASURES).values[0]


@pytest.mark.parametrize("side", [0, 1])
def test_a_goal_counts_for_the_side_that_attacks_there(side: int) -> None:
    speeds = (20.0, 0.0) if side == 0 else (0.0, 20.0)
    values = values_of(before_goal(side), speeds, 4.0)
    np.testing.assert_array_equal(values[0], -values[1])
    scored, place, gain = values[side]
    assert scored == 1.0
    assert 400.0 / 525.0 < place < 1.0
    way_mm = 100.0 * (gain - GOAL_REWARD)
    assert 125.0 + 32.0 < way_mm < 205.0
    # Earlier goals count more: the ball is in the goal for a larger share of the time.
    assert values_of(before_goal(side), speeds, 8.0)[side, 1] > place


def test_nothing_counts_while_nobody_moves_the_ball_or_there_is_none() -> None:
    for arena in kick_offs():
        np.testing.assert_array_equal(values_of(arena, (0.0, 0.0), 2.0), 0.0)
    np.testing.assert_array_equal(values_of(Arena.box(800, 600), (10.0, -5.0), 1.0), 0.0)


def test_one_side_gains_what_the_other_loses() -> None:
    task = football(seconds=5.0)
    pairs = 2.0 * np.random.default_rng(1).standard_normal((40, task.parameter_count))
    values = task.evaluate(pairs, np.arange(40), 2)
    np.testing.assert_allclose(values[:, 0] + values[:, 4], 0.0, atol=1e-12)
    assert np.abs(values[:, 0]).max() > 0.05
    still = task.with_changes(controller=ahead, against=replace(task.sides[1], controller=ahead))
    stood = still.evaluate(np.zeros((1, 4)), np.zeros(1, np.int64), 1)
    np.testing.assert_array_equal(stood, 0.0)


def test_champions_play_until_a_goal(tmp_path: Path) -> None:
    tasks = [(name, kiks.tasks.load(name)) for name in kiks.tasks.TASKS]
    sides = {name: tuple(side.name for side in task.sides) for name, task in tasks if task.against}
    assert {sides[name] for name in TWO_SIDED} == set(sides.values())  # `kiks run` finds them by their sides
    assert all(shipped(f"examples/demos/supervisors/{name}.py").is_file() for name in TWO_SIDED)
    evolution = kiks.Evolution(football(seconds=1.0), seed=1, population=4, opponents=1, folder=tmp_path / "out")
    evolution.run(generations=1)
    played = forked.run("run", "out", "--seconds", "1", cwd=tmp_path)
    assert (played.returncode, played.stdout) == (0, "")
    goal = Ball(pitch.RIGHT_LINE_MM + 40.0, pitch.MIDDLE_Y_MM, friction_mm_s2=pitch.FRICTION_MM_S2)
    save_arena(replace(before_goal(0), balls=(goal,)), tmp_path / "goal.toml")
    scored = forked.run("run", "out", "--arena", "goal.toml", cwd=tmp_path)
    assert scored.stdout.startswith("left scored after 0."), scored.stderr


def team(**changes: Any) -> Any:
    from kiks.learn.pettingzoo_env import KheperaTeam

    return KheperaTeam("Football", robots=2, **changes)


def test_the_environment_passes_the_checks_of_pettingzoo() -> None:
    from pettingzoo.test import parallel_api_test
    from pettingzoo.test.seed_test import parallel_seed_test

    parallel_api_test(team(), num_cycles=30)
    parallel_seed_test(team, num_cycles=10)


@pytest.mark.parametrize("side", [0, 1])
def test_an_episode_ends_with_a_goal_and_its_reward(side: int) -> None:
    players = team(arenas=before_goal(side), starts="arena")
    players.reset(seed=1)
    speeds, totals = (np.ones(2, np.float32), np.zeros(2, np.float32)), np.zeros(2)
    while players.agents:
        actions = dict(zip(players.agents, speeds if side == 0 else speeds[::-1], strict=True))
        _, rewards, terminations, truncations, infos = players.step(actions)
        totals += list(rewards.values())
    assert all(terminations.values())
    assert not any(truncations.values())
    assert infos["robot_1"]["time_s"] < 5.0
    assert totals[side] == pytest.approx(-totals[1 - side])
    assert GOAL_REWARD + 1.5 < totals[side] < GOAL_REWARD + 2.5


def test_random_players_gain_nothing() -> None:
    """Where the ball is counts, not how it came there: the return of an episode is at most what one push gives."""
    players, rng, returns = team(max_cycles=100), np.random.default_rng(1), []
    for seed in range(8):
        players.reset(seed=seed)
        total = np.zeros(2)
        while players.agents:
            actions = {agent: rng.uniform(-1, 1, 2).astype(np.float32) for agent in players.agents}
            total += list(players.step(actions)[1].values())
        assert total.sum() == pytest.approx(0.0, abs=1e-9)
        returns.append(total[0])
    assert abs(float(np.mean(returns))) < 1.0
