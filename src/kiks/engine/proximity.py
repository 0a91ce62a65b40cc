"""The eight proximity sensors: when each was sampled, its seven rays, and the noise on its response to them.

Source: thesis section 3.3 ("Proximity sensors", "noise model"), khepera-protocol.md 8.1 (sampling) and
kiks-behaviour.md 3.1 (rays, noise). The responses themselves are in `kiks.engine.responses`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.discs import SEEN_LIMIT, SEEN_SIZE, TRACKS_SIZE, follow, meet_discs, see
from kiks.engine.lanes import stack_floats, stack_integers
from kiks.engine.motion import pose_between
from kiks.engine.numbers import draw, sin_cos, source
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.rays import cast_fan, free_cells, meet_face, scale, stride
from kiks.engine.responses import FAST, REFLECTION, respond
from kiks.engine.scene import find_near, moment_of
from kiks.engine.vectors import LANES, is_any, lane_of, load, splat, store
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
    view = view_of(parameters, x, y, heading, sensor)
    seen = stack_floats(SEEN_SIZE)
    is_near, begin, seen_count = survey(sight, parameters, tracks, track_count, moment, view, seen)
    if not is_near:
        return parameters.baseline_counts[sensor]
    lengths_mm, cosines, brightnesses = trace(
        sight, parameters.response, view, parameters.reach_mm, begin, seen, seen_count
    )
    counts = respond(networks, parameters, sensor, lengths_mm, cosines, brightnesses)
    return parameters.baseline_counts[sensor] + counts


@inlined
def view_of(parameters: Any, x: Any, y: Any, heading: Any, sensor: Any) -> Any:
    """Return where a sensor's rays begin, x and y [mm], and their directions, cosines and sines, `Lanes`."""
    sine, cosine = sin_cos(heading)
    ray_x, ray_y = parameters.ray_x_mm[sensor], parameters.ray_y_mm[sensor]
    x, y = x + ray_x * cosine - ray_y * sine, y + ray_x * sine + ray_y * cosine
    ray_cos, ray_sin = load(parameters.ray_cos[sensor]), load(parameters.ray_sin[sensor])
    return x, y, ray_cos * cosine - ray_sin * sine, ray_cos * sine + ray_sin * cosine


@inlined
def survey(sight: Any, parameters: Any, tracks: Any, track_count: Any, moment: Any, view: Any, seen: Any) -> Any:
    """Find out what is about a sensor; write the discs in its view into `seen`, float64 [`SEEN_SIZE`].

    Returns:
        Whether anything is within its reach; if not, it reads its baseline. A length that its rays may go freely
        [cells]. How many discs are in view.
    """
    x, y, rays_x, rays_y = view
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    begin = max(free_cells(sight, x * per_cell + pad, y * per_cell + pad), 0.0)
    seen_count = 0
    if track_count > 0:
        left = lane_of(rays_x, 0), lane_of(rays_y, 0)
        right = lane_of(rays_x, RAY_COUNT - 1), lane_of(rays_y, RAY_COUNT - 1)
        seen_count = see(tracks, track_count, moment, (cell, pad), (x, y, left, right, parameters.reach_mm), seen)
    return begin <= parameters.reach_mm * per_cell or seen_count > 0, begin, seen_count


@inlined
def trace(sight: Any, response: Any, view: Any, reach_mm: Any, begin: Any, seen: Any, seen_count: Any) -> Any:
    """Follow the rays of a sensor to what they meet, as exactly as a response needs them.

    Returns:
        Lengths of the rays [mm], cosines of the angles of incidence, and brightnesses, 0 for nothing, `Lanes`.
    """
    x, y, rays_x, rays_y = view
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    column, row, reach = x * per_cell + pad, y * per_cell + pad, reach_mm * per_cell
    lengths, cosines, brightnesses = splat(reach), splat(1.0), splat(0.0)
    if begin <= reach:
        lengths, cosines, brightnesses = meet_walls(sight, response, column, row, rays_x, rays_y, reach, begin)
    if seen_count > 0:
        lengths, cosines, brightnesses = meet_discs(
            seen, seen_count, column, row, rays_x, rays_y, lengths, cosines, brightnesses
        )
    return lengths * cell, cosines, brightnesses


@kernel
def meet_walls(
    sight: Any, response: Any, column: Any, row: Any, rays_x: Any, rays_y: Any, reach: Any, begin: Any
) -> Any:
    """Follow a sensor's rays to the walls, as exactly as a response needs them.

    Returns:
        Lengths [cells], cosines of the angles of incidence, and brightnesses, `Lanes`.
    """
    if response == FAST:
        return stride_all(sight, column, row, rays_x, rays_y, reach, begin)
    lengths, brightnesses = cast_fan(sight, splat(column), splat(row), rays_x, rays_y, reach, splat(begin))
    cosines = splat(1.0)
    if response == REFLECTION and is_any(brightnesses):
        lengths, cosines = meet_faces(sight, column, row, rays_x, rays_y, lengths, brightnesses)
    return lengths, cosines, brightnesses


@kernel
def meet_faces(sight: Any, column: Any, row: Any, rays_x: Any, rays_y: Any, lengths: Any, brightnesses: Any) -> Any:
    """Return where rays that met a wall meet its smooth surface, and how squarely, `Lanes`."""
    exact, cosines, shades = stack_floats(LANES), stack_floats(LANES), stack_floats(LANES)
    to_x, to_y = stack_floats(LANES), stack_floats(LANES)
    store(exact, lengths)
    store(cosines, splat(1.0))
    store(shades, brightnesses)
    store(to_x, rays_x)
    store(to_y, rays_y)
    for ray in range(RAY_COUNT):
        if shades[ray] > 0.0:
            exact[ray], cosines[ray] = meet_face(sight, column, row, to_x[ray], to_y[ray], exact[ray])
    return load(exact), load(cosines)


@kernel
def stride_all(sight: Any, column: Any, row: Any, rays_x: Any, rays_y: Any, reach: Any, begin: Any) -> Any:
    """Return what `meet_walls` does for the table, which rounds lengths to 10 mm: for it, rays need not be exact."""
    lengths, brightnesses = stack_floats(LANES), stack_floats(LANES)
    to_x, to_y = stack_floats(LANES), stack_floats(LANES)
    store(to_x, rays_x)
    store(to_y, rays_y)
    lengths[RAY_COUNT], brightnesses[RAY_COUNT] = reach, 0.0
    for ray in range(RAY_COUNT):
        lengths[ray], shade = stride(sight, column, row, to_x[ray], to_y[ray], reach, begin)
        brightnesses[ray] = shade
    return load(lengths), splat(1.0), load(brightnesses)


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


@inlined
def scatter(parameters: Any, count: Any, sign: Any, size: Any) -> Any:
    """Return a count with that noise that is a share of it, from two random numbers 0..1.

    It is at most 25 % of small and 10 % of large counts and seldom that much, to either side.
    """
    largest = parameters.noise_small - count / 1000.0 * (parameters.noise_small - parameters.noise_large)
    deviation = largest * integer_power(size, parameters.noise_exponent)
    return count * (1.0 + deviation) if sign < 0.5 else count * (1.0 - parameters.noise_down * deviation)


@inlined
def jitter_of(parameters: Any, chance: Any) -> Any:
    """Return the noise that is there with nothing near, too, from the robot's own distribution."""
    return quantile(parameters.jitter_counts, parameters.jitter_point_count, chance)


@inlined
def chances(seed: Any, robot: Any, turn: Any, sensor: Any) -> Any:
    """Return the three random numbers 0..1 of a sensor's reading in a round: sign and size of the share, and jitter."""
    chance = source(seed, 0, robot, STREAM_PROXIMITY, turn)
    return draw(chance, sensor * 3), draw(chance, sensor * 3 + 1), draw(chance, sensor * 3 + 2)


@kernel
def quantize(parameters: Any, count: Any) -> Any:
    """Return a count as the converter gives it: whole steps, within its range."""
    steps = np.floor(count / parameters.step_counts + 0.5)
    return np.int64(min(max(steps * parameters.step_counts, 0.0), parameters.maximum_counts))


@inlined
def follow_near(scene: Any, robot: Any, tracks: Any) -> Any:
    """Write down the tracks of the discs that a robot's proximity sensors may see; return how many.

    Args:
        scene: What there is.
        robot: Index of the robot.
        tracks: float64 [`TRACKS_SIZE`].
    """
    robots, _, kinds, _ = scene
    state = robots[0, robot]
    parameters = kinds[state.kind]
    found = stack_integers(SEEN_LIMIT)
    reach = parameters.radius_mm + parameters.reach_mm + MOVED_MM
    count = find_near(scene, 0, state.x_mm, state.y_mm, reach + MOVED_MM, robot, found)
    return follow(scene, 0, found, count, state.x_mm, state.y_mm, reach, tracks) if count > 0 else 0


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
    tracks = stack_floats(TRACKS_SIZE)
    track_count = follow_near(scene, robot, tracks)
    for sensor in range(out.shape[0]):
        turn, instant_ns, x, y, heading = sampled_pose(state, tick_count, time_ns, sensor, is_noisy)
        moment = moment_of(tick_count, instant_ns)
        count = expected_count(sight, networks, parameters, tracks, track_count, moment, x, y, heading, sensor)
        if is_noisy:
            sign, size, jitter = chances(seed, robot, turn, sensor)
            noisy = scatter(parameters, count, sign, size) + jitter_of(parameters, jitter)
            out[sensor] = quantize(parameters, noisy)
        else:
            out[sensor] = min(count, parameters.maximum_counts)


@entry
def pose_of(robots: Any, tick_count: Any, time_ns: Any, robot: Any) -> Any:
    """Return x [mm], y [mm] and heading [rad] of a robot at a time."""
    return pose_at(robots[0, robot], tick_count, time_ns)
