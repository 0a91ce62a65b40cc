"""Recorded runs in which anything may happen: worlds, robots, turrets and acts are drawn by a seed."""

import random
from dataclasses import replace
from pathlib import Path

import numpy as np

from kiks import Arena, Khepera, KiksError, Recording, Simulation
from kiks.model.arena import Lamp, Zone
from kiks.model.arena_objects import LampSwitch
from kiks.model.robot import RobotSpec
from kiks.sim.console import type_lines

KINDS = ("khepera", "khepera_ii", "epuck", "epuck2", "epuck_wf15")
TURRETS = ("gripper", "k213", "radio", "battle", "io", "floor")
COMMANDS = (
    "D,{a},{b}", "D,{a},{b}", "N", "O", "E", "H", "G,{a},{b}", "C,{c},{c}", "L,0,2", "L,1,{d}", "A,3,400,20",
    "P,{a},{b}", "K", "T,1,D,{d}", "T,1,E,{c}", "T,2,N", "T,2,O", "restart",
)  # fmt: skip

CHANGES = {
    "body__diameter_mm": (75.0, 80.0),
    "firmware__baud": (19_200,),
    "proximity__range_mm": (25.0, 120.0),
    "proximity__jitter_counts": ([0.0] * 8,),
    "ambient__model": ("thesis",),
}


def record_random(seed: int, file: Path, *, seconds: float = 2.2, most: int = 20) -> Recording:
    """Record a run.

    Args:
        seed: Of all that is drawn.
        file: The recording.
        seconds: How long it is about.
        most: Most robots.
    """
    draw = random.Random(seed)
    sim = Simulation(_arena(draw), robots=draw.choice((0, 1, 1, 1, 2, 3, 5, most)), seed=seed, robot=_kind(draw))
    with sim.record(file):
        while sim.time_s < seconds:
            for _ in range(draw.randrange(1, 6)):
                try:
                    _act(draw, sim)
                except KiksError:
                    continue  # it is not possible now
            sim.run(draw.choice((0.003, 0.01, 0.05, 0.2)))
    return Recording(file)


def _arena(draw: random.Random) -> Arena:
    size_mm = draw.choice((450, 700)), draw.choice((450, 600))
    arena = draw.choice((Arena.box(*size_mm), Arena.box(*size_mm), Arena.load("pillars")))
    if draw.random() < 0.5:
        lamps = tuple(Lamp(draw.uniform(30, 400), draw.uniform(30, 400)) for _ in range(draw.randrange(1, 4)))
        switches = tuple(LampSwitch(draw.randrange(30) / 10 + 0.1, draw.randrange(len(lamps)) + 1, True) for _ in "ab")
        arena = replace(arena, lamps=lamps, lamp_switches=switches if draw.random() < 0.5 else ())
    if draw.random() < 0.3:
        arena = replace(arena, zones=(Zone(disc_mm=(120, 120), radius_mm=50),))
    return arena


def _kind(draw: random.Random) -> RobotSpec:
    """Return a kind of robot that comes with KiKS, or one that differs from it, as robots' files may."""
    kind = RobotSpec.load(draw.choice(KINDS))
    return kind.with_changes(**{name: draw.choice(of) for name, of in CHANGES.items() if draw.random() < 0.1})


def _act(draw: random.Random, sim: Simulation) -> None:
    place = draw.uniform(20, 430), draw.uniform(20, 430)
    bodies = sim.bodies()["number"].tolist()
    robot = draw.randrange(sim.robot_count) + 1 if sim.robot_count else 0
    what = draw.randrange(30)
    if what == 0 and sim.robot_count < 20:
        sim.add_robot(_kind(draw), pose=(*place, draw.uniform(-3, 3)) if draw.random() < 0.5 else None)
    elif what == 1:
        sim.add_ball(*place, radius_mm=draw.choice((10, 20)))
    elif what == 2:
        sim.add_cylinder(*place)
    elif what == 3:
        sim.add_lamp(*place, power_w=draw.uniform(0.5, 20))
    elif what == 4 and len(sim.lamps):
        sim.lamps[draw.randrange(len(sim.lamps)), draw.choice((0, 3))] = draw.choice((0, 1))
    elif what == 5 and bodies:
        sim.remove_body(draw.choice(bodies))
    elif what in (6, 7) and bodies:
        speed = draw.choice((None, 200.0))
        sim.move_body(draw.choice(bodies), *place, speed_mm_s=speed, heading_rad=draw.uniform(-3, 3))
    elif what == 8 and bodies:
        sim.change_body(draw.choice(bodies), radius_mm=draw.choice((12.0, 18.0)))
    elif what == 9 and draw.random() < 0.3:
        sim.set_arena(Arena.box(draw.choice((450, 720)), 500))
    elif robot:
        _act_on(draw, sim, robot, what, place)


def _act_on(draw: random.Random, sim: Simulation, robot: int, what: int, place: tuple[float, float]) -> None:
    if what == 10:
        sim.fit(robot, draw.choice(TURRETS))
    elif what in (11, 12):
        sim.place(robot, *place, draw.uniform(-3, 3))
    elif what == 13:
        sim.reset(sim.checkpoint())
    elif sim.specs[robot - 1].kind == "khepera" and what == 14:
        khepera = Khepera(sim.port(robot))
        for _ in range(3):
            values = khepera.proximity()
            khepera.set_speed(8 - values[3] // 60, 8 - values[2] // 60)
    else:
        small, speed = draw.randrange(3), np.clip(round(draw.gauss(8, 12)), -40, 40)
        line = draw.choice(COMMANDS).format(a=speed, b=draw.randrange(-20, 30), c=draw.randrange(200), d=small)
        type_lines(sim, robot, line)
