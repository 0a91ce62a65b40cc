"""The clock on a page: simulated time and how fast it passes. What it shows comes over the page's own WebSocket."""

from __future__ import annotations

from pathlib import Path

from nicegui import ui
from nicegui.element import Element

_WEB = Path(__file__).parent / "web"


class ClockView(Element, component=_WEB / "clock_view.js", esm={"kiks-desk": str(_WEB)}):
    """The simulated clock, and how fast it goes.

    Args:
        feed: Path of the WebSocket that frames come from; all components of a page share one.
    """

    def __init__(self, feed: str = "/desk/feed") -> None:
        super().__init__()
        ui.add_css(_WEB / "clock_view.css")
        self._props["feed"] = feed
