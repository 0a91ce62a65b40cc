"""How fast simulated time passes, on average and at this moment."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

WINDOW_NS = 1_000_000_000
"""What 'at this moment' is [ns of real time]."""


class Speedometer:
    """Looks at both clocks again and again.

    Args:
        wall_ns: A clock that only goes forwards [ns]; a test hands in its own.

    Attributes:
        average: Simulated seconds in a real one since the beginning; pauses do not count.
        momentary: The same over the last second.

    Example:
        >>> wall = [0]
        >>> meter = Speedometer(wall_ns=lambda: wall[0])
        >>> meter.note(0, is_paused=False)
        >>> wall[0] = 1_000_000_000
        >>> meter.note(5_000_000_000, is_paused=False)
        >>> meter.average, meter.momentary
        (5.0, 5.0)
    """

    def __init__(self, *, wall_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.average = 0.0
        self.momentary = 0.0
        self._wall_ns = wall_ns
        self._last: tuple[int, int] | None = None
        self._running_ns = self._passed_ns = 0
        self._recent: deque[tuple[int, int]] = deque()

    def note(self, now_ns: int, *, is_paused: bool) -> None:
        """Look: simulated time is now at `now_ns` [ns]."""
        wall_ns = self._wall_ns()
        if self._last is not None:
            last_wall_ns, last_ns = self._last
            self._passed_ns += now_ns - last_ns
            # A step in a pause takes no time to speak of.
            self._running_ns += 0 if is_paused else wall_ns - last_wall_ns
        self._last = wall_ns, now_ns
        self._recent.append(self._last)
        while wall_ns - self._recent[0][0] > WINDOW_NS and len(self._recent) > 2:
            self._recent.popleft()
        first_wall_ns, first_ns = self._recent[0]
        self.momentary = (now_ns - first_ns) / (wall_ns - first_wall_ns) if wall_ns > first_wall_ns else 0.0
        self.average = self._passed_ns / self._running_ns if self._running_ns else 0.0
