"""The referee of hide and seek: robot 1 must find robot 2 and come near it within 40 s; then the round is the seeker's.

Else it is the hider's. After each round the seeker stands on its mark again, turned to the wall, and the hider in a
place that the seed draws.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from kiks import Simulation
from kiks.engine.scalar_math import uniform

LOOK_S = 0.1
"""Simulated time between two looks of the referee [s]."""

ROUND_S = 40.0
"""Longest round [s]."""

CAUGHT_MM = 90.0
"""A hider whose centre is so near the seeker's is caught, if the seeker has it in sight."""

SIGHT_RAD = math.radians(45.0)
"""Half of the seeker's field of view."""

STEP_MM = 2.0
"""Distance of the places between the robots in which the referee looks for a wall."""

PLACES_MM = ((710.0, 350.0), (320.0, 100.0), (320.0, 600.0), (830.0, 80.0), (830.0, 620.0))
"""Where a hider begins."""

STREAM_REFEREE = 103
"""Random stream of these places."""

SEEKER, HIDER = 1, 2


def supervise(sim: Simulation) -> Iterator[float]:
    """Watch the match, and print each round."""
    points, rounds = {SEEKER: 0, HIDER: 0}, 1
    mark = sim.pose(SEEKER)
    began_s = sim.time_s
    show(sim, points)
    try:
        while True:
            yield LOOK_S
            caught = is_caught(sim)
            if not caught and sim.time_s - began_s < ROUND_S:
                continue
            points[SEEKER if caught else HIDER] += 1
            show(sim, points)
            print(f"{sim.time_s:6.1f} s   {points[SEEKER]}:{points[HIDER]}   {'caught' if caught else 'not found'}")
            rounds += 1
            begin(sim, mark, rounds)
            began_s = sim.time_s
    finally:
        print(f"caught {points[SEEKER]} times, not found {points[HIDER]} times")


def show(sim: Simulation, points: dict[int, int]) -> None:
    """Show the score on the desk."""
    for robot, value in points.items():
        sim.set_score(robot, value)


def begin(sim: Simulation, mark: tuple[float, float, float], number: int) -> None:
    """Put both robots where a round begins."""
    place = PLACES_MM[int(uniform(sim.seed, 0, 0, STREAM_REFEREE, number, 0) * len(PLACES_MM))]
    # The hider waits away from the seeker, as either may stand where the other begins.
    sim.place(HIDER, *max(PLACES_MM, key=lambda each: math.dist(each, sim.pose(SEEKER)[:2])), 0.0)
    sim.place(SEEKER, *mark)
    sim.place(HIDER, *place, 2 * math.pi * uniform(sim.seed, 0, 0, STREAM_REFEREE, number, 1))


def is_caught(sim: Simulation) -> bool:
    """Return whether the seeker is near the hider, has it in its field of view, and no wall is between them."""
    x_mm, y_mm, heading_rad = sim.pose(SEEKER)
    to_x_mm, to_y_mm, _ = sim.pose(HIDER)
    distance_mm = math.dist((x_mm, y_mm), (to_x_mm, to_y_mm))
    bearing = math.remainder(math.atan2(to_y_mm - y_mm, to_x_mm - x_mm) - heading_rad, 2 * math.pi)
    if distance_mm > CAUGHT_MM or abs(bearing) > SIGHT_RAD:
        return False
    count = max(int(distance_mm / STEP_MM), 1)
    shares = (k / count for k in range(count + 1))
    return all(is_floor(sim, x_mm + (to_x_mm - x_mm) * share, y_mm + (to_y_mm - y_mm) * share) for share in shares)


def is_floor(sim: Simulation, x_mm: float, y_mm: float) -> bool:
    """Return whether no wall is at a place."""
    arena = sim.arena
    row, column = int((arena.height_mm - y_mm) / arena.mm_per_cell), int(x_mm / arena.mm_per_cell)  # row 0 is on top
    return int(arena.brightness[row, column]) == 0
