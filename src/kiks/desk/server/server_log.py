"""What the libraries of the web server log, as lines for a person: no traceback, and none that a client lengthens."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

from kiks.ports.file_descriptors import SHORTAGES, shortage

LIBRARIES = ("uvicorn", "uvicorn.error", "nicegui", "engineio.server", "socketio.server")
"""Their logs."""

WORDS_MAX = 200
"""Longest line [characters]."""

_log = logging.getLogger("kiks.desk")


class Plain(logging.Handler):
    """Says in a line what has failed; what clients get wrong is their own affair, and is not said."""

    def emit(self, record: logging.LogRecord) -> None:
        """Say it."""
        note(record.getMessage(), record.exc_info[1] if record.exc_info else None)


def speak_plainly() -> None:
    """Let them say errors in a line each."""
    for name in LIBRARIES:
        log = logging.getLogger(name)
        log.handlers = [Plain(logging.ERROR)]
        log.setLevel(logging.ERROR)
        log.propagate = False


def note_fault(_loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Say in a line what has failed in a loop, where nothing waits for it."""
    note(str(context.get("message", "")), context.get("exception"))


def note(text: str, fault: BaseException | None) -> None:
    """Say in a line what has failed, and its traceback at the level of debugging.

    Args:
        text: What was to be done.
        fault: Why it was not.
    """
    if isinstance(fault, UnicodeError | ConnectionError):
        return
    why = "" if fault is None else f": {fault!r}"
    if isinstance(fault, OSError) and fault.errno in SHORTAGES:
        if _SHORT.is_said:
            return
        _SHORT.is_said = True
        text, why = "It needs a file descriptor", f": {shortage()}"
    _log.error("The desk: %s", ascii(text.strip().rstrip(".") + why)[1:-1][:WORDS_MAX])
    _log.debug("It failed here.", exc_info=fault)


class _Short:
    """Whether it was said that descriptors are short."""

    is_said = False


_SHORT = _Short()
