"""The arena on a page: an element that shows robots, walls and light from above and in 3-D, and lets hands at them.

What it draws comes over the page's own WebSocket, not through this element; see `web/stage.js`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import nicegui
from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

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
"""What the views can show, and whether they do at first."""

_WEB = Path(__file__).parents[1] / "web"
_THREE = Path(nicegui.__file__).parent / "elements" / "scene" / "dist"


@dataclass(frozen=True)
class Pick:
    """What a click met.

    Attributes:
        what: 'robot', 'sensor' (of the chosen robot), 'body', 'lamp' or 'floor'.
        index: Which one, in the order of frames, from 0; -1 for the floor.
        sensor: Which sensor, from 0; -1 for anything else.
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
    """What was drawn with a tool.

    Attributes:
        kind: 'rectangle' and 'line' (two points each), 'freehand' or 'point' (one).
        points: Places on the arena [mm], snapped and within it.
    """

    kind: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Tool:
    """What the pointer does on the arena.

    Attributes:
        kind: 'hand' (drag and pick) or what it draws.
        brush_mm: Width of a line or of a freehand stroke, size of a point.
        snap_mm: Grid to which points snap; 0 for none.
        label: What is written beside the pointer.
    """

    kind: Literal["hand", "rectangle", "line", "freehand", "point"] = "hand"
    brush_mm: float = 10.0
    snap_mm: float = 0.0
    label: str = ""


class ArenaView(
    Element,
    component=_WEB / "arena_view.js",
    esm={"kiks-desk": str(_WEB), "nicegui-scene": str(_THREE)},
):
    """The arena, from above or in 3-D, or both; it fills the element it is in.

    Args:
        feed: Path of the WebSocket that frames come from; all components of a page share one.
        view: What is seen at first.
        on_pick: Told of each click that is no drag.
        on_draw: Told of each stroke of a tool.

    Raises:
        ParameterError: If there is no such view.
    """

    def __init__(
        self,
        feed: str = "/desk/feed",
        *,
        view: View = "top",
        on_pick: Callable[[Pick], Any] | None = None,
        on_draw: Callable[[Stroke], Any] | None = None,
    ) -> None:
        super().__init__()
        ui.add_css(_WEB / "arena_view.css")
        self._props["feed"] = feed
        self._props["show"] = dict(SHOWN)
        self.set_view(view)
        self.set_tool(Tool())
        self.set_follow(-1)
        self.set_dark(None)
        if on_pick is not None:
            self.on("pick", lambda event: on_pick(_pick(event)))
        if on_draw is not None:
            self.on("draw", lambda event: on_draw(_stroke(event)))

    def set_view(self, view: View) -> None:
        """Show the arena from above ('top'), in 3-D ('solid') or 'both'.

        Raises:
            ParameterError: If there is no such view.
        """
        if view not in VIEWS:
            raise ParameterError(f"view must be one of {list(VIEWS)}, but it was {shown(view)}.")
        self._props["view"] = view
        self.update()

    def set_show(self, shown: Mapping[str, bool]) -> None:
        """Show or hide parts of the picture; those not named stay as they are.

        Raises:
            ParameterError: If there is no such part.
        """
        for name in shown:
            if name not in SHOWN:
                raise ParameterError(f"what to show must be among {list(SHOWN)}, but it was {name!r}.")
        self._props["show"] = {**self._props["show"], **shown}
        self.update()

    def set_tool(self, tool: Tool) -> None:
        """Give the pointer a tool."""
        self._props["tool"] = asdict(tool)
        self.update()

    def set_follow(self, robot: int) -> None:
        """Keep a robot in the middle, by its index from 0; -1 follows none."""
        self._props["follow"] = robot
        self.update()

    def set_dark(self, is_dark: bool | None) -> None:
        """Draw for a dark page, or for a light one; None follows the page."""
        self._props["dark"] = is_dark
        self.update()

    def fit(self) -> None:
        """Show all of the arena."""
        self.run_method("fit")

    def clear_trails(self) -> None:
        """Forget where robots have been."""
        self.run_method("clear_trails")

    def select(self, what: Literal["robot", "body", "lamp"], index: int) -> None:
        """Choose a thing as a click does, by its index from 0; -1 chooses nothing."""
        self.run_method("select", what, index)


def _pick(event: GenericEventArguments) -> Pick:
    """Return what the browser said of a click."""
    said = event.args
    return Pick(str(said["what"]), int(said["index"]), int(said["sensor"]), float(said["x_mm"]), float(said["y_mm"]))


def _stroke(event: GenericEventArguments) -> Stroke:
    """Return what the browser said of a stroke."""
    return Stroke(str(event.args["kind"]), tuple((float(x), float(y)) for x, y in event.args["points"]))
