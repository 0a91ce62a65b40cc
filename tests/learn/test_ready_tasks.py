"""Tasks that come with KiKS: what their fitness and their exams are for."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases
from tests.learn.small import forget_arenas

import kiks
from kiks.learn import ready_tasks
from kiks.learn.algorithm_name import AlgorithmName, parse_algorithm
from kiks.learn.experiment import cautious_mean
from kiks.model.shipped import shipped_arena

ELSEWHERE = ("floreano_mondada_1994", "floreano_nolfi_1997", "floreano_mondada_1996")
"""Tasks that tests of their own evaluate, in `tests/demos`."""

READY = [*(name for name in kiks.tasks.TASKS if name not in ELSEWHERE), *ELSEWHERE]


@pytest.fixture
def _forgotten() -> Iterator[None]:
    yield
    forget_arenas()


@pytest.mark.slow
@pytest.mark.usefixtures("_forgotten")
@pytest.mark.parametrize("name", cases(READY, len(READY) - len(ELSEWHERE)))
def test_a_ready_task_can_be_evaluated_and_neither_standing_still_nor_chance_passes_its_exam(name: str) -> None:
    task = kiks.tasks.load(name)
    assert parse_algorithm(task.algorithm)[0] in list(AlgorithmName)
    quick = task.with_changes(seconds=0.5)
    values = quick.evaluate(np.zeros((2, task.parameter_count)), np.array([5, 5]), 1)
    assert values.shape == (2, len(task.value_names))
    assert np.isfinite(values).all()
    assert (values[0] == values[1]).all()
    if task.exam is None:
        return
    trained = [(each.brightness.tobytes(), each.cylinders) for each in task.arenas]
    seen = [(each.brightness.tobytes(), each.cylinders) in trained for each in task.exam.arenas]
    assert any(seen) == name.startswith("maze")
    exam = replace(task.exam, worlds=len(task.exam.arenas))
    rng = np.random.default_rng(1)
    for scale in (0.0, 1.0, 3.0):
        parameters = (scale * rng.standard_normal(task.parameter_count)).tolist()
        champion = kiks.Champion(task.controller, parameters, timing=task.timing)
        assert not exam.examine(champion, robots=task.robots).solved.all()


def test_cautious_mean_weights_the_worse_half() -> None:
    scores = np.array([[1.0, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 0.0]])
    assert cautious_mean(scores, 0.0).tolist() == [1.0, 0.75]
    assert cautious_mean(scores, 1.0).tolist() == [1.0, 0.5]


def test_standing_still_earns_nothing() -> None:
    task = kiks.tasks.light(seconds=1.0)
    still = np.zeros((20, task.parameter_count))
    assert not task.evaluate(still, np.arange(20), threads=1)[:, 0].any()


def test_light_trains_from_starts_behind_walls_and_far_from_the_lamp() -> None:
    for arena in kiks.tasks.light().arenas:
        lamp = arena.lamps[0]
        assert arena.starts
        assert all(math.dist(start[:2], (lamp.x_mm, lamp.y_mm)) >= ready_tasks.FROM_LIGHT_MM for start in arena.starts)
        x_mm, y_mm, _ = arena.starts[-1]
        ray_mm = np.linspace((x_mm, y_mm), (lamp.x_mm, lamp.y_mm), 2000).tolist()
        assert any(arena.clearance_at_mm(*place) <= 0 for place in ray_mm)


def test_the_exam_starts_where_no_sensor_sees_the_lamp_and_is_solved_by_staying_at_it_for_half_a_minute() -> None:
    arena = shipped_arena("training/lit_unseen")
    lamp = arena.lamps[0]
    assert len(set(arena.starts)) == 20
    sim = kiks.Simulation(arena)
    dark_counts = kiks.RobotSpec.load("khepera").ambient.dark_counts
    for start in arena.starts:
        assert math.dist((start.x_mm, start.y_mm), (lamp.x_mm, lamp.y_mm)) >= 1000.0
        for heading_rad in np.arange(8) * math.pi / 4:
            sim.place(1, start.x_mm, start.y_mm, heading_rad)
            assert set(sim.ambient(1)) == {dark_counts}
    exam = ready_tasks.light().exam
    assert [each.name for each in exam.measures] == ["light_stay_s"]
    solved = exam.solved_in(np.array([[0.0], [29.9], [30.0], [170.0]]))
    assert solved.tolist() == [False, False, True, True]


def test_the_fitness_of_the_maze_puts_the_goal_before_thrift_and_thrift_before_nothing() -> None:
    task = kiks.tasks.maze()
    near, far = {"closest_mm": 40.0}, {"closest_mm": 101.0}
    cheap, dear = {"turned_pulses": 1e3}, {"turned_pulses": 3e5}

    def arrays(*given: dict[str, float]) -> dict[str, Any]:
        return {name: np.array([[value]]) for each in given for name, value in each.items()}

    order = [task.fitness(arrays(*each))[0] for each in ((near, cheap), (near, dear), (far, cheap))]
    assert order == sorted(order, reverse=True)
    assert order[1] > order[2] + 1


def test_the_camera_tells_a_cylinder_from_a_wall_where_proximity_tells_nothing() -> None:
    shipped = shipped_arena("training/cylinders_0")
    room = replace(shipped, cylinders=shipped.cylinders[:1])
    cylinder = room.cylinders[0]
    poses = [(cylinder.x_mm - 150.0, cylinder.y_mm, 0.0), (200.0, 250.0, math.pi)]
    given = {"senses": ("proximity", "camera"), "timing": kiks.tasks.gather().timings[0]}
    batch = kiks.Batch(room, 2, seed=1, starts=np.array(poses)[:, None], **given)
    batch.reset()
    for _ in range(5):
        counts = batch.step(np.zeros((2, 1, 2)))
    at_cylinder, at_wall = counts[:, 0]
    assert at_cylinder[:8].max() < 30
    assert at_wall[:8].max() < 30
    middle, edges = slice(14, 18), [8, 9, 22, 23]
    assert at_cylinder[middle].min() > at_cylinder[edges].max() + 80
    assert at_wall[middle].min() < at_wall[edges].max() + 80
