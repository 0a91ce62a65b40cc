"""The debugger in the programs panel: where the program stands, with its variables, and how it goes on or back."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from kiks.desk.panels.widgets import Panel, icon_button, named, relabel, select, with_props
from kiks.desk.server.desk import Desk
from kiks.errors import KiksError
from kiks.units import ns_from_s

ADDRESS = re.compile("( at |id=)0x[0-9a-f]+,? ?", re.IGNORECASE)
"""An address in the memory of a process: it says nothing to people, and is another one in a run that is made again."""

REASONS = {"breakpoint": "breakpoint", "end": "the end. Continue ends the program"}
"""Why a program stands, for people; most reasons need no word."""

PARTS_MAX = 200
"""Most parts of a value that are shown."""

CLOSED = "Globals"
"""The scope that is not shown until a person opens it: it is long."""


class DebugBar(Panel):
    """The buttons of the debugger.

    Args:
        desk: The desk.
        robot: Returns the number of the robot whose program is paused.
        show: Called when the program stands somewhere, or goes on.

    Attributes:
        place: The file and the line that are shown; None while nothing stands.
    """

    def __init__(self, desk: Desk, robot: Callable[[], int], show: Callable[[], object]) -> None:
        super().__init__(desk)
        self._robot, self._told, self._debugging = robot, show, desk.debugging
        self.place: tuple[str, int] | None = None
        self._seen: object = None
        # What the list of functions offers: where each stands; its numbers were never there before.
        self._frames: dict[Any, dict[str, Any]] = {}
        self._is_open: dict[tuple[str, ...], bool] = {}
        self._filled: set[int] = set()  # ids of the rows that have their parts
        self._texts: dict[tuple[str, ...], str] = {}
        with ui.column().classes("w-full gap-1").props('role="group" aria-label="Debugger"') as self._box:
            with ui.row().classes("w-full items-center no-wrap gap-2"):
                self._state = named(ui.label().classes("text-body2 col").props("role=status"), "debug-state")
                tip = "The functions that call each other, the innermost first"
                self._frame = select("In", "debug-frame", {}, None, tip, self._show_frame).classes("col")
            with ui.row().classes("w-full items-center no-wrap gap-1"):
                go, back = self._debugging.go_on, self._back
                self._run = self._add("play_arrow", "Continue", "run", self._go_on, "F8")
                self._steps = [
                    self._add("redo", "Step over", "over", partial(go, "next"), "F10"),
                    self._add("south", "Step into", "into", partial(go, "stepIn"), "F11"),
                    self._add("north", "Step out", "out", partial(go, "stepOut"), "Shift-F11"),
                ]
                self._add("undo", "Step back", "back", back)
                self._add("fast_rewind", "Back to the last breakpoint", "rewind", partial(back, is_to_breakpoint=True))
                when = named(ui.input("Back to before").classes("col"), "debug-when").props("dense")
                when.tooltip("Back to the line before this became true, such as contacts == 1, or to a time in s")
                when.on("keydown.enter", partial(self._go_before, when))
                self._add("history", "Go back there", "before", partial(self._go_before, when))
        self._debugging.changed.subscribe(self._follow)

    def build_values(self) -> None:
        """Build the place of the variables, elsewhere in the panel."""
        self._values = named(ui.element("div").classes("debug-values"), "debug-values")
        with_props(self._values, tabindex="0", role="region", aria_label="Variables")

    def _add(self, icon: str, label: str, name: str, act: Callable[[], Any], key: str = "") -> ui.button:
        tip = f"{label} ({key.replace('-', ' and ')})" if key else label
        return with_props(icon_button(icon, label, f"debug-{name}", lambda: act(), tip=tip), data_key=key)

    async def refresh(self) -> None:
        """Show how the program does; what was shown goes when the program has gone on for a while."""
        if self._debugging.stop is None and self._seen is not None:
            self._seen = self.place = None
            self._texts = {}
        await self._follow()

    async def _follow(self) -> None:
        """Show where the program stands."""
        stop = self._debugging.stop
        self._box.set_visibility(self._debugging.is_there)
        relabel(self._run, *(("pause", "Pause") if stop is None else ("play_arrow", "Continue")))
        for each in self._steps:
            each.set_enabled(stop is not None)
        self._values.set_visibility(self._seen is not None)
        self._frame.set_visibility(self._seen is not None and len(self._frame.options) > 1)
        if stop is None:
            self._state.text = "Going back ..." if self._debugging.is_going_back else "The program runs."
        elif stop is not self._seen:
            self._seen = stop
            why = stop.text or REASONS.get(stop.reason, "")
            robot = f" (robot {self._desk.names()[stop.robot - 1]})" * (len(self._desk.programs.handles) > 1)
            self._state.text = f"{Path(stop.file).name}, line {stop.line}{robot}{why and ': '}{why}"
            self.place = stop.file, stop.line
            frames = []
            with suppress(KiksError):  # it goes on meanwhile
                frames = (await self._ask("stackTrace", threadId=stop.thread))["stackFrames"]
            if self._debugging.stop is stop:
                self._frames = dict(enumerate(frames, max(self._frames, default=0) + 1))
                names = {number: f"{each['name']}, line {each['line']}" for number, each in self._frames.items()}
                self._frame.set_options(names, value=min(names, default=None))
        self._told()

    async def _ask(self, command: str, **given: Any) -> Any:
        return await self._debugging.ask(lambda session: session.ask(command, given))

    # ---- variables ----

    async def _show_frame(self) -> None:
        """Show the variables of the function that is chosen, and its line."""
        if (frame := self._frames.get(self._frame.value)) is None:
            self._values.clear()  # at its end
            return
        stop = self._seen
        self._before, self._texts = self._texts, {}
        old = [*self._values]
        with suppress(KiksError), self._values, ui.element("div") as new:
            new.set_visibility(False)  # until all is read
            for each in (await self._ask("scopes", frameId=frame["id"]))["scopes"]:
                await self._add_value(each, ())
        new.set_visibility(True)
        for each in old if self._debugging.stop is stop else [new]:
            if not each.is_deleted:
                each.delete()
        self.place = str(frame["source"].get("path")), frame["line"]
        await self._follow()

    async def _add_value(self, given: dict[str, Any], path: tuple[str, ...]) -> None:
        """Show a value, with its parts if they were shown at the line before; one that has changed stands out."""
        name, text, reference = given["name"], ADDRESS.sub("", given.get("value", "")), given.get("variablesReference")
        path = (*path, name)
        self._texts[path] = text
        look = "is-new" if self._before and self._before.get(path) != text else ""
        with ui.element("details" if reference else "div") as row, ui.element("summary" if reference else "div"):
            ui.label(name).classes("debug-name")
            with_props(ui.label(text).classes(look), title=text)
        if reference:
            row.on(
                "toggle", partial(self._toggle, row, reference, path), js_handler="(event) => emit(event.target.open)"
            )
            if self._is_open.get(path, len(path) == 1 and name != CLOSED):
                row.props("open")
                await self._add_parts(row, reference, path)

    async def _add_parts(self, row: ui.element, reference: int, path: tuple[str, ...]) -> None:
        # A browser tells of each opening, also of one that was asked of it.
        if row.id in self._filled:
            return
        self._filled.add(row.id)
        with row:
            for each in (await self._ask("variables", variablesReference=reference, count=PARTS_MAX))["variables"]:
                await self._add_value(each, path)

    async def _toggle(
        self, row: ui.element, reference: int, path: tuple[str, ...], event: GenericEventArguments
    ) -> None:
        """Note whether a value is open, and show its parts."""
        self._is_open[path] = bool(event.args)
        if event.args:
            await self._add_parts(row, reference, path)

    # ---- on and back ----

    async def _go_on(self) -> None:
        await (self._debugging.go_on() if self._debugging.stop is not None else self._debugging.pause(self._robot()))

    async def _back(self, **how: Any) -> None:
        await self._debugging.back(self._robot(), **how)

    async def _go_before(self, when: ui.input) -> None:
        """Go back to the line before what a person has typed: a time, or a formula."""
        text = (when.value or "").strip()
        is_time = text.replace(".", "", 1).isdecimal()
        await self._back(**({"time_ns": ns_from_s(float(text))} if is_time else {"when": text}))
