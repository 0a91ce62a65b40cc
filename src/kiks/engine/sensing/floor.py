"""The floor below a robot: what an infrared sensor under its base reads.

Model: a reading follows the brightness of a spot, a disc whose cells count by how much of them lies within it. No
manual tells the spot, the scale or the noise of such a sensor: they are ours.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.numbers import sin_cos, uniform
from kiks.engine.scene import open_scene
from kiks.engine.sensing.floor_spots import BLOCK, SPOT_MM
from kiks.engine.sensing.proximity import on_body, pose_at
from kiks.engine.sensing.rays import cell_at

STREAM_FLOOR = 6

COUNTS = 1023.0
"""Reading on white: ten bits, as all readings of the robot (khepera-protocol.md 8.4); black is 0."""

NOISE_COUNTS = 10.0
"""Largest error of a reading, of which all are equally likely."""

GROUND_COUNTS, GROUND_NOISE_COUNTS = 1000.0, 3.0
"""The same of ground sensors, as some robots have them (epuck-protocol.md 6.3 and 8)."""

_WHOLE = 1024.0  # a cell within the spot counts as much


@inlined
def spot_brightness(floor: Any, plains: Any, cell_mm: Any, x_mm: Any, y_mm: Any) -> Any:
    """Return the mean brightness of a spot, 0 to 255.

    A cell counts by the share of its width that lies within the spot, on the line through both centres. The sums are
    of whole numbers, so they depend on no order, and a floor of one brightness has it everywhere.
    """
    middle, level = cell_at(plains, x_mm / cell_mm * (1.0 / BLOCK), y_mm / cell_mm * (1.0 / BLOCK))
    if plains[level, middle] >= 0:
        return 1.0 * plains[level, middle]
    column, row, radius = x_mm / cell_mm - 0.5, y_mm / cell_mm - 0.5, SPOT_MM / cell_mm
    reach = radius + 0.5
    low, high = math.ceil(row - reach), math.floor(row + reach) + 1
    left, right = math.ceil(column - reach), math.floor(column + reach) + 1
    total, weights = np.int64(0), np.int64(0)
    for j in range(low, high):
        for i in range(left, right):
            apart = math.sqrt((i - column) * (i - column) + (j - row) * (j - row))
            weight = np.int64(_WHOLE * min(max(0.0, reach - apart), 1.0) + 0.5)
            # Beyond the arena the floor goes on as at its edge.
            cell = floor[min(max(0, j), floor.shape[0] - 1), min(max(0, i), floor.shape[1] - 1)]
            total += weight * np.int64(cell)
            weights += weight
    return total / weights


@kernel
def sense_floor(scene: Any, world: Any, robot: Any, x: Any, y: Any, time_ns: Any, is_noisy: Any, index: Any) -> Any:
    """Return the reading of a floor sensor at a place and a time; arguments as for `sense_spot`."""
    return sense_spot(scene, world, robot, x, y, time_ns, is_noisy, index, COUNTS, NOISE_COUNTS)


@kernel
def sense_ground(scene: Any, world: Any, robot: Any, pose: Any, time_ns: Any, is_noisy: Any, out: Any) -> Any:
    """Write the readings of the ground sensors of a robot at a pose, x and y [mm] and heading [rad], float64 [5].

    Other arguments are those of `sense_spot`.
    """
    x, y, heading = pose
    sine, cosine = sin_cos(heading)
    parameters = scene.kinds[scene.robots[world, robot].kind]
    for index in range(out.shape[0]):
        place = on_body(x, y, sine, cosine, parameters.ground_x_mm[index], parameters.ground_y_mm[index])
        scale = GROUND_COUNTS, GROUND_NOISE_COUNTS
        out[index] = sense_spot(scene, world, robot, *place, time_ns, is_noisy, index, *scale)


@kernel
def sense_spot(
    scene: Any,
    world: Any,
    robot: Any,
    x: Any,
    y: Any,
    time_ns: Any,
    is_noisy: Any,
    index: Any,
    white_counts: Any,
    noise_counts: Any,
) -> Any:
    """Return the reading of a sensor under a robot at a place and a time.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        world: Index of the world.
        robot: Index of the robot.
        x: Where it looks [mm].
        y: As above.
        time_ns: Time of the reading [ns].
        is_noisy: False for the expected reading, without rounding.
        index: Number of the sensor on its robot: each has noise of its own.
        white_counts: Its reading on white.
        noise_counts: The largest error of a reading.
    """
    counts = spot_brightness(scene.floor, scene.plains, scene.walls.cell_mm, x, y) * (white_counts / 255.0)
    if not is_noisy:
        return counts
    if scene.kinds[scene.robots[world, robot].kind].is_noisy != 0:
        chance = uniform(scene.seeds[world], 0, robot, STREAM_FLOOR, time_ns, index)
        counts += noise_counts * (2.0 * chance - 1.0)
    return min(max(0.0, math.floor(counts + 0.5)), white_counts)


@entry
def read_floor(
    scene: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, ahead: Any, left: Any, index: Any
) -> Any:
    """Call `sense_floor` for the first world of a scene, and a place ahead and to the left of a robot's middle [mm]."""
    scene = open_scene(scene[0])
    x, y, heading = pose_at(scene.robots[0, robot], tick_count, time_ns)
    if ahead != 0.0 or left != 0.0:
        sine, cosine = sin_cos(heading)
        x, y = on_body(x, y, sine, cosine, ahead, left)
    return sense_floor(scene, 0, robot, x, y, time_ns, is_noisy, index)
