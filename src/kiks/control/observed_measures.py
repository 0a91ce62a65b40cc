"""What measures say of a robot that is looked at from outside, by one kernel: for pages, which have no Python.

A judge (`kiks.sim.judge`) calls the measures that its goal names; `look_at` lets all look that have no arguments. Their
values are the first note or `measures.mean`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.control import measures, senses
from kiks.control.measure import Measure, moment_of
from kiks.control.turret_parts import view_of
from kiks.engine.compiling import entry, kernel
from kiks.engine.physics.contact import clearance_mm
from kiks.engine.scene import open_scene
from kiks.engine.sensing.proximity import lone_pose_at
from kiks.engine.simd.stack_arrays import stack_floats
from kiks.model.robot import SENSOR_COUNT
from kiks.units import NS_PER_S

LOOKED_AT: tuple[Measure, ...] = tuple(
    made for name in measures.__all__ if isinstance(made := getattr(measures, name), Measure)
)
"""The measures without arguments."""

NOTE_COUNT = max(each.note_count for each in LOOKED_AT)

_HAS_MEAN = np.array([each.result is measures.mean for each in LOOKED_AT])
_sense_proximity, _sense_ambient = senses.proximity.kernel, senses.ambient.kernel


def _together(kernels: tuple[Any, ...]) -> Any:
    """Return a kernel that calls some, each with a row of the notes."""
    if not kernels:
        return kernel(lambda moment, notes: None)
    row, last, before = len(kernels) - 1, kernels[-1], _together(kernels[:-1])

    @kernel
    def look(moment: Any, notes: Any) -> Any:
        before(moment, notes)
        last(moment, notes[row])

    return look


_look = _together(tuple(each.kernel for each in LOOKED_AT))


@entry
def look_at(scene: Any, robot: Any, tick_count: Any, time_ns: Any, passed_ns: Any, kind: Any, out: Any) -> Any:
    """Let all measures look at a robot in the first world once more, and write what they say now.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        robot: Index of the robot.
        tick_count: Ticks done.
        time_ns: The time [ns].
        passed_ns: The time since the last look [ns].
        kind: What controllers see of its kind: the scale of proximity, and the highest speed and the unit of speeds,
            float64 [3]; which of its sensors comes first, second and so on, int64 [8].
        out: Output: notes, float64 [measure, `NOTE_COUNT`], zeros before the first look; a value for each measure, and
            the gap to the nearest wall [mm], float64 [measure + 1]; what its proximity and its light sensors read,
            free of noise, float64 [2, 8].
    """
    opened = open_scene(scene[0])
    _look_in(opened, robot, tick_count, time_ns, passed_ns, kind, out, np.empty((opened.robots.shape[1], 3)))


@kernel
def _look_in(
    scene: Any, robot: Any, tick_count: Any, time_ns: Any, passed_ns: Any, kind: Any, out: Any, poses: Any
) -> Any:
    """Do what `look_at` does in an open scene, with memory for the poses of all robots."""
    (scales, order), (notes, values, readings), robots = kind, out, scene.robots[0]
    state, sensors, wheels = robots[robot], stack_floats(SENSOR_COUNT), stack_floats(2)
    for each in range(robots.shape[0]):
        poses[each, 0], poses[each, 1], poses[each, 2] = lone_pose_at(robots[each], tick_count, time_ns)
    view = view_of(scene, 0, robot, tick_count, time_ns, False, 0, 0)
    _sense_proximity(view, readings[0])
    _sense_ambient(view, readings[1])
    for sensor in range(SENSOR_COUNT):
        sensors[sensor] = scales[0] * readings[0, order[sensor]]
    for wheel in range(2):
        wheels[wheel] = min(max(state.speed_setpoint[wheel], -scales[1]), scales[1]) / scales[2]
    times_s, around = (time_ns / NS_PER_S, passed_ns / NS_PER_S), (scene.bodies[0], scene.lamps[0])
    _look(moment_of(times_s, sensors, wheels, state, state, *around, robot, poses), notes)
    for row in range(notes.shape[0]):
        values[row] = notes[row, 0]
        if _HAS_MEAN[row]:
            values[row] = notes[row, 0] / notes[row, 1] if notes[row, 1] > 0 else 0.0
    gap_mm = clearance_mm(scene.ground, poses[robot, 0], poses[robot, 1]) - scene.kinds[state.kind].radius_mm
    values[notes.shape[0]] = gap_mm
