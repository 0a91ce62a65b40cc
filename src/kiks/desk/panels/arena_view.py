"""The arena element: it shows robots, walls and light from above or in 3-D, and people can drag things in it.

Its data arrive over the page's own WebSocket, not through this element; see `web/stage.js`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import nicegui

from kiks.desk.panels.shortcuts import ARENA_KEYS
from kiks.desk.panels.widgets import WEB, FeedElement
from kiks.model.walls import Wall

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


Place = tuple[float, float]
"""x and y in the arena [mm]."""

Points = Sequence[Place]
"""Places of a stroke in the arena [mm], snapped to the grid."""


class ArenaView(
    FeedElement, component=WEB / "arena_view.js", esm={"kiks-desk": str(WEB), "nicegui-scene": str(_THREE)}
):
    """The arena from above, in 3-D, or both; it fills its parent element.

    Its properties: `view` is 'top', 'solid' (3-D) or 'both', and `follow` the index from 0 of the robot that stays in
    the middle, -1 for none. Its methods in the browser: `fit` shows all of the arena, `clear_trails` deletes trails,
    `snapshot` downloads a picture of what is seen.

    Args:
        feed: Address of the WebSocket that frames come from, seen from the page; all its components share one.
        on_pick: Called with each click that is not a drag: with 'robot', 'sensor' (of the selected robot), 'body',
            'lamp' or 'floor', the index of the thing, and that of the sensor, both from 0; -1 for none; and the place.
        on_edit: Called with each double click and with Enter, in the same way: a person wants to set properties.
        on_draw: Called with each stroke of a tool: its kind and points.
        on_remove: Called with the place of a thing that a person removes [mm].
    """

    def __init__(
        self,
        feed: str,
        *,
        on_pick: Callable[[str, int, int, Place], Any],
        on_edit: Callable[[str, int, Place], Any],
        on_draw: Callable[[str, Points], Any],
        on_remove: Callable[[float, float], Any],
    ) -> None:
        super().__init__(feed, "arena_view.css")
        self._layers = {name: is_shown for name, (_, is_shown) in LAYERS.items()}
        self.change(show=self._layers, view="top", follow=-1, keys=ARENA_KEYS)
        self.set_tool("hand")
        self.on("pick", lambda e: on_pick(*_thing(e.args), int(e.args["sensor"]), _place(e.args)))
        self.on("edit", lambda e: on_edit(*_thing(e.args), _place(e.args)))
        self.on("draw", lambda e: on_draw(str(e.args["kind"]), [(float(x), float(y)) for x, y in e.args["points"]]))
        self.on("remove", lambda e: on_remove(float(e.args["x_mm"]), float(e.args["y_mm"])))

    def show_layer(self, name: str, is_shown: bool) -> None:
        """Show or hide a layer."""
        self._layers = {**self._layers, name: is_shown}
        self.change(show=self._layers)

    def show_wall(self, wall: Wall | None) -> None:
        """Mark a wall with a shape, which a person has selected; None for none."""
        stroke: dict[str, Any] | None = None
        if wall is not None and wall.box_mm is not None:
            stroke = {"kind": "rectangle", "points": wall.box_mm, "brush_mm": 1}
        elif wall is not None and wall.disc_mm is not None:
            (x_mm, y_mm), radius_mm = wall.disc_mm, wall.radius_mm or 0
            stroke = {"kind": "disc", "points": [(x_mm, y_mm), (x_mm + radius_mm, y_mm)], "brush_mm": 1}
        elif wall is not None:
            stroke = {"kind": "line", "points": wall.line_mm, "brush_mm": wall.thick_mm}
        self.change(wall=stroke)

    def set_tool(self, kind: str, *, brush_mm: float = 10.0, snap_mm: float = 0.0, label: str = "") -> None:
        """Give the pointer a tool.

        Args:
            kind: 'hand' (drag and pick), or the kind of its strokes: 'rectangle' or 'line' (two points each),
                'freehand', or 'point'.
            brush_mm: Width of a line or freehand stroke, size of a point.
            snap_mm: Period of the grid to which points snap; 0 for none.
            label: Text beside the pointer.
        """
        self.change(tool={"kind": kind, "brush_mm": brush_mm, "snap_mm": snap_mm, "label": label})


class ScoreBoard(FeedElement, component=WEB / "board.js", esm={"kiks-desk": str(WEB)}):
    """The score above the arena; its method `enter` in the browser begins the hall view for a projector."""


def _thing(args: dict[str, Any]) -> tuple[str, int]:
    return str(args["what"]), int(args["index"])


def _place(args: dict[str, Any]) -> Place:
    return float(args["x_mm"]), float(args["y_mm"])
