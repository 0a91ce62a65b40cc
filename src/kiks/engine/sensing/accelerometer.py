"""The accelerometer of a robot: gravity, and how its speed changes.

Derivation: from where the robot is at the end of the last tick and was at the two before, p0, p1 and p2, its mean
acceleration over them is (p0 - 2 p1 + p2)/T^2 for ticks of the length T. A step of the speed by 100 mm/s within a tick
is one of 10 m/s^2. So wheels that start and stop, and walls and things that a robot runs into, are shocks.

The axes are to the right, ahead and up: a driver for ROS takes the second one for ahead (epuck2-wifi.md 9.2); the
sign of the first is ours, as the three are a right-handed system so. A robot that stands still feels the floor push it
upwards, by one g.
"""

from __future__ import annotations

import math
from typing import Any

from kiks.engine.compiling import kernel
from kiks.engine.numbers import sin_cos, uniform
from kiks.units import TICK_NS

STREAM_ACCELERATION = 8

GRAVITY_COUNTS = 768.0
"""One g (epuck-protocol.md 6.3)."""

COUNTS_MAX = 2.0 * GRAVITY_COUNTS
"""The range is 2 g, either way (epuck2-wifi.md 4)."""

NOISE_COUNTS = 8.0
"""Largest error of a reading, of which all are equally likely: ours."""

_COUNTS_PER_MM = GRAVITY_COUNTS / 9806.65 * (1e9 / TICK_NS) ** 2  # in a tick, by how much it is more than in the last


@kernel
def sense_acceleration(scene: Any, world: Any, robot: Any, time_ns: Any, is_noisy: Any, out: Any) -> Any:
    """Write the acceleration of a robot to the right, ahead and up [counts], float64 [3].

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        world: Index of the world.
        robot: Index of the robot.
        time_ns: Time of the reading [ns].
        is_noisy: False for what is expected, without rounding.
        out: Where they are written.
    """
    state = scene.robots[world, robot]
    x = state.x_mm - 2.0 * state.trail[0, 0] + state.trail[1, 0]
    y = state.y_mm - 2.0 * state.trail[0, 1] + state.trail[1, 1]
    sine, cosine = sin_cos(state.trail[0, 2])
    out[0], out[1] = _COUNTS_PER_MM * (x * sine - y * cosine), _COUNTS_PER_MM * (x * cosine + y * sine)
    out[2] = GRAVITY_COUNTS
    for axis in range(3):
        counts = out[axis]
        if is_noisy:
            if scene.kinds[state.kind].is_noisy != 0:
                chance = uniform(scene.seeds[world], 0, robot, STREAM_ACCELERATION, time_ns, axis)
                counts += NOISE_COUNTS * (2.0 * chance - 1.0)
            counts = math.floor(counts + 0.5)
        out[axis] = min(max(-COUNTS_MAX, counts), COUNTS_MAX)
