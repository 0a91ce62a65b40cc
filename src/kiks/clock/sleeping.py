"""A hint for a program that waits by `time.sleep` beside a simulation of its own: its world stands still meanwhile.

Need: such a robot hardly moves, and nothing says why. Assumption: whether a call has slept cannot be seen cheaply.
Method: a program whose code names `sleep` is measured from its first port on, and compared with its world at the end.
"""

from __future__ import annotations

import logging
import sys
from contextlib import suppress
from pathlib import Path
from time import perf_counter, process_time
from types import CodeType, FrameType
from typing import Protocol
from weakref import WeakSet, finalize

IDLE_S = 1.0
"""Real time without computing from which on there is a hint, if it is also twice the simulated time [s]."""

FRAMES_MAX = 10
"""Most calls of the program that are looked at."""

SCHEDULED = Path("/proc/self/schedstat")
"""Where Linux says how long the first thread of this process has waited for a processor."""

_log = logging.getLogger("kiks.program")
_watched: WeakSet[object] = WeakSet()


class SimulatedClock(Protocol):
    """Has the simulated time [ns]."""

    now_ns: int


def watch_sleeps(simulation: object, clock: SimulatedClock) -> None:
    """Compare real and simulated time when a simulation ends, if the program that opens its port names `sleep`."""
    if simulation in _watched:
        return
    _watched.add(simulation)
    frame: FrameType | None = sys._getframe(1)
    codes: list[CodeType] = []
    while frame is not None and len(codes) < FRAMES_MAX:
        if str(frame.f_globals.get("__name__")).partition(".")[0] not in ("kiks", "serial"):
            codes.append(frame.f_code)
        frame = frame.f_back
    if any(map(_names_sleep, codes)):
        finalize(simulation, _compare, clock, clock.now_ns, _idle_s())


def _names_sleep(code: CodeType) -> bool:
    return "sleep" in code.co_names or any(_names_sleep(each) for each in code.co_consts if isinstance(each, CodeType))


def _idle_s() -> float:
    """Return for how long the program has waited, beside a time that stays the same [s].

    On a busy computer it also waits for a processor, which Linux counts (Documentation/scheduler/sched-stats.rst).
    """
    queued_ns = 0
    with suppress(OSError, ValueError, IndexError):
        queued_ns = int(SCHEDULED.read_text(encoding="ascii").split()[1])
    return perf_counter() - process_time() - queued_ns * 1e-9


def _compare(clock: SimulatedClock, begin_ns: int, begin_s: float) -> None:
    idle_s, simulated_s = _idle_s() - begin_s, (clock.now_ns - begin_ns) * 1e-9
    if idle_s > max(IDLE_S, 2 * simulated_s):
        _log.warning(
            "the program has waited for %.0f s, and %.1f s have passed in its world: time.sleep lets no simulated time "
            "pass beside a kiks.Simulation. Write sim.run(seconds), or robot.pause(seconds).",
            idle_s,
            simulated_s,
        )
