"""The timing of a program that drives robots over serial lines, exchange by exchange.

In each loop, the program sends the command of each sense to all its robots and reads all replies. It decides, sends
each robot its speeds and reads the replies. Then it waits until its period is over, if it is not over already.

A command acts when its last character has arrived and the robot has processed it; then its reply begins. A character
takes 11 bit times, so the duration of a loop depends on the replies: `n,0,...` is shorter than `n,1023,...`.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from kiks.engine.compiling import kernel
from kiks.errors import ParameterError
from kiks.firmware.robot_kind import robot_kind
from kiks.model.data_file import Number, Whole, record
from kiks.model.robot import RobotSpec
from kiks.units import character_ns, ns_from_s

Line: Any = namedtuple(
    "Line",
    "character_ns processing_ns think_ns period_ns speed_scale speed_max speeds_length done_length",
)
"""What kernels know of a line: times [ns]; by how much more a command says for a speed than controllers do, the largest
speed in it, the number of its characters but for the two speeds, and that of its reply."""

Baud = Annotated[Whole, Field(ge=110, le=10_000_000, description="The Khepera knows 9600, 19200, 38400 and 57600.")]

Milliseconds = Annotated[Number, Field(ge=0, le=1e6)]

LENGTHS = 32
"""More than the most characters of a command that sets speeds, on any kind of robot."""


@record
class Timing:
    """The pace of a control loop.

    Args:
        period_s: Time from the beginning of one loop to that of the next [s]; after a loop that takes longer, the next
            one begins at once.
        baud: Speed of the lines [bit/s]; None for a robot that senses and acts at once, without a line.
        think_s: Thinking time of the program before each command [s], or before the commands that it sends to several
            robots at once, like the thinking policy 'fixed'.

    Example:
        >>> Timing(period_s=0.05, baud=None)
        Timing(period_s=0.05, baud=None, think_s=0.0)
    """

    period_s: Annotated[Number, Field(ge=0, le=1000)] = 0.1
    baud: Baud | None = 9600
    think_s: Annotated[Number, Field(ge=0, le=1000)] = 0.0

    def __post_init__(self) -> None:
        if self.baud is None and self.period_s < 0.01:
            raise ParameterError(f"period_s must be at least 0.01 without a line, but it was {self.period_s:g}.")

    @property
    def thinking(self) -> str:
        """The thinking policy of a program with this pace."""
        return f"fixed:{ns_from_s(self.think_s) / 1e6}" if self.think_s else "none"

    def line(self, spec: RobotSpec) -> Any:
        """Return the timing of the line to a robot of a kind, for kernels.

        Example:
            >>> import kiks
            >>> kiks.Timing().line(kiks.RobotSpec.load("khepera")).character_ns
            1145833
        """
        has_line, kind = self.baud is not None, robot_kind(spec.kind)
        if has_line:
            kind.must_take_lines("a batch with a line")
        return Line(
            character_ns(self.baud, spec.firmware.bits_per_character) if self.baud is not None else 0,
            ns_from_s(spec.firmware.processing_ms * 1e-3) if has_line else 0,
            ns_from_s(self.think_s),
            ns_from_s(self.period_s),
            kind.speed_scale,
            kind.speed_max,
            len(kind.stop) - 2 if kind.commands else 0,
            len(kind.speeds_reply) + spec.quirks.d_reply_trailing_comma,
        )


@kernel
def digit_count(number: Any) -> Any:
    """Return the number of characters of a whole number of at most four digits, with its sign."""
    size = abs(number)
    return 1 + (size >= 10) + (size >= 100) + (size >= 1000) + (number < 0)


@kernel
def answer_length(head: Any, readings: Any) -> Any:
    """Return the number of characters of a sense's reply: its head, and a comma and a number for each reading."""
    length = head + readings.shape[0]
    for k in range(readings.shape[0]):
        length += digits_of(readings[k])
    return length


@kernel
def short_answer_length(head: Any, readings: Any) -> Any:
    """Return what `answer_length` does for readings of at most four digits, which are counted side by side."""
    length = head + readings.shape[0]
    for k in range(readings.shape[0]):
        length += digit_count(np.int64(readings[k]))
    return length


@kernel
def digits_of(number: Any) -> Any:
    """Return the number of characters of any whole number, with its sign."""
    whole = np.int64(number)
    length, size = digit_count(whole), abs(whole)
    while size >= 10_000:
        size //= 10
        length += 1
    return length


@kernel
def order_length(line: Any, left: Any, right: Any) -> Any:
    """Return the number of characters of a command that sets speeds."""
    return line.speeds_length + digit_count(left) + digit_count(right)


@kernel
def acts_at(line: Any, now_ns: Any, length: Any) -> Any:
    """Return the time at which a command of `length` characters acts, if the program starts thinking now [ns]."""
    return now_ns + line.think_ns + length * line.character_ns + line.processing_ns
