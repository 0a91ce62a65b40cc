"""The log of a run: all that came from outside and all that robots answered, in order.

Entries are written in columns: many entries make one block, for a message per entry would cost more than the run.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from kiks.errors import ParameterError
from kiks.model.checks import CLOCK_END_NS, ROBOTS_MAX
from kiks.sim.run_log import Kind


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
        >>> [entry] = entries_of(block_of((2, 5, 0, 5, 5, b"N")), "block", 1, 0)
        >>> entry.data
        b'N'
    """
    *columns, data = (values[place::FIELD_COUNT] for place in range(FIELD_COUNT))
    # A struct takes numbers faster than `array` and numpy do.
    numbers = struct.Struct(f"<{len(data)}q")
    packed = (numbers.pack(*column) for column in (*columns, map(len, data)))
    return b"".join((_COUNT.pack(len(data)), *packed, *data))


FIELD_COUNT = 6
_COUNT = struct.Struct("<I")


def entries_of(
    block: bytes, what: str, inputs_max: int, lines_max: int, kinds: Sequence[int] | None = None
) -> list[Entry]:
    """Return the entries of a block of `block_of`.

    Args:
        block: The block.
        what: What messages call it.
        inputs_max: Most entries that it may have besides lines of output.
        lines_max: Most lines of output.
        kinds: Those that are wanted; all if left out.
    """
    count = _COUNT.unpack_from(block)[0] if len(block) >= _COUNT.size else -1
    begin = _COUNT.size + count * FIELD_COUNT * 8
    if not 0 < begin <= len(block):
        raise _damaged(what)
    columns = np.frombuffer(block, "<i8", count * FIELD_COUNT, _COUNT.size).reshape(FIELD_COUNT, count)
    limits = ((0, 2**31), (0, CLOCK_END_NS), (0, ROBOTS_MAX - 1), *[(-(2**63), 2**63 - 1)] * 2, (0, len(block)))
    for column, (low, high) in zip(columns, limits, strict=True):
        if not ((column >= low) & (column <= high)).all():
            raise _damaged(what)
    ends = begin + columns[-1].cumsum()
    if len(block) != (ends[-1] if count else begin):
        raise _damaged(what)
    line_count = np.count_nonzero(columns[0] == Kind.TEXT)
    if not count or line_count > lines_max or count - line_count > inputs_max:
        raise ParameterError(f"{what} must be whole, but a part has {count} entries. Take another copy of it.")
    if kinds is not None:
        is_wanted = np.isin(columns[0], kinds)
        columns, ends = columns[:, is_wanted], ends[is_wanted]
    return [
        Entry(kind, time_ns, robot, number, other, block[end - length : end])
        for kind, time_ns, robot, number, other, length, end in zip(*columns.tolist(), ends.tolist(), strict=True)
    ]


def _damaged(what: str) -> ParameterError:
    return ParameterError(f"{what} must have blocks of entries, but one is damaged. Take another copy of it.")
