"""Turrets on the robots of a world: which there are by name, and what one may ask of the robot it sits on."""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, Any

from pydantic import Field

from kiks.engine.physics.gripper import find_object
from kiks.engine.scalar_math import uniform
from kiks.engine.sensing.floor import read_floor
from kiks.engine.sensing.range_finder import probe
from kiks.engine.state import MEMORY_COUNT
from kiks.errors import ParameterError, shown
from kiks.firmware.firmware import Firmware
from kiks.firmware.general_io import GeneralIO
from kiks.firmware.k213 import K213
from kiks.firmware.radio import Radio, deliver
from kiks.firmware.turret import AnyTurret, Met, Turret
from kiks.model.checks import check_choice, check_count, check_heading, check_number
from kiks.model.data_file import Rule, Whole, check, record
from kiks.model.robot import RobotSpec
from kiks.model.turrets import TURRETS
from kiks.sim.cameras import Cameras
from kiks.sim.world import World

STREAM_TURRET = 1000
"""Random streams from here on are the turrets', each its number farther."""


@record
class TurretOfUser:
    """What is known of a turret of a user's own without its program."""

    number: Annotated[Whole, Field(ge=-1, le=99, description="24 to 31 are for users.")]
    name: Annotated[
        str, Field(pattern=r"^[ -~]+$", description="Tool 'net' prints it."), Rule("a line of ASCII characters")
    ]
    revision: Annotated[
        tuple[Annotated[Whole, Field(ge=0)], ...],
        Field(min_length=2, max_length=2, description="Take (1, 0)."),
        Rule("two whole numbers"),
    ]
    memory_count: Annotated[Whole, Field(ge=0, le=MEMORY_COUNT)]


class Turrets:
    """The turrets on all robots of a world.

    Args:
        world: The world.
        firmwares: Of its robots, in their order; the list grows when robots are added.

    Attributes:
        world: As above.
        firmwares: As above.
        cameras: The cameras among them.
    """

    def __init__(self, world: World, firmwares: Sequence[Firmware]) -> None:
        self.world = world
        self.firmwares = firmwares
        self.cameras = Cameras(world)
        self._radios: dict[int, Radio] = {}

    def sync(self) -> None:
        """Do the ticks that have begun, take the pictures that are due on the way, and deliver radio messages."""
        if self.cameras:
            self.cameras.sync()
        self.world.tick_to(self.world.now_ns)
        if self._radios:
            deliver(self._radios, self.world.now_ns)

    def fit(self, index: int, turret: str | Turret) -> Turret:
        """Put a turret on a robot; return it.

        Args:
            index: The robot's index.
            turret: Its name, or one of a user's own.
        """
        firmware = self.firmwares[index]
        fitted = named(turret)
        there = [each for each in firmware.fitted if each.number == fitted.number]
        if there:
            raise ParameterError(
                f"turret must be one that robot {index + 1} has not got, but {shown(there[0].name)} has its number, "
                f"{fitted.number}. Give a turret of your own another, 24 to 31."
            )
        first = sum(each.memory_count for each in firmware.fitted)
        advice = f"All turrets of a robot share {MEMORY_COUNT} numbers."
        check_count("memory_count of a turret", fitted.memory_count, 0, MEMORY_COUNT - first, advice)
        site = _RobotSite(self, index, fitted, first)
        fitted.fit(site)
        firmware.fit(fitted)
        self.world.rebuild_scene()  # a lone robot needs more of the engine with a gripper
        if isinstance(fitted, Radio):
            self._radios = site.turrets(Radio)
        elif isinstance(fitted, K213):
            self.cameras.fit(index, fitted)
        return fitted


class _RobotSite:
    """A `kiks.firmware.turret.Site`: the back of a robot of a simulation.

    Args:
        turrets: All turrets of the simulation.
        index: The robot's index.
        turret: The turret that sits here.
        first: Index of its first number among those that turrets remember.
    """

    def __init__(self, turrets: Turrets, index: int, turret: Turret, first: int) -> None:
        self._world, self._sync, self._firmwares = turrets.world, turrets.sync, turrets.firmwares
        self._index = index
        self._stream = STREAM_TURRET + turret.number
        self._first, self._count = first, turret.memory_count

    @property
    def robot(self) -> int:
        return self._index + 1

    @property
    def spec(self) -> RobotSpec:
        return self._world.specs[self._index]

    @property
    def record(self) -> Any:
        return self._world.state.robots[0, self._index]

    @property
    def memory(self) -> Any:
        return self.record["turret_memory"][self._first : self._first + self._count]

    @property
    def arena_mm(self) -> tuple[float, float]:
        return float(self._world.arena.width_mm), float(self._world.arena.height_mm)

    @property
    @contextmanager
    def lock(self) -> Iterator[None]:
        with self._world.lock:
            yield
            self._world.note_change()

    @property
    def time_ns(self) -> int:
        return self._world.now_ns

    def pose(self) -> tuple[float, float, float]:
        with self._world.lock:
            self._sync()
            return self._world.pose(self._index)

    def ray(self, angle_rad: float = 0.0) -> Met:
        world = self._world
        # The engine is behind the clock until the state is read.
        self._sync()
        ticks, now_ns = world.state.tick_count, world.now_ns
        angle_rad = check_heading("angle_rad", angle_rad)
        distance_mm, disc, brightness = probe(world.scene, self._index, ticks, now_ns, angle_rad)
        if disc < 0:
            return Met(distance_mm, brightness)
        if disc < world.robot_count:
            return Met(distance_mm, brightness, robot=disc + 1)
        body: Any = world.state.bodies[0, disc - world.robot_count]
        return Met(distance_mm, brightness, body=int(body["number"]))

    def floor(self, ahead_mm: float = 0.0, left_mm: float = 0.0, index: int = 0) -> int:
        world = self._world
        with world.lock:
            self._sync()
            ahead_mm, left_mm = (check_number("a place", each, -1e3, 1e3) for each in (ahead_mm, left_mm))
            given = world.state.tick_count, world.now_ns, True, ahead_mm, left_mm, index
            return int(read_floor(world.scene, self._index, *given))

    def random(self, index: int = 0, time_ns: int | None = None) -> float:
        time_ns = self._world.now_ns if time_ns is None else time_ns
        return float(uniform(self._world.seed, 0, self._index, self._stream, time_ns, index))

    def poses(self) -> list[tuple[float, float, float]]:
        with self._world.lock:
            self._sync()
            return [self._world.pose(index) for index in range(self._world.robot_count)]

    def bodies(self) -> Any:
        with self._world.lock:
            self._sync()
            return self._world.bodies()

    def held_body(self) -> Any:
        row = find_object(self._world.scene, self._index)
        return None if row < 0 else self._world.state.bodies[0, row]

    def turrets(self, kind: type[AnyTurret]) -> dict[int, AnyTurret]:
        found = enumerate((firmware.fitted for firmware in self._firmwares), 1)
        return {robot: each for robot, fitted in found for each in fitted if isinstance(each, kind)}


def named(turret: object) -> Turret:
    """Return a turret of a name, or what is one already."""
    if isinstance(turret, str):
        rule = f"one of {', '.join(map(repr, TURRETS))} or an object of your own"
        check_choice("turret", turret, TURRETS, rule, 'The page "Turrets" of the documentation says how to make one.')
        made: Turret = pkgutil.resolve_name(TURRETS[turret])()
        return made
    if not isinstance(turret, Turret):
        raise ParameterError(
            f"turret must be a name or a kiks.firmware.turret.Turret, but it was {shown(turret)}. Inherit from Turret: "
            'the page "Turrets" of the documentation says how.'
        )
    # General I/O has no orders, and no number to be asked by, which the rules for others want.
    if not isinstance(turret, GeneralIO):
        _check(turret)
    return turret


def name_of(turret: Turret) -> str | None:
    """Return the name that `Simulation.fit` takes for a turret; None for one of a user's own."""
    kind = f"{type(turret).__module__}.{type(turret).__qualname__}"
    return next((name for name, known in TURRETS.items() if kind == known), None)


def has_user_turret(firmware: Firmware) -> bool:
    """Return whether a robot has a turret of a user's own, whose program a replay may not have."""
    return any(name_of(turret) is None for turret in firmware.fitted)


def described(turret: Turret) -> dict[str, Any]:
    """Return the fields of a `TurretOfUser`."""
    return {name: getattr(turret, name, None) for name in ("number", "name", "revision", "memory_count")}


def _check(turret: Turret) -> None:
    check(TurretOfUser, described(turret), f"turret {type(turret).__name__}")
    for letter, row in turret.orders.items():
        # The firmware answers B itself, for each turret.
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
