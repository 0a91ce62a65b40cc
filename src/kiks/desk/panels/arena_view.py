"""The arena element: it shows robots, walls and light from above or in 3-D, and people can drag things in it.

Its data arrive over the page's own WebSocket, not through this element; see `web/stage.js`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import nicegui
from nicegui.events import GenericEventArguments

from kiks.desk.panels.widgets import FeedElement
from kiks.errors import ParameterError, shown

__all__ = ["SHOWN", "ArenaView", "Pick", "Stroke", "Tool"]

View = Literal["top", "solid", "both"]
VIEWS = ("top", "solid", "both")

SHOWN = {
    "rays": True,
    "light": True,
    "camera": True,
    "trails": False,
    "contacts": True,
    "grid": True,
    "ruler": True,
    "names": True,
}
"""The layers of the views, and whether each is visible at first."""

_WEB = Path(__file__).parents[1] / "web"
_THREE = Path(nicegui.__file__).parent / "elements" / "scene" / "dist"


@dataclass(frozen=True)
class Pick:
    """The thing that a click hit.

    Attributes:
        what: 'robot', 'sensor' (of the selected robot), 'body', 'lamp' or 'floor'.
        index: Index of the thing in frames, from 0; -1 for the floor.
        sensor: Index of the sensor, from 0; -1 for any other thing.
        x_mm: Place of the click.
        y_mm: Place of the click.
    """

    what: str
    index: int
    sensor: int
    x_mm: float
    y_mm: float


@dataclass(frozen=True)
class Stroke:
    """A stroke of a tool.

    Attributes:
        kind: 'rectangle' or 'line' (two points each), 'freehand', or 'point' (one point).
        points: Places in the arena [mm], snapped to the grid.
    """

    kind: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Tool:
    """The tool of the pointer.

    Attributes:
        kind: 'hand' (drag and pick) or the kind of its strokes.
        brush_mm: Width of a line or freehand stroke, size of a point.
        snap_mm: Period of the grid to which points snap; 0 for none.
        label: Text beside the pointer.
    """

    kind: Literal["hand", "rectangle", "line", "freehand", "point"] = "hand"
    brush_mm: float = 10.0
    snap_mm: float = 0.0
    label: str = ""


class ArenaView(
    FeedElement,
    component=_WEB / "arena_view.js",
    esm={"kiks-desk": str(_WEB), "nicegui-scene": str(_THREE)},
):
    """The arena from above, in 3-D, or both; it fills its parent element.

    Args:
        feed: Address of the WebSocket that frames come from, seen from the page; all its components share one.
        view: The first view.
        on_pick: Called with each click that is not a drag.
        on_draw: Called with each stroke of a tool.
        on_remove: Called with the place of a thing that a person removes [mm].
    """

    def __init__(
        self,
        feed: str = "/desk/feed",
        *,
        view: View = "top",
        on_pick: Callable[[Pick], Any] | None = None,
        on_draw: Callable[[Stroke], Any] | None = None,
        on_remove: Callable[[float, float], Any] | None = None,
    ) -> None:
        super().__init__(feed, _WEB / "arena_view.css")
        self._props["show"] = dict(SHOWN)
        self.set_view(view)
        self.set_tool(Tool())
        self.set_follow(-1)
        self.set_dark(None)
        if on_pick is not None:
            self.on("pick", lambda event: on_pick(_pick(event)))
        if on_draw is not None:
            self.on("draw", lambda event: on_draw(_stroke(event)))
        if on_remove is not None:
            self.on("remove", lambda event: on_remove(float(event.args["x_mm"]), float(event.args["y_mm"])))

    def set_view(self, view: View) -> None:
        """Show the arena from above ('top'), in 3-D ('solid') or 'both'."""
        if view not in VIEWS:
            raise ParameterError(f"view must be one of {list(VIEWS)}, but it was {shown(view)}.")
        self._props["view"] = view
        self.update()

    def set_show(self, shown: Mapping[str, bool]) -> None:
        """Show or hide layers; other layers stay as they are."""
        for name in shown:
            if name not in SHOWN:
                raise ParameterError(f"a layer must be one of {list(SHOWN)}, but it was {name!r}.")
        self._props["show"] = {**self._props["show"], **shown}
        self.update()

    def set_tool(self, tool: Tool) -> None:
        """Give the pointer a tool."""
        self._props["tool"] = asdict(tool)
        self.update()

    def set_follow(self, robot: int) -> None:
        """Keep a robot in the middle, by its index from 0; -1 for no robot."""
        self._props["follow"] = robot
        self.update()

    def set_dark(self, is_dark: bool | None) -> None:
        """Use dark or light colours; None follows the page."""
        self._props["dark"] = is_dark
        self.update()

    def fit(self) -> None:
        """Show all of the arena."""
        self.run_method("fit")

    def clear_trails(self) -> None:
        """Delete the trails of the robots."""
        self.run_method("clear_trails")

    def select(self, what: Literal["robot", "body", "lamp"], index: int) -> None:
        """Select a thing as a click does, by its index from 0; -1 deselects."""
        self.run_method("select", what, index)


def _pick(event: GenericEventArguments) -> Pick:
    args = event.args
    return Pick(str(args["what"]), int(args["index"]), int(args["sensor"]), float(args["x_mm"]), float(args["y_mm"]))


def _stroke(event: GenericEventArguments) -> Stroke:
    return Stroke(str(event.args["kind"]), tuple((float(x), float(y)) for x, y in event.args["points"]))
