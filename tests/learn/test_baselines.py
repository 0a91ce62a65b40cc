"""Baselines: standing still, and random controllers, in the trials of an evolution."""

from __future__ import annotations

import numpy as np
import pytest
from tests.learn.small import small

import kiks
from kiks.learn.results import RANDOM_COUNT, baselines_of


def test_baselines_follow_from_task_and_seed_alone() -> None:
    one = baselines_of(small(), 3)
    assert one == baselines_of(small(), 3)
    assert one != baselines_of(small(), 4)


def test_a_robot_that_stands_still_does_not_move() -> None:
    def fitness(values):
        return -values["path_mm"].mean(axis=1)

    found = baselines_of(small().with_changes(fitness=fitness), 1)
    assert found.standing == 0.0
    assert found.random < -1.0


@pytest.mark.slow
def test_the_worlds_are_those_of_the_trials() -> None:
    evolution = kiks.Evolution(small(), "ga", seed=3, population=8)
    evolution.tell(np.zeros(len(evolution.ask())))
    trials = evolution.seeds[8:]
    seen = []

    class Task(kiks.Task):
        def evaluate(self, candidates, seeds, threads=None, seconds=None):
            seen.append(seeds)
            return super().evaluate(candidates, seeds, threads, seconds)

    task = small()
    baselines_of(Task(**{name: getattr(task, name) for name in task.__dataclass_fields__}), 3)
    assert seen[0].tolist() == trials.tolist()
    assert set(seen[1].tolist()) == set(trials.tolist())
    assert len(seen[1]) == RANDOM_COUNT
