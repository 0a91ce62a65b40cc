"""The player: shows the past of a world on a desk, forwards at any speed, backwards, and from any time on.

The past is a living simulation that recorded inputs move, so readings, rays and lines are there as ever. The player's
own thread moves it: the thread that moves the present world waits at its gate meanwhile.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from concurrent.futures import TimeoutError as NotYet
from typing import NamedTuple

from kiks.clock.gate import LAG_NS
from kiks.desk.server.desk_world import DeskWorld
from kiks.errors import KiksError
from kiks.recording.recorder import CHECK_NS
from kiks.recording.replay import Replay
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

PERIOD_S = 0.01
"""Real time between two movements [s]."""

IDLE_S = 0.05
"""Real time between two looks whether it shall move, while it stands [s]."""

SLICE_NS = NS_PER_S // 50
"""Longest slice of real time that is caught up at once, and of simulated time at full speed [ns]."""

BACK_SPEED_MAX = 100.0
"""Highest speed backwards [simulated seconds per real second], full speed among them."""

SMOOTH_BACK_SPEED = 10.0
"""Up to this speed, each picture backwards is of its own instant; beyond it, of a whole second, where the recording
has a checkpoint."""


class Span(NamedTuple):
    """A span of simulated time [ns]."""

    begin_ns: int
    end_ns: int


class Player(DeskWorld):
    """A part of the past of a world, played.

    Args:
        replay: The part.
        span: From when to when it goes.
        speed: Simulated seconds per real second; None for full speed.
        leave: Called in the player's thread with the player, locked, and a time that it cannot show, when it would go
            there by itself [ns]; returns whether another player shows it now.
        say: Called with a message for people.

    Attributes:
        replay: The part.
        span: From when to when it goes.
        is_backwards: Whether it is played backwards.
    """

    def __init__(
        self,
        replay: Replay,
        span: Span,
        *,
        speed: float | None,
        leave: Callable[[Player, int], bool],
        say: Callable[[str], None],
    ) -> None:
        super().__init__(replay.sim, speed)
        self.replay = replay
        self.span = span
        self.is_backwards = False
        self._leave, self._say = leave, say
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
        return self.replay.let_go()

    # ---- how it goes; between two events ----

    @property
    def is_paused(self) -> bool:
        """Whether its time stands still."""
        return self.gate.is_paused and not self.is_backwards

    def pause(self) -> None:
        """Pause its time."""
        self.is_backwards = False
        super().pause()

    def go_on(self) -> None:
        """Play on."""
        self.pause()
        super().go_on()

    def go_back(self) -> None:
        """Play backwards."""
        self.pause()
        self._back_ns, self._back_wall_ns = self.sim.now_ns, time.monotonic_ns()
        self.is_backwards = True

    def go_like(self, other: Player) -> None:
        """Go on as another player does."""
        if other.is_backwards:
            self.go_back()
        elif not other.is_paused:
            self.go_on()

    # ---- another time ----

    def seek(self, time_ns: int) -> bool:
        """Go to a time [ns]; from any thread, which waits for it.

        Returns:
            Whether this player can show it; else nothing has changed.
        """
        if not self.span.begin_ns <= time_ns <= self.span.end_ns:
            return False
        future = self.gate.ask(lambda: self._seek(time_ns))
        while True:
            try:
                return future.result(IDLE_S)
            except NotYet:
                # The thread that moves the world has ended just now.
                self.gate.serve()

    def _seek(self, time_ns: int) -> bool:
        if not self.replay.go_to(time_ns):
            return False
        if self.is_backwards:
            self.go_back()
        elif self.gate.is_paused:
            self.gate.pause(time_ns)
        else:
            self.gate.set_speed(self.gate.speed, time_ns)
        return True

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
        if self.is_backwards:
            return self._move_back()
        now_ns, pace = self.sim.now_ns, self.gate.pace
        if now_ns >= self.span.end_ns:
            if pace.now_ns() > now_ns and not self._leave(self, now_ns):
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

    def _move_back(self) -> float:
        wall_ns = time.monotonic_ns()
        passed_ns = min(wall_ns - self._back_wall_ns, LAG_NS)
        speed = min(self.gate.speed or BACK_SPEED_MAX, BACK_SPEED_MAX)
        self._back_wall_ns = wall_ns
        self._back_ns -= round(passed_ns * speed)
        time_ns = self._back_ns if speed <= SMOOTH_BACK_SPEED else self._back_ns // CHECK_NS * CHECK_NS
        at_ns = max(time_ns, self.span.begin_ns)
        is_shown = at_ns == self.sim.now_ns or self.replay.go_to(at_ns)
        if (time_ns < at_ns or not is_shown) and not self._leave(self, time_ns if is_shown else at_ns):
            self.pause()
        return 2 * PERIOD_S
