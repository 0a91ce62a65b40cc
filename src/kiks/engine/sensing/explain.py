"""Explains the count of a sensor by its parts, with the same functions that compute it."""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel
from kiks.engine.numbers import stream_of, uniform
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.physics.motion import moment_of
from kiks.engine.scene import open_scene
from kiks.engine.sensing.ambient import FACING, STREAM_AMBIENT, expected_ambient, face, is_burning, mount_of
from kiks.engine.sensing.disc_rays import PER_DISC, PER_TRACK, disc_of, other_tracks, see_all
from kiks.engine.sensing.observe import WALL, gaze_robot
from kiks.engine.sensing.proximity import (
    NOT_NEAR,
    STREAM_PROXIMITY,
    begin_rays,
    chances,
    end_rays,
    expected_counts,
    follow_rays,
    jitter_of,
    make_tracing,
    quantize,
    sampled_pose,
    scatter,
    track_around,
)
from kiks.engine.sensing.rays import is_lit
from kiks.engine.sensing.responses import REFLECTION, respond
from kiks.engine.simd.lanes import LANES, lane_of, load, store
from kiks.engine.simd.stack_arrays import stack_floats

HIDDEN, OFF = 3, 4
"""Effects of a lamp on a sensor that `kiks.engine.sensing.ambient.face` does not know."""


@kernel
def respond_without(scene: Any, parameters: Any, sensor: Any, hits: Any, ray: Any) -> Any:
    """Return the expected counts above the baseline if one ray hit nothing."""
    parts = stack_floats(LANES), stack_floats(LANES), stack_floats(LANES)
    for part in range(3):
        store(parts[part], hits[part])
    parts[0][ray], parts[1][ray], parts[2][ray] = parameters.reach_mm, 1.0, 0.0
    return respond(scene.networks, parameters, sensor, load(parts[0]), load(parts[1]), load(parts[2]))


@entry
def explain_proximity(scene: Any, robot: Any, sensor: Any, tick_count: Any, time_ns: Any, out: Any) -> Any:
    """Explain the count that command N returns at a time for one sensor.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        robot: Index of the robot.
        sensor: Index of the sensor.
        tick_count: Ticks done.
        time_ns: Time of the reading [ns].
        out: Output: lengths [mm] of the rays of all sensors, cosines of the angles of incidence and brightnesses,
            float64 [8, 3, 7]; lengths and brightnesses are those that the response uses, if anything is near enough to
            the sensor. What the rays hit, as in `kiks.engine.sensing.observe`, int64 [8, 7]. Expected count of the
            sensor if one of its rays hit nothing, float64 [7].

    Returns:
        Time of the sample [ns]; expected count; proportional noise; constant noise; count.
    """
    scene, (rays, met, without) = open_scene(scene[0]), out
    tracing, counts, cosines = make_tracing(), stack_floats(LANES), stack_floats(LANES)
    walls, state = scene.walls, scene.robots[0, robot]
    parameters = scene.kinds[state.kind]
    slots = load(parameters.slot_ns), parameters.round_ns
    turns, instants_ns, x, y, heading = sampled_pose(state, tick_count, 1.0 * time_ns, *slots, True)
    moments, poses = moment_of(tick_count, instants_ns), (x, y, heading)
    gaze_robot(scene, robot, True, tick_count, instants_ns, poses, tracing, rays, met)
    disc_count = track_around(scene, 0, robot, state.x_mm, state.y_mm, tracing.tracks)
    follow_rays(walls, tracing, begin_rays(walls, parameters, False, moments, poses, disc_count, tracing, 0, 0))
    expected_counts(scene, parameters, tracing, 0, counts)
    expected = counts[sensor]
    # A sensor that nothing is near reads its baseline, with and without a ray.
    without[:] = parameters.baseline_counts[sensor]
    if tracing.packet_of[sensor] != NOT_NEAR:
        has_faces = parameters.response == REFLECTION
        hits = end_rays(walls, parameters, has_faces, tracing, 0, sensor)
        for ray in range(RAY_COUNT):
            without[ray] += respond_without(scene, parameters, sensor, hits, ray)
            cosines[ray] = rays[sensor, 1, ray]
        # Angles are shown as they are on the smooth surface, even if the response does not use them.
        gaze_robot(scene, robot, has_faces, tick_count, instants_ns, poses, tracing, rays, met)
        for ray in range(RAY_COUNT):
            rays[sensor, 1, ray] = cosines[ray]
    stream = stream_of(scene.seeds[0], 0, robot, STREAM_PROXIMITY)
    sign, size, chance = chances(stream, lane_of(turns, sensor), sensor)
    scattered, jitter = scatter(parameters, expected, sign, size), jitter_of(parameters, chance)
    count = np.int64(quantize(parameters, scattered + jitter, parameters.maximum_counts))
    return lane_of(instants_ns, sensor), expected, scattered - expected, jitter, count


@kernel
def find_hider(walls: Any, tracks: Any, track_count: Any, moment: Any, mount: Any, lamp_x: Any, lamp_y: Any) -> Any:
    """Return the disc that hides a hidden lamp from a sensor, `WALL` if a wall does."""
    alone = stack_floats(PER_DISC)
    x, y = mount[0], mount[1]
    if not is_lit(walls, alone, 0, x, y, lamp_x, lamp_y):
        return WALL
    hider = WALL
    # One disc after the other, as each might hide the lamp alone.
    for k in range(track_count):
        see_all(walls, tracks[PER_TRACK * k :], 1, moment, alone)
        if hider == WALL and not is_lit(walls, alone, 1, x, y, lamp_x, lamp_y):
            hider = disc_of(tracks, k)
    return hider


@entry
def explain_ambient(scene: Any, robot: Any, sensor: Any, tick_count: Any, time_ns: Any, out: Any) -> Any:
    """Explain the count that command O returns at a time for one sensor.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        robot: Index of the robot.
        sensor: Index of the sensor.
        tick_count: Ticks done.
        time_ns: Time of the reading [ns].
        out: Output: distance of a lamp from the sensor [mm], cosine of its angle off the sensor's axis, and the
            expected count without it, float64 [lamp, 3]. Effect of a lamp on the sensor (`FACING`, ...), and the disc
            that hides it, `WALL` for a wall, int64 [lamp, 2].

    Returns:
        Time of the sample [ns]; expected count; noise; count; expected count without lamps.
    """
    scene, (facts, reasons) = open_scene(scene[0]), out
    walls, lamps = scene.walls, scene.lamps[0]
    state = scene.robots[0, robot]
    parameters = scene.kinds[state.kind]
    tracks, count, seen = other_tracks(scene, 0, robot)
    slot = parameters.slot_ns[sensor], parameters.round_ns
    turn, instant_ns, x, y, heading = sampled_pose(state, tick_count, 1.0 * time_ns, *slot, True)
    moment = moment_of(tick_count, instant_ns)
    see_all(walls, tracks, count, moment, seen)
    mount = mount_of(parameters, x, y, heading, sensor)
    expected = expected_ambient(walls, lamps, parameters, seen, count, x, y, heading, sensor)
    others = lamps.copy()
    for number in range(lamps.shape[0]):
        how, facts[number, 0], facts[number, 1] = face(mount, lamps, number)
        reasons[number, 1] = WALL
        if not is_burning(lamps, number):
            how = OFF
        elif how == FACING:
            lamp_x, lamp_y = lamps[number, 0], lamps[number, 1]
            if not is_lit(walls, seen, count, mount[0], mount[1], lamp_x, lamp_y):
                how = HIDDEN
                reasons[number, 1] = find_hider(walls, tracks, count, moment, mount, lamp_x, lamp_y)
        reasons[number, 0] = how
        others[number, 3] = 0.0
        facts[number, 2] = expected_ambient(walls, others, parameters, seen, count, x, y, heading, sensor)
        others[number, 3] = lamps[number, 3]
    dark = expected_ambient(walls, others[:0], parameters, seen, count, x, y, heading, sensor)
    jitter = uniform(scene.seeds[0], 0, robot, STREAM_AMBIENT, turn, sensor)
    noise = parameters.dark_noise_counts * (2.0 * jitter - 1.0)
    read = np.int64(quantize(parameters, expected + noise, parameters.ambient_maximum_counts))
    return instant_ns, expected, noise, read, dark
