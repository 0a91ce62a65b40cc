"""One tick of the world, 10 ms of it, as a list of phases."""

from __future__ import annotations

from typing import Any

from kiks.engine.compiling import entry
from kiks.engine.motion import move, remember_pose
from kiks.engine.motor import control_motors, latch_encoders, turn_motors
from kiks.engine.numbers import uniform
from kiks.engine.proximity import STREAM_SLIP


@entry
def advance(robots: Any, kinds: Any, field: Any, cell: Any, pad: Any, seed: Any, tick: Any, tick_count: Any) -> Any:
    """Let time pass.

    Args:
        robots: Records of `ROBOT`, shape [world_count, robot_count]; changed in place.
        kinds: Records of `PARAMETERS`, shape [robot_count].
        field: Distance of cells to the nearest wall [mm], shape [rows, columns].
        cell: Edge of a cell [mm].
        pad: Cells of the border around the arena.
        seed: Seed of the run.
        tick: Number of the first tick.
        tick_count: Ticks to do.
    """
    for now in range(tick, tick + tick_count):
        for world in range(robots.shape[0]):
            for number in range(robots.shape[1]):
                robot, parameters = robots[world, number], kinds[number]
                remember_pose(robot)
                latch_encoders(robot)
                control_motors(robot, parameters)
                left = turn_motors(robot, parameters, 0)
                right = turn_motors(robot, parameters, 1)
                drawn = uniform(seed, world, number, STREAM_SLIP, now, 0)
                slip_ratio = parameters.slip_ratio_min + drawn * (parameters.slip_ratio_max - parameters.slip_ratio_min)
                move(field, cell, pad, robot, parameters, left, right, slip_ratio)
