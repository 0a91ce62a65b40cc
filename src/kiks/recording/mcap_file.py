"""The MCAP file of a recording: chunks with messages, and attachments between them (https://mcap.dev/spec).

Chunks are found by the heads of the records, from the beginning on, so that a file without an end is read like any
other. Nothing is read or expanded beyond its declared size, which is checked before.
"""

from __future__ import annotations

import io
import os
import shutil
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import lz4.frame
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Chunk, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from kiks.errors import ParameterError
from kiks.meant import nearest_file
from kiks.model.atomic_files import FileBeside, ending_of, explained, path_of, target_of
from kiks.model.limits import RECORD_BYTES_MAX
from kiks.version import __version__

ENDING = ".mcap"

PROFILE = "kiks"

_MAGIC = b"\x89MCAP0\r\n"
_HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQ")
_CRC = struct.Struct("<I")
_MESSAGE = struct.Struct("<BQHIQQ")
_IN_CHUNKS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)

RESERVE_BYTES, RESERVE_SHARE = 128 << 20, 0.05
"""What recordings leave free of a disk [bytes], or of a small disk this share."""


class DiskSpace(NamedTuple):
    """The free space of a disk, and how much of it recordings leave to other programs."""

    free_bytes: int
    reserve_bytes: int

    @property
    def is_too_small(self) -> bool:
        """Whether only the reserve is left."""
        return self.free_bytes < self.reserve_bytes


def disk_space(folder: Path) -> DiskSpace:
    """Return the free space of the disk on which a folder lies.

    Raises:
        OSError: If there is no such folder.
    """
    disk = shutil.disk_usage(folder)
    return DiskSpace(disk.free, min(RESERVE_BYTES, int(disk.total * RESERVE_SHARE)))


TOPIC = "/kiks/log"
"""The channel of a recording; its number is 1."""


class McapFile(FileBeside):
    """A file that grows chunk by chunk, while no other recording does there.

    It begins beside an earlier file, and replaces it when something has happened.

    The first chunk announces all channels, so that every chunk can be read without an index. After an error of the
    disk nothing more is written, and `close` raises it: a recording never ends the run.

    Args:
        path: The file.
    """

    def __init__(self, path: str | Path) -> None:
        ending_of(path, "a recording's file", (ENDING,))
        self._given = path
        with explained(path, "a recording"):
            target = target_of(path)
            self._folder = target.parent
            if (room := disk_space(self._folder)).is_too_small:
                raise ParameterError(
                    f"a recording must leave {room.reserve_bytes / 2**20:.3g} MiB of its disk free, but that of "
                    f"{str(path)!r} has {room.free_bytes / 2**20:.3g} MiB. Free some space, or choose another "
                    "place."
                )
            super().__init__(target, is_only=True)
        self._writer = Writer(self.file, chunk_size=RECORD_BYTES_MAX, compression=CompressionType.LZ4)
        self.attempt(lambda: self._writer.start(profile=PROFILE, library=f"kiks {__version__}"))
        self._writer.register_channel(TOPIC, "kiks", schema_id=0)

    @property
    def is_disk_full(self) -> bool:
        """Whether only the reserve of its disk is left."""
        try:
            return disk_space(self._folder).is_too_small
        except OSError:  # the folder has another name now
            return False

    def take_place(self, *, keeps_rights: bool = True) -> None:
        """Take the place of its path, unless it has it."""
        if not self.is_in_place:
            self.attempt(super().take_place)

    def attach(self, name: str, data: bytes, media_type: str, time_ns: int = 0) -> None:
        """Write a file within the file."""
        self.attempt(lambda: self._writer.add_attachment(0, time_ns, name, media_type, data))

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Write texts by name."""
        self.attempt(lambda: self._writer.add_metadata(name, dict(values)))

    def write(self, begin_ns: int, log: bytes, *, keeps_earlier: bool = False) -> None:
        """Write a chunk, and take the place.

        Args:
            begin_ns: Its time [ns].
            log: A block of entries.
            keeps_earlier: Whether not to take that of an earlier file, or any on a full disk.
        """

        def add_all() -> None:
            self._writer.add_message(1, begin_ns, log, begin_ns)
            self._writer.flush()  # type: ignore[no-untyped-call]

        self.attempt(add_all)
        if not (keeps_earlier and (self.has_earlier or self.is_disk_full)):
            self.take_place()

    def close(self) -> None:
        """Write the index, and close the file; it goes if it never took its place."""
        self.attempt(self._writer.finish)
        self.attempt(self.file.flush)
        with explained(self._given, "a recording"):
            super().close()


@dataclass(frozen=True)
class FoundChunk:
    """Where a chunk is, and when it begins.

    Attributes:
        offset: Of its record in the file.
        length: Of its record.
        begin_ns: Time of its first message [ns].
    """

    offset: int
    length: int
    begin_ns: int


class McapReader:
    """Reads a recording's file.

    Attributes:
        path: The file.
        what: What messages call it.
        chunks: Its whole chunks, in their order in the file.
        attachments: Names and contents of its attachments.
        about: Texts of its metadata, by name.
        is_whole: Whether it has an end; else the run that wrote it was killed, or still writes.
    """

    def __init__(self, path: str | Path) -> None:
        self.what = f"Recording {str(path)!r}"
        self.path = path_of(path, "a recording")
        if not self.path.is_file():
            raise ParameterError(
                f"{self.what} must exist, but there is no such file. Check its name and its folder."
                f"{nearest_file(self.path)}"
            )
        self.chunks: list[FoundChunk] = []
        self.attachments: dict[str, bytes] = {}
        self.about: dict[str, str] = {}
        self.is_whole = False
        with self._open() as stream:
            if stream.read(len(_MAGIC)) != _MAGIC:
                raise ParameterError(f"{self.what} must be an MCAP file, but it is none. `--record FILE` makes one.")
            self._offset = len(_MAGIC)
            self._find_all(stream)

    def _open(self) -> BinaryIO:
        try:
            return self.path.open("rb")
        except OSError as error:
            raise ParameterError(f"{self.what} must be readable, but: {error}. Check its rights.") from None

    def _find_all(self, stream: BinaryIO) -> None:
        size = os.fstat(stream.fileno()).st_size
        while not self.is_whole and self._offset + _HEAD.size <= size:
            stream.seek(self._offset)
            opcode, length = _HEAD.unpack(stream.read(_HEAD.size))
            end = self._offset + _HEAD.size + length
            if end > size:
                return  # what a crash has cut off
            if length > RECORD_BYTES_MAX:
                raise ParameterError(
                    f"{self.what} must have records of at most {RECORD_BYTES_MAX >> 20} MiB, but one has {length} "
                    "bytes. Is the file damaged?"
                )
            self._find(stream, opcode, length)
            self._offset = end

    def _find(self, stream: BinaryIO, opcode: int, length: int) -> None:
        if opcode == Opcode.CHUNK and length >= _CHUNK_HEAD.size:
            begin_ns, _, _ = _CHUNK_HEAD.unpack(stream.read(_CHUNK_HEAD.size))
            self.chunks.append(FoundChunk(self._offset, _HEAD.size + length, begin_ns))
        elif opcode in (Opcode.ATTACHMENT, Opcode.METADATA):
            stream.seek(self._offset)
            data = stream.read(_HEAD.size + length)
            for record in self._records(data):
                if isinstance(record, Attachment):
                    # The checksum at the end is of all of the record before it.
                    if _CRC.unpack(data[-_CRC.size :])[0] not in (0, zlib.crc32(data[_HEAD.size : -_CRC.size])):
                        raise self._damaged("attachments")
                    self.attachments[record.name] = record.data
                elif isinstance(record, Metadata):
                    self.about |= record.metadata
        elif opcode == Opcode.DATA_END:
            self.is_whole = True

    @property
    def blocks(self) -> range:
        """The numbers of its chunks."""
        return range(len(self.chunks))

    def chunk(self, block: int) -> FoundChunk:
        """Return where a chunk is, by its number."""
        return self.chunks[block]

    def read(self, block: int) -> bytes:
        """Return the log of a chunk; nothing if it has none."""
        messages = (record for record in self._inside(self.chunks[block]) if record[0] == Opcode.MESSAGE)
        return next((record[_MESSAGE.size :] for record in messages if _MESSAGE.unpack_from(record)[2] == 1), b"")

    def _inside(self, chunk: FoundChunk) -> Iterator[bytes]:
        """Yield the records in a chunk, each with its head. None is smaller than an empty message."""
        with self._open() as stream:
            stream.seek(chunk.offset)
            packed = stream.read(chunk.length)
        for record in self._records(packed):
            data = self._expanded(record) if isinstance(record, Chunk) else b""
            begin = 0
            while begin < len(data):
                least = begin + _MESSAGE.size
                opcode, length = _HEAD.unpack_from(data, begin) if least <= len(data) else (0, 0)
                end = begin + _HEAD.size + length
                if opcode not in _IN_CHUNKS or not least <= end <= len(data):
                    raise self._damaged()
                yield data[begin:end]
                begin = end

    def _expanded(self, chunk: Chunk) -> bytes:
        """Return what a chunk holds, no more than it says."""
        if chunk.compression not in ("", "lz4"):
            raise ParameterError(
                f"{self.what} must have chunks without compression or with lz4, but one has {chunk.compression!r}. "
                "KiKS writes lz4."
            )
        data, size = chunk.data, chunk.uncompressed_size
        if chunk.compression and size <= RECORD_BYTES_MAX:
            with suppress(RuntimeError, EOFError):
                data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
        if len(data) != size or chunk.uncompressed_crc not in (0, zlib.crc32(data)):
            raise self._damaged("chunks")
        return data

    def _records(self, data: bytes) -> Iterator[Any]:
        """Yield the MCAP records in bytes."""
        stream = io.BytesIO(data)
        reader = StreamReader(stream, skip_magic=True, emit_chunks=True, record_size_limit=len(data))
        records = reader.records
        while stream.tell() < len(data):
            try:
                yield next(records)
            except StopIteration:
                return
            except (McapError, EOFError, ValueError, struct.error, OverflowError, MemoryError) as error:
                raise self._damaged(why=f" ({error or type(error).__name__})") from None

    def _damaged(self, parts: str = "records", why: str = "") -> ParameterError:
        return ParameterError(f"{self.what} must have whole {parts}, but one is damaged{why}. Take another copy of it.")
