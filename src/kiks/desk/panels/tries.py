"""The tries of a program in all cases of an exercise: the buttons, and a table of what has come out."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import PurePosixPath

from nicegui import ui

from kiks.desk.panels.widgets import Panel, icon_button, named
from kiks.desk.server.desk import Desk
from kiks.errors import ParameterError, counted
from kiks.model.exercise import STUDENT
from kiks.ports.program_command import ProgramCommand
from kiks.trials.trial import End, Outcome

CLOSED = "Handing in is closed now. Ask your lecturer to open it."
"""What people read who cannot hand in."""

ENDS = {
    End.ENDED: "The program ended by itself",
    End.RUNNING: "The program still ran when this was decided",
    End.OUT_OF_TIME: "The program still ran at the time limit",
    End.CRASHED: "The program crashed",
    End.ENDLESS: "The program let no time pass",
    End.STOPPED: "The program was stopped",
}
"""What people read of how a program has ended."""

CSS = """
.tries { width: 100%; border-collapse: collapse; font-size: 14px }
.tries :is(th, td) { padding: 5px 8px 5px 0; text-align: left; vertical-align: top }
.tries th { font-weight: 500 }
.tries tr { border-bottom: 1px solid rgba(127, 140, 155, .4) }
.tries .tries-number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }
.tries-detail { font-size: 12.5px; opacity: .85; overflow-wrap: anywhere; white-space: pre-wrap }
.tries-solved { color: #1b7a34; font-weight: 500 }
.body--dark .tries-solved { color: #7ddc95 }
.tries-failed { color: #b00020; font-weight: 500 }
.body--dark .tries-failed { color: #ff9a90 }
"""


class TriesPanel(Panel):
    """The buttons 'Try all' and 'Hand in', and the table.

    Args:
        desk: The desk.
        program: Saves the program in the editor and returns it; None if a person wants it otherwise.
    """

    def __init__(self, desk: Desk, program: Callable[[], Awaitable[ProgramCommand | None]]) -> None:
        super().__init__(desk)
        self._program = program
        self._drawn: object = None
        self._is_giving = False
        ui.add_css(CSS)
        with ui.row().classes("w-full items-center gap-2"):
            self._try = ui.button("Try all", icon="playlist_play", on_click=self.acting(self._begin))
            named(self._try.props("unelevated no-caps color=primary"), "try-all")
            self._try.tooltip("Run the program of the editor in all cases of this exercise")
            self._stop = ui.button("Stop", icon="stop", on_click=self.acting(self._end))
            named(self._stop.props("outline no-caps"), "stop-tries").tooltip("Stop these tries")
            self._hand_in = ui.button("Hand in", icon="outbox", on_click=self.acting(self._give))
            named(self._hand_in.props("outline no-caps"), "hand-in")
            self._hand_in.tooltip("Try the program in all cases, and hand in program, run and score as one file")
            self._said = named(ui.label().classes("text-body2").props("role=status"), "tries-state")
        self._table = named(ui.column().classes("w-full"), "tries")
        self.refresh()

    def refresh(self) -> None:
        """Show what has come out."""
        desk, tries = self._desk, self._desk.tries
        is_running = tries.is_running
        is_shown = tries.project is not None and tries.project.exercise == desk.project.exercise
        self._try.set_enabled(not is_running)
        self._stop.set_visibility(is_running)
        self._hand_in.set_enabled(desk.may_hand_in and not self._is_giving)
        told = tries.error, tries.is_waiting, desk.may_hand_in, tries.is_packing, tries.is_handed_in
        drawn = is_shown, is_running, len(tries.outcomes), told
        if drawn == self._drawn:
            return
        self._drawn = drawn
        self._said.text = "" if desk.may_hand_in else CLOSED
        self._table.clear()
        if is_shown:
            handed_in = "Handed in. " if tries.is_handed_in and desk.hand_in is not None else ""
            self._said.text = f"{handed_in}{self._state()}"
            if tries.outcomes:
                with self._table:
                    self._build_table()

    def _state(self) -> str:
        tries = self._desk.tries
        if tries.error:
            return tries.error
        if not (tries.outcomes or tries.is_running):
            return f"Stopped; {counted(len(tries.cases), 'case')} not tried."
        if tries.is_waiting:
            return "Others are trying their programs; yours is next after them."
        if tries.is_packing:
            return "Writing its page ..."
        if tries.is_running:
            return f"{len(tries.outcomes)} of {counted(len(tries.cases), 'case')} tried."
        of = "" if tries.is_whole else f", {len(tries.cases) - len(tries.outcomes)} not tried"
        count, outcomes = tries.taken_count, tries.come_out
        taken = f" {counted(count, 'case')} taken from earlier: nothing has changed." if count else ""
        return f"{outcomes.solved} of {len(outcomes)} solved, {counted(outcomes.points, 'point')}{of}.{taken}"

    def _build_table(self) -> None:
        tries = self._desk.tries
        with ui.element("table").classes("tries"), ui.element("tbody"):
            with ui.element("tr"):
                for word, look in (("Case", ""), ("Points", "tries-number"), ("Time", "tries-number"), ("Run", "")):
                    with ui.element("th").classes(look):
                        ui.label(word)
            for number, case in enumerate(tries.cases):
                if (outcome := tries.outcomes.get(number)) is not None:
                    self._build_row(number, case.name + " (hidden)" * case.is_hidden, outcome)

    def _build_row(self, number: int, name: str, outcome: Outcome) -> None:
        with named(ui.element("tr"), f"try-{number}"):
            with ui.element("td"):
                ui.label(name)
                how, look = ("solved", "solved") if outcome.is_solved else ("not solved", "open")
                how, look = ("failed", "failed") if outcome.is_failed else (how, look)
                ui.label(how).classes(f"tries-{look}")
                if text := _detail(outcome):
                    ui.label(text).classes("tries-detail")
            for text in (f"{outcome.points:g}", f"{outcome.time_s:.1f} s"):
                with ui.element("td").classes("tries-number"):
                    ui.label(text)
            with ui.element("td"):
                show = self.acting(partial(self._show, number))
                icon_button("play_circle", f"Show the run: {name}", f"show-try-{number}", show, tip="Show this run")

    async def _begin(self) -> None:
        if (command := await self._program()) is not None:
            self._desk.try_all(command)

    async def _end(self) -> None:
        self._desk.tries.stop()
        await self._desk.tries.ended()

    async def _show(self, number: int) -> None:
        await self._desk.looking.show_run(self._desk.tries.recording(number))

    async def _give(self) -> None:
        if not self._desk.may_hand_in:
            raise ParameterError(CLOSED)
        if (command := await self._program()) is None:
            return
        self._is_giving = True
        self.refresh()
        try:
            await self._hand_over(command, f"{PurePosixPath(command.name).stem}.zip")
        finally:
            self._is_giving = False

    async def _hand_over(self, command: ProgramCommand, name: str) -> None:
        desk, tries = self._desk, self._desk.tries
        if desk.hand_in is not None:
            await desk.give(command, name)
            ui.notify("Handed in. Now it is tried in all cases.", type="positive")
            return
        made: list[bytes] = []
        desk.try_all(command, made.append)
        self.refresh()
        await tries.ended()
        if tries.error:
            raise ParameterError(tries.error)
        for data in made:
            ui.download.content(data, name)
            ui.notify(f"{name} is in your browser's downloads. Send it to your lecturer.", type="positive")


def _detail(outcome: Outcome) -> str:
    """Return how the program has ended, and what it has printed last."""
    end = outcome.end_of(STUDENT)
    lines = [f"{ENDS[end.how]}: {end.detail}" if end.detail else f"{ENDS[end.how]}."]
    lines += [f"Printed last: {line}" for line in end.printed[-1:] if end.how != End.CRASHED]
    return "\n".join([*lines, *filter(None, [outcome.doubt])])
