"""Session files, by which programs find sessions: readable by this user alone, and locked while the session runs."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, NamedTuple

from kiks.errors import LinkError, shown
from kiks.model.atomic_files import NO_LINK_NO_WAIT, lock, locked_file
from kiks.ports.pty import default_folder
from kiks.version import __version__

FILE_MAX = 1000
"""Maximum size of a session file [bytes]."""

CONNECT_S = 10.0
"""Timeout of a connection to a session [s of real time]."""

_PREFIX = "session-"


class SessionAddress(NamedTuple):
    """Address of a session on this computer.

    Attributes:
        number: Number of the session and of its process.
        port: Its TCP port.
        token: The token that a client must send first.
    """

    number: int
    port: int
    token: str

    def line(self) -> str:
        """Return the line that the toolbox reads."""
        return f"KiKS {__version__} session {self.number} port {self.port} token {self.token}\n"

    @staticmethod
    def parse(line: bytes) -> SessionAddress | None:
        """Parse the line of a session file; return None if it is not valid."""
        try:
            words = line.decode("ascii").split()
            return SessionAddress(int(words[3]), int(words[5]), words[7])
        except (ValueError, IndexError):
            return None

    def connect(self) -> socket.socket:
        """Connect to the session and send the token.

        Raises:
            LinkError: If the session has ended.
        """
        try:
            connection = socket.create_connection(("127.0.0.1", self.port), timeout=CONNECT_S)
            connection.settimeout(None)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.sendall(f"{self.token}\n".encode())
        except OSError as error:
            reason = error.strerror or error
            raise LinkError(f"session {self.number} must run to be joined, but it has ended ({reason}).") from None
        return connection


class SessionFile:
    """The session file of this process; it exists from `open` until `close` or the end of the process.

    Args:
        address: Address of the session.

    Raises:
        LinkError: If this user has no folder for it.
    """

    def __init__(self, address: SessionAddress) -> None:
        self._address = address
        self._path = default_folder() / f"{_PREFIX}{address.number}"
        self._file: BinaryIO | None = None

    def open(self) -> None:
        """Write the file, unless it exists.

        Raises:
            LinkError: If it cannot be written.
        """
        if self._file is None:
            # An earlier process of this number may have left its file behind.
            self._path.unlink(missing_ok=True)
            self._file = _create(self._path, self._address)

    def close(self) -> None:
        """Remove the file if it exists."""
        if self._file is not None:
            self._path.unlink(missing_ok=True)
            self._file.close()
            self._file = None


def find_session(number: int) -> SessionAddress:
    """Return the address of a session of this user on this computer.

    Args:
        number: Number of the session; 0 for the newest.

    Raises:
        LinkError: If there is none.
    """
    sessions = list(_addresses(default_folder()))
    for address in sessions:
        if number in (0, address.number):
            return address
    known = (
        f"those that run are {[address.number for address in sessions]}" if sessions else "none runs on this computer"
    )
    which = "a session" if number == 0 else f"session {number}"
    raise LinkError(f"{which} must run before it is joined, but {known}. Start one with kiks(ARENA) in another Octave.")


def write_session_file(address: SessionAddress, path: Path) -> None:
    """Write the address of a session into a new file that this user alone can read.

    Raises:
        LinkError: If the file exists or cannot be written.
    """
    beside = path.with_name(f".{path.name}-{os.getpid()}")
    with _create(beside, address):
        try:
            # A link fails if the file exists, and a reader never sees a part of the file.
            os.link(beside, path)
        except OSError as error:
            raise _not_new(path, error) from None
        finally:
            beside.unlink(missing_ok=True)


def _create(path: Path, address: SessionAddress) -> BinaryIO:
    """Write a new file, and lock it as long as it is open."""
    try:
        file = locked_file(path, os.O_CREAT | os.O_EXCL | NO_LINK_NO_WAIT, 0o600)
        file.write(address.line().encode("ascii"))
        file.flush()
    except OSError as error:
        raise _not_new(path, error) from None
    return file


def _not_new(path: Path, error: OSError) -> LinkError:
    return LinkError(f"{shown(str(path))} must be a new file that can be written, but it is not ({error.strerror}).")


def _addresses(folder: Path) -> Iterator[SessionAddress]:
    """Yield the addresses in the locked files, the newest first; delete files without a lock.

    The folder is this user's alone, and so are the files in it.
    """
    times = {}
    for path in folder.glob(f"{_PREFIX}*"):
        with suppress(OSError):
            times[path] = path.lstat().st_mtime_ns
    for path in sorted(times, key=times.__getitem__, reverse=True):
        with suppress(OSError), open(os.open(path, os.O_RDWR | NO_LINK_NO_WAIT), "rb") as file:
            try:
                if lock(file.fileno(), path):
                    path.unlink()
            except BlockingIOError:
                address = SessionAddress.parse(file.read(FILE_MAX))
                if address is not None:
                    yield address
