"""Pace: simulated time held to a multiple of real time by waiting, never by changing what happens."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable

from kiks.errors import ParameterError
from kiks.units import NS_PER_S, s_from_ns

SPEED_MIN = 1e-3
SPEED_MAX = 1e3

LAG_LIMIT_NS = NS_PER_S // 4
"""How far behind the simulation must be for a warning [ns of the wall clock]; a busy computer often is for a moment."""

_log = logging.getLogger("kiks.serve")


class Pace:
    """What simulated time it ought to be now.

    Args:
        speed: Simulated seconds in a real one.
        wall_ns: A clock that only goes forwards [ns]; a test hands in its own.

    Raises:
        ParameterError: If the speed is out of range.

    Example:
        >>> wall = [5_000]
        >>> pace = Pace(2.0, wall_ns=lambda: wall[0])
        >>> pace.start(100)
        >>> wall[0] += 1_000
        >>> pace.now_ns()
        2100
        >>> round(pace.wall_wait_s(4_100) * 1e9)
        1000
    """

    def __init__(self, speed: float = 1.0, *, wall_ns: Callable[[], int] = time.monotonic_ns) -> None:
        if not (isinstance(speed, int | float) and math.isfinite(speed) and SPEED_MIN <= speed <= SPEED_MAX):
            raise ParameterError(
                f"speed must be a number from {SPEED_MIN:g} to {SPEED_MAX:g}, but it was {speed!r}. "
                "1 is real time; a program that waits for its replies runs as fast as it can with thinking 'none'."
            )
        self.speed = speed
        self._wall_ns = wall_ns
        self._has_warned = False
        self.start(0)

    def start(self, time_ns: int) -> None:
        """Let simulated time be `time_ns` at this moment."""
        self._wall_start_ns = self._wall_ns()
        self._start_ns = time_ns

    def now_ns(self) -> int:
        """Return the simulated time that the wall clock stands for [ns]."""
        return self._start_ns + round((self._wall_ns() - self._wall_start_ns) * self.speed)

    def wall_wait_s(self, time_ns: int) -> float:
        """Return how long it really takes until a simulated time [s]; 0 if it is over."""
        return max(s_from_ns(time_ns - self.now_ns()) / self.speed, 0.0)

    def report(self, time_ns: int) -> None:
        """Note how far the simulation has got [ns]; say so, once, if that is far behind."""
        lag_ns = (self.now_ns() - time_ns) / self.speed
        if lag_ns > LAG_LIMIT_NS and not self._has_warned:
            self._has_warned = True
            _log.warning(
                "the simulation must keep up with %g times real time, but it is %.1f s behind. Ask for a lower speed; "
                "the robots do the same as ever, only later.",
                self.speed,
                lag_ns / NS_PER_S,
            )
