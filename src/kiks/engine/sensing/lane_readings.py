"""Proximity readings of eight lone robots at once: the counts of command N, with the same bits.

A program that drives many worlds spends most of its time reading sensors. Poses, places of sensors, the clearance
around them and noise are computed for eight robots at a time, as `Lanes`, by the functions that read one robot. Only
sensors near something need more: their ray packets, those of all robots and sensors together, step in turn
(`kiks.engine.sensing.ray_packets`).
"""

from __future__ import annotations

from typing import Any

from kiks.engine.compiling import kernel
from kiks.engine.numbers import sin_cos, stream_of
from kiks.engine.parameters import PARAMETERS
from kiks.engine.sensing.proximity import (
    STREAM_PROXIMITY,
    aim,
    chances,
    jitter_of,
    mount,
    quantize,
    sampled_pose,
    scatter,
    watched,
)
from kiks.engine.sensing.ray_packets import WAY_SIZE, enter, follow, met
from kiks.engine.sensing.rays import leap_at, scale
from kiks.engine.sensing.responses import REFLECTION, respond
from kiks.engine.simd.f64x8 import LANES, lane_of, load, store
from kiks.engine.simd.masks import choose
from kiks.engine.simd.records import record8_of
from kiks.engine.simd.stack_arrays import stack_floats, stack_integers, stack_narrow
from kiks.model.robot import SENSOR_COUNT

EIGHT_SENSES = record8_of(
    PARAMETERS,
    (
        *("ray_x_mm", "ray_y_mm", "watch_x_mm", "watch_y_mm", "watch_mm"),
        *("baseline_counts", "maximum_counts", "step_counts"),
        *("noise_small", "noise_large", "noise_exponent", "noise_down"),
    ),
)
"""The constants of eight robots that readings use as lanes."""

# Eight robots have 64 sensors; sizes of stack arrays must be constants of their own.
_FANS = 64
_WAYS_SIZE = _FANS * WAY_SIZE


@kernel
def read_eight(
    robots: Any, senses: Any, which: Any, kinds: Any, sight: Any, networks: Any, times_ns: Any, seeds: Any, out: Any
) -> Any:
    """Write the counts that command N returns at eight times in eight worlds, each with a lone robot.

    Args:
        robots: `Record8` of `EIGHT`, with the number of ticks of each.
        senses: `Record8` of `EIGHT_SENSES`.
        which: Index of each robot's kind, int64 [8].
        kinds: Records of `PARAMETERS`, one for each kind.
        sight: The arena as rays see it (`kiks.engine.sensing.rays`).
        networks: As `kiks.engine.sensing.proximity.read_proximity` takes them.
        times_ns: Time of each reading [ns], `Lanes`.
        seeds: Seeds of the runs, `Words`.
        out: int64 or float64, shape [8, 8]: a row for each robot.
    """
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    turns, counts, nears = stack_floats(_FANS), stack_floats(_FANS), stack_floats(_FANS)
    xs, ys, sines, cosines = stack_floats(_FANS), stack_floats(_FANS), stack_floats(_FANS), stack_floats(_FANS)
    for sensor in range(SENSOR_COUNT):
        place = LANES * sensor
        turn, _, x, y, heading = sampled_pose(robots, robots.tick_count, times_ns, sensor, True)
        sine, cosine = sin_cos(heading)
        watch_x, watch_y = watched(senses, x, y, sine, cosine, sensor)
        leaps = leap_at(sight, watch_x * per_cell + pad, watch_y * per_cell + pad)
        store(nears[place:], choose(leaps <= senses.watch_mm[sensor] * per_cell, 1.0, 0.0))
        x, y = mount(senses, x, y, sine, cosine, sensor)
        store(turns[place:], turn)
        store(counts[place:], senses.baseline_counts[sensor])
        store(xs[place:], x * per_cell + pad)
        store(ys[place:], y * per_cell + pad)
        store(sines[place:], sine)
        store(cosines[place:], cosine)
    ways, origins = stack_narrow(_WAYS_SIZE), stack_integers(_FANS)
    under_way, whose = stack_integers(_FANS), stack_integers(_FANS)
    fan_count = 0
    for lane in range(LANES):
        parameters = kinds[which[lane]]
        reach = parameters.reach_mm * per_cell
        for sensor in range(SENSOR_COUNT):
            k = LANES * sensor + lane
            if nears[k] > 0.0:
                rays_x, rays_y = aim(parameters, sines[k], cosines[k], sensor)
                enter(sight, ways, origins, fan_count, xs[k], ys[k], rays_x, rays_y, reach)
                whose[fan_count] = k
                fan_count += 1
    follow(sight, ways, origins, under_way, fan_count)
    for fan in range(fan_count):
        k = whose[fan]
        parameters, sensor = kinds[which[k % LANES]], k // LANES
        lengths, squares, shades = met(sight, parameters.response == REFLECTION, ways, origins, fan)
        counts[k] += respond(networks, parameters, sensor, lengths * cell, squares, shades)
    stream = stream_of(seeds, 0, 0, STREAM_PROXIMITY)
    for sensor in range(SENSOR_COUNT):
        sign, size, chance = chances(stream, load(turns[LANES * sensor :]), sensor)
        jitters = stack_floats(LANES)
        for lane in range(LANES):
            jitters[lane] = jitter_of(kinds[which[lane]], lane_of(chance, lane))
        noisy = scatter(senses, load(counts[LANES * sensor :]), sign, size) + load(jitters)
        quantized = quantize(senses, noisy)
        for lane in range(LANES):
            out[lane, sensor] = lane_of(quantized, lane)
