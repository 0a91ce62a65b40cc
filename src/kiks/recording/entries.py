"""The log of a run: all that came from outside and all that robots answered, in order.

Entries are written in columns: many entries make one block, for a message per entry would cost more than the run.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.model.checks import CLOCK_END_NS, ROBOTS_MAX


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


def block_of(values: Sequence[Any]) -> bytes:
    """Return a block of entries, whose fields (see `NotedEntry`) come one after the other.

    Example:
        >>> Columns.of_block(block_of((2, 5, 0, 5, 5, b"N")), "block").entry(0).data
        b'N'
    """
    *columns, data = (values[place::FIELD_COUNT] for place in range(FIELD_COUNT))
    # A struct takes numbers faster than `array` and numpy do.
    numbers = struct.Struct(f"<{len(data)}q")
    packed = (numbers.pack(*column) for column in (*columns, map(len, data)))
    return b"".join((_COUNT.pack(len(data)), *packed, *data))


FIELD_COUNT = 6
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
        """Return the columns of a block of `block_of`."""
        count = _COUNT.unpack_from(block)[0] if len(block) >= _COUNT.size else -1
        begin = _COUNT.size + count * FIELD_COUNT * 8
        if count >= 0 and len(block) >= begin:
            columns = np.frombuffer(block, "<i8", count * FIELD_COUNT, _COUNT.size).reshape(FIELD_COUNT, count)
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
