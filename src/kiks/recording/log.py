"""The log of a recording, read block by block."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from kiks.errors import ParameterError
from kiks.recording.entries import RECORDED_LAYOUT, Entry, pack_entries, unpack_entries
from kiks.recording.mcap_file import FoundChunk
from kiks.sim.run_log import ACT, CHECK, LAST_INPUT, MARK, SCORE, STATE, TEXT
from kiks.sim.saved_state import SavedState, WorldFiles
from kiks.units import s_from_ns
from kiks.version import __version__

HASH_LENGTH = 16
"""Characters of a hash, before the state of a checkpoint."""

BLOCKS_KEPT = 4
"""Blocks of the log that are kept when they were read."""


class EntryPlace(NamedTuple):
    """The place of an entry: which block of the log it is in, and its row there."""

    block: int
    row: int


class Source(Protocol):
    """Where a recording is read from: a file, or the past of a desk."""

    @property
    def what(self) -> str:
        """What messages call it."""

    @property
    def path(self) -> Path:
        """The file, or what stands for its name."""

    @property
    def about(self) -> Mapping[str, str]:
        """What it says of the run."""

    @property
    def attachments(self) -> Mapping[str, bytes]:
        """Names and contents of the files that belong to the run."""

    @property
    def blocks(self) -> range:
        """The numbers of its chunks."""

    def chunk(self, block: int) -> FoundChunk:
        """Return where a chunk is, by its number."""

    def read(self, block: int) -> bytes:
        """Return the log of a chunk; nothing if it has none."""


class RecordedLog:
    """The log of a recording, for one thread at a time."""

    def __init__(self, reader: Source) -> None:
        self.reader = reader
        self._files = WorldFiles(reader.attachments, reader.what)
        self._blocks: OrderedDict[int, list[Entry]] = OrderedDict()
        self._first = -1
        if "layout" not in reader.about or not reader.blocks:
            raise ParameterError(
                f"{reader.what} must be a recording of KiKS, but it is another MCAP file, or the run was killed at its "
                "very beginning. `--record FILE` makes one."
            )
        if reader.about["layout"] != RECORDED_LAYOUT:
            raise ParameterError(
                f"Cannot read {reader.what}: KiKS {reader.about.get('kiks', '?')} recorded it with other fields than "
                f"KiKS {__version__} has. Read it with that version."
            )

    def __repr__(self) -> str:
        return f"<RecordedLog of {self.reader.what}, {s_from_ns(self.begin_ns):.3f} to {s_from_ns(self.end_ns):.3f} s>"

    @property
    def blocks(self) -> range:
        """The numbers of its blocks, from the first one on that has a state: no run can be made again before that."""
        blocks = self.reader.blocks
        if self._first not in blocks:
            self._first = next((block for block in blocks if any(map(has_state, self.entries_in(block)))), -1)
            if self._first < 0:
                raise self.damaged("it has no state")
        return range(self._first, blocks.stop)

    @property
    def begin_ns(self) -> int:
        """When it begins [ns]: at its first state."""
        return next(entry.time_ns for entry in self.entries_in(self.blocks.start) if has_state(entry))

    @property
    def end_ns(self) -> int:
        """When it ends [ns]: at its last checkpoint."""
        entries = self.entries_in(self.blocks[-1])
        return max((entry.time_ns for entry in entries if entry.kind <= LAST_INPUT), default=entries[0].time_ns)

    def entries_from(self, time_ns: int) -> Iterator[Entry]:
        """Yield the entries from a time on [ns], by time."""
        for block in range(self._block_at(time_ns - 1), self.blocks.stop):
            for entry in sorted(self.entries_in(block), key=lambda entry: entry.time_ns):
                if entry.time_ns >= time_ns:
                    yield entry

    def entries_in(self, block: int) -> Sequence[Entry]:
        """Return the entries of a block."""
        if block not in self._blocks:
            self._blocks[block] = self._read(block)
            if len(self._blocks) > BLOCKS_KEPT:
                self._blocks.popitem(last=False)
        return self._blocks[block]

    def notes_in(self, block: int) -> list[Entry]:
        """Return the entries of a block that people care for: output, bookmarks, scores and changes by hand."""
        return self._read(block, (STATE, SCORE, TEXT, MARK))

    def _read(self, block: int, kinds: Sequence[int] | None = None) -> list[Entry]:
        return unpack_entries(self.reader.read(block), self.reader.what, kinds)

    def until(self, block: int, time_ns: int) -> bytes:
        """Return the log of a block, as bytes, up to a time [ns], with bookmarks before it that were set later.

        It is empty if the block has no entry up to then: a chunk may begin before its first entry.
        """
        entries = [entry for entry in self.entries_in(block) if entry.time_ns <= time_ns]
        for later in range(block, self.blocks.stop):
            marks = (note for note in self.notes_in(later) if note.kind == MARK)
            entries += [mark._replace(time_ns=time_ns) for mark in marks if mark.number <= time_ns < mark.time_ns]
        return pack_entries([value for entry in entries for value in entry]) if entries else b""

    def place_before(self, time_ns: int) -> EntryPlace:
        """Return the place of the last checkpoint at or before a time [ns], or of the first state."""
        begin_ns = self.begin_ns
        for block in range(self._block_at(time_ns), self.blocks.start - 1, -1):
            entries = self.entries_in(block)
            for row in range(len(entries) - 1, -1, -1):
                if has_state(entries[row]) and entries[row].time_ns <= max(time_ns, begin_ns):
                    return EntryPlace(block, row)
        raise self.damaged("it has no state")

    def _block_at(self, time_ns: int) -> int:
        """Return the number of the last block that begins at or before a time [ns], or of the first one."""
        blocks = self.blocks
        return max((block for block in blocks if self.reader.chunk(block).begin_ns <= time_ns), default=blocks.start)

    def entry(self, place: EntryPlace) -> Entry:
        """Return the entry at a place."""
        return self.entries_in(place.block)[place.row]

    def next_input(self, place: EntryPlace) -> tuple[EntryPlace, Entry, bool] | None:
        """Return the next input after a place, None after the last one.

        Returns:
            Its place, the entry, and whether robots acted between it and the place.
        """
        has_acted, begin = False, place.row + 1
        for block in range(place.block, self.blocks.stop):
            entries = self.entries_in(block)
            for next_row in range(begin, len(entries)):
                if (entry := entries[next_row]).kind <= LAST_INPUT:
                    return EntryPlace(block, next_row), entry, has_acted
                has_acted = has_acted or entry.kind == ACT
            begin = 0
        return None

    def state_of(self, entry: Entry) -> SavedState:
        """Return the state of an entry."""
        data = entry.data[HASH_LENGTH:] if entry.kind == CHECK else entry.data
        saved = SavedState.from_bytes(data, self._files, f"{self.reader.what}: state")
        if saved.now_ns != entry.time_ns:
            raise self.damaged(f"a state of {s_from_ns(saved.now_ns):.3f} s is at {s_from_ns(entry.time_ns):.3f} s")
        return saved

    def state_before(self, time_ns: int) -> SavedState:
        """Return the last recorded state at or before a time [ns]."""
        return self.state_of(self.entry(self.place_before(time_ns)))

    def damaged(self, why: str) -> ParameterError:
        """Return the error that says why it is not whole."""
        return ParameterError(f"{self.reader.what} must be whole, but {why}. Take another copy of it.")


def has_state(entry: Entry) -> bool:
    """Return whether an entry has a state."""
    return entry.kind == STATE or (entry.kind == CHECK and len(entry.data) > HASH_LENGTH)
