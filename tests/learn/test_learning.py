"""Rewards of the environments are for robots that do what is wanted."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import kiks
import kiks.learn.gymnasium_envs  # registers the environments

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


def stand_still(seen: np.ndarray) -> np.ndarray:
    return np.zeros((len(seen), 2), np.float32)


def spin(seen: np.ndarray) -> np.ndarray:
    return np.tile(np.array([1, -1], np.float32), (len(seen), 1))


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
    ("name", "good", "return_min", "useless_max"),
    [
        ("kiks/Avoid-v0", follow_the_wall, 150.0, 40.0),
        ("kiks/Follow-v0", follow_the_wall, 200.0, 20.0),
        ("kiks/Light-v0", seek_the_light, 250.0, 25.0),
        ("kiks/Maze-v0", follow_the_wall, 5.0, 0.5),
    ],
)
def test_rewards_are_for_those_that_do_what_is_wanted(
    name: str, good: Any, return_min: float, useless_max: float
) -> None:
    def mean_return(policy: Any) -> float:
        envs: Any = gymnasium.make_vec(name, num_envs=24, autoreset_mode="SameStep", threads=1)
        seen, _ = envs.reset(seed=1)
        returns, is_over = np.zeros(24), np.zeros(24, np.bool_)
        for _ in range(600):
            seen, rewards, terminations, truncations, _ = envs.step(policy(seen))
            returns += np.where(is_over, 0.0, rewards)
            is_over |= terminations | truncations
        return float(returns.mean())

    assert mean_return(good) > return_min
    assert mean_return(stand_still) == pytest.approx(0.0, abs=1e-9)
    for useless in (spin, act_at_random()):
        assert mean_return(useless) < useless_max


@pytest.mark.skipif(
    importlib.util.find_spec("stable_baselines3") is None, reason="Stable-Baselines3, with PyTorch, is not installed"
)
def test_the_ppo_example_runs(tmp_path: Path) -> None:
    program = [sys.executable, str(ROOT / "examples/learning/ppo_avoid.py"), "--steps", "4096"]
    output = subprocess.run(program, capture_output=True, text=True, check=True, cwd=tmp_path).stdout
    assert [line.split(":")[0] for line in output.splitlines()] == ["before", "after", "on the wire"]
    assert kiks.Champion.load(tmp_path / "ppo_avoid.toml").algorithm == "PPO"
