"""The controls of the arena view: 2-D or 3-D, layers, the robot to follow, colours and help."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from nicegui import ui

from kiks.desk.panels.arena_view import LAYERS, ArenaView, ScoreBoard
from kiks.desk.panels.shortcuts import ARENA_KEYS, SHORTCUTS
from kiks.desk.panels.widgets import bar_button, dialog, named, place_tip, with_props
from kiks.desk.server.desk import Desk

VIEWS = {"top": "2-D", "both": "both", "solid": "3-D"}

_KEYS = ", ".join(f"`{each.words}` {each.label[0].lower()}{each.label[1:]}" for each in SHORTCUTS.values())

HELP = f"""
**With the mouse or a finger**

* Drag a robot to move it. Drag its rim, or drag with Shift, to turn it. You can drag balls, cylinders and lamps, too.
* Click a robot to see its readings. Click one of its sensors to see an explanation of its reading.
* Turn the mouse wheel or use two fingers to zoom. Drag the floor to move the view.

**With the keyboard**

* On the page: {_KEYS}.
* On the arena (press Tab to reach it): {ARENA_KEYS}
* In the program editor: Ctrl-Enter runs; Tab indents, and leaves the editor after Escape.
"""


class ViewPanel:
    """The buttons of the arena view.

    Args:
        desk: The desk.
        view: The view of the arena.
        board: The board above it.
    """

    def __init__(self, desk: Desk, view: ArenaView, board: ScoreBoard) -> None:
        self._desk = desk
        self._view = view
        toggle = ui.toggle(VIEWS, value="top", on_change=lambda event: view.change(view=event.value))
        toggle.props("dense unelevated no-caps toggle-color=accent text-color=white color=transparent")
        toggle.props('data-testid=views aria-label="2-D or 3-D"')
        place_tip(toggle, "View from above, or in 3-D: there drag to orbit, turn the wheel to zoom", "aside")
        layers = _button("layers", "Layers", "layers")
        with layers, with_props(ui.menu(), role="group", aria_label="Layers"), ui.column().classes("q-pa-sm gap-0"):
            for name, (text, is_shown) in LAYERS.items():
                box = ui.checkbox(
                    text, value=is_shown, on_change=lambda event, name=name: view.show_layer(name, event.value)
                )
                named(box, f"show-{name}").props("dense").classes("q-py-xs")
            clear = ui.button("Clear trails", icon="auto_fix_normal").props("flat dense")
            clear.on_click(lambda: view.run_method("clear_trails"))
        with _button("my_location", "Follow a robot", "follow", word="Follow"), ui.menu() as self._robots:
            pass
        self._robots.on("before-show", self._list_robots)
        fit = "Show all of the arena (key: 0)"
        _button("fit_screen", fit, "fit", lambda: view.run_method("fit"), word="Show all")
        tip = "Snapshot: save a picture of the arena as you see it (PNG)"
        _button("photo_camera", "Snapshot", "snapshot", lambda: view.run_method("snapshot"), tip=tip)
        tip = "Hall view, for a projector: arena, score and clock, large (Escape ends it)"
        _button("tv", "Hall view", "hall", lambda: board.run_method("enter"), tip=tip).classes("desk-from-1000")
        with dialog("Help") as self._help:
            ui.markdown(HELP)
            ui.button("Close", on_click=self._help.close).props("flat")
        dark = ui.dark_mode(value=None)
        with _button("contrast", "Light or dark", "dark"), ui.menu():
            for text, value in (("Same as the system", None), ("Light", False), ("Dark", True)):
                _item(text, partial(dark.set_value, value))
        _button("help_outline", "Help", "help").on_click(self._help.open)

    def _list_robots(self) -> None:
        self._robots.clear()
        with self._robots:
            _item("No robot", partial(self._view.change, follow=-1))
            for index, name in enumerate(self._desk.names()):
                _item(f"Robot {name}", partial(self._view.change, follow=index))


def _item(text: str, act: Callable[[], Any]) -> None:
    with_props(ui.menu_item(text, on_click=act), role="menuitem")


_button = partial(bar_button, place="aside")
