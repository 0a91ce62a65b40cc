"""Turrets: modules on a robot's back that answer orders of their own (khepera-protocol.md 4.18 and 10).

A turret is a number, a name and a table of orders. What it may ask of its robot and of the world comes through one
object, its `Site`, that it gets when it is fitted.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, TypeVar

from kiks.model.robot import RobotSpec

Values = tuple[int, ...]

Orders = Mapping[str, tuple[int, Callable[..., Values | None]]]
"""For each letter how many numbers the order takes, and the function that carries it out.

It is called with the turret and the numbers, and returns the values of the answer, or None for numbers that it does not
allow. The first line of its docstring says what the order does.
"""

AnyTurret = TypeVar("AnyTurret", bound="Turret")

USER_NUMBERS = range(24, 32)
"""Numbers that K-Team left to users (khepera-protocol.md 10.1)."""


@dataclass(frozen=True)
class Shape:
    """Something to draw of a turret, seen from above.

    Attributes:
        points: Corners [mm], ahead and to the left of the robot's centre; of one point a disc is drawn.
        colour: How it is filled, as HTML has it.
        radius_mm: Of the disc.
    """

    points: tuple[tuple[float, float], ...]
    colour: str = "#808080"
    radius_mm: float = 0.0


@dataclass(frozen=True)
class Met:
    """The hit of a ray.

    Attributes:
        distance_mm: From the robot's centre [mm].
        brightness: 1 black to 255 white.
        robot: Number of the robot it met, from 1, or 0.
        body: Number of the ball or cylinder it met, or 0. A wall is neither.
    """

    distance_mm: float
    brightness: int
    robot: int = 0
    body: int = 0


class Site(Protocol):
    """The view that a turret has of its robot and of the world."""

    @property
    def robot(self) -> int:
        """Number of the robot, from 1."""

    @property
    def spec(self) -> RobotSpec:
        """The robot's kind."""

    @property
    def record(self) -> Any:
        """The robot's record of `kiks.engine.state.ROBOT`: part of every snapshot and hash."""

    @property
    def memory(self) -> Any:
        """Numbers that the turret may keep, float64 [`Turret.memory_count`], part of every snapshot and hash."""

    @property
    def arena_mm(self) -> tuple[float, float]:
        """Width and height of the arena [mm]."""

    @property
    def lock(self) -> AbstractContextManager[Any]:
        """The lock of the simulation: hold it to change something from outside."""

    @property
    def time_ns(self) -> int:
        """The simulated time [ns]."""

    def pose(self) -> tuple[float, float, float]:
        """Return the robot's pose: x_mm, y_mm, heading_rad."""

    def ray(self, angle_rad: float = 0.0) -> Met:
        """Return what is in a direction, counter-clockwise from ahead."""

    def floor(self, ahead_mm: float = 0.0, left_mm: float = 0.0, index: int = 0) -> int:
        """Return the reading of a floor sensor at a place of the robot: 0 on black to 1023 on white, with noise.

        Sensors with another `index` have noise of their own.
        """

    def random(self, index: int = 0, time_ns: int | None = None) -> float:
        """Return a number in [0, 1) that belongs to this seed, robot, turret, time (the present one) and index."""

    def poses(self) -> list[tuple[float, float, float]]:
        """Return the poses of all robots, robot 1 first."""

    def bodies(self) -> Any:
        """Return the balls and cylinders, records of `kiks.engine.state.BODY`."""

    def held_body(self) -> Any:
        """Return the record of the body that a gripper holds or has between its jaws; None without one."""

    def turrets(self, kind: type[AnyTurret]) -> dict[int, AnyTurret]:
        """Return the turrets of a kind on all robots, by the robots' numbers, in rising order."""


class Turret:
    """A turret: what every kind of its own inherits from.

    Attributes:
        number: Where it answers, `T,<number>,...`; `USER_NUMBERS` are free.
        name: What `net` prints.
        revision: Version and revision, the answer to order B, which is the firmware's.
        orders: The table.
        memory_count: How many numbers it remembers in the robot's record.
        site: What it may ask, once it is fitted.

    Example:
        >>> class Dice(Turret):
        ...     number, name = 24, "Dice"
        ...
        ...     def roll(self, sides):
        ...         return (1 + int(sides * self.site.random()),) if sides > 0 else None
        ...
        ...     orders = {"R": (1, roll)}
        >>> from kiks import Khepera, Simulation
        >>> sim = Simulation()
        >>> dice = sim.fit(1, Dice())
        >>> Khepera(sim.port(1)).turret(24, "R,1")
        [1]
    """

    number: int
    name: str
    revision: tuple[int, int] = (1, 0)
    orders: ClassVar[Orders] = {}
    memory_count: int = 0
    site: Site

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: turret {self.number}, {self.name!r}>"

    def fit(self, site: Site) -> None:
        """Fit the turret to a robot; the power is on."""
        self.site = site

    def reset(self) -> None:
        """React to a reset of the robot; by default do nothing."""

    def order(self, letter: str, values: Values) -> Values | None:
        """Carry out an order and return the values of its answer, None for an order it does not know."""
        entry = self.orders.get(letter)
        return entry[1](self, *values) if entry is not None and len(values) == entry[0] else None

    def status(self) -> str:
        """Return its present state in a line, for a person at the desk."""
        return "a user-defined turret"

    def shapes(self) -> Sequence[Shape]:
        """Return its present drawing."""
        return ()
