"""The clocks of a program: `time`, `datetime` and the others tell simulated time, and sleeping takes no real time."""

from __future__ import annotations

import datetime
import os
import resource
import sys
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import update_wrapper
from typing import Any

from kiks.clock.program_clock import EPOCH_S, calendar_ns
from kiks.model.checks import SECONDS_MAX
from kiks.script.patching import Query, for_program
from kiks.script.thread_scheduler import Scheduler
from kiks.sim.port import VirtualPort
from kiks.units import NS_PER_S

with suppress(ImportError):
    import _uuid  # type: ignore[import-not-found]  # noqa: F401  (only what was imported can be replaced)

CALENDARS = frozenset(getattr(time, name) for name in ("CLOCK_REALTIME", "CLOCK_TAI") if hasattr(time, name))
"""Clocks of `time.clock_gettime` that tell the date; the others tell the time since the program's start."""

SHORTEST_S = 1e-9
"""Shortest sleep [s]: rounding may leave less of a wait, and time must pass nevertheless."""

SLEPT_MAX_S = 2**63 / NS_PER_S
"""Limit of the times that Python knows [s]."""

UUID_EPOCH = 0x01B21DD213814000
"""Time of 1970 in UUIDs [100 ns since 15 October 1582] (RFC 9562, section 5.1)."""

NODE = b"\x02KiKS\x01"
"""Address of the simulated network card in UUIDs, a locally administered one (RFC 9562, section 6.10)."""

OF_NOW = ("localtime", "gmtime", "ctime", "asctime", "strftime")
"""Functions of `time` that convert the present time if they are given none."""

_real_now, _real_utcnow = (vars(datetime.datetime)[name] for name in ("now", "utcnow"))
_real_today = vars(datetime.date)["today"]


def replacements(scheduler: Scheduler, clock: VirtualPort) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of modules that tell a time, by module.

    Args:
        scheduler: The program's threads.
        clock: A port of the program's world.
    """

    def reading(convert: Callable[..., Any]) -> Query:
        """Return what stands in for a clock; `convert` takes the time [ns], and what the clock was given."""

        def waited(*given: Any) -> Any:
            scheduler.poll()
            return convert(scheduler.world.now_ns, *given)

        return Query(lambda *given: convert(clock.ask_ns(), *given), waited)

    def sleep(seconds: Any, /) -> None:
        if not 0 <= seconds < SLEPT_MAX_S:
            time.sleep(seconds)  # says what is wrong
        if seconds == 0:
            scheduler.give_way()
            clock.ask_ns()
        else:
            clock.sleep(min(max(float(seconds), SHORTEST_S), SECONDS_MAX))

    def clock_gettime_ns(now_ns: int, clock_id: int) -> int:
        time.clock_gettime_ns(clock_id)  # says whether there is such a clock
        return calendar_ns(now_ns) if clock_id in CALENDARS else now_ns

    def of_now(name: str) -> Callable[..., Any]:
        """Return a function of `time` that takes a time, or the present one."""
        is_of_struct = name in ("asctime", "strftime")

        def converted(*given: Any) -> Any:
            if name == "strftime" and len(given) == 1:
                given = (given[0], time.localtime(calendar_ns(clock.ask_ns()) / NS_PER_S))
            elif name != "strftime" and (not given or given[0] is None):
                seconds = calendar_ns(clock.ask_ns()) / NS_PER_S
                given = (time.localtime(seconds),) if is_of_struct else (seconds,)
            return getattr(time, name)(*given)

        return converted

    functions: dict[str, Any] = {
        "sleep": sleep,
        "time": reading(lambda now_ns: calendar_ns(now_ns) / NS_PER_S),
        "time_ns": reading(calendar_ns),
        "clock_gettime": reading(lambda now_ns, clock_id: clock_gettime_ns(now_ns, clock_id) / NS_PER_S),
        "clock_gettime_ns": reading(clock_gettime_ns),
    }
    for name in ("monotonic", "perf_counter", "process_time", "thread_time"):
        functions[name] = reading(lambda now_ns: now_ns / NS_PER_S)
        functions[f"{name}_ns"] = reading(lambda now_ns: now_ns)
    functions |= {name: of_now(name) for name in OF_NOW}

    def usage(who: int, /) -> resource.struct_rusage:
        real: resource.struct_rusage = resource.getrusage(who)
        return type(real)((clock.ask_ns() / NS_PER_S, 0.0, *real[2:])) if who == resource.RUSAGE_SELF else real

    def times() -> os.times_result:
        now_s = clock.ask_ns() / NS_PER_S
        return os.times_result((now_s, 0.0, 0.0, 0.0, now_s))

    last_time = 0

    def new_time_uuid() -> tuple[bytes, int]:
        nonlocal last_time
        last_time = max(calendar_ns(clock.ask_ns()) // 100 + UUID_EPOCH, last_time + 1)
        low, middle, high = last_time & 0xFFFFFFFF, last_time >> 32 & 0xFFFF, last_time >> 48
        return b"".join(
            (low.to_bytes(4, "big"), middle.to_bytes(2, "big"), (high | 0x1000).to_bytes(2, "big"), b"\x80\0", NODE)
        ), 0

    return {
        "time": functions,
        **_dates(scheduler, clock),
        "posix": {"times": times},
        "resource": {"getrusage": usage},
        "_uuid": {"generate_time_safe": new_time_uuid},
        # Start of `relativeCreated` of log records.
        "logging": {"_startTime": EPOCH_S * NS_PER_S if sys.version_info >= (3, 13) else float(EPOCH_S)},
    }


def _dates(scheduler: Scheduler, clock: VirtualPort) -> dict[str, dict[str, Any]]:
    """Return the methods of `datetime`'s classes that tell the present; the other ones ask `time`."""

    def today(cls: type[datetime.date]) -> datetime.date:
        return cls.fromtimestamp(calendar_ns(clock.ask_ns()) / NS_PER_S)

    def now(cls: type[datetime.datetime], tz: datetime.tzinfo | None = None) -> datetime.datetime:
        seconds, rest_ns = divmod(calendar_ns(clock.ask_ns()), NS_PER_S)
        return cls.fromtimestamp(seconds, tz).replace(microsecond=rest_ns // 1000)

    def utcnow(cls: type[datetime.datetime]) -> datetime.datetime:
        if sys.version_info >= (3, 12):
            warnings.warn(
                "datetime.datetime.utcnow() is deprecated and scheduled for removal in a future version. Use "
                "timezone-aware objects to represent datetimes in UTC: datetime.datetime.now(datetime.UTC).",
                DeprecationWarning,
                stacklevel=3,
            )
        return now(cls, datetime.UTC).replace(tzinfo=None)

    def real(method: Any) -> Callable[..., Any]:
        def call(cls: Any, *args: Any, **kwargs: Any) -> Any:
            return method.__get__(None, cls)(*args, **kwargs)

        return update_wrapper(call, method, ("__name__", "__qualname__", "__doc__"), ())

    return {
        # From 3.15 on, it no longer asks `time`.
        "datetime.date": {"today": classmethod(for_program(scheduler, today, real(_real_today)))},
        "datetime.datetime": {
            "now": classmethod(for_program(scheduler, now, real(_real_now))),
            "utcnow": classmethod(for_program(scheduler, utcnow, real(_real_utcnow))),
        },
    }
