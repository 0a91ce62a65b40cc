"""Placements: a person, or the program itself in a simulation, puts the robot where a measurement needs it."""

from __future__ import annotations

import math
from typing import Protocol

from kiks.errors import ParameterError, shown
from kiks.sim.simulation import Simulation


class Placements(Protocol):
    """Carries out instructions."""

    def place(self, instruction: str, gap_mm: float | None = None) -> float | None:
        """Put the robot there; return its real gap [mm].

        Args:
            instruction: Where the robot must stand, in words for a person.
            gap_mm: Marked distance from a straight white wall, which it faces, to its rim [mm]; None in the open.
        """

    def wants_repeat(self, finding: str, *, is_good: bool) -> bool:
        """Show a result; return True to repeat the placement and its measurement."""


class SimPlacements:
    """Places a simulated robot in front of the upper wall of its arena, askew as by a hand, or in the middle."""

    def __init__(self, sim: Simulation, robot: int = 1, *, skew_rad: float = 0.0) -> None:
        self.sim = sim
        self.robot = robot
        self.skew_rad = skew_rad

    def place(self, instruction: str, gap_mm: float | None = None) -> float | None:
        """Put the robot there."""
        arena, radius_mm = self.sim.arena, self.sim.spec.body.radius_mm
        x_mm, y_mm = arena.width_mm / 2, arena.height_mm / 2
        if gap_mm is not None:
            # Halve the way to the wall until the rim touches it.
            free_mm, blocked_mm = y_mm, arena.height_mm
            while blocked_mm - free_mm > 1e-6:
                middle_mm = (free_mm + blocked_mm) / 2
                if arena.free_for(x_mm, middle_mm, radius_mm):
                    free_mm = middle_mm
                else:
                    blocked_mm = middle_mm
            y_mm = free_mm - gap_mm
        if not arena.free_for(x_mm, y_mm, radius_mm):
            raise ParameterError(
                f"the arena must have room for a robot {gap_mm or 0:g} mm below the middle of its upper wall, "
                f"but {shown(arena.name)} has none. Take a box of at least 500 x 650 mm, empty, or shorten the run-up."
            )
        self.sim.place(self.robot, x_mm, y_mm, math.pi / 2 + self.skew_rad)
        return gap_mm

    def wants_repeat(self, finding: str, *, is_good: bool) -> bool:
        """Return False: a repetition would give the same result."""
        return False
