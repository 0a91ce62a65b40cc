"""What the system lets a process have: file descriptors and processors.

Each connection and each pseudo-terminal takes descriptors, and their number is limited. A server that has run out of
them logs one line and goes on, and new clients wait.
"""

from __future__ import annotations

import contextlib
import errno
import functools
import importlib
import logging
import os
import select
import socket
from collections.abc import Iterator
from typing import Any

from kiks.errors import LinkError

resource: Any = None
with contextlib.suppress(ModuleNotFoundError):  # Windows has none
    resource = importlib.import_module("resource")

WANTED = 1 << 14
"""Descriptors that a process asks for at its start: enough for a thousand robots with three ports and a client each."""

SHORTAGES = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
"""Errors that mean that this process or the computer has none left, or no memory for one."""

SHORTAGE_PAUSE_S = 0.05
"""Pause before a server without descriptors tries to accept a client again [s of real time]."""

_log = logging.getLogger("kiks.ports")


def raise_limit() -> None:
    """Raise the limit of descriptors of this process to the largest allowed one, up to `WANTED`."""
    if resource is None:
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = WANTED if hard == resource.RLIM_INFINITY else min(WANTED, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with contextlib.suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def shortage() -> str:
    """Return the limit that was reached and how to raise it, as text."""
    if resource is None:
        return "this process has none left. Close some."
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


def check_files(what: str, count: int) -> None:
    """Check that this process may open some more files: a server that begins with too few fails later, and in pieces.

    Args:
        what: The server, as the subject of the message.
        count: How many it needs with its first clients.

    Raises:
        LinkError: If it may not.
    """
    try:
        with contextlib.ExitStack() as stack:
            for _ in range(count):
                stack.callback(os.close, os.open(os.devnull, os.O_RDONLY))
    except OSError as error:
        if error.errno not in SHORTAGES:
            raise
        limit = "too few" if resource is None else resource.getrlimit(resource.RLIMIT_NOFILE)[0]
        raise LinkError(
            f"{what} must be able to open {count} more files, but this process may have {limit} in all. Allow more: "
            "ulimit -n 4096."
        ) from None


def accept(listener: socket.socket) -> socket.socket | None:
    """Return the next connection; None if there is none, or no descriptor for it: then it waits in the queue.

    Raises:
        OSError: If the listener is closed.
    """
    try:
        connection, _ = listener.accept()
    except (BlockingIOError, ConnectionAbortedError):
        return None
    except OSError as error:
        if error.errno not in SHORTAGES:
            raise
        _warn_of_shortage()
        # The listener stays readable, so a loop that tries again at once would spin.
        select.select([], [], [], SHORTAGE_PAUSE_S)
        return None
    return connection


@functools.cache
def _warn_of_shortage() -> None:
    """Log the shortage, once in a process."""
    _log.warning("a client needs a file descriptor: %s Clients wait until some are free.", shortage())


def processor_count() -> int:
    """Return how many processors this process may use."""
    # macOS and Windows do not say it of a process.
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
