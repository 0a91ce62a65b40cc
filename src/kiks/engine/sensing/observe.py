"""Observation for display: the rays of all robots with their hits, and all readings in one call.

Observing changes only the output arrays. Rays are exact, with smooth surfaces and angles of incidence, even if a
robot's response uses coarser ones.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from kiks.engine.compiling import entry, kernel, linked
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.physics.motion import moment_of
from kiks.engine.scene import OPEN_SCENE, open_scene
from kiks.engine.sensing.ambient import sense_ambient
from kiks.engine.sensing.disc_rays import disc_of, meet_disc, see, seen_by, sees
from kiks.engine.sensing.proximity import (
    READERS,
    begin_rays,
    end_rays,
    expected_counts,
    follow_rays,
    make_readers,
    make_tracing,
    pose_at,
    rays_of,
    sense_linked,
    track_around,
    view_of,
)
from kiks.engine.simd.lanes import lane_of, wide

NOTHING, WALL = -2, -1
"""Hits of a ray that hit no disc; discs are numbered as in `kiks.engine.scene`."""

_FAR_MM = 1e6


@kernel
def gaze_robot(
    scene: Any,
    robot: Any,
    has_faces: Any,
    tick_count: Any,
    instants_ns: Any,
    poses: Any,
    tracing: Any,
    rays: Any,
    met: Any,
) -> Any:
    """Write the hits of all rays of a robot's sensors, each at an instant [ns] and from a pose of its own, `Lanes`.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        robot: Index of the robot in the first world.
        has_faces: Whether walls have smooth surfaces.
        tick_count: Ticks done.
        instants_ns: The instants.
        poses: The robot's x and y [mm] and heading [rad] then.
        tracing: Scratch memory (`kiks.engine.sensing.proximity.make_tracing`).
        rays: float64 [8, 3, 7]: lengths [mm], cosines of the angles of incidence, brightnesses 0..255.
        met: int64 [8, 7]: which disc, `WALL` or `NOTHING`.
    """
    walls, state = scene.walls, scene.robots[0, robot]
    parameters, moments = scene.kinds[state.kind], moment_of(tick_count, instants_ns)
    disc_count = track_around(scene, 0, robot, state.x_mm, state.y_mm, tracing.tracks)
    follow_rays(walls, tracing, begin_rays(walls, parameters, True, moments, poses, disc_count, tracing, 0, 0))
    for sensor in range(met.shape[0]):
        hits = end_rays(walls, parameters, has_faces, tracing, 0, sensor)
        for ray in range(RAY_COUNT):
            for part in range(3):
                rays[sensor, part, ray] = lane_of(hits[part], ray)
            met[sensor, ray] = WALL if rays[sensor, 2, ray] > 0.0 else NOTHING
    view, nothing = view_of(parameters, poses), (wide(_FAR_MM), wide(1.0), wide(0.0))
    for k in range(disc_count):
        count, _ = see(walls, tracing.tracks, k, k + 1, moments, view, tracing.seen, 0)
        for sensor in range(met.shape[0]):
            if count > 0 and sees(tracing.seen, 0, sensor):
                origin, directions = rays_of(walls, parameters, tracing, 0, sensor)
                alone, _, shades = meet_disc(seen_by(tracing.seen, 0, sensor), *origin, *directions, *nothing)
                for ray in range(RAY_COUNT):
                    is_this = lane_of(alone, ray) * walls.cell_mm <= rays[sensor, 0, ray]
                    if is_this and lane_of(shades, ray) > 0.0 and met[sensor, ray] != NOTHING:
                        met[sensor, ray] = disc_of(tracing.tracks, k)


@linked(types.void(OPEN_SCENE, *(types.int64,) * 3, types.float64[:, :, :, ::1], types.int64[:, :, ::1]))
def gaze_linked(scene: Any, tick_count: Any, time_ns: Any, first: Any, rays: Any, met: Any) -> Any:
    """Do what `gaze` does, for an open scene."""
    tracing = make_tracing()
    for k in range(met.shape[0]):
        x, y, heading = pose_at(scene.robots[0, first + k], tick_count, time_ns)
        poses = wide(x), wide(y), wide(heading)
        gaze_robot(scene, first + k, True, tick_count, wide(1.0 * time_ns), poses, tracing, rays[k], met[k])


@entry
def gaze(scene: Any, tick_count: Any, time_ns: Any, first: Any, rays: Any, met: Any) -> Any:
    """Write the hits of all rays of some robots' proximity sensors at the present time and poses.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        tick_count: Ticks done.
        time_ns: The present time.
        first: Index of the first of the robots.
        rays: float64 [robot, 8, 3, 7]: lengths [mm], cosines of the angles of incidence, brightnesses 0..255.
        met: int64 [robot, 8, 7]: which disc, `WALL` or `NOTHING`.
    """
    gaze_linked(open_scene(scene[0]), tick_count, time_ns, first, rays, met)


@kernel
def read_robots(scene: Any, tick_count: Any, time_ns: Any, proximity: Any, ambient: Any) -> Any:
    """Do what `read_all` does, for an open scene."""
    readers = make_readers()
    for first in range(0, proximity.shape[0], READERS):
        count = min(READERS, proximity.shape[0] - first)
        for k in range(count):
            readers.worlds[k], readers.robots[k] = 0, first + k
            readers.ticks[k], readers.times_ns[k] = tick_count, time_ns
        sense_linked(scene, readers, count, True, proximity[first : first + READERS])
    for robot in range(proximity.shape[0]):
        sense_ambient(scene, 0, robot, tick_count, time_ns, True, ambient[robot])


@entry
def read_all(scene: Any, tick_count: Any, time_ns: Any, proximity: Any, ambient: Any) -> Any:
    """Write the counts that commands N and O of all robots return at a time.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        tick_count: Ticks done.
        time_ns: When the robots read.
        proximity: float64 [robot, 8].
        ambient: float64 [robot, 8].
    """
    read_robots(open_scene(scene[0]), tick_count, time_ns, proximity, ambient)


@kernel
def find_places(scene: Any, tick_count: Any, time_ns: Any, poses: Any, places: Any) -> Any:
    """Do what `places_at` does, for an open scene."""
    for robot in range(poses.shape[0]):
        poses[robot, 0], poses[robot, 1], poses[robot, 2] = pose_at(scene.robots[0, robot], tick_count, time_ns)
    ticks, back = moment_of(tick_count, time_ns)
    ticks_ago = np.int64(ticks)
    for k in range(places.shape[0]):
        body = scene.bodies[0, k]
        for axis in range(2):
            now = body.x_mm if axis == 0 else body.y_mm
            later = now if ticks_ago == 0 else body.trail[ticks_ago - 1, axis]
            places[k, axis] = later + back * (body.trail[ticks_ago, axis] - later)


@entry
def places_at(scene: Any, tick_count: Any, time_ns: Any, poses: Any, places: Any) -> Any:
    """Write where everything is at a time.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        tick_count: Ticks done.
        time_ns: When.
        poses: Of robots, x and y [mm] and heading [rad], float64 [robot, 3].
        places: Of balls and cylinders, x and y [mm], float64 [body, 2].
    """
    find_places(open_scene(scene[0]), tick_count, time_ns, poses, places)


@entry
def read_from(scene: Any, robot: Any, tick_count: Any, time_ns: Any, poses: Any, out: Any) -> Any:
    """Write the counts that a robot would read on average now if it stood elsewhere.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        robot: Index of the robot.
        tick_count: Ticks done.
        time_ns: The present time.
        poses: float64 [pose, 3]: x [mm] and y [mm], in the arena, and heading [rad].
        out: float64 [pose, 8].
    """
    scene = open_scene(scene[0])
    parameters = scene.kinds[scene.robots[0, robot].kind]
    tracing = make_tracing()
    moments = moment_of(tick_count, wide(1.0 * time_ns))
    for k in range(out.shape[0]):
        x, y, heading = poses[k, 0], poses[k, 1], poses[k, 2]
        disc_count = track_around(scene, 0, robot, x, y, tracing.tracks)
        pose = wide(x), wide(y), wide(heading)
        packet_count = begin_rays(scene.walls, parameters, False, moments, pose, disc_count, tracing, 0, 0)
        follow_rays(scene.walls, tracing, packet_count)
        expected_counts(scene, parameters, tracing, 0, out[k])
        for sensor in range(out.shape[1]):
            out[k, sensor] = min(out[k, sensor], parameters.maximum_counts)
