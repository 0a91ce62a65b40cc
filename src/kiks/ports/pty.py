"""A pseudo-terminal: a serial port for any program in any language, under a stable name.

A client may open the port raw or canonical, at any speed, and the next client must find it like new. The server must
notice that a client has closed the port, to drop its unfinished command and its unread replies.

On Linux (tried): the master reports a hang-up while the slave is closed, but not before its first open; the settings of
the slave and the characters in it outlive the client; the master reads and sets the slave's settings; characters that
the master writes while the slave is closed wait for the next client.

So between two clients the endpoint itself holds the slave open, and needs no polling. The first character shows that a
client is there. The endpoint then closes the slave, and the next hang-up is the client's. A program that opens the port
and writes nothing, such as `stty`, is no client: its settings stay, as on a real port.
"""

from __future__ import annotations

import fcntl
import os
import select
import stat
import struct
import tempfile
import termios
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from kiks.errors import LinkError
from kiks.model.atomic_files import locked_file
from kiks.ports.endpoint import READ_SIZE, Channel, Endpoint
from kiks.ports.resources import SHORTAGES, opening

TCGETS2 = 0x802C542A
"""Linux request for terminal settings with any speed, as a number (asm-generic/ioctls.h)."""

SETTINGS2 = struct.Struct("4I20s2I")
"""Four flag words, line discipline and control characters, speed in, speed out [bit/s] (asm-generic/termbits.h)."""

SLAVES = "/dev/pts/"


class PtyEndpoint(Endpoint):
    """A pseudo-terminal with a stable link to it.

    Args:
        link: Path of the link; a link that a dead server left there is replaced.
        baud: Speed of the port until a client sets one [bit/s].

    Raises:
        LinkError: If the link belongs to a running server, another file has its name, or it cannot be created.
    """

    def __init__(self, link: str | Path, *, baud: int = 9600) -> None:
        self.name = os.path.abspath(link)
        self._baud = baud
        with opening("a serial port"):
            self._claim = _claim(self.name)
        try:
            self._master, self._slave_name, self._held = -1, "", -1
            self._create()
        except BaseException:
            self._leave()
            raise

    def _create(self) -> None:
        """Make a pseudo-terminal and point the link to it."""
        with opening("a serial port"):
            master, held = os.openpty()
        os.set_blocking(master, False)
        slave_name = os.ttyname(held)
        try:
            _point(self.name, slave_name)
        except BaseException:
            os.close(held)
            os.close(master)
            raise
        self._master, self._slave_name, self._held = master, slave_name, held
        self._reset()

    def _reset(self) -> None:
        """Give the slave the settings of a new port: raw, no echo, 8N2."""
        speed = getattr(termios, f"B{self._baud}", termios.B9600)
        flags = termios.CS8 | termios.CSTOPB | termios.CREAD | termios.CLOCAL
        characters = list(termios.tcgetattr(self._master)[6])
        characters[termios.VMIN], characters[termios.VTIME] = 1, 0
        termios.tcsetattr(self._master, termios.TCSANOW, [0, 0, flags, 0, speed, speed, characters])

    def fileno(self) -> int:
        """Return the master."""
        return self._master

    def accept(self) -> PtyChannel:
        """Close the slave, so that the master reports the client's hang-up."""
        # The descriptor's number stays reserved for the slave.
        os.dup2(self._master, self._held, inheritable=False)
        return PtyChannel(self)

    def reject(self) -> None:
        """Drop the characters of the other client."""
        os.read(self._master, READ_SIZE)

    def renew(self) -> None:
        """Restore the port after a client."""
        self._reset()
        os.close(self._held)
        try:
            self._held = os.open(self._slave_name, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError:
            # The client has locked the terminal (TIOCEXCL) and died: it cannot be opened any more.
            os.close(self._master)
            self._create()
            return
        termios.tcflush(self._held, termios.TCIFLUSH)

    def close(self) -> None:
        """Remove the link and the pseudo-terminal; a client that is still there sees a hang-up."""
        if os.path.islink(self.name) and os.readlink(self.name) == self._slave_name:
            os.unlink(self.name)
        os.close(self._held)
        os.close(self._master)
        self._leave()

    def _leave(self) -> None:
        """Give the link's name up."""
        with suppress(OSError):  # its folder may have gone
            os.unlink(_lock_of(self.name))
        self._claim.close()


class PtyChannel(Channel):
    """The client that has the slave open."""

    def __init__(self, endpoint: PtyEndpoint) -> None:
        super().__init__(endpoint.name)
        self._endpoint = endpoint
        self._master = endpoint.fileno()
        self._settings = bytearray(SETTINGS2.size)

    def fileno(self) -> int:
        """Return the master."""
        return self._master

    def read(self) -> bytes | None:
        """Return the bytes of the client, and note the speed that it has set; None when it has closed the slave."""
        try:
            data = os.read(self._master, READ_SIZE)
        except BlockingIOError:
            return b""
        except OSError:
            return None
        fcntl.ioctl(self._master, TCGETS2, self._settings)
        # Speed 0 asks a modem to hang up; there is none.
        self.baud = SETTINGS2.unpack(self._settings)[-1] or self.baud
        return data

    def _put(self, data: bytes | bytearray) -> int:
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            poll = select.poll()
            poll.register(self._master, 0)
            return len(data) if poll.poll(0) else 0

    def close(self) -> None:
        """Restore the port for the next client."""
        self._endpoint.renew()


def default_folder() -> Path:
    """Return the folder of links and sessions, this user's alone: `$XDG_RUNTIME_DIR/kiks`, else `/tmp/kiks-<uid>`.

    Raises:
        LinkError: If something else has that name.
    """
    runtime = Path(os.environ.get("XDG_RUNTIME_DIR", ""))
    folder = runtime / "kiks" if _is_own(runtime) else Path(tempfile.gettempdir(), f"kiks-{os.getuid()}")
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        raise LinkError(
            f"{str(folder)!r} must be a folder of yours, but it is not ({error.strerror}). Give a link of your own."
        ) from None
    if not _is_own(folder):
        raise LinkError(
            f"{str(folder)!r} must be a folder of yours, but it is another user's, or others can write there. Give a "
            "link of your own."
        )
    folder.chmod(0o700)
    return folder


def _is_own(folder: Path) -> bool:
    """Return whether a path is a folder (not a link) of this user in which no other user can write."""
    try:
        found = folder.lstat()
    except OSError:
        return False
    return (
        folder.is_absolute()
        and stat.S_ISDIR(found.st_mode)
        and found.st_uid == os.getuid()
        and not found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    )


def _lock_of(path: str) -> Path:
    return Path(path).with_name(f".{Path(path).name}.lock")


def _claim(path: str) -> BinaryIO:
    """Reserve a link's name until this process ends, by a lock on a file beside it; only who may write there can."""
    try:
        return locked_file(_lock_of(path), os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o600)
    except BlockingIOError:
        raise LinkError(
            f"link {path!r} must be free, but a KiKS that is running has it. Stop that one, or give another link."
        ) from None
    except OSError as error:
        if error.errno in SHORTAGES:
            raise
        raise _unwritable(path, error) from None


def _unwritable(path: str, error: OSError) -> LinkError:
    return LinkError(
        f"link {path!r} must be in a folder that you can write to, but it is not ({error.strerror}). Take another."
    )


def _point(path: str, target: str) -> None:
    """Create a link; it replaces a link of a dead server, and no other file."""
    if os.path.lexists(path) and not (os.path.islink(path) and os.readlink(path).startswith(SLAVES)):
        raise LinkError(
            f"link {path!r} must not exist or be an old link to a terminal, but it is another file. Give another name."
        )
    fresh = f"{path}.{os.getpid()}"
    try:
        os.symlink(target, fresh)
        os.replace(fresh, path)
    except OSError as error:
        raise _unwritable(path, error) from None
