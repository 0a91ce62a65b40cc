"""Pace: keeps simulated time at a multiple of real time by waiting, so the run stays the same."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable

from kiks.errors import ParameterError, shown
from kiks.units import NS_PER_S, s_from_ns

SPEED_MIN = 1e-3
SPEED_MAX = 1e3

LAG_LIMIT_NS = NS_PER_S // 4
"""Lag of the simulation at which a warning is logged [ns of real time]; a busy computer often lags for a moment."""

ALWAYS_NS = 2**62
"""Later than any simulated time [ns]."""

_log = logging.getLogger("kiks.serve")


class Pace:
    """Maps real time to the simulated time that is due.

    Args:
        speed: Simulated seconds per real second; None for no limit.
        wall_ns: A monotonic clock [ns]; tests pass their own.

    Attributes:
        speed: Simulated seconds per real second; `set_speed` changes it.
        is_held: Whether simulated time stands still.

    Example:
        >>> wall = [5_000]
        >>> pace = Pace(2.0, wall_ns=lambda: wall[0])
        >>> pace.start(100)
        >>> wall[0] += 1_000
        >>> pace.now_ns()
        2100
        >>> round(pace.wall_wait_s(4_100) * 1e9)
        1000
        >>> pace.hold(2_100)
        >>> wall[0] += 1_000
        >>> pace.now_ns()
        2100
    """

    def __init__(self, speed: float | None = 1.0, *, wall_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.speed = _check_speed(speed)
        self.is_held = False
        self._wall_ns = wall_ns
        self._has_warned = False
        self.start(0)

    def start(self, time_ns: int) -> None:
        """Bind a simulated time [ns] to the present moment."""
        self._wall_start_ns = self._wall_ns()
        self._start_ns = time_ns

    def set_speed(self, speed: float | None, time_ns: int) -> None:
        """Change the speed from a simulated time [ns] on."""
        self.speed = _check_speed(speed)
        self.start(time_ns)

    def hold(self, time_ns: int) -> None:
        """Stop simulated time at `time_ns`, until `go_on`."""
        self.is_held = True
        self.start(time_ns)

    def go_on(self) -> None:
        """Let simulated time pass again."""
        self.is_held = False
        self.start(self._start_ns)

    def now_ns(self) -> int:
        """Return the simulated time that is due now [ns]."""
        if self.is_held:
            return self._start_ns
        if self.speed is None:
            return ALWAYS_NS
        return self._start_ns + round((self._wall_ns() - self._wall_start_ns) * self.speed)

    def wall_wait_s(self, time_ns: int) -> float:
        """Return the real time until a simulated time [s]; 0 if that has passed."""
        left_s = s_from_ns(time_ns - self.now_ns())
        if left_s <= 0 or self.speed is None:
            return 0.0 if left_s <= 0 else math.inf
        return math.inf if self.is_held else left_s / self.speed

    def report(self, time_ns: int) -> None:
        """Compare the simulation's time [ns] with the due time; log a large lag, once."""
        if self._has_warned or self.speed is None:
            return
        lag_ns = (self.now_ns() - time_ns) / self.speed
        if lag_ns > LAG_LIMIT_NS:
            self._has_warned = True
            _log.warning(
                "the simulation must keep up with %g times real time, but it is %.1f s behind. Ask for a lower speed; "
                "the robots do the same, only later.",
                self.speed,
                lag_ns / NS_PER_S,
            )


def _check_speed(speed: float | None) -> float | None:
    if speed is not None and not (
        isinstance(speed, int | float) and math.isfinite(speed) and SPEED_MIN <= speed <= SPEED_MAX
    ):
        raise ParameterError(
            f"speed must be a number from {SPEED_MIN:g} to {SPEED_MAX:g}, but it was {shown(speed)}. "
            "1 is real time; a program that waits for its replies runs at full speed with thinking 'none'."
        )
    return speed
