"""The paths of robots, balls and cylinders, kept as they move; and who looks on while ticks are done."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import State
from kiks.units import TICK_NS


class Watcher(Protocol):
    """Who looks at a world after ticks of its own choice. It changes nothing, and asks the world for nothing."""

    def ticks_left(self, tick_count: int) -> int:
        """Return how many ticks may be done before the next look, at least one."""

    def look(self, state: State) -> None:
        """Look at the state, after ticks that are no more than were left; called between two looks, too."""


class Paths:
    """Poses of all robots and places of all balls and cylinders, after each period of whole ticks.

    Args:
        period_ticks: Ticks between two points.
        state: What is looked at; its present poses are the first point.
        points_max: Most points that are kept. When there are more, every second one is dropped, and from then on half
            as many come; None for all.
    """

    def __init__(self, period_ticks: int, state: State, points_max: int | None = None) -> None:
        self._period_ticks = period_ticks
        self._points_max = points_max
        self._ticks: list[int] = []
        self._robots: list[NDArray[np.float64]] = []
        self._bodies: list[NDArray[np.float64]] = []
        self._note(state)

    def ticks_left(self, tick_count: int) -> int:
        """Return how many ticks may be done before the next point is due."""
        return self._period_ticks - tick_count % self._period_ticks

    def look(self, state: State) -> None:
        """Keep the poses if a point is due."""
        if state.tick_count % self._period_ticks == 0:
            self._note(state)

    def _note(self, state: State) -> None:
        robots: Any = state.robots[0]
        bodies: Any = state.bodies[0]
        self._ticks.append(state.tick_count)
        self._robots.append(np.array([robots["x_mm"], robots["y_mm"], robots["heading_rad"]]))
        self._bodies.append(np.array([bodies["number"], bodies["x_mm"], bodies["y_mm"]]))
        if self._points_max is not None and len(self._ticks) > self._points_max:
            self._thin_out()

    def _thin_out(self) -> None:
        """Drop every second point; the first stays, at whatever tick it was."""
        self._period_ticks *= 2
        kept = [k for k, ticks in enumerate(self._ticks) if k == 0 or ticks % self._period_ticks == 0]
        self._ticks = [self._ticks[k] for k in kept]
        self._robots = [self._robots[k] for k in kept]
        self._bodies = [self._bodies[k] for k in kept]

    def array(self) -> NDArray[np.float64]:
        """Return all points, float64 [robot, point, 4]: time_s, x_mm, y_mm, heading_rad; NaN before a robot came."""
        poses = np.full((self._robots[-1].shape[1], len(self._robots), 3), np.nan)
        for point, there in enumerate(self._robots):
            poses[: there.shape[1], point] = there.T
        times_s = np.array([ticks * TICK_NS * 1e-9 for ticks in self._ticks])
        return np.concatenate([np.broadcast_to(times_s[None, :, None], (*poses.shape[:2], 1)), poses], axis=2)

    def of_bodies(self) -> dict[int, list[tuple[float, float]]]:
        """Return the places of each ball and cylinder that there was, by its number: x_mm, y_mm."""
        places: dict[int, list[tuple[float, float]]] = {}
        for there in self._bodies:
            for number, x_mm, y_mm in there.T.tolist():
                places.setdefault(int(number), []).append((x_mm, y_mm))
        return places
