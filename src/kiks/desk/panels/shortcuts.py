"""The keys of the page in one table: the panels listen to them, tooltips name them, and the help lists them.

What keys of the arena do is in `web/keys.js`; what people read of them is here, too.
"""

from __future__ import annotations

import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, NamedTuple

from nicegui import ui
from nicegui.events import KeyEventArguments


class Shortcut(NamedTuple):
    """A key, with Ctrl or Cmd if it begins with `Ctrl-`, and what it does."""

    key: str
    label: str

    @property
    def words(self) -> str:
        """The key as people call it."""
        return "space" if self.key == " " else f"Shift and {self.key}" if self.key.isupper() else self.key


SHORTCUTS = {
    "run": Shortcut(" ", "Run or pause"),
    "step": Shortcut(".", "One step"),
    "step-back": Shortcut(",", "One step back"),
    "event-before": Shortcut("u", "Event before"),
    "back-long": Shortcut("J", "1 s back"),
    "back-short": Shortcut("j", "0.1 s back"),
    "play": Shortcut("k", "Play"),
    "on-short": Shortcut("l", "0.1 s on"),
    "on-long": Shortcut("L", "1 s on"),
    "event-after": Shortcut("o", "Event after"),
    "bookmark": Shortcut("b", "Set a bookmark"),
    "undo": Shortcut("Ctrl-z", "Undo the last step"),
    "redo": Shortcut("Ctrl-y", "Redo the step"),
}

ARENA_KEYS = (
    "Tab or n selects the next thing, arrow keys move it by 10 mm (with Shift 1 mm), q and e turn it by 5 degrees, "
    "Enter shows its properties, Delete removes it, Escape deselects it; plus and minus zoom, 0 shows everything."
)
"""The keys of the arena, for its description and the help."""

PASS_ON = f"""
    const keys = {json.dumps([each.key for each in SHORTCUTS.values()])};
    const controls = ["button", "tab", "checkbox", "switch", "radio"].map((role) => `[role=${{role}}]`);
    const taking = ["button", "a", ".q-select input[readonly]", ...controls].join();
    let isPointed = false;
    addEventListener("pointerdown", () => {{ isPointed = true; }}, true);
    addEventListener("keydown", (event) => {{
        const at = document.activeElement;
        if (event.key === "Tab" || event.key.startsWith("Arrow")) isPointed = false;
        if (!isPointed || !keys.includes(event.key) || event.ctrlKey || event.altKey || event.metaKey) return;
        if (!at.closest(taking) || at.ariaExpanded === "true" || at.closest(".q-dialog, .q-menu")) return;
        event.preventDefault();
        event.stopImmediatePropagation();
        at.blur();
        document.dispatchEvent(new KeyboardEvent("keydown", event));
    }}, true);
"""
"""Lets what was clicked pass the page's keys on: after a click on a sensor or a speed, space pauses, and does not click
again. What Tab or an arrow key brought the focus to takes them itself. Quasar gives the focus to a part of a button."""


def pass_on_keys() -> None:
    """Let what is clicked on this page pass the page's keys on."""
    ui.run_javascript(PASS_ON)


def listen(acts: Mapping[str, Callable[[], Awaitable[object]]], *, is_for_buttons: bool = True) -> None:
    """Listen to keys on this page, outside of fields.

    Args:
        acts: What each does, by the names of `SHORTCUTS`.
        is_for_buttons: Whether also while a button has the focus.
    """
    by_key = {SHORTCUTS[name].key: act for name, act in acts.items()}

    async def press(event: KeyEventArguments) -> None:
        pressed, held, key = event.action, event.modifiers, str(event.key)
        if held.ctrl or held.meta:
            key = f"Ctrl-{'y' if key in ('Z', 'z') and held.shift else key.lower()}"
        # A held space would run and pause in turn.
        if pressed.keydown and not held.alt and not (pressed.repeat and key == " ") and key in by_key:
            await by_key[key]()

    fields: list[Any] = ["input", "select", "textarea"]
    ui.keyboard(on_key=press, ignore=fields if is_for_buttons else [*fields, "button"])
