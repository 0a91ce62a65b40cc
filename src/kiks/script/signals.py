"""Signals of a program: its main thread handles them, as in Python; alarms ring in simulated time."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Any

import kiks
from kiks.script.thread_scheduler import SIGNALLED, Scheduler, timeout_ns
from kiks.sim.read_completion import NEVER_NS
from kiks.units import s_from_ns

EXIT_OF_SIGNAL = 128
"""Offset of the exit code of a program that a signal has ended, as in a shell."""

_HERE = os.path.dirname(kiks.__file__)
_ROOT = Scheduler.start.__code__.co_filename

_real_signal, _real_getsignal, _real_wakeup = signal.signal, signal.getsignal, signal.set_wakeup_fd


class Signals:
    """The signal handlers and the alarm of a program.

    Args:
        scheduler: The program's threads.
    """

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self._handlers: dict[int, Any] = {}
        # The handlers from before the program.
        self._before: dict[int, Any] = {}
        self._wakeup = -1
        # Number of the present alarm, its time [ns], and its interval [ns].
        self._alarm = (0, NEVER_NS, 0)

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Let KeyboardInterrupt be raised in the program's main thread, not in the running thread."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {
            number: handler
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
            if (handler := _real_getsignal(number)) is signal.default_int_handler
        }
        for name, handler in before.items():
            self._set(name, handler)
        try:
            yield
        finally:
            for changed, handler in self._before.items():
                _real_signal(changed, handler)

    def replacements(self) -> dict[str, dict[str, Any]]:
        """Return the replacements for names of `signal`."""
        return {
            "signal": {
                "signal": self._set,
                "getsignal": self._get,
                "set_wakeup_fd": self._set_wakeup,
                "alarm": lambda seconds, /: -int(-self._set_alarm(seconds, 0)[0] // 1),
                "setitimer": self._set_timer,
                "getitimer": self._get_timer,
                "pause": self._pause,
            }
        }

    # ---- calls of the program ----

    def _set(self, number: int, handler: Any, /) -> Any:
        before = self._get(number)
        self._before.setdefault(number, _real_getsignal(number))
        is_called = callable(handler) and not isinstance(handler, signal.Handlers)
        _real_signal(number, self._come if is_called else handler)
        self._handlers[number] = handler
        return before

    def _get(self, number: int, /) -> Any:
        return self._handlers[number] if number in self._handlers else _real_getsignal(number)

    def _set_wakeup(self, descriptor: int, /, **options: Any) -> int:
        self._wakeup = descriptor
        return _real_wakeup(descriptor, **options)

    def _set_timer(self, which: int, seconds: float, interval: float = 0.0, /) -> tuple[float, float]:
        self._check_timer(which)
        return self._set_alarm(seconds, interval)

    def _get_timer(self, which: int, /) -> tuple[float, float]:
        self._check_timer(which)
        _, at_ns, interval_ns = self._alarm
        left_ns = 0 if at_ns == NEVER_NS else max(at_ns - self._scheduler.world.now_ns, 1)
        return s_from_ns(left_ns), s_from_ns(interval_ns)

    def _check_timer(self, which: int) -> None:
        if which != signal.ITIMER_REAL:
            self._scheduler.end(
                1,
                "a timer of signals must be ITIMER_REAL, but the program has set one that counts the processor's time. "
                "Use ITIMER_REAL, or run the program on kiks serve.",
            )

    def _pause(self) -> None:
        while self._scheduler.wait("a signal") is not SIGNALLED:
            pass

    # ---- delivery ----

    def _set_alarm(self, seconds: float, interval_s: float) -> tuple[float, float]:
        """Set the alarm [s], 0: never; return the remaining time of the previous alarm [s], and its interval [s]."""
        before = self._get_timer(signal.ITIMER_REAL)
        number, world = self._alarm[0] + 1, self._scheduler.world
        self._alarm = number, NEVER_NS, 0
        if seconds:
            self._alarm = number, world.now_ns + timeout_ns(seconds), timeout_ns(interval_s)
            self._scheduler.start(self._ring, (number,), {})
        return before

    def _ring(self, number: int) -> None:
        """Wait for the alarm, in a thread of its own, and raise its signal."""
        while True:
            self._scheduler.sleep_until(self._alarm[1])
            if self._alarm[0] != number:
                return
            _, at_ns, interval_ns = self._alarm
            self._alarm = number, at_ns + interval_ns if interval_ns else NEVER_NS, interval_ns
            self._raise(signal.SIGALRM)
            if not interval_ns or self._alarm[0] != number:
                return

    def _raise(self, number: int) -> None:
        """Deliver a simulated signal."""
        handler = self._get(number)
        if self._wakeup >= 0:
            with contextlib.suppress(OSError):
                os.write(self._wakeup, bytes([number]))
        if handler is signal.SIG_DFL:
            self._scheduler.end(EXIT_OF_SIGNAL + number, f"the program was ended by signal {number}.")
        elif callable(handler) and not isinstance(handler, signal.Handlers):
            self._scheduler.interrupt(partial(handler, number, None), at_once=False)

    def _come(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal of the operating system, in the running thread."""
        handler = self._handlers.get(number, signal.default_int_handler)
        self._scheduler.interrupt(partial(handler, number, frame), at_once=_is_in_program(frame))


def _is_in_program(frame: FrameType | None) -> bool:
    """Return whether a thread runs the program's own code: a signal may preempt it there, but not in KiKS."""
    while frame is not None:
        name = frame.f_code.co_filename
        if name.startswith(_HERE):
            return name == _ROOT
        frame = frame.f_back
    return True
