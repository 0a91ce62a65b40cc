"""Locks, queues and threads of `_thread` and `_queue` for the threads of one program; `threading` builds on them.

The objects are Python's own, and code in C may use them. Where a thread of the program would wait in C, it waits in the
scheduler instead. Threads get what they wait for in the order in which they began to wait: `release` hands it over.
"""

from __future__ import annotations

import _queue
import _thread
import concurrent.futures.thread
import itertools
import os
import queue
import sys
import threading
import weakref
from collections import deque
from collections.abc import Callable
from typing import Any

from kiks.script.callers import is_for_program
from kiks.script.cpython import FIRST_IDENT, IDENT_STEP
from kiks.script.patching import ForAll, Query, for_program
from kiks.script.thread_scheduler import SIGNALLED, Scheduler, ThreadTask, get_ident, timeout_ns
from kiks.sim.read_completion import NEVER_NS

LOCKS_IN_A_ROW = 1000
"""Free locks that a thread may take before each costs as much as a poll."""

_lock, _rlock = _thread.LockType, _thread.RLock
_real_acquire, _real_release, _real_locked = _lock.acquire, _lock.release, _lock.locked
_real_enter = _lock.__enter__
_real_get, _real_put = _queue.SimpleQueue.get, _queue.SimpleQueue.put


class WaitingRoom:
    """The threads that wait for objects.

    Attributes:
        waiters: The threads, by the identity of an object, which they keep alive.
    """

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self.waiters: dict[int, deque[ThreadTask]] = {}

    def wait(
        self, key: object, what: str, until_ns: int, take: Callable[[], bool], give_back: Callable[[], object]
    ) -> bool:
        """Wait for an object until a time [ns]; return whether this thread has got it.

        Args:
            key: The object.
            what: Its name in messages.
            until_ns: When the wait ends at the latest [ns].
            take: Takes the object if it is free; called after a signal, whose handler may have freed it.
            give_back: Called if this thread has got it, but an exception comes up in its wait.
        """
        scheduler, task = self._scheduler, self._scheduler.current
        while True:
            waiters = self.waiters.setdefault(id(key), deque())
            waiters.append(task)
            try:
                cause = scheduler.wait(what, until_ns=until_ns)
            except BaseException:
                if task.cause is key:
                    give_back()
                raise
            finally:
                if task in waiters:
                    waiters.remove(task)
                if not waiters and self.waiters.get(id(key)) is waiters:
                    del self.waiters[id(key)]
            if cause is not SIGNALLED:
                scheduler.program.thread.act()
                return cause is key
            if take():
                return True

    def hand_over(self, key: object) -> ThreadTask | None:
        """Let the thread go on that has waited longest for an object; return it, or None if there is none."""
        waiters = self.waiters.get(id(key))
        while waiters:
            task = waiters.popleft()
            if self._scheduler.wake(task, key):
                return task
        return None


def _deadline_ns(scheduler: Scheduler, blocking: bool, timeout: float) -> int:
    """Return when a wait for a lock ends [ns]; if it cannot be meant so, a free lock says what is wrong."""
    _real_acquire(_thread.allocate_lock(), blocking, timeout)
    return NEVER_NS if timeout == -1 else scheduler.world.now_ns + timeout_ns(timeout)


def _plain_locks(scheduler: Scheduler, room: WaitingRoom) -> dict[str, Any]:
    """Return the methods of `_thread.lock`."""
    # Locks that other threads of this process hold, by identity, as long as they exist.
    foreign: dict[int, Any] = {}
    waiters = room.waiters

    # This runs some times for each item of a queue, so that it calls as little as possible.

    def acquire(lock: Any, blocking: bool = True, timeout: float = -1) -> bool:
        if get_ident() != scheduler.os_thread:
            if scheduler.is_standing and is_for_program(sys._getframe(1)):
                with scheduler.resumed():
                    return acquire(lock, blocking, timeout)
            if is_acquired := _real_acquire(lock, blocking, timeout):
                key = id(lock)
                foreign[key] = weakref.ref(lock, lambda _: foreign.pop(key, None))
            return is_acquired
        until_ns = NEVER_NS if timeout == -1 else _deadline_ns(scheduler, blocking, timeout)
        if _real_acquire(lock, False):
            scheduler.lock_count += 1
            if scheduler.lock_count > LOCKS_IN_A_ROW:
                # A thread that checks a value behind a lock in a loop waits for others.
                scheduler.lock_count = 0
                scheduler.ask()
            return True
        if not blocking:
            scheduler.poll()
            return False
        if id(lock) in foreign:
            # It is held in real time.
            return _real_acquire(lock, blocking, timeout)
        return room.wait(lock, "a lock", until_ns, lambda: _real_acquire(lock, False), lambda: release(lock))

    def enter(lock: Any, *given: Any) -> bool:
        return _real_enter(lock, *given) if given else acquire(lock)

    def release(lock: Any, *_: object) -> None:
        if foreign:
            foreign.pop(id(lock), None)
        if not (waiters and id(lock) in waiters and room.hand_over(lock)):
            _real_release(lock)

    def locked(lock: Any) -> bool:
        scheduler.poll()
        return _real_locked(lock)

    return {
        **dict.fromkeys(("acquire", "acquire_lock"), acquire),
        # From 3.15 on, it takes no arguments.
        "__enter__": enter if sys.version_info >= (3, 15) else acquire,
        **dict.fromkeys(("release", "release_lock", "__exit__"), release),
        # `threading` itself only looks, at the locks of all its threads and in the order of their addresses.
        **dict.fromkeys(("locked", "locked_lock"), for_program(scheduler, Query(locked, _real_locked), _real_locked)),
    }


class _Owner:
    """The thread of the program that holds an `RLock`, and how often."""

    __slots__ = ("count", "lock", "task")

    def __init__(self, lock: Any, task: ThreadTask) -> None:
        self.lock = lock
        self.task = task
        self.count = 1


_RLOCK = dict(vars(_rlock))
"""Its methods as they are; not every version of Python has all of them."""


def _reentrant_locks(scheduler: Scheduler, room: WaitingRoom) -> dict[str, Any]:
    """Return the methods of `_thread.RLock`: all threads of the program are one to it, and hold it together.

    So does KiKS, whose own locks stay held while another thread of the program goes on.
    """
    owners: dict[int, _Owner] = {}

    def acquire(lock: Any, blocking: bool = True, timeout: float = -1) -> bool:
        owner, task = owners.get(id(lock)), scheduler.current
        if owner is None:
            # Another thread of the process may hold it, in real time.
            if is_acquired := _RLOCK["acquire"](lock, blocking, timeout):
                owners[id(lock)] = _Owner(lock, task)
            return bool(is_acquired)
        if owner.task is task:
            owner.count += 1
            return True
        until_ns = _deadline_ns(scheduler, blocking, timeout)
        if not blocking:
            scheduler.poll()
            return False
        return room.wait(lock, "a lock", until_ns, lambda: acquire(lock, False), lambda: release(lock))

    def release(lock: Any) -> None:
        owner = owners.get(id(lock))
        if owner is None:
            _RLOCK["release"](lock)
            return
        if owner.task is not scheduler.current:
            raise RuntimeError("cannot release un-acquired lock")
        owner.count -= 1
        if not owner.count:
            leave(lock, owner)

    def leave(lock: Any, owner: _Owner) -> None:
        task = room.hand_over(lock)
        if task is None:
            del owners[id(lock)]
            _RLOCK["release"](lock)
        else:
            owner.task, owner.count = task, 1

    def save(lock: Any) -> Any:
        owner = owners.get(id(lock))
        if owner is None or owner.task is not scheduler.current:
            return _RLOCK["_release_save"](lock)
        state = owner.count, owner.task
        leave(lock, owner)
        return state

    def restore(lock: Any, state: Any) -> None:
        if not isinstance(state[1], ThreadTask):
            _RLOCK["_acquire_restore"](lock, state)
            return
        acquire(lock)
        owners[id(lock)].count = state[0]

    def is_owned(lock: Any) -> bool:
        owner = owners.get(id(lock))
        return bool(_RLOCK["_is_owned"](lock)) if owner is None else owner.task is scheduler.current

    methods: dict[str, Callable[..., Any]] = {
        **dict.fromkeys(("acquire", "__enter__"), acquire),
        "release": release,
        "__exit__": lambda lock, *_: release(lock),
        "_release_save": save,
        "_acquire_restore": restore,
        "_is_owned": is_owned,
        "_recursion_count": lambda lock: owners[id(lock)].count if is_owned(lock) else 0,
        "locked": lambda lock: id(lock) in owners,
    }
    return {name: for_program(scheduler, method, _RLOCK[name]) for name, method in methods.items() if name in _RLOCK}


def _queues(scheduler: Scheduler, room: WaitingRoom) -> dict[str, Any]:
    """Return the methods of `_queue.SimpleQueue`."""

    def get(simple_queue: Any, block: bool = True, timeout: float | None = None) -> Any:
        if not scheduler.is_here:
            if scheduler.is_standing and is_for_program(sys._getframe(1)):
                with scheduler.resumed():
                    return get(simple_queue, block, timeout)
            return _real_get(simple_queue, block, timeout)
        if timeout is not None and timeout < 0 and block:
            raise ValueError("'timeout' must be a non-negative number")
        found: list[Any] = []

        def take() -> bool:
            try:
                found.append(_real_get(simple_queue, False))
            except queue.Empty:
                return False
            return True

        until_ns = NEVER_NS if timeout is None else scheduler.world.now_ns + timeout_ns(timeout)
        while not take():
            if not block:
                scheduler.poll()
                raise queue.Empty
            if not room.wait(simple_queue, "a queue", until_ns, take, lambda: room.hand_over(simple_queue)):
                raise queue.Empty
            if found:
                break
        return found[0]

    def put(simple_queue: Any, item: Any, block: bool = True, timeout: float | None = None) -> None:
        _real_put(simple_queue, item)
        room.hand_over(simple_queue)

    return {"get": get, "get_nowait": lambda simple_queue: get(simple_queue, False), "put": put, "put_nowait": put}


def replacements(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of `_thread`, `threading` and `queue`, by module."""
    room = WaitingRoom(scheduler)

    def is_set(event: threading.Event) -> bool:
        if not real_is_set(event):
            scheduler.poll()
        return real_is_set(event)

    def is_owned(condition: Any) -> bool:
        # Python tries to acquire the lock, which would be a poll.
        lock = condition._lock
        return _real_locked(lock) if type(lock) is _lock else real_is_owned(condition)

    def ident(*given: Any) -> int:
        real_ident = get_ident(*given)
        return scheduler.current.ident if real_ident == scheduler.own_thread else real_ident

    def get_native_id() -> int:
        # The operating system numbers threads on from the process.
        task = scheduler.current
        return os.getpid() + (0 if task is scheduler.main else (task.ident - FIRST_IDENT) // IDENT_STEP + 1)

    # Running executors: those of this process are not the program's.
    executors: dict[str, dict[str, Any]] = {
        concurrent.futures.thread.__name__: {"_shutdown": False, "_threads_queues": weakref.WeakKeyDictionary()}
    }
    if (processes := "concurrent.futures.process") in sys.modules:  # importing it would make each start slower
        executors[processes] = {"_global_shutdown": False, "_threads_wakeups": weakref.WeakKeyDictionary()}
    real_is_set, real_is_owned = threading.Event.is_set, threading.Condition._is_owned  # type: ignore[attr-defined]
    return {
        "_thread": {"get_ident": ForAll(ident), "get_native_id": get_native_id},
        "_thread.LockType": _plain_locks(scheduler, room),
        "_thread.RLock": _reentrant_locks(scheduler, room),
        "_queue.SimpleQueue": _queues(scheduler, room),
        "threading": {
            # The first thread of a program is Thread-1, even if other threads ran in this process before.
            "_counter": itertools.count(1).__next__
        },
        "threading.Event": {"is_set": for_program(scheduler, Query(is_set, real_is_set), real_is_set)},
        "threading.Condition": {"_is_owned": is_owned},
        **executors,
    }
