"""The paths of robots, kept as they drive."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import State
from kiks.units import TICK_NS


class Paths:
    """Poses of all robots, one after each period of whole ticks.

    Args:
        period_ticks: Ticks between two points.
        state: What is looked at; its present poses are the first point.
    """

    def __init__(self, period_ticks: int, state: State) -> None:
        self._period_ticks = period_ticks
        self._points: list[NDArray[np.float64]] = []
        self._times_s: list[float] = []
        self._note(state)

    def ticks_left(self, tick_count: int) -> int:
        """Return how many ticks may be done before the next point is due."""
        return self._period_ticks - tick_count % self._period_ticks

    def look(self, state: State) -> None:
        """Keep the poses if a point is due."""
        if state.tick_count % self._period_ticks == 0:
            self._note(state)

    def _note(self, state: State) -> None:
        self._times_s.append(state.tick_count * TICK_NS * 1e-9)
        robots: Any = state.robots[0]
        self._points.append(np.array([robots["x_mm"], robots["y_mm"], robots["heading_rad"]]))

    def array(self) -> NDArray[np.float64]:
        """Return all points, float64 [robot, point, 4]: time_s, x_mm, y_mm, heading_rad; NaN before a robot came."""
        poses = np.full((self._points[-1].shape[1], len(self._points), 3), np.nan)
        for point, there in enumerate(self._points):
            poses[: there.shape[1], point] = there.T
        times_s = np.broadcast_to(np.array(self._times_s)[None, :, None], (*poses.shape[:2], 1))
        return np.concatenate([times_s, poses], axis=2)
