"""All that a simulation is at an instant, in a form that can be written, read and gone back to.

Random numbers depend on the seed and the time alone. So a saved state has one future, to the bit.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from threading import RLock
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.clock.program_clock import ProgramClock
from kiks.engine.physics.gripper import ARM_MAX, JAWS_MAX
from kiks.engine.state import BALL, BODY, CYLINDER, ROBOT
from kiks.errors import ParameterError, counted, shown
from kiks.firmware.k213 import PERIODS_NS
from kiks.firmware.radio import ATTEMPTS, DATA_LIMIT
from kiks.firmware.turret import Turret
from kiks.model.arena import Arena
from kiks.model.checks import CLOCK_END_NS, ROBOTS_MAX
from kiks.model.data_file import Number, OneOf, Text, Whole, check, parse_json, parse_toml, record
from kiks.model.project import Project
from kiks.model.radio_link import parse_link
from kiks.model.robot import RobotSpec, robot_toml
from kiks.model.settings import LinkName
from kiks.model.turrets import TURRETS
from kiks.sim.free_space import FreeSpace
from kiks.sim.simulation import SCORE_ENTRIES_MAX, SCORE_MAX, SCORE_TEXT_MAX, Simulation
from kiks.sim.turret_host import TurretOfUser, described, name_of
from kiks.sim.wire import Count, SavedWire
from kiks.sim.world import World
from kiks.units import TICK_NS, s_from_ns

_ScoreText = Annotated[Text, Field(min_length=1, max_length=SCORE_TEXT_MAX)]

ScoreEntry = tuple[
    Annotated[Whole, Field(ge=1, le=ROBOTS_MAX)] | _ScoreText,
    Annotated[Whole | Number, Field(ge=-SCORE_MAX, le=SCORE_MAX)] | _ScoreText,
]
"""What and value of `Simulation.set_score`."""


class AbsentTurret(Turret):
    """Takes the place of a turret of a user's own whose program is not there: it knows no orders."""

    def __init__(self, known: TurretOfUser) -> None:
        self.number, self.name, self.memory_count = known.number, known.name, known.memory_count
        self.revision = (known.revision[0], known.revision[1])


class WorldFiles:
    """The arenas and the kinds of robots that saved states name: each is a file, named by a digest of it.

    Args:
        files: Contents of the files, by name.
        what: What messages call them.
        on_new: Called with name and content of each file that is added.

    Attributes:
        files: As above.
    """

    def __init__(
        self,
        files: Mapping[str, bytes] | None = None,
        what: str = "the files of a world",
        on_new: Callable[[str, bytes], object] = lambda name, data: None,
    ) -> None:
        self.files = dict(files or {})
        self._what, self._on_new = what, on_new
        self._names: list[tuple[Arena | RobotSpec, str]] = []
        self._arenas: dict[str, Arena] = {}
        self._kinds: dict[str, RobotSpec] = {}

    def name_of(self, part: Arena | RobotSpec) -> str:
        """Return the name of the file of an arena, as far as it consists of walls, or of a kind of robot."""
        # Arenas and kinds are compared by identity: they are large, and few.
        name = next((name for known, name in self._names if known is part), None)
        if name is None:
            if isinstance(part, Arena):
                walls = replace(part, starts=(), lamps=(), balls=(), cylinders=())
                data, ending = Project(walls).to_bytes(), "kiks"
            else:
                data, ending = robot_toml(part).encode(), "toml"
            name = f"world/{hashlib.sha256(data).hexdigest()[:16]}.{ending}"
            self._names.append((part, name))
            if name not in self.files:
                self.files[name] = data
                self._on_new(name, data)
        return name

    def arena(self, name: str) -> Arena:
        """Return the arena of a file."""
        if name not in self._arenas:
            data, what = self._data(name)
            self._arenas[name] = Project.from_bytes(data, what=what).arena
        return self._arenas[name]

    def kind(self, name: str) -> RobotSpec:
        """Return the kind of robot of a file."""
        if name not in self._kinds:
            data, what = self._data(name)
            self._kinds[name] = check(RobotSpec, parse_toml(data, what), what)
        return self._kinds[name]

    def _data(self, name: str) -> tuple[bytes, str]:
        if name not in self.files:
            raise ParameterError(f"{self._what} must be whole, but it has no {shown(name)}. Take another copy of it.")
        return self.files[name], f"{self._what}: {name}"


@record
class _RobotFile:
    """A robot in the head of a saved state."""

    kind: Text
    turrets: tuple[Annotated[str, OneOf(tuple(TURRETS))] | TurretOfUser, ...]
    wire: SavedWire


@record
class Head:
    """What stands before the records in the bytes of a saved state.

    Attributes:
        now_ns: The time [ns].
        tick_count: Number of ticks done.
        seed: Seed of all random numbers.
        arena: Name of the file of the walls.
        robots: The robots without their records.
        bodies: Number of bodies.
        lamps: Number of lamps.
        body_count: Bodies created so far, i.e. the last number.
        score: See `Simulation.score`.
        link: See `Simulation`.
    """

    now_ns: Annotated[Whole, Field(ge=0, le=CLOCK_END_NS)]
    tick_count: Count
    seed: Annotated[Whole, Field(ge=0, le=2**63 - 1)]
    arena: Text
    robots: Annotated[tuple[_RobotFile, ...], Field(max_length=ROBOTS_MAX)]
    bodies: Annotated[Whole, Field(ge=0, le=100_000)]
    lamps: Annotated[Whole, Field(ge=0, le=100_000)]
    body_count: Count
    score: Annotated[tuple[ScoreEntry, ...], Field(max_length=SCORE_ENTRIES_MAX)] = ()
    link: LinkName = "cable"


@dataclass(frozen=True)
class SavedState:
    """All that a simulation is, at an instant at which its ticks are done.

    Replies that a program has not read yet are not part of it.

    Attributes:
        head: What is no record.
        arena: The walls alone.
        specs: The kind of each robot.
        robots: Records of `ROBOT`, shape [1, robot].
        bodies: Records of `BODY`, shape [1, body].
        lamps: float64 [lamp, 4].
    """

    head: Head
    arena: Arena
    specs: tuple[RobotSpec, ...]
    robots: NDArray[np.void]
    bodies: NDArray[np.void]
    lamps: NDArray[np.float64]

    def __repr__(self) -> str:
        robots = counted(len(self.specs), "robot")
        return f"<SavedState of {robots} in {self.arena.name!r} at {s_from_ns(self.head.now_ns):.3f} s>"

    @classmethod
    def from_bytes(cls, data: bytes, files: WorldFiles, what: str) -> SavedState:
        """Read what `state_bytes` returned.

        Args:
            data: The bytes.
            files: The files that it names.
            what: What messages call them.
        """
        line, _, rest = data.partition(b"\n")
        head = check(Head, parse_json(line, what), what)
        robots_end = len(head.robots) * ROBOT.itemsize
        bodies_end = robots_end + head.bodies * BODY.itemsize
        if len(rest) != bodies_end + head.lamps * 32:
            raise ParameterError(
                f"{what} must have the records of {len(head.robots)} robots, {head.bodies} bodies and {head.lamps} "
                "lamps, but it has others. Is the file damaged?"
            )
        saved = cls(
            head,
            files.arena(head.arena),
            tuple(files.kind(robot.kind) for robot in head.robots),
            np.frombuffer(rest[:robots_end], ROBOT)[None],
            np.frombuffer(rest[robots_end:bodies_end], BODY)[None],
            np.frombuffer(rest[bodies_end:]).reshape(-1, 4),
        )
        _check_records(saved.robots, saved.bodies, (saved.arena.width_mm, saved.arena.height_mm), what)
        ticks = -(-head.now_ns // TICK_NS)
        _check_range(np.array(head.tick_count), ticks, ticks, f"tick_count of {what}")
        _check_range(np.nan_to_num(saved.lamps), -_NUMBER_MAX, _NUMBER_MAX, f"lamps of {what}")
        return saved

    @property
    def now_ns(self) -> int:
        """The time [ns]."""
        return self.head.now_ns

    @property
    def poses(self) -> NDArray[np.float64]:
        """Where robots are, float64 [robot, 3]."""
        robots: Any = self.robots[0]
        return np.column_stack([robots["x_mm"], robots["y_mm"], robots["heading_rad"]])

    def simulation(
        self, lock: RLock | None = None, thinking: str = "none", program: ProgramClock | None = None
    ) -> Simulation:
        """Return a simulation in this state.

        Args:
            lock: See `World`.
            thinking: See `Simulation`.
            program: The clock of the program on its ports; a new one if left out.
        """
        world = World(self.arena, self.specs, self.head.seed, self.poses, lock)
        sim = Simulation.of_world(world, thinking, program)
        self.restore(sim)
        return sim

    def can_restore(self, sim: Simulation) -> bool:
        """Return whether this state has all robots and turrets of a simulation, which never loses any."""
        counts = [len(wire.firmware.fitted) for wire in sim.wires]
        others = [len(robot.turrets) for robot in self.head.robots]
        return len(counts) <= len(others) and all(a <= b for a, b in zip(counts, others, strict=False))

    def restore(self, sim: Simulation) -> None:
        """Take a simulation of the same run back, or on, to this state."""
        with sim.lock:
            if not self.can_restore(sim):
                raise ParameterError(
                    f"Cannot go back to a state of {counted(len(self.specs), 'robot')}: the simulation has "
                    f"{sim.robot_count}, or other turrets. Make another simulation of the state."
                )
            self._extend(sim)
            world = sim.world
            kinds = world.state.robots["kind"].copy()
            world.state.robots[...] = self.robots
            # Kinds are numbered in the order in which this simulation got its robots.
            world.state.robots["kind"] = kinds
            world.state.bodies = self.bodies.copy()
            world.state.tick_count, world.now_ns = self.head.tick_count, self.now_ns
            # In two steps, for a lamp may be nowhere: its numbers are none.
            world.lamps = np.zeros_like(self.lamps)
            world.lamps[...] = self.lamps
            world.rebuild_scene()
            sim.things.body_count = self.head.body_count
            for wire, robot in zip(sim.wires, self.head.robots, strict=True):
                wire.restore(robot.wire)
            world.score = dict(self.head.score)
            sim.loop.link = parse_link(self.head.link)
            world.note_change()

    def _extend(self, sim: Simulation) -> None:
        """Add missing robots and turrets, and set the walls."""
        poses = self.poses
        # No robot may look from a place that the new walls do not have.
        for index, pose in enumerate(poses[: sim.robot_count].tolist()):
            sim.world.put_robot(index, *pose)
        # Arenas are large, and compared by identity as in `WorldFiles`.
        if sim.arena is not self.arena:
            sim.world.take_walls(FreeSpace(self.arena, sim.specs, sim.world.state))
        for spec, pose in zip(self.specs[sim.robot_count :], poses[sim.robot_count :].tolist(), strict=True):
            sim.add_robot(spec, pose=pose)
        for number, robot in enumerate(self.head.robots, 1):
            for turret in robot.turrets[len(sim.turrets(number)) :]:
                sim.fit(number, turret if isinstance(turret, str) else AbsentTurret(turret))


def state_bytes(sim: Simulation, files: WorldFiles) -> bytes:
    """Return all that a simulation is now: a line of JSON, then the records; `files` gets the files that it names."""
    with sim.lock:
        sim.sync()
        world = sim.world
        state, lamps = world.state, world.lamps
        robots = [
            {
                "kind": files.name_of(wire.firmware.spec),
                "turrets": [name_of(turret) or described(turret) for turret in wire.firmware.fitted],
                "wire": wire.save(),
            }
            for wire in sim.wires
        ]
        head = {
            "now_ns": world.now_ns,
            "tick_count": state.tick_count,
            "seed": world.seed,
            "arena": files.name_of(world.arena),
            "robots": robots,
            "bodies": state.bodies.shape[1],
            "lamps": len(lamps),
            "body_count": sim.things.body_count,
            "score": list(world.score.items()),
            "link": sim.link,
        }
        parts = json.dumps(head).encode(), b"\n", state.robots.tobytes(), state.bodies.tobytes(), lamps.tobytes()
        return b"".join(parts)


# ---- copies ----


class _SharedParts(WorldFiles):
    """Arenas and kinds of robots by names of their own, without files: they never change."""

    def __init__(self, arenas: dict[str, Arena], kinds: dict[str, RobotSpec]) -> None:
        super().__init__(what="a copied simulation")
        self._arenas, self._kinds = arenas, kinds

    def name_of(self, part: Arena | RobotSpec) -> str:
        """Return the name of a part, and keep it."""
        parts: dict[str, Any] = self._arenas if isinstance(part, Arena) else self._kinds
        name = next((name for name, known in parts.items() if known is part), str(len(parts)))
        parts[name] = part
        return name


def reduced(sim: Simulation) -> tuple[Any, ...]:
    """Return how `copy` and `pickle` make a simulation that goes on as this one does."""
    with sim.lock:
        sim.sync()
        for number, wire in enumerate(sim.wires, 1):
            # A saved state has no replies on the line: the copy would wait for them in vain.
            if wire.line.reply_end_ns is not None:
                raise ParameterError(
                    f"a simulation must have no unread replies to be copied, but robot {number} has sent some. "
                    "Read them first."
                )
            for turret in wire.firmware.fitted:
                if name_of(turret) is None:
                    raise ParameterError(
                        f"a simulation must have no turrets of a user's own to be copied, but robot {number} has "
                        f"{turret!r}. Make another with the same seed, or go back with checkpoint()."
                    )
        arenas: dict[str, Arena] = {}
        kinds: dict[str, RobotSpec] = {}
        data = state_bytes(sim, _SharedParts(arenas, kinds))
        return _copied, (data, arenas, kinds, sim.thinking, sim.program)


def _copied(
    data: bytes, arenas: dict[str, Arena], kinds: dict[str, RobotSpec], thinking: str, program: ProgramClock
) -> Simulation:
    shared = _SharedParts(arenas, kinds)
    return SavedState.from_bytes(data, shared, "a copied simulation").simulation(None, thinking, program)


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
    "registers": None,
    "loudness": (0, 1e6),
}
"""Lowest and highest values of fields that kernels trust; None for those that may hold any number, or none."""

_BEYOND_MM = 1000.0
"""How far beyond the walls a body may be, as a gripper lifts it over a thin one [mm]."""

_TIMES = ("camera_taken_ns", "sound_ends_ns", "radio_starts_ns", "radio_ends_ns", "radio_ended_ns", "battle_ns")


def _check_records(robots: NDArray[Any], bodies: NDArray[Any], size_mm: tuple[float, float], what: str) -> None:
    """Check what kernels and pictures trust, as a file may hold anything.

    Args:
        robots: Records of robots, shape [1, robot].
        bodies: Records of bodies, shape [1, body].
        size_mm: Width and height of the arena [mm].
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
