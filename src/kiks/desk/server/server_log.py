"""The log of the web server's libraries: one line of limited length for each error, without a traceback."""

from __future__ import annotations

import logging

from kiks.errors import KiksError
from kiks.ports.resources import SHORTAGES, shortage

PAGES = "nicegui"
"""Logger of errors that pages get, too (`show_error`)."""

LIBRARIES = ("uvicorn", "uvicorn.error", PAGES, "engineio.server", "socketio.server")
"""Loggers of the libraries."""

LINE_MAX = 200
"""Maximum length of a line [characters]."""

_log = logging.getLogger("kiks.desk")


class Plain(logging.Handler):
    """Log handler that reports an error in one line, unless a client has caused it."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self._has_shortage = False

    def emit(self, record: logging.LogRecord) -> None:
        """Report an error, unless NiceGUI has given it to a page, which shows it to the person who has caused it."""
        fault = record.exc_info[1] if record.exc_info else None
        if record.name != PAGES or not isinstance(fault, KiksError):
            self.note(record.getMessage(), fault)

    def note(self, text: str, fault: BaseException | None) -> None:
        """Log a failure in one line, and its traceback at debug level; a shortage of file descriptors once."""
        if isinstance(fault, UnicodeError | ConnectionError):
            return
        why = "" if fault is None else f": {fault!r}"
        if isinstance(fault, OSError) and fault.errno in SHORTAGES:
            if self._has_shortage:
                return
            self._has_shortage = True
            text, why = "It needs a file descriptor", f": {shortage()}"
        _log.error("The desk: %s", ascii(text.strip().rstrip(".") + why)[1:-1][:LINE_MAX])
        _log.debug("It failed here.", exc_info=fault)


def log_plainly() -> Plain:
    """Make the libraries report each error in one line; return the handler, which also notes what no task waits for."""
    plain = Plain()
    for name in LIBRARIES:
        log = logging.getLogger(name)
        log.handlers = [plain]
        log.setLevel(logging.ERROR)
        log.propagate = False
    return plain
