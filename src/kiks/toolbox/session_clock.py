"""The clock of a program in Octave or MATLAB: the robot's while a port is open, the computer's at other times.

A program measures its loops by `tic` and `toc`, and simulated time passes faster than real time or more slowly. So the
functions in `matlab/clocks` ask this clock. It never jumps: it goes on from where it was when its source changes.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol

NS_PER_US = 1000


class Timed(Protocol):
    """What a clock can follow."""

    @property
    def now_ns(self) -> int:
        """Its time [ns]."""


class SessionClock:
    """A clock with a source that can change.

    Args:
        wall_ns: The computer's clock [ns]; tests pass their own.
        date_ns: What it shows at the start [ns since 1970]; None is the present.

    Example:
        >>> wall = [7_000]
        >>> clock = SessionClock(wall_ns=lambda: wall[0], date_ns=0)
        >>> wall[0] += 5_000
        >>> clock.now_us()
        5
    """

    def __init__(self, *, wall_ns: Callable[[], int] = time.monotonic_ns, date_ns: int | None = None) -> None:
        self._wall_ns = wall_ns
        self._followed: Timed | None = None
        self._began_ns = wall_ns()
        # In whole microseconds, so that a difference does not depend on the date.
        self._shown_us = (time.time_ns() if date_ns is None else date_ns) // NS_PER_US
        self._tic_us: int | None = None

    def follow(self, followed: Timed | None) -> None:
        """Follow another clock from now on; None is the computer's."""
        if followed is not self._followed:
            self._shown_us = self.now_us()
            self._followed = followed
            self._began_ns = self._source_ns()

    def now_us(self) -> int:
        """Return the time [us since 1970]."""
        return self._shown_us + (self._source_ns() - self._began_ns) // NS_PER_US

    def tic(self, ago_us: int = 0) -> None:
        """Begin to measure, or note that the program has begun some time ago [us]."""
        self._tic_us = self.now_us() - ago_us

    def toc_us(self) -> int | None:
        """Return the time since `tic` [us]; None if there was none."""
        return None if self._tic_us is None else self.now_us() - self._tic_us

    def _source_ns(self) -> int:
        return self._wall_ns() if self._followed is None else self._followed.now_ns
