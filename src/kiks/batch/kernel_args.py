"""The argument of a batch's kernels beside the scene: what the control loop knows of all worlds."""

from __future__ import annotations

from collections import namedtuple
from typing import Any

Worlds: Any = namedtuple(
    "Worlds",
    "line senses scales sensor_orders sense_counts has_camera ticks begins_ns watched_ns sensed_ns steps sensors "
    "wheels turns memory parameters notes orders order_counts sent switch_ticks switch_codes switched",
)
"""What the loop knows of all worlds of a batch.

* line: the serial lines (`kiks.batch.loop_timing.Line`);
* senses: the senses (`kiks.control.senses.rows_of`), int64 [sense, 7];
* scales: what their readings are multiplied by for controllers, float64 [sense];
* sensor_orders: which of them comes first and so on (`kiks.control.senses.ForControllers`), int64 [sense, reading];
* sense_counts: how many of these each robot has, int64 [robot];
* has_camera: whether each robot has a camera, bool [robot];
* ticks: ticks done, int64 [world];
* begins_ns: when the present loop began [ns], int64 [world];
* watched_ns: when measures were last called [ns], int64 [world];
* sensed_ns: when the last reply of the present loop had arrived [ns], int64 [world];
* steps: loops done, int64 [world];
* sensors: the last readings, as controllers see them, float64 [world, robot, sensor];
* wheels: the last sent speeds [8 mm/s], and outputs of other actuators, float64 [world, robot, 2 + order];
* turns: the robots of each world in the order in which their commands act, int64 [world, robot];
* memory: memory of the controllers, float64 [world, robot, number];
* parameters: parameters of the controllers, float64 [world, robot, number];
* notes: state slots of the measures, float64 [world, robot, note];
* orders: the other actuators (`kiks.control.actuators.order_rows_of`), int64 [order, 7];
* order_counts: how many of these each robot has, int64 [robot];
* sent: what they have sent last, float64 [world, robot, order];
* switch_ticks: ticks after which lamps are switched, int64 [world, switch], in order;
* switch_codes: twice the index of the lamp, and 1 more for on, int64 [world, switch];
* switched: switches done, int64 [world].
"""
