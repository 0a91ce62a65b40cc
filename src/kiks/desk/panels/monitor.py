"""The robot panel: the monitor of one robot, the state of its turrets, and explanations of its readings."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

from nicegui import ui
from nicegui.events import GenericEventArguments

from kiks.desk.panels.explanation_drawing import draw_rays
from kiks.desk.panels.widgets import WEB, FeedElement, Panel, heading, icon_button, named, offer_robots, select
from kiks.desk.server.desk import Desk
from kiks.sim.explanation import Explanation, LightExplanation
from kiks.sim.simulation import Simulation

_RAY_COLUMNS = ("Ray", "Length [mm]", "Met", "Bright", "Angle [°]", "Counts")
_LAMP_COLUMNS = ("Lamp", "Distance [mm]", "Angle [°]", "Power [W]", "State", "Counts")
_TEXT_COLUMNS = ("Met", "State")


class SensorReading(NamedTuple):
    """A reading of a robot: the index of its sensor, from 0, and which of the two: 'proximity' or 'ambient'."""

    sensor: int
    which: str


class MonitorView(FeedElement, component=WEB / "monitor_view.js", esm={"kiks-desk": str(WEB)}):
    """One robot from above with its readings at their sensors, curves of the last seconds, numbers, and its camera.

    Its data arrive over the page's own WebSocket, see `web/monitor.js`. Its properties: `robot` is the index of the
    robot from 0, and `chosen` the reading that is explained, or None. Events: `explain`, a reading was clicked; `seen`,
    whether the element is visible.
    """


class MonitorPanel(Panel):
    """The monitor of one robot, with explanations of its readings.

    Args:
        desk: The desk.
        feed: Address of the WebSocket that frames come from, seen from the page.
    """

    def __init__(self, desk: Desk, feed: str) -> None:
        super().__init__(desk)
        self._reading: SensorReading | None = None
        with ui.column().classes("w-full gap-2 q-pa-sm"):
            self._choice = select("Robot", "monitor-robot", {1: "robot 1"}, 1, "The robot shown here", self._choose)
            self._choice.classes("w-full").props("outlined")
            with MonitorView(feed, "monitor_view.css").classes("w-full") as self._view:
                self._build_answer()
            self._view.change(robot=0, chosen=None)
            self._view.on("explain", self._ask).on("seen", lambda event: self.set_visible(bool(event.args)))
            self._view.on("keydown.escape", self._forget)
            self._turrets = named(ui.label().style("white-space: pre-line"), "turret-words")
        offer_robots(self._choice, desk)

    def _build_answer(self) -> None:
        """Build the explanation of a reading, hidden until a person asks for one."""
        with ui.column().classes("kiks-answer w-full gap-2").props('data-testid="explanation"') as self._answer:
            with ui.row().classes("w-full items-center justify-between no-wrap"):
                self._title = heading("", "text-h6").props("aria-live=polite")
                icon_button("close", "Close the explanation", "close-explanation", self._forget)
            self._drawing = named(ui.html(sanitize=False).classes("w-full"), "explanation-drawing")
            self._words = named(ui.label().style("white-space: pre-line"), "explanation-text")
            self._keeps = named(ui.switch("Keep looking"), "keep-looking").props("dense")
            self._keeps.tooltip("Update the explanation twice a second")
            self._table = named(ui.table(rows=[], columns=[], row_key="0"), "explanation-table").classes("w-full")
            self._table.props('dense flat bordered hide-pagination :rows-per-page-options="[0]"')
            self._note = ui.label().classes("text-caption")
        self._answer.set_visibility(False)

    # ---- the robot ----

    def show_robot(self, number: int) -> None:
        """Show another robot; an unknown number changes nothing."""
        offer_robots(self._choice, self._desk)
        if number in self._choice.options:
            self._choice.value = number

    async def explain(self, sensor: int) -> None:
        """Explain the reading of one of the robot's proximity sensors, by its index from 0."""
        await self._explain(SensorReading(sensor, "proximity"))

    def _choose(self) -> None:
        self._view.change(robot=(self._choice.value or 1) - 1)
        self._forget()

    def _forget(self) -> None:
        self._reading = None
        self._view.change(chosen=None)
        self._answer.set_visibility(False)

    # ---- turrets and explanations ----

    async def refresh(self) -> None:
        """Show the robots, the state of the turrets, and the explanation if it is to be kept up to date."""
        offer_robots(self._choice, self._desk)
        self._turrets.set_text(await self._desk.do(self._describe_turrets))
        if self._keeps.value and self._reading is not None:
            await self._explain(self._reading)

    def _describe_turrets(self, sim: Simulation) -> str:
        robot = self._choice.value or 0
        turrets = sim.turrets(robot) if 1 <= robot <= sim.robot_count else ()
        numbers = [f" (turret {turret.number})" if turret.number >= 0 else "" for turret in turrets]
        rows = zip(turrets, numbers, strict=True)
        return "\n".join(f"{turret.name}{number}: {turret.status()}" for turret, number in rows)

    async def _ask(self, event: GenericEventArguments) -> None:
        await self._explain(SensorReading(int(event.args["sensor"]), str(event.args["which"])))

    async def _explain(self, reading: SensorReading) -> None:
        robot = self._choice.value or 1

        def explained(sim: Simulation) -> Explanation | LightExplanation:
            explain = sim.explain_light if reading.which == "ambient" else sim.explain
            return explain(robot, reading.sensor)

        why = await self._desk.do(explained)
        if self._desk.has_old_coordinates:
            why = replace(why, sensor=why.sensor + 1)
        if reading != self._reading:
            self._reading = reading
            self._view.change(chosen=reading._asdict())
        self._answer.set_visibility(True)
        self._title.set_text(f"Why does it read {why.count}?")
        self._words.set_text(why.text())
        self._drawing.set_visibility(isinstance(why, Explanation))
        if isinstance(why, Explanation):
            self._show_rays(why)
        else:
            self._show_lamps(why)

    def _show_rays(self, why: Explanation) -> None:
        self._drawing.set_content(draw_rays(why))
        rows = [
            (number, _figure(ray.length_mm), ray.met, ray.brightness or "–", _figure(ray.incidence_deg, 0),
             _signed(ray.contribution_counts))
            for number, ray in enumerate(why.rays, 1)
        ]  # fmt: skip
        self._fill(_RAY_COLUMNS, rows)
        self._note.set_text(
            "Ray 1 is the leftmost. Bright: 1 is black, 255 is white. Angle: between the ray and the normal of the "
            "surface. Counts: by how much the reading would drop without this ray."
        )

    def _show_lamps(self, why: LightExplanation) -> None:
        rows = [
            (lamp.lamp, _figure(lamp.distance_mm, 0), _figure(lamp.angle_deg, 0), f"{lamp.power_w:g}", lamp.state,
             _signed(-lamp.contribution_counts))
            for lamp in why.lamps
        ]  # fmt: skip
        self._fill(_LAMP_COLUMNS, rows)
        self._note.set_text(
            "Angle: from the sensor's axis. Counts: the change by this lamp; light makes readings smaller."
        )

    def _fill(self, names: tuple[str, ...], rows: list[tuple[Any, ...]]) -> None:
        columns = [
            {"name": str(k), "field": str(k), "label": name, "align": "left" if name in _TEXT_COLUMNS else "right"}
            for k, name in enumerate(names)
        ]
        if self._table.columns != columns:
            self._table.columns = columns
        self._table.rows = [{str(k): value for k, value in enumerate(row)} for row in rows]


def _figure(value: float, digits: int = 1) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "–"


def _signed(value: float) -> str:
    return f"{value:+.1f}" if abs(value) >= 0.05 else "0"
