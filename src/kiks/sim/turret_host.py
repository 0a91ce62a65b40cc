"""What a simulation tells a turret of the robot that it sits on, and which turrets there are by name."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

from kiks.engine.physics.gripper import find_object
from kiks.engine.sensing.range_finder import chance, probe
from kiks.engine.state import MEMORY_COUNT
from kiks.errors import ParameterError, nearest, shown
from kiks.firmware.battle import Battle
from kiks.firmware.general_io import GeneralIO
from kiks.firmware.gripper import Gripper
from kiks.firmware.k213 import K213
from kiks.firmware.radio import Radio
from kiks.firmware.turret import AnyTurret, Met, Turret
from kiks.model.checks import check_heading
from kiks.model.robot import RobotSpec

if TYPE_CHECKING:
    from kiks.sim.simulation import Simulation

KINDS: dict[str, type[Turret]] = {"gripper": Gripper, "radio": Radio, "io": GeneralIO, "battle": Battle}

NAMES = ("k213", *KINDS)
"""What `Simulation.fit` takes by name."""

STREAM_TURRET = 1000
"""Random streams from here on are the turrets', each its number farther."""


class RobotSite:
    """A `kiks.firmware.turret.Site`: the back of a robot of a simulation.

    Args:
        sim: The simulation.
        index: Which robot, from 0.
        turret: Who asks.
        first: Where its numbers begin among those that turrets remember.
    """

    def __init__(self, sim: Simulation, index: int, turret: Turret, first: int) -> None:
        self._sim = sim
        self._index = index
        self._stream = STREAM_TURRET + turret.number
        self._first, self._count = first, turret.memory_count

    @property
    def robot(self) -> int:
        """Number of the robot, from 1."""
        return self._index + 1

    @property
    def spec(self) -> RobotSpec:
        """What kind of robot it is."""
        return self._sim.specs[self._index]

    @property
    def record(self) -> Any:
        """The robot's record of `kiks.engine.state.ROBOT`."""
        return self._sim.state.robots[0, self._index]

    @property
    def memory(self) -> Any:
        """Numbers that the turret may keep, float64 [`Turret.memory_count`]."""
        return self.record["turret_memory"][self._first : self._first + self._count]

    @property
    def arena_mm(self) -> tuple[float, float]:
        """Width and height of the arena [mm]."""
        return float(self._sim.arena.width_mm), float(self._sim.arena.height_mm)

    @property
    def lock(self) -> AbstractContextManager[Any]:
        """To be held by whoever changes something from outside the simulation."""
        return self._sim.lock

    @property
    def time_ns(self) -> int:
        """The simulated time [ns]."""
        return self._sim.now_ns

    def pose(self) -> tuple[float, float, float]:
        """Return where the robot is: x_mm, y_mm, heading_rad."""
        return self._sim.pose(self._index + 1)

    def ray(self, angle_rad: float = 0.0) -> Met:
        """Return what is in a direction, counter-clockwise from ahead."""
        sim = self._sim
        sim.sync()
        ticks, now_ns = sim.state.tick_count, sim.now_ns
        angle_rad = check_heading("angle_rad", angle_rad)
        distance_mm, disc, brightness = probe(sim.scene, sim.sight, ticks, now_ns, self._index, angle_rad)
        if disc < 0:
            return Met(distance_mm, brightness)
        if disc < sim.robot_count:
            return Met(distance_mm, brightness, robot=disc + 1)
        body: Any = sim.state.bodies[0, disc - sim.robot_count]
        return Met(distance_mm, brightness, body=int(body["number"]))

    def random(self, index: int = 0, time_ns: int | None = None) -> float:
        """Return a number in [0, 1) that belongs to this seed, robot, turret, time (the present one) and index."""
        time_ns = self._sim.now_ns if time_ns is None else time_ns
        return float(chance(self._sim.seed, self._index, self._stream, time_ns, index))

    def poses(self) -> list[tuple[float, float, float]]:
        """Return where all robots are, robot 1 first."""
        return [(x_mm, y_mm, heading_rad) for x_mm, y_mm, heading_rad in self._sim.poses().tolist()]

    def bodies(self) -> Any:
        """Return the balls and cylinders, records of `kiks.engine.state.BODY`."""
        return self._sim.bodies()

    def held_body(self) -> Any:
        """Return the record of what a gripper holds or has between its jaws, None for nothing."""
        row = find_object(self._sim.scene, self._index)
        return None if row < 0 else self._sim.state.bodies[0, row]

    def turrets(self, kind: type[AnyTurret]) -> dict[int, AnyTurret]:
        """Return the turrets of a kind on all robots, by the robots' numbers, in rising order."""
        found = enumerate((wire.firmware.fitted for wire in self._sim.wires), 1)
        return {robot: each for robot, fitted in found for each in fitted if isinstance(each, kind)}


def named(turret: object, camera: Callable[[], Turret]) -> Turret:
    """Return a turret of a name, or what is one already.

    Args:
        turret: The name or the turret.
        camera: Makes a K213.

    Raises:
        ParameterError: If it is neither, or one of a user's own that breaks the rules.
    """
    if isinstance(turret, str):
        if turret == "k213":
            return camera()
        if turret not in KINDS:
            raise ParameterError(
                f"turret must be one of {', '.join(map(repr, NAMES))} or an object of your own, but it was "
                f"{shown(turret)}."
                f"{nearest(turret, NAMES)} docs/turrets.md says how to make one."
            )
        return KINDS[turret]()
    if not isinstance(turret, Turret):
        raise ParameterError(
            f"turret must be a name or a kiks.firmware.turret.Turret, but it was {shown(turret)}. Inherit from Turret: "
            "docs/turrets.md says how."
        )
    if not isinstance(turret, GeneralIO):
        _check(turret)
    return turret


def name_of(turret: Turret) -> str | None:
    """Return the name that `Simulation.fit` takes for a turret; None for one of a user's own."""
    if type(turret) is K213:
        return "k213"
    return next((name for name, kind in KINDS.items() if type(turret) is kind), None)


def _check(turret: Turret) -> None:
    number, name = getattr(turret, "number", None), getattr(turret, "name", None)
    if not isinstance(number, int) or not 0 <= number <= 99:
        raise ParameterError(
            f"number of a turret must be a whole number from 0 to 99, but it was {shown(number)}. 24 to 31 are for "
            "users."
        )
    if not isinstance(name, str) or not name.isascii() or not name.isprintable() or not name:
        raise ParameterError(
            f"name of a turret must be a line of ASCII, but it was {shown(name)}. Tool 'net' prints it."
        )
    revision = turret.revision
    is_pair = isinstance(revision, tuple) and len(revision) == 2
    if not is_pair or not all(isinstance(part, int) and part >= 0 for part in revision):
        raise ParameterError(
            f"revision of a turret must be two whole numbers, but it was {shown(revision)}. Take (1, 0)."
        )
    for letter, row in turret.orders.items():
        if len(letter) != 1 or not "A" <= letter <= "Z" or letter == "B":
            raise ParameterError(
                f"orders of a turret must be capital letters other than B, but one was {shown(letter)}. B is its "
                "revision."
            )
        if not isinstance(row, tuple) or len(row) != 2 or not isinstance(row[0], int) or not callable(row[1]):
            raise ParameterError(
                f"orders of a turret must be a count of numbers and a function, but {letter} was {shown(row)}. "
                "Write 'orders = {\"R\": (0, read)}'."
            )


def first_memory(turret: Turret, fitted: list[Turret]) -> int:
    """Return where the numbers of one more turret begin among those that the turrets of a robot remember.

    Raises:
        ParameterError: If there is no room for them.
    """
    first = sum(each.memory_count for each in fitted)
    if not isinstance(turret.memory_count, int) or not 0 <= turret.memory_count <= MEMORY_COUNT - first:
        raise ParameterError(
            f"memory_count of a turret must be at most {MEMORY_COUNT - first}, but it was "
            f"{shown(turret.memory_count)}. "
            f"All turrets of a robot share {MEMORY_COUNT} numbers."
        )
    return first
