"""pygame: its clocks, waits and timers in simulated time."""

from __future__ import annotations

import time
from collections import deque
from types import ModuleType
from typing import Any

from kiks.script.libraries.host import BLINK_S, Host
from kiks.script.thread_scheduler import STUCK, Task, timeout_ns
from kiks.sim.read_completion import NEVER_NS

NS_PER_MS = 1_000_000
FPS_FRAMES = 10
"""Number of frames that `Clock.get_fps` averages."""

_waiting: list[Task] = []


def adapt(module: ModuleType, host: Host) -> dict[Any, dict[str, Any]]:
    """Return what stands in for names of `pygame.time`."""
    scheduler, clock = host.scheduler, host.clock
    start_ns = scheduler.world.now_ns
    timers: dict[int, int] = {}

    def wait(milliseconds: int, /) -> int:
        if milliseconds > 0:
            clock.sleep(milliseconds / 1000)
        return max(milliseconds, 0)

    def get_ticks() -> int:
        return (clock.ask_ns() - start_ns) // NS_PER_MS

    def set_timer(event: Any, millis: int, loops: int = 0) -> None:
        import pygame

        kind = event if isinstance(event, int) else event.type
        number = timers[kind] = timers.get(kind, 0) + 1

        def ring(left: int) -> None:
            at_ns = scheduler.world.now_ns
            while left and timers[kind] == number:
                at_ns += millis * NS_PER_MS
                scheduler.sleep_until(at_ns)
                if timers[kind] == number:
                    pygame.event.post(pygame.event.Event(kind) if isinstance(event, int) else event)
                left -= 1

        if millis > 0:
            scheduler.start(ring, (loops or -1,), {})

    class Clock:
        """See `pygame.time.Clock`: it counts whole milliseconds."""

        def __init__(self) -> None:
            self._last_ms = self._now_ms()
            self._time_ms = self._raw_ms = 0
            self._frames: deque[int] = deque(maxlen=FPS_FRAMES)

        def _now_ms(self) -> int:
            return scheduler.world.now_ns // NS_PER_MS

        def tick(self, framerate: float = 0, /) -> int:
            self._raw_ms = self._now_ms() - self._last_ms
            left_ms = int(1000 / framerate) - self._raw_ms if framerate > 0 else 0
            if left_ms > 0:
                clock.sleep(left_ms / 1000)
            else:
                clock.ask_ns()
            now_ms = self._now_ms()
            self._time_ms, self._last_ms = now_ms - self._last_ms, now_ms
            self._frames.append(self._time_ms)
            return self._time_ms

        tick_busy_loop = tick

        def get_time(self) -> int:
            return self._time_ms

        def get_rawtime(self) -> int:
            return self._raw_ms

        def get_fps(self) -> float:
            total_ms = sum(self._frames)
            return 1000 * len(self._frames) / total_ms if len(self._frames) == FPS_FRAMES and total_ms else 0.0

    return {module: {"wait": wait, "delay": wait, "get_ticks": get_ticks, "set_timer": set_timer, "Clock": Clock}}


def adapt_events(module: ModuleType, host: Host) -> dict[Any, dict[str, Any]]:
    """Return what stands in for names of `pygame.event`."""
    scheduler = host.scheduler
    real_post = module.post

    def post(event: Any, /) -> bool:
        is_posted = bool(real_post(event))
        for task in _waiting:
            scheduler.wake(task, None)
        return is_posted

    def wait(timeout: int = 0) -> Any:
        until_ns = scheduler.world.now_ns + timeout_ns(timeout / 1000) if timeout > 0 else NEVER_NS
        while not (event := module.poll()) and scheduler.world.now_ns < until_ns:
            task = scheduler.current
            _waiting.append(task)
            try:
                cause = scheduler.wait("an event of pygame", until_ns=until_ns, when_stuck=True)
            finally:
                _waiting.remove(task)
            if cause is STUCK:
                # Only a person can go on.
                time.sleep(BLINK_S)
        return event

    return {module: {"post": post, "wait": wait}}
