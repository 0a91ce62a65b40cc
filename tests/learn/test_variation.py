"""Robots, links and arenas that vary within the worlds of a candidate, or from one generation to the next."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from tests.learn.small import refused, small

import kiks
from kiks.model.arena import Pose
from kiks.model.family import family

KHEPERA = kiks.RobotSpec.load("khepera")
TIMINGS = (kiks.Timing(), kiks.Timing(0.05, 38400), kiks.Timing(think_s=0.02))


def task_of(**changes: Any) -> kiks.Task:
    return small(**{"worlds": 12, "fitness": lambda values: values["path_mm"][:, 0]} | changes)


def values_of(task: kiks.Task, seeds: tuple[int, ...] = (5,)) -> np.ndarray:
    parameters = np.linspace(-3, 3, 18)[None].repeat(len(seeds), axis=0)
    return task.evaluate(parameters, np.array(seeds), 1)


def test_a_list_of_one_is_that_robot_and_that_timing_and_wrong_lists_are_errors() -> None:
    alone = values_of(task_of())
    for changes in ({"robot": KHEPERA}, {"robot": ["khepera"]}, {"timing": [task_of().timing]}):
        task = task_of(**changes)
        assert (values_of(task) == alone).all()
        assert task.digest() == task_of().digest()
    for changes in ({"robot": []}, {"robot": 3}, {"robot": ["khepera", 3]}, {"timing": []}, {"timing": "fast"}):
        (name,) = changes
        refused(f"^{name}.* must be .* or a list of them, but it was", task_of, **changes)


def test_worlds_take_all_combinations_in_turn() -> None:
    base = kiks.tasks.avoid()
    for arenas, (kinds, timings) in product((1, 2, 3), ((3, 1), (1, 3), (3, 3), (2, 3), (4, 2))):
        varied = {"robot": family(KHEPERA, kinds, seed=1), "timing": TIMINGS[:timings]}
        task = base.with_changes(arenas=base.arenas[:arenas], worlds=arenas * kinds * timings, **varied)
        for seed in (0, 2**62 - 1):
            turns, timing = task._turns(np.array([seed]))
            found = {*zip(np.arange(task.worlds) % arenas, turns % kinds, timing, strict=True)}
            assert len(found) == arenas * kinds * timings


def test_a_world_is_what_a_task_of_its_robot_and_timing_alone_would_have() -> None:
    robots = family(KHEPERA, 2, seed=3)
    task = task_of(robot=robots, timing=TIMINGS)
    turns, timings = task._turns(np.array([7]))
    for world in range(task.worlds):
        one = lambda values, world=world: values["path_mm"][:, world]  # noqa: E731
        alone = task_of(robot=robots[turns[world] % 2], timing=TIMINGS[timings[world]], fitness=one)
        assert values_of(task.with_changes(fitness=one), (7,))[0, 0] == values_of(alone, (7,))[0, 0]


def many(count: int) -> list[kiks.Arena]:
    return [kiks.Arena.box(300 + 50 * number, 400) for number in range(count)]


def test_what_is_no_seed_is_refused() -> None:
    task = task_of(arenas=many(3), worlds=2)
    for seed in ("x", -1, 1.5, None, 2**63):
        with pytest.raises(kiks.ParameterError, match="seed must be a whole number from 0 to"):
            task.arenas_of(seed)  # type: ignore[arg-type]
        with pytest.raises(kiks.ParameterError, match="seeds must be whole numbers from 0"):
            task.start_poses([seed])  # type: ignore[arg-type]
    assert task.start_poses(np.array([], np.int64)).shape == (0, 1, 3)


def test_each_generation_draws_others_of_many_arenas() -> None:
    arenas = many(7)
    task = task_of(arenas=arenas, worlds=3, robot=family(KHEPERA, 4, seed=3), timing=TIMINGS)
    drawn = [task.arenas_of(seed) for seed in range(40)]
    assert drawn == [task.arenas_of(seed) for seed in range(40)]
    assert all(len(set(each)) == 3 for each in drawn)
    assert {arena for each in drawn for arena in each} == set(arenas)
    together, parameters = values_of(task, tuple(range(5))), np.linspace(-3, 3, 18)
    turns_of, timings_of = (each.reshape(5, 3) for each in task._turns(np.arange(5)))
    for seed, (turns, timings) in enumerate(zip(turns_of, timings_of, strict=True)):
        assert (values_of(task, (seed,))[0] == together[seed]).all()
        starts, paths = task.start_poses(np.array([seed])), []
        for world, arena in enumerate(task.arenas_of(seed)):
            kind, timing = family(KHEPERA, 4, seed=3)[turns[world] % 4], TIMINGS[timings[world]]
            batch = kiks.Batch(arena, 1, robot=[kind], starts=starts[world], seed=seed + world, timing=timing)
            rollouts = batch.run(task.controller, parameters, seconds=1.0, measures=[kiks.measures.path_mm])
            paths.append(rollouts.values.item())
        assert together[seed][task.value_names.index("path_mm")] == pytest.approx(np.mean(paths), rel=1e-12)


def test_where_arenas_are_drawn_a_lone_robot_draws_its_start_too() -> None:
    places = [[Pose(60.0 + 10.0 * k, 100.0 + number, 0.1 * k) for k in range(4)] for number in range(5)]
    arenas = [replace(arena, starts=tuple(own)) for arena, own in zip(many(5), places, strict=True)]
    task, seen = task_of(arenas=arenas, worlds=3, starts="arena"), set()
    for seed in range(40):
        starts = task.start_poses(np.array([seed, 7, seed]))
        assert starts.shape == (9, 1, 3)
        assert (starts[:3] == starts[6:]).all()
        for arena, start in zip(task.arenas_of(seed), starts[:3, 0].tolist(), strict=True):
            assert tuple(start) in arena.starts
            seen.add(tuple(start))
    assert seen == {tuple(pose) for own in places for pose in own}
    assert task_of(arenas=arenas[:3], worlds=3, starts="arena").start_poses(np.array([1])) is None
    assert task_of(arenas=arenas, worlds=3, robots=2, starts="arena").start_poses(np.array([1])) is None


def test_many_arenas_need_no_multiple_of_worlds_and_the_digest_depends_on_them_robots_and_timings() -> None:
    task = task_of(arenas=many(7), worlds=6, exam=None)
    assert task.project().arena.width_mm in {arena.width_mm for arena in task.arenas_of(0)}
    refused("worlds must be a multiple of the number of arenas, 5, but it was 6", task_of, arenas=many(5), worlds=6)
    assert task.digest() != task_of(arenas=many(8), worlds=6).digest()
    robots = ["khepera_ii", *(family(KHEPERA, 2, seed=seed) for seed in (1, 2))]
    changed = [{"robot": robot} for robot in robots] + [{"timing": timing} for timing in (TIMINGS, TIMINGS[1])]
    tasks = [task_of(), *(task_of(**changes) for changes in changed)]
    assert len({tuple(task.digest().items()) for task in tasks}) == len(tasks)


def test_an_evolution_in_many_arenas_resumes(tmp_path: Any) -> None:
    task = task_of(arenas=many(7), worlds=2)
    whole = kiks.Evolution(task, "ga", seed=4, population=6)
    whole.run(generations=3)
    kiks.Evolution(task, "ga", seed=4, population=6, folder=tmp_path).run(generations=2)
    again = kiks.Evolution(task, "ga", seed=4, population=6, folder=tmp_path)
    again.run(generations=3)
    assert again.champion.parameters == whole.champion.parameters
    refused("arenas", kiks.Evolution, task_of(arenas=many(8), worlds=2), "ga", seed=4, population=6, folder=tmp_path)


@pytest.mark.slow
def test_champions_of_a_family_drive_its_first_robot(tmp_path: Any) -> None:
    robots = family(KHEPERA, 3, seed=3)
    evolution = kiks.Evolution(task_of(robot=robots, timing=TIMINGS), "ga", population=8, folder=tmp_path)
    evolution.run(generations=2)
    champion = kiks.Champion.load(tmp_path / "champion.toml")
    assert (champion.robot, champion.timing) == (robots[0], TIMINGS[0])
