"""A program's `time` module in simulated time, so that its waits cost nothing and its clocks tell the robot's time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from kiks.clock.program import calendar_ns
from kiks.units import NS_PER_S


@contextmanager
def virtual_time(now_ns: Callable[[], int], sleep: Callable[[float], None]) -> Iterator[None]:
    """Let `time.sleep`, `time.time`, `time.monotonic`, `time.perf_counter` and their `_ns` forms be simulated.

    Threads that run already keep real time: they are none of the program's, such as the server of a desk.

    Args:
        now_ns: Returns the simulated time [ns]; may let a little of it pass, so that no loop waits for ever.
        sleep: Lets simulated time pass [s].
    """

    def virtual_sleep(seconds: float) -> None:
        if seconds < 0:
            raise ValueError("sleep length must be non-negative")
        sleep(seconds)

    replacements: dict[str, Callable[..., Any]] = {
        "sleep": virtual_sleep,
        "time": lambda: calendar_ns(now_ns()) / NS_PER_S,
        "time_ns": lambda: calendar_ns(now_ns()),
    }
    for name in ("monotonic", "perf_counter"):
        replacements[name] = lambda: now_ns() / NS_PER_S
        replacements[f"{name}_ns"] = now_ns
    originals = {name: getattr(time, name) for name in replacements}
    others = {thread.ident for thread in threading.enumerate()} - {threading.get_ident()}
    for name, replacement in replacements.items():
        setattr(time, name, _for_all_but(others, replacement, originals[name]) if others else replacement)
    try:
        yield
    finally:
        for name, original in originals.items():
            setattr(time, name, original)


def _for_all_but(
    others: set[int | None], replacement: Callable[..., Any], original: Callable[..., Any]
) -> Callable[..., Any]:
    """Return a function that is the replacement, but for some threads the original."""

    def choose(*given: float) -> Any:
        return (original if threading.get_ident() in others else replacement)(*given)

    return choose
