"""Baselines of an evolution: the fitness of robots that stand still, and of controllers with random parameters."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from kiks.control.controller import Controller
from kiks.learn.evolution import BASELINE_SEED, TRIAL_SEED, TRIALS
from kiks.learn.generation_loop import seed_for
from kiks.learn.task import Task

RANDOM_COUNT = 40
"""Number of random controllers: as many as the first generation has by default."""


@dataclass(frozen=True)
class Baselines:
    """Fitness in the trial worlds of an evolution.

    Attributes:
        standing: Mean fitness of standing still in all trials.
        random: Median fitness of random controllers, each in one of the trials in turn.
    """

    standing: float
    random: float


def baselines_of(task: Task, seed: int, threads: int | None = None) -> Baselines:
    """Return the baselines of an evolution: the same for the same seed.

    Args:
        task: Its task.
        seed: Its seed.
        threads: Number of threads; the number of cores if left out.
    """
    threads = threads or os.cpu_count() or 1
    trials = np.array([seed_for(seed, TRIAL_SEED, number) for number in range(TRIALS)])
    still = Controller(_stand, senses=task.controller.senses, parameters=1)
    standing = task.with_changes(controller=still).evaluate(np.zeros((TRIALS, 1)), trials, threads)
    rng = np.random.default_rng(seed_for(seed, BASELINE_SEED))
    drawn = task.spread * rng.standard_normal((RANDOM_COUNT, task.parameter_count))
    random = task.evaluate(drawn, np.resize(trials, RANDOM_COUNT), threads)
    return Baselines(float(standing[:, 0].mean()), float(np.median(random[:, 0])))


def _stand(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[0] = wheels[1] = 0.0
