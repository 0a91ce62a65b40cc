"""Rewards of the environments are for robots that do what is wanted."""

import importlib.util
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.at_length import share

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


def vector(task: Any, count: int, **options: Any) -> Any:
    from kiks.learn.gymnasium_envs import KheperaVectorEnv

    return KheperaVectorEnv(count, task, threads=1, **options)


def stand_still(seen: np.ndarray) -> np.ndarray:
    return np.zeros((len(seen), 2), np.float32)


def spin(seen: np.ndarray) -> np.ndarray:
    return np.tile(np.array([1, -1], np.float32), (len(seen), 1))


def shuttle() -> Any:
    steps = itertools.count()
    return lambda seen: np.full((len(seen), 2), 1 if next(steps) // 20 % 2 else -1, np.float32)


def act_at_random() -> Any:
    rng = np.random.default_rng(5)
    return lambda seen: rng.uniform(-1, 1, (len(seen), 2)).astype(np.float32)


def wheels(ahead: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return actions of driving ahead and turning right at the same time, [world, 2]."""
    return np.clip(np.stack([ahead + right, ahead - right], axis=1), -1, 1).astype(np.float32)


def follow_the_wall(seen: np.ndarray) -> np.ndarray:
    """Keep the wall on the left at a distance, and turn right before what is in front."""
    left, front = 2.6 * seen[:, 0], 3.4 * seen[:, 1:4].max(axis=1)
    return wheels(np.full(len(seen), 0.6), 1.2 * np.clip(front, 0, 2) + 0.5 * (np.clip(left, 0, 1.5) - 0.6))


def seek_the_light(seen: np.ndarray) -> np.ndarray:
    """Turn to the brighter side and away from what is near; stop where it is bright."""
    near, light = seen[:, :8], np.clip(1 - 1023 * seen[:, 8:] / 500, 0, 1)
    brighter_right = light[:, 3:6].sum(axis=1) - light[:, :3].sum(axis=1)
    brighter_right += light[:, 6:].sum(axis=1) * np.sign(brighter_right - 1e-9) / 1.5
    away = np.sign(near[:, :3].sum(axis=1) - near[:, 3:6].sum(axis=1) + 1e-3)
    block = 2 * near[:, 2:4].sum(axis=1) + near[:, 1] + near[:, 4]
    ahead = np.where(light.max(axis=1) > 0.93, 0.0, 0.8 - 0.5 * np.clip(block, 0, 1))
    return wheels(ahead, 1.5 * brighter_right + away * np.clip(2.5 * block, 0, 2))


@pytest.mark.parametrize(
    ("name", "good", "least", "useless_max"),
    [
        ("Avoid", follow_the_wall, 20.0, 2.0),
        ("Follow", follow_the_wall, 200.0, 20.0),
        ("Light", seek_the_light, 250.0, 60.0),
        ("Maze", follow_the_wall, 5.0, 2.0),
    ],
)
def test_rewards_are_for_those_that_do_what_is_wanted(name: str, good: Any, least: float, useless_max: float) -> None:
    count = share(8, 24)

    def mean_return(policy: Any) -> float:
        envs = vector(name, count)
        seen, _ = envs.reset(seed=1)
        returns, is_over = np.zeros(count), np.zeros(count, np.bool_)
        for _ in range(600):
            seen, rewards, terminations, truncations, _ = envs.step(policy(seen))
            returns += np.where(is_over, 0.0, rewards)
            is_over |= terminations | truncations
        return float(returns.mean())

    assert mean_return(good) > least
    assert mean_return(stand_still) == pytest.approx(0.0, abs=1e-9)
    for useless in (spin, act_at_random(), shuttle()):
        assert mean_return(useless) < useless_max


@pytest.fixture(scope="module")
def pgpe() -> Any:
    """Return the example that learns, with short episodes and contacts that cost nothing."""
    path = ROOT / "examples/learning/pgpe.py"
    spec = importlib.util.spec_from_file_location("pgpe", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    vars(module).update(EPISODE_S=15.0, STARTS_PER_ARENA=1, CONTACT_COST=0.0)
    return module


def test_a_tiny_training_improves_the_reward(pgpe: Any) -> None:
    champion = pgpe.learn("Avoid", seed=1, generations=12, pairs=24)
    weights = np.array(champion.parameters[2:]).reshape(pgpe.INPUTS, 2)
    envs = vector("Avoid", 12, reward=pgpe.REWARDS["Avoid"])
    before, after = (
        pgpe.returns_of(envs, np.tile(each, (12, 1, 1)), list(range(12)), champion.parameters[1]).mean()
        for each in (0 * weights, weights)
    )
    assert before == 0.0
    assert after > 1.0


def test_a_poor_attempt_is_followed_by_another(pgpe: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.setattr(pgpe, "EPISODE_S", 1.0)
    pgpe.learn("Follow", seed=1, generations=2, pairs=2)
    # No policy follows walls after two generations, so each attempt but the last one ends after half of them.
    assert capsys.readouterr().out.count("begin again") == pgpe.ATTEMPTS["Follow"] - 1


@pytest.mark.parametrize("name", ["Avoid", "Follow"])
def test_the_policy_that_learns_is_the_one_that_drives(pgpe: Any, name: str) -> None:
    rng, used = np.random.default_rng(3), pgpe.USED[name]
    weights, share = rng.normal(size=(5, used, 2)), 0.06
    act, memory, wheels = pgpe.acting(weights, share), np.zeros((5, pgpe.tracing.memory_count)), np.zeros((5, 2))
    for _ in range(20):
        counts = rng.integers(0, 1024, (5, 8)).astype(float)
        actions = act(counts / 1023)
        for world in range(5):
            parameters = np.array([8.0, share, *weights[world].ravel(), *[0.0] * (2 * (pgpe.INPUTS - used))])
            pgpe.tracing(counts[world], memory[world], parameters, wheels[world])
        np.testing.assert_allclose(wheels / 8.0, actions, rtol=0, atol=1e-12)
        assert actions.std() > 0.1
