"""A real desk whose page has the monitor's panel alone. Run as a program, in a process of its own, because NiceGUI
keeps one application a process; it prints the address of the desk when it listens.

`/world` tells what the simulation says of itself, `/ask/WHAT` makes it do something: see `ask`.
"""

from __future__ import annotations

import threading
from typing import Any

from nicegui import app, ui

import kiks
from kiks.desk.panels.monitor import MonitorPanel
from kiks.desk.server.show import show
from kiks.model.arena_objects import Ball, Cylinder, Lamp, Pose


def make_world() -> kiks.Simulation:
    """Return three robots: by a wall with a camera, beside a ball with a gripper, and one among others."""
    plain = kiks.Arena.box(700, 500)
    arena = kiks.Arena(
        plain.brightness,
        plain.mm_per_cell,
        "monitored",
        starts=(Pose(60, 240, 2.9), Pose(300, 250, 0.4), Pose(500, 300, 0.0)),
        lamps=(Lamp(200, 60, 2.0), Lamp(30, 330, 1.0)),
        balls=(Ball(380, 290),),
        cylinders=(Cylinder(110, 215),),
    )
    sim = kiks.Simulation(arena, robots=3, seed=1)
    for robot, turret in ((1, "k213"), (1, "radio"), (2, "gripper"), (3, "battle")):
        sim.fit(robot, turret)
    return sim


def main() -> None:
    """Serve it until the process is ended."""
    sim = make_world()
    begin = sim.checkpoint()
    panels: list[MonitorPanel] = []
    shown = show(sim, is_alive=True, browser=False, port=0)

    @ui.page("/monitor")
    def page(dark: bool = False) -> None:
        ui.dark_mode(dark)
        panels.append(MonitorPanel(shown.desk, "desk/1/feed"))

    @app.get("/world")
    def world() -> dict[str, Any]:
        with sim.lock:
            why = sim.explain(1, 2)
            return {
                "time_s": sim.time_s,
                "hash": sim.state_hash(),
                "counts": [sim.proximity(robot, noise=True) for robot in (1, 2, 3)],
                "light": [sim.ambient(robot, noise=True) for robot in (1, 2, 3)],
                "lengths_mm": [ray.length_mm if ray.brightness else None for ray in why.rays],
                "count": why.count,
            }

    @app.get("/ask/{what}")
    async def ask(what: str) -> str:
        if what == "drive":
            for robot, order in enumerate((b"D,4,6\n", b"D,9,12\n", b"D,-20,15\n"), 1):
                sim.port(robot).write(order)
        elif what == "reset":
            for robot in (1, 2, 3):
                sim.port(robot).write(b"D,0,0\n")
            await shown.desk.go_on()
            await shown.desk.do(lambda sim: sim.reset(begin))
        elif what == "pause":
            await shown.desk.pause()
        elif what == "show2":
            panels[-1].show_robot(1)
        return what

    print(shown.url, flush=True)
    threading.Event().wait()


if __name__ == "__main__":
    main()
