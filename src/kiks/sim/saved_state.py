"""All that a simulation is at an instant, in a form that can be written, read and gone back to.

A setup is what a world consists of: the arena, the kinds of robots, their turrets, the seed. A saved state is all that
changes while it runs. Random numbers depend on the seed and the time alone. So both together have one future, to the
bit.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from threading import RLock
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.engine.physics.gripper import ARM_MAX, JAWS_MAX
from kiks.engine.state import BALL, BODY, CYLINDER, MEMORY_COUNT, ROBOT
from kiks.errors import ParameterError, shown
from kiks.firmware.k213 import PERIODS_NS
from kiks.firmware.radio import ATTEMPTS, DATA_LIMIT
from kiks.firmware.receiver import LINE_LIMIT
from kiks.firmware.turret import Turret
from kiks.model.arena import Arena
from kiks.model.checks import CLOCK_END_NS, ROBOTS_MAX
from kiks.model.data_file import Switch, Text, Whole, check, parse_json, parse_toml, record
from kiks.model.project import Project, ProjectRobot
from kiks.model.robot import Baud, RobotSpec, robot_toml
from kiks.model.turrets import TURRETS
from kiks.sim.free_space import FreeSpace
from kiks.sim.simulation import Simulation
from kiks.sim.turret_host import name_of
from kiks.sim.wire import SavedWire
from kiks.sim.world import World
from kiks.units import TICK_NS

Instant = Annotated[Whole, Field(ge=-CLOCK_END_NS, le=2 * CLOCK_END_NS)]
Count = Annotated[Whole, Field(ge=0, le=2**62)]
Line = Annotated[str, Field(max_length=LINE_LIMIT + 1, pattern=r"^[\x00-\xff]*$")]
"""Bytes of a line, as characters of Latin-1."""


# ---- what a world consists of ----


@record
class TurretOfUser:
    """What is known of a turret of a user's own without its program."""

    number: Annotated[Whole, Field(ge=-1, le=99)]
    name: Text
    revision: Annotated[tuple[Count, ...], Field(min_length=2, max_length=2)]
    memory_count: Annotated[Whole, Field(ge=0, le=MEMORY_COUNT)]


class AbsentTurret(Turret):
    """Takes the place of a turret of a user's own whose program is not there: it knows no orders."""

    def __init__(self, known: TurretOfUser) -> None:
        self.number, self.name, self.memory_count = known.number, known.name, known.memory_count
        self.revision = (known.revision[0], known.revision[1])


@record
class _SetupFile:
    """A setup as JSON holds it."""

    seed: Annotated[Whole, Field(ge=0, le=2**63 - 1)]
    arena: str
    kinds: Annotated[tuple[str, ...], Field(max_length=ROBOTS_MAX)]
    robots: Annotated[tuple[Annotated[Whole, Field(ge=0)], ...], Field(max_length=ROBOTS_MAX)]
    turrets: tuple[tuple[Text | TurretOfUser, ...], ...]


@dataclass(frozen=True)
class Setup:
    """What a world consists of.

    Attributes:
        arena: The walls alone.
        specs: The kind of each robot.
        turrets: For each robot its turrets: their names, or what is known of those of users.
        seed: Seed of all random numbers.
    """

    arena: Arena
    specs: tuple[RobotSpec, ...]
    turrets: tuple[tuple[str | TurretOfUser, ...], ...]
    seed: int

    @classmethod
    def of(cls, sim: Simulation) -> Setup:
        """Return the setup of a simulation."""
        walls = replace(sim.arena, starts=(), lamps=(), balls=(), cylinders=())
        turrets = tuple(tuple(map(_described, wire.firmware.fitted)) for wire in sim.wires)
        return cls(walls, tuple(sim.specs), turrets, sim.seed)

    def to_bytes(self) -> bytes:
        """Return it as JSON."""
        kinds = list(dict.fromkeys(self.specs))
        turrets = [[each if isinstance(each, str) else vars(each) for each in of_one] for of_one in self.turrets]
        return json.dumps(
            {
                "seed": self.seed,
                "arena": Project(self.arena).to_bytes().decode(),
                "kinds": [robot_toml(kind) for kind in kinds],
                "robots": [kinds.index(spec) for spec in self.specs],
                "turrets": turrets,
            },
            default=vars,
        ).encode()

    @classmethod
    def from_bytes(cls, data: bytes, what: str) -> Setup:
        """Read what `to_bytes` returned.

        Args:
            data: The bytes.
            what: What messages call them.
        """
        file = check(_SetupFile, parse_json(data, what), what)
        arena = Project.from_bytes(file.arena.encode(), what=what).arena
        kinds = [check(RobotSpec, parse_toml(text.encode(), what), what) for text in file.kinds]
        if not (max(file.robots, default=-1) < len(kinds) and len(file.turrets) == len(file.robots)):
            raise ParameterError(
                f"{what} must name a kind and turrets for each robot, but it does not. Is the file damaged?"
            )
        for name in (each for of_one in file.turrets for each in of_one if isinstance(each, str)):
            if name not in TURRETS:
                turrets = ", ".join(TURRETS)
                raise ParameterError(
                    f"{what} must have turrets of {turrets}, but one was {shown(name)}. Is it of a newer KiKS?"
                )
        return cls(arena, tuple(kinds[kind] for kind in file.robots), file.turrets, file.seed)

    def simulation(self, poses: NDArray[np.float64], lock: RLock | None = None) -> Simulation:
        """Return a simulation of this setup.

        Args:
            poses: Where its robots are, whatever is there, float64 [robot, 3].
            lock: See `World`.
        """
        sim = Simulation.of_world(World(self.arena, self.specs, self.seed, poses, lock))
        self.extend(sim, poses)
        return sim

    def extend(self, sim: Simulation, poses: NDArray[np.float64]) -> None:
        """Add missing robots and turrets to a simulation, and set its walls.

        Args:
            sim: A simulation of an earlier setup of the same run.
            poses: Where its robots are then, whatever is there, float64 [robot, 3].
        """
        with sim.lock:
            # No robot may look from a place that the new walls do not have.
            for index, pose in enumerate(poses[: sim.robot_count].tolist()):
                sim.world.put_robot(index, *pose)
            if sim.arena is not self.arena:
                sim.world.take_walls(FreeSpace(self.arena, sim.specs, sim.world.state))
            for spec, pose in zip(self.specs[sim.robot_count :], poses[sim.robot_count :].tolist(), strict=True):
                sim.add_robot(spec, pose=pose)
            for number, turrets in enumerate(self.turrets, 1):
                for turret in turrets[len(sim.turrets(number)) :]:
                    sim.fit(number, turret if isinstance(turret, str) else AbsentTurret(turret))

    def project(self) -> Project:
        """Return a project with these walls, robots and turrets; robots of users' own files become Kheperas."""
        robots = tuple(
            ProjectRobot(turrets=tuple(name for name in turrets if isinstance(name, str))) for turrets in self.turrets
        )
        return Project(self.arena, robots, seed=self.seed)


def setup_name(number: int) -> str:
    """Return the name of the file of a setup."""
    return f"setup/{number:014x}.json"


def setup_number(data: bytes) -> tuple[int, str]:
    """Return the number of the bytes of a setup, a digest of them, and the name of its file."""
    number = int.from_bytes(hashlib.sha256(data).digest()[:7])
    return number, setup_name(number)


def _described(turret: Turret) -> str | TurretOfUser:
    name = name_of(turret)
    return name or TurretOfUser(turret.number, turret.name, turret.revision, turret.memory_count)


# ---- all that changes ----


@record
class _Head:
    """What stands before the records in the bytes of a saved state."""

    now_ns: Annotated[Whole, Field(ge=0, le=CLOCK_END_NS)]
    tick_count: Count
    robots: Annotated[Whole, Field(ge=0, le=ROBOTS_MAX)]
    bodies: Annotated[Whole, Field(ge=0, le=100_000)]
    lamps: Annotated[Whole, Field(ge=0, le=100_000)]
    body_count: Count
    wires: tuple[_WireFile, ...]


@record
class _WireFile:
    """A `SavedWire` in a file."""

    line: tuple[Baud, Instant, Instant]
    robot_baud: Baud
    selected_baud: Baud
    demo_wakes_ns: Instant | None
    partial: Line
    pending: tuple[tuple[Instant, Line, Switch], ...]
    last_act_ns: Instant
    orphan_count: Count


@dataclass(frozen=True)
class SavedState:
    """All that changes in a simulation, at an instant at which its ticks are done.

    Replies that a program has not read yet are not part of it.

    Attributes:
        now_ns: The time [ns].
        tick_count: Number of ticks done.
        robots: Records of `ROBOT`, shape [1, robot].
        bodies: Records of `BODY`, shape [1, body].
        lamps: float64 [lamp, 4].
        body_count: Number of bodies that there ever were.
        wires: The robots' lines.
    """

    now_ns: int
    tick_count: int
    robots: NDArray[np.void]
    bodies: NDArray[np.void]
    lamps: NDArray[np.float64]
    body_count: int
    wires: tuple[SavedWire, ...]

    @property
    def poses(self) -> NDArray[np.float64]:
        """Where robots are, float64 [robot, 3]."""
        robots: Any = self.robots[0]
        return np.column_stack([robots["x_mm"], robots["y_mm"], robots["heading_rad"]])

    @classmethod
    def from_bytes(cls, data: bytes, setup: Setup, what: str) -> SavedState:
        """Read what `state_bytes` returned.

        Args:
            data: The bytes.
            setup: That of the world.
            what: What messages call them.
        """
        line, _, rest = data.partition(b"\n")
        values = parse_json(line, what)
        if isinstance(values, dict) and isinstance(wires := values.get("wires"), list):
            fields = SavedWire._fields
            values["wires"] = [
                dict(zip(fields, each, strict=False)) if isinstance(each, list) else each for each in wires
            ]
        head = check(_Head, values, what)
        robots_end = head.robots * ROBOT.itemsize
        bodies_end = robots_end + head.bodies * BODY.itemsize
        is_whole = len(rest) == bodies_end + head.lamps * 32
        if not (is_whole and head.robots == len(head.wires) == len(setup.specs)):
            raise ParameterError(
                f"{what} must have the records of {len(setup.specs)} robots, {head.bodies} bodies and {head.lamps} "
                "lamps, but it has others. Is the file damaged?"
            )
        saved = cls(
            head.now_ns,
            head.tick_count,
            np.frombuffer(rest[:robots_end], ROBOT)[None],
            np.frombuffer(rest[robots_end:bodies_end], BODY)[None],
            np.frombuffer(rest[bodies_end:]).reshape(-1, 4),
            head.body_count,
            tuple(SavedWire(**vars(each)) for each in head.wires),
        )
        check_records(saved.robots, saved.bodies, (setup.arena.width_mm, setup.arena.height_mm), what)
        ticks = -(-saved.now_ns // TICK_NS)
        _check_range(np.array(saved.tick_count), ticks, ticks, f"tick_count of {what}")
        _check_range(np.nan_to_num(saved.lamps), -_NUMBER_MAX, _NUMBER_MAX, f"lamps of {what}")
        return saved


def state_bytes(sim: Simulation) -> bytes:
    """Return all that changes in a simulation, as it is now: a line of JSON, then the records."""
    with sim.lock:
        sim.sync()
        world = sim.world
        state, lamps = world.state, world.lamps
        head = {
            "now_ns": world.now_ns,
            "tick_count": state.tick_count,
            "robots": state.robots.shape[1],
            "bodies": state.bodies.shape[1],
            "lamps": len(lamps),
            "body_count": sim.things.body_count,
            "wires": [wire.save() for wire in sim.wires],
        }
        parts = json.dumps(head).encode(), b"\n", state.robots.tobytes(), state.bodies.tobytes(), lamps.tobytes()
        return b"".join(parts)


def restore_state(sim: Simulation, saved: SavedState) -> None:
    """Take a simulation back, or on, to a state of a simulation of the same setup."""
    with sim.lock:
        world = sim.world
        if saved.robots.shape != world.state.robots.shape:
            raise ParameterError(
                f"the state must be of {world.robot_count} robots, but it was of {saved.robots.shape[1]}. Take one of "
                "the same simulation."
            )
        kinds = world.state.robots["kind"].copy()
        world.state.robots[...] = saved.robots
        world.state.robots["kind"] = kinds
        world.state.bodies = saved.bodies.copy()
        world.state.tick_count, world.now_ns = saved.tick_count, saved.now_ns
        # In two steps, for a lamp may be nowhere: its numbers are none.
        world.lamps = np.zeros_like(saved.lamps)
        world.lamps[...] = saved.lamps
        world.rebuild_scene()
        sim.things.body_count = saved.body_count
        for wire, saved_wire in zip(sim.wires, saved.wires, strict=True):
            wire.restore(saved_wire)
        world.note_change()


# ---- records in files ----

LAYOUT = hashlib.sha256(repr([kind.descr for kind in (ROBOT, BODY)]).encode()).hexdigest()[:16]
"""What the fields of the records are, as a text: files with another one are of another version."""

_NUMBER_MAX = 1e12
"""Largest magnitude of a number in a record, far beyond any that a run reaches."""

_LIMITS: dict[str, tuple[float, float] | None] = {
    "camera_period": (0, len(PERIODS_NS) - 1),
    "radio_attempt": (0, ATTEMPTS),
    "radio_to_length": (0, DATA_LIMIT),
    "radio_from_length": (0, DATA_LIMIT),
    "motor_mode": (0, 2),
    "profile_speed": (1, 127),
    "profile_acceleration": (1, 255),
    "motor_speed": (-1e4, 1e4),
    "arm": (-1, ARM_MAX + 1),
    "arm_target": (-1, ARM_MAX + 1),
    "jaws": (-1, JAWS_MAX + 10),
    "brightness": (0, 255),
    "what": (BALL, CYLINDER),
    "radius_mm": (1e-3, 1e4),
    "velocity_x": (-1e6, 1e6),
    "velocity_y": (-1e6, 1e6),
    "friction_mm_s2": (0, 1e6),
    "kick_share": (0, 1),
    "hold_ahead_mm": (-1e4, 1e4),
    "hold_aside_mm": (-1e4, 1e4),
    "turret_memory": None,
}
"""Lowest and highest values of fields that kernels trust; None for those that may hold any number, or none."""

_BEYOND_MM = 1000.0
"""How far beyond the walls a body may be, as a gripper lifts it over a thin one [mm]."""

_TIMES = ("camera_taken_ns", "radio_starts_ns", "radio_ends_ns", "radio_ended_ns", "battle_ns")


def check_records(robots: NDArray[Any], bodies: NDArray[Any], size_mm: tuple[float, float], what: str) -> None:
    """Check what kernels and pictures trust, as a file may hold anything.

    Args:
        robots: Records of robots, or their first fields, shape [instant, robot].
        bodies: Records of bodies, shape [instant, body].
        size_mm: Width and height of the arena [mm], at most.
        what: What messages call them.
    """
    limits: dict[str, tuple[float, float] | None] = {
        **_LIMITS,
        **dict.fromkeys(_TIMES, (-1, CLOCK_END_NS)),
        "held_row": (0, bodies.shape[1]),
        "holder": (0, robots.shape[1]),
    }
    for records, beyond_mm in ((robots, 0.0), (bodies, _BEYOND_MM)):
        for name in records.dtype.names or ():
            limit = limits.get(name, (-_NUMBER_MAX, _NUMBER_MAX))
            if limit is not None:
                _check_range(records[name], *limit, f"{name} of {what}")
        for x, y in ((records["x_mm"], records["y_mm"]), (records["trail"][..., 0], records["trail"][..., 1])):
            _check_range(x, -beyond_mm, size_mm[0] + beyond_mm, f"x_mm of {what}")
            _check_range(y, -beyond_mm, size_mm[1] + beyond_mm, f"y_mm of {what}")


def _check_range(values: NDArray[Any], low: float, high: float, name: str) -> None:
    if not ((values >= low) & (values <= high)).all():
        raise ParameterError(f"{name} must be from {low:g} to {high:g}, but one is not. Is the file damaged?")
