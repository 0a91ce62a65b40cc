"""Explains the count of a sensor by its parts, with the same functions that compute it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel
from kiks.engine.numbers import arccosine, arctangent2, stream_of, uniform
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.physics.motion import moment_of
from kiks.engine.scene import open_scene
from kiks.engine.sensing.ambient import FACING, STREAM_AMBIENT, expected_ambient, face, is_burning, mount_of
from kiks.engine.sensing.disc_rays import PER_DISC, PER_TRACK, disc_of, other_tracks, see_all
from kiks.engine.sensing.observe import NOTHING, WALL, gaze_robot
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
from kiks.model.robot import SENSOR_COUNT

HIDDEN, OFF = 3, 4
"""Effects of a lamp on a sensor that `kiks.engine.sensing.ambient.face` does not know."""

_DEGREES = 180.0 / math.pi


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
        out: Output: of each ray the direction from where the robot looks [deg], length [mm], brightness, angle of
            incidence [deg] and contribution [counts], float64 [7, 5]; infinity and NaN if it met nothing. Length and
            brightness are those that the response uses, if anything is near enough to the sensor. What each met, as
            in `kiks.engine.sensing.observe`, int64 [7].

    Returns:
        Age of the sample [ms]; step and end of the converter; count; reach of the rays [mm]; the sensor's gain;
        baseline; expected counts above it; proportional noise; constant noise.
    """
    scene, (numbers, met) = open_scene(scene[0]), out
    rays, all_met = np.empty((SENSOR_COUNT, 3, RAY_COUNT)), np.empty((SENSOR_COUNT, RAY_COUNT), np.int64)
    without = stack_floats(LANES)
    tracing, counts, cosines = make_tracing(), stack_floats(LANES), stack_floats(LANES)
    walls, state = scene.walls, scene.robots[0, robot]
    parameters = scene.kinds[state.kind]
    slots = load(parameters.slot_ns), parameters.round_ns
    turns, instants_ns, x, y, heading = sampled_pose(state, tick_count, 1.0 * time_ns, *slots, True)
    moments, poses = moment_of(tick_count, instants_ns), (x, y, heading)
    gaze_robot(scene, robot, True, tick_count, instants_ns, poses, tracing, rays, all_met)
    disc_count = track_around(scene, 0, robot, state.x_mm, state.y_mm, tracing.tracks)
    follow_rays(walls, tracing, begin_rays(walls, parameters, False, moments, poses, disc_count, tracing, 0, 0))
    expected_counts(scene, parameters, tracing, 0, counts)
    expected = counts[sensor]
    baseline = parameters.baseline_counts[sensor]
    # Angles are shown as they are on the smooth surface, even if the response does not use them.
    for ray in range(RAY_COUNT):
        cosines[ray], without[ray] = rays[sensor, 1, ray], baseline
    # A sensor that nothing is near reads its baseline, with and without a ray.
    if tracing.packet_of[sensor] != NOT_NEAR:
        has_faces = parameters.response == REFLECTION
        hits = end_rays(walls, parameters, has_faces, tracing, 0, sensor)
        for ray in range(RAY_COUNT):
            without[ray] += respond_without(scene, parameters, sensor, hits, ray)
        gaze_robot(scene, robot, has_faces, tick_count, instants_ns, poses, tracing, rays, all_met)
    for ray in range(RAY_COUNT):
        angle_rad = arctangent2(parameters.ray_sin[sensor, ray], parameters.ray_cos[sensor, ray])
        has_met = all_met[sensor, ray] != NOTHING
        met[ray] = all_met[sensor, ray]
        numbers[ray, 0] = angle_rad * _DEGREES
        numbers[ray, 1] = rays[sensor, 0, ray] if has_met else math.inf
        numbers[ray, 2] = rays[sensor, 2, ray]
        numbers[ray, 3] = arccosine(cosines[ray]) * _DEGREES if has_met else math.nan
        numbers[ray, 4] = expected - without[ray]
    stream = stream_of(scene.seeds[0], 0, robot, STREAM_PROXIMITY)
    sign, size, chance = chances(stream, lane_of(turns, sensor), sensor)
    scattered, jitter = scatter(parameters, expected, sign, size), jitter_of(parameters, chance)
    count = np.int64(quantize(parameters, scattered + jitter, parameters.maximum_counts))
    age_ms, above, relative = (time_ns - lane_of(instants_ns, sensor)) / 1e6, expected - baseline, scattered - expected
    ends, gain = (parameters.step_counts, parameters.maximum_counts), parameters.gain[sensor]
    return age_ms, *ends, count, parameters.reach_mm, gain, baseline, above, relative, jitter


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
        out: Output: of each lamp the distance from the sensor [mm], angle off the sensor's axis [deg], power [W] and
            contribution [counts], float64 [lamp, 4]. Its effect on the sensor (`FACING`, ...), and the disc that hides
            it, `WALL` for a wall, int64 [lamp, 2].

    Returns:
        Age of the sample [ms]; step and end of the converter; count; expected count without lamps, and with them;
        noise.
    """
    scene, (numbers, reasons) = open_scene(scene[0]), out
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
        how, distance_mm, cosine = face(mount, lamps, number)
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
        alone = expected_ambient(walls, others, parameters, seen, count, x, y, heading, sensor)
        numbers[number, 0], numbers[number, 1] = distance_mm, arccosine(cosine) * _DEGREES
        numbers[number, 2], numbers[number, 3] = lamps[number, 2], alone - expected
        others[number, 3] = lamps[number, 3]
    dark = expected_ambient(walls, others[:0], parameters, seen, count, x, y, heading, sensor)
    jitter = uniform(scene.seeds[0], 0, robot, STREAM_AMBIENT, turn, sensor)
    noise = parameters.dark_noise_counts * (2.0 * jitter - 1.0)
    read = np.int64(quantize(parameters, expected + noise, parameters.ambient_maximum_counts))
    age_ms = (time_ns - instant_ns) / 1e6
    return age_ms, parameters.step_counts, parameters.ambient_maximum_counts, read, dark, expected, noise
