"""Drags that reach into a world: they take a robot, a ball, a cylinder or a lamp, move and turn it, and let go."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kiks.errors import ParameterError, shown
from kiks.model.checks import check_count, check_heading, check_number
from kiks.sim.simulation import Simulation

STEP_MM = 0.5
"""Distance between two collision checks of a drag [mm], as in KiKS 2.2.0 (kiks-behaviour.md 1.5)."""

STEPS_MAX = 2000
"""Most steps of one move; a longer pull takes several moves."""

SIDES_RAD = (0.0, *(sign * math.radians(degrees) for degrees in (25, 50, 75, 87, 89, 89.7) for sign in (1, -1)))
"""Detour angles tried when the straight way is blocked: a thing never gets farther from where it is wanted."""

KINDS = ("robot", "body", "lamp")


@dataclass
class Held:
    """Something in a hand.

    Attributes:
        what: 'robot', 'body' or 'lamp'.
        index: Which one, from 0.
        x_mm: Where the hand has brought it.
        y_mm: Where the hand has brought it.
        heading_rad: Where it looks, if it is a robot.
    """

    what: str
    index: int
    x_mm: float
    y_mm: float
    heading_rad: float = 0.0


class Drags:
    """The hands of all viewers of a world; each viewer has one.

    What is held stays where the hand is, though its wheels turn and others push: `keep` puts it back, and has to be
    called again and again while time passes (`Gate.keep`). All of it is called with the simulation's lock held.

    Example:
        >>> from kiks import Arena, Simulation
        >>> sim = Simulation(Arena.box(500, 500))
        >>> hands = Drags(sim)
        >>> hands.grab("viewer", "robot", 0)
        >>> hands.move("viewer", 900, 250)
        >>> [int(value) for value in sim.pose(1)[:2]]
        [462, 250]
    """

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._held: dict[str, Held] = {}

    @property
    def are_empty(self) -> bool:
        """Whether no hand holds anything."""
        return not self._held

    def holds(self, what: str, index: int) -> bool:
        """Return whether a hand holds a thing."""
        return any(held.what == what and held.index == index for held in self._held.values())

    def grab(self, owner: str, what: str, index: int) -> None:
        """Take a thing in a viewer's hand; the hand drops the thing that it held before."""
        self.drop(owner)
        counts = self._counts()
        if not isinstance(what, str) or what not in KINDS:
            raise ParameterError(f"a hand must take one of {counts} by its kind, but it was to take {shown(what)}.")
        check_count(f"index of the {what} that a hand takes", index, 0, counts[what] - 1)
        # Two hands would pull it to and fro with each frame.
        if self.holds(what, index):
            raise ParameterError(f"one hand must let go before another takes {what} {index + 1}, but it holds it.")
        self._held[owner] = self._found(what, index)

    def move(self, owner: str, x_mm: float, y_mm: float) -> None:
        """Move what a hand holds towards a place, as far as it gets: it slides along what is in the way."""
        x_mm, y_mm = check_number("x_mm", x_mm), check_number("y_mm", y_mm)
        held = self._held_by(owner)
        if held is None:
            return
        if held.what == "lamp":
            # Lamps hang above everything: only the border of the arena stops them.
            held.x_mm = min(max(x_mm, 0.0), self._sim.arena.width_mm)
            held.y_mm = min(max(y_mm, 0.0), self._sim.arena.height_mm)
        else:
            held.x_mm, held.y_mm = self._slide(held, x_mm, y_mm)
        self._put(held)

    def turn(self, owner: str, heading_rad: float) -> None:
        """Turn the robot that a hand holds."""
        heading_rad = check_heading("heading_rad", heading_rad)
        held = self._held_by(owner)
        if held is not None and held.what == "robot":
            held.heading_rad = heading_rad
            self._put(held)

    def drop(self, owner: str) -> None:
        """Let go of what a hand holds."""
        self._held.pop(owner, None)

    def drop_all(self) -> None:
        """Let go of everything."""
        self._held.clear()

    def keep(self) -> None:
        """Put everything that is held back where its hand is; what has gone meanwhile is held no longer."""
        for owner in list(self._held):
            held = self._held_by(owner)
            # Nothing moves a lamp but a hand.
            if held is None or held.what == "lamp":
                continue
            found = self._found(held.what, held.index)
            if (found.x_mm, found.y_mm, found.heading_rad) != (held.x_mm, held.y_mm, held.heading_rad):
                # A robot may have driven to where the hand was.
                held.x_mm, held.y_mm = self._slide(found, held.x_mm, held.y_mm)
                self._put(held)

    # ---- inside ----

    def _held_by(self, owner: str) -> Held | None:
        """Return what a hand holds; what has gone meanwhile is held no longer."""
        held = self._held.get(owner)
        if held is not None and held.index >= self._counts()[held.what]:
            self.drop(owner)
            return None
        return held

    def _counts(self) -> dict[str, int]:
        """Return how many there are of each kind of thing."""
        return {"robot": self._sim.robot_count, "body": len(self._bodies()), "lamp": len(self._sim.world.lamps)}

    def _bodies(self) -> Any:
        return self._sim.world.state.bodies[0]

    def _found(self, what: str, index: int) -> Held:
        """Return a thing as it lies there."""
        if what == "robot":
            return Held(what, index, *self._sim.pose(index + 1))
        if what == "body":
            body = self._bodies()[index]
            return Held(what, index, float(body["x_mm"]), float(body["y_mm"]))
        return Held(what, index, float(self._sim.world.lamps[index, 0]), float(self._sim.lamps[index, 1]))

    def _slide(self, held: Held, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Return how far a thing gets towards a place, in small steps that overlap nothing else."""
        is_free = self._freedom(held)
        x, y = held.x_mm, held.y_mm
        for _ in range(STEPS_MAX):
            left_mm = math.hypot(x_mm - x, y_mm - y)
            if left_mm == 0.0:
                break
            ahead_rad = math.atan2(y_mm - y, x_mm - x)
            # Straight ahead first, then ever more aside: so it slides along what is in the way.
            for side_rad in SIDES_RAD:
                step_mm = min(STEP_MM, left_mm * math.cos(side_rad))  # beyond that it gets farther away again
                to_x = x_mm if step_mm == left_mm else x + step_mm * math.cos(ahead_rad + side_rad)
                to_y = y_mm if step_mm == left_mm else y + step_mm * math.sin(ahead_rad + side_rad)
                if math.hypot(x_mm - to_x, y_mm - to_y) < left_mm and is_free(to_x, to_y):
                    x, y = to_x, to_y
                    break
            else:
                break
        return x, y

    def _freedom(self, held: Held) -> Callable[[float, float], bool]:
        self._sim.sync()
        return self._sim.world.free_space.may_lie(
            held.index if held.what == "robot" else self._sim.robot_count + held.index
        )

    def _put(self, held: Held) -> None:
        """Put a thing where its hand is; where others press upon it, it stays as it lies until they let it go."""
        if held.what == "lamp":
            self._sim.lamps[held.index, :2] = held.x_mm, held.y_mm
        elif not self._freedom(held)(held.x_mm, held.y_mm):
            return
        elif held.what == "robot":
            self._sim.place(held.index + 1, held.x_mm, held.y_mm, held.heading_rad)
        else:
            self._sim.move_body(int(self._bodies()["number"][held.index]), held.x_mm, held.y_mm)
