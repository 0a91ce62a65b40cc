"""Explains the count of a sensor by its parts, with the same functions that compute it."""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel
from kiks.engine.numbers import stream_of, uniform
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.scene import moment_of
from kiks.engine.sensing.ambient import STREAM_AMBIENT, expected_ambient, face, is_burning, mount_of
from kiks.engine.sensing.disc_rays import ALL_AROUND, PER_TRACK, SEEN_SIZE, TRACKS_SIZE, disc_of, other_tracks, see
from kiks.engine.sensing.observe import WALL, find_met, gaze_sensor, keep
from kiks.engine.sensing.proximity import (
    STREAM_PROXIMITY,
    chances,
    expected_count,
    follow_near,
    jitter_of,
    quantize,
    sampled_pose,
    scatter,
    survey,
    trace,
    view_of,
)
from kiks.engine.sensing.rays import is_lit, scale
from kiks.engine.sensing.responses import respond
from kiks.engine.simd.f64x8 import LANES, load, store
from kiks.engine.simd.stack_arrays import stack_floats

SHINING, BEHIND, BEHIND_BODY, HIDDEN, OFF = 0, 1, 2, 3, 4
"""Effect of a lamp on a sensor; the first three values are those of `kiks.engine.sensing.ambient.face`."""


@kernel
def respond_without(
    networks: Any,
    parameters: Any,
    sensor: Any,
    lengths_mm: Any,
    cosines: Any,
    brightnesses: Any,
    ray: Any,
) -> Any:
    """Return the expected counts above the baseline if one ray hit nothing."""
    far, square, bright = stack_floats(LANES), stack_floats(LANES), stack_floats(LANES)
    store(far, lengths_mm)
    store(square, cosines)
    store(bright, brightnesses)
    far[ray], square[ray], bright[ray] = parameters.reach_mm, 1.0, 0.0
    return respond(networks, parameters, sensor, load(far), load(square), load(bright))


@entry
def explain_proximity(
    scene: Any,
    sight: Any,
    networks: Any,
    tick_count: Any,
    time_ns: Any,
    seed: Any,
    robot: Any,
    sensor: Any,
    rays: Any,
    met: Any,
    without: Any,
) -> Any:
    """Explain the count that command N returns at a time for one sensor.

    Args:
        scene: The scene (`kiks.engine.scene`).
        sight: The arena as rays see it (`kiks.engine.sensing.rays`).
        networks: As `kiks.engine.sensing.proximity.read_proximity` takes them.
        tick_count: Ticks done.
        time_ns: Time of the reading [ns].
        seed: Seed of the run.
        robot: Index of the robot.
        sensor: Index of the sensor.
        rays: Output, float64 [3, 7]: lengths [mm], cosines of the angles of incidence, brightnesses. Lengths and
            brightnesses are those that the response uses.
        met: Output: hits of the rays, as in `kiks.engine.sensing.observe`, int64 [7].
        without: Output: expected count if one ray hit nothing, float64 [7].

    Returns:
        Time of the sample [ns]; expected count; proportional noise; constant noise; count.
    """
    robots, _, kinds, _ = scene
    state = robots[0, robot]
    parameters = kinds[state.kind]
    tracks = stack_floats(TRACKS_SIZE)
    track_count = follow_near(scene, robot, tracks)
    turn, instant_ns, x, y, heading = sampled_pose(state, tick_count, time_ns, sensor, True)
    moment = moment_of(tick_count, instant_ns)
    gaze_sensor(sight, parameters, tracks, track_count, moment, (x, y, heading), sensor, rays, met)
    without[:] = parameters.baseline_counts[sensor]
    view = view_of(parameters, x, y, heading, sensor)
    seen = stack_floats(SEEN_SIZE)
    is_near, seen_count = survey(sight, parameters, tracks, track_count, moment, view, seen)
    if is_near:
        lengths_mm, cosines, brightnesses = trace(
            sight, parameters.response, view, parameters.reach_mm, seen, seen_count
        )
        keep(lengths_mm, rays[0])
        keep(brightnesses, rays[2])
        find_met(sight, parameters, tracks, track_count, moment, view, lengths_mm, brightnesses, met)
        for ray in range(RAY_COUNT):
            without[ray] += respond_without(networks, parameters, sensor, lengths_mm, cosines, brightnesses, ray)
    expected = expected_count(sight, networks, parameters, tracks, track_count, moment, x, y, heading, sensor)
    sign, size, chance = chances(stream_of(seed, 0, robot, STREAM_PROXIMITY), turn, sensor)
    scattered, jitter = scatter(parameters, expected, sign, size), jitter_of(parameters, chance)
    return instant_ns, expected, scattered - expected, jitter, np.int64(quantize(parameters, scattered + jitter))


@kernel
def find_hider(sight: Any, tracks: Any, track_count: Any, moment: Any, mount: Any, lamp_x: Any, lamp_y: Any) -> Any:
    """Return the disc that hides a hidden lamp from a sensor, `WALL` if a wall does."""
    alone = stack_floats(SEEN_SIZE)
    x, y = mount[0], mount[1]
    if not is_lit(sight, alone, 0, x, y, lamp_x, lamp_y):
        return WALL
    hider = WALL
    for k in range(track_count):
        count = see(tracks[PER_TRACK * k :], 1, moment, scale(sight), ALL_AROUND, alone)
        if hider == WALL and not is_lit(sight, alone, count, x, y, lamp_x, lamp_y):
            hider = disc_of(tracks, k)
    return hider


@entry
def explain_ambient(
    scene: Any,
    sight: Any,
    lamps: Any,
    tick_count: Any,
    time_ns: Any,
    seed: Any,
    robot: Any,
    sensor: Any,
    facts: Any,
    reasons: Any,
) -> Any:
    """Explain the count that command O returns at a time for one sensor.

    Args:
        scene: The scene.
        sight: The arena as rays see it.
        lamps: As `kiks.engine.sensing.ambient.read_ambient` takes them, shape [lamp, 4].
        tick_count: Ticks done.
        time_ns: Time of the reading [ns].
        seed: Seed of the run.
        robot: Index of the robot.
        sensor: Index of the sensor.
        facts: Output, float64 [lamp, 3]: distance of a lamp from the sensor [mm], cosine of its angle off the sensor's
            axis, and the expected count without it.
        reasons: Output, int64 [lamp, 2]: effect of a lamp on the sensor (`SHINING`, ...), and the disc that hides it,
            `WALL` for a wall.

    Returns:
        Time of the sample [ns]; expected count; noise; count; expected count without lamps.
    """
    robots, _, kinds, _ = scene
    state = robots[0, robot]
    parameters = kinds[state.kind]
    tracks, count, seen = other_tracks(scene, 0, robot)
    turn, instant_ns, x, y, heading = sampled_pose(state, tick_count, time_ns, sensor, True)
    moment = moment_of(tick_count, instant_ns)
    seen_count = see(tracks, count, moment, scale(sight), ALL_AROUND, seen)
    mount = mount_of(parameters, x, y, heading, sensor)
    expected = expected_ambient(sight, lamps, parameters, seen, seen_count, x, y, heading, sensor)
    others = lamps.copy()
    for number in range(lamps.shape[0]):
        how, facts[number, 0], facts[number, 1] = face(mount, lamps, number)
        reasons[number, 1] = WALL
        if not is_burning(lamps, number):
            how = OFF
        elif how == SHINING:
            lamp_x, lamp_y = lamps[number, 0], lamps[number, 1]
            if not is_lit(sight, seen, seen_count, mount[0], mount[1], lamp_x, lamp_y):
                how = HIDDEN
                reasons[number, 1] = find_hider(sight, tracks, count, moment, mount, lamp_x, lamp_y)
        reasons[number, 0] = how
        others[number, 3] = 0.0
        facts[number, 2] = expected_ambient(sight, others, parameters, seen, seen_count, x, y, heading, sensor)
        others[number, 3] = lamps[number, 3]
    dark = expected_ambient(sight, others[:0], parameters, seen, seen_count, x, y, heading, sensor)
    jitter = uniform(seed, 0, robot, STREAM_AMBIENT, turn, sensor)
    noise = parameters.dark_noise_counts * (2.0 * jitter - 1.0)
    return instant_ns, expected, noise, np.int64(quantize(parameters, expected + noise)), dark
