"""The referee of a sumo match: a robot that touches the wall has lost the round, whoever pushed it there.

The other one gets a point. Then both stand on their marks again, turned as the seed says. A round that takes long ends
without a point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from kiks import Simulation
from kiks.engine.scalar_math import uniform

LOOK_S = 0.05
"""Simulated time between two looks of the referee [s]: a robot drives 50 mm at most."""

ROUND_S = 20.0
"""Longest round [s]."""

TOUCH_MM = 2.0
"""A robot that is nearer to the wall touches it."""

MARK_MM = 120.0
"""Distance of the marks from the middle of the ring."""

STREAM_REFEREE = 102
"""Random stream of the directions."""


def supervise(sim: Simulation) -> Iterator[float]:
    """Watch the match, and print each round."""
    points, rounds = [0, 0], 1
    began_s = sim.time_s
    show(sim, points)
    try:
        while True:
            yield LOOK_S
            touching = [gap_mm(sim, robot) < TOUCH_MM for robot in (1, 2)]
            if not any(touching) and sim.time_s - began_s < ROUND_S:
                continue
            if sum(touching) == 1:
                winner = touching.index(False)
                points[winner] += 1
                show(sim, points)
            print(f"{sim.time_s:6.1f} s   {points[0]}:{points[1]}   round {rounds}")
            rounds += 1
            put_on_marks(sim, rounds)
            began_s = sim.time_s
    finally:
        print(f"{points[0]}:{points[1]} after {rounds} rounds")


def show(sim: Simulation, points: list[int]) -> None:
    """Show the score on the desk."""
    for robot, value in enumerate(points, 1):
        sim.set_score(robot, value)


def gap_mm(sim: Simulation, robot: int) -> float:
    """Return how far a robot is from the wall."""
    x_mm, y_mm, _ = sim.pose(robot)
    return sim.world.free_space.wall_gap_mm(x_mm, y_mm, sim.specs[robot - 1].body.radius_mm)


def put_on_marks(sim: Simulation, number: int) -> None:
    """Put both robots on their marks, each turned by the same angle from the other."""
    angle = 2 * math.pi * uniform(sim.seed, 0, 0, STREAM_REFEREE, number, 0)
    turn = math.pi * (uniform(sim.seed, 0, 0, STREAM_REFEREE, number, 1) - 0.5)
    # Robot 1 waits beside the marks, away from robot 2, as that may stand on its mark.
    beside = [mark(sim, angle + side) for side in (math.pi / 2, -math.pi / 2)]
    sim.place(1, *max(beside, key=lambda place: math.dist(place, sim.pose(2)[:2])), 0.0)
    for robot, towards in ((2, angle + math.pi), (1, angle)):
        sim.place(robot, *mark(sim, towards), (towards + math.pi + turn) % (2 * math.pi))


def mark(sim: Simulation, angle: float) -> tuple[float, float]:
    """Return the mark in a direction from the middle of the ring."""
    arena = sim.arena
    return arena.width_mm / 2 + MARK_MM * math.cos(angle), arena.height_mm / 2 + MARK_MM * math.sin(angle)
