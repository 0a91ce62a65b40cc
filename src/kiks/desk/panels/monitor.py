"""The robot panel: the monitor of one robot, the state of its turrets, and explanations of its readings."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import NamedTuple

from nicegui import ui
from nicegui.events import GenericEventArguments

from kiks.desk.panels.widgets import WEB, FeedElement, Panel, named, offer_robots, select
from kiks.desk.server.desk import Desk
from kiks.sim.explanation import Explanation, LightExplanation
from kiks.sim.simulation import Simulation


class SensorReading(NamedTuple):
    """A reading of a robot: the index of its sensor, from 0, and which of the two: 'proximity' or 'ambient'."""

    sensor: int
    which: str


class MonitorView(FeedElement, component=WEB / "monitor_view.js", esm={"kiks-desk": str(WEB)}):
    """One robot from above with its readings at their sensors, curves of the last seconds, numbers, and its camera.

    Its data arrive over the page's own WebSocket, see `web/monitor.js`. Its properties: `robot` is the index of the
    robot from 0, `chosen` the reading that is explained, or None, and `why` its explanation with its `text`. Events:
    `explain`, a reading was clicked, or None, its explanation was closed; `keep`, whether that is to follow the world;
    `seen`, whether the element is visible.
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
        self._is_kept = False
        with ui.column().classes("w-full gap-2 q-pa-sm"):
            self._choice = select("Robot", "monitor-robot", {1: "robot 1"}, 1, "The robot shown here", self._choose)
            self._choice.classes("w-full").props("outlined")
            self._view = MonitorView(feed, "monitor_view.css").classes("w-full")
            self._view.change(robot=0, chosen=None, why=None)
            self._view.on("keep", self._keep)
            self._view.on("explain", self._ask).on("seen", lambda event: self.set_visible(bool(event.args)))
            self._view.on("keydown.escape", self._forget)
            self._turrets = named(ui.label().style("white-space: pre-line"), "turret-words")
        offer_robots(self._choice, desk)

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
        self._view.change(chosen=None, why=None)

    def _keep(self, event: GenericEventArguments) -> None:
        self._is_kept = bool(event.args)

    # ---- turrets and explanations ----

    async def refresh(self) -> None:
        """Show the robots, the state of the turrets, and the explanation if it is to be kept up to date."""
        offer_robots(self._choice, self._desk)
        self._turrets.set_text(await self._desk.do(self._describe_turrets))
        if self._is_kept and self._reading is not None:
            await self._explain(self._reading)

    def _describe_turrets(self, sim: Simulation) -> str:
        robot = self._choice.value or 0
        turrets = sim.turrets(robot) if 1 <= robot <= sim.robot_count else ()
        numbers = [f" (turret {turret.number})" if turret.number >= 0 else "" for turret in turrets]
        rows = zip(turrets, numbers, strict=True)
        return "\n".join(f"{turret.name}{number}: {turret.status()}" for turret, number in rows)

    async def _ask(self, event: GenericEventArguments) -> None:
        if event.args is None:
            self._forget()
        else:
            await self._explain(SensorReading(int(event.args["sensor"]), str(event.args["which"])))

    async def _explain(self, reading: SensorReading) -> None:
        robot = self._choice.value or 1

        def explained(sim: Simulation) -> Explanation | LightExplanation:
            explain = sim.explain_light if reading.which == "ambient" else sim.explain
            return explain(robot, reading.sensor)

        why = await self._desk.do(explained)
        if self._desk.has_old_coordinates:
            why = replace(why, sensor=why.sensor + 1)
        self._reading = reading
        self._view.change(chosen=reading._asdict(), why=asdict(why) | {"text": why.text()})
