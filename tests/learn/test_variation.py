"""Robots and links that vary within the worlds of a candidate."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import kiks
from kiks.model.family import family

KHEPERA = kiks.RobotSpec.load("khepera")
TIMINGS = (kiks.Timing(), kiks.Timing(0.05, 38400), kiks.Timing(think_s=0.02))


def task_of(**changes: Any) -> kiks.Task:
    def first(values: Any) -> Any:
        return values["path_mm"][:, 0]

    return kiks.tasks.avoid(**{"seconds": 1.0, "worlds": 12, "fitness": first} | changes)


def values_of(task: kiks.Task, seeds: tuple[int, ...] = (5,)) -> np.ndarray:
    parameters = np.linspace(-3, 3, 18)[None].repeat(len(seeds), axis=0)
    return task.evaluate(parameters, np.array(seeds), 1)


def test_a_list_of_one_is_that_robot_and_that_timing() -> None:
    alone = values_of(task_of())
    for changes in ({"robot": KHEPERA}, {"robot": ["khepera"]}, {"timing": [task_of().timing]}):
        task = task_of(**changes)
        assert (values_of(task) == alone).all()
        assert task.digest() == task_of().digest()


@pytest.mark.parametrize(("kinds", "timings"), [(3, 1), (1, 3), (3, 3), (2, 3), (4, 2)])
@pytest.mark.parametrize("arenas", [1, 2, 3])
def test_worlds_take_all_combinations_in_turn(kinds: int, timings: int, arenas: int) -> None:
    base = kiks.tasks.avoid()
    task = base.with_changes(
        arenas=base.arenas[:arenas],
        robot=family(KHEPERA, kinds, seed=1),
        timing=TIMINGS[:timings],
        worlds=arenas * kinds * timings,
    )
    for seed in (0, 2**62 - 1):
        turns, timing = task._turns(np.array([seed]))
        kind = turns % kinds
        arena = np.arange(task.worlds) % arenas
        found = set(zip(arena.tolist(), kind.tolist(), timing.tolist(), strict=True))
        assert len(found) == arenas * kinds * timings


def test_a_world_is_what_a_task_of_its_robot_and_timing_alone_would_have() -> None:
    robots = family(KHEPERA, 2, seed=3)
    task = task_of(robot=robots, timing=TIMINGS)
    turns, timings = task._turns(np.array([7]))
    for world in range(task.worlds):
        one = lambda values, world=world: values["path_mm"][:, world]  # noqa: E731
        alone = task_of(robot=robots[turns[world] % 2], timing=TIMINGS[timings[world]], fitness=one)
        assert values_of(task.with_changes(fitness=one), (7,))[0, 0] == values_of(alone, (7,))[0, 0]


def test_values_do_not_depend_on_other_candidates() -> None:
    task = task_of(robot=family(KHEPERA, 4, seed=3), timing=TIMINGS)
    together = values_of(task, (1, 2, 9))
    for number, seed in enumerate((1, 2, 9)):
        assert (values_of(task, (seed,))[0] == together[number]).all()


def test_the_digest_depends_on_robots_and_timings() -> None:
    tasks = [
        task_of(),
        task_of(robot="khepera_ii"),
        task_of(robot=family(KHEPERA, 2, seed=1)),
        task_of(robot=family(KHEPERA, 2, seed=2)),
        task_of(timing=TIMINGS),
        task_of(timing=TIMINGS[1]),
    ]
    assert len({tuple(task.digest().items()) for task in tasks}) == len(tasks)


@pytest.mark.parametrize(
    "changes", [{"robot": []}, {"robot": 3}, {"robot": ["khepera", 3]}, {"timing": []}, {"timing": "fast"}]
)
def test_wrong_lists_are_errors(changes: dict[str, Any]) -> None:
    (name,) = changes
    with pytest.raises(kiks.ParameterError, match=f"^{name}.* must be .* or a list of them, but it was"):
        task_of(**changes)


@pytest.mark.slow
def test_champions_of_a_family_drive_its_first_robot(tmp_path: Any) -> None:
    robots = family(KHEPERA, 3, seed=3)
    evolution = kiks.Evolution(task_of(robot=robots, timing=TIMINGS), "ga", population=8, folder=tmp_path)
    evolution.run(generations=2)
    champion = kiks.Champion.load(tmp_path / "champion.toml")
    assert (champion.robot, champion.timing) == (robots[0], TIMINGS[0])
