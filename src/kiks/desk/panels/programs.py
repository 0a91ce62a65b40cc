"""The programs panel: the programs with their robots, states and output, and an editor to write and run one."""

from __future__ import annotations

import asyncio
import shlex
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

from nicegui import background_tasks, ui

from kiks.desk.panels.files import Encoded, save_in
from kiks.desk.panels.kept_text import Kept, KeptText
from kiks.desk.panels.widgets import LogBox, Panel, icon_button, named, offer_robots, select, telling, told, with_props
from kiks.desk.server import scripts
from kiks.desk.server.desk import Desk
from kiks.desk.server.merging import merged
from kiks.desk.server.scripts import EXAMPLES, NEW
from kiks.errors import KiksError, ParameterError
from kiks.model.exercise import STUDENT, Exercise
from kiks.model.program_kinds import ProgramKind, program_kind
from kiks.ports.program_command import ProgramCommand
from kiks.ports.programs import Handle

REFRESH_S = 0.3
"""Refresh period of the list and the output [s]."""

SHOWN_LINES = 500
"""Maximum number of lines of output in the page."""

NEWEST_LINES = 100
"""Maximum number of lines of output that one refresh adds."""

CHECKED_MAX = 100_000
"""Most characters of a program that is checked while a person types: compiling more would take too long."""

OTHERS_FILES_MAX = 100
"""Most programs of a student in a room."""

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

CSS = """
.program-wrong-line { box-shadow: inset 3px 0 #b00020 }
.body--dark .program-wrong-line { box-shadow: inset 3px 0 #ff9a90 }
.program-wrong { text-decoration: underline wavy #d3281d; text-underline-offset: 3px }
.body--dark .program-wrong { text-decoration-color: #ff9a90 }
"""

LIGHT: Final = "githubLight"
DARK: Final = "githubDark"
"""Themes of the editor whose words all have a contrast of 4.5 to 1 or more."""

ICONS = {"running": "play_circle", "stopping": "hourglass_top", "stopped": "stop_circle", "silenced": "volume_off"}
"""Icons of programs by state; all other states are ends."""


class ProgramsPanel(Panel):
    """The programs of a desk.

    Args:
        desk: The desk.
        kept: Keeps in the browser what is typed; None: it is not kept.
    """

    def __init__(self, desk: Desk, kept: KeptText | None = None) -> None:
        super().__init__(desk, REFRESH_S)
        self._kept = kept
        self._folder = scripts.ProgramFolder(desk.folder)
        self._folder.count_max = OTHERS_FILES_MAX if desk.rights.is_for_others else None
        self._drawn: object = None
        self._world: object = None
        self._shown: Handle | None = None
        self._script: Path | None = None
        self._exercise: Exercise | None = None
        self._text: str | None = NEW  # as it was read or saved last; None with a draft
        self._drafts = desk.drafts  # so a page that is closed or loaded again loses nothing
        self._shown_arguments = ""  # where something else stands, a person has typed it
        self._is_saving = False
        self._seen = self._checked = NEW
        ui.add_css(CSS)
        with ui.column().classes("w-full q-pa-sm gap-2 no-wrap desk-programs"):
            if desk.rights.may_run_programs:
                self._build_editor()
            else:
                named(ui.label(MAY_NOT if desk.rights.owns_world else NOT_OWN).classes("text-body2"), "may-not")
            self._list = named(ui.column().classes("w-full gap-1"), "programs")
            self._attached = named(ui.column().classes("w-full gap-0"), "attached")
            with ui.expansion("Output", value=True).classes("w-full").props("dense"):
                label = "What the program has printed"
                height = "clamp(5rem, 17vh, 14rem)"
                self._log = LogBox(height, "output", label, rows_max=SHOWN_LINES, new_max=NEWEST_LINES)
        self.refresh()

    # ---- the list and the output ----

    def refresh(self) -> None:
        """Show the programs, and what the chosen one prints."""
        desk = self._desk
        handles = list(desk.programs.handles)
        if self._shown not in handles:
            self._show(handles[-1] if handles else None)
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
        if desk.rights.may_run_programs:
            offer_robots(self._robot, desk)
            is_still = self._check_pause()
            if desk.rights.is_for_others:
                self._follow_file(is_still=is_still)
            if self._world is not desk.present:
                self._choose_attached(attached, is_first=self._world is None)
                self._world = desk.present
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
                button.props("flat no-caps align=left dense")
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
                    leave = self.acting(partial(self._leave, robot))
                    tip = "Save the project without this program; if it runs, it goes on"
                    icon_button("link_off", f"Leave out: {command.name}", "leave-out", leave, tip=tip)

    async def _leave(self, robot: int) -> None:
        self._desk.attach(None, robot)

    def _choose_attached(self, attached: dict[int, ProgramCommand], *, is_first: bool) -> None:
        """Show the program of the project that has been opened: in an exercise that of the student.

        If it has none, a new exercise begins with its template, and all else with an example.
        """
        self._offer()
        project = self._desk.project
        if is_first and self._drafts:
            self._exercise = project.exercise
            self._go_on_writing(next(reversed(self._drafts)))
            return
        if (exercise := project.exercise) is not None:
            if (command := attached.get(STUDENT)) is not None:
                attached = {STUDENT: command}
            elif exercise != self._exercise:
                self._exercise = exercise
                self._begin_exercise(exercise)
                return
            else:
                return
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

    def _begin_exercise(self, exercise: Exercise) -> None:
        """Show the student's program of an exercise, which may be there from an earlier day; else its template."""
        name = self._name_of_exercise(exercise)
        self._robot.value = STUDENT
        if (program := self._folder.path / name) in self._choice.options:
            self._choice.value = program
        else:
            self._new(name, exercise.template or NEW)

    def _choose(self, handle: Handle) -> None:
        self._show(handle)
        self.refresh()

    def _show(self, handle: Handle | None) -> None:
        """Show the output of another program."""
        self._shown = handle
        self._log.clear()

    @told
    async def _stop(self, handle: Handle) -> None:
        self._desk.check_present()
        self._desk.programs.stop(handle)
        self.refresh()

    # ---- the editor ----

    def _build_editor(self) -> None:
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            tip = "Your programs in the desk's folder, those of its project, and examples that come with KiKS"
            self._choice = select("Program", "script", {}, None, tip, self._open).classes("col")
            icon_button("note_add", "New program", "new-program", lambda: self._new(), tip="Write a new program")
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            tip = "The robot that answers on every port that the program opens"
            self._robot = select("Runs on", "robot", {1: "robot 1"}, 1, tip)
            self._arguments = named(ui.input("Arguments"), "arguments")
            self._arguments.classes("col").props("dense").tooltip("Command-line arguments of the program; usually none")
            act = self.acting(self._run)
            run = named(ui.button("Run", icon="play_arrow", on_click=act), "run-program")
            run.props("unelevated no-caps color=primary")
            run.tooltip("Save and run this program (Ctrl-Enter); first stops a program that runs on this robot")
        # Here, the page's shortcut keys (space, .) are text.
        program = ui.element("div").classes("w-full desk-program")
        with program.on("keydown", js_handler="(event) => event.stopPropagation()"):
            keys: dict[str, Any] = {"Ctrl-Enter": act, "Cmd-Enter": act}
            self._editor = ui.codemirror(NEW, language="Python", theme=LIGHT, keymap=keys)
            named(self._editor, "editor").on_value_change(self._note_draft)
            self._editor.classes("w-full desk-editor")
        self._mistake = named(ui.label().classes("desk-error text-body2").props("role=status"), "mistake")
        with ui.row().classes("w-full items-end no-wrap gap-2"):
            self._name = named(ui.input("Saved as", value="mine.py"), "name").classes("col").props("dense")
            self._name.tooltip("The file in the desk's folder in which the program is saved before it runs")
            save = named(ui.button("Save", on_click=self._save), "save-program").props("flat no-caps")
            save.tooltip("Save the program in the desk's folder")
        self._offer()
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
                if (!text) return requestAnimationFrame(name);
                text.setAttribute("aria-label", "Program. Escape, then Tab leaves it.");
                text.tabIndex = 0;
            };
            name();
        """)

    def _set_theme(self, is_dark: bool) -> None:
        self._editor.theme = DARK if is_dark else LIGHT

    def _offer(self) -> None:
        """Update the list of programs."""
        desk = self._desk
        attached = [command for number in range(1, desk.sim.robot_count + 1) if (command := desk.attached(number))]
        self._choice.set_options(scripts.offered(self._folder, attached))

    def _open(self) -> None:
        """Show the selected program with its unsaved changes; at once, as it may be handed in with the next step."""
        script = self._choice.value
        if script is None or script == self._script:
            return
        with telling():
            draft = self._drafts.get(script)
            self._text = scripts.read_script(script) if draft is None else None
            if draft is None and script.parent == self._folder.path:
                self._folder.open(script.name)
            self._edit(script, script.name, draft or self._text or "")

    def _new(self, name: str = "mine.py", text: str = NEW) -> None:
        self._choice.value = None
        self._text = text
        self._edit(None, name, text)

    def _edit(self, script: Path | None, name: str, text: str) -> None:
        self._script = script
        self._name.value = name
        self._editor.set_language("Octave" if program_kind(Path(name)) is ProgramKind.OCTAVE else "Python")
        self._editor.value = text
        self._tell_saved()
        self._check()

    def _tell_saved(self) -> None:
        """Tell the browser which text is saved, so that it keeps any other."""
        if self._kept is not None:
            self._kept.know(self._editor, self._name.value or "", self._text)

    def _note_draft(self) -> None:
        self._drafts.pop(self._script, None)
        if (text := self._editor.value or "") != self._text:
            self._drafts[self._script] = text

    def _check_pause(self) -> bool:
        """Look for a mistake when the person has stopped to type; return whether that is so."""
        text, before = self._editor.value or "", self._seen
        self._seen = text
        if text == before and text != self._checked and len(text) <= CHECKED_MAX:
            self._check()
        return text == before

    def _follow_file(self, *, is_still: bool) -> None:
        """Keep editor and file the same: what a person types is saved, and what another page saves is shown.

        So nothing is lost when a room ends, and student and lecturer see the same program; what both type at the same
        time is put together.

        Args:
            is_still: Whether the person has stopped to type.
        """
        script, folder = self._script, self._folder
        is_own = script is not None and script.parent == folder.path
        if (self._editor.value or "") != self._text:
            if is_still and (is_own or script is None) and not self._is_saving:
                self._is_saving = True
                background_tasks.create(self._save_silently(), name="kiks program")
        elif is_own and script is not None and not folder.is_known(script.name) and script.is_file():
            with suppress(ParameterError):
                folder.open(script.name)
                self._text = scripts.read_script(script)
                self._edit(script, script.name, self._text)
        elif script is None and self._is_of_exercise(name := self._name.value or "") and (folder.path / name).is_file():
            self._offer()
            self._choice.value = folder.path / name  # another page of this desk has begun it

    async def _save_silently(self) -> None:
        """Save the program under its name, if no other one has it."""
        script, text, folder = self._script, self._editor.value or "", self._folder
        try:
            name = folder.full_name(script.name if script is not None else self._name.value or "")
            is_own = script is not None or self._is_of_exercise(name)
            saved = text
            if is_own:
                saved = self._joined(folder.path / name, self._text, text)[1]
                folder.question(name)
            data = scripts.encode_script(saved, name)
            await asyncio.to_thread(folder.save, data, name, "a program", may_replace=is_own)
        except KiksError:
            return  # "Save" says what is wrong
        finally:
            self._is_saving = False
        if self._script == script and not self._list.is_deleted:
            self._drafts.pop(script, None)
            self._script, self._text = folder.path / name, saved
            with self._list:
                self._offer()
                self._choice.value = self._script
                if saved == text:
                    self._tell_saved()
                else:  # with what was typed since
                    self._edit(self._script, name, merged(text, self._editor.value or "", saved))

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

    def _is_of_exercise(self, name: str) -> bool:
        return self._exercise is not None and name == self._name_of_exercise(self._exercise)

    def _check(self) -> bool:
        """Mark the first mistake of the program, and return whether there is one."""
        self._checked = self._editor.value or ""
        mistake = scripts.find_mistake(self._checked, self._name.value or "")
        self._mistake.text = "" if mistake is None else str(mistake)
        marks: list[dict[str, Any]] = []
        if mistake is not None:
            marks.append({"kind": "line", "line": mistake.line, "class": "program-wrong-line"})
            if mistake.end > mistake.begin:
                place = {"from": mistake.begin, "to": mistake.end}
                marks.append({"kind": "mark", **place, "class": "program-wrong"})
        self._editor.decorations = marks
        self._editor.line_tooltips = {} if mistake is None else {mistake.line: mistake.message}
        return mistake is not None

    async def _stored(self) -> Path | None:
        """Save the program under its name and return its file; None if another one would be replaced and is to stay."""
        script, text, folder = self._script, self._editor.value or "", self._folder
        name = self._name.value or ""
        encoded: Encoded = scripts.encode_script(text, name), {}
        is_own = script == folder.path / folder.full_name(name)
        saved = await save_in(folder, encoded, name, "a program", is_own=is_own)
        if saved is None:
            return None
        self._drafts.pop(script, None)
        self._script, self._text = folder.path / saved, text
        self._name.value = saved
        self._offer()
        self._choice.value = self._script
        self._tell_saved()
        return self._script

    async def take(self, kept: Kept) -> bool:
        """Save what was typed while the connection was away, with what was saved here meanwhile, and show it.

        Returns:
            Whether there was something that had not come here.
        """
        folder = self._folder
        file = folder.path / folder.full_name(kept.name)
        is_open = self._script == file or (self._script is None and self._name.value == kept.name)
        if is_open and kept.text == self._editor.value != self._text:
            return False  # it has come, and is saved at the next pause
        there, text = self._joined(file, kept.base, kept.text)
        is_new = text != there
        if is_new:
            folder.question(file.name)
            data = scripts.encode_script(text, file.name)
            await asyncio.to_thread(folder.save, data, file.name, "a program", may_replace=True)
            for script in (file, None) if is_open else (file,):
                self._drafts.pop(script, None)
            self._offer()
            before = self._text if is_open else None
            shown = text if before is None else merged(before, self._editor.value or "", text)
            self._text = text
            self._edit(file, file.name, shown)
            self._choice.value = file
            ui.notify(f"What you typed while the connection was away is saved in {file.name}.", type="positive")
        if self._kept is not None:
            self._kept.forget(kept)
        return is_new

    @told
    async def _save(self) -> None:
        script = await self._stored()
        if script is not None:
            ui.notify(f"{script.name} is saved in {self._desk.folder}.")

    @property
    def text(self) -> str:
        """The program in the editor; empty if there is no editor."""
        return self._editor.value or "" if self._desk.rights.may_run_programs else ""

    async def command(self) -> ProgramCommand | None:
        """Check the program in the editor, save it, and return how it is started; None if a person wants it otherwise.

        A program from elsewhere, such as an example, is saved only if it was changed.

        Raises:
            ParameterError: If it has a mistake.
        """
        if not self._desk.rights.may_run_programs:
            raise ParameterError(MAY_NOT)
        if self._check():
            raise ParameterError(f"The program has a mistake. {self._mistake.text}")
        arguments = scripts.split_arguments(self._arguments.value or "")
        script = self._script
        is_kept = script is not None and (script.parent != self._folder.path or scripts.is_notebook(script.name))
        if script is None or not is_kept or self._editor.value != scripts.read_script(script):
            script = await self._stored()
        return None if script is None else ProgramCommand(script, arguments)

    async def _run(self) -> None:
        """Check the program, save it and run it, unless Halt is pressed meanwhile."""
        halt_count = self._desk.halt_count
        if not self._check() and (command := await self.command()) is not None:
            if self._desk.halt_count == halt_count:
                await self._start(command, self._robot.value or 1)
            else:
                ui.notify(f"{command.name} was not started: Halt was pressed.")

    async def _start(self, command: ProgramCommand, robot: int) -> None:
        """Start a program on a robot after stopping the one that runs there."""
        desk, programs = self._desk, self._desk.programs
        if desk.project.exercise is not None and desk.rights.owns_world:
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
