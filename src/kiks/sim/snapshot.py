"""A snapshot for the viewers of a world: where everything is and what all sensors see at an instant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kiks.engine.parameters import RAY_COUNT
from kiks.engine.sensing import observe
from kiks.errors import ParameterError, counted
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_heading
from kiks.model.robot import SENSOR_COUNT
from kiks.sim.world import World


@dataclass(frozen=True)
class Snapshot:
    """Where everything is at an instant, and what all sensors see.

    Attributes:
        poses: Of robots: x_mm, y_mm, heading_rad; float64 [robot, 3].
        places: Of balls and cylinders: x_mm, y_mm; float64 [body, 2].
        lengths_mm: How far each ray of each proximity sensor goes from the sensor to what it meets [mm], infinite where
            nothing is within reach; float64 [robot, 8, 7], the leftmost ray first.
        cosines: Of the angles at which rays meet surfaces; float64 [robot, 8, 7].
        brightnesses: Of what they meet, 1..255, 0 for nothing; float64 [robot, 8, 7].
        met: What they meet: a robot's index, the number of robots and a body's index, `WALL` or `NOTHING` of
            `kiks.engine.sensing.observe`; int64 [robot, 8, 7].
        proximity: The counts that command N would return; int64 [robot, 8].
        ambient: The counts that command O would return; int64 [robot, 8].
    """

    poses: NDArray[np.float64]
    places: NDArray[np.float64]
    lengths_mm: NDArray[np.float64]
    cosines: NDArray[np.float64]
    brightnesses: NDArray[np.float64]
    met: NDArray[np.int64]
    proximity: NDArray[np.int64]
    ambient: NDArray[np.int64]

    def __repr__(self) -> str:
        robots, things = len(self.poses), len(self.places)
        return f"<{type(self).__name__}: {counted(robots, 'robot')}, {counted(things, 'thing')}>"


def look(world: World) -> Snapshot:
    """Return a snapshot of a world whose ticks are done."""
    robots, ticks, now_ns = world.robot_count, world.state.tick_count, world.now_ns
    poses, places = world.places()
    lengths_mm, cosines, brightnesses, met = trace_rays(world, 0, robots)
    proximity, ambient = (np.empty((robots, SENSOR_COUNT)) for _ in range(2))
    observe.read_all(world.scene, ticks, now_ns, proximity, ambient)
    return Snapshot(poses, places, lengths_mm, cosines, brightnesses, met, proximity.astype(int), ambient.astype(int))


def trace_rays(
    world: World, first: int, count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return lengths [mm], cosines, brightnesses and what was met (`Snapshot`) of `count` robots from `first`."""
    rays = np.empty((count, SENSOR_COUNT, 3, RAY_COUNT))
    met = np.empty((count, SENSOR_COUNT, RAY_COUNT), np.int64)
    observe.gaze(world.scene, world.state.tick_count, world.now_ns, first, rays, met)
    lengths_mm = np.where(met == observe.NOTHING, np.inf, rays[:, :, 0])
    return lengths_mm, rays[:, :, 1], rays[:, :, 2], met


def proximity_at(world: World, index: int, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what a robot's proximity sensors would read without noise at other poses, float64 [pose, 8].

    Nothing checks whether the robot fits there: a fit asks thousands of times.

    Args:
        world: The world, whose ticks are done.
        index: The robot's index.
        poses: float64 [pose, 3]: x_mm, y_mm, heading_rad.
    """
    poses = check_numbers("poses", poses, (None, 3))
    size_mm = (world.arena.width_mm, world.arena.height_mm)
    if not ((poses[:, :2] >= 0.0) & (poses[:, :2] <= size_mm)).all():
        raise ParameterError(f"poses must be in the arena, {size_mm[0]:g} x {size_mm[1]:g} mm, but one was not.")
    poses[:, 2] = [check_heading("heading_rad", heading_rad) for heading_rad in poses[:, 2].tolist()]
    counts, state = np.empty((len(poses), SENSOR_COUNT)), world.state
    observe.read_from(world.scene, index, state.tick_count, world.now_ns, poses, counts)
    return counts
