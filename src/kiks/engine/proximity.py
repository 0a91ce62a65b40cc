"""The eight proximity sensors: when each was sampled, its seven rays, the response to them, and the noise.

Source: thesis section 3.3 ("Proximity sensors", "noise model"), khepera-protocol.md 8.1 (sampling) and
kiks-behaviour.md 3.1 (rays, colour) and 3.1.1 (the response: a compact stand-in for the measured one).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel
from kiks.engine.motion import pose_between
from kiks.engine.numbers import exponential, power, sin_cos, uniform
from kiks.engine.parameters import RAY_COUNT
from kiks.engine.rays import cast, free_cells, scale
from kiks.units import SENSOR_ROUND_NS, SENSOR_SLOT_NS, TICK_NS

STREAM_SLIP, STREAM_PROXIMITY = 1, 2
"""Random streams: whoever draws has a number of his own."""

_WEIGHTS = (0.35, 0.33, 0.69, 0.43, 0.69, 0.33, 0.35)  # kiks-behaviour.md 3.1.1
_MARGIN = 0.06  # of the range


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
def nearness(range_share: Any, brightness: Any) -> Any:
    """Return what the response makes of a ray: 1 at the sensor, 0 out of range, less for a dark surface.

    The length, a share of the sensor's range, is inverted; black counts half of white (thesis 3.4, "Proximity sensor
    colour sensitivity"). The margin is what the sampled rays of KiKS 2.2.0 add (kiks-behaviour.md 3.1).
    """
    if brightness == 0:
        return 0.0
    inverted = min(max(1.0 + _MARGIN - range_share, 0.0), 0.98)
    return inverted * (0.5 + brightness * (0.5 / 255.0))


@kernel
def respond(nearnesses: Any) -> Any:
    """Return the expected count for seven nearnesses (kiks-behaviour.md 3.1.1)."""
    total = 0.0
    for ray in range(RAY_COUNT):
        root = math.sqrt(nearnesses[ray])
        total += _WEIGHTS[ray] * nearnesses[ray] * root * math.sqrt(root)  # to the power of 1.75
    if total == 0.0:
        return 0.0
    return 1023.0 * (1.0 - exponential(-power(total, 1.61)))


@kernel
def expected_count(sight: Any, parameters: Any, x: Any, y: Any, heading: Any, sensor: Any) -> Any:
    """Return the count that a sensor of a robot at this pose gives on average."""
    sine, cosine = sin_cos(heading)
    mount_x, mount_y = parameters.mount_x_mm[sensor], parameters.mount_y_mm[sensor]
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    column = (x + mount_x * cosine - mount_y * sine) * per_cell + pad
    row = (y + mount_x * sine + mount_y * cosine) * per_cell + pad
    reach = parameters.range_mm * (1.0 + _MARGIN) * per_cell
    if free_cells(sight, column, row) > reach:
        return parameters.baseline_counts[sensor]
    per_range = cell / parameters.range_mm
    seen = np.empty(RAY_COUNT, np.float64)
    for ray in range(RAY_COUNT):
        ray_x, ray_y = parameters.ray_cos[sensor, ray], parameters.ray_sin[sensor, ray]
        direction_x = ray_x * cosine - ray_y * sine
        direction_y = ray_x * sine + ray_y * cosine
        length, brightness = cast(sight, column, row, direction_x, direction_y, reach)
        seen[ray] = nearness(length * per_range, brightness)
    return parameters.baseline_counts[sensor] + parameters.gain[sensor] * respond(seen)


@kernel
def integer_power(base: Any, exponent: Any) -> Any:
    """Return a number to a whole, positive power by multiplication alone."""
    result = 1.0
    for _ in range(exponent):
        result *= base
    return result


@kernel
def add_noise(parameters: Any, count: Any, sign: Any, size: Any, jitter: Any) -> Any:
    """Return a count with noise: at most 25 % of small and 10 % of large readings, and seldom that much."""
    largest = parameters.noise_small - count / 1000.0 * (parameters.noise_small - parameters.noise_large)
    deviation = largest * integer_power(size, parameters.noise_exponent)
    noisy = count * (1.0 + deviation) if sign < 0.5 else count * (1.0 - deviation)
    return noisy + parameters.noise_counts * (2.0 * jitter - 1.0)


@kernel
def quantize(parameters: Any, count: Any) -> Any:
    """Return a count as the converter gives it: whole steps, within its range."""
    steps = np.floor(count / parameters.step_counts + 0.5)
    return np.int64(min(max(steps * parameters.step_counts, 0.0), parameters.maximum_counts))


@entry
def read_proximity(
    robots: Any,
    kinds: Any,
    sight: Any,
    tick_count: Any,
    time_ns: Any,
    seed: Any,
    robot: Any,
    is_noisy: Any,
    out: Any,
) -> Any:
    """Write the eight counts that command N returns at a time into `out`, each sampled at its own instant.

    Args:
        robots: Records of `ROBOT`, shape [world_count, robot_count].
        kinds: Records of `PARAMETERS`, shape [robot_count].
        sight: What rays meet (`kiks.engine.rays`).
        tick_count: Ticks done.
        time_ns: When the robot reads.
        seed: Seed of the run.
        robot: Index of the robot.
        is_noisy: False for the expected counts at the pose of this very time, without rounding.
        out: int64, or float64 for expected counts, shape [8].
    """
    state, parameters = robots[0, robot], kinds[robot]
    for sensor in range(out.shape[0]):
        turn, instant_ns = sample_instant(time_ns, sensor) if is_noisy else (np.int64(0), time_ns)
        x, y, heading = pose_at(state, tick_count, instant_ns)
        count = expected_count(sight, parameters, x, y, heading, sensor)
        if is_noisy:
            sign = uniform(seed, 0, robot, STREAM_PROXIMITY, turn, sensor * 3)
            size = uniform(seed, 0, robot, STREAM_PROXIMITY, turn, sensor * 3 + 1)
            jitter = uniform(seed, 0, robot, STREAM_PROXIMITY, turn, sensor * 3 + 2)
            count = quantize(parameters, add_noise(parameters, count, sign, size, jitter))
        out[sensor] = count


@entry
def pose_of(robots: Any, tick_count: Any, time_ns: Any, robot: Any) -> Any:
    """Return x [mm], y [mm] and heading [rad] of a robot at a time."""
    return pose_at(robots[0, robot], tick_count, time_ns)
