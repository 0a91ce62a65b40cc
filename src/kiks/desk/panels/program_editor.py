"""The editor of programs: it opens, checks and saves them, and keeps what is typed."""

from __future__ import annotations

import asyncio
import shlex
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from nicegui import background_tasks, ui
from nicegui.events import GenericEventArguments

from kiks.desk.panels.debug_bar import DebugBar
from kiks.desk.panels.files import save_in
from kiks.desk.panels.kept_text import Kept, KeptText
from kiks.desk.panels.widgets import WEB, icon_button, named, offer_robots, select, text_button
from kiks.desk.server import scripts
from kiks.desk.server.desk import Desk
from kiks.desk.server.merging import merged
from kiks.desk.server.scripts import EXAMPLES, NEW
from kiks.errors import KiksError, ParameterError
from kiks.model.exercise import STUDENT, Exercise
from kiks.model.program_kinds import ProgramKind, program_kind
from kiks.ports.program_command import ProgramCommand

CHECKED_MAX = 100_000
"""Most characters of a program that is checked while a person types: compiling more would take too long."""

OTHERS_FILES_MAX = 100
"""Most programs of a student in a room."""

LIGHT: Final = "githubLight"
DARK: Final = "githubDark"
"""Themes of the editor whose words all have a contrast of 4.5 to 1 or more."""

DRESS = (WEB / "program_editor.js").read_text(encoding="utf-8")
"""Prepares the editor in a browser."""


class ProgramEditor:
    """The editor of programs.

    Args:
        desk: The desk.
        kept: Keeps in the browser what is typed; None: it is not kept.
        run: Runs the program.
        debug: Runs it with the debugger.

    Attributes:
        bar: The debugger.
    """

    def __init__(
        self,
        desk: Desk,
        kept: KeptText | None,
        run: Callable[[], Awaitable[None]],
        debug: Callable[[], Awaitable[None]],
    ) -> None:
        self._desk, self._kept = desk, kept
        self._folder = scripts.ProgramFolder(desk.folder)
        self._folder.count_max = OTHERS_FILES_MAX if desk.rights.is_for_others else None
        self._world: object = None
        self._script: Path | None = None
        self._exercise: Exercise | None = None
        self._text: str | None = NEW  # as it was read or saved last; None with a draft
        self._drafts = desk.drafts  # so a page that is closed or loaded again loses nothing
        self._shown_arguments = ""  # where something else stands, a person has typed it
        self._is_saving = False
        self._seen = self._checked = self._told = NEW
        self._wrong: list[dict[str, Any]] = []
        self._marks: list[dict[str, Any]] | None = None
        self._shown_places: object = None
        ui.add_css(WEB / "program_editor.css")
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            tip = "Your programs in the desk's folder, those of its project, and examples that come with KiKS"
            self._choice = select("Program", "script", {}, None, tip, self._open).classes("col")
            icon_button("note_add", "New program", "new-program", lambda: self._new(), tip="Write a new program")
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            tip = "The robot that answers on every port that the program opens"
            self._robot = select("Runs on", "robot", {1: "robot 1"}, 1, tip)
            self._arguments = named(ui.input("Arguments"), "arguments")
            self._arguments.classes("col").props("dense").tooltip("Command-line arguments of the program; usually none")
            tip = "Save and run this program (Ctrl-Enter); first stops a program that runs on this robot"
            text_button("Run", "play_arrow", "run-program", tip, run, look="unelevated color=primary")
            tip = "Save this program, begin the world again, and stop at the lines whose numbers you have clicked"
            if desk.rights.owns_world:
                text_button("Debug", "bug_report", "debug-program", tip, debug)
        self.bar = DebugBar(desk, lambda: self.robot, self._mark)
        # Here, the page's shortcut keys (space, .) are text.
        self._box = ui.element("div").classes("w-full desk-program")
        with self._box.on("keydown", js_handler="(event) => event.stopPropagation()"):
            keys: dict[str, Any] = {"Ctrl-Enter": run, "Cmd-Enter": run}
            self._editor = ui.codemirror(NEW, language="Python", theme=LIGHT, keymap=keys)
            named(self._editor, "editor").on_value_change(self._note_draft).classes("w-full desk-editor")
        self.bar.build_values()
        self._mistake = named(ui.label().classes("desk-error text-body2").props("role=status"), "mistake")
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            self._name = named(ui.input("Saved as", value="mine.py"), "name").classes("col").props("dense")
            self._name.tooltip("The file in the desk's folder in which the program is saved before it runs")
            text_button("Save", None, "save-program", "Save the program in the desk's folder", self._save, look="flat")
        self._offer()
        ui.timer(0, lambda: ui.run_javascript(DRESS), once=True)
        ui.on("desk-dark", lambda event: self._set_theme(bool(event.args)))
        ui.on("desk-breakpoint", self._toggle_breakpoint)

    @property
    def robot(self) -> int:
        """The number of the robot that the program shall run on."""
        return self._robot.value or 1

    @property
    def text(self) -> str:
        """The program."""
        return self._editor.value or ""

    def refresh(self, attached: dict[int, ProgramCommand]) -> None:
        """Check and save what is typed, and show the program of a project that has been opened.

        Args:
            attached: The programs of the project by the numbers of their robots.
        """
        offer_robots(self._robot, self._desk)
        is_still = self._check_pause()
        if self._desk.rights.is_for_others:
            self._follow_file(is_still=is_still)
        if self._world is not self._desk.present:
            self._choose_attached(attached, is_first=self._world is None)
            self._world = self._desk.present

    # ---- which program ----

    def _choose_attached(self, attached: dict[int, ProgramCommand], *, is_first: bool) -> None:
        """Show the program of the project that has been opened: in an exercise that of the student.

        If it has none, a new exercise begins with its template, and all else with an example.
        """
        self._offer()
        exercise = self._desk.project.exercise
        if is_first and self._drafts:
            self._exercise = exercise
            self._go_on_writing(next(reversed(self._drafts)))
            return
        if exercise is not None:
            if STUDENT not in attached:
                if exercise != self._exercise:
                    self._exercise = exercise
                    self._begin_exercise(exercise)
                return
            attached = {STUDENT: attached[STUDENT]}
        for robot, command in attached.items():
            if (program := command.program.resolve()) in self._choice.options:
                if self._script in self._drafts:
                    return  # a person writes another program
                self._choice.value, self._robot.value = program, robot
                if self._arguments.value == self._shown_arguments:
                    self._arguments.value = self._shown_arguments = shlex.join(command.arguments)
                return
        if is_first:
            self._choice.value = EXAMPLES / "first_steps.py"

    def _go_on_writing(self, script: Path | None) -> None:
        """Show what was written last, maybe on a page that was closed since."""
        if script in self._choice.options:
            self._choice.value = script
        else:
            text, self._text = self._drafts[script], None
            self._edit(None, self._name_of_exercise(self._exercise) if self._exercise else self._name.value, text)

    def _name_of_exercise(self, exercise: Exercise) -> str:
        return scripts.name_of(exercise.title or self._desk.project.arena.name)

    def _is_of_exercise(self, name: str) -> bool:
        return self._exercise is not None and name == self._name_of_exercise(self._exercise)

    def _begin_exercise(self, exercise: Exercise) -> None:
        """Show the student's program of an exercise, which may be there from an earlier day; else its template."""
        name = self._name_of_exercise(exercise)
        self._robot.value = STUDENT
        if (program := self._folder.path / name) in self._choice.options:
            self._choice.value = program
        else:
            self._new(name, exercise.template or NEW)

    def _offer(self) -> None:
        """Update the list of programs."""
        desk = self._desk
        attached = [command for number in range(1, desk.sim.robot_count + 1) if (command := desk.attached(number))]
        self._choice.set_options(scripts.offered(self._folder, attached))

    def _open(self) -> None:
        """Show the selected program; at once, as it may be handed in with the next step."""
        script = self._choice.value
        if script is not None and script != self._script:
            self._load(script)

    def _load(self, script: Path) -> None:
        """Show a program with its unsaved changes."""
        draft = self._drafts.get(script)
        self._text = scripts.read_script(script) if draft is None else None
        if draft is None and script.parent == self._folder.path:
            self._folder.open(script.name)
        self._edit(script, script.name, draft or self._text or "")

    def _new(self, name: str = "mine.py", text: str = NEW) -> None:
        self._desk.debugging.breakpoints.pop(None, None)
        self._choice.value = None
        self._text = text
        self._edit(None, name, text)

    def _edit(self, script: Path | None, name: str, text: str) -> None:
        self._script = script
        self._name.value = name
        self._editor.set_language("Octave" if program_kind(Path(name)) is ProgramKind.OCTAVE else "Python")
        self._told = self._editor.value = text
        self._send_saved()
        self.check()

    def _set_theme(self, is_dark: bool) -> None:
        self._editor.theme = DARK if is_dark else LIGHT

    # ---- while a person types ----

    def _send_saved(self) -> None:
        """Tell the browser which text is saved, so that it keeps any other."""
        if self._kept is not None:
            self._kept.know(self._editor, self._name.value or "", self._text)

    def _note_draft(self) -> None:
        debugging, before, self._told = self._desk.debugging, self._told, self.text
        if before != self.text and (lines := debugging.breakpoints.get(self._script)):
            debugging.set_breakpoints(self._script, scripts.moved(lines, before, self.text))
        self._drafts.pop(self._script, None)
        if self.text != self._text:
            self._drafts[self._script] = self.text

    def _check_pause(self) -> bool:
        """Look for a mistake when the person has stopped to type; return whether that is so."""
        text, before = self.text, self._seen
        self._seen = text
        if text == before and text != self._checked and len(text) <= CHECKED_MAX:
            self.check()
        return text == before

    def check(self) -> bool:
        """Mark the first mistake of the program, and return whether there is one."""
        self._checked = self.text
        mistake = scripts.find_mistake(self._checked, self._name.value or "")
        self._mistake.text = "" if mistake is None else str(mistake)
        self._wrong = marks = []
        if mistake is not None:
            marks.append({"kind": "line", "line": mistake.line, "class": "program-wrong-line"})
            if mistake.end > mistake.begin:
                place = {"from": mistake.begin, "to": mistake.end}
                marks.append({"kind": "mark", **place, "class": "program-wrong"})
        self._marks = None  # set anew, as the text may be another one
        self._editor.line_tooltips = {} if mistake is None else {mistake.line: mistake.message}
        self._mark()
        return mistake is not None

    def _mark(self) -> None:
        """Mark mistakes, breakpoints, where the program stands, and where it was at the time that is shown."""
        debugging, last = self._desk.debugging, self.text.count("\n") + 1
        here, then = self._place(self.bar.place), self._place(debugging.located)
        lines = [(line, "program-breakpoint") for line in debugging.breakpoints.get(self._script, ())]
        lines += [(here, "program-here"), (then, "program-then")]
        marks = [{"kind": "line", "line": line, "class": look} for line, look in lines if 0 < line <= last]
        if (marks := self._wrong + marks) != self._marks:
            self._marks = marks
            self._editor.decorations = marks
        if (then or here) and self._shown_places != (self.bar.place, then):
            self._editor.reveal_line(min(then or here, last))
        self._shown_places = self.bar.place, then

    def _place(self, place: tuple[str, int] | None) -> int:
        """Return the line of a place in the program that is shown; 0 if it is none."""
        is_here = place is not None and self._script is not None and Path(place[0]).resolve() == self._script.resolve()
        return place[1] if place is not None and is_here else 0

    def _toggle_breakpoint(self, event: GenericEventArguments) -> None:
        """Set a breakpoint at a line, or remove the one that is there."""
        debugging, line = self._desk.debugging, event.args
        if isinstance(line, int) and 0 < line <= self.text.count("\n") + 1:
            lines = {line}.symmetric_difference(debugging.breakpoints.get(self._script, ()))
            debugging.set_breakpoints(self._script, sorted(lines))

    def _follow_file(self, *, is_still: bool) -> None:
        """Keep editor and file the same: what a person types is saved, and what another page saves is shown.

        So nothing is lost when a room ends, and student and lecturer see the same program; what both type at the same
        time is put together.

        Args:
            is_still: Whether the person has stopped to type.
        """
        script, folder = self._script, self._folder
        is_own = script is not None and script.parent == folder.path
        if self.text != self._text:
            if is_still and (is_own or script is None) and not self._is_saving:
                self._is_saving = True
                background_tasks.create(self._save_silently(), name="kiks program")
        elif is_own and script is not None and not folder.is_known(script.name) and script.is_file():
            with suppress(ParameterError):
                self._load(script)
        elif script is None and self._is_of_exercise(name := self._name.value or "") and (folder.path / name).is_file():
            self._offer()
            self._choice.value = folder.path / name  # another page of this desk has begun it

    # ---- saving ----

    async def _save_silently(self) -> None:
        """Save the program under its name, if no other one has it."""
        script, text, folder = self._script, self.text, self._folder
        try:
            name = folder.full_name(script.name if script is not None else self._name.value or "")
            is_own = script is not None or self._is_of_exercise(name)
            saved = self._joined(folder.path / name, self._text, text)[1] if is_own else text
            await self._write(name, saved, may_replace=is_own)
        except KiksError:
            return  # "Save" says what is wrong
        finally:
            self._is_saving = False
        if self._script == script and not self._box.is_deleted:
            with self._box:
                self._note_saved(script, folder.path / name, saved)
                if saved == text:
                    self._send_saved()
                else:  # with what was typed since
                    self._edit(self._script, name, merged(text, self.text, saved))

    async def take(self, kept: Kept) -> bool:
        """Save what was typed while the connection was away, with what was saved here meanwhile, and show it.

        Returns:
            Whether there was something that had not come here.
        """
        folder = self._folder
        file = folder.path / folder.full_name(kept.name)
        is_open = self._script == file or (self._script is None and self._name.value == kept.name)
        if is_open and kept.text == self.text != self._text:
            return False  # it has come, and is saved at the next pause
        there, text = self._joined(file, kept.base, kept.text)
        if text != there:
            await self._write(file.name, text, may_replace=True)
            before = self._text if is_open else None
            self._note_saved(self._script if is_open else file, file, text)
            self._edit(file, file.name, text if before is None else merged(before, self.text, text))
            ui.notify(f"What you typed while the connection was away is saved in {file.name}.", type="positive")
        if self._kept is not None:
            self._kept.forget(kept)
        return text != there

    @staticmethod
    def _joined(file: Path, base: str | None, text: str) -> tuple[str, str]:
        """Return what a program's file has now, and that together with what was typed.

        Args:
            file: The file.
            base: What both began with; None if that is not known.
            text: The program as it was typed.
        """
        there = scripts.read_script(file) if file.is_file() else base or ""
        return there, merged(there if base is None else base, text, there)

    async def _write(self, name: str, text: str, *, may_replace: bool) -> None:
        """Write a file, without a question: nothing that it replaces is lost."""
        if may_replace:
            self._folder.question(name)
        data = scripts.encode_script(text, name)
        await asyncio.to_thread(self._folder.save, data, name, "a program", may_replace=may_replace)

    def _note_saved(self, script: Path | None, file: Path, text: str) -> None:
        """Note that what was a draft of a script is saved in a file, and let the list show that."""
        self._drafts.pop(script, None)
        if script != file and (lines := self._desk.debugging.breakpoints.pop(script, None)):
            self._desk.debugging.breakpoints[file] = lines
        self._script, self._text = file, text
        self._offer()
        self._choice.value = file

    async def _stored(self) -> Path | None:
        """Save the program under its name and return its file; None if another one would be replaced and is to stay."""
        script, text, folder, name = self._script, self.text, self._folder, self._name.value or ""
        data = scripts.encode_script(text, name)
        is_own = script == folder.path / folder.full_name(name)
        if (saved := await save_in(folder, (data, {}), name, "a program", is_own=is_own)) is None:
            return None
        self._name.value = saved
        self._note_saved(script, folder.path / saved, text)
        self._send_saved()
        return self._script

    async def _save(self) -> None:
        if (script := await self._stored()) is not None:
            ui.notify(f"{script.name} is saved in {self._desk.folder}.")

    async def command(self) -> ProgramCommand | None:
        """Check the program, save it, and return how it is started; None if a person wants it otherwise.

        A program from elsewhere, such as an example, is saved only if it was changed.

        Raises:
            ParameterError: If it has a mistake.
        """
        if self.check():
            raise ParameterError(f"The program has a mistake. {self._mistake.text}")
        arguments = scripts.split_arguments(self._arguments.value or "")
        script = self._script
        is_kept = script is not None and (script.parent != self._folder.path or scripts.is_notebook(script.name))
        if script is None or not is_kept or self._editor.value != scripts.read_script(script):
            script = await self._stored()
        return None if script is None else ProgramCommand(script, arguments)
