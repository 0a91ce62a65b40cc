"""A world on a desk, with what belongs to it alone: its gate, the hands in it, its speedometer."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from typing import TypeVar

from kiks.clock.gate import Gate
from kiks.engine.compiling import compiling_s
from kiks.sim.drag import Drags
from kiks.sim.simulation import Simulation
from kiks.units import ns_from_s

RETRY_S = 0.02
"""Period at which a request is offered again while no thread moves the world [s]."""

WINDOW_NS = 1_000_000_000
"""Window of the momentary speed [ns of real time]."""

Done = TypeVar("Done")


def working_ns() -> int:
    """Return a monotonic time [ns] that stands still while something is compiled."""
    return time.monotonic_ns() - ns_from_s(compiling_s())


class Speedometer:
    """Measures how fast simulated time passes, from samples of both clocks.

    Args:
        wall_ns: Monotonic clock [ns]; tests pass their own.

    Attributes:
        average: Simulated seconds per real second since the start, without pauses.
        momentary: Simulated seconds per real second over the last second.

    Example:
        >>> wall = [0]
        >>> meter = Speedometer(wall_ns=lambda: wall[0])
        >>> meter.note(0, is_paused=False)
        >>> wall[0] = 1_000_000_000
        >>> meter.note(5_000_000_000, is_paused=False)
        >>> meter.average, meter.momentary
        (5.0, 5.0)
    """

    def __init__(self, *, wall_ns: Callable[[], int] = working_ns) -> None:
        self.average = 0.0
        self.momentary = 0.0
        self._wall_ns = wall_ns
        self._last: tuple[int, int] | None = None
        self._running_ns = self._passed_ns = 0
        self._recent: deque[tuple[int, int]] = deque()

    def note(self, now_ns: int, *, is_paused: bool) -> None:
        """Take a sample at the simulated time `now_ns` [ns]."""
        wall_ns = self._wall_ns()
        if self._last is not None:
            last_wall_ns, last_ns = self._last
            self._passed_ns += now_ns - last_ns
            # A single step during a pause takes hardly any real time.
            self._running_ns += 0 if is_paused else wall_ns - last_wall_ns
        self._last = wall_ns, now_ns
        self._recent.append(self._last)
        while wall_ns - self._recent[0][0] > WINDOW_NS and len(self._recent) > 2:
            self._recent.popleft()
        first_wall_ns, first_ns = self._recent[0]
        self.momentary = (now_ns - first_ns) / (wall_ns - first_wall_ns) if wall_ns > first_wall_ns else 0.0
        self.average = self._passed_ns / self._running_ns if self._running_ns else 0.0


class DeskWorld:
    """A world on a desk.

    Attributes:
        sim: The world.
        gate: Where its time passes, at a speed in simulated seconds per real second, or at full speed if that is None.
        hands: The things that people hold.
        meter: Measures how fast its time passes.
    """

    def __init__(self, sim: Simulation, speed: float | None) -> None:
        self.sim = sim
        self.gate = Gate(sim.lock, speed=speed)
        self.hands = Drags(sim)
        self.meter = Speedometer()

    async def do(self, act: Callable[[Simulation], Done]) -> Done:
        """Run a function with the locked world between two events, and return or raise its outcome.

        The function must not let time pass.
        """
        future = self.gate.ask(lambda: act(self.sim))
        if future.done():
            return future.result()
        loop = asyncio.get_running_loop()
        alarm: asyncio.TimerHandle

        def serve() -> None:
            nonlocal alarm
            self.gate.serve()
            alarm = loop.call_later(RETRY_S, serve)

        # The thread that moves the world serves the request, unless it has just stopped. This thread waits for nothing
        # else, as each time it wakes up it takes the interpreter from that one.
        alarm = loop.call_later(RETRY_S, serve)
        try:
            return await asyncio.wrap_future(future)
        finally:
            alarm.cancel()

    # ---- between two events of the world, with its lock held ----

    def pause(self) -> None:
        """Pause its time."""
        self.gate.pause(self.sim.now_ns)

    def drop_all(self) -> None:
        """Let all hands drop what they hold."""
        self.hands.drop_all()
        self.leave_if_empty()

    def leave_if_empty(self) -> None:
        """Remove the keeper from the gate when all hands are empty."""
        if self.hands.are_empty:
            self.gate.leave(self.hands.keep)
