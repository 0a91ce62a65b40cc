"""What follows from a recording: where its odometry would put a robot, and where the milliseconds went."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kiks.recording.log import RecordedLog
from kiks.recording.rerun import RunPiece
from kiks.sim.run_log import Kind
from kiks.sim.wire_log import Span, TimeShares, share_time


def odometry(
    pulses: NDArray[np.int64], start: NDArray[np.float64], pulse_mm: float, wheel_base_mm: float
) -> NDArray[np.float64]:
    """Return where a robot would be by its wheels alone.

    Between two counts the wheels roll without slipping, and the robot drives the chord of an arc.

    Args:
        pulses: Counts of the left and the right wheel [pulses], int64 [count, 2].
        start: x_mm, y_mm, heading_rad at the first of them.
        pulse_mm: Way of a wheel for a pulse [mm].
        wheel_base_mm: Distance of the wheels [mm].

    Returns:
        x_mm, y_mm, heading_rad at each count, float64 [count, 3].

    Example:
        >>> odometry(np.array([[0, 0], [1250, 1250]]), np.zeros(3), 0.08, 53.0)[-1].tolist()
        [100.0, 0.0, 0.0]
    """
    left_mm, right_mm = np.diff(pulses, axis=0).T * pulse_mm
    turns = (right_mm - left_mm) / wheel_base_mm
    ways_mm = (left_mm + right_mm) / 2 * np.sinc(turns / (2 * np.pi))
    headings = start[2] + np.concatenate([[0.0], turns.cumsum()])
    middles = headings[:-1] + turns / 2
    x_mm = start[0] + np.concatenate([[0.0], (ways_mm * np.cos(middles)).cumsum()])
    y_mm = start[1] + np.concatenate([[0.0], (ways_mm * np.sin(middles)).cumsum()])
    return np.column_stack([x_mm, y_mm, headings])


class Lines:
    """The lines of robots, by their numbers, as they are found while a run is made again."""

    def __init__(self, robots: Sequence[int]) -> None:
        self._lines = {robot - 1: _LineTimes() for robot in robots}

    def add(self, piece: RunPiece) -> None:
        """Add what took time in a piece of the run."""
        for entry in piece.entries:
            line = self._lines.get(entry.robot)
            if line is None:
                continue
            if entry.kind in (Kind.SEND, Kind.TYPE):
                line.sent.append((entry.other, len(entry.data)))
                line.link.append((entry.number, entry.other))  # in the air, if it is no cable
            elif entry.kind == Kind.THINK:
                line.thinking.append((entry.number, entry.other))
            elif entry.kind == Kind.ACT:
                # The reply tells how long a character takes.
                begin_ns = max((begin + count * entry.other for begin, count in line.sent), default=entry.time_ns)
                line.link += [(begin, begin + count * entry.other) for begin, count in line.sent]
                line.link.append((entry.time_ns, entry.number + len(entry.data) * entry.other))
                line.robot.append((begin_ns, entry.time_ns))
                line.sent.clear()

    def shares(self, log: RecordedLog) -> list[TimeShares]:
        """Return where the time of the recording went on each line."""
        window, lines = (log.begin_ns, log.end_ns), self._lines.values()
        return [share_time(window, link=each.link, robot=each.robot, thinking=each.thinking) for each in lines]


@dataclass
class _LineTimes:
    """What took time on a robot's line; of what was sent and has no reply yet: when it began, and its characters."""

    link: list[Span] = field(default_factory=list)
    robot: list[Span] = field(default_factory=list)
    thinking: list[Span] = field(default_factory=list)
    sent: list[tuple[int, int]] = field(default_factory=list)
