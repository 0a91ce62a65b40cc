"""The newest part of a run, for as long as the process lives: a ring of chunks in a file without a name.

The system deletes such a file with the process, however it ends. A chunk follows the one before it. Where the file may
not grow, the next one goes to its beginning, and the oldest chunks make room.
"""

from __future__ import annotations

import os
import tempfile
import threading
import weakref
from collections.abc import Callable
from pathlib import Path

import lz4.frame

from kiks.errors import ParameterError
from kiks.recording.log import RecordedLog
from kiks.recording.mcap_file import FoundChunk, disk_space
from kiks.recording.recorder import describe_run
from kiks.sim.simulation import Simulation
from kiks.units import s_from_ns

BYTES_MAX = 256 << 20
"""Most bytes of the file."""

COPY_BYTES_MAX = 64 << 20
"""Most bytes of another recording that a ring begins with."""


class Ring:
    """The newest part of a run, as a `kiks.recording.recorder.Store` and a `kiks.recording.log.Source`.

    Args:
        sim: The simulation.
        say: Called with messages for people, from any thread.

    Raises:
        OSError: If there is no temporary folder.
    """

    def __init__(self, sim: Simulation, say: Callable[[str], object] = lambda text: None) -> None:
        self.what = "The past of this run"
        self.path = Path("run.mcap")
        self.about = describe_run(sim)
        self.attachments: dict[str, bytes] = {}
        self._say = say
        with tempfile.TemporaryFile(prefix="kiks-") as file:
            self._file = os.dup(file.fileno())
        weakref.finalize(self, os.close, self._file)
        self._lock = threading.Lock()
        self._chunks: dict[int, FoundChunk] = {}
        self._next = self._end = 0
        self._has_dropped = False
        _check_room()

    # ---- as a store ----

    def attach(self, name: str, data: bytes) -> None:
        """Keep a file that belongs to the run."""
        self.attachments[name] = data

    def write(self, begin_ns: int, log: bytes) -> bool:
        """Write a chunk; return whether that was possible."""
        data = lz4.frame.compress(log)
        try:
            with self._lock:
                self._append(begin_ns, data)
        except (ParameterError, OSError) as error:
            self._say(f"Cannot record the past any longer: {error}")
            return False
        return True

    def _append(self, begin_ns: int, data: bytes) -> None:
        if self._end + len(data) > BYTES_MAX:
            self._drop(self._end, BYTES_MAX)  # what is left of the round before
            self._end = 0
        _check_room()
        has_dropped = self._drop(self._end, self._end + len(data))
        if os.pwrite(self._file, data, self._end) < len(data):
            raise OSError("no space left")
        self._chunks[self._next] = FoundChunk(self._end, len(data), begin_ns)
        self._next += 1
        self._end += len(data)
        if has_dropped and not self._has_dropped:
            self._has_dropped = True
            self._say(
                f"The time bar now begins at {s_from_ns(next(iter(self._chunks.values())).begin_ns):.0f} s: the past "
                f"has at most {BYTES_MAX >> 20} MiB. To keep a whole run, start KiKS with --record FILE."
            )

    def _drop(self, begin: int, end: int) -> bool:
        """Drop the oldest chunks as long as they begin in a part of the file; return whether there were any."""
        count = len(self._chunks)
        while self._chunks and begin <= self._chunks[oldest := next(iter(self._chunks))].offset < end:
            del self._chunks[oldest]
        return len(self._chunks) < count

    def copy(self, log: RecordedLog, until_ns: int) -> None:
        """Write what another recording has up to a time [ns], or the last `COPY_BYTES_MAX` of that."""
        self.attachments |= log.reader.attachments
        blocks, count_bytes = [], 0
        for block in reversed(log.blocks):
            chunk = log.reader.chunk(block)
            if chunk.begin_ns <= until_ns and count_bytes <= COPY_BYTES_MAX:
                blocks.append(block)
                count_bytes += chunk.length
        for block in reversed(blocks[1:]):
            self.write(log.reader.chunk(block).begin_ns, log.reader.read(block))
        if blocks and (end := log.until(blocks[0], until_ns)):
            self.write(log.reader.chunk(blocks[0]).begin_ns, end)

    # ---- as a source ----

    @property
    def blocks(self) -> range:
        """The numbers of its chunks, which rise."""
        with self._lock:
            return range(next(iter(self._chunks), self._next), self._next)

    def chunk(self, block: int) -> FoundChunk:
        """Return where a chunk is, by its number."""
        with self._lock:
            return self._chunk(block)

    def _chunk(self, block: int) -> FoundChunk:
        if block not in self._chunks:
            raise ParameterError(f"{self.what} has gone on: that time was dropped. Choose a later time.")
        return self._chunks[block]

    def read(self, block: int) -> bytes:
        """Return the log of a chunk."""
        with self._lock:
            chunk = self._chunk(block)
            packed = os.pread(self._file, chunk.length, chunk.offset)
        log: bytes = lz4.frame.decompress(packed)
        return log


def _check_room() -> None:
    room = disk_space(Path(tempfile.gettempdir()))
    if room.is_too_small:
        raise ParameterError(
            f"the disk of the temporary folder must have {room.reserve_bytes >> 20} MiB free, but it has "
            f"{room.free_bytes >> 20} MiB. Free some space and start the world over, or start KiKS with TMPDIR set to "
            "a folder on another disk."
        )
