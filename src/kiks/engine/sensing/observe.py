"""Observation for display: the rays of all robots with their hits, and all readings in one call.

Observing changes only the output arrays. Rays are exact, with smooth surfaces and angles of incidence, even if a
robot's response uses coarser ones.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.scene import moment_of
from kiks.engine.sensing.ambient import read_ambient
from kiks.engine.sensing.disc_rays import PER_TRACK, SEEN_SIZE, TRACKS_SIZE, disc_of, meet_discs, see
from kiks.engine.sensing.proximity import (
    expected_count,
    follow_around,
    follow_near,
    pose_at,
    read_proximity,
    survey,
    trace,
    view_of,
)
from kiks.engine.sensing.rays import scale
from kiks.engine.sensing.responses import REFLECTION
from kiks.engine.simd.f64x8 import LANES, lane_of, splat, store
from kiks.engine.simd.stack_arrays import stack_floats

NOTHING, WALL = -2, -1
"""Hits of a ray that hit no disc; discs are numbered as in `kiks.engine.scene`."""

_FAR_MM = 1e6


@kernel
def find_met(
    sight: Any,
    parameters: Any,
    tracks: Any,
    track_count: Any,
    moment: Any,
    view: Any,
    lengths_mm: Any,
    brightnesses: Any,
    met: Any,
) -> Any:
    """Write the hits of a sensor's rays into `met`, shape [7], from their lengths and brightnesses."""
    x, y, rays_x, rays_y, _ = view
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    for ray in range(RAY_COUNT):
        met[ray] = WALL if lane_of(brightnesses, ray) > 0.0 else NOTHING
    left = lane_of(rays_x, 0), lane_of(rays_y, 0)
    right = lane_of(rays_x, RAY_COUNT - 1), lane_of(rays_y, RAY_COUNT - 1)
    seen = stack_floats(SEEN_SIZE)
    for k in range(track_count):
        track = tracks[PER_TRACK * k :]
        if see(track, 1, moment, (cell, pad), (x, y, left, right, parameters.reach_mm), seen) == 0:
            continue
        alone, _, shades = meet_discs(
            seen, 1, x * per_cell + pad, y * per_cell + pad, rays_x, rays_y, splat(_FAR_MM), splat(1.0), splat(0.0)
        )
        for ray in range(RAY_COUNT):
            is_this = lane_of(alone, ray) * cell <= lane_of(lengths_mm, ray)
            if is_this and lane_of(shades, ray) > 0.0 and met[ray] != NOTHING:
                met[ray] = disc_of(tracks, k)


@inlined
def keep(lanes: Any, out: Any) -> Any:
    """Write the seven rays of a sensor into `out`, shape [7]."""
    room = stack_floats(LANES)
    store(room, lanes)
    for ray in range(RAY_COUNT):
        out[ray] = room[ray]


@kernel
def gaze_sensor(
    sight: Any,
    parameters: Any,
    tracks: Any,
    track_count: Any,
    moment: Any,
    pose: Any,
    sensor: Any,
    rays: Any,
    met: Any,
) -> Any:
    """Write the hits of a sensor's rays: `rays` [3, 7] holds lengths, cosines and brightnesses, `met` [7] the discs."""
    view = view_of(parameters, pose[0], pose[1], pose[2], sensor)
    seen = stack_floats(SEEN_SIZE)
    _, seen_count = survey(sight, parameters, tracks, track_count, moment, view, seen)
    lengths_mm, cosines, brightnesses = trace(sight, REFLECTION, view, parameters.reach_mm, seen, seen_count)
    keep(lengths_mm, rays[0])
    keep(cosines, rays[1])
    keep(brightnesses, rays[2])
    find_met(sight, parameters, tracks, track_count, moment, view, lengths_mm, brightnesses, met)


@entry
def gaze(scene: Any, sight: Any, tick_count: Any, time_ns: Any, first: Any, rays: Any, met: Any) -> Any:
    """Write the hits of all rays of some robots' proximity sensors at the present time and poses.

    Args:
        scene: The scene (`kiks.engine.scene`).
        sight: The arena as rays see it (`kiks.engine.sensing.rays`).
        tick_count: Ticks done.
        time_ns: The present time.
        first: Index of the first of the robots.
        rays: float64 [robot, 8, 3, 7]: lengths [mm], cosines of the angles of incidence, brightnesses 0..255.
        met: int64 [robot, 8, 7]: which disc, `WALL` or `NOTHING`.
    """
    robots, _, kinds, _ = scene
    tracks, moment = stack_floats(TRACKS_SIZE), moment_of(tick_count, time_ns)
    for k in range(met.shape[0]):
        state = robots[0, first + k]
        parameters = kinds[state.kind]
        track_count = follow_near(scene, first + k, tracks)
        pose = pose_at(state, tick_count, time_ns)
        for sensor in range(met.shape[1]):
            room, names = rays[k, sensor], met[k, sensor]
            gaze_sensor(sight, parameters, tracks, track_count, moment, pose, sensor, room, names)


@entry
def read_all(
    scene: Any,
    sight: Any,
    networks: Any,
    lamps: Any,
    tick_count: Any,
    time_ns: Any,
    seed: Any,
    proximity: Any,
    ambient: Any,
) -> Any:
    """Write the counts that commands N and O of all robots return at a time.

    Args:
        scene: The scene.
        sight: The arena as rays see it.
        networks: As `kiks.engine.sensing.proximity.read_proximity` takes them.
        lamps: As `kiks.engine.sensing.ambient.read_ambient` takes them.
        tick_count: Ticks done.
        time_ns: When the robots read.
        seed: Seed of the run.
        proximity: int64 [robot, 8].
        ambient: int64 [robot, 8].
    """
    for robot in range(proximity.shape[0]):
        read_proximity(scene, sight, networks, tick_count, time_ns, seed, robot, True, proximity[robot])
        read_ambient(scene, sight, lamps, tick_count, time_ns, seed, robot, True, ambient[robot])


@entry
def places_at(scene: Any, tick_count: Any, time_ns: Any, poses: Any, places: Any) -> Any:
    """Write where everybody is at a time.

    Args:
        scene: The scene.
        tick_count: Ticks done.
        time_ns: When.
        poses: Of robots, x and y [mm] and heading [rad], float64 [robot, 3].
        places: Of balls and cylinders, x and y [mm], float64 [body, 2].
    """
    robots, bodies, _, _ = scene
    for robot in range(poses.shape[0]):
        poses[robot, 0], poses[robot, 1], poses[robot, 2] = pose_at(robots[0, robot], tick_count, time_ns)
    ticks, back = moment_of(tick_count, time_ns)
    ticks_ago = np.int64(ticks)
    for k in range(places.shape[0]):
        body = bodies[0, k]
        for axis in range(2):
            now = body.x_mm if axis == 0 else body.y_mm
            later = now if ticks_ago == 0 else body.trail[ticks_ago - 1, axis]
            places[k, axis] = later + back * (body.trail[ticks_ago, axis] - later)


@entry
def read_from(
    scene: Any, sight: Any, networks: Any, tick_count: Any, time_ns: Any, robot: Any, poses: Any, out: Any
) -> Any:
    """Write the counts that a robot would read on average now if it stood elsewhere.

    Args:
        scene: The robots, balls and cylinders (`kiks.engine.scene`).
        sight: The arena as rays see it.
        networks: As `kiks.engine.sensing.proximity.read_proximity` takes them.
        tick_count: Ticks done.
        time_ns: The present time.
        robot: Index of the robot.
        poses: float64 [pose, 3]: x [mm] and y [mm], in the arena, and heading [rad].
        out: float64 [pose, 8].
    """
    robots, _, kinds, _ = scene
    parameters = kinds[robots[0, robot].kind]
    tracks, moment = stack_floats(TRACKS_SIZE), moment_of(tick_count, time_ns)
    for k in range(out.shape[0]):
        x, y, heading = poses[k, 0], poses[k, 1], poses[k, 2]
        track_count = follow_around(scene, robot, x, y, tracks)
        for sensor in range(out.shape[1]):
            count = expected_count(sight, networks, parameters, tracks, track_count, moment, x, y, heading, sensor)
            out[k, sensor] = min(count, parameters.maximum_counts)
