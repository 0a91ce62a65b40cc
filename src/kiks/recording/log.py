"""The log of a recording, read block by block."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.recording.entries import Columns, Entry
from kiks.recording.mcap_file import McapReader, Topic
from kiks.recording.motion import Motion
from kiks.recording.motion import decode as decode_motion
from kiks.recording.recorder import LINES_MAX, LOG, MOTION
from kiks.sim.run_log import LAST_INPUT, Kind
from kiks.sim.saved_state import LAYOUT, SavedState, Setup
from kiks.units import s_from_ns
from kiks.version import __version__

HASH_LENGTH = 16
"""Characters of a hash, before the state of a checkpoint."""

ENTRY_BYTES, PART_BYTES = 1, 64
"""Fewest bytes of a chunk, packed as it is, for each entry beyond `LINES_MAX`, and for each time that things come or
go: a recording of KiKS has four times as many, and work is in proportion to the size of a file."""

BLOCKS_KEPT = 4
"""Blocks of the log that are kept when they were read."""


class Row(NamedTuple):
    """The place of an entry: which block of the log it is in, and its row there."""

    block: int
    row: int


class RecordedLog:
    """The log of a recording.

    Args:
        file: The file.

    Attributes:
        reader: Reads the file.
    """

    def __init__(self, file: str | Path) -> None:
        self.reader = reader = McapReader(file)
        self._setups: dict[int, Setup] = {}
        self._blocks: OrderedDict[int, Columns] = OrderedDict()
        if "setup/0.json" not in reader.attachments or not reader.chunks:
            raise ParameterError(
                f"{reader.what} must be a recording of KiKS, but it is another MCAP file, or the run was killed at its "
                "very beginning. `--record FILE` makes one."
            )
        if reader.told.get("layout") != LAYOUT:
            raise ParameterError(
                f"Cannot read {reader.what}: KiKS {reader.told.get('kiks', '?')} recorded it with other fields than "
                f"KiKS {__version__} has. Read it with that version."
            )

    @property
    def begin_ns(self) -> int:
        """When it begins [ns]."""
        return int(self._block(0).time_ns[0])

    @property
    def end_ns(self) -> int:
        """When it ends [ns]: at its last checkpoint."""
        columns = self._block(len(self.reader.chunks) - 1)
        return int(columns.time_ns[_is_input(columns)].max(initial=columns.time_ns[0]))

    @property
    def block_count(self) -> int:
        """Number of blocks that have been found."""
        return len(self.reader.chunks)

    def motion(self) -> Iterator[Motion]:
        """Yield the records of robots and bodies, after every third or fourth tick."""
        for block in range(self.block_count):
            yield from self.motion_of(block)

    def motion_of(self, block: int) -> Iterator[Motion]:
        """Yield those records of a block."""
        data, parts_max = self._part(block, MOTION), self._most(block, PART_BYTES)
        yield from decode_motion(data, self.reader.what, parts_max)

    def entries(self) -> Iterator[Entry]:
        """Yield all entries of the log."""
        for block in range(self.block_count):
            yield from self.entries_of(block)

    def entries_of(self, block: int) -> Sequence[Entry]:
        """Return the entries of a block."""
        return self._block(block).entries()

    def find_more(self) -> None:
        """Find what a run that goes on has written since."""
        self.reader.find_more()

    def row_before(self, time_ns: int) -> Row:
        """Return the place of the last checkpoint at or before a time [ns], or of the first state."""
        chunks = self.reader.chunks
        last = max((number for number, chunk in enumerate(chunks) if chunk.begin_ns <= time_ns), default=0)
        for block in range(last, -1, -1):
            columns = self._block(block)
            is_state = (columns.kind == Kind.CHECK) | (columns.kind == Kind.STATE)
            rows = np.flatnonzero(is_state & (columns.time_ns <= max(time_ns, self.begin_ns)))
            if len(rows):
                return Row(block, int(rows[-1]))
        raise self.damaged("it has no state")

    def entry(self, row: Row) -> Entry:
        """Return the entry at a place."""
        return self._block(row.block).entry(row.row)

    def next_input(self, row: Row) -> tuple[Row, Entry, bool] | None:
        """Return the next input after a place, None after the last one.

        Returns:
            Its place, the entry, and whether robots acted between it and the place.
        """
        has_acted, begin = False, row.row + 1
        for block in range(row.block, len(self.reader.chunks)):
            kinds = self._block(block).kind
            for next_row in range(begin, len(kinds)):
                if kinds[next_row] <= LAST_INPUT:
                    return Row(block, next_row), self._block(block).entry(next_row), has_acted
                has_acted = has_acted or kinds[next_row] == Kind.ACT
            begin = 0
        return None

    def setup(self, number: int) -> Setup:
        """Return a setup by its number."""
        if number not in self._setups:
            name = f"setup/{number}.json"
            if name not in self.reader.attachments:
                raise self.damaged(f"it has no {name}")
            self._setups[number] = Setup.from_bytes(self.reader.attachments[name], f"{self.reader.what}: {name}")
        return self._setups[number]

    def state_of(self, entry: Entry) -> tuple[Setup, SavedState]:
        """Return the setup and the state of an entry."""
        setup = self.setup(entry.number)
        data = entry.data[HASH_LENGTH:] if entry.kind == Kind.CHECK else entry.data
        saved = SavedState.from_bytes(data, setup, f"{self.reader.what}: state")
        if saved.now_ns != entry.time_ns:
            raise self.damaged(f"a state of {s_from_ns(saved.now_ns):.3f} s is at {s_from_ns(entry.time_ns):.3f} s")
        return setup, saved

    def _block(self, number: int) -> Columns:
        """Return a block of the log."""
        if number not in self._blocks:
            columns = Columns.of_block(self._part(number, LOG), self.reader.what)
            if not 0 < len(columns.kind) <= self._most(number, ENTRY_BYTES) + LINES_MAX:
                raise self.damaged(f"a part has {len(columns.kind)} entries")
            self._blocks[number] = columns
            if len(self._blocks) > BLOCKS_KEPT:
                self._blocks.popitem(last=False)
        return self._blocks[number]

    def _most(self, number: int, bytes_each: int) -> int:
        """Return how many things there may be in a chunk."""
        return 16 + self.reader.chunks[number].length // bytes_each

    def _part(self, number: int, topic: Topic) -> bytes:
        """Return the part of a chunk that belongs to a topic; nothing if it has none."""
        messages = self.reader.messages(self.reader.chunks[number])
        return next((data for name, _, data in messages if name == topic.name), b"")

    def damaged(self, why: str) -> ParameterError:
        """Return the error that says why it is not whole."""
        return ParameterError(f"{self.reader.what} must be whole, but {why}. Take another copy of it.")


def _is_input(columns: Columns) -> NDArray[np.bool_]:
    return columns.kind <= LAST_INPUT
