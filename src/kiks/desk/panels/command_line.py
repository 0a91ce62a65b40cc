"""An input line for commands, which recalls earlier ones, and a button that sends."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

from nicegui import ui

from kiks.desk.panels.widgets import icon_button, named
from kiks.errors import KiksError

HISTORY_LIMIT = 100
"""Number of commands kept for the arrow keys."""

TAKE = """(event) => {
    const input = event.target, text = input.value;
    // The browser empties the input at once, for a person may type the next command before an answer comes.
    input.value = "";
    input.dispatchEvent(new Event("input"));
    setTimeout(() => emit(text));  // after the change of the input
}"""


class History:
    """The commands typed before, for the arrow keys.

    Example:
        >>> history = History()
        >>> history.add("N"); history.add("D,1,1")
        >>> history.back("x"), history.back("x"), history.back("x"), history.forth(), history.forth()
        ('D,1,1', 'N', 'N', 'D,1,1', 'x')
    """

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._place = 0
        self._unsent = ""

    def add(self, line: str) -> None:
        """Add a line that a person sends."""
        if self._lines[-1:] != [line]:
            self._lines = [*self._lines, line][-HISTORY_LIMIT:]
        self._place = len(self._lines)

    def back(self, now: str) -> str:
        """Return the previous line; `now` is the unsent line, which `forth` returns at the end."""
        if self._place == len(self._lines):
            self._unsent = now
        self._place = max(self._place - 1, 0)
        return self._lines[self._place] if self._lines else now

    def forth(self) -> str:
        """Return the next line, or the unsent line at the end."""
        self._place = min(self._place + 1, len(self._lines))
        return self._lines[self._place] if self._place < len(self._lines) else self._unsent


class CommandLine:
    """An input line and a button that sends. A line whose command fails comes back, to be corrected.

    Args:
        send: Called with each line, without blanks around it.
        label: Label of the input.
        example: A command, shown while the input is empty.
        tip: What a command does, for a person who hovers over the input.
        verb: Name of the button.
        verb_tip: What it does.
        name: Test id of the input; that of the button ends in `-send`.
        on_change: Called when the text has changed.
    """

    def __init__(
        self,
        send: Callable[[str], Awaitable[None]],
        *,
        label: str,
        example: str,
        tip: str,
        verb: str,
        verb_tip: str,
        name: str,
        on_change: Callable[[], Any] = lambda: None,
    ) -> None:
        self._send = send
        self._history = History()
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            self._input = named(ui.input(label, placeholder=example, on_change=lambda: on_change()), name)
            self._input.classes("col").props("dense autocomplete=off autocapitalize=off spellcheck=false")
            self._input.tooltip(f"{tip}; the arrow keys recall earlier ones")
            self._input.on("keydown.enter", lambda event: self._take(str(event.args)), js_handler=TAKE)
            self._input.on("keydown.up.prevent", lambda: self._input.set_value(self._history.back(self.text)))
            self._input.on("keydown.down.prevent", lambda: self._input.set_value(self._history.forth()))
            icon_button("send", verb, f"{name}-send", self._take_click, tip=verb_tip)

    @property
    def text(self) -> str:
        """The text of the input."""
        return self._input.value or ""

    def complete(self, text: str) -> None:
        """Put a text into the input for completion."""
        self._input.value = text
        self._input.run_method("focus")

    async def _take_click(self) -> None:
        text, self._input.value = self.text, ""
        await self._take(text)

    async def _take(self, text: str) -> None:
        text = text.strip()
        self._history.add(text)
        try:
            await self._send(text)
        except KiksError:
            self._input.value = self.text or text
            raise
