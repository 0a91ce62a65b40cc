"""How a process ends when it is told to from outside: at once while it loads, then with all that is due at the end.

Need: Ctrl-C always works. An exception that a signal raises may come up in a callback of a library, which drops it, or
in an import, which makes another one of it.
Method: while a command loads there is nothing to bring to an end, so that the signal's handler ends the process itself.
Later an interruption that was dropped is sent again. Code in C that does not return hears no signal, and may let no
other thread run: a process of its own, which hears them as they come (`signal.set_wakeup_fd`), then kills this one.
"""

from __future__ import annotations

import os
import signal
import sys
from _thread import allocate_lock, get_ident, interrupt_main, start_new_thread
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

INTERRUPTED = 130
"""Exit code of what Ctrl-C ended."""

OUT_OF_TIME = 124
"""Exit code of what ran for too long, as that of timeout(1)."""

UNHEARD_S = 1.2
"""Time that the main thread has to hear a signal that ends the process [s]; waits for a processor do not count."""

PROGRAM_GRACE_S = 0.6
"""Time that a program has to end after such a signal [s]; with the time above it is less than two seconds."""

LIMIT_GRACE_S = 2.0
"""Time that what runs has to end after its time is over [s]."""

_BUSY_S = 10.0
"""Most that such waits put the end off [s]."""

_AGAIN_S = 0.01
_HAS_OWN_SIGNALS = hasattr(signal, "SIGRTMAX")
"""Whether there are signals for what one thread tells another: not on macOS and Windows, where compiled code that does
not return hears no Ctrl-C."""

_LIMIT = signal.SIGRTMAX - 2 if _HAS_OWN_SIGNALS else signal.SIGTERM
_HEARD = signal.SIGRTMAX - 3 if _HAS_OWN_SIGNALS else signal.SIGTERM
_ENDINGS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
_DIE_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux (linux/prctl.h)."""

_CODE = "code that did not return, such as a controller without an end: there is no summary"


def end_at_once() -> None:
    """Let Ctrl-C, SIGTERM and SIGHUP end the process where it stands, with one line; for the start of a process."""
    _handle(lambda _number, _frame: leave(INTERRUPTED, "stopped."))
    if _HAS_OWN_SIGNALS:
        _start_guard()


def end_with_parent() -> None:
    """Let Linux kill this process when the thread that has started it ends, such as when its process is killed."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)


def leave_threads() -> None:
    """End an interrupted process without a wait for threads of it that are in code that does not return."""
    import threading

    if any(not thread.daemon and thread is not threading.current_thread() for thread in threading.enumerate()):
        leave_interrupted()


def leave_interrupted() -> NoReturn:
    """End an interrupted process after what is due at its end, and take no memory apart: that may be long."""
    import atexit

    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(INTERRUPTED)


def leave(code: int, line: str) -> NoReturn:
    """End the process at once, from any thread, with a line that says why."""
    tell(line)
    os._exit(code)


def tell(line: str) -> None:
    """Print a line of KiKS on the error output, from any thread, whatever the program has made of `sys.stderr`."""
    with suppress(OSError):
        os.write(2, f"kiks: {line}\n".encode(errors="replace"))


def end_as_with_ctrl_c() -> None:
    """Let Ctrl-C, SIGTERM and SIGHUP raise KeyboardInterrupt; `nohup` keeps a process alive as ever."""
    _handle(signal.default_int_handler)


@contextmanager
def noting_endings(note: Callable[[int], object], *others: int) -> Iterator[None]:
    """Call something with the signal at Ctrl-C, SIGTERM, SIGHUP and others meanwhile, and go on; in the main thread."""
    before = {name: signal.getsignal(name) for name in (*_endings(), *others)}
    _handle(lambda number, _frame: note(number), *others)
    try:
        yield
    finally:
        with suppress(ValueError):
            for name, handler in before.items():
                signal.signal(name, handler)


@contextmanager
def postponing_endings() -> Iterator[None]:
    """Let what ends the process act after this instead of in its middle; in other threads it never does."""
    noted: list[int] = []
    try:
        with noting_endings(noted.append, *[_LIMIT] * _HAS_OWN_SIGNALS):
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


def _handle(handler: Callable[[int, FrameType | None], Any], *others: int) -> None:
    # Only the main thread may; where a command runs in another one, signals are none of its business.
    with suppress(ValueError):
        for name in (*_endings(), *others):
            signal.signal(name, handler)


def _endings() -> Iterator[signal.Signals]:
    """Yield the signals that end a process, but those that it was started to ignore."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            yield number


def _start_guard() -> None:
    """Start the process that kills this one if its main thread is in code that does not return, and so hears no signal.

    The interpreter's own handler, in C, passes each signal on through a pipe, whatever holds the interpreter's lock.
    """
    import atexit
    import posix  # of os, debuggers follow a fork

    numbers, sender = os.pipe()
    answers, answerer = os.pipe()
    guarded = os.getpid()
    if helper := posix.fork():
        os.waitpid(helper, 0)
        for each in (numbers, answers):
            os.close(each)
        os.set_blocking(sender, False)
        signal.signal(_HEARD, lambda _number, _frame: os.write(answerer, b"!"))
        signal.set_wakeup_fd(sender, warn_on_full_buffer=False)

        def answer_at_the_end() -> None:
            # Python takes its handlers away before its process ends; a busy guard may ask only then.
            signal.signal(_HEARD, signal.SIG_IGN)
            os.write(answerer, b"!")

        atexit.register(answer_at_the_end)
        return
    # No child of the guarded process: a program may wait for all of those.
    if posix.fork():
        os._exit(0)
    os.setsid()
    for number in _ENDINGS:
        signal.signal(number, signal.SIG_IGN)
    for each in (0, 1, sender, answerer):
        with suppress(OSError):
            os.close(each)
    with suppress(OSError):
        _guard(guarded, numbers, answers)
    os._exit(0)


def _guard(process: int, numbers: int, answers: int) -> None:
    """Kill a process that does not answer soon after a signal that ends it; return when it has ended.

    Args:
        process: Its number.
        numbers: Where the numbers of its signals come.
        answers: Where its main thread answers.
    """
    while number := os.read(numbers, 1):
        if number[0] not in _ENDINGS:
            continue
        # A true signal: it also wakes a wait that has gone on after the first one was handled.
        os.kill(process, _HEARD)
        if not _is_heard(process, answers):
            tell(f"stopped in the middle of {_CODE}.")
            os.kill(process, signal.SIGKILL)
        os.read(answers, 1)


def _is_heard(process: int, answers: int) -> bool:
    """Tell whether a process answers in time, in which its waits for a processor do not count."""
    import select
    import time

    began_s, waited_s = time.monotonic(), _waited_s(process)
    while True:
        busy_s = min(_BUSY_S, _waited_s(process) - waited_s)
        left_s = began_s + UNHEARD_S + busy_s - time.monotonic()
        if left_s <= 0 or select.select([answers], [], [], left_s)[0]:
            return left_s > 0


def _waited_s(process: int) -> float:
    """Return how long the threads of a process have waited for a processor [s] (Linux, sched-stats.rst), or 0.

    All threads: the main one may wait for the interpreter's lock, which one that waits for a processor holds.
    """
    waited_ns = 0
    with suppress(OSError, ValueError, IndexError):
        for thread in os.listdir(f"/proc/{process}/task"):
            with open(f"/proc/{process}/task/{thread}/schedstat") as file:
                waited_ns += int(file.read().split()[1])
    return waited_ns / 1e9


@contextmanager
def ended_after(seconds: float | None, end: Callable[[], object]) -> Iterator[None]:
    """Call something in the main thread when this takes longer than some real time [s]; None for no limit.

    Where it does not bring this to an end, the process ends.
    """
    if seconds is None:
        yield
        return
    is_over = allocate_lock()
    is_over.acquire()
    main = get_ident()

    def watch() -> None:
        if is_over.acquire(timeout=seconds):
            return
        if _HAS_OWN_SIGNALS:
            signal.pthread_kill(main, _LIMIT)
        if not is_over.acquire(timeout=LIMIT_GRACE_S):
            leave(OUT_OF_TIME, f"stopped after {seconds:g} s of real time, in the middle of {_CODE}.")

    if _HAS_OWN_SIGNALS:
        signal.signal(_LIMIT, lambda _number, _frame: end())
    start_new_thread(watch, ())
    try:
        yield
    finally:
        is_over.release()
        # It may be on its way.
        if _HAS_OWN_SIGNALS:
            signal.signal(_LIMIT, lambda _number, _frame: None)


def _interrupt() -> None:
    """Send the main thread a signal that raises KeyboardInterrupt, if one does."""
    import threading

    for name in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(name) is signal.default_int_handler:
            if hasattr(signal, "pthread_kill"):
                signal.pthread_kill(threading.main_thread().ident or 0, name)
            else:
                interrupt_main(name)
            return
