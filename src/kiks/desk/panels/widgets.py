"""What several panels share: buttons, and error messages for the person who acts."""

from __future__ import annotations

import functools
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from nicegui import ui
from nicegui.element import Element

from kiks.errors import KiksError

Given = ParamSpec("Given")
Some = TypeVar("Some", bound=ui.element)

BAR = "flat round dense color=white"
"""Look of an icon button in the bar above the arena."""


def told(act: Callable[Given, Awaitable[None]]) -> Callable[Given, Awaitable[None]]:
    """Show a `KiksError` of an action to the person who has caused it."""

    @functools.wraps(act)
    async def acted(*args: Given.args, **kwargs: Given.kwargs) -> None:
        try:
            await act(*args, **kwargs)
        except KiksError as error:
            ui.notify(str(error), type="negative", multi_line=True, close_button="OK", timeout=10_000)

    return acted


def with_props(element: Some, **texts: str) -> Some:
    """Set properties to texts as they are; their names have `-` for `_`.

    `element.props(...)` reads properties from a text, so a quote in a name could add others, such as `href`.
    """
    for name, text in texts.items():
        element.props[name.replace("_", "-")] = text
    return element


def named(element: Some, name: str) -> Some:
    """Give an element its name for tests, in a browser and without one."""
    return with_props(element, data_testid=name).mark(name)


def log_box(lines_max: int, height: str, name: str, label: str) -> ui.log:
    """Build a box of lines; `label` is its accessible name."""
    box = ui.log(max_lines=lines_max).classes("w-full text-caption").style(f"height: {height}")
    return named(with_props(box, aria_label=label), name)


class FeedElement(Element):
    """An element that is drawn from frames.

    Args:
        feed: Address of the WebSocket that frames come from, seen from the page; all elements of a page share one.
        style: Its style sheet.
    """

    def __init__(self, feed: str, style: Path) -> None:
        super().__init__()
        ui.add_css(style)
        self._props["feed"] = feed


def icon_button(
    icon: str, label: str, name: str, act: Callable[..., Any] | None = None, *, look: str = "flat round dense"
) -> ui.button:
    """Build a button with an icon alone; `label` is its accessible name."""
    button = ui.button(icon=icon, on_click=act).props(look)
    return named(with_props(button, aria_label=label), name)


def offer_robots(choice: ui.select, count: int) -> None:
    """Let a list offer robots 1 to `count`, and keep the chosen one if it is among these."""
    robots = {robot: f"robot {robot}" for robot in range(1, count + 1)}
    if choice.options != robots:
        choice.set_options(robots, value=min(choice.value or 1, count) or None)


def text_button(text: str, icon: str, name: str, tip: str, act: Callable[..., Any]) -> ui.button:
    """Build a button with an icon, a text (possibly empty) and a tooltip."""
    button = ui.button(text, icon=icon, on_click=act).props('dense no-caps outline padding="4px 10px"')
    return named(with_props(button, aria_label=text or tip), name).tooltip(tip)
