"""What asyncio keeps for each thread, kept for each of the program's; and the order of what it keeps in sets."""

from __future__ import annotations

import asyncio
from _threading_local import local
from collections.abc import Iterator
from itertools import count
from typing import Any

from kiks.script.thread_scheduler import Scheduler


def replacements(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return what stands in for names of `asyncio` and `concurrent.futures`, by module.

    Args:
        scheduler: The program's threads; each has a running loop of its own from now on.
    """
    scheduler.carried.append((asyncio._get_running_loop, asyncio._set_running_loop))

    class Local(local):
        """Which loop each thread has."""

        _loop = None
        _set_called = False

    # `wait` and `as_completed` go through a set, whose order must not depend on where in memory a future lies.
    numbers: Iterator[int] = count()

    class Task(asyncio.Task):  # type: ignore[type-arg]
        def __init__(self, *args: Any, **kwargs: Any) -> None:
            self._number = next(numbers)
            super().__init__(*args, **kwargs)

        def __hash__(self) -> int:
            return self._number

    def hash_by_number(future: Any) -> int:
        number = future.__dict__.get("_number")
        if number is None:
            number = future._number = next(numbers)
        return int(number)

    Task.__name__ = Task.__qualname__ = "Task"
    Task.__module__ = "asyncio"
    return {
        "asyncio.events.BaseDefaultEventLoopPolicy": {"_Local": Local},
        "asyncio.events": {"_event_loop_policy": None},
        "asyncio": {"Task": Task},
        "asyncio.tasks": {"Task": Task},
        "concurrent.futures._base.Future": {"__hash__": hash_by_number},
    }
