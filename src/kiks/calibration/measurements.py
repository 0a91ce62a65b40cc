"""Measuring: what a robot does and notes down while it is calibrated.

A run is a movement at constant wheel speeds in front of a straight wall, with the counters and the readings taken in
turn all the way. Whether the robot spins, drives along the wall or comes towards it makes no difference to the fit.
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
"""Turns of a spin: the wall comes by more than once, so that the wheel base shows, and readings go into a mean."""

SPIN_SPEED_PULSES, DRIVE_SPEED_PULSES = 4, 4
"""Wheel speeds [pulses/10 ms]: slow, as a reading is up to 20 ms old."""

LEAD_S = 0.005
"""How much older a reading is than counters asked for at the same instant [s]: 10 ms on average against 5
(khepera-protocol.md 8.1 and 6.1)."""

SETTLE_S = 0.4
"""How long a robot takes to stand still after a stop [s], generously."""

JITTER_POINTS = 26
"""Points that tell the distribution of the jitter: 4 % of the readings between two."""

PULSES_PER_S = 100
"""Wheel speed 1 is a pulse every 10 ms."""


class CalibrationError(KiksError):
    """A measurement does not show what it should, or measurements contradict each other."""


@dataclass(frozen=True)
class Run:
    """What was noted during one movement, or during several without a hand in between.

    Attributes:
        gap_mm: Distance from wall to rim at the start [mm].
        pulses: Counters at the instant of each reading, zero at the start [pulses], shape [sample, 2].
        counts: Proximity readings, shape [sample, 8].
        end_pulses: Counters after the robot had come to rest, left and right.
        is_marked: True if a mark says what the gap was; else it is about that.
    """

    gap_mm: float
    pulses: Array
    counts: Array
    end_pulses: tuple[int, int]
    is_marked: bool = True

    def turned_pulses(self) -> int:
        """Return the difference of the wheels over the whole run, positive to the left [pulses]."""
        return self.end_pulses[1] - self.end_pulses[0]

    def then(self, after: Run) -> Run:
        """Return this run and the one that began where it ended as one."""
        left, right = self.end_pulses
        return replace(
            self,
            pulses=np.vstack((self.pulses, after.pulses + self.end_pulses)),
            counts=np.vstack((self.counts, after.counts)),
            end_pulses=(left + after.end_pulses[0], right + after.end_pulses[1]),
        )

    def thinned(self, step: int) -> Run:
        """Return the run with every `step`-th reading alone."""
        return replace(self, pulses=self.pulses[::step], counts=self.counts[::step])


def halt(robot: Khepera) -> None:
    """Stop the robot whatever was under way on the line: what is left of an earlier exchange costs an attempt."""
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
    """Let a robot move until a wheel has turned a given way, or until its readings say so.

    Args:
        robot: The robot.
        gap_mm: Distance from wall to rim at the start [mm].
        left: Speed of the left wheel [pulses/10 ms].
        right: Speed of the right wheel [pulses/10 ms].
        limit_pulses: How far a wheel turns at most [pulses].
        is_done: Looks at each reading.

    Raises:
        CalibrationError: If the wheels do not turn as they should.
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
    """Turn on the spot: turns to the left positive, their length by the wheel base that `spec` gives.

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
    way_mm: float,
    is_done: Callable[[list[int]], bool] = lambda counts: False,
) -> Run:
    """Drive straight on, backwards if the way is negative [mm], its length by the pulse that `spec` gives.

    Raises:
        CalibrationError: If the wheels do not turn.
        LinkError: If the robot does not answer.
    """
    speed = DRIVE_SPEED_PULSES if way_mm > 0 else -DRIVE_SPEED_PULSES
    return record(robot, gap_mm, speed, speed, abs(way_mm) / spec.body.pulse_mm, is_done)


@dataclass(frozen=True)
class Rest:
    """What a robot that stands still reads, shape [sample, 8]."""

    counts: Array

    def jitter(self) -> Array:
        """Return how the readings of all sensors lie around the mean of each, least to largest, evenly [counts]."""
        strayed = self.counts - self.counts.mean(axis=0)
        jitter: Array = np.quantile(strayed, np.linspace(0.0, 1.0, JITTER_POINTS))
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
    """Return how long the robot thinks about a command, by the median of several exchanges [ms].

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
