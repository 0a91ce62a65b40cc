"""The gate: pauses or slows simulated time while a person watches, and lets other threads act between two events.

A person may pause a world, slow it down, or drag a robot, no matter what moves the world: a program in this process,
programs in others, a server, or nothing. None of that may change the run otherwise. All time passes in one place,
`EventLoop.advance_to`, with the simulation's lock held. While the gate is up, the loop asks `admit` how far it may go.
Waiting there releases the lock, so other threads may read the world. Their requests are done in between, by the thread
that holds the lock.
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
from kiks.errors import HaltError
from kiks.units import NS_PER_S, TICK_NS

SLICE_NS = NS_PER_S // 50
"""Longest slice of real time, if the pace is bound to it [ns]."""

HELD_SLICE_NS = TICK_NS
"""Longest slice of simulated time while something is dragged [ns]."""

LAG_NS = NS_PER_S * 3 // 20
"""Largest lag that the world catches up [ns of real time]. If a program thinks for longer, or the computer is too slow,
the world skips the time instead. Longer than `UNTOLD_NS` of a session, which begins to catch up only then."""

CHECK_S = 0.05
"""Longest time between two checks of a waiting world [s]."""

Done = TypeVar("Done")


class Gate:
    """Decides how far simulated time may go.

    Args:
        lock: The lock of the simulation.
        speed: Simulated seconds per real second; None for no limit.
        wall_ns: A monotonic clock [ns]; tests pass their own.

    Attributes:
        is_up: Whether the event loop must call `admit`. False while time passes freely: then the gate costs nothing.
        pace: The speed of time, and whether it stands still.

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
        self, lock: threading.RLock, *, speed: float | None = 1.0, wall_ns: Callable[[], int] = time.monotonic_ns
    ) -> None:
        self._changed = threading.Condition(lock)
        self._wall_ns = wall_ns
        self._held_ns = 0
        self._requests: deque[tuple[Callable[[], Any], Future[Any]]] = deque()
        self._keepers: list[Callable[[], None]] = []
        self._is_closed = self._is_halting = False
        self.pace = Pace(speed, wall_ns=wall_ns)
        self._update_is_up()

    # ---- for watchers; at any time, from any thread ----

    @property
    def is_paused(self) -> bool:
        """Whether time stands still."""
        return self.pace.is_held

    @property
    def speed(self) -> float | None:
        """Simulated seconds per real second; None for no limit."""
        return self.pace.speed

    def set_speed(self, speed: float | None, now_ns: int) -> None:
        """Change the speed from a simulated time [ns] on."""
        self.pace.set_speed(speed, now_ns)
        self._update_is_up()

    def pause(self, now_ns: int) -> None:
        """Stop time at a simulated time [ns]."""
        self.pace.hold(now_ns)
        self._update_is_up()

    def go_on(self) -> None:
        """Let time pass again."""
        self.pace.go_on()
        self._update_is_up()

    def step(self, seconds: float) -> None:
        """Let some time pass [s], then stop again."""
        self.pace.hold(self.pace.now_ns() + round(seconds * NS_PER_S))
        self._update_is_up()

    def ask(self, act: Callable[[], Done]) -> Future[Done]:
        """Call a function as soon as possible between two events; return its future result."""
        future: Future[Done] = Future()
        self._requests.append((act, future))
        self.serve()
        return future

    def serve(self) -> None:
        """Do the requests, unless a thread moves the world at this moment, which does them."""
        if not self._requests:
            return
        self.is_up = True
        if self._changed.acquire(blocking=False):
            try:
                self._do_requests()
            finally:
                self._changed.release()

    def keep(self, keeper: Callable[[], None]) -> None:
        """Call a function after each slice of time, until `leave`; this is how a drag holds a robot."""
        self._keepers.append(keeper)
        self._update_is_up()

    def leave(self, keeper: Callable[[], None]) -> None:
        """Stop calling a function that `keep` has added."""
        if keeper in self._keepers:
            self._keepers.remove(keeper)
        self._update_is_up()

    def halt(self) -> None:
        """Raise an error in the thread that lets time pass, or else in the first one that does."""
        self._is_halting = True
        self._update_is_up()

    def close(self) -> None:
        """Let time pass freely from now on, and do the requests."""
        self._is_closed = True
        self._keepers.clear()
        self._update_is_up()
        self.serve()

    def wall_ns(self) -> int:
        """Return real time without the time that was spent waiting here [ns]."""
        return self._wall_ns() - self._held_ns

    def patience(self, seconds: float) -> Patience:
        """Return a patience that does not run out while time stands still."""
        return Patience(seconds, wall_ns=self.wall_ns)

    # ---- for the simulation ----

    def admit(self, now_ns: int, until_ns: int) -> int:
        """Wait until time may pass; return the time up to which it may [ns]: `until_ns`, or less, and then ask again.

        The caller holds the lock; waiting releases it.

        Raises:
            HaltError: If `halt` was called.
        """
        with self._changed:
            while True:
                self._do_requests()
                if self._is_halting:
                    self._is_halting = False
                    self._update_is_up()
                    raise HaltError("Halt was pressed on the desk: the program and the robots are stopped.")
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
                self._wait(min(pace.wall_wait_s(most_ns), CHECK_S))

    # ---- inside ----

    def _update_is_up(self) -> None:
        self.is_up = not self._is_closed and bool(
            self._requests or self._keepers or self._is_halting or self.pace.is_held or self.pace.speed is not None
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
        self._update_is_up()
