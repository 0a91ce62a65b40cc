"""Baselines of an evolution: the fitness of robots that stand still, and of controllers with random parameters."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from kiks.control.controller import Controller
from kiks.learn import seeds
from kiks.learn.evolution_log import TRIALS
from kiks.learn.seeds import seed_for
from kiks.learn.task import Task
from kiks.model.data_file import Number, record

RANDOM_COUNT = 40
"""Number of random controllers: as many as the first generation has by default."""


@record
class Baselines:
    """Fitness in the trial worlds of an evolution.

    Attributes:
        standing: Mean fitness of standing still in all trials.
        random: Median fitness of random controllers, each in one of the trials in turn.
    """

    standing: Number
    random: Number


def baselines_of(task: Task, seed: int, threads: int | None = None) -> Baselines:
    """Return the baselines of an evolution: the same for the same seed.

    Args:
        task: Its task.
        seed: Its seed.
        threads: Number of threads; the number of cores if left out.
    """
    threads = threads or os.cpu_count() or 1
    trials = np.array([seed_for(seed, seeds.TRIALS, number) for number in range(TRIALS)])
    still = Controller(_stand, senses=task.controller.senses, parameters=1)
    standing = task.with_changes(controller=still).evaluate(np.zeros((TRIALS, 1)), trials, threads)
    rng = np.random.default_rng(seed_for(seed, seeds.BASELINES))
    drawn = task.spread * rng.standard_normal((RANDOM_COUNT, task.parameter_count))
    random = task.evaluate(drawn, np.resize(trials, RANDOM_COUNT), threads)
    return Baselines(float(standing[:, 0].mean()), float(np.median(random[:, 0])))


def _stand(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[0] = wheels[1] = 0.0
