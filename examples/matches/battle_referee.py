"""The referee of a battle: a robot without energy is knocked out, and the other one gets a point.

A shot costs 5 points of energy and takes 10 from the robot that it hits; one comes back each second. A robot that was
knocked out is put as far from the other as there is a place, and cannot be knocked out again before it has recovered.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from kiks import Simulation
from kiks.firmware.battle import Battle

LOOK_S = 0.1
"""Simulated time between two looks of the referee [s]: a tenth of a point of energy comes back."""

OUT_POINTS = 0.5
"""A robot with less energy is knocked out."""

RECOVERED_POINTS = 15.0
"""With so much energy it can be knocked out again."""

PLACES_MM = ((100.0, 100.0), (700.0, 100.0), (100.0, 500.0), (700.0, 500.0))
"""Where a robot is put that was knocked out."""


def supervise(sim: Simulation) -> Iterator[float]:
    """Watch the battle, and print each knock-out."""
    points, can_fall = [0, 0], [True, True]
    show(sim, points)
    try:
        while True:
            yield LOOK_S
            for robot, other in ((1, 2), (2, 1)):
                energy = energy_of(sim, robot)
                if can_fall[robot - 1] and energy < OUT_POINTS:
                    points[other - 1] += 1
                    can_fall[robot - 1] = False
                    show(sim, points)
                    print(f"{sim.time_s:6.1f} s   {points[0]}:{points[1]}   robot {robot} is knocked out")
                    put_away(sim, robot, other)
                elif energy > RECOVERED_POINTS:
                    can_fall[robot - 1] = True
    finally:
        print(f"{points[0]}:{points[1]} knock-outs")


def show(sim: Simulation, points: list[int]) -> None:
    """Show the score on the desk."""
    for robot, value in enumerate(points, 1):
        sim.set_score(robot, value)


def energy_of(sim: Simulation, robot: int) -> float:
    """Return a robot's energy [points]."""
    return next(turret.energy for turret in sim.turrets(robot) if isinstance(turret, Battle))


def put_away(sim: Simulation, robot: int, other: int) -> None:
    """Put a robot where it is farthest from the other one, facing the middle."""
    from_mm = sim.pose(other)[:2]
    x_mm, y_mm = max(PLACES_MM, key=lambda place: math.dist(place, from_mm))
    heading = math.atan2(sim.arena.height_mm / 2 - y_mm, sim.arena.width_mm / 2 - x_mm)
    sim.place(robot, x_mm, y_mm, heading)
