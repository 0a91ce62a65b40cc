"""Placements: a person, or the program itself in a simulation, puts the robot where a measurement needs it."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Protocol

from kiks.errors import ParameterError, shown
from kiks.sim.simulation import Simulation


class Place(enum.Enum):
    """Places for a measurement."""

    FREE = "free"
    WALL = "wall"


@dataclass(frozen=True)
class Instruction:
    """An instruction before a measurement.

    Attributes:
        place: In the open, or in front of a straight white wall, facing it.
        text: The same in words, for a person.
        gap_mm: Marked distance from the wall to the robot's rim [mm]; 0 in the open.
    """

    place: Place
    text: str
    gap_mm: float = 0.0


class Placements(Protocol):
    """Carries out instructions."""

    def place(self, instruction: Instruction) -> float:
        """Put the robot there; return its real gap [mm]."""

    def wants_repeat(self, finding: str, *, is_good: bool) -> bool:
        """Show a result; return True to repeat the placement and its measurement."""


class SimPlacements:
    """Places a simulated robot in front of the upper wall of its arena, or in the middle.

    Args:
        sim: The simulation.
        robot: Number of the robot, from 1.
        skew_rad: Error of the heading at the wall [rad], as by a hand.
    """

    def __init__(self, sim: Simulation, robot: int = 1, *, skew_rad: float = 0.0) -> None:
        self.sim = sim
        self.robot = robot
        self.skew_rad = skew_rad

    def place(self, instruction: Instruction) -> float:
        """Put the robot there."""
        arena, radius_mm = self.sim.arena, self.sim.spec.body.radius_mm
        x_mm, y_mm = arena.width_mm / 2, arena.height_mm / 2
        if instruction.place is Place.WALL:
            y_mm = self._touching_mm(x_mm, y_mm) - instruction.gap_mm
        if not arena.free_for(x_mm, y_mm, radius_mm):
            raise ParameterError(
                f"the arena must have room for a robot {instruction.gap_mm:g} mm below the middle of its upper wall, "
                f"but {shown(arena.name)} has none. Take a box of at least 500 x 650 mm, empty, or shorten the run-up."
            )
        self.sim.place(self.robot, x_mm, y_mm, math.pi / 2 + self.skew_rad)
        return instruction.gap_mm

    def wants_repeat(self, finding: str, *, is_good: bool) -> bool:
        """Return False: a repetition would give the same result."""
        return False

    def _touching_mm(self, x_mm: float, free_mm: float) -> float:
        """Return the y at which the robot's rim touches the upper wall [mm]."""
        arena, radius_mm = self.sim.arena, self.sim.spec.body.radius_mm
        blocked_mm = free_mm
        while arena.free_for(x_mm, blocked_mm, radius_mm):
            free_mm, blocked_mm = blocked_mm, blocked_mm + 1.0
        while blocked_mm - free_mm > 1e-6:
            middle_mm = (free_mm + blocked_mm) / 2
            if arena.free_for(x_mm, middle_mm, radius_mm):
                free_mm = middle_mm
            else:
                blocked_mm = middle_mm
        return free_mm
