"""Measurements of a robot over its line: it stands and is read, or it moves and is read together with its counters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kiks.client.khepera import Khepera
from kiks.errors import KiksError, LinkError
from kiks.units import character_ns, s_from_ns

Array = NDArray[np.float64]

LEAD_S = 0.005
"""Age of a reading minus age of counters read at the same instant [s]: 10 ms on average against 5
(khepera-protocol.md 8.1 and 6.1)."""

SETTLE_S = 0.4
"""Time after a stop until the robot certainly stands still [s]."""

JITTER_POINTS = 26
"""Number of quantiles that describe the distribution of the jitter: 4 % of the readings lie between two."""

PULSES_PER_S = 100
"""Wheel speed 1 is a pulse every 10 ms."""


class CalibrationError(KiksError):
    """A measurement shows something unexpected, or measurements contradict each other."""


@dataclass(frozen=True)
class Track:
    """What was read during one movement.

    Attributes:
        path: Counters, left and right, at the start, at the instant of each reading, and after the stop [pulses], shape
            [samples + 2, 2].
        counts: Proximity readings, shape [samples, 8].
    """

    path: Array
    counts: NDArray[np.int64]


def halt(robot: Khepera) -> None:
    """Stop the robot, even if replies of earlier commands are still on the line: each of them costs an attempt."""
    for attempt in range(4):
        try:
            robot.stop()
            return
        except LinkError:
            if attempt == 3:
                return


def record(
    robot: Khepera,
    left: int,
    right: int,
    limit_pulses: float,
    is_done: Callable[[list[int]], bool] = lambda counts: False,
) -> Track:
    """Let a robot move until a wheel has turned far enough, or a reading ends the movement.

    Args:
        robot: The robot.
        left: Speed of the left wheel [pulses/10 ms].
        right: Speed of the right wheel [pulses/10 ms].
        limit_pulses: How far a wheel turns [pulses].
        is_done: Called with each reading; returns whether the movement ends.

    Raises:
        CalibrationError: If the wheels do not turn far enough in time.
        LinkError: If the robot does not answer.
    """
    asked_s: list[float] = []
    counters: list[tuple[int, int]] = []
    read_s: list[float] = []
    readings: list[list[int]] = []
    allowed_s = 2.0 + 1.5 * limit_pulses / (PULSES_PER_S * max(abs(left), abs(right)))
    start_s = robot.time_s
    try:
        robot.set_speed(left, right)
        while True:
            asked_s.append(robot.time_s)
            counters.append(robot.encoders())
            turned = max(abs(now - first) for now, first in zip(counters[-1], counters[0], strict=True))
            if turned >= limit_pulses or (readings and is_done(readings[-1])):
                break
            if asked_s[-1] - start_s > allowed_s:
                raise CalibrationError(
                    f"the wheels must turn {limit_pulses:.0f} pulses in {allowed_s:.0f} s, but they turned {turned}. "
                    "Is the battery charged, the robot on the floor and nothing in its way?"
                )
            read_s.append(robot.time_s)
            readings.append(robot.proximity())
    finally:
        halt(robot)
    robot.pause(SETTLE_S)
    instants_s = np.array(read_s) - LEAD_S
    pulses = [np.interp(instants_s, asked_s, [pair[wheel] for pair in counters]) for wheel in (0, 1)]
    path = np.vstack((counters[0], np.stack(pulses, axis=1), robot.encoders()))
    return Track(path, np.array(readings, np.int64))


def rest(robot: Khepera, sample_count: int) -> Array:
    """Return readings of a robot that stands still, each a fresh sample [counts], shape [samples, 8]."""
    robot.pause(SETTLE_S)
    readings = []
    for _ in range(sample_count):
        readings.append(robot.proximity())
        robot.pause(0.02)
    return np.array(readings, np.float64)


def jitter(readings: Array) -> Array:
    """Return evenly spaced quantiles of all readings minus the mean of their sensor, ascending [counts]."""
    quantiles: Array = np.quantile(readings - readings.mean(axis=0), np.linspace(0.0, 1.0, JITTER_POINTS))
    return quantiles


def deviation(readings: Array) -> Array:
    """Return the mean absolute deviation of each sensor from its mean [counts]."""
    deviations: Array = np.abs(readings - readings.mean(axis=0)).mean(axis=0)
    return deviations


def processing_ms(robot: Khepera, baud: int, exchange_count: int = 40) -> float:
    """Return the time that the robot takes to process a command, from the median of several exchanges [ms]."""
    times_s = []
    characters = 0
    for _ in range(exchange_count):
        start_s = robot.time_s
        reply = robot.send("B")
        times_s.append(robot.time_s - start_s)
        characters = len("B\n") + len(reply) + len("\r\n")
    return max(1000.0 * (float(np.median(times_s)) - characters * s_from_ns(character_ns(baud))), 0.0)
