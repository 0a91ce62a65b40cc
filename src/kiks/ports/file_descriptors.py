"""File descriptors: a server that has run out of them logs one line and goes on.

Each connection and each pseudo-terminal takes descriptors, and their number is limited. A listener that cannot accept
stays readable: a loop that tries again spins, and a loop that raises ends. So one descriptor is held in reserve. When
there is no other, the reserve is closed, the waiting client is accepted and disconnected, and the reserve is opened
again. So the queue always empties.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import resource
import socket
import threading
from collections.abc import Iterator

from kiks.errors import LinkError

WANTED = 1 << 14
"""Descriptors that a process asks for at its start: enough for a thousand robots with three ports and a client each."""

SHORTAGES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
"""Errors that mean that this process or the computer has none left, or no memory for one."""

_log = logging.getLogger("kiks.ports")


def raise_limit() -> None:
    """Raise the limit of descriptors of this process to the largest allowed one, up to `WANTED`."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = WANTED if hard == resource.RLIM_INFINITY else min(WANTED, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def shortage() -> str:
    """Return the limit that was reached and how to raise it, as text."""
    limit, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return f"this process may have {limit}, and all are in use. Allow more: ulimit -n {max(4 * limit, 4096)}."


@contextlib.contextmanager
def opening(what: str) -> Iterator[None]:
    """Turn an error of the operating system into a LinkError of one line.

    Args:
        what: The subject of the message.

    Raises:
        LinkError: If the operating system does not open it.
    """
    try:
        yield
    except LinkError:
        raise
    except OSError as error:
        why = (
            f"it needs a file descriptor: {shortage()}"
            if error.errno in SHORTAGES
            else f"it cannot ({error.strerror})."
        )
        raise LinkError(f"{what} must be able to open, but {why}") from None


class Reserve:
    """A descriptor for rejecting a client when there is no other; `RESERVE` is the process's."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._spare = -1
        self._has_warned = False

    def hold(self) -> None:
        """Open the reserve, if a descriptor is free; called when a listener opens."""
        with self._lock:
            if self._spare < 0:
                with contextlib.suppress(OSError):
                    self._spare = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)

    def accept(self, listener: socket.socket) -> socket.socket | None:
        """Return the next connection; None if there is none, or no descriptor for it: then it is disconnected.

        Raises:
            OSError: If the listener is closed.
        """
        self.hold()
        try:
            connection, _ = listener.accept()
        except (BlockingIOError, ConnectionAbortedError):
            return None
        except OSError as error:
            if error.errno not in SHORTAGES:
                raise
            self._reject(listener)
            return None
        return connection

    def _reject(self, listener: socket.socket) -> None:
        if not self._has_warned:
            self._has_warned = True
            _log.warning("a client needs a file descriptor: %s Clients are rejected until some are free.", shortage())
        with self._lock:
            if self._spare >= 0:
                os.close(self._spare)
                self._spare = -1
            timeout_s = listener.gettimeout()
            try:
                listener.setblocking(False)
                listener.accept()[0].close()
            except OSError:
                pass
            finally:
                listener.settimeout(timeout_s)
        self.hold()


RESERVE = Reserve()
"""The reserve of this process."""
