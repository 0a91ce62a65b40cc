"""The log of a run: all that came from outside and all that robots answered, in order.

Entries are written in columns: many entries make one block, for a message per entry would cost more than the run.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np

from kiks.errors import ParameterError
from kiks.model.checks import CLOCK_END_NS, ROBOTS_MAX
from kiks.model.data_file import check, parse_json
from kiks.sim.run_log import Kind
from kiks.sim.saved_state import LAYOUT, ScoreEntry


class Entry(NamedTuple):
    """One entry of the log; what `number`, `other` and `data` are depends on its kind: see `Kind`.

    Attributes:
        kind: A `Kind`.
        time_ns: When [ns].
        robot: Index of the robot; 0 where it has none.
    """

    kind: int
    time_ns: int
    robot: int
    number: int
    other: int
    data: bytes


FIELD_COUNT = 6

ENTRIES_MAX = 100_000
"""Most entries of a block: what reading it costs is in proportion to its size, packed."""

_COUNT = struct.Struct("<I")
_COLUMNS = "BqHqqI"
"""Types of the columns of a block, those of fields, the last one for the lengths of data."""

RECORDED_LAYOUT = f"{LAYOUT} {_COLUMNS}"
"""What the fields of entries and of states are: files with others are of another version."""

_ENTRY_BYTES = struct.calcsize(f"<{_COLUMNS}")


def pack_entries(values: Sequence[Any]) -> bytes:
    """Return a block of entries, whose fields (see `NotedEntry`) come one after the other.

    Times are written as the time since the entry before, and numbers as the time since that of the entry, which most
    of them are: packed, little is left of them.

    Example:
        >>> [entry] = unpack_entries(pack_entries((2, 5, 0, 5, 5, b"N")), "block")
        >>> entry.data
        b'N'
    """
    *columns, data = (values[place::FIELD_COUNT] for place in range(FIELD_COUNT))
    # A struct takes numbers faster than `array` and numpy do, and in the processor's own order of bytes once more.
    kind, time_ns, robot, number, other, length = (
        np.frombuffer(struct.pack(f"{len(data)}{code}", *column), code)
        for code, column in zip(_COLUMNS, (*columns, map(len, data)), strict=True)
    )
    parts = kind, np.diff(time_ns, prepend=0), robot, number - time_ns, other - time_ns, length
    packed = (part.astype(f"<{code}").tobytes() for code, part in zip(_COLUMNS, parts, strict=True))
    return b"".join((_COUNT.pack(len(data)), *packed, *data))


def parse_score(entry: Entry) -> tuple[int | str, float | str]:
    """Return what and value of an entry of the kind `SCORE`."""
    kind, what = cast(Any, ScoreEntry), "the score of a recording"
    found: tuple[int | str, float | str] = check(kind, parse_json(entry.data, what), what)
    return found


def characters_in(block: bytes) -> int:
    """Return how long the data of all entries of a block are together."""
    (count,) = _COUNT.unpack_from(block)
    return len(block) - _COUNT.size - int(count) * _ENTRY_BYTES


def unpack_entries(block: bytes, what: str, kinds: Sequence[int] | None = None) -> list[Entry]:
    """Return the entries of a block of `pack_entries`.

    Args:
        block: The block.
        what: What messages call it.
        kinds: Those that are wanted; all if left out.
    """
    count = _COUNT.unpack_from(block)[0] if len(block) >= _COUNT.size else 0
    if not 0 < count <= ENTRIES_MAX:
        raise ParameterError(f"{what} must be whole, but a part has {count} entries. Take another copy of it.")
    if (end := _COUNT.size + count * _ENTRY_BYTES) > len(block):
        raise _damaged(what)
    columns, place = [], _COUNT.size
    for code in _COLUMNS:
        columns.append(np.frombuffer(block, f"<{code}", count, place))
        place += columns[-1].nbytes
    kind, time_ns, robot, number, other, length = columns
    time_ns = time_ns.cumsum()
    ends = end + length.cumsum()
    is_sound = (kind <= max(Kind)) & (time_ns >= 0) & (time_ns <= CLOCK_END_NS) & (robot < ROBOTS_MAX)
    if not is_sound.all() or len(block) != ends[-1]:
        raise _damaged(what)
    columns = [kind, time_ns, robot, number + time_ns, other + time_ns, length, ends]
    if kinds is not None:
        is_wanted = np.isin(kind, kinds)
        columns = [column[is_wanted] for column in columns]
    return [
        Entry(kind, time_ns, robot, number, other, block[end - length : end])
        for kind, time_ns, robot, number, other, length, end in zip(*(each.tolist() for each in columns), strict=True)
    ]


def _damaged(what: str) -> ParameterError:
    return ParameterError(f"{what} must have blocks of entries, but one is damaged. Take another copy of it.")
