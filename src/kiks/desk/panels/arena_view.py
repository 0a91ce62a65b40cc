"""The arena element: it shows robots, walls and light from above or in 3-D, and people can drag things in it.

Its data arrive over the page's own WebSocket, not through this element; see `web/stage.js`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import nicegui
from nicegui.events import GenericEventArguments

from kiks.desk.panels.widgets import WEB, FeedElement

LAYERS = {
    "rays": ("Rays of the proximity sensors, coloured by their readings", True),
    "light": ("Light of the lamps on the floor", True),
    "camera": ("Camera pictures beside their robots", True),
    "trails": ("Trails of robots", False),
    "contacts": ("Contacts of robots", True),
    "grid": ("Grid of 10 and 100 mm", True),
    "ruler": ("Millimetres along the edges", True),
    "names": ("Names of the robots", True),
}
"""The layers of the views: what each shows, and whether it is visible at first."""

_THREE = Path(nicegui.__file__).parent / "elements" / "scene" / "dist"


@dataclass(frozen=True)
class Pick:
    """The thing that a click hit.

    Attributes:
        what: 'robot', 'sensor' (of the selected robot), 'body', 'lamp' or 'floor'.
        index: Index of the thing in frames, from 0; -1 for the floor.
        sensor: Index of the sensor, from 0; -1 for any other thing.
    """

    what: str
    index: int
    sensor: int


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
    FeedElement, component=WEB / "arena_view.js", esm={"kiks-desk": str(WEB), "nicegui-scene": str(_THREE)}
):
    """The arena from above, in 3-D, or both; it fills its parent element.

    Its properties: `view` is 'top', 'solid' (3-D) or 'both', and `follow` the index from 0 of the robot that stays in
    the middle, -1 for none. Its methods in the browser: `fit` shows all of the arena, `clear_trails` deletes trails.

    Args:
        feed: Address of the WebSocket that frames come from, seen from the page; all its components share one.
        on_pick: Called with each click that is not a drag.
        on_draw: Called with each stroke of a tool.
        on_remove: Called with the place of a thing that a person removes [mm].
    """

    def __init__(
        self,
        feed: str,
        *,
        on_pick: Callable[[Pick], Any],
        on_draw: Callable[[Stroke], Any],
        on_remove: Callable[[float, float], Any],
    ) -> None:
        super().__init__(feed, "arena_view.css")
        self._layers = {name: is_shown for name, (_, is_shown) in LAYERS.items()}
        self.change(show=self._layers, view="top", follow=-1)
        self.set_tool(Tool())
        self.on("pick", lambda event: on_pick(_pick(event)))
        self.on("draw", lambda event: on_draw(_stroke(event)))
        self.on("remove", lambda event: on_remove(float(event.args["x_mm"]), float(event.args["y_mm"])))

    def show_layer(self, name: str, is_shown: bool) -> None:
        """Show or hide a layer."""
        self._layers = {**self._layers, name: is_shown}
        self.change(show=self._layers)

    def set_tool(self, tool: Tool) -> None:
        """Give the pointer a tool."""
        self.change(tool=asdict(tool))


def _pick(event: GenericEventArguments) -> Pick:
    return Pick(str(event.args["what"]), int(event.args["index"]), int(event.args["sensor"]))


def _stroke(event: GenericEventArguments) -> Stroke:
    return Stroke(str(event.args["kind"]), tuple((float(x), float(y)) for x, y in event.args["points"]))
