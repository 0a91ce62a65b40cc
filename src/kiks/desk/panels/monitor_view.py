"""One robot's monitor on a page: an element that shows its readings live, and tells which one somebody asks about.

What it draws comes over the page's own WebSocket, not through this element; see `web/monitor.js`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

__all__ = ["Asked", "MonitorView", "Which"]

Which = Literal["proximity", "ambient"]

_WEB = Path(__file__).parents[1] / "web"


@dataclass(frozen=True)
class Asked:
    """A reading that somebody asks about.

    Attributes:
        sensor: Index of the sensor, from 0.
        which: 'proximity' or 'ambient'.
    """

    sensor: int
    which: Which


class MonitorView(Element, component=_WEB / "monitor_view.js", esm={"kiks-desk": str(_WEB)}):
    """One robot from above with its readings at their sensors, curves of the last seconds, numbers, and its camera.

    Args:
        feed: Path of the WebSocket that frames come from; all components of a page share one.
        on_explain: Told of a reading that was clicked.
        on_seen: Told whether it can be seen.
    """

    def __init__(
        self,
        feed: str = "/desk/feed",
        *,
        on_explain: Callable[[Asked], Any] | None = None,
        on_seen: Callable[[bool], Any] | None = None,
    ) -> None:
        super().__init__()
        ui.add_css(_WEB / "monitor_view.css")
        self._props["feed"] = feed
        self.set_robot(0)
        if on_explain is not None:
            self.on("explain", lambda event: on_explain(_asked(event)))
        if on_seen is not None:
            self.on("seen", lambda event: on_seen(bool(event.args)))

    def set_robot(self, index: int) -> None:
        """Show another robot, by its index from 0."""
        self._props["robot"] = index
        self.update()

    def set_chosen(self, asked: Asked | None) -> None:
        """Mark a reading as the one that is explained, or none."""
        self._props["chosen"] = None if asked is None else {"sensor": asked.sensor, "which": asked.which}
        self.update()


def _asked(event: GenericEventArguments) -> Asked:
    """Return what the browser said of a click."""
    return Asked(int(event.args["sensor"]), "ambient" if event.args["which"] == "ambient" else "proximity")
