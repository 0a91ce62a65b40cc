"""Patience: a timeout in real time that can be renewed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from kiks.errors import ParameterError, shown
from kiks.units import s_from_ns

LONGEST_S = 86_400.0


class Patience:
    """A timeout.

    Args:
        seconds: Its length [s of real time].
        wall_ns: A monotonic clock [ns]; tests pass their own.

    Example:
        >>> wall = [0]
        >>> patience = Patience(2.0, wall_ns=lambda: wall[0])
        >>> patience.left_s()
        2.0
        >>> wall[0] = 1_500_000_000
        >>> patience.left_s(), patience.left_s(share=0.5)
        (0.5, 0.0)
        >>> patience.renew()
        >>> patience.left_s()
        2.0
    """

    def __init__(self, seconds: float, *, wall_ns: Callable[[], int] = time.monotonic_ns) -> None:
        if not (isinstance(seconds, int | float) and math.isfinite(seconds) and 0 < seconds <= LONGEST_S):
            raise ParameterError(
                f"patience must be a number of seconds above 0 and up to {LONGEST_S:g}, but it was {shown(seconds)}. "
                "2 is usual; --when-silent wait waits for ever."
            )
        self.seconds = float(seconds)
        self._wall_ns = wall_ns
        self._begin_ns: int | None = None

    def left_s(self, *, share: float = 1.0) -> float:
        """Return the remaining time of it, or of a share of it [s]; the first call starts it."""
        now_ns = self._wall_ns()
        if self._begin_ns is None:
            self._begin_ns = now_ns
        return max(self.seconds * share - s_from_ns(now_ns - self._begin_ns), 0.0)

    def waited_s(self) -> float:
        """Return the time since its start [s]."""
        return 0.0 if self._begin_ns is None else s_from_ns(self._wall_ns() - self._begin_ns)

    def renew(self) -> None:
        """Reset it; the next call of `left_s` starts it again."""
        self._begin_ns = None
