"""What several panels share: widgets, questions, and how an action tells the person who acts of its outcome."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from nicegui import ui
from nicegui.element import Element

from kiks.desk.server.desk import LOCKED, Desk
from kiks.errors import KiksError, ParameterError, counted
from kiks.export.looks import robot_colours
from kiks.sim.ring_buffer import RingBuffer

Some = TypeVar("Some", bound=ui.element)
Item = TypeVar("Item")
Act = Callable[..., Any] | None
"""What a control does; None for nothing yet."""

WEB = Path(__file__).parents[1] / "web"


# ---- actions ----


def show_error(error: Exception) -> None:
    """Show a `KiksError` of an action to the person who has caused it, on pages that give it to `ui.on_exception`."""
    if isinstance(error, KiksError):
        ui.notify(str(error), type="negative", multi_line=True, close_button="OK", timeout=10_000)


class Panel:
    """A part of the page, which is refreshed while it is visible: another browser may have changed what it shows.

    Args:
        desk: The desk.
        refresh_s: Period of `refresh` [s].
    """

    def __init__(self, desk: Desk, refresh_s: float = 0.5) -> None:
        self._desk = desk
        self._timer = ui.timer(refresh_s, self.refresh)

    def refresh(self) -> Any:
        """Show the present state."""

    def set_visible(self, is_visible: bool) -> None:
        """Follow the panel's tab."""
        self._timer.active = is_visible

    def acting(self, act: Callable[[], Awaitable[object]], done: str = "") -> Callable[[], Awaitable[None]]:
        """Return a handler that acts, refreshes the panel and says what is done."""

        async def acted() -> None:
            await act()
            self.refresh()
            if done:
                ui.notify(done)

        return acted


async def agrees(question: str, explanation: str = "", *, yes: str = "Yes", no: str = "No") -> bool:
    """Ask a person, and return whether the answer is yes."""
    with dialog(question) as asked:
        named(ui.label(explanation).classes("text-body2"), "dialog-text")
        finish(asked, yes, lambda: True, no)
    return await answer(asked) is not None


@contextmanager
def dialog(title: str, look: str = "") -> Iterator[ui.dialog]:
    """Build a dialog with a title; what the block builds stands below it."""
    with with_props(ui.dialog(), aria_label=title) as built, ui.card().classes("gap-3").classes(look):
        heading(title, "text-h6")
        yield built


def finish(dialog: ui.dialog, yes: str, result: Callable[[], object], no: str = "Cancel") -> None:
    """Build the buttons of a dialog, which stays open while its result cannot be made."""

    async def submit() -> None:
        dialog.submit(result())

    with ui.row().classes("w-full justify-end"):
        ui.button(no, on_click=lambda: dialog.submit(None)).props("flat data-testid=dialog-no")
        ui.button(yes, on_click=submit).props("unelevated data-testid=dialog-yes")


async def answer(dialog: ui.dialog) -> Any:
    """Show a dialog once and return its result; None if the person cancels."""
    result = await dialog
    dialog.delete()
    return result


# ---- elements ----

ui.button.default_props("no-caps")
ui.tooltip.default_props('anchor="center left" self="center right"')
ui.tooltip.default_classes("desk-tip")

PLACES = {
    "": "",
    "below": 'anchor="bottom middle" self="top middle"',
    "aside": 'anchor="bottom middle" self="top middle"',
    "above": 'anchor="top middle" self="bottom middle" :offset="[0, 50]"',
}
"""Places of tooltips where they cover nothing that a person may want next: below the bar above the arena; on the arena
for the buttons of that bar that are above the tabs; above the slider of the time bar. All others, of panels, stand on
the arena beside them (`web/page.css`)."""


OUTLINED = 'dense outline padding="4px 10px"'


def place_tip(element: Some, text: str, place: str) -> Some:
    """Give an element a tooltip at a place."""
    look = PLACES[place]
    with element:
        tip = ui.tooltip(text).props(look)
    if place:
        tip.classes(replace=f"desk-tip-{place}")
    return element


def with_props(element: Some, **texts: str) -> Some:
    """Set properties to texts as they are; their names have `-` for `_`.

    `element.props(...)` reads properties from a text, so a quote in a name could add others, such as `href`.
    """
    for name, text in texts.items():
        element.props[name.replace("_", "-")] = text
    return element


def named(element: Some, name: str) -> Some:
    """Give an element its name for tests."""
    return with_props(element, data_testid=name)


def heading(text: str, look: str = "text-subtitle1", *, level: int = 2) -> ui.label:
    """Build a heading, which screen readers list."""
    return with_props(ui.label(text).classes(look), role="heading", aria_level=str(level))


class FeedElement(Element):
    """An element that is drawn from frames.

    Args:
        feed: Address of the WebSocket that frames come from, seen from the page; all elements of a page share one.
        style: Name of its style sheet.
    """

    def __init__(self, feed: str, style: str) -> None:
        super().__init__()
        ui.add_css(WEB / style)
        self.change(feed=feed)

    def change(self, **properties: Any) -> None:
        """Change properties of the component."""
        self._props.update(properties)
        self.update()


def lock_note(desk: Desk) -> ui.row:
    """Build the line that says that an exercise is locked; it is there while this is so."""
    with named(ui.row(), "locked").classes("items-center no-wrap text-body2") as note:
        ui.icon("lock").props("aria-hidden=true")
        ui.label(LOCKED)
    return note.bind_visibility_from(desk, "is_locked")


def icon_button(
    icon: str, label: str, name: str, act: Act = None, *, tip: str = "", look: str = "flat round dense", place: str = ""
) -> ui.button:
    """Build a button with an icon alone; `label` is its accessible name, and its tooltip unless there is a tip."""
    button = named(with_props(ui.button(icon=icon, on_click=act).props(look), aria_label=label), name)
    return place_tip(button, tip or label, place)


def relabel(button: ui.button, icon: str, label: str) -> None:
    """Give an icon button another icon and name, unless it has them."""
    if button.props.get("aria-label") != label:
        with_props(button, icon=icon, aria_label=label)


def bar_button(
    icon: str, label: str, name: str, act: Act = None, *, tip: str = "", place: str = "below", word: str = ""
) -> ui.button:
    """Build a button of the bar above the arena: an icon, and below it where there is room a word, `label` if none."""
    button = icon_button(icon, label, name, act, tip=tip, look="flat dense stack color=white", place=place)
    with button:
        ui.label(word or label).classes("desk-word")
    return button


def text_button(
    text: str, icon: str | None, name: str, tip: str, act: Act = None, *, look: str = OUTLINED, place: str = ""
) -> ui.button:
    """Build a button with an icon, a text (possibly empty) and a tooltip."""
    button = ui.button(text, icon=icon, on_click=act).props(look)
    return place_tip(named(with_props(button, aria_label=text or tip), name), tip, place)


def select(
    label: str, name: str, options: Any, value: Any = None, tip: str = "", act: Any = None, **more: Any
) -> ui.select:
    """Build a list to choose from; more options are those of `ui.select`."""
    choice = ui.select(options, label=label or None, value=value, on_change=act, **more).props("dense options-dense")
    return named(choice.tooltip(tip) if tip else choice, name)


class NumberField(ui.number):
    """A field for a number, which stays as a person types it: `read` says what is wrong with it.

    Args:
        label: Its label.
        name: Its name for tests.
        value: What stands in it at first.
        is_whole: Whether the number is a whole one.
        options: Those of `ui.number`, such as `min` and `max`.
    """

    def __init__(
        self, label: str, name: str, value: float | None = None, *, is_whole: bool = False, **options: Any
    ) -> None:
        super().__init__(label, value=value, **options)
        self._is_whole = is_whole
        named(self.props("dense"), name)

    def sanitize(self) -> None:
        """Leave it as it is, where NiceGUI would put the nearest number that is allowed, written in another way."""

    def read(self) -> Any:
        """Return the number.

        Raises:
            ParameterError: If there is none, or it is not allowed.
        """
        value, kind = self.value, "a whole number" if self._is_whole else "a number"
        if value is None or self.out_of_limits or not math.isfinite(value) or (self._is_whole and value % 1):
            least, most = self.props.get("min"), self.props.get("max")
            limits = f" from {least:g} to {most:g}" if most is not None else f" of at least {least:g}"
            given = "the field is empty" if value is None else f"it was {value:g}"
            raise ParameterError(f"{self.props['label']} must be {kind}{limits}, but {given}.")
        return int(value) if self._is_whole else value


def offer_robots(choice: ui.select, desk: Desk) -> None:
    """Let a list offer the robots by their numbers, with the colour of the chosen one, which stays if it is there."""
    if "prepend" not in choice.slots:
        with choice.add_slot("prepend"):
            dot = ui.element("span").classes("desk-robot-dot").props("aria-hidden=true")

        def paint() -> None:
            colours = robot_colours((choice.value or 1) - 1)
            dot.style(f"--light: {colours['light']}; --dark: {colours['dark']}")

        choice.on_value_change(paint)
        paint()
    robots = {robot: f"robot {name}" for robot, name in enumerate(desk.names(), 1)}
    if choice.options != robots:
        choice.set_options(robots, value=min(choice.value or 1, len(robots)) or None)


class LogBox:
    """A box that shows the newest entries of a buffer.

    Args:
        height: Its height in CSS.
        name: Its name for tests.
        label: Its accessible name.
        rows_max: Most rows in the box.
        new_max: Most rows that are added at once.
        live: Whether screen readers read new rows aloud: 'off' or 'polite'.
    """

    def __init__(self, height: str, name: str, label: str, *, rows_max: int, new_max: int, live: str = "off") -> None:
        self.element = ui.log(max_lines=rows_max).classes("w-full text-caption").style(f"height: {height}")
        named(with_props(self.element, role="log", aria_label=label, aria_live=live, tabindex="0"), name)
        self._new_max = new_max
        self._next = 0

    def push(self, text: str, look: str = "") -> None:
        """Add a row; `look` names its CSS classes."""
        self.element.push(text, classes=look)

    def add(self, buffer: RingBuffer[Item], row: Callable[[Item], tuple[str, str] | None]) -> None:
        """Add what is new in a buffer.

        Args:
            buffer: The buffer.
            row: Returns text and look of an entry; None to leave it out.
        """
        first, items = buffer.since(self._next)
        left_out = first - self._next + max(len(items) - self._new_max, 0)
        if left_out:
            self.push(f"... {counted(left_out, 'line')} left out ...", "text-italic")
        for made in map(row, items[-self._new_max :]):
            if made is not None:
                self.push(*made)
        self._next = first + len(items)

    def clear(self, begin: int = 0, *, keeps: bool = False) -> None:
        """Empty the box, unless it keeps what is in it, and begin with a number of an entry."""
        if not keeps:
            self.element.clear()
        self._next = begin
