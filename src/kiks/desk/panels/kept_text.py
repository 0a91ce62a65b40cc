"""What a person types in a room, kept in the browser until it is saved here."""

from __future__ import annotations

from typing import NamedTuple

from nicegui import ui
from nicegui.element import Element

from kiks.desk.panels.widgets import WEB
from kiks.model.limits import PROGRAM_BYTES_MAX


class Kept(NamedTuple):
    """A text that a browser has kept.

    Attributes:
        name: Name of the program.
        base: What was saved before it was typed; None if the browser does not know.
        text: The program as it was typed.
    """

    name: str
    base: str | None
    text: str


class KeptText(Element, component=WEB / "kept_text.js"):
    """Keeps the text of the editor in the browser; emits `offer` with a text that may not have come here."""

    def know(self, editor: ui.codemirror, name: str, saved: str | None) -> None:
        """Say what is saved.

        Args:
            editor: The editor.
            name: Name of the program in it.
            saved: Its text as it is saved, or would be where nothing is; None if it was not read.
        """
        self._props.update(editor=editor.id, name=name, saved=saved)
        self.update()

    def forget(self, kept: Kept) -> None:
        """Let the browser forget a text, which is saved now."""
        self.run_method("forget", kept.name, kept.text)


def kept_of(told: object) -> Kept | None:
    """Return what a browser offers; None if it is nothing of the kind."""
    if not isinstance(told, dict):
        return None
    name, base, text = told.get("name"), told.get("base"), told.get("text")
    if not (isinstance(name, str) and isinstance(text, str) and isinstance(base, str | None)):
        return None
    return Kept(name, base, text) if max(len(text), len(base or "")) <= PROGRAM_BYTES_MAX else None
