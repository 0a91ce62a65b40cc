"""The panels of programs and of the wire on a page of their own, in a process of its own: NiceGUI has one a process.

It prints its address. Arguments: the desk's folder, and `may` or `may-not` start programs.
"""

from __future__ import annotations

import sys
import threading
from pathlib import Path

from fastapi import FastAPI
from nicegui import ui
from tests.desk.announced import serve

from kiks.desk.panels.programs import ProgramsPanel
from kiks.desk.panels.wire import WirePanel
from kiks.desk.server.desk import Desk
from kiks.desk.server.show import Driver
from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation


def make_app(folder: Path, may_run_programs: bool) -> FastAPI:
    sim = Simulation(Arena.box(600, 600), robots=2, seed=1)
    desk = Desk(sim, folder=folder, may_run_programs=may_run_programs, speed=10.0)
    threading.Thread(target=Driver(desk).run, daemon=True).start()
    app = FastAPI()

    @app.get("/speeds")
    def speeds() -> list[list[int]]:
        setpoints: list[list[int]] = sim.world.state.robots["speed_setpoint"][0].tolist()
        return setpoints

    @app.get("/watched")
    def watched() -> list[bool]:
        return [wire.log is not None for wire in sim.wires]

    @app.get("/pause")
    async def pause() -> None:
        await desk.pause()

    @app.get("/go-on")
    async def go_on() -> None:
        await desk.go_on()

    @ui.page("/")
    def page(dark: bool = False) -> None:
        ui.dark_mode(dark)
        with ui.row().classes("no-wrap"):
            for panel in (ProgramsPanel, WirePanel):
                with ui.card().style("width: 420px"):
                    panel(desk)

    ui.run_with(app, reconnect_timeout=0.5)
    return app


if __name__ == "__main__":
    serve(make_app(Path(sys.argv[1]), sys.argv[2] == "may"))
