"""The programs panel: the programs with their robots, states and output, and an editor to write and run one."""

from __future__ import annotations

import asyncio
from typing import Any

from nicegui import ui

from kiks.desk.panels.widgets import icon_button, log_box, named, offer_robots, told, with_props
from kiks.desk.server.desk import Desk
from kiks.desk.server.scripts import (
    NEW,
    Script,
    find_mistake,
    offered,
    path_of,
    read_script,
    save_script,
    split_arguments,
)
from kiks.ports.program_process import Command
from kiks.ports.programs import Handle

REFRESH_S = 0.3
"""Refresh period of the list and the output [s]."""

SHOWN_LINES = 500
"""Maximum number of lines of output in the page."""

NEWEST_LINES = 100
"""Maximum number of lines of output that one refresh adds."""

POLL_S = 0.02
"""Period at which the end of a program is polled [s]."""

MAY_NOT = (
    "You cannot start programs from this page: the desk is open to other computers, so any visitor could run "
    "anything here. Start them at the terminal, or open the desk for this computer only."
)
"""Shown in place of the editor, whose programs would not start (`kiks.ports.program_process`)."""

CSS = ".program-error { color: #b00020 } .body--dark .program-error { color: #ff9a90 }"

ICONS = {"running": "play_circle", "stopping": "hourglass_top", "stopped": "stop_circle", "silenced": "volume_off"}
"""Icons of programs by state; all other states are ends."""


class ProgramsPanel:
    """The programs of a desk.

    Args:
        desk: The desk.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._drawn: object = None
        self._shown: Handle | None = None
        self._next_line = 0
        self._script: Script | None = None
        self._drafts: dict[Script | None, str] = {}
        self._known: dict[Script | None, str] = {}  # the texts as they were read or saved last
        ui.add_css(CSS)
        with ui.column().classes("w-full q-pa-sm gap-2"):
            if desk.may_run_programs:
                self._build_editor()
            else:
                named(ui.label(MAY_NOT).classes("text-body2"), "may-not")
            self._list = named(ui.column().classes("w-full gap-1"), "programs")
            with ui.expansion("Output", value=True).classes("w-full").props("dense") as self._output_box:
                self._log = log_box(SHOWN_LINES, "12rem", "output", "What the program has printed")
        self._timer = ui.timer(REFRESH_S, self.refresh)
        self.refresh()

    def set_visible(self, is_visible: bool) -> None:
        """Refresh the panel only while it is visible."""
        self._timer.active = is_visible

    # ---- the list and the output ----

    def refresh(self) -> None:
        """Show the present state."""
        desk = self._desk
        handles = list(desk.programs.handles)
        if self._shown not in handles:
            self._show(handles[-1] if handles else None)
        drawn = [(handle, handle.state, handle is self._shown) for handle in handles]
        if drawn != self._drawn:
            self._drawn = drawn
            self._list.clear()
            with self._list:
                self._draw_list(handles)
        if desk.may_run_programs:
            offer_robots(self._robot, desk.sim.robot_count)
        self._add_output()

    def _draw_list(self, handles: list[Handle]) -> None:
        if not handles:
            ui.label("No program runs.").classes("text-body2")
        for handle in handles:
            is_shown = handle is self._shown
            with ui.row().classes("w-full items-center no-wrap gap-1"):
                icon = ICONS.get(handle.state, "error_outline" if handle.code else "check_circle")
                button = ui.button(on_click=lambda handle=handle: self._choose(handle))
                button.props("flat no-caps align=left dense").mark(f"program-{handle.number}")
                with with_props(button, aria_pressed=str(is_shown).lower()).classes(
                    "col text-weight-bold" if is_shown else "col"
                ):
                    ui.icon(icon).classes("q-mr-sm").props("aria-hidden=true")
                    ui.label(f"{handle.command.name} on robot {handle.robot}: {handle.state}")
                    ui.tooltip("Show what this program prints")
                self._draw_act(handle)

    def _draw_act(self, handle: Handle) -> None:
        """Add the button that stops a program or starts it again."""
        program = handle.command.name
        if handle.is_running:
            button = icon_button("stop", f"Stop: {program}", "stop", lambda: self._stop(handle))
            button.mark(f"stop-{handle.number}")
            button.tooltip("End this program, as Ctrl-C would; its robot stops. A second press ends it at once")
        elif self._desk.may_run_programs:
            button = icon_button("replay", f"Start again: {program}", "start-again", lambda: self._again(handle))
            button.mark(f"start-again-{handle.number}").tooltip("Start this program again, with the same arguments")

    def _choose(self, handle: Handle) -> None:
        self._show(handle)
        self.refresh()

    def _show(self, handle: Handle | None) -> None:
        """Show the output of another program."""
        self._shown = handle
        self._next_line = 0
        self._log.clear()

    def _add_output(self) -> None:
        """Show the output since the last refresh."""
        if self._shown is None or self._shown.output is None:
            return
        first, lines = self._shown.output.since(self._next_line)
        left_out = first - self._next_line + max(len(lines) - NEWEST_LINES, 0)
        if left_out:
            self._log.push(f"... {left_out} lines are left out ...", classes="text-italic")
        for line in lines[-NEWEST_LINES:]:
            self._log.push(line.text, classes="program-error" if line.is_error else "")
        self._next_line = first + len(lines)

    @told
    async def _stop(self, handle: Handle) -> None:
        self._desk.check_present()
        self._desk.programs.stop(handle)
        self.refresh()

    @told
    async def _again(self, handle: Handle) -> None:
        await self._start(handle.command, handle.robot)

    # ---- the editor ----

    def _build_editor(self) -> None:
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            self._choice = named(ui.select({}, label="Program", on_change=self._open), "script")
            self._choice.classes("col").props("dense options-dense")
            self._choice.tooltip("Your programs in the desk's folder, and examples that come with KiKS")
            icon_button("note_add", "New program", "new-program", self._new).tooltip("Write a new program")
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            self._robot = named(ui.select({1: "robot 1"}, value=1, label="Runs on"), "robot")
            self._robot.props("dense").tooltip("The robot that answers on every port that the program opens")
            self._arguments = named(ui.input("Arguments"), "arguments")
            self._arguments.classes("col").props("dense").tooltip("Command-line arguments of the program; usually none")
            run = named(ui.button("Run", icon="play_arrow", on_click=self._run), "run-program")
            run.props("unelevated no-caps color=primary")
            run.tooltip("Save and run this program (Ctrl-Enter); first stops a program that runs on this robot")
        # Here, the page's shortcut keys (space, .) are text.
        with ui.element("div").classes("w-full").on("keydown", js_handler="(event) => event.stopPropagation()"):
            keys: dict[str, Any] = {"Ctrl-Enter": self._run, "Cmd-Enter": self._run}
            self._editor = ui.codemirror(NEW, language="Python", theme="basicLight", keymap=keys)
            named(self._editor, "editor").on_value_change(self._note_draft)
            self._editor.classes("w-full").style("height: 38vh; border: 1px solid currentcolor")
        self._mistake = named(ui.label().classes("program-error text-body2").props("role=alert"), "mistake")
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            self._name = named(ui.input("Saved as", value="mine.py"), "name").classes("col").props("dense")
            self._name.tooltip("The file in the desk's folder in which the program is saved before it runs")
            save = named(ui.button("Save", on_click=self._save), "save-program").props("flat no-caps")
            save.tooltip("Save the program in the desk's folder")
        self._offer()
        self._choice.value = next(script for script in self._choice.options if script.name == "first_steps.py")
        ui.timer(0, self._dress_editor, once=True)
        ui.on("desk-dark", lambda event: self._set_theme(bool(event.args)))

    def _dress_editor(self) -> None:
        """Set the accessible name of the editor, and make its theme follow the page's."""
        ui.run_javascript("""
            const tell = () => emitEvent("desk-dark", document.body.classList.contains("body--dark"));
            new MutationObserver(tell).observe(document.body, { attributeFilter: ["class"] });
            tell();
            const name = () => {
                const text = document.querySelector("[data-testid=editor] .cm-content");
                if (text) text.setAttribute("aria-label", "Program. Escape, then Tab leaves it.");
                else requestAnimationFrame(name);
            };
            name();
        """)

    def _set_theme(self, is_dark: bool) -> None:
        self._editor.theme = "vscodeDark" if is_dark else "basicLight"

    def _offer(self) -> None:
        """Update the list of programs."""
        self._choice.set_options({script: script.label for script in offered(self._desk.folder)})

    @told
    async def _open(self) -> None:
        """Show the selected program with its unsaved changes."""
        script = self._choice.value
        if script is None or script == self._script:
            return
        text = self._drafts.get(script)
        if text is None or text == self._known.get(script):
            text = self._known[script] = read_script(self._desk.folder, script)
        self._script = script
        self._name.value = script.name
        self._editor.value = text
        self._mistake.text = ""

    def _new(self) -> None:
        self._script = None
        self._choice.value = None
        self._name.value = "mine.py"
        self._editor.value = NEW
        self._mistake.text = ""

    def _note_draft(self) -> None:
        self._drafts[self._script] = self._editor.value or ""
        self._mistake.text = ""

    def _store(self) -> Script:
        """Save the program under its name and return its script; an unchanged example needs no saving."""
        text = self._editor.value or ""
        script, folder = self._script, self._desk.folder
        if script is not None and script.is_example and text == read_script(folder, script):
            return script
        saved = save_script(folder, self._name.value or "", text, may_replace=script, known=self._known.get(script))
        self._known[saved] = text
        self._drafts.pop(self._script, None)
        self._script = saved
        self._name.value = saved.name
        self._offer()
        self._choice.value = saved
        return saved

    @told
    async def _save(self) -> None:
        script = self._store()
        where = "an unchanged example, with nothing to save" if script.is_example else f"saved in {self._desk.folder}"
        ui.notify(f"{script.name} is {where}.")

    @told
    async def _run(self) -> None:
        """Check the program, save it and run it."""
        mistake = find_mistake(self._editor.value or "")
        if mistake is not None:
            self._mistake.text = str(mistake)
            return
        arguments = split_arguments(self._arguments.value or "")
        command = Command(path_of(self._desk.folder, self._store()), arguments)
        await self._start(command, self._robot.value or 1)

    async def _start(self, command: Command, robot: int) -> None:
        """Start a program on a robot after stopping the one that runs there."""
        desk, programs = self._desk, self._desk.programs
        desk.check_present()
        for handle in list(programs.handles):
            if handle.robot == robot and handle.is_running:
                programs.stop(handle)
                while handle.is_running:
                    await asyncio.sleep(POLL_S)
        handle = await desk.change(lambda _: programs.start(command, robot))
        self._show(handle)
        self.refresh()
        if desk.is_paused:
            ui.notify("Time is paused. Press space to run it; then the program continues.")
