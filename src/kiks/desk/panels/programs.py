"""The programs panel: the programs with their robots, states and output, and the editor to write and run one."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial

from nicegui import ui

from kiks.desk.panels.kept_text import KeptText
from kiks.desk.panels.program_editor import ProgramEditor
from kiks.desk.panels.widgets import LogBox, Panel, icon_button, named, with_props
from kiks.desk.server.desk import Desk
from kiks.errors import ParameterError
from kiks.ports.program_command import ProgramCommand
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
"""Shown in place of the editor, whose programs would not start (`kiks.ports.program_permission`)."""

NOT_OWN = (
    "Another program owns this world and drives its robots. Start yours there, or open a desk of your own: kiks desk."
)
"""Shown in place of the editor where the world is not the desk's own."""

ICONS = {"running": "play_circle", "stopping": "hourglass_top", "stopped": "stop_circle", "silenced": "volume_off"}
"""Icons of programs by state; all other states are ends."""


class ProgramsPanel(Panel):
    """The programs of a desk.

    Args:
        desk: The desk.
        kept: Keeps in the browser what is typed; None: it is not kept.

    Attributes:
        editor: The editor; None where no program can be started.
    """

    def __init__(self, desk: Desk, kept: KeptText | None = None) -> None:
        super().__init__(desk, REFRESH_S)
        self._drawn: object = None
        self._shown: Handle | None = None
        self._session: object = None
        self.editor: ProgramEditor | None = None
        with ui.column().classes("w-full q-pa-sm gap-2 no-wrap desk-programs"):
            if desk.rights.may_run_programs:
                debug = self.acting(partial(self._run, desk.debugging.begin))
                self.editor = ProgramEditor(desk, kept, self.acting(partial(self._run, self._start)), debug)
            else:
                named(ui.label(MAY_NOT if desk.rights.owns_world else NOT_OWN).classes("text-body2"), "may-not")
            self._list = named(ui.column().classes("w-full gap-1"), "programs")
            self._attached = named(ui.column().classes("w-full gap-0"), "attached")
            with ui.expansion("Output", value=True).classes("w-full").props("dense"):
                label = "What the program has printed"
                height = "clamp(5rem, 17vh, 14rem)"
                self._log = LogBox(height, "output", label, rows_max=SHOWN_LINES, new_max=NEWEST_LINES)
        self.refresh()

    def set_visible(self, is_visible: bool) -> None:
        """Follow the panel's tab."""
        super().set_visible(is_visible)
        if self.editor is not None:
            self.editor.bar.set_visible(is_visible)

    def refresh(self) -> None:
        """Show the programs, and what the chosen one prints."""
        desk = self._desk
        handles = list(desk.programs.handles)
        if self._shown not in handles:
            before, session = self._session, desk.debugging.session
            self._session = session
            # What was printed before a debugger went back is not printed again.
            self._show(handles[-1] if handles else None, is_same=before is session is not None)
        attached = {robot: command for robot in range(1, desk.sim.robot_count + 1) if (command := desk.attached(robot))}
        states = [(handle, handle.state, handle is self._shown) for handle in handles]
        drawn = states, desk.programs.players, attached, desk.names()
        if drawn != self._drawn:
            self._drawn = drawn
            self._list.clear()
            with self._list:
                self._draw_list(handles)
            self._attached.clear()
            with self._attached:
                self._draw_attached(attached)
        if self.editor is not None:
            self.editor.refresh(attached)
        if self._shown is not None and self._shown.output is not None:
            self._log.add(self._shown.output, lambda line: (line.text, "desk-error" if line.is_error else ""))

    def _draw_list(self, handles: list[Handle]) -> None:
        players = self._desk.programs.players
        if not handles and not players and self._desk.rights.owns_world:
            ui.label("No program runs.").classes("text-body2")
        for robot, state in players.items():
            name = self._desk.names()[robot - 1]
            named(ui.label(f"The program elsewhere of robot {name} {state}."), "player").classes("text-body2")
        for handle in handles:
            is_shown = handle is self._shown
            with ui.row().classes("w-full items-center no-wrap gap-1"):
                icon = ICONS.get(handle.state, "error_outline" if handle.code else "check_circle")
                button = ui.button(on_click=lambda handle=handle: self._choose(handle))
                button.props("flat align=left dense")
                look = "col text-weight-bold" if is_shown else "col"
                with with_props(button, aria_pressed=str(is_shown).lower()).classes(look):
                    ui.icon(icon).classes("q-mr-sm").props("aria-hidden=true")
                    ui.label(f"{handle.command.name} on robot {handle.robot}: {handle.state}")
                    ui.tooltip("Show what this program prints")
                self._draw_act(handle)

    def _draw_act(self, handle: Handle) -> None:
        """Add the button that stops a program or starts it again."""
        program = handle.command.name
        if handle.is_running:
            tip = "End this program, as Ctrl-C would; its robot stops. A second press ends it at once"
            icon_button("stop", f"Stop: {program}", "stop", lambda: self._stop(handle), tip=tip)
        elif self._desk.rights.may_run_programs:
            again = self.acting(lambda: self._start(handle.command, handle.robot))
            tip = "Start this program again, with the same arguments"
            icon_button("replay", f"Start again: {program}", "start-again", again, tip=tip)

    def _draw_attached(self, attached: dict[int, ProgramCommand]) -> None:
        """Say which programs belong to the project, each with the button that takes it out."""
        if not attached and self._desk.rights.may_run_programs:
            ui.label("The project has no program yet. Run one of yours, and it is saved with the project.")
        for robot, command in attached.items():
            with ui.row().classes("w-full items-center no-wrap gap-1"):
                name = self._desk.names()[robot - 1]
                ui.label(f"{command.name} starts with this world on robot {name}.").classes("col")
                if self._desk.rights.may_run_programs:
                    leave = self.acting(partial(self._leave_out, robot))
                    tip = "Save the project without this program; if it runs, it goes on"
                    icon_button("link_off", f"Leave out: {command.name}", "leave-out", leave, tip=tip)

    async def _leave_out(self, robot: int) -> None:
        self._desk.attach(None, robot)

    def _choose(self, handle: Handle) -> None:
        self._show(handle)
        self.refresh()

    def _show(self, handle: Handle | None, *, is_same: bool = False) -> None:
        """Show the output of another program, or below what is shown, that of the same one in a run made again."""
        self._shown = handle
        self._log.clear(keeps=is_same)

    async def _stop(self, handle: Handle) -> None:
        self._desk.check_present()
        self._desk.programs.stop(handle)
        self.refresh()

    # ---- the program in the editor ----

    async def command(self) -> ProgramCommand | None:
        """Save the program in the editor, and return how it is started; None if a person wants it otherwise."""
        if self.editor is None:
            raise ParameterError(MAY_NOT)
        return await self.editor.command()

    async def _run(self, start: Callable[[ProgramCommand, int], Awaitable[None]]) -> None:
        """Check the program, save it and start it on its robot, unless Halt is pressed meanwhile."""
        halt_count = self._desk.halt_count
        if self.editor is not None and not self.editor.check() and (command := await self.command()) is not None:
            if self._desk.halt_count == halt_count:
                await start(command, self.editor.robot)
            else:
                ui.notify(f"{command.name} was not started: Halt was pressed.")

    async def _start(self, command: ProgramCommand, robot: int) -> None:
        """Start a program on a robot after stopping the one that runs there."""
        desk, programs = self._desk, self._desk.programs
        if (desk.project.exercise or desk.debugging.session) is not None and desk.rights.owns_world:
            desk.attach(command, robot)
            # A run that is judged begins at time 0, with its programs.
            await desk.start_over()
            await desk.go_on()
            self._show(next((each for each in desk.programs.handles if each.robot == robot), None))
            return
        desk.check_present()
        for handle in list(programs.handles):
            if handle.robot == robot and handle.is_running:
                programs.stop(handle)
                while handle.is_running:
                    await asyncio.sleep(POLL_S)
        self._show(await desk.change(lambda _: programs.start(command, robot)))
        desk.attach(command, robot)
        if desk.is_paused:
            ui.notify("Time is paused. Press space to run it; then the program continues.")
