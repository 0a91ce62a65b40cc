"""Measurements of a robot over its line: it stands and is read, or it moves and is read together with its counters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kiks.client.serial_robot import SerialRobot
from kiks.errors import KiksError, LinkError
from kiks.firmware.robot_kind import robot_kind
from kiks.model.robot import SENSOR_COUNT, RobotSpec
from kiks.units import TICK_NS, character_ns, s_from_ns

Array = NDArray[np.float64]

SETTLE_S = 0.4
"""Time after a stop until the robot certainly stands still [s]."""

JITTER_POINTS = 26
"""Number of quantiles that describe the distribution of the jitter: 4 % of the readings lie between two."""

SPEED_MM_PER_S = 8.0
"""The wheel speed 1 [mm/s], that of controllers, whatever the kind of robot."""


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


class Subject:
    """A robot that is measured: its line, with the commands of its kind and counters that do not wrap.

    Args:
        line: The robot.
        base: The kind of robot.
    """

    def __init__(self, line: SerialRobot, base: RobotSpec) -> None:
        self.line, self.base, self.kind = line, base, robot_kind(base.kind)
        self.kind.must_take_lines("a calibration")
        self._counts, self._zero = np.zeros(2, np.int64), np.zeros(2, np.int64)

    @property
    def time_s(self) -> float:
        """Time of the robot's world [s]."""
        return self.line.time_s

    @property
    def lead_s(self) -> float:
        """Age of a reading minus age of counters read at the same instant [s].

        A sensor is sampled once in a round, and counters are latched every tick (khepera-protocol.md 8.1 and 6.1);
        those of steppers are never old.
        """
        latched_ns = 0.0 if self.base.motor.steps_per_s_max else float(TICK_NS)
        return (self.base.proximity.round_ns - latched_ns) / 2e9

    def pause(self, seconds: float) -> None:
        """Let time pass [s]."""
        self.line.pause(seconds)

    def set_speed(self, left: float, right: float) -> None:
        """Set the wheel speeds [`SPEED_MM_PER_S`]."""
        scale = self.kind.speed_scale
        request = self.kind.set_speeds(round(left * scale), round(right * scale))
        self.line.port.write(request)
        self.line.read_confirmation(request)

    def zero(self) -> None:
        """Count from here on."""
        self._zero = self._zero + self.counters()

    def counters(self) -> NDArray[np.int64]:
        """Return how far the wheels have turned, left and right [pulses]."""
        full = 1 << self.base.motor.counter_bits
        turned = (np.array(self._read("positions", 2)) - self._counts + full // 2) % full - full // 2
        self._counts = self._counts + turned
        return self._counts - self._zero

    def proximity(self) -> list[int]:
        """Return the eight proximity readings [counts]."""
        return self._read("proximity", SENSOR_COUNT)

    def _read(self, sense: str, count: int) -> list[int]:
        request = f"{self.kind.senses[sense]}\n".encode()
        self.line.port.write(request)
        return self.line.read_numbers(request, count)

    def exchange(self) -> tuple[float, int]:
        """Ask for the counters; return how long that took [s], and how many characters were on the line."""
        start_s, command = self.time_s, self.kind.senses["positions"]
        reply = self.line.send(command)
        return self.time_s - start_s, len(command) + len("\n") + len(reply) + len("\r\n")


def halt(robot: Subject) -> None:
    """Stop the robot, even if replies of earlier commands are still on the line: each of them costs an attempt."""
    for attempt in range(4):
        try:
            robot.set_speed(0, 0)
            return
        except LinkError:
            if attempt == 3:
                return


def record(
    robot: Subject,
    left: int,
    right: int,
    limit_pulses: float,
    is_done: Callable[[list[int]], bool] = lambda counts: False,
) -> Track:
    """Let a robot move until a wheel has turned far enough, or a reading ends the movement.

    Args:
        robot: The robot.
        left: Speed of the left wheel [`SPEED_MM_PER_S`].
        right: Speed of the right wheel.
        limit_pulses: How far a wheel turns [pulses].
        is_done: Called with each reading; returns whether the movement ends.

    Raises:
        CalibrationError: If the wheels do not turn far enough in time.
        LinkError: If the robot does not answer.
    """
    asked_s: list[float] = []
    counters: list[NDArray[np.int64]] = []
    read_s: list[float] = []
    readings: list[list[int]] = []
    pulses_per_s = SPEED_MM_PER_S / robot.base.body.pulse_mm * max(abs(left), abs(right))
    allowed_s = 2.0 + 1.5 * limit_pulses / pulses_per_s
    start_s = robot.time_s
    try:
        robot.set_speed(left, right)
        while True:
            asked_s.append(robot.time_s)
            counters.append(robot.counters())
            turned = int(np.abs(counters[-1] - counters[0]).max())
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
    instants_s = np.array(read_s) - robot.lead_s
    pulses = [np.interp(instants_s, asked_s, [pair[wheel] for pair in counters]) for wheel in (0, 1)]
    path = np.vstack((counters[0], np.stack(pulses, axis=1), robot.counters()))
    return Track(path, np.array(readings, np.int64))


def rest(robot: Subject, sample_count: int) -> Array:
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


def processing_ms(robot: Subject, baud: int, exchange_count: int = 40) -> float:
    """Return the time that the robot takes to process a command, from the median of several exchanges [ms]."""
    character_s = s_from_ns(character_ns(baud, robot.base.firmware.bits_per_character))
    exchanges = [robot.exchange() for _ in range(exchange_count)]
    return max(1000.0 * float(np.median([took_s - count * character_s for took_s, count in exchanges])), 0.0)
