"""The eight proximity sensors: when each was sampled, its seven rays, and the noise on its response to them.

Source: thesis section 3.3 ("Proximity sensors", "noise model"), khepera-protocol.md 8.1 (sampling) and
kiks-behaviour.md 3.1 (rays, noise). The responses themselves are in `kiks.engine.responses`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel
from kiks.engine.discs import LANES, SEEN_LIMIT, SEEN_SIZE, TRACKS_SIZE, follow, meet_discs, see
from kiks.engine.lanes import stack_floats, stack_integers
from kiks.engine.motion import pose_between
from kiks.engine.numbers import draw, sin_cos, source
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.rays import cast_fan, free_cells, meet_face, scale, stride
from kiks.engine.responses import FAST, REFLECTION, respond
from kiks.engine.scene import find_near, moment_of
from kiks.units import SENSOR_ROUND_NS, SENSOR_SLOT_NS, TICK_NS

STREAM_SLIP, STREAM_PROXIMITY = 1, 2
"""Random streams: whoever draws has a number of his own."""

MOVED_MM = 30.0
"""How far a robot or a thing moves between the first sensor's sample and a reading, at most: 20 ms at 1.5 m/s."""


@kernel
def sample_instant(time_ns: Any, sensor: Any) -> Any:
    """Return the number of the round in which a sensor was last sampled, and when that was [ns]."""
    slot_ns = sensor * SENSOR_SLOT_NS
    if time_ns < slot_ns:
        return np.int64(0), np.int64(0)
    turn = (time_ns - slot_ns) // SENSOR_ROUND_NS
    return np.int64(turn + 1), np.int64(turn * SENSOR_ROUND_NS + slot_ns)


@kernel
def pose_at(robot: Any, tick_count: Any, time_ns: Any) -> Any:
    """Return x, y and heading at a time at most 20 ms before the end of the last tick."""
    age_ns = max(tick_count * TICK_NS - time_ns, 0)
    ticks_ago = min(age_ns // TICK_NS, robot.trail.shape[0] - 1)
    share = 1.0 - (age_ns - ticks_ago * TICK_NS) / TICK_NS
    return pose_between(robot, ticks_ago, max(share, 0.0))


@kernel
def sampled_pose(robot: Any, tick_count: Any, time_ns: Any, sensor: Any, is_sampled: Any) -> Any:
    """Return a sensor's round, its instant [ns], and x, y and heading of the robot then; if not sampled, those now."""
    turn, instant_ns = sample_instant(time_ns, sensor) if is_sampled else (np.int64(0), time_ns)
    x, y, heading = pose_at(robot, tick_count, instant_ns)
    return turn, instant_ns, x, y, heading


@kernel
def aim(parameters: Any, sine: Any, cosine: Any, sensor: Any, rays_x: Any, rays_y: Any) -> Any:
    """Write the directions of a sensor's rays, an array on the stack [`LANES`] each; the one over repeats the last."""
    for lane in range(LANES):
        ray = min(lane, RAY_COUNT - 1)
        ray_cos, ray_sin = parameters.ray_cos[sensor, ray], parameters.ray_sin[sensor, ray]
        rays_x[lane] = ray_cos * cosine - ray_sin * sine
        rays_y[lane] = ray_cos * sine + ray_sin * cosine


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
    """Return the count that a sensor of a robot at this pose gives on average; nothing cuts it off at the top.

    Args:
        sight: What rays meet of the arena.
        networks: What the response needs besides.
        parameters: Record of the robot's constants.
        tracks: Where the discs about have been (`kiks.engine.discs`).
        track_count: How many they are.
        moment: When (`kiks.engine.scene.moment_of`).
        x: Where the robot is [mm].
        y: Where the robot is [mm].
        heading: Where it looks [rad].
        sensor: Index of the sensor.
    """
    sine, cosine = sin_cos(heading)
    ray_x, ray_y = parameters.ray_x_mm[sensor], parameters.ray_y_mm[sensor]
    x, y = x + ray_x * cosine - ray_y * sine, y + ray_x * sine + ray_y * cosine
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    column, row, reach = x * per_cell + pad, y * per_cell + pad, parameters.reach_mm * per_cell
    begin = max(free_cells(sight, column, row), 0.0)
    if begin > reach and track_count == 0:
        return parameters.baseline_counts[sensor]
    rays_x, rays_y = stack_floats(LANES), stack_floats(LANES)
    aim(parameters, sine, cosine, sensor, rays_x, rays_y)
    seen, seen_count = stack_floats(SEEN_SIZE), 0
    if track_count > 0:
        view = x, y, (rays_x[0], rays_y[0]), (rays_x[RAY_COUNT - 1], rays_y[RAY_COUNT - 1]), parameters.reach_mm
        seen_count = see(tracks, track_count, moment, (cell, pad), view, seen)
    if begin > reach and seen_count == 0:
        return parameters.baseline_counts[sensor]
    lengths, cosines, brightnesses = stack_floats(LANES), stack_floats(LANES), stack_floats(LANES)
    for lane in range(LANES):
        lengths[lane], cosines[lane], brightnesses[lane] = reach, 1.0, 0.0
    if begin <= reach:
        meet_walls(sight, parameters, column, row, rays_x, rays_y, begin, lengths, cosines, brightnesses)
    if seen_count > 0:
        meet_discs(seen, seen_count, column, row, rays_x, rays_y, lengths, cosines, brightnesses)
    for lane in range(LANES):
        lengths[lane] *= cell
    counts = respond(networks, parameters, sensor, lengths, cosines, brightnesses)
    return parameters.baseline_counts[sensor] + counts


@kernel
def meet_walls(
    sight: Any,
    parameters: Any,
    column: Any,
    row: Any,
    rays_x: Any,
    rays_y: Any,
    begin: Any,
    lengths: Any,
    cosines: Any,
    brightnesses: Any,
) -> Any:
    """Shorten a sensor's rays to the walls they meet, as exactly as the response needs them."""
    reach = lengths[0]
    if parameters.response == FAST:
        # The table rounds lengths to 10 mm: for it, rays need not be exact.
        for ray in range(RAY_COUNT):
            lengths[ray], shade = stride(sight, column, row, rays_x[ray], rays_y[ray], reach, begin)
            brightnesses[ray] = shade
        return
    columns, rows = stack_floats(LANES), stack_floats(LANES)
    for lane in range(LANES):
        columns[lane], rows[lane], lengths[lane] = column, row, begin
    cast_fan(sight, columns, rows, rays_x, rays_y, reach, lengths, brightnesses)
    if parameters.response == REFLECTION:
        for ray in range(RAY_COUNT):
            if brightnesses[ray] > 0.0:
                lengths[ray], cosines[ray] = meet_face(sight, column, row, rays_x[ray], rays_y[ray], lengths[ray])


@kernel
def integer_power(base: Any, exponent: Any) -> Any:
    """Return a number to a whole, positive power by multiplication alone."""
    result = 1.0
    for _ in range(exponent):
        result *= base
    return result


@kernel
def quantile(values: Any, count: Any, share: Any) -> Any:
    """Return what a share 0..1 of all draws stays below: the first `count` of the values are equally probable steps."""
    place = share * (count - 1)
    i = min(np.int64(place), max(count - 2, 0))
    return values[i] + (place - i) * (values[i + 1] - values[i])


@kernel
def add_noise(parameters: Any, count: Any, sign: Any, size: Any, jitter: Any) -> Any:
    """Return a count with noise, from three random numbers 0..1.

    A share of the reading, at most 25 % of small and 10 % of large ones and seldom that much, to either side; and
    what is there with nothing near, too, drawn from the robot's own distribution.
    """
    largest = parameters.noise_small - count / 1000.0 * (parameters.noise_small - parameters.noise_large)
    deviation = largest * integer_power(size, parameters.noise_exponent)
    noisy = count * (1.0 + deviation) if sign < 0.5 else count * (1.0 - parameters.noise_down * deviation)
    return noisy + quantile(parameters.jitter_counts, parameters.jitter_point_count, jitter)


@kernel
def quantize(parameters: Any, count: Any) -> Any:
    """Return a count as the converter gives it: whole steps, within its range."""
    steps = np.floor(count / parameters.step_counts + 0.5)
    return np.int64(min(max(steps * parameters.step_counts, 0.0), parameters.maximum_counts))


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
        scene: What there is (`kiks.engine.scene`).
        sight: What rays meet of the arena (`kiks.engine.rays`).
        networks: A record of `kiks.engine.networks.NETWORKS`, or none if no robot's response needs them.
        tick_count: Ticks done.
        time_ns: When the robot reads.
        seed: Seed of the run.
        robot: Index of the robot.
        is_noisy: False for the expected counts at the pose of this very time, without rounding.
        out: int64, or float64 for expected counts, shape [8].
    """
    robots, _, kinds, _ = scene
    state = robots[0, robot]
    parameters = kinds[state.kind]
    found, tracks = stack_integers(SEEN_LIMIT), stack_floats(TRACKS_SIZE)
    reach = parameters.radius_mm + parameters.reach_mm + MOVED_MM
    track_count = find_near(scene, 0, state.x_mm, state.y_mm, reach + MOVED_MM, robot, found)
    if track_count > 0:
        track_count = follow(scene, 0, found, track_count, state.x_mm, state.y_mm, reach, tracks)
    for sensor in range(out.shape[0]):
        turn, instant_ns, x, y, heading = sampled_pose(state, tick_count, time_ns, sensor, is_noisy)
        moment = moment_of(tick_count, instant_ns)
        count = expected_count(
            sight, networks, parameters, tracks, track_count, moment, x, y, heading, sensor
        )
        if is_noisy:
            chance = source(seed, 0, robot, STREAM_PROXIMITY, turn)
            sign, size, jitter = draw(chance, sensor * 3), draw(chance, sensor * 3 + 1), draw(chance, sensor * 3 + 2)
            out[sensor] = quantize(parameters, add_noise(parameters, count, sign, size, jitter))
        else:
            out[sensor] = min(count, parameters.maximum_counts)


@entry
def pose_of(robots: Any, tick_count: Any, time_ns: Any, robot: Any) -> Any:
    """Return x [mm], y [mm] and heading [rad] of a robot at a time."""
    return pose_at(robots[0, robot], tick_count, time_ns)
