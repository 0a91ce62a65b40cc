"""The watchdog: checks from outside whether the thread that runs a program is stuck or waits in real time.

Code in C may wait by itself, and a loop may never call into the simulation. Neither lets other threads go on, and
simulated time stands still meanwhile. The watchdog samples the thread some times per second. It tells of a loop that
asks for nothing, which may well be right, and ends a program that waits by itself with one line that names the place.
It never changes a run that ends normally.
"""

from __future__ import annotations

import dis
import signal
import subprocess
import sys
import threading
import time
from _thread import allocate_lock, start_new_thread
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from kiks.ending import leave, tell
from kiks.script import thread_scheduler
from kiks.script.refusals import OURS, refusal, where
from kiks.script.thread_scheduler import Scheduler

SAMPLE_S = 0.05
"""Period of the samples [s of real time]."""

WAITING_SAMPLES = 5
"""Samples in which the thread may wait by itself."""

LOCKED_S = 10.0
"""Longest wait for a lock of a library [s of real time]; a library that computes on all processors waits, too."""

SPINNING_S = 30.0
"""Longest computation of a thread while others wait for a time or a robot [s of its own processor time]."""

WARNING_SHARE = 0.2
"""Share of that time after which a line tells of the computation, whatever others do."""

GRACE_S = 5.0
"""Time after which the process of a program that stays in code in C is killed [s of real time]."""

_HERE, _KIKS = str(Path(__file__).parent), str(Path(__file__).parent.parent)
_ROOTS = (thread_scheduler.__file__, str(Path(__file__).with_name("main_module.py")))
"""Files of KiKS that call the program: the others work for it."""

_MAY_WAIT = ("<", _KIKS, subprocess.__file__)
"""Code that may wait in real time: imports, KiKS, and waits for other programs."""

_DEBUGGER = "_pydevd_bundle"
"""A module of pydevd, which would stop this thread, too. A person looks then."""

_READS_ONLY = (
    "LOAD_",
    "COMPARE_",
    "CONTAINS_",
    "IS_",
    "UNARY_",
    "TO_BOOL",
    "POP_JUMP_",
    "JUMP_",
    "NOP",
    "EXTENDED_ARG",
)
"""Instructions of Python that change nothing."""

_SIGNAL = signal.SIGRTMAX - 1 if sys.platform == "linux" else 0


@contextmanager
def watched(scheduler: Scheduler) -> Iterator[None]:
    """End the program if it waits by itself or asks for nothing; on Linux, and in the main thread of a process."""
    is_main = threading.current_thread() is threading.main_thread()
    if sys.platform != "linux" or not is_main or _DEBUGGER in sys.modules:
        yield
        return
    watch = _Watch(scheduler)
    before = signal.signal(_SIGNAL, watch.end)
    watch.start()
    try:
        yield
    finally:
        watch.stop()
        signal.signal(_SIGNAL, before)


class _Watch:
    """The watchdog's thread."""

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self._message = ""
        self._watched = threading.get_ident()
        self._folder = Path(f"/proc/self/task/{threading.get_native_id()}")
        self._is_over = False
        self._going_on, self._sampling = allocate_lock(), allocate_lock()

    def start(self) -> None:
        """Start to sample."""
        self._going_on.acquire()
        self._sampling.acquire()
        # Unknown to `threading`: a program may count its threads, and wait until only one is left.
        start_new_thread(self._run, ())

    def stop(self) -> None:
        """Stop sampling."""
        self._is_over = True
        self._going_on.release()
        self._sampling.acquire()

    def end(self, _number: int, _frame: FrameType | None) -> None:
        """End the program, in its own thread."""
        if not self._is_over:
            self._scheduler.end(1, self._message)

    def _run(self) -> None:
        try:
            self._sample()
        finally:
            self._sampling.release()

    def _sample(self) -> None:
        waits, last, has_warned, spun_s = 0, -1, False, 0.0
        # Neither the threads of KiKS nor those of a library count as computations of the program.
        clock = time.pthread_getcpuclockid(self._watched)
        own_cpu_s, locked_cpu_s, locked_s = time.clock_gettime(clock), time.process_time(), time.monotonic()
        while not self._going_on.acquire(timeout=SAMPLE_S):
            if _DEBUGGER in sys.modules:
                return
            count, cpu_s, now_s = self._scheduler.program.act_count, time.process_time(), time.monotonic()
            before_s, own_cpu_s = own_cpu_s, time.clock_gettime(clock)
            # The program has asked for something: it is neither stuck nor spinning.
            if count != last:
                last, spun_s, before_s = count, 0.0, own_cpu_s
            # It lives in real time, such as at the prompt of a debugger.
            if not self._scheduler.os_thread:
                last, waits, locked_cpu_s, locked_s = -1, 0, cpu_s, now_s
                continue
            what = self._waits_for()
            if what == "lock" and cpu_s - locked_cpu_s < LOCKED_S / 10:
                if now_s - locked_s > LOCKED_S:
                    self._end_program(f"it waited by itself{self._where()}")
                    return
            else:
                locked_cpu_s, locked_s = cpu_s, now_s
            waits += what == "time"
            if waits >= WAITING_SAMPLES:
                self._end_program(f"it waited by itself{self._where()}")
                return
            frame = _computing(self._frame())
            if frame is None:
                continue
            spun_s += own_cpu_s - before_s
            has_others = bool(self._scheduler.tasks)
            if spun_s > SPINNING_S and (self._scheduler.has_timed or (has_others and _only_reads(frame))):
                self._end_program(
                    f"it asked for neither time nor bytes for {spun_s:.0f} s while its other threads waited"
                    f"{where(frame)}",
                    "If it waits for a variable there, put time.sleep(0.001) into the loop, or ",
                )
                return
            if spun_s > WARNING_SHARE * SPINNING_S and not has_warned:
                has_warned = True
                tell(
                    f"line {frame.f_lineno} of {Path(frame.f_code.co_filename).name} has computed for {spun_s:.0f} s "
                    f"without waiting for a time or a robot{', while its other threads waited' if has_others else ''}. "
                    "If it computes, that is right; if it waits for something, end it (Ctrl-C, or Stop on the desk) "
                    "and put time.sleep(0.01) into the loop."
                )

    def _waits_for(self) -> str:
        """Return 'time' if the thread waits for a time or file in foreign code, 'lock' for a lock, else ''."""
        try:
            state = (self._folder / "stat").read_text().rpartition(")")[2].split()[0]
            if state != "S":
                return ""
            reason = (self._folder / "wchan").read_text()
        except OSError:
            return ""
        if "futex" in reason or ("pipe" in reason and self._scheduler.tasks):
            # A pipe may be one that another thread of the program writes to.
            kind = "lock"
        elif any(word in reason for word in ("nanosleep", "poll", "select", "sigtimedwait", "inode_wait")):
            kind = "time"
        else:
            return ""
        frame = self._frame()
        name = frame.f_code.co_filename if frame is not None else "<"
        return "" if name.startswith(_MAY_WAIT) else kind

    def _frame(self) -> FrameType | None:
        return sys._current_frames().get(self._watched)

    def _where(self) -> str:
        return where(self._frame())

    def _end_program(self, what: str, way: str = "") -> None:
        self._message = refusal("wait by time.sleep, a lock or a port", what, way)
        with suppress(OSError):
            signal.pthread_kill(self._watched, _SIGNAL)
        if not self._going_on.acquire(timeout=GRACE_S):
            # Code in C does not return to Python.
            sys.stdout.flush()
            leave(1, self._message)


def _computing(frame: FrameType | None) -> FrameType | None:
    """Return where a program computes: its innermost frame, or that of a library; None while KiKS works for it.

    What stands in for functions of Python is as much part of its loop as they are.
    """
    found = None
    while frame is not None:
        name = frame.f_code.co_filename
        if name in _ROOTS:
            return found
        if name.startswith(_KIKS):
            if not name.startswith(_HERE):
                return None
        elif "site-packages" in name:
            found = found or frame
        elif not name.startswith(("<", *OURS)):
            return found or frame
        frame = frame.f_back
    return found


def _only_reads(frame: FrameType) -> bool:
    """Return whether a frame is at the end of a loop that changes nothing, so that only another thread could end it."""
    code = list(dis.get_instructions(frame.f_code))
    jump = next(each for each in code if each.offset == frame.f_lasti)
    if "JUMP" not in jump.opname or not isinstance(jump.argval, int) or jump.argval > jump.offset:
        return False
    loop = [each.opname for each in code if jump.argval <= each.offset <= jump.offset]
    return all(name.startswith(_READS_ONLY) for name in loop)
