"""The gate: where simulated time passes while somebody watches, who may hold it, let it through, or reach in.

Need: a person pauses a world, slows it down, or takes a robot in the hand, whoever moves that world: a program in this
process, programs in others, a server, or nobody. None of it may change what happens otherwise.
Method: all time passes in one place, `Simulation.advance_to`, with the simulation's lock held. While the gate is up it
asks `admit` how far it may go. PollCost there releases the lock, so that others may look; what they want done with the
world is done in between, by whoever holds the lock.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from kiks.clock.pace import Pace
from kiks.clock.patience import Patience
from kiks.units import NS_PER_S, TICK_NS

SLICE_NS = NS_PER_S // 50
"""Real time that passes in one go, if the pace is bound to it [ns]."""

HELD_SLICE_NS = TICK_NS
"""Simulated time that passes in one go while a hand holds something [ns]."""

LAG_NS = NS_PER_S // 10
"""How far the world may lie behind its pace and still catch up [ns of real time]: a program that thinks for longer, or
a computer that is too slow, makes it lose the time instead."""

LOOK_S = 0.05
"""How often a world that stands still looks whether it still must [s]."""

Done = TypeVar("Done")


class Gate:
    """Lets simulated time through.

    Args:
        lock: The simulation's.
        speed: Simulated seconds in a real one; None for as fast as possible.
        wall_ns: A clock that only goes forwards [ns]; a test hands in its own.

    Attributes:
        is_up: Whether `admit` has to be asked. False while time passes freely: then the gate costs nothing.
        pace: How fast time passes, and whether it stands still.

    Raises:
        ParameterError: If the speed is out of range.

    Example:
        >>> gate = Gate(threading.RLock(), speed=None)
        >>> gate.is_up
        False
        >>> gate.pause(5_000)
        >>> gate.step(1e-3)
        >>> gate.admit(5_000, 9_000_000)
        1005000
    """

    def __init__(
        self,
        lock: threading.RLock,
        *,
        speed: float | None = 1.0,
        wall_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._changed = threading.Condition(lock)
        self._wall_ns = wall_ns
        self._held_ns = 0
        self._requests: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._keepers: list[Callable[[], None]] = []
        self._is_closed = False
        self.pace = Pace(speed, wall_ns=wall_ns)
        self._settle()

    # ---- for those who watch; at any time, from any thread ----

    @property
    def is_paused(self) -> bool:
        """Whether time stands still."""
        return self.pace.is_held

    @property
    def speed(self) -> float | None:
        """Simulated seconds in a real one; None for as fast as possible."""
        return self.pace.speed

    def set_speed(self, speed: float | None, now_ns: int) -> None:
        """Let time pass at another speed from now on, a simulated time [ns].

        Raises:
            ParameterError: If it is out of range.
        """
        self.pace.set_speed(speed, now_ns)
        self._settle()

    def pause(self, now_ns: int) -> None:
        """Let time stand still, now, at a simulated time [ns]."""
        self.pace.hold(now_ns)
        self._settle()

    def go_on(self) -> None:
        """Let it pass again."""
        self.pace.go_on()
        self._settle()

    def step(self, seconds: float) -> None:
        """Let so much pass [s], and then stand still again."""
        self.pace.hold(self.pace.now_ns() + round(seconds * NS_PER_S))
        self._settle()

    def ask(self, act: Callable[[], Done]) -> Future[Done]:
        """Have something done with the world as soon as possible, between two events; `serve` if nobody moves it."""
        future: Future[Done] = Future()
        self._requests.append((act, future))
        self.serve()
        return future

    def serve(self) -> None:
        """Do what was asked for, unless somebody moves the world at this moment, who does it."""
        if not self._requests:
            return
        self.is_up = True
        if self._changed.acquire(blocking=False):
            try:
                self._do_requests()
            finally:
                self._changed.release()

    def keep(self, keeper: Callable[[], None]) -> None:
        """Have something done again after each slice of time, until `leave`: a hand that holds a robot in its place."""
        self._keepers.append(keeper)
        self._settle()

    def leave(self, keeper: Callable[[], None]) -> None:
        """Have it done no longer, if it is."""
        if keeper in self._keepers:
            self._keepers.remove(keeper)
        self._settle()

    def close(self) -> None:
        """Let everything through from now on, and do what was asked for."""
        self._is_closed = True
        self._keepers.clear()
        self._settle()
        self.serve()

    def wall_ns(self) -> int:
        """Return real time less what was spent waiting here [ns]."""
        return self._wall_ns() - self._held_ns

    def patience(self, seconds: float) -> Patience:
        """Return a patience that does not run out while time stands still.

        Raises:
            ParameterError: If the time is out of range.
        """
        return Patience(seconds, wall_ns=self.wall_ns)

    # ---- for the simulation ----

    def admit(self, now_ns: int, until_ns: int) -> int:
        """Wait until time may pass, and return how far it may go: `until_ns`, or less, and then ask again.

        The lock is held by the caller, and released while this waits.
        """
        with self._changed:
            while True:
                self._do_requests()
                if self._is_closed or now_ns >= until_ns:
                    return until_ns
                pace = self.pace
                most_ns = until_ns
                if self._keepers:
                    most_ns = min(most_ns, now_ns + HELD_SLICE_NS)
                if pace.speed is None and not pace.is_held:
                    return most_ns
                if pace.speed is not None:
                    most_ns = min(most_ns, now_ns + round(SLICE_NS * pace.speed))
                    if not pace.is_held and pace.now_ns() - now_ns > LAG_NS * pace.speed:
                        pace.start(most_ns)
                due_ns = pace.now_ns()
                if due_ns >= most_ns:
                    return most_ns
                if pace.is_held and due_ns > now_ns:
                    return due_ns
                self._wait(min(pace.wall_wait_s(most_ns), LOOK_S))

    # ---- inside ----

    def _settle(self) -> None:
        self.is_up = not self._is_closed and bool(
            self._requests or self._keepers or self.pace.is_held or self.pace.speed is not None
        )

    def _wait(self, seconds: float) -> None:
        begin_ns = self._wall_ns()
        self._sleep(seconds)
        self._held_ns += self._wall_ns() - begin_ns

    def _sleep(self, seconds: float) -> None:
        self._changed.wait(seconds)

    def _do_requests(self) -> None:
        for keeper in self._keepers[:]:
            keeper()
        while self._requests:
            act, future = self._requests.popleft()
            if not future.set_running_or_notify_cancel():
                continue
            try:
                result = act()
            except BaseException as error:
                future.set_exception(error)
            else:
                future.set_result(result)
        self._settle()
