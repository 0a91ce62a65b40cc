"""The messages between a program's process and the process that runs the world.

A program sends requests, stamped with its own time. Some requests only tell and get no answer, so the program goes on
at once. The others ask, and the answer carries the program's new time. Both have a header of fixed length, followed by
bytes.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from kiks.sim.read_completion import Read

RECEIVE_SIZE = 1 << 16
"""Most bytes read from the connection at once."""

WINDOW = 64
"""Requests that a program may send without an answer: it limits how far a program runs ahead of the world."""

LATE, PUNCTUAL = "late", "punctual"
"""How a program begins: when the world may have begun already, or with it."""

_REQUEST = struct.Struct("<BHqIqqqqI")
_ANSWER = struct.Struct("<I?qqqI")
_READ = struct.Struct("<HqB")


class Kind(IntEnum):
    """The kind of a request, and the fields that it uses."""

    REACHED = 1
    """Tells that the program does nothing before its time."""
    MEET = 2
    """Asks for an answer when the world has reached the program's time."""
    FIND = 3
    """Asks for the number of the robot behind the port name in `data`."""
    CLAIM = 4
    """Asks for a robot's line exclusively; `data` names the program."""
    HANG_UP = 5
    """Releases a line, if `first` is 1, and drops unread characters."""
    SEND = 6
    """Sends the characters in `data`."""
    ROOM = 7
    """Asks when the line has room for `first` characters [ns]."""
    READ = 8
    """Asks for `first` characters (-1: any number) or up to the terminator in `data`; `second`: timeout [ns], -1 for
    none; `third`: cost of a read without result [ns]."""
    COUNT = 9
    """Asks for the number of characters that have arrived."""
    DROP = 10
    """Drops the characters that have arrived."""
    SENT = 11
    """Asks when all characters will have been sent [ns]."""
    SET_BAUD = 12
    """Sets the speed to `first`."""
    BAUD = 13
    """Asks for the speed."""
    WAIT = 14
    """Asks for an answer when one of the reads in `data` is complete, or at `second` [ns]; -1: without a limit."""
    END = 15
    """Represents the end of the connection; never sent."""


ASKING = frozenset(Kind) - {Kind.REACHED, Kind.HANG_UP, Kind.SEND, Kind.DROP, Kind.SET_BAUD, Kind.END}
"""The kinds that get an answer."""

_KINDS = {kind.value: kind for kind in Kind}


class Request(NamedTuple):
    """A request of a program; `robot` is 0 where it does not matter, and the answer has the same ticket.

    Attributes:
        at_ns: The program's time [ns].
        thought_ns: Thinking time since the last request [ns].
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
    """An answer to a request.

    Attributes:
        ticket: Ticket of the request.
        is_good: False: `data` is the text of an error.
        now_ns: The program's new time [ns].
        number: The number asked for.
        ahead_count: Characters on the way to the robot.
        data: Characters that were read.
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


def take_requests(buffer: bytearray) -> list[Request]:
    """Remove and return the complete requests at the beginning of a buffer."""
    requests, start, size = [], 0, len(buffer)
    while start + _REQUEST.size <= size:
        kind, robot, at_ns, ticket, first, second, third, thought_ns, length = _REQUEST.unpack_from(buffer, start)
        data_start = start + _REQUEST.size
        if data_start + length > size:
            break
        start = data_start + length
        data = bytes(buffer[data_start:start])
        requests.append(Request(_KINDS[kind], robot, at_ns, ticket, first, second, third, thought_ns, data))
    del buffer[:start]
    return requests


def take_answer(buffer: bytearray) -> Answer | None:
    """Remove and return the first answer of a buffer; None while it is incomplete."""
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
    """Return the data of a WAIT."""
    packed = b""
    for robot, size, terminator in reads:
        end = terminator or b""
        packed += _READ.pack(robot, -1 if size is None else size, len(end)) + end
    return packed


def unpack_reads(data: bytes) -> list[Read]:
    """Return the reads that `pack_reads` has packed."""
    reads, start = [], 0
    while start < len(data):
        robot, size, length = _READ.unpack_from(data, start)
        start += _READ.size + length
        reads.append(Read(robot, None if size < 0 else size, data[start - length : start] or None))
    return reads
