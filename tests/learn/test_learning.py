"""Learning algorithms raise the reward in the environments."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

import kiks.learn.gymnasium_envs  # noqa: F401  (registers the environments)

ROOT = Path(__file__).parents[2]


def returns_of(envs: Any, weights: np.ndarray, steps: int) -> np.ndarray:
    """Return the reward of an episode for the linear policy of each world, float64 [world, sensor + 1, wheel]."""
    seen, _ = envs.reset(seed=1)
    total = np.zeros(envs.num_envs)
    for _ in range(steps):
        inputs = np.concatenate([seen, np.ones((envs.num_envs, 1))], axis=1)
        actions = np.tanh(np.einsum("wi,wio->wo", inputs, weights)).astype(np.float32)
        seen, rewards, *_ = envs.step(actions)
        total += rewards
    return total


@pytest.mark.slow
@pytest.mark.parametrize(("name", "gain_min"), [("kiks/Avoid-v0", 0.3), ("kiks/FollowWall-v0", 0.1)])
def test_the_cross_entropy_method_learns(name: str, gain_min: float) -> None:
    worlds, steps = 64, 150
    envs = gymnasium.make_vec(name, num_envs=worlds)
    rng = np.random.default_rng(1)
    mean, deviation = np.zeros((9, 2)), np.full((9, 2), 2.0)
    best = []
    for _ in range(12):
        weights = mean + deviation * rng.standard_normal((worlds, 9, 2))
        returns = returns_of(envs, weights, steps)
        elite = weights[np.argsort(returns)[-12:]]
        mean, deviation = elite.mean(axis=0), elite.std(axis=0) + 0.05
        best.append(returns.mean() / steps)
    assert best[-1] > best[0] + gain_min, best


@pytest.mark.slow
@pytest.mark.skipif(
    importlib.util.find_spec("stable_baselines3") is None, reason="Stable-Baselines3, with PyTorch, is not installed"
)
def test_the_ppo_example_runs(tmp_path: Path) -> None:
    program = [sys.executable, str(ROOT / "examples/learning/ppo_avoid.py"), "--steps", "4096"]
    output = subprocess.run(program, capture_output=True, text=True, check=True, cwd=tmp_path).stdout
    assert [line.split(":")[0] for line in output.splitlines()] == ["before", "after", "on the wire"]
    assert (tmp_path / "ppo_avoid.npy").is_file()
