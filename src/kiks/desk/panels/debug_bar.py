"""The debugger in the programs panel: where the program stands, with its variables, and how it goes on or back."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from nicegui import ui
from nicegui.events import GenericEventArguments

from kiks.desk.panels.widgets import Panel, icon_button, named, relabel, select, with_props
from kiks.desk.server.desk import Desk
from kiks.errors import ParameterError
from kiks.units import ns_from_s

CSS = """
.debug-values { max-height: 30vh; overflow: auto; font-size: 13px; font-family: monospace; width: 100% }
.debug-values details, .debug-values details > div { padding-left: 1rem; white-space: nowrap; overflow: hidden }
.debug-values > details { padding-left: 0 }
.debug-values details > div { padding-left: 2rem }
.debug-values summary { cursor: pointer; overflow: hidden; text-overflow: ellipsis }
.debug-values .nicegui-label { display: inline; padding: 0 }
.debug-values .debug-name { margin-right: 0.5em; font-weight: 600 }
.debug-values .is-new { font-weight: 700; color: #8a4500 }
.body--dark .debug-values .is-new { color: #ffb870 }
"""

KEYS = """
    addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.altKey || event.metaKey) return;
        const button = document.querySelector(`[data-key="${event.shiftKey ? "Shift-" : ""}${event.key}"]`);
        if (!button?.checkVisibility()) return;
        event.preventDefault();
        event.stopPropagation();
        button.click();
    }, true);
"""
"""Lets keys click the buttons of the debugger while it is there, also in the editor."""

REASONS = {"breakpoint": "breakpoint", "pause": "paused", "entry": "begin"}
"""Why a program stands, for people; other reasons need no word."""

SECONDS_MAX = 1e6
"""Latest time that people may name [s]."""

CLOSED = "Globals"
"""The scope that is not shown until a person opens it: it is long."""


class _Value(NamedTuple):
    """A value, or a scope, as it is shown.

    Attributes:
        name: Its name.
        text: Its text.
        reference: The number by which its parts are asked for; 0 if it has none.
        path: The names of what it is a part of, and its own: it is shown open again at the next line.
        parts: Its parts; empty while it is closed.
    """

    name: str
    text: str
    reference: int
    path: tuple[str, ...]
    parts: list[_Value]


class DebugBar(Panel):
    """The buttons of the debugger, and the variables of the program that stands.

    Args:
        desk: The desk.
        robot: Returns the number of the robot whose program is paused.
        show: Called when the program stands somewhere, or goes on.

    Attributes:
        place: The file and the line that are shown; None while nothing stands.
    """

    def __init__(self, desk: Desk, robot: Callable[[], int], show: Callable[[], object]) -> None:
        super().__init__(desk)
        self._robot, self._told = robot, show
        self.place: tuple[str, int] | None = None
        self._seen: object = None
        # What the list of functions offers, by its numbers: the numbers of the program, and where each stands.
        self._ids: dict[int, int] = {}
        self._places: dict[int, tuple[str, int]] = {}
        self._open: dict[tuple[str, ...], bool] = {}
        self._texts: dict[tuple[str, ...], str] = {}
        debugging = desk.debugging
        ui.add_css(CSS)
        with ui.column().classes("w-full gap-1").props('role="group" aria-label="Debugger"') as self._box:
            self._state = named(ui.label().classes("text-body2").props("role=status"), "debug-state")
            with ui.row().classes("w-full items-center no-wrap gap-1"):
                self._run = self._add("play_arrow", "Continue", "debug-run", self._go_on, key="F8")
                go = debugging.go_on
                self._acts = [
                    self._add("redo", "Step over", "debug-over", partial(go, "next"), key="F10"),
                    self._add("south", "Step into", "debug-into", partial(go, "stepIn"), key="F11"),
                    self._add("north", "Step out", "debug-out", partial(go, "stepOut"), key="Shift-F11"),
                    self._add("undo", "Step back", "debug-back", debugging.back),
                    self._add(
                        "fast_rewind",
                        "Back to the last breakpoint",
                        "debug-rewind",
                        partial(debugging.back, is_to_breakpoint=True),
                    ),
                ]
                self._when = named(ui.input("Back to before").classes("col"), "debug-when").props("dense")
                self._when.tooltip("Back to the line before this became true, such as contacts == 1, or to a time in s")
                self._when.on("keydown.enter", self._go_before)
                self._acts.append(self._add("history", "Back to before that", "debug-before", self._go_before))
            tip = "The functions that call each other, the innermost first"
            self._frames = select("In", "debug-frames", {}, None, tip, self._show_frame).classes("w-full")
            self._values = named(ui.element("div").classes("debug-values"), "debug-values")
            with_props(self._values, tabindex="0", role="region", aria_label="Variables")
        debugging.changed.subscribe(self._follow)
        ui.timer(0, lambda: ui.run_javascript(KEYS), once=True)

    def _add(self, icon: str, label: str, name: str, act: Callable[..., Any], *, key: str = "") -> ui.button:
        tip = f"{label} ({key.replace('-', ' and ')})" if key else label
        button = icon_button(icon, label, name, lambda: act(), tip=tip)
        return with_props(button, data_key=key) if key else button

    async def refresh(self) -> None:
        """Show how the program does; what it has shown goes when it has gone on for a while."""
        if self._desk.debugging.stop is None and self._seen is not None:
            self._seen = self.place = None
            self._texts = {}
            self._values.clear()
            self._told()
        await self._follow()

    async def _follow(self) -> None:
        """Show where the program stands."""
        debugging = self._desk.debugging
        stop = debugging.stop
        self._box.set_visibility(debugging.is_there)
        relabel(self._run, *(("pause", "Pause") if stop is None else ("play_arrow", "Continue")))
        for control in (*self._acts, self._when):
            control.set_enabled(stop is not None)
        self._values.set_visibility(self._seen is not None)
        self._frames.set_visibility(self._seen is not None and len(self._frames.options) > 1)
        if stop is None:
            self._state.text = "Going back ..." if debugging.is_going_back else "The program runs."
        if stop is None or stop is self._seen:
            self._told()
            return
        self._seen = stop
        why = f": {stop.text}" if stop.text else f": {REASONS[stop.reason]}" if stop.reason in REASONS else ""
        robot = f" (robot {self._desk.names()[stop.robot - 1]})" if len(self._desk.programs.handles) > 1 else ""
        self._state.text = f"{Path(stop.file).name}, line {stop.line}{robot}{why}"
        frames = (await debugging.ask("stackTrace", {"threadId": stop.thread}))["stackFrames"]
        if debugging.stop is stop and frames:
            # Numbers that were not there before, so that the list takes the first one as new.
            first = max(self._places, default=0) + 1
            self._ids = {first + number: each["id"] for number, each in enumerate(frames)}
            self._places = {first + number: _place(each) for number, each in enumerate(frames)}
            names = {first + number: f"{each['name']}, line {each['line']}" for number, each in enumerate(frames)}
            self._frames.set_options(names, value=first)

    async def _show_frame(self) -> None:
        """Show the variables of the function that is chosen, and its line."""
        stop, frame, debugging = self._seen, self._frames.value, self._desk.debugging
        scopes = (await debugging.ask("scopes", {"frameId": self._ids[frame]}))["scopes"]
        values = [await self._value(each | {"value": ""}, ()) for each in scopes]
        if debugging.stop is not stop:
            return
        self.place = self._places[frame]
        before, self._texts = self._texts, {}
        self._values.clear()
        with self._values:
            for each in values:
                self._build(each, before)
        await self._follow()

    async def _value(self, given: dict[str, Any], path: tuple[str, ...]) -> _Value:
        """Return a value with the parts that are to be shown."""
        name, reference = given["name"], given.get("variablesReference", 0)
        path = (*path, name)
        is_open = reference and self._open.get(path, len(path) == 1 and name != CLOSED)
        return _Value(name, given["value"], reference, path, await self._read(reference, path) if is_open else [])

    async def _read(self, reference: int, path: tuple[str, ...]) -> list[_Value]:
        given = await self._desk.debugging.ask("variables", {"variablesReference": reference})
        return [await self._value(each, path) for each in given["variables"]]

    def _build(self, value: _Value, before: dict[tuple[str, ...], str]) -> None:
        """Build the row of a value; one that has changed stands out."""
        self._texts[value.path] = value.text
        look = "is-new" if before and before.get(value.path) != value.text else ""
        with ui.element("details" if value.reference else "div") as row:
            with ui.element("summary") if value.reference else nullcontext():
                ui.label(value.name + ":" * bool(value.text)).classes("debug-name")
                with_props(ui.label(value.text).classes(look), title=value.text)
            for each in value.parts:
                self._build(each, before)
        if value.reference:
            if value.parts:
                row.props("open")
            row.on("toggle", partial(self._toggle, row, value), js_handler="(event) => emit(event.target.open)")

    async def _toggle(self, row: ui.element, value: _Value, event: GenericEventArguments) -> None:
        """Read the parts of a value when it is opened, and open it again at the next line."""
        self._open[value.path] = bool(event.args)
        if event.args and not value.parts:
            value.parts.extend(await self._read(value.reference, value.path))
            with row:
                for each in value.parts:
                    self._build(each, {})

    # ---- on and back ----

    async def _go_on(self) -> None:
        debugging = self._desk.debugging
        await (debugging.pause(self._robot()) if debugging.stop is None else debugging.go_on())

    async def _go_before(self) -> None:
        """Go back to the line before what a person has typed: a time, or a formula."""
        text = (self._when.value or "").strip()
        if not text:
            raise ParameterError("The field must have a formula such as contacts == 1, or a time in s, but is empty.")
        try:
            time_s = float(text)
        except ValueError:
            await self._desk.debugging.back(when=text)
        else:
            await self._desk.debugging.back(time_ns=ns_from_s(min(max(time_s, 0.0), SECONDS_MAX)))


def _place(frame: dict[str, Any]) -> tuple[str, int]:
    return str(frame["source"].get("path", "")), int(frame["line"])
