"""The console, in which a person types commands to a robot."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from kiks.desk.panels.command_line import CommandLine
from kiks.desk.panels.widgets import LogBox, heading, named
from kiks.desk.server.desk import Desk
from kiks.firmware.robot_kind import RobotCommand, RobotKind, robot_kind
from kiks.sim.console import Typed, type_lines

ROWS = 100
"""Maximum number of lines in the page."""

SUGGESTIONS = 6
"""Maximum number of suggested commands."""


class ConsolePanel:
    """An input line and a log of commands and replies.

    Args:
        desk: The desk.
        robot: Returns the number of the robot that gets the commands.
    """

    def __init__(self, desk: Desk, robot: Callable[[], int]) -> None:
        self._desk = desk
        self._of_robot = robot
        self._waiting: list[Typed] = []
        heading("Commands to the robot", "text-subtitle2")
        label = "What you typed, and the replies"
        self._rows = LogBox("7rem", "console-log", label, rows_max=ROWS, new_max=ROWS, live="polite")
        self._line = CommandLine(
            self._send,
            label="Command",
            example="D,5,5",
            tip="A command for the robot, such as D,5,5 to drive",
            verb="Send",
            verb_tip="Send the command on the robot's line",
            name="console",
            on_change=self._suggest,
        )
        self._hints = named(ui.column().classes("w-full gap-0"), "hints")
        self._suggest()

    def refresh(self) -> None:
        """Show new replies."""
        while self._waiting and self._waiting[0].reply is not None:
            typed = self._waiting.pop(0)
            for line in (typed.reply or "(no reply)").split("\n"):
                self._rows.push(f"{typed.reply_s or 0:8.3f} ← {line}", "wire-row wire-received")

    async def _send(self, text: str) -> None:
        desk, robot = self._desk, self._of_robot()
        sent = await desk.change(lambda sim: type_lines(sim, robot, text))
        self._waiting += sent
        for typed in sent:
            self._rows.push(f"{typed.time_s:8.3f} → {typed.text}", "wire-row wire-sent")
        if desk.is_paused:
            ui.notify("Time is paused. Press space to run it; then the robot answers.")

    def _kind(self) -> RobotKind:
        specs, robot = self._desk.sim.specs, self._of_robot()
        return robot_kind(specs[robot - 1].kind if 1 <= robot <= len(specs) else "khepera")

    def _suggest(self) -> None:
        """Show the commands that match the input."""
        self._hints.clear()
        with self._hints:
            for command in suggested(self._kind(), self._line.text)[:SUGGESTIONS]:
                button = ui.button(on_click=lambda command=command: self._take(command))
                with button.props("flat dense align=left").classes("w-full text-caption"):
                    ui.label(command.help).classes("text-left")

    def _take(self, command: RobotCommand) -> None:
        """Put a command into the input line for completion."""
        self._line.complete(command.letter + ("," if command.parameters else ""))


def suggested(kind: RobotKind, text: str) -> list[RobotCommand]:
    """Return the commands that match a text; without a text, some for the start.

    Example:
        >>> khepera = robot_kind("khepera")
        >>> [[each.letter for each in suggested(khepera, text)] for text in ("d,5", "speed")]
        [['D'], ['A', 'D', 'E', 'J']]
    """
    text = text.strip()
    if not text:
        return [command for command in kind.commands if command.letter in kind.usual]
    letter = text.split(",")[0].upper()
    if len(letter) == 1:
        return [command for command in kind.commands if command.letter == letter]
    return [command for command in kind.commands if text.lower() in command.help.lower()]
