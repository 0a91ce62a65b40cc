"""The settings panel: seed, thinking time, baud rate, sensors and robots."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from nicegui import ui

from kiks.desk.panels.widgets import NumberField, Panel, heading, lock_note, named, select, text_button, with_props
from kiks.desk.server.desk import Desk
from kiks.model.project import Project, ProjectRobot
from kiks.model.radio_link import LINKS
from kiks.model.robot import RobotSpec, robot_names
from kiks.model.thinking_policy import split_thinking
from kiks.model.turrets import TURRETS

POLICIES = {
    "none": "none: computing takes no time",
    "fixed": "fixed: a constant time before each command",
    "live": "live: the measured time, times a factor",
    "replay": "replay: the times recorded in a file",
}

MODELS = {
    "": "the robot's own",
    "reflection": "reflection: physics, fitted to a real robot",
    "thesis": "thesis: the networks of the thesis of 2001",
    "fast": "fast: a table of those networks",
    "curve": "curve: a measured curve of one colour",
}

BAUDS = [9600, 19200, 38400, 57600, 115200]

MATLAB_KIKS_SETTINGS = """
*Time mode* and *CPU*: thinking `live` with a factor, above. *Time acceleration*: the speed above the arena.
*Movement limit* and *interpolation limit*: not needed, motion is exact at any speed. *Fast sensors*: sensor
model `fast`. *Grid*, *redraw* (clear trails) and *visualization*: the layers button above the arena. *KiKSnet*:
several robots in one world, each with its own program; `kiks host` for programs on other computers, `kiks serve` for
programs in any language.
"""


class SettingsPanel(Panel):
    """The settings of a world. Applying them restarts the world with everything where it stands."""

    def __init__(self, desk: Desk) -> None:
        super().__init__(desk)
        with ui.column().classes("w-full q-pa-md gap-3"):
            lock_note(desk)
            self._fields = ui.column().classes("w-full gap-3")
            with ui.row().classes("w-full"):
                tip = "Restart at time 0 with these settings; everything stays in place"
                apply = text_button("Apply", "check", "apply", tip, self.acting(self._apply), look="")
                tip = "Restart at time 0 with the same seed, programs and initial places"
                begin = self.acting(self._start_over)
                over = text_button("Start over", "replay", "start-over", tip, begin, look="outline")
            if not desk.rights.owns_world:
                ui.label("Another program owns this world. Change the settings there.").classes("text-caption")
                apply.disable()
                over.disable()
            ui.separator()
            heading("Display")
            old = named(ui.switch("Coordinates of KiKS 2.2.0", value=desk.has_old_coordinates), "old-coordinates")
            old.on_value_change(lambda: desk.show_old_coordinates(bool(old.value)))
            old.tooltip("x is a column and y a row of the arena's matrix, so y points down; sensors are 1 to 8")
            with ui.expansion("The settings of the Matlab KiKS").classes("w-full").props("dense"):
                ui.markdown(MATLAB_KIKS_SETTINGS).classes("text-body2")
        self._show()

    def _show(self) -> None:
        """Show the settings of the present world."""
        project = self._desk.project
        self._fields.clear()
        with self._fields:
            heading("Run")
            self._build_run(project)
            heading("Robots and sensors")
            self._build_robots(project)

    def _build_run(self, project: Project) -> None:
        policy, amount = split_thinking(project.thinking)
        file, amount = (amount, 1.0) if isinstance(amount, str) else ("", amount)
        self._seed = NumberField("Seed", "seed", project.seed, is_whole=True, min=0).props("outlined").classes("w-full")
        with_props(self._seed, hint="Whole number. The same seed gives the same run, to the bit.")
        hint = "How much simulated time the program's computing takes."
        self._policy = _choice("Thinking", "thinking", POLICIES, policy, hint)
        self._amount = NumberField("", "thinking-amount", amount, min=0).props("outlined").classes("w-full")
        self._amount.bind_visibility_from(self._policy, "value", lambda policy: policy in ("fixed", "live"))
        self._policy.on_value_change(self._name_amount)
        self._name_amount()
        self._file = named(ui.input("Recorded times", value=file), "thinking-file").classes("w-full")
        self._file.props("dense outlined")
        with_props(self._file, hint=f"A file in {self._desk.home.folder}, made with kiks run --save-thinking.")
        self._file.bind_visibility_from(self._policy, "value", lambda policy: policy == "replay")

    def _name_amount(self) -> None:
        label, hint = (
            ("Milliseconds", "Before each command.")
            if self._policy.value == "fixed"
            else ("CPU factor", "1: this computer; 2: a computer half as fast.")
        )
        with_props(self._amount, label=label, hint=hint)

    def _build_robots(self, project: Project) -> None:
        self._rows: list[_RobotRow] = []
        self._table = ui.column().classes("w-full gap-1")
        for robot in project.robots:
            self._add(robot)
        ui.button("Another robot", icon="add", on_click=self._add_row).props("flat dense data-testid=add-robot")
        specs = self._desk.sim.specs
        baud = project.baud or (specs[0] if specs else RobotSpec.load("khepera")).firmware.baud
        hint = "Speed of the serial line; programs may set another one."
        self._baud = _choice("Baud rate", "baud", sorted({*BAUDS, baud}), baud, hint)
        hint = "What is between program and robot."
        self._link = _choice("Link", "link", list(dict.fromkeys((*LINKS, project.link))), project.link, hint)
        hint = "How a proximity sensor responds to what it sees."
        self._model = _choice("Sensor model", "model", MODELS, project.response or "", hint)
        self._noise = named(ui.switch("Noise", value=project.noise), "noise")
        self._noise.tooltip("Real sensors are noisy; without noise it is easier to find mistakes in programs.")

    def _add_row(self) -> None:
        self._add(ProjectRobot(kind=self._rows[-1].robot().kind if self._rows else "khepera"))

    def _add(self, robot: ProjectRobot) -> None:
        with self._table:
            self._rows.append(_RobotRow(robot, len(self._rows) + 1, self._remove))

    def _remove(self, row: _RobotRow) -> None:
        self._rows.remove(row)
        row.element.delete()

    def _thinking(self) -> str:
        policy = self._policy.value
        if policy == "replay":
            return f"replay:{self._file.value}"
        return policy if policy == "none" else f"{policy}:{self._amount.read()}"

    async def _apply(self) -> None:
        seed = self._seed.read()
        present = await self._desk.present_project()
        await self._desk.alter(
            replace(
                present,
                seed=seed,
                thinking=self._thinking(),
                baud=int(self._baud.value),
                link=self._link.value,
                response=self._model.value or None,
                noise=bool(self._noise.value),
                robots=tuple(row.robot() for row in self._rows),
            )
        )
        ui.notify("Restarted with these settings.")

    async def _start_over(self) -> None:
        await self._desk.start_over()
        self._show()
        ui.notify("Started over.")


def _choice(label: str, name: str, options: Any, value: object, hint: str) -> ui.select:
    return with_props(select(label, name, options, value).props("outlined").classes("w-full"), hint=hint)


class _RobotRow:
    """The line of one robot."""

    def __init__(self, robot: ProjectRobot, number: int, remove: Any) -> None:
        self._given = robot
        kinds = robot_names()
        with ui.row().classes("w-full items-center no-wrap gap-2") as self.element:
            self._name = ui.input(value=robot.name, placeholder=str(number)).props('dense aria-label="Name"')
            self._name.style("width: 4.5rem")
            kind = [*kinds, robot.kind] if robot.kind not in kinds else kinds
            self._kind = ui.select(kind, value=robot.kind).props('dense options-dense aria-label="Kind"')
            self._turrets = (
                ui.select(list(TURRETS), value=list(robot.turrets), multiple=True, label="Turrets")
                .props("dense options-dense use-chips")
                .classes("col")
            )
            ui.button(icon="close", on_click=lambda: remove(self)).props('flat round dense size=sm aria-label="Remove"')

    def robot(self) -> ProjectRobot:
        """Return the robot as edited; what was changed of one kind does not suit another."""
        kind = self._kind.value
        return replace(
            self._given,
            name=self._name.value or "",
            kind=kind,
            turrets=tuple(self._turrets.value),
            changes=self._given.changes if kind == self._given.kind else {},
        )
