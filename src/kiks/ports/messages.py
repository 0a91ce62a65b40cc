"""What a program in a process of its own and the process that runs the world say to each other.

A request is sent by the program, stamped with its own time. Those that tell are not answered, so the program goes on at
once; those that ask are answered with the program's new time. Both have a head of fixed length, and characters behind.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from kiks.sim.read_completion import Read

RECEIVE_SIZE = 1 << 16
"""Most bytes taken from the connection at once."""

WINDOW = 64
"""Requests that a program may send without an answer: nobody runs farther ahead of the world than that."""

_REQUEST = struct.Struct("<BHqIqqqqI")
_ANSWER = struct.Struct("<I?qqqI")
_READ = struct.Struct("<HqB")


class Kind(IntEnum):
    """What a request wants; the numbers that it carries."""

    REACHED = 1
    """Tells that the program does nothing earlier."""
    MEET = 2
    """Asks to be answered when the world is there, too."""
    FIND = 3
    """Asks for the number of the robot behind the port name that follows."""
    CLAIM = 4
    """Asks for a robot's line; who wants it follows."""
    HANG_UP = 5
    """Gives a line back, if `first` is 1, and forgets what nobody read."""
    SEND = 6
    """Tells what is sent; the characters follow."""
    SEND_AND_MEET = 7
    """The same, and asks to be answered when the line has taken it."""
    READ = 8
    """Asks for `first` characters (-1: any number) or up to the terminator that follows; `second`: time-out [ns], -1
    for none; `third`: what a read in vain costs [ns]."""
    COUNT = 9
    """Asks how many characters have arrived."""
    DROP = 10
    """Tells to forget these."""
    SENT = 11
    """Asks when everything will have been sent [ns]."""
    SET_BAUD = 12
    """Tells the speed, `first`."""
    BAUD = 13
    """Asks for the speed."""
    ROOM = 14
    """Asks when the line takes more [ns]."""
    WAIT = 15
    """Asks to be answered when one of the reads that follow is complete, or at `second` [ns]; -1: at no time."""
    END = 16
    """Never sent: what the end of the connection stands for."""


ASKING = frozenset(Kind) - {Kind.REACHED, Kind.HANG_UP, Kind.SEND, Kind.DROP, Kind.SET_BAUD, Kind.END}
"""The kinds that are answered."""


class Request(NamedTuple):
    """What a program says; `robot` is 0 where it does not matter, and the answer has the same ticket.

    Attributes:
        at_ns: The program's time [ns].
        thought_ns: How much of it the program has thought since the last request [ns].
    """

    kind: Kind
    robot: int
    at_ns: int
    ticket: int = 0
    first: int = 0
    second: int = 0
    third: int = 0
    thought_ns: int = 0
    data: bytes = b""

    def pack(self) -> bytes:
        """Return it as bytes."""
        return _REQUEST.pack(*self[:8], len(self.data)) + self.data


class Answer(NamedTuple):
    """What it is answered.

    Attributes:
        ticket: The request's.
        is_good: False: `data` is the text of an error.
        now_ns: The program's time from now on [ns].
        number: What was asked for.
        ahead_count: Characters that are still on the way to the robot.
        data: The characters that were read.
    """

    ticket: int
    is_good: bool
    now_ns: int
    number: int = 0
    ahead_count: int = 0
    data: bytes = b""

    def pack(self) -> bytes:
        """Return it as bytes."""
        return _ANSWER.pack(*self[:5], len(self.data)) + self.data


def take_request(buffer: bytearray) -> Request | None:
    """Remove and return the first request of a buffer, None while it is not complete."""
    if len(buffer) < _REQUEST.size:
        return None
    kind, robot, at_ns, ticket, first, second, third, thought_ns, length = _REQUEST.unpack_from(buffer)
    end = _REQUEST.size + length
    if len(buffer) < end:
        return None
    data = bytes(buffer[_REQUEST.size : end])
    del buffer[:end]
    return Request(Kind(kind), robot, at_ns, ticket, first, second, third, thought_ns, data)


def take_answer(buffer: bytearray) -> Answer | None:
    """Remove and return the first answer of a buffer, None while it is not complete."""
    if len(buffer) < _ANSWER.size:
        return None
    ticket, is_good, now_ns, number, ahead_count, length = _ANSWER.unpack_from(buffer)
    end = _ANSWER.size + length
    if len(buffer) < end:
        return None
    data = bytes(buffer[_ANSWER.size : end])
    del buffer[:end]
    return Answer(ticket, is_good, now_ns, number, ahead_count, data)


def pack_reads(reads: Sequence[Read]) -> bytes:
    """Return what WAIT carries."""
    packed = b""
    for robot, size, terminator in reads:
        end = terminator or b""
        packed += _READ.pack(robot, -1 if size is None else size, len(end)) + end
    return packed


def unpack_reads(data: bytes) -> list[Read]:
    """Return what `pack_reads` has packed."""
    reads, start = [], 0
    while start < len(data):
        robot, size, length = _READ.unpack_from(data, start)
        start += _READ.size + length
        reads.append(Read(robot, None if size < 0 else size, data[start - length : start] or None))
    return reads
