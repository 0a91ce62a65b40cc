"""Monitoring: samples of all readings of a robot at a steady rate, and their log."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, TextIO

from kiks.client.khepera import Khepera, Status
from kiks.errors import ParameterError, shown
from kiks.model.checks import SECONDS_MAX, check_number
from kiks.model.robot import SENSOR_COUNT

RATE_MIN_HZ, RATE_MAX_HZ = 0.01, 100.0

RATE_WINDOW = 20
"""Number of samples over which `RateMeter` averages."""


class Sample(NamedTuple):
    """All readings of a robot at one time.

    Attributes:
        time_s: Time since the start at which the first command was sent [s].
        proximity: Reflected light, clockwise from the left [counts]; more is nearer.
        ambient: Ambient light [counts]; less is brighter.
        encoders: Position counters, left and right [pulses].
        speed: Measured speeds, left and right [pulses/10 ms].
        status: Reports of the two controllers.
    """

    time_s: float
    proximity: list[int]
    ambient: list[int]
    encoders: tuple[int, int]
    speed: tuple[int, int]
    status: tuple[Status, Status]

    def row(self) -> str:
        """Return the sample as a line of the log, in the order of `COLUMNS`."""
        states = [value for motor in self.status for value in (int(motor.on_target), motor.mode, motor.error)]
        numbers = [*self.proximity, *self.ambient, *self.encoders, *self.speed, *states]
        return ",".join((f"{self.time_s:.3f}", *map(str, numbers)))


COLUMNS = (
    "time_s",
    *(f"proximity_{sensor}_counts" for sensor in range(SENSOR_COUNT)),
    *(f"ambient_{sensor}_counts" for sensor in range(SENSOR_COUNT)),
    "left_pulses",
    "right_pulses",
    "left_speed_pulses",
    "right_speed_pulses",
    *(f"{side}_{what}" for side in ("left", "right") for what in ("on_target", "mode", "error_pulses")),
)
"""Columns of the log. Speeds and controllers' errors are in pulses/10 ms; errors of position moves are in pulses."""


def samples(robot: Khepera, *, rate_hz: float = 10.0, seconds: float | None = None) -> Iterator[Sample]:
    """Yield samples at a steady rate, or as fast as the line allows if that is slower.

    The commands of one sample take 0.15 s at 9600 baud, so the rate there is at most 6 or 7 Hz.

    Args:
        robot: The robot.
        rate_hz: Samples per second [Hz].
        seconds: Duration by the robot's clock [s]; without end if left out.

    Raises:
        LinkError: If the robot does not answer.
    """
    rate_hz = check_number("rate_hz", rate_hz, RATE_MIN_HZ, RATE_MAX_HZ, "At 9600 baud about 6 are possible.")
    if seconds is not None:
        check_number("seconds", seconds, 1e-3, SECONDS_MAX, "Leave it out for no end.")
    return _samples(robot, 1.0 / rate_hz, math.inf if seconds is None else seconds)


def _samples(robot: Khepera, period_s: float, seconds: float) -> Iterator[Sample]:
    start_s = robot.time_s
    due_s = 0.0
    while due_s < seconds:
        now_s = robot.time_s - start_s
        if now_s < due_s:
            robot.pause(due_s - now_s)
            now_s = robot.time_s - start_s
        yield Sample(now_s, robot.proximity(), robot.ambient(), robot.encoders(), robot.speed(), robot.status())
        # After a late sample the next one is due at once; missed samples are not made up for.
        due_s = max(due_s + period_s, robot.time_s - start_s)


class RateMeter:
    """Rate of the last samples.

    Example:
        >>> meter = RateMeter()
        >>> for time_s in (0.0, 0.5, 1.0):
        ...     rate_hz = meter.note(time_s)
        >>> rate_hz
        2.0
    """

    def __init__(self) -> None:
        self._times_s: list[float] = []

    def note(self, time_s: float) -> float:
        """Note the time of a sample [s]; return the rate [Hz], 0 before the second sample."""
        self._times_s = [*self._times_s[-RATE_WINDOW:], time_s]
        span_s = time_s - self._times_s[0]
        return (len(self._times_s) - 1) / span_s if span_s > 0 else 0.0


class CsvLog:
    """A log file: a header with columns and units, then one line per sample, each written at once.

    Args:
        path: A file that does not exist yet.
    """

    def __init__(self, path: str | Path) -> None:
        try:
            self._file: TextIO = open(path, "x", encoding="utf-8")  # noqa: SIM115  (closed by close)
        except OSError as error:
            raise ParameterError(
                f"a log must go to a new file, but {str(path)!r} cannot be one ({error.strerror}). Choose another name."
            ) from None
        self._write(",".join(COLUMNS))

    def add(self, sample: Sample) -> None:
        """Write a sample."""
        self._write(sample.row())

    def close(self) -> None:
        """Close the file."""
        # `add` has reported a full disk already.
        with suppress(OSError):
            self._file.close()

    def _write(self, line: str) -> None:
        try:
            self._file.write(line + "\n")
            self._file.flush()
        except OSError as error:
            raise ParameterError(
                f"a log must go to a file that can be written, but {shown(self._file.name)} cannot any more "
                f"({error.strerror}). The samples before are in it."
            ) from None


def logged(stream: Iterable[Sample], log: CsvLog | None) -> Iterator[Sample]:
    """Yield samples; each is written to the log first, if there is one."""
    for sample in stream:
        if log is not None:
            log.add(sample)
        yield sample
