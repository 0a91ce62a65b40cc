"""Put twelve cylinders at random places, 30 mm or more from all else, and count at the end those at the walls."""

import math
import random

from kiks import ArenaError

CYLINDERS = 12
RADIUS_MM = 16.0
GAP_MM = 30.0
TIDY_MM = 100.0  # the whole of a cylinder, its far edge included, must be as near to a wall


def supervise(sim):
    chance = random.Random(sim.seed)
    taken = [(x_mm, y_mm, sim.spec.body.radius_mm) for x_mm, y_mm, _ in sim.poses()]
    for _ in range(10_000):
        if len(sim.bodies()) >= CYLINDERS:
            break
        x_mm, y_mm = sim.arena.width_mm * chance.random(), sim.arena.height_mm * chance.random()
        if sim.arena.free_for(x_mm, y_mm, RADIUS_MM + GAP_MM) and all(
            math.dist((x_mm, y_mm), (other_x, other_y)) >= RADIUS_MM + other_mm + GAP_MM
            for other_x, other_y, other_mm in taken
        ):
            taken.append((x_mm, y_mm, RADIUS_MM))
            sim.add_cylinder(x_mm, y_mm)
    else:
        raise ArenaError(f"The arena must have room for {CYLINDERS} cylinders, but it is too small. Take a larger one.")
    at_start = tidy_count(sim)
    try:
        while True:
            sim.set_score("cylinders at the walls", f"{tidy_count(sim)} of {CYLINDERS}")
            yield 1.0
    finally:
        print(f"{tidy_count(sim)} of {CYLINDERS} cylinders at the walls, {at_start} at the start")


def tidy_count(sim):
    bodies = sim.bodies()
    places = zip(bodies["x_mm"], bodies["y_mm"], strict=True)
    return sum(sim.arena.clearance_at_mm(x_mm, y_mm) + RADIUS_MM <= TIDY_MM for x_mm, y_mm in places)
