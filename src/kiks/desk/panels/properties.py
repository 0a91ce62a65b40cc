"""The properties of the selected thing or wall: a form made from the rules by which files are checked."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from nicegui import ui

from kiks.desk.panels.arena_view import ArenaView
from kiks.desk.panels.record_form import label_of, rules_of, text_of, value_of
from kiks.desk.panels.widgets import Panel, icon_button, named, with_props
from kiks.desk.server.desk import Desk
from kiks.desk.server.live_content import Selected, values_of
from kiks.desk.server.live_editing import Editing
from kiks.errors import KiksError
from kiks.model.walls import Wall

TYPED = "(event) => emit(event.target.value)"
"""Sends what stands in a field with the event, as the field's own message may come later."""

HINT = "Double-click a robot, a ball, a cylinder, a lamp or a drawn wall to set its properties."


class PropertiesPanel(Panel):
    """The properties of what a person has selected.

    Args:
        desk: The desk.
        editing: Changes its world.
        view: Marks the selected wall.
        changed: Called after each change.
    """

    def __init__(self, desk: Desk, editing: Editing, view: ArenaView, changed: Callable[[], object]) -> None:
        super().__init__(desk)
        self._editing, self._view, self._changed = editing, view, changed
        self._selected: Selected | None = None
        self._record: Any = None
        self._rules: dict[str, dict[str, Any]] = {}
        self._fields: dict[str, ui.input | ui.switch] = {}
        self._shown: dict[str, Any] = {}
        """What was last put into each field; where something else stands, a person has typed since."""
        self._in_focus = self._bad = ""
        self._acting = asyncio.Lock()
        self._form = named(ui.column().classes("w-full gap-1"), "properties")
        self._refused = named(ui.label().classes("text-body2 desk-error").props("role=alert"), "refused")
        self._build()

    async def show(self, selected: Selected | None, *, has_focus: bool = False) -> None:
        """Show the properties of a thing or a wall; None for nothing."""
        # The clicks of a double click ask for the same form: what a person types into it already must stay.
        if selected is None or selected != self._selected or not self._fields:
            self._selected = selected
            self._record = None if selected is None else await self._editing.properties(selected)
            self._build()
            self._mark()
        if has_focus and self._fields:
            next(iter(self._fields.values())).run_method("focus")

    async def refresh(self) -> None:
        """Show the present values, but not in a field that a person is in, or has typed into."""
        if self._selected is None or self._desk.past is not None:
            return
        asked = self._selected
        try:
            record = await self._editing.properties(asked)
        except KiksError:
            return  # by now, the past is shown
        if self._acting.locked() or asked != self._selected:
            return  # the answer is about a wall as it was before
        if type(record) is not type(self._record):
            await self.show(None)
            return
        self._record = record
        for name, value in values_of(record).items():
            if name != self._in_focus and self._fields[name].value == self._shown[name]:
                self._shown[name] = self._fields[name].value = text_of(value)

    def set_visible(self, is_visible: bool) -> None:
        """Mark the selected wall while the panel is visible."""
        super().set_visible(is_visible)
        self._mark(is_visible=is_visible)

    def _mark(self, *, is_visible: bool = True) -> None:
        self._view.show_wall(self._selected if is_visible and isinstance(self._selected, Wall) else None)

    def _build(self) -> None:
        """Build the form of the selected thing."""
        self._form.clear()
        self._fields.clear()
        self._shown.clear()
        self._in_focus = self._refused.text = ""
        with self._form:
            if self._record is None:
                ui.label(HINT).classes("text-caption")
                return
            with ui.row().classes("w-full items-center no-wrap"):
                ui.label(name_of(self._record)).classes("text-subtitle1 col")
                icon_button("delete", "Remove it", "remove-selected", self._remove)
                icon_button("close", "Close the properties", "close-properties", partial(self.show, None))
            self._rules = rules_of(type(self._record))
            with ui.element("div").classes("desk-properties"):
                for name, value in values_of(self._record).items():
                    self._fields[name] = self._build_field(name, value)
            if self._desk.has_old_coordinates:
                ui.label("Here x and y are those of files: from the lower left corner, y up.").classes("text-caption")

    def _build_field(self, name: str, value: Any) -> ui.input | ui.switch:
        word, unit = label_of(name)
        field: ui.input | ui.switch
        if isinstance(value, bool):
            field = ui.switch(word, value=value, on_change=lambda event: self._take(name, event.value))
        else:
            field = ui.input(word, value=text_of(value)).props("dense outlined hide-bottom-space")
            field = with_props(field, suffix=unit)
            if not isinstance(value, str):
                field = with_props(field, inputmode="decimal" if isinstance(value, int | float) else "text")
            field.on("focus", partial(self._focus, name))
            field.on("blur", lambda event: self._leave(name, event.args), js_handler=TYPED)
            field.on("keydown.enter", lambda event: self._take(name, event.args), js_handler=TYPED)
        self._shown[name] = field.value
        if isinstance(value, tuple):
            field.classes("desk-wide")
        if tip := self._rules[name].get("description", ""):
            field.tooltip(tip)
        return named(field, f"property-{name}")

    def _focus(self, name: str) -> None:
        self._in_focus = name

    async def _leave(self, name: str, typed: str) -> None:
        self._in_focus = ""
        await self._take(name, typed)

    async def _take(self, name: str, typed: Any) -> None:
        """Apply what a field says; its message stays below the form until the value is good."""
        if self._selected is None or name not in self._fields:
            return
        before = values_of(self._record)[name]
        if typed == text_of(before):
            if name == self._bad:
                self._refused.text = ""
            return
        self._bad = name
        value = value_of(typed, before, self._rules[name])
        changes, taken = {name: value}, (typed, self._fields[name].value)
        await self._act(lambda selected: self._editing.change(selected, **changes), name, taken)

    async def _remove(self) -> None:
        await self._act(self._editing.remove_selected)

    async def _act(
        self, act: Callable[[Selected], Awaitable[Selected | None]], name: str = "", taken: tuple[Any, ...] = ()
    ) -> None:
        """Change the world, and show what came of it; the field of this name had one of the values `taken` before."""
        async with self._acting:
            if (asked := self._selected) is None:
                return
            try:
                after = await act(asked)
            except KiksError as error:
                self._refused.text = str(error)
                return
            if asked == self._selected:  # a person may have selected something else since
                self._selected, self._refused.text = after, ""
        if name in self._fields and self._fields[name].value in taken:  # what has been typed since stays
            self._shown[name] = self._fields[name].value
            if self._in_focus == name:
                self._in_focus = ""
        await (self.show(None) if self._selected is None else self.refresh())
        self._mark()
        self._changed()


def name_of(record: Any) -> str:
    """Return what people call a thing with such properties."""
    kind = type(record).__name__.removesuffix("Properties")
    return f"{kind} {record.name}" if getattr(record, "name", "") else kind
