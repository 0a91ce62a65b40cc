"""The dialog in which a lecturer makes an exercise of the desk's world."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

from nicegui import ui

from kiks.desk.panels.record_form import RecordForm
from kiks.desk.panels.widgets import agrees, answer, dialog, heading, icon_button, named, text_button
from kiks.desk.server.desk import Desk
from kiks.desk.server.folder import Folder
from kiks.desk.server.scripts import NEW
from kiks.errors import ParameterError, counted
from kiks.model.exercise import STUDENT, Cases, Exercise, cases_of
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.ports.resources import processor_count
from kiks.sim.judge import Judge, goal_names
from kiks.trials.exercise_check import check_exercise, findings_of
from kiks.trials.grading import load_exercise

STUDENTS = "-students"
"""What the name of the students' file has at its end."""

GOAL_LABELS = {"text": "In a line for people", "points": "Points", "robot": "Whose measures count (number of a robot)"}

GOAL_TIPS = {
    "text": "Students read it above the arena",
    "solved": "A formula: the run ends when it is true",
    "failed": "A formula: the run ends when it is true",
    "points": "A formula: what the run is worth at its end",
}

CASE_TIPS = {
    "name": "What people call these cases",
    "seed": "Such as 1, 2, 3 or 1..20",
    "start": "Places of robot 1: x, y, heading; x, y, heading",
    "arena": "Arenas in place of this one, such as maze, or files beside the exercise",
    "baud": "Speeds of the serial line, such as 9600, 38400",
    "thinking": "Such as none, fixed:5",
    "link": "Such as cable, bluetooth, wifi",
    "family": "Numbers of imperfect robots, such as 0, 1, 2; 0 is the exact one",
}

CSS = """
.exercise-dialog { width: 880px; max-width: 94vw !important }
.exercise-dialog > * { flex: none }
.exercise-dialog .desk-properties > * { min-width: 0 }
.exercise-check { white-space: pre-line; overflow-wrap: anywhere }
.exercise-names { display: grid; grid-template-columns: max-content 1fr; gap: 3px 14px; font-size: 13px }
.exercise-names code { white-space: nowrap }
.exercise-case { border: 1px solid rgba(127, 140, 155, .5); border-radius: 6px; padding: 10px; width: 100% }
@media (max-width: 599px) {
  .exercise-dialog .desk-properties { grid-template-columns: 1fr }
  .exercise-names { grid-template-columns: 1fr }
  .exercise-names code { white-space: normal }
}
"""

Template = Callable[[], str]


class ExerciseDialog:
    """Asks for all that makes an exercise of a world, and saves it.

    Args:
        desk: The desk.
        template: Returns the program in the editor.
    """

    def __init__(self, desk: Desk, template: Template) -> None:
        self._desk, self._template = desk, template
        self._folder = Folder(desk.folder)
        self._checks = 0
        ui.add_css(CSS)

    async def open(self) -> None:
        """Show the dialog."""
        self._desk.check_unlocked()
        project = self._desk.project
        with dialog("Save as exercise", "exercise-dialog") as self._dialog:
            self._build(project)
        await answer(self._dialog)

    def _build(self, project: Project) -> None:
        exercise, goal = project.exercise or Exercise(), project.goal or Goal()
        labels = {"text": "Text (Markdown)", "is_locked": "Students may not change walls, things and settings"}
        self._exercise = RecordForm(
            Exercise,
            vars(exercise),
            "exercise",
            labels=labels,
            tips={"text": "What students read. A section whose heading begins with Hint is folded until it is opened"},
            wide=("title",),
            long=("text",),
            left_out=("template",),
        )
        is_new = project.exercise is None
        word = "The program in the editor is the template"
        self._has_template = named(ui.switch(word, value=is_new), "use-template")
        heading("Goal")
        self._goal = RecordForm(
            Goal,
            vars(goal),
            "goal",
            labels=GOAL_LABELS,
            tips=GOAL_TIPS,
            wide=("text", "points"),
            examine=self._examine_goal,
        )
        self._seconds = named(ui.input("Time limit [s of simulated time]", value=f"{project.seconds or 60:g}"), "limit")
        self._seconds.props("dense outlined").classes("w-full")
        with ui.expansion("What formulas can say").classes("w-full").props("dense"):
            text = "Numbers, + - * /, comparisons, and, or, not, min, max, abs, round, a if b else c, and these names:"
            ui.label(text).classes("text-body2 q-mb-sm")
            with ui.element("div").classes("exercise-names"):
                for typed, meaning in goal_names().items():
                    with ui.element("code"):
                        ui.label(typed)
                    ui.label(meaning)
        heading("Cases")
        ui.label("Each value of one list with each of the others; empty: as this world is.").classes("text-body2")
        self._cases: list[tuple[RecordForm, ui.element]] = []
        self._case_list = ui.column().classes("w-full gap-2")
        for each in project.cases or (Cases(seed=(1, 2, 3)),):
            self._add_case(each)
        text_button("Another set of cases", "add", "add-case", "Add cases", lambda: self._add_case(Cases()))
        heading("File")
        word = "Robots and things begin where they are now"
        is_there = is_new or self._desk.sim.now_ns == 0
        self._begins_here = named(ui.switch(word, value=is_there), "begins-here")
        name = PurePosixPath(project.arena.name).name if not is_new else "exercise"
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            self._name = named(ui.input("Name", value=name).props("dense outlined").classes("col"), "exercise-name")
        self._also = named(ui.switch(value=True), "also-students")
        self._also.bind_text_from(
            self._name, "value", lambda name: f"Also save {_stem(name)}{STUDENTS}.kiks, without hidden cases"
        )
        self._said = named(ui.label().classes("exercise-check text-body2").props("role=status"), "exercise-check")
        with ui.row().classes("w-full justify-end"):
            self._close = ui.button("Cancel", on_click=lambda: self._dialog.submit(None))
            self._close.props("flat data-testid=dialog-no")
            save = ui.button("Save", on_click=self._save).props("unelevated data-testid=dialog-yes")
            save.tooltip(f"Save in {self._desk.folder}")

    def _add_case(self, cases: Cases) -> None:
        with self._case_list, ui.column().classes("exercise-case gap-2") as box:
            name = f"case-{len(self._cases)}"
            form = RecordForm(Cases, vars(cases), name, labels={"is_hidden": "Hidden from students"}, tips=CASE_TIPS)
            entry = form, box
            self._cases.append(entry)
            with ui.row().classes("w-full justify-end"):
                icon_button("delete", "Remove these cases", f"remove-{name}", partial(self._remove_case, entry))

    def _remove_case(self, entry: tuple[RecordForm, ui.element]) -> None:
        self._cases.remove(entry)
        entry[1].delete()

    async def _examine_goal(self, name: str, value: Any) -> None:
        """Check that this world has what a formula names."""
        goal = Goal(**{name: value})
        await self._desk.do(lambda sim: Judge(sim, goal))

    async def _made(self) -> tuple[Project, dict[str, bytes]]:
        """Return the exercise, and the files that have to be beside it."""
        goal: Goal = self._goal.record()
        await self._desk.do(lambda sim: Judge(sim, goal))
        try:
            seconds = float(self._seconds.value or "")
        except ValueError:
            raise ParameterError(f"The time limit must be a number, but it was {self._seconds.value!r}.") from None
        exercise: Exercise = self._exercise.record()
        template = self._template() if self._has_template.value else exercise.template
        file = f"{_stem(self._name.value)}.kiks"
        project, beside = await self._desk.project_to_save(file, _without_students_program)
        if not self._begins_here.value:
            project = replace(project, arena=replace(self._desk.project.arena, name=project.arena.name))
        made = replace(
            project,
            seconds=seconds,
            goal=goal,
            exercise=replace(exercise, template="" if template == NEW else template),
            cases=tuple(form.record() for form, _ in self._cases),
        )
        return made, beside

    async def _save(self) -> None:
        made, beside = await self._made()
        files = {f"{_stem(self._name.value)}.kiks": made}
        if self._also.value:
            files[f"{_stem(self._name.value)}{STUDENTS}.kiks"] = made.for_students()
        question = " ".join(filter(None, map(self._folder.question, files)))
        if question and not await agrees(question):
            return
        for name, project in files.items():
            data = await asyncio.to_thread(project.to_bytes)
            agreed = bool(question)
            await asyncio.to_thread(self._folder.save, data, name, "an exercise", may_replace=agreed, beside=beside)
        ui.notify(f"Saved as {' and '.join(files)} in {self._desk.folder}.", type="positive")
        self._close.text = "Close"
        await self._check(self._desk.folder / next(iter(files)))

    async def _check(self, file: Path) -> None:
        """Check a saved exercise, as `kiks exercise check` does, until the dialog is closed or saves another one."""
        project, home = load_exercise(file)
        cases = counted(len(cases_of(project.cases)), "case")
        self._said.text = f"Saved. Trying the template and programs that do nothing in {cases} ..."
        self._checks += 1
        number = self._checks
        graded = await asyncio.to_thread(
            check_exercise,
            project,
            home,
            is_trusted=self._desk.is_trusted,
            workers=max(processor_count() - 1, 1),
            goes_on=lambda: bool(self._dialog.value) and number == self._checks,
        )
        if graded is not None:
            nothing = f"A check in {cases} has found nothing to be looked at. Can it be solved?"
            command = f"kiks exercise check {file.name} --solution PROGRAM tries a solution."
            self._said.text = "\n".join([*(findings_of(project, graded) or [nothing]), command])


def _without_students_program(project: Project) -> Project:
    robots = list(project.robots)
    if robots:
        robots[STUDENT - 1] = replace(robots[STUDENT - 1], program=None, arguments=())
    return replace(project, robots=tuple(robots))


def _stem(name: object) -> str:
    return str(name or "exercise").strip().removesuffix(".kiks")
