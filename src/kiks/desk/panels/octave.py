"""The Octave panel: the log of the session, and a line of commands for Octave or MATLAB to evaluate."""

from __future__ import annotations

from nicegui import ui

from kiks.desk.panels.command_line import CommandLine
from kiks.desk.panels.widgets import LogBox, Panel, heading, select
from kiks.desk.server.desk import Desk

ROWS_MAX = 10_000
"""Maximum number of lines of the log in the page."""

REFRESH_S = 0.25
"""Refresh period of the log and of the list of programs [s]."""

EXPLANATION = (
    "A command runs in that program, in its base workspace, with all the rights of the user who started it: as soon as "
    "the program uses its robot again, or at once at Octave's prompt. Its output appears here and in that program."
)


class OctavePanel(Panel):
    """The log and the command line of the programs of Octave and MATLAB."""

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk, REFRESH_S)
        self._next_line = 0
        self._last_line = ""
        ui.add_css(".kiks-log * { white-space: pre-wrap; overflow-wrap: anywhere }")
        with ui.column().classes("w-full q-pa-sm gap-2"):
            heading("Log", "text-subtitle2")
            self._rows = LogBox("55vh", "log", "Log of the session", rows_max=ROWS_MAX, new_max=ROWS_MAX).element
            self._rows.classes("kiks-log")
            programs = desk.outside.interpreters()
            self._choice = select("Commands for", "interpreter", programs, min(programs)).classes("w-full")
            CommandLine(
                self._send,
                label="Command for Octave or MATLAB",
                example="kSetSpeed(ref, 5, 5)",
                tip="A command of the language",
                verb="Evaluate",
                verb_tip="Evaluate the command",
                name="octave",
            )
            ui.label(EXPLANATION).classes("text-caption")
        self.refresh()

    def refresh(self) -> None:
        """Show new lines of the log, and the programs."""
        # The last line is read again, as a program may have replaced it.
        first, lines = self._desk.log.since(max(self._next_line - 1, 0))
        if lines and first == self._next_line - 1:
            if lines[0] == self._last_line:
                lines = lines[1:]
                first += 1
            else:
                [*self._rows][-1].delete()
        for line in lines:
            self._rows.push(line)
            self._last_line = line
        self._next_line = first + len(lines)
        programs = self._desk.outside.interpreters()
        if programs and programs != self._choice.options:
            kept = self._choice.value if self._choice.value in programs else min(programs)
            self._choice.set_options(programs, value=kept)
        self._choice.set_visibility(len(programs) > 1)

    async def _send(self, command: str) -> None:
        self._desk.outside.evaluate(self._choice.value, command)
        self.refresh()
