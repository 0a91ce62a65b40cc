"""The console, in which a person types commands to a robot."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from kiks.desk.panels.widgets import icon_button, told
from kiks.desk.server.desk import Desk
from kiks.firmware.commands import COMMANDS
from kiks.firmware.commands import Command as RobotCommand
from kiks.sim.console import Typed, type_lines

ROWS = 100
"""Maximum number of lines in the page."""

HISTORY_LIMIT = 100
"""Number of commands kept for the arrow keys."""

SUGGESTIONS = 6
"""Maximum number of suggested commands."""


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
        """Add a line that was sent."""
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


class ConsolePanel:
    """An input line and a log of commands and replies.

    Args:
        desk: The desk.
        robot: Returns the number of the robot that gets the commands.
    """

    def __init__(self, desk: Desk, robot: Callable[[], int]) -> None:
        self._desk = desk
        self._of_robot = robot
        self._history = History()
        self._waiting: list[Typed] = []
        ui.label("Commands to the robot").classes("text-subtitle2")
        self._rows = (
            ui.log(max_lines=ROWS)
            .classes("w-full text-caption")
            .style("height: 7rem")
            .props('data-testid="console-log" aria-label="What you typed, and the replies"')
            .mark("console-log")
        )
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            self._line = (
                ui.input("Command", placeholder="D,5,5", on_change=self._suggest)
                .classes("col")
                .props('dense autocomplete=off autocapitalize=off spellcheck=false data-testid="console"')
                .mark("console")
                .on("keydown.enter", self._send)
                .on("keydown.up.prevent", self._back)
                .on("keydown.down.prevent", self._forth)
                .tooltip("A command for the robot, such as D,5,5 to drive; the arrow keys recall earlier ones")
            )
            icon_button("send", "Send", "console-send", self._send).tooltip("Send the command on the robot's line")
        self._hints = ui.column().classes("w-full gap-0").mark("hints").props('data-testid="hints"')
        self._suggest()

    def refresh(self) -> None:
        """Show new replies."""
        while self._waiting and self._waiting[0].reply is not None:
            typed = self._waiting.pop(0)
            for line in (typed.reply or "(no reply)").split("\n"):
                self._rows.push(f"{typed.reply_s or 0:8.3f} ← {line}", classes="wire-row wire-received")

    @told
    async def _send(self) -> None:
        desk, text, robot = self._desk, (self._line.value or "").strip(), self._of_robot()
        sent = await desk.change(lambda sim: type_lines(sim, robot, text))
        self._history.add(text)
        self._line.value = ""
        self._waiting += sent
        for typed in sent:
            self._rows.push(f"{typed.time_s:8.3f} → {typed.text}", classes="wire-row wire-sent")
        if desk.is_paused:
            ui.notify("Time is paused. Press space to run it; then the robot answers.")

    def _back(self) -> None:
        self._line.value = self._history.back(self._line.value or "")

    def _forth(self) -> None:
        self._line.value = self._history.forth()

    def _suggest(self) -> None:
        """Show the commands that match the input."""
        self._hints.clear()
        with self._hints:
            for command in suggested(self._line.value or "")[:SUGGESTIONS]:
                with (
                    ui.button(on_click=lambda command=command: self._take(command))
                    .props("flat dense no-caps align=left")
                    .classes("w-full text-caption")
                ):
                    ui.label(help_of(command)).classes("text-left")

    def _take(self, command: RobotCommand) -> None:
        """Put a command into the input line for completion."""
        self._line.value = command.letter + ("," if command.parameters else "")
        self._line.run_method("focus")


def suggested(text: str) -> list[RobotCommand]:
    """Return the commands that match a text; without a text, some for the start.

    Example:
        >>> [command.letter for command in suggested("d,5")], [command.letter for command in suggested("speed")]
        (['D'], ['A', 'D', 'E', 'J'])
    """
    text = text.strip()
    if not text:
        return [command for command in COMMANDS if command.letter in "DNOHL"]
    letter = text.split(",")[0].upper()
    if len(letter) == 1:
        return [command for command in COMMANDS if command.letter == letter]
    return [command for command in COMMANDS if text.lower() in help_of(command).lower()]


def help_of(command: RobotCommand) -> str:
    """Return the syntax and help of a command in one line.

    Example:
        >>> help_of(COMMANDS[3])
        'D,left,right: set speed (pulses/10 ms, -127..127, clamped)'
    """
    form = ",".join((command.letter, *command.parameters))
    return f"{form}: {command.name}" + (f" ({command.limits})" if command.limits else "")
