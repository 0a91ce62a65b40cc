"""Measurements of a robot during its calibration.

A run is a movement at constant wheel speeds in front of a straight wall, during which counters and sensors are read in
turn. The fit treats all runs alike, whether the robot spins, drives along the wall or drives towards it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from kiks.client.khepera import Khepera
from kiks.errors import KiksError, LinkError
from kiks.model.robot import RobotSpec
from kiks.units import character_ns, s_from_ns

Array = NDArray[np.float64]

SPIN_TURNS = 2.5
"""Turns of a spin: the robot faces the wall more than once, which shows the wheel base and averages readings."""

SPIN_SPEED_PULSES, DRIVE_SPEED_PULSES = 4, 4
"""Wheel speeds [pulses/10 ms]: slow, as a reading is up to 20 ms old."""

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
class Run:
    """The record of one movement, or of several without a new placement in between.

    Attributes:
        gap_mm: Distance from wall to rim at the start [mm].
        pulses: Counters at the instant of each reading, zero at the start [pulses], shape [sample, 2].
        counts: Proximity readings, shape [sample, 8].
        end_pulses: Counters after the robot had come to rest, left and right.
        is_marked: Whether a mark gives the gap; otherwise it is approximate.
    """

    gap_mm: float
    pulses: Array
    counts: Array
    end_pulses: tuple[int, int]
    is_marked: bool = True

    def turned_pulses(self) -> int:
        """Return the right minus the left counter at the end of the run [pulses]; positive for turns to the left."""
        return self.end_pulses[1] - self.end_pulses[0]

    def then(self, after: Run) -> Run:
        """Return this run and one that began where it ended as one run."""
        left, right = self.end_pulses
        return replace(
            self,
            pulses=np.vstack((self.pulses, after.pulses + self.end_pulses)),
            counts=np.vstack((self.counts, after.counts)),
            end_pulses=(left + after.end_pulses[0], right + after.end_pulses[1]),
        )

    def thinned(self, step: int) -> Run:
        """Return the run with every `step`-th reading only."""
        return replace(self, pulses=self.pulses[::step], counts=self.counts[::step])


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
    gap_mm: float,
    left: int,
    right: int,
    limit_pulses: float,
    is_done: Callable[[list[int]], bool] = lambda counts: False,
) -> Run:
    """Let a robot move until a wheel has turned far enough, or a reading ends the run.

    Args:
        robot: The robot.
        gap_mm: Distance from wall to rim at the start [mm].
        left: Speed of the left wheel [pulses/10 ms].
        right: Speed of the right wheel [pulses/10 ms].
        limit_pulses: Counter of a wheel at which the run ends [pulses].
        is_done: Called with each reading; returns whether the run ends.

    Raises:
        CalibrationError: If the wheels do not turn far enough in time.
        LinkError: If the robot does not answer.
    """
    asked_s: list[float] = []
    counters: list[tuple[int, int]] = []
    read_s: list[float] = []
    readings: list[list[int]] = []
    allowed_s = 2.0 + 1.5 * limit_pulses / (PULSES_PER_S * max(abs(left), abs(right)))
    robot.set_encoders(0, 0)
    start_s = robot.time_s
    try:
        robot.set_speed(left, right)
        while True:
            asked_s.append(robot.time_s)
            counters.append(robot.encoders())
            turned = max(map(abs, counters[-1]))
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
    return Run(gap_mm, np.stack(pulses, axis=1), np.array(readings, np.float64), robot.encoders())


def spin(robot: Khepera, spec: RobotSpec, gap_mm: float, turns: float) -> Run:
    """Turn on the spot; positive turns are to the left. `spec` gives the wheel base.

    Raises:
        CalibrationError: If the wheels do not turn.
        LinkError: If the robot does not answer.
    """
    speed = SPIN_SPEED_PULSES if turns > 0 else -SPIN_SPEED_PULSES
    wheel_path_mm = abs(turns) * math.pi * spec.body.wheel_base_mm
    return record(robot, gap_mm, -speed, speed, wheel_path_mm / spec.body.pulse_mm)


def drive(
    robot: Khepera,
    spec: RobotSpec,
    gap_mm: float,
    distance_mm: float,
    is_done: Callable[[list[int]], bool] = lambda counts: False,
) -> Run:
    """Drive straight over a distance [mm], backwards if it is negative. `spec` gives the pulse length.

    Raises:
        CalibrationError: If the wheels do not turn.
        LinkError: If the robot does not answer.
    """
    speed = DRIVE_SPEED_PULSES if distance_mm > 0 else -DRIVE_SPEED_PULSES
    return record(robot, gap_mm, speed, speed, abs(distance_mm) / spec.body.pulse_mm, is_done)


@dataclass(frozen=True)
class Rest:
    """Readings of a robot that stands still [counts], shape [sample, 8]."""

    counts: Array

    def jitter(self) -> Array:
        """Return evenly spaced quantiles of all readings minus the mean of their sensor, ascending [counts]."""
        deviations = self.counts - self.counts.mean(axis=0)
        jitter: Array = np.quantile(deviations, np.linspace(0.0, 1.0, JITTER_POINTS))
        return jitter

    def deviation(self) -> Array:
        """Return the mean absolute deviation of each sensor from its mean [counts]."""
        deviation: Array = np.abs(self.counts - self.counts.mean(axis=0)).mean(axis=0)
        return deviation


def rest(robot: Khepera, sample_count: int) -> Rest:
    """Read the sensors of a robot that stands still, each time a fresh sample.

    Raises:
        LinkError: If the robot does not answer.
    """
    robot.pause(SETTLE_S)
    readings = []
    for _ in range(sample_count):
        readings.append(robot.proximity())
        robot.pause(0.02)
    return Rest(np.array(readings, np.float64))


def processing_ms(robot: Khepera, baud: int, exchange_count: int = 40) -> float:
    """Return the time that the robot takes to process a command, from the median of several exchanges [ms].

    Raises:
        LinkError: If the robot does not answer.
    """
    times_s = []
    characters = 0
    for _ in range(exchange_count):
        start_s = robot.time_s
        reply = robot.send("B")
        times_s.append(robot.time_s - start_s)
        characters = len("B\n") + len(reply) + len("\r\n")
    return max(1000.0 * (float(np.median(times_s)) - characters * s_from_ns(character_ns(baud))), 0.0)
