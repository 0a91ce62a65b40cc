"""The player: shows the past of a world on a desk, at any speed, and from any time on.

The past is a simulation that recorded inputs move, so readings, rays and lines are there as ever. The player's own
thread moves it: the thread that moves the present world waits at its gate meanwhile.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from typing import NamedTuple

from kiks.clock.gate import LAG_NS
from kiks.desk.server.desk_world import DeskWorld
from kiks.errors import KiksError
from kiks.recording.log import RecordedLog
from kiks.recording.replay import Replay
from kiks.sim.drag import Drags
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

PERIOD_S = 0.01
"""Real time between two movements [s]."""

IDLE_S = 0.05
"""Polling period while paused [s]."""

SLICE_NS = NS_PER_S // 50
"""Longest slice of real time that is caught up at once, and of simulated time at full speed [ns]."""


class Span(NamedTuple):
    """A span of simulated time [ns]."""

    begin_ns: int
    end_ns: int

    def nearest_ns(self, time_ns: int) -> int:
        """Return the time in it that is nearest to another one [ns]."""
        return min(max(time_ns, self.begin_ns), self.end_ns)


class Player(DeskWorld):
    """The past of a world, played.

    Args:
        log: Its recording.
        time_ns: Where it begins to be played [ns]; at its begin or end if that is nearer.
        speed: Simulated seconds per real second; None for full speed.
        say: Called with a message for people.

    Attributes:
        span: From when to when it goes.
    """

    def __init__(self, log: RecordedLog, time_ns: int, *, speed: float | None, say: Callable[[str], None]) -> None:
        self._log = log
        self.span = Span(log.begin_ns, log.end_ns)
        self._replay = Replay(log, self.span.nearest_ns(time_ns))
        super().__init__(self._replay.sim, speed)
        self._say = say
        self._is_over = False
        self._changed = threading.Condition(self.sim.lock)
        self._thread = threading.Thread(target=self._run, name="kiks player", daemon=True)
        self.pause()

    def start(self) -> None:
        """Begin to move the world, as far as it shall go."""
        self._thread.start()

    def end(self) -> None:
        """Leave the world alone; from any thread."""
        self._is_over = True
        self.gate.close()

    def let_go(self) -> Simulation:
        """Leave the world alone and return it: it goes on without the recording. The caller holds the lock."""
        self.end()
        return self._replay.let_go()

    # ---- another time ----

    def seek(self, time_ns: int) -> None:
        """Go to a time [ns], or where the past begins or ends; from a thread without an event loop, which waits."""
        asyncio.run(self.do(lambda _: self._seek(self.span.nearest_ns(time_ns))))

    def _seek(self, time_ns: int) -> None:
        if not self._replay.go_to(time_ns):
            # There were fewer robots or turrets then.
            self._replay = Replay(self._log, time_ns, lock=self.sim.world.lock)
            self.sim = self._replay.sim
            self.hands = Drags(self.sim)
        if self.gate.is_paused:
            self.gate.pause(time_ns)
        else:
            self.gate.set_speed(self.gate.speed, time_ns)

    # ---- the thread ----

    def _run(self) -> None:
        while not self._is_over:
            with self._changed:
                self.gate.serve()
                try:
                    wait_s = 0.0 if self._is_over else self._move()
                except KiksError as error:
                    self.pause()
                    self._say(str(error))
                    wait_s = IDLE_S
                if wait_s:
                    self._changed.wait(wait_s)

    def _move(self) -> float:
        """Move the world as far as it shall be by now; return how long nothing more is to be done [s]."""
        now_ns, pace = self.sim.now_ns, self.gate.pace
        if now_ns >= self.span.end_ns:
            if pace.now_ns() > now_ns:
                self.pause()
            return IDLE_S
        speed = 1.0 if pace.speed is None else pace.speed
        due_ns = min(pace.now_ns(), now_ns + round(SLICE_NS * speed), self.span.end_ns)
        if due_ns <= now_ns:
            return IDLE_S if pace.is_held else PERIOD_S
        if not pace.is_held and pace.now_ns() - now_ns > LAG_NS * speed:
            pace.start(due_ns)
        self.sim.advance_to(due_ns)
        return 0.0
