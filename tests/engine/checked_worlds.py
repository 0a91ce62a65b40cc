"""Worlds of all kinds, to be run as a process whose kernels are compiled for another processor and check every index.

It prints all that comes of plain runs, which no build may change. Then NaN and numbers far out of range are written
into the state and the lamps themselves, behind the checks that guard every entrance.
"""

import logging
import math
from dataclasses import replace
from typing import Any

import numpy as np
from tests.batch.test_batch import all_hashes
from tests.engine.test_determinism import run_record

import kiks
from kiks import Arena, Simulation
from kiks.engine.state import BODY, ROBOT
from kiks.model.arena_objects import Ball, Cylinder, Lamp
from kiks.model.robot import RESPONSES

WILD = (math.nan, math.inf, -1e308, 1e20, -3e9)
"""Numbers that no kernel is ever given."""

PLACES = ("x_mm", "y_mm", "heading_rad", "trail", "motor_speed")
BODY_PLACES = ("x_mm", "y_mm", "trail", "velocity_x", "velocity_y")


def furnished() -> Simulation:
    """Return a world with all that a robot senses, grips and meets."""
    lamps, balls, cylinders = (Lamp(60, 60), Lamp(250, 200, 3.0)), (Ball(60, 60, 20.0),), (Cylinder(230, 200),)
    box = Arena.box(300, 260, rounded_mm=40)
    arena = replace(box, name="furnished", lamps=lamps, balls=balls, cylinders=cylinders)
    sim = Simulation(arena, seed=3, robots=2)
    for turret in ("k213", "gripper", "battle"):
        sim.fit(1, turret)
    return sim


def sense_everything(sim: Simulation) -> None:
    """Let robot 1 sense, drive and grip, and look at all there is."""
    port = sim.port(1)
    port.timeout, port.baudrate = 2.0, 1_000_000  # few ticks: one of a wild state takes as long as a thousand others
    for line in (b"N\n", b"O\n", b"T,2,N\n", b"T,99,S\n", b"T,1,G\n", b"D,90,-40\n", b"K\n", b"H\n", b"T,1,D,1\n"):
        port.write(line)
        port.readline()
    sim.look()
    sim.explain(1, 2)
    sim.explain_light(1, 2)
    sim.image(1)
    sim.run(0.02)


def wild_states() -> None:
    """Write wild numbers where the kernels look, one field at a time and all at once."""
    sim = furnished()
    begin = sim.world.state.snapshot()
    lamps = sim.lamps.copy()
    for wild in WILD:
        for names, records, kind in ((PLACES, "robots", ROBOT), (BODY_PLACES, "bodies", BODY)):
            for name in (*names, ""):
                sim.world.state.restore(begin)
                sim.world.state.tick_count = -(-sim.now_ns // 10_000_000)
                for each in [name] if name else list(names):
                    assert kind.names is not None
                    assert each in kind.names
                    getattr(sim.world.state, records)[each] = wild
                sim.world.rebuild_scene()
                sense_everything(sim)
        sim.world.state.restore(begin)
        sim.world.state.tick_count = -(-sim.now_ns // 10_000_000)
        sim.world.rebuild_scene()
        for column in range(4):
            sim.lamps[...] = lamps
            sim.lamps[:, column] = wild
            sense_everything(sim)
        sim.lamps[...] = lamps


@kiks.controller(memory=1, parameters=1)
def wild_driver(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Send a wild number to one wheel and a plain one to the other."""
    memory[0] += 1.0
    wheels[0] = parameters[0] / (memory[0] - 2.0)
    wheels[1] = 5.0


def batches() -> None:
    """Let robots, alone and in company, be driven by speeds that are none."""
    arena = Arena.box(400, 400)
    for robots, response in ((1, None), (1, "fast"), (2, "curve"), (3, "thesis")):
        kind = "khepera_ii" if response == "curve" else "khepera"
        senses = ("proximity", "ambient")
        batch = kiks.Batch(arena, 9, robots=robots, robot=kind, response=response, senses=senses, seed=1)
        batch.reset()
        batch.state.robots["heading_rad"][2:5, 0] = WILD[:3]
        batch.state.robots["x_mm"][5:8, 0] = WILD[:3]
        batch.step(np.full((9, robots, 2), 127.0))
        measures = [kiks.measures.roaming, kiks.measures.coverage(arena), kiks.measures.contacts]
        for wild in (0.0, 1e300, -1e300):
            batch.run(wild_driver, [wild], seconds=1.0, measures=measures)


def programs() -> None:
    """Let a robot of each response drive to a wall and along it."""
    for response in RESPONSES:
        kind = "khepera_ii" if response == "curve" else "khepera"
        sim = Simulation(Arena.box(300, 260, rounded_mm=40), seed=6, robot=kind, response=response)
        for line in (b"D,40,37\n", b"P,-255,200\n", b"C,3000,-2000\n"):
            sim.port(1).write(line)
            for _ in range(20):
                sim.run(0.1)
                sim.proximity(1, noise=True)


if __name__ == "__main__":
    logging.disable()  # a turret that reckons with what is no number says so
    print(run_record())
    print(all_hashes())
    programs()
    batches()
    wild_states()
    print("all within their arrays")
