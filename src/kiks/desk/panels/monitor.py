"""The robot panel: the monitor of one robot, the state of its turrets, and explanations of its readings."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from nicegui import ui

from kiks.desk.panels.explanation_drawing import draw_rays
from kiks.desk.panels.monitor_view import MonitorView, Reading
from kiks.desk.panels.widgets import icon_button, named, told
from kiks.desk.server.desk import Desk
from kiks.firmware.turret import Turret
from kiks.sim.explanation import Explanation, LightExplanation
from kiks.sim.simulation import Simulation


def describe_turret(turret: Turret) -> str:
    """Return a one-line status of a turret; the caller holds the simulation's lock."""
    number = f" (turret {turret.number})" if turret.number >= 0 else ""
    return f"{turret.name}{number}: {turret.status()}"


AGAIN_S = 0.5
"""Refresh period of the explanation and the status of turrets [s]."""

_RAY_COLUMNS = ("Ray", "Length [mm]", "Met", "Bright", "Angle [°]", "Counts")
_LAMP_COLUMNS = ("Lamp", "Distance [mm]", "Angle [°]", "Power [W]", "State", "Counts")
_TEXT_COLUMNS = ("Met", "State")


class MonitorPanel:
    """The monitor of one robot, with explanations of its readings.

    Args:
        desk: The desk.
        feed: Address of the WebSocket that frames come from, seen from the page.
    """

    def __init__(self, desk: Desk, feed: str = "/desk/feed") -> None:
        self._desk = desk
        self._index = 0
        self._reading: Reading | None = None
        self._is_seen = False
        with ui.column().classes("w-full gap-2 q-pa-sm"):
            self._choice = ui.select(self._names(), value=0 if desk.sim.robot_count else None, label="Robot")
            self._choice.on_value_change(lambda event: self._choose(event.value)).classes("w-full")
            named(self._choice, "monitor-robot").props("dense outlined").tooltip("The robot shown here")
            with MonitorView(feed, on_explain=self._explain, on_seen=self._see).classes("w-full") as self._view:
                self._build_answer()
            self._turrets = ui.label().style("white-space: pre-line").props('data-testid="turret-words"')
        ui.timer(AGAIN_S, self._renew)

    def _build_answer(self) -> None:
        """Build the explanation of a reading, hidden until a person asks for one."""
        with ui.column().classes("kiks-answer w-full gap-2").props('data-testid="explanation"') as self._answer:
            with ui.row().classes("w-full items-center justify-between no-wrap"):
                self._title = ui.label().classes("text-h6").props('role="heading" aria-level="2" aria-live="polite"')
                tip = "Close the explanation"
                icon_button("close", tip, "close-explanation", self._forget).tooltip(tip)
            self._drawing = ui.html(sanitize=False).classes("w-full").props('data-testid="explanation-drawing"')
            self._words = ui.label().style("white-space: pre-line").props('data-testid="explanation-text"')
            self._keeps = named(ui.switch("Keep looking"), "keep-looking").props("dense")
            self._keeps.tooltip("Update the explanation twice a second")
            self._table = named(ui.table(rows=[], columns=[], row_key="0"), "explanation-table").classes("w-full")
            self._table.props('dense flat bordered hide-pagination :rows-per-page-options="[0]"')
            self._note = ui.label().classes("text-caption")
        self._answer.set_visibility(False)

    # ---- the robot ----

    def show_robot(self, index: int) -> None:
        """Show another robot by its index from 0; an unknown index changes nothing."""
        if 0 <= index < self._desk.sim.robot_count:
            self._choice.set_options(self._names(), value=index)

    async def show_sensor(self, index: int, sensor: int) -> None:
        """Show a robot and explain the reading of one of its proximity sensors, by their indices from 0."""
        self.show_robot(index)
        await self._explain(Reading(sensor, "proximity"))

    def _names(self) -> dict[int, str]:
        return {index: f"Robot {name}" for index, name in enumerate(self._desk.names())}

    def _choose(self, chosen: int | None) -> None:
        self._index = index = chosen or 0
        self._view.set_robot(index)
        self._forget()

    def _forget(self) -> None:
        self._reading = None
        self._view.set_chosen(None)
        self._answer.set_visibility(False)

    def _see(self, is_seen: bool) -> None:
        self._is_seen = is_seen

    # ---- turrets and explanations ----

    async def _renew(self) -> None:
        if not self._is_seen:
            return
        if self._choice.options != (names := self._names()):
            self._choice.set_options(names, value=min(self._index, len(names) - 1) if names else None)
        number = self._index + 1
        self._turrets.set_text(await self._desk.do(lambda sim: _describe_turrets(sim, number)))
        if self._keeps.value and self._reading is not None:
            await self._explain(self._reading)

    @told
    async def _explain(self, reading: Reading) -> None:
        number = self._index + 1

        def explained(sim: Simulation) -> Explanation | LightExplanation:
            explain = sim.explain if reading.kind == "proximity" else sim.explain_light
            return explain(number, reading.sensor)

        why = await self._desk.do(explained)
        if self._desk.has_old_coordinates:
            why = replace(why, sensor=why.sensor + 1)
        if reading != self._reading:
            self._reading = reading
            self._view.set_chosen(reading)
        self._answer.set_visibility(True)
        self._title.set_text(f"Why does it read {why.count}?")
        self._words.set_text(why.text())
        if isinstance(why, Explanation):
            self._show_rays(why)
        else:
            self._show_lamps(why)

    def _show_rays(self, why: Explanation) -> None:
        self._drawing.set_visibility(True)
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
        self._drawing.set_visibility(False)
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


def _describe_turrets(sim: Simulation, number: int) -> str:
    return "\n".join(describe_turret(turret) for turret in sim.turrets(number)) if number <= sim.robot_count else ""
