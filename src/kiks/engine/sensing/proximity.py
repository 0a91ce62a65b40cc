"""The eight proximity sensors: the instants of their samples, their seven rays, and the noise of their counts.

All eight are read at once, one lane each; the rays of each are a packet of eight lanes of their own.

Source: thesis section 3.3 ("Proximity sensors", "noise model"), khepera-protocol.md 8.1 (sampling) and
kiks-behaviour.md 3.1 (rays, noise). The responses themselves are in `kiks.engine.sensing.responses`.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np
from numba import types

from kiks.engine.compiling import entry, inlined, kernel, linked, spliced
from kiks.engine.grid import find_around
from kiks.engine.numbers import at_instant, draw, sin_cos, stream_of
from kiks.engine.physics.motion import moment_of, pose_between
from kiks.engine.scene import OPEN_SCENE, open_scene
from kiks.engine.sensing.disc_rays import (
    SEEN_SIZE,
    SEEN_TOGETHER,
    TRACKS_SIZE,
    follow,
    meet_disc,
    moved_of,
    see,
    seen_by,
    sees,
)
from kiks.engine.sensing.ray_packets import PACKET_SIZE, enter, met, nothing_met, step_all
from kiks.engine.sensing.rays import leap_at
from kiks.engine.sensing.responses import REFLECTION, light_of, reflection_count, respond
from kiks.engine.simd.lanes import LANES, floor, greatest, lane_of, load, store, wide
from kiks.engine.simd.masks import anywhere, choose
from kiks.engine.simd.rasters import pick
from kiks.engine.simd.stack_arrays import stack_floats, stack_integers, stack_narrow
from kiks.model.raster import ROOM_CELLS
from kiks.model.robot import SENSOR_COUNT
from kiks.units import TICK_NS

STREAM_PROXIMITY = 2
"""Random stream of the noise; each purpose has a number of its own."""

MOVED_MM = 30.0
"""Longest path of a disc between the first sensor's sample and a reading: 20 ms at 1.5 m/s."""

READERS = 8
"""Most robots whose sensors are read together."""

Readers: Any = namedtuple("Readers", ("worlds", "robots", "ticks", "times_ns"))
"""The robots that are read together: indices of their worlds and of the robots, the ticks that their worlds have done,
and the times of the readings [ns]; each int64 [`READERS`]."""

_named_tuple: Any = types.NamedUniTuple
READERS_TYPE = _named_tuple(types.int64[::1], 4, Readers)
"""Numba's type of `Readers`."""

NOT_NEAR, NO_WALL = -2.0, -1.0
"""In place of a packet: nothing is near the sensor; or no wall, so only discs are to be looked for."""

Tracing: Any = namedtuple(
    "Tracing", ("packets", "origins", "under_way", "views", "packet_of", "tracks", "seen", "seen_ends")
)
"""Scratch memory for the rays of several robots at once.

* packets, origins, under_way: the ray packets (`kiks.engine.sensing.ray_packets`);
* views: what `view_of` returns for each robot, without the edges, float64 [`_VIEW_SIZE` per robot];
* packet_of: the packet of each sensor of each robot, `NO_WALL` or `NOT_NEAR`, float64 [8 per robot];
* tracks: tracks of the discs near one of the robots (`kiks.engine.sensing.disc_rays`);
* seen: the discs that their sensors see (`kiks.engine.sensing.disc_rays.see`), robot by robot;
* seen_ends: where those of each robot end, int64 [robot + 1]: those of robot k begin at `seen_ends[k]`.
"""

_FOUND_LIMIT = 256
_DIAGONAL = 1.4142135623730951
_ENDS_COUNT = READERS + 1
_PACKET_COUNT = READERS * SENSOR_COUNT
_PACKETS_SIZE = _PACKET_COUNT * PACKET_SIZE
_VIEW_SIZE = 4 * LANES
_VIEWS_SIZE = READERS * _VIEW_SIZE
_TURNS_SIZE = READERS * LANES
_SENSORS = np.arange(float(SENSOR_COUNT))


@kernel
def sample_instant(time_ns: Any, slot_ns: Any, round_ns: Any) -> Any:
    """Return the round in which a sensor was last sampled, and the time of that sample [ns].

    Times are float64: whole nanoseconds are exact for a hundred days. For `Lanes` of sensors the results are lanes.
    """
    turn = floor((time_ns - slot_ns) / round_ns)
    is_sampled = turn >= 0.0
    return choose(is_sampled, turn + 1.0, 0.0), choose(is_sampled, turn * round_ns + slot_ns, 0.0)


@inlined
def sensors_in_lanes() -> Any:
    """Return the indices of the sensors, `Lanes`."""
    return load(_SENSORS)


@kernel
def pose_at(robot: Any, tick_count: Any, time_ns: Any) -> Any:
    """Return x, y and heading at a time at most 20 ms before the end of the last tick."""
    ticks_ago, back = moment_of(tick_count, time_ns)
    return pose_between(robot, ticks_ago, 1.0 - back)


@kernel
def lone_pose_at(robot: Any, tick_count: Any, time_ns: Any) -> Any:
    """Return what `pose_at` does, to the bit, for one time: at the end of the last tick no arc is to be followed."""
    # Not simply the present pose: these sums round as the arc does at its end.
    if time_ns != tick_count * TICK_NS:
        return pose_at(robot, tick_count, time_ns)
    trail = robot.trail
    return (
        trail[0, 0] + (robot.x_mm - trail[0, 0]),
        trail[0, 1] + (robot.y_mm - trail[0, 1]),
        trail[0, 2] + (robot.heading_rad - trail[0, 2]),
    )


@kernel
def sampled_pose(robot: Any, tick_count: Any, time_ns: Any, slot_ns: Any, round_ns: Any, is_sampled: Any) -> Any:
    """Return a sensor's round, its instant [ns], and x, y and heading then; without sampling, those of now.

    For `Lanes` of sensors, lanes.
    """
    turn, instant_ns = sample_instant(time_ns, slot_ns, round_ns)
    # Expected counts are those of the present: all sensors look at once.
    if not is_sampled:
        turn, instant_ns = 0.0 * slot_ns, 0.0 * slot_ns + time_ns
    x, y, heading = pose_at(robot, tick_count, instant_ns)
    return turn, instant_ns, x, y, heading


@spliced
def make_readers() -> Any:
    """Return space for the readings of some robots on the stack."""
    return Readers(stack_integers(READERS), stack_integers(READERS), stack_integers(READERS), stack_integers(READERS))


@spliced
def make_tracing() -> Any:
    """Return scratch memory on the stack."""
    seen_ends = stack_integers(_ENDS_COUNT)
    seen_ends[0] = 0
    return Tracing(
        stack_narrow(_PACKETS_SIZE),
        stack_integers(_PACKET_COUNT),
        stack_integers(_PACKET_COUNT),
        stack_floats(_VIEWS_SIZE),
        stack_floats(_PACKET_COUNT),
        stack_floats(TRACKS_SIZE),
        stack_floats(SEEN_SIZE),
        seen_ends,
    )


@kernel
def begin_rays(
    walls: Any,
    parameters: Any,
    is_all: Any,
    moments: Any,
    poses: Any,
    disc_count: Any,
    tracing: Any,
    k: Any,
    first: Any,
) -> Any:
    """Begin the rays of all sensors of a robot, each from its own pose.

    Args:
        walls: The walls as rays see them.
        parameters: Record of the robot's constants.
        is_all: Whether to follow also the rays of sensors that nothing is near enough to.
        moments: The time of each sensor, `Lanes` (`kiks.engine.physics.motion.moment_of`).
        poses: The robot's x and y [mm] and heading [rad] at those times, `Lanes`.
        disc_count: Number of tracks of discs near it.
        tracing: Scratch memory (`Tracing`).
        k: The robot's number among those that are read together.
        first: The first free packet.

    Returns:
        The next free packet.
    """
    per_cell = 1.0 / walls.cell_mm
    view = view_of(parameters, poses)
    room_mm = room_around(walls, parameters, poses)
    is_near = poses[0] < poses[0]
    # One look-up often shows that no wall is near any sensor; eight would wait for the memory eight times.
    if room_mm <= parameters.watch_reach_mm:
        watch_x, watch_y = on_body(*poses[:2], *view[5], load(parameters.watch_x_mm), load(parameters.watch_y_mm))
        # Outside this circle nothing makes a sensor respond.
        leaps = leap_at(walls, watch_x * per_cell + walls.pad, watch_y * per_cell + walls.pad)
        is_near = leaps <= load(parameters.watch_mm) * per_cell
    tracing.seen_ends[k + 1] = tracing.seen_ends[k]
    if disc_count > 0:
        end, is_seeing = see(walls, tracing.tracks, 0, disc_count, moments, view, tracing.seen, tracing.seen_ends[k])
        tracing.seen_ends[k + 1] = end
        is_near = is_near | is_seeing
    # Until a packet is entered, a near sensor looks for discs alone.
    packet_of = tracing.packet_of[SENSOR_COUNT * k :]
    store(packet_of, choose(is_near, NO_WALL, NOT_NEAR))
    if is_all or anywhere(is_near):
        its = tracing.views[_VIEW_SIZE * k :]
        store(its, view[0])
        store(its[LANES:], view[1])
        store(its[2 * LANES :], view[5][0])
        store(its[3 * LANES :], view[5][1])
        for sensor in range(SENSOR_COUNT):
            if is_all or packet_of[sensor] != NOT_NEAR:
                packet_of[sensor] = NO_WALL
                # With no wall in reach, no ray is followed: only discs are looked for.
                if room_mm <= parameters.ray_reach_mm:
                    origin, rays = rays_of(walls, parameters, tracing, k, sensor)
                    enter(
                        walls, tracing.packets, tracing.origins, first, *origin, *rays, parameters.reach_mm * per_cell
                    )
                    packet_of[sensor] = first
                    first += 1
    return first


@inlined
def follow_rays(walls: Any, tracing: Any, packet_count: Any) -> Any:
    """Follow the rays of all robots whose rays have begun."""
    step_all(walls, tracing.packets, tracing.origins, tracing.under_way, packet_count)


@inlined
def end_rays(walls: Any, parameters: Any, has_faces: Any, tracing: Any, k: Any, sensor: Any) -> Any:
    """Return the hits of a sensor's rays that `follow_rays` has followed; most arguments are those of `begin_rays`.

    Args:
        walls: The walls.
        parameters: The robot's constants.
        has_faces: Whether walls have smooth surfaces.
        tracing: Scratch memory.
        k: The robot's number.
        sensor: Index of the sensor.

    Returns:
        Lengths [mm], cosines of the angles of incidence, and brightnesses, 0 for nothing, `Lanes`.
    """
    packet = np.int64(tracing.packet_of[SENSOR_COUNT * k + sensor])
    lengths, cosines, brightnesses = nothing_met(parameters.reach_mm * (1.0 / walls.cell_mm))
    if packet >= 0:
        lengths, cosines, brightnesses = met(walls, has_faces, tracing.packets, tracing.origins, packet)
    for disc in range(tracing.seen_ends[k], tracing.seen_ends[k + 1]):
        if sees(tracing.seen, disc, sensor):
            origin, rays = rays_of(walls, parameters, tracing, k, sensor)
            hits = lengths, cosines, brightnesses
            lengths, cosines, brightnesses = meet_disc(seen_by(tracing.seen, disc, sensor), *origin, *rays, *hits)
    return lengths * walls.cell_mm, cosines, brightnesses


@inlined
def room_around(walls: Any, parameters: Any, poses: Any) -> Any:
    """Return a distance from a robot within which no look-up finds a wall, from any of its poses [mm].

    That is the clearance, less the way to the other poses and less three diagonals of cells, as places and distances
    are rounded to cells. The least one in its block is enough, if it is beyond all rays: the table of blocks is in the
    processor's cache, the raster is not.
    """
    x, y, _ = poses
    centre_x, centre_y = lane_of(x, 0), lane_of(y, 0)
    moved_mm = _DIAGONAL * greatest(max(abs(x - centre_x), abs(y - centre_y)))
    per_cell = 1.0 / walls.cell_mm
    column, row = centre_x * per_cell + walls.pad, centre_y * per_cell + walls.pad
    less_mm, per_block = moved_mm + 3.0 * _DIAGONAL * walls.cell_mm, 1.0 / ROOM_CELLS
    room_mm = pick(walls.rooms, column * per_block, row * per_block) - less_mm
    # The block says that a wall may be near; now its cell decides.
    if room_mm <= parameters.ray_reach_mm:
        room_mm = pick(walls.clearance, column, row) - less_mm
    return room_mm


@inlined
def view_of(parameters: Any, poses: Any) -> Any:
    """Return what all sensors of a robot see, each from a pose of its own, as `see` takes it.

    Returns:
        The origins of their rays, x and y [mm]; the directions of their leftmost and rightmost rays, cosines and sines;
        the length of the rays [mm]; sines and cosines of the robot's headings. All but the length are `Lanes`.
    """
    x, y, heading = poses
    sine, cosine = sin_cos(heading)
    left = turned(parameters.edge_cos[0], parameters.edge_sin[0], sine, cosine)
    right = turned(parameters.edge_cos[1], parameters.edge_sin[1], sine, cosine)
    x, y = on_body(x, y, sine, cosine, load(parameters.ray_x_mm), load(parameters.ray_y_mm))
    return x, y, left, right, parameters.reach_mm, (sine, cosine)


@inlined
def rays_of(walls: Any, parameters: Any, tracing: Any, k: Any, sensor: Any) -> Any:
    """Return the origin of a sensor's rays, column and row [cells], and their directions, cosines and sines."""
    place, per_cell = _VIEW_SIZE * k + sensor, 1.0 / walls.cell_mm
    x, y = tracing.views[place], tracing.views[place + LANES]
    sine, cosine = tracing.views[place + 2 * LANES], tracing.views[place + 3 * LANES]
    rays = turned(parameters.ray_cos[sensor], parameters.ray_sin[sensor], sine, cosine)
    return (x * per_cell + walls.pad, y * per_cell + walls.pad), rays


@inlined
def on_body(x: Any, y: Any, sine: Any, cosine: Any, ahead: Any, aside: Any) -> Any:
    """Return a place of a robot's body [mm], x and y, from where it is relative to its centre."""
    return x + ahead * cosine - aside * sine, y + ahead * sine + aside * cosine


@inlined
def turned(cosines: Any, sines: Any, sine: Any, cosine: Any) -> Any:
    """Return directions on a robot that is turned, cosines and sines, `Lanes`, from arrays of them."""
    return load(cosines) * cosine - load(sines) * sine, load(cosines) * sine + load(sines) * cosine


@kernel
def expected_counts(scene: Any, parameters: Any, tracing: Any, k: Any, counts: Any) -> Any:
    """Write the mean counts of a robot's sensors into `counts`, float64 [8], without an upper limit.

    Its rays have been followed; arguments as for `end_rays`.
    """
    is_reflection = parameters.response == REFLECTION
    store(counts, wide(0.0))
    for sensor in range(SENSOR_COUNT):
        if tracing.packet_of[SENSOR_COUNT * k + sensor] != NOT_NEAR:
            hits = end_rays(scene.walls, parameters, is_reflection, tracing, k, sensor)
            # Light is summed here for each sensor, and turned into counts for all eight at once below.
            if is_reflection:
                counts[sensor] = light_of(parameters, sensor, *hits)
            else:
                counts[sensor] = respond(scene.networks, parameters, sensor, *hits)
    above = load(counts)
    if is_reflection:
        above = reflection_count(parameters, load(parameters.threshold), load(parameters.gain), above)
        above = choose(load(tracing.packet_of, SENSOR_COUNT * k) != NOT_NEAR, above, 0.0)
    store(counts, load(parameters.baseline_counts) + above)


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
def quantize(parameters: Any, count: Any, maximum_counts: Any) -> Any:
    """Return a count in the steps and the range of the converter; of one robot or eight."""
    steps = floor(count / parameters.step_counts + 0.5)
    return min(max(0.0, steps * parameters.step_counts), maximum_counts)


@inlined
def track_around(scene: Any, world: Any, robot: Any, x: Any, y: Any, tracks: Any) -> Any:
    """List the tracks of the discs that a robot's proximity sensors might see from a place; return their number.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        world: Index of the world.
        robot: Index of the robot.
        x: The place [mm].
        y: The place [mm].
        tracks: float64 [`TRACKS_SIZE`].
    """
    state = scene.robots[world, robot]
    parameters = scene.kinds[state.kind]
    found = stack_integers(_FOUND_LIMIT)
    reach_mm = parameters.ray_reach_mm + moved_of(state)
    count = find_around(scene, world, x, y, reach_mm + MOVED_MM, robot, found)
    return follow(scene, world, found, count, x, y, reach_mm, tracks) if count > 0 else 0


@kernel
def sense_proximity(scene: Any, readers: Any, count: Any, is_noisy: Any, out: Any) -> Any:
    """Write the eight counts that command N returns to some robots into `out`, each sampled at its own instant.

    The rays of the robots are followed together, as far as there is room for the discs that they see: while some wait
    for the memory, others go on.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        readers: Which robots, and when (`Readers`).
        count: Their number.
        is_noisy: False for the expected counts at the present pose, without rounding.
        out: float64, shape [`READERS`, 8].
    """
    tracing, turns, counts = make_tracing(), stack_floats(_TURNS_SIZE), stack_floats(LANES)
    first = 0
    while first < count:
        end, packet_count, tracing.seen_ends[first] = first, 0, 0
        while end < count:
            world, robot, tick_count = readers.worlds[end], readers.robots[end], readers.ticks[end]
            state = scene.robots[world, robot]
            parameters = scene.kinds[state.kind]
            disc_count = track_around(scene, world, robot, state.x_mm, state.y_mm, tracing.tracks)
            # No more room for the discs of this robot: it is read in the next round. One robot alone always has room.
            if tracing.seen_ends[end] + disc_count > SEEN_TOGETHER:
                break
            time_ns = 1.0 * readers.times_ns[end]
            slots = load(parameters.slot_ns), parameters.round_ns
            turn, instants_ns, x, y, heading = sampled_pose(state, tick_count, time_ns, *slots, is_noisy)
            store(turns[LANES * end :], turn)
            given = moment_of(tick_count, instants_ns), (x, y, heading), disc_count
            packet_count = begin_rays(scene.walls, parameters, False, *given, tracing, end, packet_count)
            end += 1
        follow_rays(scene.walls, tracing, packet_count)
        for k in range(first, end):
            world, robot = readers.worlds[k], readers.robots[k]
            parameters = scene.kinds[scene.robots[world, robot].kind]
            expected_counts(scene, parameters, tracing, k, counts)
            if is_noisy:
                stream = stream_of(scene.seeds[world], 0, robot, STREAM_PROXIMITY)
                add_noise(parameters, stream, load(turns[LANES * k :]), counts)
            else:
                store(counts, min(load(counts), parameters.maximum_counts))
            for sensor in range(SENSOR_COUNT):
                out[k, sensor] = counts[sensor]
        first = end


@inlined
def add_noise(parameters: Any, stream: Any, turns: Any, counts: Any) -> Any:
    """Add the noise of a reading to mean counts, float64 [8], and round them."""
    jitters = stack_floats(LANES)
    sign, size, chance = chances(stream, turns, sensors_in_lanes())
    store(jitters, chance)
    for sensor in range(SENSOR_COUNT):
        jitters[sensor] = jitter_of(parameters, jitters[sensor])
    noisy = scatter(parameters, load(counts), sign, size) + load(jitters)
    store(counts, quantize(parameters, noisy, parameters.maximum_counts))


@linked(types.void(OPEN_SCENE, READERS_TYPE, types.int64, types.boolean, types.float64[:, ::1]))
def sense_linked(scene: Any, readers: Any, count: Any, is_noisy: Any, out: Any) -> Any:
    """Do what `sense_proximity` does. A batch, whose readings are noisy, has that in its own code, a tenth faster."""
    sense_proximity(scene, readers, count, is_noisy, out)


@entry
def read_proximity(scene: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, out: Any) -> Any:
    """Write the eight counts that command N returns to a robot of the first world at a time into `out`.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        robot: Index of the robot.
        tick_count: Ticks done.
        time_ns: Time of the reading [ns].
        is_noisy: False for the expected counts at the present pose, without rounding.
        out: float64, shape [8].
    """
    readers = make_readers()
    readers.worlds[0], readers.robots[0], readers.ticks[0], readers.times_ns[0] = 0, robot, tick_count, time_ns
    sense_linked(open_scene(scene[0]), readers, 1, is_noisy, out.reshape((1, out.shape[0])))


@entry
def pose_of(robots: Any, tick_count: Any, time_ns: Any, robot: Any) -> Any:
    """Return x [mm], y [mm] and heading [rad] of a robot at a time."""
    return pose_at(robots[0, robot], tick_count, time_ns)
