"""The eight proximity sensors: the instants of their samples, their seven rays, and the noise of their counts.

Source: thesis section 3.3 ("Proximity sensors", "noise model"), khepera-protocol.md 8.1 (sampling) and
kiks-behaviour.md 3.1 (rays, noise). The responses themselves are in `kiks.engine.sensing.responses`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.numbers import at_instant, draw, sin_cos, stream_of
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.physics.motion import pose_between
from kiks.engine.scene import find_near, moment_of
from kiks.engine.sensing.disc_rays import SEEN_LIMIT, SEEN_SIZE, TRACKS_SIZE, follow, meet_discs, see
from kiks.engine.sensing.ray_packets import cast_fan
from kiks.engine.sensing.rays import leap_at, scale
from kiks.engine.sensing.responses import REFLECTION, respond
from kiks.engine.simd.f64x8 import floor, greatest, lane_of, load
from kiks.engine.simd.masks import choose
from kiks.engine.simd.stack_arrays import stack_floats, stack_integers
from kiks.units import SENSOR_ROUND_NS, SENSOR_SLOT_NS

STREAM_PROXIMITY = 2
"""Random stream of the noise; each purpose has a number of its own."""

MOVED_MM = 30.0
"""Longest path of a robot or body between the first sensor's sample and a reading: 20 ms at 1.5 m/s."""


@kernel
def sample_instant(time_ns: Any, sensor: Any) -> Any:
    """Return the round in which a sensor was last sampled, and the time of that sample [ns].

    Times are float64, or eight of them: whole nanoseconds are exact for a hundred days.
    """
    slot_ns = 1.0 * sensor * SENSOR_SLOT_NS
    turn = floor((time_ns - slot_ns) / SENSOR_ROUND_NS)
    is_sampled = turn >= 0.0
    return choose(is_sampled, turn + 1.0, 0.0), choose(is_sampled, turn * SENSOR_ROUND_NS + slot_ns, 0.0)


@kernel
def pose_at(robot: Any, tick_count: Any, time_ns: Any) -> Any:
    """Return x, y and heading at a time at most 20 ms before the end of the last tick."""
    ticks_ago, back = moment_of(tick_count, time_ns)
    return pose_between(robot, ticks_ago, 1.0 - back)


@kernel
def sampled_pose(robot: Any, tick_count: Any, time_ns: Any, sensor: Any, is_sampled: Any) -> Any:
    """Return a sensor's round, its instant [ns], and x, y and heading then; without sampling, those of now."""
    turn, instant_ns = sample_instant(time_ns, sensor)
    if not is_sampled:
        turn, instant_ns = 0.0 * time_ns, 1.0 * time_ns
    x, y, heading = pose_at(robot, tick_count, instant_ns)
    return turn, instant_ns, x, y, heading


@kernel
def expected_count(
    sight: Any,
    networks: Any,
    parameters: Any,
    tracks: Any,
    track_count: Any,
    moment: Any,
    x: Any,
    y: Any,
    heading: Any,
    sensor: Any,
) -> Any:
    """Return the mean count of a sensor of a robot at a pose, without an upper limit.

    Args:
        sight: The arena as rays see it.
        networks: Networks of the response, if it needs any.
        parameters: Record of the robot's constants.
        tracks: Tracks of nearby discs (`kiks.engine.sensing.disc_rays`).
        track_count: Number of tracks.
        moment: The time (`kiks.engine.scene.moment_of`).
        x: Where the robot is [mm].
        y: Where the robot is [mm].
        heading: Where it looks [rad].
        sensor: Index of the sensor.
    """
    view = view_of(parameters, x, y, heading, sensor)
    seen = stack_floats(SEEN_SIZE)
    is_near, seen_count = survey(sight, parameters, tracks, track_count, moment, view, seen)
    if not is_near:
        return parameters.baseline_counts[sensor]
    lengths_mm, cosines, brightnesses = trace(sight, parameters.response, view, parameters.reach_mm, seen, seen_count)
    counts = respond(networks, parameters, sensor, lengths_mm, cosines, brightnesses)
    return parameters.baseline_counts[sensor] + counts


@inlined
def view_of(parameters: Any, x: Any, y: Any, heading: Any, sensor: Any) -> Any:
    """Return the view of a sensor.

    Returns:
        Origin of its rays, x and y [mm]; their directions, cosines and sines, `Lanes`; the circle outside which nothing
        makes it respond, x, y and radius [mm].
    """
    sine, cosine = sin_cos(heading)
    watch = *watched(parameters, x, y, sine, cosine, sensor), parameters.watch_mm[sensor]
    x, y = mount(parameters, x, y, sine, cosine, sensor)
    rays_x, rays_y = aim(parameters, sine, cosine, sensor)
    return x, y, rays_x, rays_y, watch


@inlined
def watched(parameters: Any, x: Any, y: Any, sine: Any, cosine: Any, sensor: Any) -> Any:
    """Return the centre of the circle outside which nothing makes a sensor respond, x and y [mm]."""
    watch_x, watch_y = parameters.watch_x_mm[sensor], parameters.watch_y_mm[sensor]
    return x + watch_x * cosine - watch_y * sine, y + watch_x * sine + watch_y * cosine


@inlined
def mount(parameters: Any, x: Any, y: Any, sine: Any, cosine: Any, sensor: Any) -> Any:
    """Return the origin of a sensor's rays, x and y [mm]; of one robot or eight."""
    ray_x, ray_y = parameters.ray_x_mm[sensor], parameters.ray_y_mm[sensor]
    return x + ray_x * cosine - ray_y * sine, y + ray_x * sine + ray_y * cosine


@inlined
def aim(parameters: Any, sine: Any, cosine: Any, sensor: Any) -> Any:
    """Return the directions of a sensor's rays, cosines and sines, `Lanes`."""
    ray_cos, ray_sin = load(parameters.ray_cos[sensor]), load(parameters.ray_sin[sensor])
    return ray_cos * cosine - ray_sin * sine, ray_cos * sine + ray_sin * cosine


@inlined
def survey(sight: Any, parameters: Any, tracks: Any, track_count: Any, moment: Any, view: Any, seen: Any) -> Any:
    """Check whether anything is near a sensor; write the discs in its view into `seen`, float64 [`SEEN_SIZE`].

    Returns:
        Whether anything may be near enough (otherwise the sensor reads its baseline), and the number of discs in view.
    """
    x, y, rays_x, rays_y, (watch_x, watch_y, watch_mm) = view
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    is_near = leap_at(sight, watch_x * per_cell + pad, watch_y * per_cell + pad) <= watch_mm * per_cell
    seen_count = 0
    if track_count > 0:
        left = lane_of(rays_x, 0), lane_of(rays_y, 0)
        right = lane_of(rays_x, RAY_COUNT - 1), lane_of(rays_y, RAY_COUNT - 1)
        seen_count = see(tracks, track_count, moment, (cell, pad), (x, y, left, right, parameters.reach_mm), seen)
    return is_near or seen_count > 0, seen_count


@inlined
def trace(sight: Any, response: Any, view: Any, reach_mm: Any, seen: Any, seen_count: Any) -> Any:
    """Follow the rays of a sensor to their hits, as exactly as a response needs them.

    Returns:
        Lengths of the rays [mm], cosines of the angles of incidence, and brightnesses, 0 for nothing, `Lanes`.
    """
    x, y, rays_x, rays_y, _ = view
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    column, row, reach = x * per_cell + pad, y * per_cell + pad, reach_mm * per_cell
    has_faces = response == REFLECTION
    lengths, cosines, brightnesses = cast_fan(sight, has_faces, column, row, rays_x, rays_y, reach)
    if seen_count > 0:
        lengths, cosines, brightnesses = meet_discs(
            seen, seen_count, column, row, rays_x, rays_y, lengths, cosines, brightnesses
        )
    return lengths * cell, cosines, brightnesses


@kernel
def integer_power(base: Any, exponent: Any) -> Any:
    """Return one number or eight to a positive whole power, by multiplication alone."""
    result = 1.0 + 0.0 * base
    for k in range(np.int64(greatest(exponent))):
        result = choose(k < exponent, result * base, result)
    return result


@kernel
def quantile(values: Any, count: Any, share: Any) -> Any:
    """Return the quantile 0..1 of a distribution: the first `count` values are its equally probable steps."""
    place = share * (count - 1)
    i = min(np.int64(place), max(count - 2, 0))
    return values[i] + (place - i) * (values[i + 1] - values[i])


@inlined
def scatter(parameters: Any, count: Any, sign: Any, size: Any) -> Any:
    """Return a count with proportional noise, from two random numbers 0..1; of one robot or eight.

    The noise is at most 25 % of small and 10 % of large counts, and rarely that much.
    """
    largest = parameters.noise_small - count / 1000.0 * (parameters.noise_small - parameters.noise_large)
    deviation = largest * integer_power(size, parameters.noise_exponent)
    return count * (1.0 + choose(sign < 0.5, deviation, -parameters.noise_down * deviation))


@inlined
def jitter_of(parameters: Any, chance: Any) -> Any:
    """Return the noise that does not depend on the count, from the robot's measured distribution."""
    return quantile(parameters.jitter_counts, parameters.jitter_point_count, chance)


@inlined
def chances(stream: Any, turn: Any, sensor: Any) -> Any:
    """Return three random numbers 0..1 for a sensor in a round: sign and size of proportional noise, and jitter."""
    chance = at_instant(stream, turn)
    return draw(chance, sensor * 3), draw(chance, sensor * 3 + 1), draw(chance, sensor * 3 + 2)


@kernel
def quantize(parameters: Any, count: Any) -> Any:
    """Return a count in the steps and the range of the converter; of one robot or eight."""
    steps = floor(count / parameters.step_counts + 0.5)
    return min(max(0.0, steps * parameters.step_counts), parameters.maximum_counts)


@inlined
def follow_near(scene: Any, robot: Any, tracks: Any) -> Any:
    """List the tracks of the discs that a robot's proximity sensors may see; return their number."""
    state = scene[0][0, robot]
    return follow_around(scene, robot, state.x_mm, state.y_mm, tracks)


@inlined
def follow_around(scene: Any, robot: Any, x: Any, y: Any, tracks: Any) -> Any:
    """List the tracks of the discs that a robot's proximity sensors might see from a place; return their number.

    Args:
        scene: The robots, balls and cylinders (`kiks.engine.scene`).
        robot: Index of the robot.
        x: The place [mm].
        y: The place [mm].
        tracks: float64 [`TRACKS_SIZE`].
    """
    robots, _, kinds, _ = scene
    parameters = kinds[robots[0, robot].kind]
    found = stack_integers(SEEN_LIMIT)
    reach = parameters.radius_mm + parameters.reach_mm + MOVED_MM
    count = find_near(scene, 0, x, y, reach + MOVED_MM, robot, found)
    return follow(scene, 0, found, count, x, y, reach, tracks) if count > 0 else 0


@entry
def read_proximity(
    scene: Any,
    sight: Any,
    networks: Any,
    tick_count: Any,
    time_ns: Any,
    seed: Any,
    robot: Any,
    is_noisy: Any,
    out: Any,
) -> Any:
    """Write the eight counts that command N returns at a time into `out`, each sampled at its own instant.

    Args:
        scene: The scene (`kiks.engine.scene`).
        sight: The arena as rays see it (`kiks.engine.sensing.rays`).
        networks: A record of `kiks.engine.sensing.thesis_networks.NETWORKS`; empty if no robot's response needs one.
        tick_count: Ticks done.
        time_ns: Time of the reading [ns].
        seed: Seed of the run.
        robot: Index of the robot.
        is_noisy: False for the expected counts at the present pose, without rounding.
        out: int64, or float64 for expected counts, shape [8].
    """
    robots, _, kinds, _ = scene
    state = robots[0, robot]
    parameters = kinds[state.kind]
    stream = stream_of(seed, 0, robot, STREAM_PROXIMITY)
    tracks = stack_floats(TRACKS_SIZE)
    track_count = follow_near(scene, robot, tracks)
    for sensor in range(out.shape[0]):
        turn, instant_ns, x, y, heading = sampled_pose(state, tick_count, time_ns, sensor, is_noisy)
        moment = moment_of(tick_count, instant_ns)
        count = expected_count(sight, networks, parameters, tracks, track_count, moment, x, y, heading, sensor)
        if is_noisy:
            sign, size, jitter = chances(stream, turn, sensor)
            noisy = scatter(parameters, count, sign, size) + jitter_of(parameters, jitter)
            out[sensor] = np.int64(quantize(parameters, noisy))
        else:
            out[sensor] = min(count, parameters.maximum_counts)


@entry
def pose_of(robots: Any, tick_count: Any, time_ns: Any, robot: Any) -> Any:
    """Return x [mm], y [mm] and heading [rad] of a robot at a time."""
    return pose_at(robots[0, robot], tick_count, time_ns)
