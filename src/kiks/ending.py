"""How a process ends when it is told to from outside: at once while it loads, then with all that is due at the end.

Need: Ctrl-C always works. An exception that a signal raises may come up in a callback of a library, which drops it, or
in an import, which makes another one of it.
Method: while a command loads there is nothing to bring to an end, so that the signal's handler ends the process itself.
Later an interruption that was dropped is sent again.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

INTERRUPTED = 130
"""Exit code of what Ctrl-C ended."""

_AGAIN_S = 0.01


def end_at_once() -> None:
    """Let Ctrl-C, SIGTERM and SIGHUP end the process where it stands, with one line."""
    _handle(_leave)


def end_as_with_ctrl_c() -> None:
    """Let Ctrl-C, SIGTERM and SIGHUP raise KeyboardInterrupt; `nohup` keeps a process alive as ever."""
    _handle(signal.default_int_handler)


@contextmanager
def noting_endings(note: Callable[[int], object]) -> Iterator[None]:
    """Call something with the signal at Ctrl-C, SIGTERM and SIGHUP meanwhile, and go on; only in the main thread."""
    before = {name: signal.getsignal(name) for name in _endings()}
    _handle(lambda number, _frame: note(number))
    try:
        yield
    finally:
        with suppress(ValueError):
            for name, handler in before.items():
                signal.signal(name, handler)


@contextmanager
def postponing_endings() -> Iterator[None]:
    """Let Ctrl-C, SIGTERM and SIGHUP act after this instead of in its middle; in other threads they never do."""
    noted: list[int] = []
    try:
        with noting_endings(noted.append):
            yield
    finally:
        for number in noted:
            signal.raise_signal(number)


def send_again_what_is_dropped() -> None:
    """Send an interruption again that a callback has dropped, until it ends what runs."""
    import threading  # here, for the process is to be guarded soon after it starts

    before = sys.unraisablehook

    def send_again() -> None:
        again = threading.Timer(_AGAIN_S, _interrupt)
        again.daemon = True
        again.start()

    def note(dropped: Any) -> None:
        try:
            if issubclass(dropped.exc_type, KeyboardInterrupt):
                send_again()
            else:
                before(dropped)
        except KeyboardInterrupt:
            # Another one has come meanwhile, and would be dropped here.
            send_again()

    sys.unraisablehook = note


def _handle(handler: Callable[[int, FrameType | None], Any]) -> None:
    # Only the main thread may; where a command runs in another one, signals are none of its business.
    with suppress(ValueError):
        for name in _endings():
            signal.signal(name, handler)


def _endings() -> Iterator[signal.Signals]:
    """Yield the signals that end a process, but those that it was started to ignore."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            yield number


def _leave(_number: int, _frame: FrameType | None) -> None:
    with suppress(OSError):
        os.write(2, b"kiks: stopped.\n")
    os._exit(INTERRUPTED)


def _interrupt() -> None:
    """Send the main thread a signal that raises KeyboardInterrupt, if one does."""
    import threading

    for name in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(name) is signal.default_int_handler:
            signal.pthread_kill(threading.main_thread().ident or 0, name)
            return
