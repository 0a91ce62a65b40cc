"""The frame of a demonstration: a world, the programs that drive its robots, and what came of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import ClassVar

from kiks.client.khepera import Khepera
from kiks.engine.scalar_math import uniform
from kiks.errors import ArenaError, shown
from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation

STREAM_SCENE = 100
"""Random stream of what scenes leave to chance."""

ATTEMPTS = 10_000
"""Random places that are tried for a thing."""


class Scene:
    """A demonstration.

    The programs know what a robot tells them, no more. A scene stands outside, like the person at the table: it puts
    things into the arena, moves them, and measures what was achieved.

    Args:
        arena: Where it takes place; the scene's own if left out.
        seed: Seed of all random numbers, those of the world and those of the scene.
        baud: Speed of the lines [bit/s]; the scene's own if left out.

    Attributes:
        sim: The world.
        robot: The first robot.
    """

    seconds: ClassVar[float] = 120.0
    """How long it takes by default [s]."""

    baud: ClassVar[int] = 9600
    """Speed of the lines by default [bit/s]."""

    slice_s: ClassVar[float] = 0.1
    """Simulated time between two looks from outside [s]."""

    robot_count: ClassVar[int] = 1
    """How many robots there are."""

    def __init__(self, arena: Arena | None = None, *, seed: int = 0, baud: int | None = None) -> None:
        self.seed = seed
        self.sim = self.make_simulation(arena)
        self.ports = [self.sim.port(number) for number in range(1, self.sim.robot_count + 1)]
        for port in self.ports:
            port.baudrate = self.baud if baud is None else baud
        self.robot = Khepera(self.ports[0])
        self.prepare()

    # ---- what each scene has of its own ----

    def make_arena(self) -> Arena:
        """Return the arena if no other is given."""
        return Arena.default()

    def make_simulation(self, arena: Arena | None) -> Simulation:
        """Return the world: the arena, or the scene's own if there is none, with its robots."""
        return Simulation(arena or self.make_arena(), robots=self.robot_count, seed=self.seed)

    def prepare(self) -> None:
        """Put things into the arena and start the programs."""

    def step(self) -> None:
        """Let the programs do one step, in which time passes."""
        raise NotImplementedError

    def watch(self) -> None:
        """Look from outside, after each slice of time."""

    @property
    def is_over(self) -> bool:
        """Whether there is nothing more to see."""
        return False

    def result(self) -> str:
        """Return what was achieved so far, in words and numbers."""
        return f"{self.sim.travelled_mm(1) / 1000:.2f} m   {self.contacts()}"

    # ---- what all share ----

    def slices(self, seconds: float | None = None) -> Iterator[None]:
        """Run, and stop for a moment after each slice of time.

        Args:
            seconds: Until when [s]; the scene's own time if left out.
        """
        end_s = self.seconds if seconds is None else seconds
        while self.sim.time_s < end_s and not self.is_over:
            until_s = self.sim.time_s + self.slice_s
            while self.sim.time_s < until_s and not self.is_over:
                self.step()
            self.watch()
            yield

    def run(self, seconds: float | None = None) -> str:
        """Run to the end [s] and return the result."""
        for _ in self.slices(seconds):
            pass
        return self.result()

    def contact_count(self) -> int:
        """Return how often robots have met something so far."""
        return sum(self.sim.contacts(number) for number in range(1, self.sim.robot_count + 1))

    def contacts(self) -> str:
        """Return that in words."""
        return f"{self.contact_count()} contacts"

    def chance(self, *what: int) -> float:
        """Return a random number from 0 to 1 that depends on the seed and on what it is for."""
        about, number, axis = (*what, 0, 0, 0)[:3]
        return float(uniform(self.seed, 0, about, STREAM_SCENE, number, axis))

    def random_place(self, about: int, radius_mm: float, gap_mm: float) -> tuple[float, float]:
        """Return a random place for a disc that leaves a gap to walls, robots, balls and cylinders [mm]."""
        arena, bodies = self.sim.arena, self.sim.bodies()
        taken = [(x, y, self.sim.spec.body.radius_mm) for x, y, _ in self.sim.poses().tolist()]
        taken += zip(bodies["x_mm"].tolist(), bodies["y_mm"].tolist(), bodies["radius_mm"].tolist(), strict=True)
        for attempt in range(ATTEMPTS):
            x, y = arena.width_mm * self.chance(about, attempt, 0), arena.height_mm * self.chance(about, attempt, 1)
            if arena.free_for(x, y, radius_mm + gap_mm) and all(
                math.hypot(x - other_x, y - other_y) >= radius_mm + other_mm + gap_mm
                for other_x, other_y, other_mm in taken
            ):
                return x, y
        raise ArenaError(
            f"Arena {shown(arena.name)} must have room for everything, but {ATTEMPTS} random places for thing "
            f"{about} of "
            f"{radius_mm:g} mm radius, {gap_mm:g} mm from all else, were all taken. Take a larger one."
        )
