"""The exercise panel: what is to be done, with hints that unfold, and how the program does in all cases."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from nicegui import ui

from kiks.desk.panels.exercise_dialog import ExerciseDialog, Template
from kiks.desk.panels.exercise_text import parts_of
from kiks.desk.panels.tries import TriesPanel
from kiks.desk.panels.widgets import Panel, heading, named, text_button
from kiks.desk.server.desk import Desk
from kiks.model.exercise import Exercise
from kiks.ports.program_command import ProgramCommand

CSS = """
.exercise-text { font-size: 15px; line-height: 1.5; overflow-wrap: anywhere }
.exercise-text :is(h1, h2, h3, h4) { font-size: 1.15rem; line-height: 1.3; font-weight: 500; margin: 1em 0 .3em }
.exercise-text :is(p, ul, ol, pre, table) { margin: .5em 0 }
.exercise-text :is(ul, ol) { padding-left: 1.4em }
.exercise-text ul { list-style: disc }
.exercise-text ol { list-style: decimal }
.exercise-text code { padding: 0 .25em; border-radius: 3px; background: rgba(127, 140, 155, .18); font-size: .93em }
.exercise-text pre { padding: 8px 10px; overflow: auto; border-radius: 6px; background: rgba(127, 140, 155, .18) }
.exercise-text pre code { padding: 0; background: none }
.exercise-text img { max-width: 100% }
.exercise-text a { color: #174a63; text-decoration: underline }
.body--dark .exercise-text a { color: #8fd0f0 }
.exercise-text :is(td, th) { padding: .15em .7em .15em 0; text-align: left }
.exercise-hint { border: 1px solid rgba(127, 140, 155, .5); border-radius: 6px; margin: 4px 0 }
"""


class ExercisePanel(Panel):
    """The exercise of a desk's project.

    Args:
        desk: The desk.
        program: Saves the program in the editor and returns it; None if a person wants it otherwise.
        template: Returns the program in the editor.
    """

    def __init__(self, desk: Desk, program: Callable[[], Awaitable[ProgramCommand | None]], template: Template) -> None:
        super().__init__(desk)
        self._shown: Exercise | None = None
        ui.add_css(CSS)
        with ui.column().classes("w-full q-pa-md gap-2"):
            self._text = named(ui.column().classes("w-full gap-0"), "exercise-text")
            ui.separator()
            self._tries = TriesPanel(desk, program)
            change = ExerciseDialog(desk, template).open
            tip = "Change the text, the goal, the cases or the template, and save the exercise"
            self._change = text_button("Change this exercise", "edit", "change-exercise", tip, change)
        self.refresh()

    def set_visible(self, is_visible: bool) -> None:
        """Follow the panel's tab."""
        super().set_visible(is_visible)
        self._tries.set_visible(is_visible)

    def refresh(self) -> None:
        """Show the text of another exercise."""
        self._change.set_visibility(not self._desk.is_locked)
        exercise = self._desk.project.exercise
        if exercise == self._shown:
            return
        self._shown = exercise
        self._text.clear()
        if exercise is None:
            return
        with self._text:
            if exercise.title:
                heading(exercise.title, "text-h6")
            for hint, html in parts_of(exercise.text):
                if not hint:
                    ui.html(html).classes("exercise-text w-full")
                    continue
                with named(ui.expansion(hint).classes("w-full exercise-hint").props("dense"), "hint"):
                    ui.html(html).classes("exercise-text w-full")
