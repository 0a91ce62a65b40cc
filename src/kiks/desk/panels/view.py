"""What the arena view shows, and how: from above or in space, with rays, trails, names and the like."""

from __future__ import annotations

from nicegui import ui

from kiks.desk.panels.arena_view import SHOWN, ArenaView
from kiks.desk.server.desk import Desk

LAYERS = {
    "rays": "Rays of the proximity sensors, coloured by their readings",
    "light": "Light of the lamps on the floor",
    "camera": "What cameras see, beside their robots",
    "trails": "Where robots have been",
    "contacts": "Who touches something",
    "grid": "Grid of 10 and 100 mm",
    "ruler": "Millimetres along the edges",
    "names": "Names of the robots",
}

VIEWS = {"top": "2-D", "both": "both", "solid": "3-D"}

HELP = """
**With the mouse or a finger**

* Drag a robot to move it; drag its rim, or drag with Shift, to turn it. Balls, cylinders and lamps are dragged, too.
* Click a robot to look inside; click one of its sensors to learn why it reads what it reads.
* Wheel or two fingers: nearer and farther. Drag the floor: move the view.

**With the keyboard**

* Space: run and pause. `.`: a step.
* On the arena, which Tab reaches: `n` selects one thing after the other, arrows move it by 10 mm (with Shift 1 mm),
  `q` and `e` turn it by 5 degrees, Escape lets go; `+` `-` `0`: nearer, farther, all.
* In the editor of programs: Ctrl-Enter runs; Tab indents, and leaves the editor after Escape.
"""


class ViewPanel:
    """The buttons that say what is shown.

    Args:
        desk: The desk.
        view: The view of the arena.
    """

    def __init__(self, desk: Desk, view: ArenaView) -> None:
        self._desk = desk
        self._view = view
        with (
            ui.toggle(VIEWS, value="top", on_change=lambda event: view.set_view(event.value))
            .props("dense unelevated no-caps toggle-color=accent text-color=white color=transparent")
            .props('data-testid=views aria-label="From above or in space"')
        ):
            ui.tooltip("Look from above, or into space: there drag to turn around, wheel to come nearer")
        with _button("layers", "What is shown", "layers"), ui.menu(), ui.column().classes("q-pa-sm gap-0"):
            for name, text in LAYERS.items():
                ui.checkbox(
                    text, value=SHOWN[name], on_change=lambda event, name=name: view.set_show({name: event.value})
                ).props(f"dense data-testid=show-{name}").classes("q-py-xs")
            ui.button("Clear trails", icon="auto_fix_normal", on_click=view.clear_trails).props("flat dense no-caps")
        with _button("my_location", "Follow a robot", "follow"), ui.menu() as self._robots:
            pass
        self._robots.on("before-show", self._list_robots)
        with _button("fit_screen", "Show all of the arena", "fit").on_click(view.fit):
            ui.tooltip("Show all of the arena (key: 0)")
        with ui.dialog() as self._help, ui.card():
            ui.markdown(HELP)
            ui.button("Close", on_click=self._help.close).props("flat no-caps")
        dark = ui.dark_mode(value=None)
        with _button("contrast", "Light or dark", "dark"), ui.menu():
            for text, value in (("As the computer has it", None), ("Light", False), ("Dark", True)):
                ui.menu_item(text, on_click=lambda value=value: dark.set_value(value))
        _button("help_outline", "Help", "help").on_click(self._help.open)

    def _list_robots(self) -> None:
        self._robots.clear()
        with self._robots:
            ui.menu_item("Nobody", on_click=lambda: self._view.set_follow(-1))
            for index, name in enumerate(self._desk.names()):
                ui.menu_item(f"Robot {name}", on_click=lambda index=index: self._view.set_follow(index))


def _button(icon: str, word: str, name: str) -> ui.button:
    button = ui.button(icon=icon).props(f'round dense flat color=white aria-label="{word}" data-testid={name}')
    with button:
        ui.tooltip(word)
    return button
