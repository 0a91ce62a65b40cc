"""The clocks of a program: `time` and `datetime` tell simulated time, and sleeping takes no real time."""

from __future__ import annotations

import datetime
import sched
import time
from collections.abc import Callable
from typing import Any

from kiks.clock.program_clock import EPOCH_S
from kiks.script.thread_scheduler import Scheduler
from kiks.sim.port import VirtualPort
from kiks.units import NS_PER_S

CALENDARS = frozenset(getattr(time, name) for name in ("CLOCK_REALTIME", "CLOCK_TAI") if hasattr(time, name))
"""Clocks of `time.clock_gettime` that tell the date; the others tell the time since the program's start."""

SHORTEST_S = 1e-9
"""Shortest sleep [s]: rounding may leave less of a wait, and time must pass nevertheless."""


def replacements(scheduler: Scheduler, clock: VirtualPort) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of `time` and `datetime`, by module.

    Args:
        scheduler: The program's threads.
        clock: A port of the program's world.
    """
    now_ns = clock.ask_ns

    def calendar_ns() -> int:
        return EPOCH_S * NS_PER_S + now_ns()

    def sleep(seconds: float, /) -> None:
        if seconds < 0:
            raise ValueError("sleep length must be non-negative")
        if seconds == 0:
            scheduler.give_way()
            now_ns()
        else:
            clock.sleep(max(seconds, SHORTEST_S))

    def clock_gettime_ns(clock_id: int, /) -> int:
        return calendar_ns() if clock_id in CALENDARS else now_ns()

    def of_now(name: str) -> Callable[..., Any]:
        """Return a function of `time` that takes a time, or the present one."""
        original = getattr(time, name)
        is_of_struct = name in ("asctime", "strftime")

        def converted(*given: Any) -> Any:
            if name == "strftime" and len(given) == 1:
                given = (given[0], local(calendar_ns() / NS_PER_S))
            elif name != "strftime" and (not given or given[0] is None):
                seconds = calendar_ns() / NS_PER_S
                given = (local(seconds),) if is_of_struct else (seconds,)
            return original(*given)

        return converted

    local = time.localtime
    functions: dict[str, Callable[..., Any]] = {
        "sleep": sleep,
        "time": lambda: calendar_ns() / NS_PER_S,
        "time_ns": calendar_ns,
        "clock_gettime": lambda clock_id, /: clock_gettime_ns(clock_id) / NS_PER_S,
        "clock_gettime_ns": clock_gettime_ns,
    }
    for name in ("monotonic", "perf_counter", "process_time", "thread_time"):
        functions[name] = lambda: now_ns() / NS_PER_S
        functions[f"{name}_ns"] = now_ns
    for name in ("localtime", "gmtime", "ctime", "asctime", "strftime"):
        functions[name] = of_now(name)

    def deadline_time(*_: object) -> float:
        """Return the time [s] to a library that waits with a timeout; the program does not poll the time here."""
        scheduler.poll()
        return scheduler.world.now_ns / NS_PER_S

    dates = _dates(calendar_ns)
    simulated = {name: _here(scheduler, function, getattr(time, name)) for name, function in functions.items()}

    def begin(
        plan: sched.scheduler, timefunc: Any = simulated["monotonic"], delayfunc: Any = simulated["sleep"]
    ) -> None:
        real_begin(plan, timefunc, delayfunc)

    real_begin = sched.scheduler.__init__
    return {
        "time": simulated,
        "sched.scheduler": {"__init__": begin},
        "queue": {"time": deadline_time},
        # Start of `relativeCreated` of log records.
        "logging": {"_startTime": float(EPOCH_S)},
        "threading": {"_time": deadline_time},
        "asyncio.base_events.BaseEventLoop": {"time": deadline_time},
        "datetime": dates,
        "_datetime": dates,
    }


def _here(scheduler: Scheduler, function: Callable[..., Any], original: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function for the program's threads; other threads of this process get the original."""

    def choose(*given: Any) -> Any:
        return (function if scheduler.is_here else original)(*given)

    choose.__name__ = choose.__qualname__ = original.__name__
    return choose


def _dates(calendar_ns: Callable[[], int]) -> dict[str, type]:
    """Return `datetime` and `date` whose present is simulated; older objects count as instances of them."""

    class Kind(type):
        """Metaclass of a class that has the same instances as the class that it replaces."""

        def __instancecheck__(cls, instance: object) -> bool:
            return isinstance(instance, cls.__bases__[0])

        def __subclasscheck__(cls, other: type) -> bool:
            return issubclass(other, cls.__bases__[0])

    class SimulatedDatetime(datetime.datetime, metaclass=Kind):
        @classmethod
        def now(cls, tz: datetime.tzinfo | None = None) -> SimulatedDatetime:
            seconds, rest_ns = divmod(calendar_ns(), NS_PER_S)
            return cls.fromtimestamp(seconds, tz).replace(microsecond=rest_ns // 1000)

        @classmethod
        def today(cls) -> SimulatedDatetime:
            return cls.now()

        @classmethod
        def utcnow(cls) -> SimulatedDatetime:
            return cls.now(datetime.UTC).replace(tzinfo=None)

    class SimulatedDate(datetime.date, metaclass=Kind):
        @classmethod
        def today(cls) -> SimulatedDate:
            return cls.fromtimestamp(calendar_ns() / NS_PER_S)

    for simulated in (SimulatedDatetime, SimulatedDate):
        simulated.__name__ = simulated.__qualname__ = simulated.__bases__[0].__name__
        simulated.__module__ = "datetime"
    return {"datetime": SimulatedDatetime, "date": SimulatedDate}
