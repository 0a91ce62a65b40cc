"""The log of the web server's libraries: one line of limited length for each error, without a traceback."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

from kiks.ports.file_descriptors import SHORTAGES, shortage

LIBRARIES = ("uvicorn", "uvicorn.error", "nicegui", "engineio.server", "socketio.server")
"""Loggers of the libraries."""

LINE_MAX = 200
"""Maximum length of a line [characters]."""

_log = logging.getLogger("kiks.desk")


class Plain(logging.Handler):
    """Log handler that reports an error in one line, unless a client has caused it."""

    def emit(self, record: logging.LogRecord) -> None:
        """Report an error."""
        note(record.getMessage(), record.exc_info[1] if record.exc_info else None)


def log_plainly() -> None:
    """Make the libraries report each error in one line."""
    for name in LIBRARIES:
        log = logging.getLogger(name)
        log.handlers = [Plain(logging.ERROR)]
        log.setLevel(logging.ERROR)
        log.propagate = False


def note_fault(_loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Report an exception in an event loop that no task waits for."""
    note(str(context.get("message", "")), context.get("exception"))


def note(text: str, fault: BaseException | None) -> None:
    """Log a failure in one line, and its traceback at debug level.

    Args:
        text: What has failed.
        fault: The exception.
    """
    if isinstance(fault, UnicodeError | ConnectionError):
        return
    why = "" if fault is None else f": {fault!r}"
    if isinstance(fault, OSError) and fault.errno in SHORTAGES:
        if _reported_shortage:
            return
        _reported_shortage.append(fault.errno)
        text, why = "It needs a file descriptor", f": {shortage()}"
    _log.error("The desk: %s", ascii(text.strip().rstrip(".") + why)[1:-1][:LINE_MAX])
    _log.debug("It failed here.", exc_info=fault)


_reported_shortage: list[int] = []
"""Error number of the reported shortage of file descriptors, which is reported once."""
