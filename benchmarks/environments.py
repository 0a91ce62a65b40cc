"""Steps a second of the vector environment `kiks/Avoid-v0` with random actions, by worlds and threads.

Run: python benchmarks/environments.py [--json]. A step is 0.1 s of one world: a loop of a program on a line of 9600
baud, ten ticks and a full reading with noise, its reward, and what Gymnasium is told of it. Actions are drawn before
the clock starts; worlds that reach their 600th step begin anew.

`environments.steps_per_s_N_T` is the median of N worlds on T threads; the sizes take turns.
`environments.batch_share_N_T` is how much of that time the batch itself took: the rest is the environment.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

import kiks.learn.gymnasium_envs  # noqa: F401  (registers them)
from calibration import report

COUNTS, THREADS = (1, 100, 1000, 10_000), (1, 2)
STEPS = 20_000
"""World-steps of a measurement, ten steps of all worlds at least."""

ROUNDS = 5


def seconds_of(step: Callable[[Any], Any], actions: np.ndarray, step_count: int) -> float:
    """Return what a step of all worlds takes [s]."""
    start_s = time.perf_counter()
    for k in range(step_count):
        step(actions[k % len(actions)])
    return (time.perf_counter() - start_s) / step_count


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--json", action="store_true")
    as_json = options.parse_args().json
    sizes = [(count, threads) for count in COUNTS for threads in THREADS if count > 1 or threads == 1]
    made = {}
    for count, threads in sizes:
        envs = gymnasium.make_vec("kiks/Avoid-v0", num_envs=count, threads=threads)
        envs.reset(seed=1)
        made[count, threads] = envs
    rates: dict[Any, list[float]] = {size: [] for size in sizes}
    shares: dict[Any, list[float]] = {size: [] for size in sizes}
    rng = np.random.default_rng(1)
    for _ in range(ROUNDS):
        for (count, threads), envs in made.items():
            actions = rng.uniform(-1, 1, (10, count, 2)).astype(np.float32)
            step_count = max(STEPS // count, 10)
            whole_s = seconds_of(envs.step, actions, step_count)
            batch_s = seconds_of(envs.unwrapped.episodes.batch.step, 10.0 * actions[:, :, None], step_count)
            rates[count, threads].append(count / whole_s)
            shares[count, threads].append(batch_s / whole_s)
    rows = []
    for count, threads in sizes:
        of = f"{count}_{threads}"
        rows.append((f"environments.steps_per_s_{of}", statistics.median(rates[count, threads]), "1/s"))
        rows.append((f"environments.batch_share_{of}", statistics.median(shares[count, threads]), ""))
    report(rows, as_json=as_json)


if __name__ == "__main__":
    main()
