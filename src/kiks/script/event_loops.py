"""The values that asyncio keeps per thread, for the program's threads, and a repeatable order of its sets."""

from __future__ import annotations

import asyncio
import sys
import weakref
from _threading_local import local
from collections.abc import Iterator
from itertools import count
from typing import Any

from kiks.script.cpython import EVENT_LOOP_POLICY
from kiks.script.thread_scheduler import Scheduler

_enter_task, _leave_task = asyncio._enter_task, asyncio._leave_task
"""What asyncio has for those who extend it, around each step of a task."""


def _take() -> tuple[Any, Any]:
    """Take the running loop and the task that it runs away from this thread."""
    loop = asyncio._get_running_loop()
    task = None if loop is None else asyncio.current_task(loop)
    if loop is not None and task is not None:
        _leave_task(loop, task)
    asyncio._set_running_loop(None)
    return loop, task


def _put(taken: tuple[Any, Any]) -> None:
    """Put them back."""
    loop, task = taken
    asyncio._set_running_loop(loop)
    if task is not None:
        _enter_task(loop, task)


def _take_hooks() -> Any:
    """Take away what this thread does with new coroutines and generators."""
    hooks, depth = sys.get_asyncgen_hooks(), sys.get_coroutine_origin_tracking_depth()
    _put_hooks(((None, None), 0))
    return hooks, depth


def _put_hooks(taken: Any) -> None:
    hooks, depth = taken
    sys.set_asyncgen_hooks(*hooks)
    sys.set_coroutine_origin_tracking_depth(depth)


def replacements(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of `asyncio` and `concurrent.futures`, by module.

    Args:
        scheduler: The program's threads; each gets a running loop of its own.
    """
    scheduler.carried += [(_take, _put), (_take_hooks, _put_hooks)]

    class Local(local):
        """The loop of each thread."""

        _loop = None
        _set_called = False

    # `wait` and `as_completed` iterate over sets, whose order must not depend on memory addresses of futures.
    numbers: Iterator[int] = count()
    known: dict[int, tuple[int, Any]] = {}

    def hash_by_number(future: Any) -> int:
        key = id(future)
        if key not in known:
            known[key] = next(numbers), weakref.ref(future, lambda _: known.pop(key))
        return known[key][0]

    return {
        f"asyncio.events.{EVENT_LOOP_POLICY}": {"_Local": Local},
        "asyncio.events": {"_event_loop_policy": None},
        "asyncio.Future": {"__hash__": hash_by_number},
        "asyncio.Task": {"__hash__": hash_by_number},
        "concurrent.futures._base.Future": {"__hash__": hash_by_number},
    }
