"""The log of a run: all that came from outside and all that robots answered, in order.

Entries are written in columns: many entries make one block, for a message per entry would cost more than the run.
"""

from __future__ import annotations

import struct
import sys
from array import array
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.model.checks import CLOCK_END_NS


class Kind(IntEnum):
    """What an entry tells.

    The first ones are the inputs, which make the run again. A state is what was changed in any other way than over a
    line, by a hand or a program: all that the simulation was after it. A check is the same at each whole second, so
    that a replay may begin there and can be compared.
    """

    STATE = 0  # data: of `state_bytes`; number: of the setup
    CHECK = 1  # data: 16 characters of the hash, then of `state_bytes`; number: of the setup
    SEND = 2  # data: characters for the robot; number, other: when they are sent, and when the first begins [ns]
    TYPE = 3  # the same, typed by a person, who gets the replies in place of the host
    HANG_UP = 4
    SET_BAUD = 5  # number: [bit/s]
    DROP = 6  # number, other: `until_ns` and `now_ns` of `Wire.drop_after`
    ACT = 16  # the robot has done what was due; data: the reply; number, other: when it starts, a character [ns]
    THINK = 17  # number, other: from when to when the program thought [ns]
    TEXT = 18  # data: a line that the robot's program printed, in UTF-8
    MARK = 19  # data: a person's note, in UTF-8


LAST_INPUT = Kind.DROP
"""Kinds up to this one are inputs."""


class Entry(NamedTuple):
    """One entry of the log.

    Attributes:
        kind: A `Kind`.
        time_ns: When [ns].
        robot: Index of the robot; 0 where it has none.
        number: See `Kind`.
        other: See `Kind`.
        data: See `Kind`.
    """

    kind: int
    time_ns: int
    robot: int
    number: int
    other: int
    data: bytes


class EntryList:
    """Entries that wait to be written, as plain numbers.

    Attributes:
        numbers: Of each entry: kind, time_ns, robot, number, other, length of its data.
        data: Of each entry.

    Example:
        >>> waiting = EntryList()
        >>> waiting.add(Kind.SEND, 5, 0, 5, 5, b"N")
        >>> Columns.of_block(waiting.take(), "block").entry(0).data
        b'N'
    """

    def __init__(self) -> None:
        self.numbers: list[int] = []
        self.data: list[bytes] = []

    def add(self, kind: int, time_ns: int, robot: int, number: int, other: int, data: bytes) -> None:
        """Add an entry."""
        self.numbers.extend((int(kind), time_ns, robot, number, other, len(data)))
        self.data.append(data)

    def take(self) -> bytes:
        """Return a block of all entries, and forget them."""
        # `array` takes a list of numbers three times as fast as numpy does.
        numbers = array("q", self.numbers)
        if sys.byteorder == "big":
            numbers.byteswap()
        block = b"".join((_COUNT.pack(len(self.data)), numbers, *self.data))
        self.numbers.clear()
        self.data.clear()
        return block


ROBOTS_MAX = 1000
"""Most robots of a world."""

_COLUMN_COUNT = 6
_COUNT = struct.Struct("<I")


class Columns(NamedTuple):
    """The columns of a block; `ends` says where the data of each entry ends in `data`."""

    kind: NDArray[np.int64]
    time_ns: NDArray[np.int64]
    robot: NDArray[np.int64]
    number: NDArray[np.int64]
    other: NDArray[np.int64]
    length: NDArray[np.int64]
    ends: NDArray[np.int64]
    data: bytes

    @classmethod
    def of_block(cls, block: bytes, what: str) -> Columns:
        """Return the columns of a block.

        Args:
            block: Of `EntryList.take`.
            what: What messages call it.

        Raises:
            ParameterError: If it is none.
        """
        count = _COUNT.unpack_from(block)[0] if len(block) >= _COUNT.size else -1
        begin = _COUNT.size + count * _COLUMN_COUNT * 8
        if count >= 0 and len(block) >= begin:
            columns = np.frombuffer(block, "<i8", count * _COLUMN_COUNT, _COUNT.size).reshape(count, _COLUMN_COUNT).T
            lengths = columns[-1]
            limits = ((0, 2**31), (0, CLOCK_END_NS), (0, ROBOTS_MAX - 1), *[(-(2**63), 2**63 - 1)] * 2, (0, len(block)))
            is_sound = (
                (columns >= low) & (columns <= high) for columns, (low, high) in zip(columns, limits, strict=True)
            )
            if all(each.all() for each in is_sound):
                ends = begin + lengths.cumsum()
                if len(block) == (int(ends[-1]) if count else begin):
                    kind, time_ns, robot, number, other, lengths = columns
                    return cls(kind, time_ns, robot, number, other, lengths, ends, block)
        raise ParameterError(f"{what} must have blocks of entries, but one is damaged. Take another copy of it.")

    def entry(self, row: int) -> Entry:
        """Return an entry."""
        kind, time_ns, robot, number, other, length, end = (int(column[row]) for column in self[:7])
        return Entry(kind, time_ns, robot, number, other, self.data[end - length : end])

    def entries(self) -> Sequence[Entry]:
        """Return all entries."""
        rows = zip(*(column.tolist() for column in self[:7]), strict=True)
        return [
            Entry(kind, time_ns, robot, number, other, self.data[end - length : end])
            for kind, time_ns, robot, number, other, length, end in rows
        ]
