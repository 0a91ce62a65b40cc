"""The paths of robots, balls and cylinders, recorded while ticks are done."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import State
from kiks.units import TICK_NS


class Watcher(Protocol):
    """Reads the state after ticks of its own choice, and changes nothing.

    Attributes:
        from_tick: If the ticks happen to stop from this one on, it looks.
        due_tick: Here they stop at the latest, so that it can.
    """

    from_tick: int
    due_tick: int

    def look(self, state: State) -> None:
        """Read the state, and choose the next two ticks, later than the present one."""


class _Point(NamedTuple):
    """Places after a number of ticks: rows x_mm, y_mm, heading_rad of robots, and number, x_mm, y_mm of bodies."""

    tick_count: int
    poses: NDArray[np.float64]
    bodies: NDArray[np.float64]


class Paths:
    """Poses of all robots and places of all balls and cylinders, after each period of whole ticks.

    Args:
        period_ticks: Ticks between two points.
        state: The state; its present poses are the first point.
        points_max: Most points that are kept. When there are more, every second one is dropped, and half as many are
            added from then on. None: no limit.

    Attributes:
        from_tick: See `Watcher`.
        due_tick: The same tick.
    """

    def __init__(self, period_ticks: int, state: State, points_max: int | None = None) -> None:
        self._period_ticks = period_ticks
        self._points_max = points_max
        self._points: list[_Point] = []
        self.look(state)

    def look(self, state: State) -> None:
        """Keep the poses."""
        robots: Any = state.robots[0]
        bodies: Any = state.bodies[0]
        poses = np.array([robots["x_mm"], robots["y_mm"], robots["heading_rad"]])
        places = np.array([bodies["number"], bodies["x_mm"], bodies["y_mm"]])
        # In one step, as Ctrl-C may come anywhere, and paths are read after it.
        self._points.append(_Point(state.tick_count, poses, places))
        if self._points_max is not None and len(self._points) > self._points_max:
            self._thin_out()
        self.from_tick = self.due_tick = (state.tick_count // self._period_ticks + 1) * self._period_ticks

    def _thin_out(self) -> None:
        """Drop every second point; the first one stays."""
        # Points stay at equal times, so that paths of different robots can be compared.
        period_ticks = 2 * self._period_ticks
        first, *others = self._points
        self._points = [first, *(each for each in others if each.tick_count % period_ticks == 0)]
        self._period_ticks = period_ticks

    def array(self) -> NDArray[np.float64]:
        """Return all points, float64 [robot, point, 4]: time_s, x_mm, y_mm, heading_rad; NaN before a robot came."""
        paths = np.full((self._points[-1].poses.shape[1], len(self._points), 4), np.nan)
        for index, point in enumerate(self._points):
            paths[:, index, 0] = point.tick_count * TICK_NS * 1e-9
            paths[: point.poses.shape[1], index, 1:] = point.poses.T
        return paths

    def of_bodies(self) -> dict[int, list[tuple[float, float]]]:
        """Return the places of each ball and cylinder, by its number: x_mm, y_mm."""
        places: dict[int, list[tuple[float, float]]] = {}
        for point in self._points:
            for number, x_mm, y_mm in point.bodies.T.tolist():
                places.setdefault(int(number), []).append((x_mm, y_mm))
        return places
