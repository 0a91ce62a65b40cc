"""Signals of a program: its main thread handles them, as in Python; alarms ring in simulated time."""

from __future__ import annotations

import contextlib
import errno
import operator
import os
import signal
import threading
import time
from _thread import allocate_lock, start_new_thread
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType
from typing import Any
from weakref import WeakKeyDictionary

import kiks
from kiks.ending import INTERRUPTED, PROGRAM_GRACE_S
from kiks.script.thread_scheduler import SIGNALLED, Scheduler, ThreadTask, timeout_ns
from kiks.sim.read_completion import NEVER_NS
from kiks.units import s_from_ns

EXIT_OF_SIGNAL = 128
"""Offset of the exit code of a program that a signal has ended, as in a shell."""

_HERE = os.path.dirname(kiks.__file__)
_ROOT = Scheduler.start.__code__.co_filename

_OF_FAULTS = frozenset({signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGSEGV})
"""Signals that a fault in C raises: they cannot wait."""

_HARMLESS = frozenset({signal.SIGCHLD, signal.SIGCONT, signal.SIGURG, signal.SIGWINCH})
"""Signals that do nothing where the program has no handler."""


class Signals:
    """The signal handlers and the alarm of a program.

    Attributes:
        were_ended: Whether the program was told from outside to end, such as by Ctrl-C.
    """

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self._handlers: dict[int, Any] = {}
        # The handlers from before the program.
        self._before: dict[int, Any] = {}
        # The signals that end a program, and those of them that it has sent to itself and not yet handled.
        self._endings: set[int] = set()
        self._own: list[int] = []
        self.were_ended = False
        self._is_over, self._insisting = False, allocate_lock()
        self._wakeup = -1
        # What each thread has blocked; the main thread's counts. The operating system blocks nothing: it would give the
        # signal to a thread of KiKS, or of a library, and end the process.
        self._masks: WeakKeyDictionary[ThreadTask, set[int]] = WeakKeyDictionary()
        # Signals that the program has blocked, and not yet waited for.
        self._pending: set[int] = set()
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
            if (handler := signal.getsignal(number)) is signal.default_int_handler
        }
        self._endings.update(before)
        for name, handler in before.items():
            self._set(name, handler)
        try:
            yield
        finally:
            with self._insisting:
                self._is_over = True
            for changed, handler in self._before.items():
                signal.signal(changed, handler)

    def replacements(self) -> dict[str, dict[str, Any]]:
        """Return the replacements for names of `signal`."""
        return {
            "_signal": {
                "signal": self._set,
                "getsignal": self._get,
                "set_wakeup_fd": self._set_wakeup,
                "alarm": lambda seconds, /: -int(-self._set_alarm(max(operator.index(seconds), 0), 0)[0] // 1),
                "setitimer": self._set_timer,
                "getitimer": self._get_timer,
                "pause": self._pause,
                "pthread_sigmask": self._set_mask,
                "sigpending": lambda: set(self._pending),
                "sigwait": lambda signals, /: self._wait_for(signals, NEVER_NS),
                "sigwaitinfo": lambda signals, /: _signal_info(self._wait_for(signals, NEVER_NS)),
                "sigtimedwait": self._wait_until,
                "pthread_kill": self._kill_thread,
                "raise_signal": lambda number, /: self._kill(os.getpid(), number),
            },
            "_thread": {"interrupt_main": lambda number=signal.SIGINT, /: self._kill(os.getpid(), number)},
            "posix": {"kill": self._kill},
        }

    # ---- calls of the program ----

    def _set(self, number: int, handler: Any, /) -> Any:
        self._check_main_thread("signal")
        before = self._get(number)
        is_heard = (
            callable(handler)
            or number in self._endings
            or (handler == signal.SIG_DFL and number in self._blocked - _OF_FAULTS)
        )
        before_here = signal.signal(number, self._come if is_heard else handler)
        self._before.setdefault(number, before_here)
        self._handlers[number] = handler
        return before

    def _get(self, number: int, /) -> Any:
        return self._handlers[number] if number in self._handlers else signal.getsignal(number)

    def _set_wakeup(self, descriptor: int, /, **options: Any) -> int:
        self._check_main_thread("set_wakeup_fd")
        # The real one is KiKS's; this checks what the program gives.
        signal.set_wakeup_fd(signal.set_wakeup_fd(descriptor, **options), warn_on_full_buffer=False)
        before, self._wakeup = self._wakeup, descriptor
        return before

    def _check_main_thread(self, name: str) -> None:
        if self._scheduler.current is not self._scheduler.main:
            raise ValueError(f"{name} only works in main thread of the main interpreter")

    def _set_timer(self, which: int, seconds: float, interval: float = 0.0, /) -> tuple[float, float]:
        self._check_timer(which)
        if min(seconds, interval) < 0:
            raise signal.ItimerError(errno.EINVAL, os.strerror(errno.EINVAL))
        return self._set_alarm(seconds, interval)

    def _get_timer(self, which: int, /) -> tuple[float, float]:
        self._check_timer(which)
        _, at_ns, interval_ns = self._alarm
        left_ns = 0 if at_ns == NEVER_NS else max(at_ns - self._scheduler.world.now_ns, 1)
        return s_from_ns(left_ns), s_from_ns(interval_ns)

    def _check_timer(self, which: int) -> None:
        signal.getitimer(which)  # says whether there is such a timer
        if which != signal.ITIMER_REAL:
            self._scheduler.end(
                1,
                "a timer of signals must be ITIMER_REAL, but the program has set one that counts the processor's time. "
                "Use ITIMER_REAL, or run the program on kiks serve.",
            )

    @property
    def _blocked(self) -> set[int]:
        """What the main thread has blocked."""
        return self._masks.get(self._scheduler.main, set())

    def _set_mask(self, how: int, mask: Iterable[int], /) -> set[int]:
        task, given = self._scheduler.current, _checked(mask)
        before = self._masks.get(task, self._blocked)
        masks: dict[int, set[int]] = {
            signal.SIG_BLOCK: before | given,
            signal.SIG_UNBLOCK: before - given,
            signal.SIG_SETMASK: given,
        }
        if how not in masks:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        self._masks[task] = masks[how]
        if task is self._scheduler.main:
            for number in sorted(before ^ masks[how]):
                if self._get(number) == signal.SIG_DFL:
                    with contextlib.suppress(OSError):  # two can have no handler
                        self._set(number, signal.SIG_DFL)
            for number in sorted(self._pending - masks[how]):
                self._pending.remove(number)
                self._raise(number)
        return before

    def _wait_for(self, signals: Iterable[int], until_ns: int) -> int:
        """Wait for one of several signals until a time [ns]; return its number, or 0."""
        wanted = _checked(signals)
        while not (found := wanted & self._pending):
            if self._scheduler.world.now_ns >= until_ns:
                return 0
            self._scheduler.wait("a signal", until_ns=until_ns, files=_FromOutside())
        number = min(found)
        self._pending.remove(number)
        return number

    def _wait_until(self, signals: Iterable[int], timeout: float, /) -> Any:
        if timeout < 0:
            raise ValueError("timeout must be non-negative")
        number = self._wait_for(signals, self._scheduler.world.now_ns + timeout_ns(timeout))
        return _signal_info(number) if number else None

    def _pause(self) -> None:
        while self._scheduler.wait("a signal") is not SIGNALLED:
            pass

    def _kill(self, process: int, number: int, /) -> None:
        # Other threads of this process, such as the watchdog, must not take what this one blocks.
        if process == os.getpid() and number:
            if number in self._endings:
                self._own.append(number)
            signal.raise_signal(number)
        else:
            os.kill(process, number)

    def _kill_thread(self, ident: int, number: int, /) -> None:
        if self._scheduler.own_thread == ident or ident in self._scheduler.tasks:
            self._kill(os.getpid(), number)
        else:
            signal.pthread_kill(ident, number)

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
        if self._hold(number):
            return
        if handler == signal.SIG_DFL and number not in _HARMLESS:
            self._scheduler.end(EXIT_OF_SIGNAL + number, f"the program was ended by signal {number}.")
        elif callable(handler):
            self._scheduler.interrupt(partial(handler, number, None), at_once=False)

    def _hold(self, number: int) -> bool:
        """Keep a signal that the program has blocked for those who wait for it, or announce it; return which."""
        if number in self._blocked:
            self._pending.add(number)
            for task in self._scheduler.waiting_for("a signal"):
                self._scheduler.wake(task, None)
            return True
        if self._wakeup >= 0:
            with contextlib.suppress(OSError):
                os.write(self._wakeup, bytes([number]))
        return False

    def _come(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal of the operating system, in the running thread."""
        if number in self._own:
            self._own.remove(number)
        elif number in self._endings:
            self._note_ending(number)
        if self._hold(number):
            return
        handler = self._handlers.get(number, signal.default_int_handler)
        if handler == signal.SIG_DFL and number in self._endings:
            self._raise(number)
        if not callable(handler):
            return  # it has come while the program changed its mask
        self._scheduler.interrupt(partial(handler, number, frame), at_once=_is_in_program(frame))

    def _note_ending(self, number: int) -> None:
        """Let the program end by itself, after what it does at its end; end it at the second signal, or later.

        It may ignore the signal, or be in code in C that goes on after one.
        """
        if self.were_ended:
            name = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
            self._scheduler.end(INTERRUPTED, f"the program had not ended after {name}, and was stopped where it was.")
        self.were_ended, self._scheduler.program.doubt = True, "it was interrupted"
        main, begun = self._scheduler.own_thread, list[bool]()

        def insist() -> None:
            begun.append(True)
            time.sleep(PROGRAM_GRACE_S)
            with self._insisting:
                if not self._is_over:
                    signal.pthread_kill(main, number)

        start_new_thread(insist, ())
        # Before it begins, Python takes it for this thread, and an exception for this one would come up there.
        while not begun:
            time.sleep(0.001)


class _FromOutside:
    """Signals that may come from other processes; see `thread_scheduler.FileWait`."""

    is_inside = is_for_person = False

    def is_over(self, block_ms: int) -> bool:
        """Give signals some real time; their handler ends the wait."""
        if block_ms:
            time.sleep(block_ms / 1000)
        return False


def _checked(signals: Iterable[int]) -> set[int]:
    given = {int(each) for each in signals}
    signal.pthread_sigmask(signal.SIG_UNBLOCK, given)  # says what is wrong; the operating system has blocked none
    return given


def _signal_info(number: int) -> signal.struct_siginfo:
    """Return what `sigwaitinfo` returns for a signal."""
    return signal.struct_siginfo((number, 0, 0, os.getpid(), os.getuid(), 0, 0))


def _is_in_program(frame: FrameType | None) -> bool:
    """Return whether a thread runs the program's own code: a signal may preempt it there, but not in KiKS."""
    while frame is not None:
        name = frame.f_code.co_filename
        if name.startswith(_HERE):
            return name == _ROOT
        frame = frame.f_back
    return True
