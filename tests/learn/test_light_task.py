"""The task `light`: standing still earns nothing, and its exam begins far from the lamp, in the dark."""

from __future__ import annotations

import math

import numpy as np

import kiks
from kiks.learn import ready_tasks
from kiks.model.shipped import shipped_arena


def test_standing_still_earns_nothing() -> None:
    task = kiks.tasks.light(seconds=1.0)
    still = np.zeros((20, task.parameter_count))
    assert not task.evaluate(still, np.arange(20), threads=1)[:, 0].any()


def test_the_exam_starts_far_from_the_lamp_where_no_sensor_sees_it() -> None:
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


def test_a_start_is_solved_by_staying_at_the_lamp_for_the_last_half_minute() -> None:
    stays_s = np.array([0.0, 29.9, 30.0, 170.0])
    names = [each.name for each in ready_tasks.light().exam.measures]
    assert names == ["light_stay_s"]
    np.testing.assert_array_equal(ready_tasks.light_solved({"light_stay_s": stays_s}), [False, False, True, True])
