"""Pile-ups: robots at full speed among balls and cylinders in a box, and what must hold after every tick of it.

The oracle knows discs, and walls as the rectangles they are drawn as; it asks the engine nothing.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from kiks.engine.physics import motor
from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation

SIZE_MM, WALL_MM = 500, 10
EACH = 8
"""Robots, and as many balls, and as many cylinders."""

DEEPEST_MM = 0.5
"""Deepest that a disc may be in another, or in a wall."""

SHOVED_MM = 0.1
"""Farthest that a robot may come whose motors are off: half of an overlap that was left, and that twice."""

REDRAWN_EVERY = 37
"""Ticks between two changes of what the robots are told."""


def worst_overlap_mm(discs: np.ndarray) -> float:
    """Return how deep the two are in each other that are deepest [mm]; discs are x, y and radius, shape [disc, 3]."""
    i, j = np.triu_indices(len(discs), 1)
    apart = np.hypot(discs[i, 0] - discs[j, 0], discs[i, 1] - discs[j, 1])
    return float((discs[i, 2] + discs[j, 2] - apart).max())


def worst_depth_mm(discs: np.ndarray, walls: np.ndarray) -> float:
    """Return how deep the disc is in a wall that is deepest [mm]; walls are rectangles, shape [wall, 4]."""
    x, y, radius = discs.T[:, :, np.newaxis]
    left, bottom, right, top = walls.T
    dx = np.maximum(np.maximum(left - x, x - right), 0.0)
    dy = np.maximum(np.maximum(bottom - y, y - top), 0.0)
    return float((radius - np.hypot(dx, dy)).max())


def boxed_arena(rng: np.random.Generator) -> tuple[Arena, np.ndarray]:
    """Return a box with up to three blocks in it, posts of one pixel among them, and its walls' rectangles [mm]."""
    mm_per_pixel = float(rng.choice([0.5, 1.0, 2.5]))
    count = int(SIZE_MM / mm_per_pixel)
    border = int(WALL_MM / mm_per_pixel)
    inner = count - border
    corners = [(0, 0, border, count), (inner, 0, count, count), (0, 0, count, border), (0, inner, count, count)]
    for _ in range(rng.integers(0, 4)):
        x, y = rng.integers(100, 400, 2) / mm_per_pixel
        wide, high = rng.integers(1, 60, 2) / mm_per_pixel if rng.random() < 0.7 else (1, 1)
        corners.append((int(x), int(y), int(x + max(wide, 1)), int(y + max(high, 1))))
    picture = np.zeros((count, count), np.uint8)
    for left, bottom, right, top in corners:
        picture[count - top : count - bottom, left:right] = 255
    return Arena.from_array(picture, mm_per_pixel=mm_per_pixel), np.array(corners, np.float64) * mm_per_pixel


@dataclass
class Pile:
    """A pile-up: what there is, and the walls as the oracle knows them."""

    sim: Simulation
    walls: np.ndarray
    rng: np.random.Generator
    fastest: int
    """Largest speed that robots are told [pulses/10 ms]."""

    @staticmethod
    def make(number: int) -> "Pile":
        """Return pile-up `number`, always the same one; one in four has things of all sizes, one in four is slow."""
        rng = np.random.default_rng([3006, number])
        arena, walls = boxed_arena(rng)
        sim = Simulation(arena, robots=EACH, seed=number)
        radii = [*([27.5] * EACH), *([32.0] * EACH), *([16.0] * EACH)]
        if number % 4 == 3:
            radii[EACH:] = rng.uniform(10.0, 40.0, 2 * EACH)
        places: list[tuple[float, float, float]] = []
        while len(places) < len(radii):
            x, y = rng.uniform(0, SIZE_MM, 2)
            radius = radii[len(places)]
            is_free = all(math.hypot(x - u, y - v) > radius + r for u, v, r in places)
            if is_free and worst_depth_mm(np.array([(x, y, radius)]), walls) < 0.0:
                places.append((x, y, radius))
        robots: Any = sim.world.state.robots[0]
        robots["x_mm"], robots["y_mm"] = np.array(places)[:EACH, :2].T
        robots["heading_rad"] = rng.uniform(-4, 4, EACH)
        for index, (x, y, radius) in enumerate(places[EACH:]):
            add = sim.add_ball if index < EACH else sim.add_cylinder
            add(x, y, radius_mm=radius)
        return Pile(sim, walls, rng, 127 if number % 4 != 2 else int(rng.integers(1, 30)))

    def drive(self) -> None:
        """Tell some robots something new: mostly to go ahead, often at full speed."""
        fastest, robots = self.fastest, self.sim.world.state.robots
        for robot in range(EACH):
            draw = self.rng.random()
            if draw < 0.3:
                motor.set_speed(robots, 0, robot, fastest, fastest)
            elif draw < 0.6:
                motor.set_speed(robots, 0, robot, *self.rng.integers(-fastest, fastest + 1, 2).tolist())
            elif draw < 0.7 and fastest == 127:
                motor.set_pwm(robots, 0, robot, *self.rng.integers(-255, 256, 2).tolist())

    def stop(self) -> None:
        """Switch all motors off, at once."""
        for robot in range(EACH):
            motor.set_pwm(self.sim.world.state.robots, 0, robot, 0, 0)
        self.sim.world.state.robots["motor_speed"] = 0.0

    def scatter(self) -> None:
        """Set all bodies rolling, at up to 1 m/s."""
        for axis in ("velocity_x", "velocity_y"):
            self.sim.world.state.bodies[axis][0] = self.rng.uniform(-700, 700, 2 * EACH)

    def tick(self) -> None:
        """Let a tick pass."""
        self.sim.run(0.01)
        self.sim.sync()

    def discs(self) -> np.ndarray:
        """Return x, y and radius [mm] of all, robots first."""
        robots, bodies = self.sim.world.state.robots[0], self.sim.world.state.bodies[0]
        discs = np.empty((len(robots) + len(bodies), 3))
        discs[:EACH, 0], discs[:EACH, 1], discs[:EACH, 2] = robots["x_mm"], robots["y_mm"], 27.5
        discs[EACH:, 0], discs[EACH:, 1], discs[EACH:, 2] = bodies["x_mm"], bodies["y_mm"], bodies["radius_mm"]
        return discs

    def worst_mm(self) -> tuple[float, float]:
        """Return the deepest overlap of two discs and the deepest place in a wall [mm]."""
        discs = self.discs()
        return worst_overlap_mm(discs), worst_depth_mm(discs, self.walls)

    def energy(self) -> float:
        """Return twice the kinetic energy of the bodies for masses of 1 [mm^2/s^2]."""
        bodies = self.sim.world.state.bodies[0]
        return float((bodies["velocity_x"] ** 2 + bodies["velocity_y"] ** 2).sum())


def rush(pile: Pile, tick_count: int) -> tuple[float, float]:
    """Let all drive about; return the deepest overlap and the deepest place in a wall of all ticks [mm]."""
    overlap, depth = -math.inf, -math.inf
    for tick in range(tick_count):
        if tick % REDRAWN_EVERY == 0:
            pile.drive()
        pile.tick()
        overlap, depth = map(max, (overlap, depth), pile.worst_mm())
    return overlap, depth


def calm(pile: Pile, tick_count: int) -> tuple[float, float, float]:
    """Let bodies roll out among robots that are switched off.

    Returns:
        The deepest overlap, the deepest place in a wall [mm], and how far the robot came that came farthest [mm].

    Raises:
        AssertionError: If the bodies' energy grew in a tick.
    """
    pile.stop()
    pile.scatter()
    overlap, depth, energy = -math.inf, -math.inf, pile.energy()
    before = pile.discs()[:EACH]
    for tick in range(tick_count):
        pile.tick()
        assert pile.energy() <= energy * (1 + 1e-12), f"tick {tick}: energy {energy} became {pile.energy()}"
        energy = pile.energy()
        overlap, depth = map(max, (overlap, depth), pile.worst_mm())
    moved = pile.discs()[:EACH] - before
    return overlap, depth, float(np.hypot(moved[:, 0], moved[:, 1]).max())
