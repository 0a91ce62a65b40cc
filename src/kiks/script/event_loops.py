"""The values that asyncio keeps per thread, for the program's threads, and a repeatable order of its sets."""

from __future__ import annotations

import asyncio
import weakref
from _threading_local import local
from collections.abc import Iterator
from itertools import count
from typing import Any

from kiks.script.thread_scheduler import Scheduler


def replacements(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of `asyncio` and `concurrent.futures`, by module.

    Args:
        scheduler: The program's threads; each gets a running loop of its own.
    """
    scheduler.carried.append((asyncio._get_running_loop, asyncio._set_running_loop))

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
        "asyncio.events.BaseDefaultEventLoopPolicy": {"_Local": Local},
        "asyncio.events": {"_event_loop_policy": None},
        "asyncio.Future": {"__hash__": hash_by_number},
        "asyncio.Task": {"__hash__": hash_by_number},
        "concurrent.futures._base.Future": {"__hash__": hash_by_number},
    }
