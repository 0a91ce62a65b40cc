"""Locks and threads like those of `_thread`, for the threads of one program; `threading` builds on them."""

from __future__ import annotations

import _thread
import concurrent.futures.thread
import itertools
import queue
import threading
import time
import weakref
from _threading_local import local
from collections import deque
from collections.abc import Callable
from typing import Any

from kiks.script.thread_scheduler import SIGNALLED, Scheduler, Task, timeout_ns
from kiks.sim.read_completion import NEVER_NS

REAL_LOCK = _thread.allocate_lock
REAL_SLEEP = time.sleep


ELSEWHERE_S = 0.001
"""Period with which a thread that is not the program's polls a lock [s]."""


LOCKS_IN_A_ROW = 1000
"""Free locks that a thread may take before each costs as much as a poll."""


class Lock:
    """A lock; see `_thread.lock`. Threads get it in the order in which they began to wait: `release` hands it over."""

    scheduler: Scheduler
    """The scheduler; each program has a subclass with its own."""

    __slots__ = ("__weakref__", "_is_locked", "_waiters")

    def __init__(self) -> None:
        self._is_locked = False
        self._waiters: deque[Task] | None = None

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """Acquire the lock; return whether it was acquired."""
        if not self._is_locked:
            if blocking and timeout != -1:
                _check_timeout(timeout)
            self._is_locked = True
            self.scheduler.lock_count += 1
            if self.scheduler.lock_count > LOCKS_IN_A_ROW:
                self._spin()
            return True
        if not blocking:
            if timeout != -1:
                raise ValueError("can't specify a timeout for a non-blocking call")
            if self.scheduler.is_here:
                self.scheduler.poll()
            return False
        until_ns = NEVER_NS
        if timeout != -1:
            _check_timeout(timeout)
            until_ns = self.scheduler.world.now_ns + timeout_ns(timeout)
        return self._wait(until_ns)

    def release(self) -> None:
        """Release the lock, or hand it to the thread that has waited longest."""
        if not self._is_locked:
            raise RuntimeError("release unlocked lock")
        waiters = self._waiters
        while waiters:
            if self.scheduler.wake(waiters.popleft(), self):
                return
        self._is_locked = False

    def locked(self) -> bool:
        """Return whether a thread holds it."""
        if self.scheduler.is_here:
            self.scheduler.poll()
        return self._is_locked

    acquire_lock = acquire
    release_lock = release
    locked_lock = locked

    def __enter__(self) -> bool:
        return self.acquire()

    def __exit__(self, *_: object) -> None:
        if self._waiters or not self._is_locked:
            self.release()
        else:
            self._is_locked = False

    def _is_owned(self) -> bool:
        """Return whether a thread holds it; without this method `threading.Condition` would try to acquire it."""
        return self._is_locked

    def _at_fork_reinit(self) -> None:
        self.__init__()  # type: ignore[misc]

    def __repr__(self) -> str:
        return f"<{'locked' if self._is_locked else 'unlocked'} lock object at {id(self):#x}>"

    def _spin(self) -> None:
        """Let other threads go on: a thread that checks a value behind a lock in a loop waits for them."""
        if self.scheduler.is_here:
            self.scheduler.lock_count = 0
            self.scheduler.ask()

    def _wait(self, until_ns: int) -> bool:
        scheduler = self.scheduler
        if not scheduler.is_here:
            return self._wait_elsewhere(until_ns)
        if self._waiters is None:
            self._waiters = deque()
        task, cause = scheduler.current, SIGNALLED
        while cause is SIGNALLED:
            if not self._is_locked:
                self._is_locked = True
                return True
            self._waiters.append(task)
            try:
                cause = scheduler.wait("a lock", until_ns=until_ns)
            except BaseException:
                if task.cause is self:
                    self.release()
                raise
            finally:
                if task in self._waiters:
                    self._waiters.remove(task)
        scheduler.program.waiting.act()
        return cause is self

    def _wait_elsewhere(self, until_ns: int) -> bool:
        """Wait in a thread of this process that is not the program's, such as one of a library in C."""
        while self.scheduler.world.now_ns < until_ns:
            if not self._is_locked:
                self._is_locked = True
                return True
            REAL_SLEEP(ELSEWHERE_S)
        return False


def _check_timeout(timeout: float) -> None:
    if timeout < 0:
        raise ValueError("timeout value must be a non-negative number")
    if timeout > threading.TIMEOUT_MAX:
        raise OverflowError("timeout value is too large")


def replacements(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of `_thread`, `threading` and `queue`, by module."""
    own_lock = type("lock", (Lock,), {"scheduler": scheduler, "__slots__": (), "__module__": "_thread"})
    real_ident = _thread.get_ident

    def allocate_lock() -> Any:
        return own_lock() if scheduler.is_here else REAL_LOCK()

    def get_ident() -> int:
        return scheduler.current.ident if scheduler.is_here else real_ident()

    def start_new_thread(
        function: Callable[..., object], args: tuple[Any, ...], kwargs: dict[str, Any] | None = None, /
    ) -> int:
        if not scheduler.is_here:
            return real_start(function, args, kwargs or {})
        if not callable(function):
            raise TypeError("first arg must be callable")
        return scheduler.start(function, tuple(args), kwargs or {})

    def set_sentinel() -> Any:
        if not scheduler.is_here:
            return real_sentinel()
        scheduler.current.sentinel = allocate_lock()
        return scheduler.current.sentinel

    def rlock(*args: Any, **kwargs: Any) -> Any:
        return python_rlock(*args, **kwargs) if scheduler.is_here else real_rlock(*args, **kwargs)

    def is_set(event: threading.Event) -> bool:
        if not event._flag and scheduler.is_here:  # type: ignore[attr-defined]
            scheduler.poll()
        return real_is_set(event)

    real_start, real_sentinel = _thread.start_new_thread, _thread._set_sentinel  # type: ignore[attr-defined]
    real_rlock, python_rlock = threading.RLock, threading._PyRLock  # type: ignore[attr-defined]
    real_is_set = threading.Event.is_set
    return {
        "_thread": {
            "allocate_lock": allocate_lock,
            "allocate": allocate_lock,
            "get_ident": get_ident,
            "start_new_thread": start_new_thread,
            "start_new": start_new_thread,
            "_set_sentinel": set_sentinel,
            "RLock": rlock,
            "_local": local,
        },
        "threading": {
            "Lock": allocate_lock,
            "RLock": rlock,
            "_CRLock": None,
            "_allocate_lock": allocate_lock,
            "_start_new_thread": start_new_thread,
            "_set_sentinel": set_sentinel,
            "get_ident": get_ident,
            "local": local,
            # The first thread of a program is Thread-1, even if other threads ran in this process before.
            "_counter": itertools.count(1).__next__,
        },
        "threading.Event": {"is_set": is_set},
        # Running executors: those of this process are not the program's.
        concurrent.futures.thread.__name__: {"_shutdown": False, "_threads_queues": weakref.WeakKeyDictionary()},
        "queue": {"SimpleQueue": queue._PySimpleQueue},  # type: ignore[attr-defined]
        "_queue": {"SimpleQueue": queue._PySimpleQueue},  # type: ignore[attr-defined]
    }
