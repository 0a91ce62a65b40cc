"""The monitor element: it shows the readings of one robot live, and reports clicks on them.

Its data arrive over the page's own WebSocket, not through this element; see `web/monitor.js`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from nicegui.events import GenericEventArguments

from kiks.desk.panels.widgets import FeedElement

_WEB = Path(__file__).parents[1] / "web"


@dataclass(frozen=True)
class Reading:
    """A reading of a robot.

    Attributes:
        sensor: Index of the sensor, from 0.
        kind: 'proximity' or 'ambient'.
    """

    sensor: int
    kind: Literal["proximity", "ambient"]


class MonitorView(FeedElement, component=_WEB / "monitor_view.js", esm={"kiks-desk": str(_WEB)}):
    """One robot from above with its readings at their sensors, curves of the last seconds, numbers, and its camera.

    Args:
        feed: Address of the WebSocket that frames come from, seen from the page; all its components share one.
        on_explain: Called with a reading that was clicked.
        on_seen: Called with whether the element is visible.
    """

    def __init__(
        self,
        feed: str = "/desk/feed",
        *,
        on_explain: Callable[[Reading], Any] | None = None,
        on_seen: Callable[[bool], Any] | None = None,
    ) -> None:
        super().__init__(feed, _WEB / "monitor_view.css")
        self.set_robot(0)
        if on_explain is not None:
            self.on("explain", lambda event: on_explain(_reading(event)))
        if on_seen is not None:
            self.on("seen", lambda event: on_seen(bool(event.args)))

    def set_robot(self, index: int) -> None:
        """Show another robot, by its index from 0."""
        self._props["robot"] = index
        self.update()

    def set_chosen(self, reading: Reading | None) -> None:
        """Mark the reading that is explained; None marks none."""
        self._props["chosen"] = None if reading is None else {"sensor": reading.sensor, "which": reading.kind}
        self.update()


def _reading(event: GenericEventArguments) -> Reading:
    return Reading(int(event.args["sensor"]), "ambient" if event.args["which"] == "ambient" else "proximity")
