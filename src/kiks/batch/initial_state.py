"""The initial state of the worlds of a batch, which is that of simulations with the same seeds."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BeforeValidator, Field, InstanceOf

from kiks.engine.compiling import make_ready
from kiks.engine.parameters import PARAMETERS, pack
from kiks.engine.scene import MEETING
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.engine.state import State
from kiks.errors import ParameterError, shown
from kiks.model.arena import Arena
from kiks.model.array_checks import check_numbers
from kiks.model.checks import ROBOTS_MAX, check_count
from kiks.model.data_file import OneOf
from kiks.model.robot import RobotSpec, specs_of
from kiks.sim.simulation import Simulation
from kiks.sim.world import NEVER_TICK

ARENAS_LIMIT = 10_000
"""Most arenas of a batch."""

ATTEMPTS = 1000
"""How often random places are drawn for a robot."""

WORLDS_LIMIT = 10_000_000
"""Most worlds in a batch: their robots alone would fill the memory of any computer."""


def _listed(arenas: object) -> object:
    return (arenas,) if isinstance(arenas, Arena) else arenas


Arenas = Annotated[
    tuple[InstanceOf[Arena], ...], BeforeValidator(_listed), Field(min_length=1, max_length=ARENAS_LIMIT)
]
"""Arenas that worlds take in turn; a single arena needs no list."""

CAMERA, NO_PICTURE = "k213", -1
"""The camera's name, and the time of the last picture of one that has not taken any yet [ns]."""

Starts = Annotated[str, OneOf(("random", "arena"))]
"""Where robots start: at random places, or where the arena puts them."""


class InitialState:
    """The initial state of the worlds of a batch.

    It holds a simulation for each arena, and for other sizes and resets of the robots; worlds begin as copies of these.

    Args:
        arena: One arena, or several that the worlds take in turn.
        worlds: Number of worlds.
        robot: Kind of the robots; see `kiks.Batch`.
        robots: Number of robots in each world.
        response: Response of the proximity sensors, if not that of the robots' files.

    Attributes:
        arenas: The arenas, each once.
        arena_indices: Index of each world's arena, int64 [world].
        specs: The kinds of robots.
        kinds: Their constants, records of `PARAMETERS`, shape [kind].
        networks: The tables for their responses (`kiks.engine.sensing.thesis_networks`).
        robot_count: Number of robots in each world.
        body_count: Number of balls and cylinders in each world.
        lamps: The lamps of each arena, float64 [arena, lamp, 4]; where there are fewer, the others are off.
        switches: `switch_ticks` and `switch_codes` (`kiks.batch.kernel_args.Worlds`), int64 [2, arena, switch].
    """

    def __init__(
        self,
        arena: Arena | Sequence[Arena],
        worlds: int,
        robot: str | RobotSpec | Sequence[Any],
        robots: int,
        response: str | None,
    ) -> None:
        turns = list(arena) if isinstance(arena, Iterable) else [arena]
        if not turns or not all(isinstance(each, Arena) for each in turns):
            raise ParameterError(f"arena must be a kiks.Arena or several, but it was {shown(arena)}.")
        self.arenas = list(dict.fromkeys(turns))
        worlds, robots = check_count("worlds", worlds, 1, WORLDS_LIMIT), check_count("robots", robots, 1, ROBOTS_MAX)
        named = _kinds_of(robot, worlds, robots, response)
        self.specs = list(dict.fromkeys(spec for row in named for spec in row))
        numbers = {spec: number for number, spec in enumerate(self.specs)}
        lines = [(spec.kind, spec.firmware, spec.quirks.d_reply_trailing_comma) for spec in self.specs]
        if len({(*(kind, of.processing_ms, of.bits_per_character), quirk) for kind, of, quirk in lines}) > 1:
            raise ParameterError(
                "the robots of one batch must have the same kind, firmware.processing_ms, bits_per_character and "
                "quirks, but they differ. Make a batch for each."
            )
        self.kinds = np.zeros(len(self.specs), PARAMETERS)
        for number, spec in enumerate(self.specs):
            self.kinds[number : number + 1] = pack(spec)
        self.networks = networks_for(*dict.fromkeys(spec.proximity.response for spec in self.specs))
        indices = {each: index for index, each in enumerate(self.arenas)}
        self.arena_indices = np.array([indices[each] for each in turns], np.int64)[np.arange(worlds) % len(turns)]
        # How a world begins depends on its arena, and on this of its robots.
        begins = [tuple((spec.reset, spec.body.radius_mm) for spec in row) for row in named]
        alike = dict(zip(begins, named, strict=True))
        self._rows, places = list(alike.values()), {key: place for place, key in enumerate(alike)}
        self._groups = np.array([places[key] for key in begins], np.int64)
        self._models: dict[tuple[int, int], Simulation] = {}
        models = [self._model(index, 0) for index in range(len(self.arenas))]
        body_counts = {model.world.state.bodies.shape[1] for model in models}
        if len(body_counts) > 1:
            raise ParameterError(
                f"the arenas of one batch must hold the same number of balls and cylinders, but they hold "
                f"{sorted(body_counts)}. Make a batch for each number."
            )
        self.robot_count, self.body_count = robots, body_counts.pop()
        self._fields: dict[tuple[Any, ...], dict[str, Any]] = {(): {}}
        self._given = turns, worlds, robot, robots, response
        self._kind_numbers = np.array([[numbers[spec] for spec in row] for row in named], np.int64)
        lamp_count = max(len(model.lamps) for model in models)
        self.lamps = np.zeros((len(self.arenas), lamp_count, 4))
        for lamps, model in zip(self.lamps, models, strict=True):
            lamps[: len(model.lamps)] = model.lamps
        switch_count = max(len(each.lamp_switches) for each in self.arenas)
        self.switches = np.full((2, len(self.arenas), switch_count), NEVER_TICK)
        for number, each in enumerate(self.arenas):
            rows = [(switch.tick, 2 * (switch.lamp - 1) + switch.is_on) for switch in each.lamp_switches]
            self.switches[:, number, : len(rows)] = np.array(rows, np.int64).reshape(-1, 2).T

    def __deepcopy__(self, memo: dict[int, Any]) -> InitialState:
        other = object.__new__(type(self))
        # Worlds may change their arenas; nothing else changes.
        vars(other).update(vars(self), arena_indices=copy.deepcopy(self.arena_indices, memo))
        return other

    def __reduce__(self) -> tuple[Any, ...]:
        return InitialState, self._given, {"arena_indices": self.arena_indices}

    def _model(self, arena: int, group: int) -> Simulation:
        """Return a simulation in an arena with robots of a group, at its start."""
        if (arena, group) not in self._models:
            self._models[arena, group] = Simulation(self.arenas[arena], robot=list(self._rows[group]))
        return self._models[arena, group]

    def _model_of(self, world: int) -> Simulation:
        """Return the one that begins as a world does."""
        return self._model(int(self.arena_indices[world]), int(self._groups[min(world, len(self._groups) - 1)]))

    def check_seeds(self, seeds: ArrayLike, count: int) -> NDArray[np.int64]:
        """Return seeds as int64 [count]."""
        try:
            given = np.asarray(seeds)
        except (TypeError, ValueError, OverflowError):
            given = np.zeros(0)
        if given.dtype.kind not in "iu" or given.shape != (count,) or (given < 0).any() or (given >= 2**63).any():
            raise ParameterError(
                f"seeds must be {count} whole numbers from 0 to 2^63 - 1, one for each world, but they were "
                f"{shown(seeds)}."
            )
        return given.astype(np.int64)

    def seeds_of(self, seed: int | ArrayLike) -> NDArray[np.int64]:
        """Return a seed for each world: the given seeds, or seeds that count up from the given one."""
        world_count = len(self.arena_indices)
        if isinstance(seed, int | np.integer) and 0 <= seed < 2**63 - world_count:
            return seed + np.arange(world_count, dtype=np.int64)
        return self.check_seeds(seed, world_count)

    def starts_of(
        self, seeds: NDArray[np.int64], starts: ArrayLike | None, worlds: NDArray[np.int64] | None = None
    ) -> NDArray[np.float64]:
        """Return start poses, float64 [chosen world, robot, 3].

        Args:
            seeds: Seeds of the worlds.
            starts: Given poses, or anything that broadcasts to them; None for the start poses of simulations.
            worlds: Indices of the worlds; all if left out.
        """
        chosen = np.arange(len(self.arena_indices)) if worlds is None else worlds
        shape = (len(chosen), self.robot_count, 3)
        if starts is None:
            poses = np.zeros(shape)
            for k, world in enumerate(chosen):
                poses[k] = self._model_of(world).world.free_space.start_poses(int(seeds[k]))
            return poses
        given = check_numbers("starts", starts)
        try:
            poses = np.array(np.broadcast_to(given, shape))
        except ValueError:
            raise ParameterError(
                f"starts must be poses x_mm, y_mm, heading_rad [world, robot, 3], here {shape}, but their shape was "
                f"{given.shape}."
            ) from None
        for k, world in enumerate(chosen):
            self._model_of(world).world.free_space.check_start_poses(poses[k], f"of world {world}")
        return poses

    def reset(self, state: State, worlds: NDArray[np.int64], starts: NDArray[np.float64]) -> None:
        """Reset worlds of a state to their initial state.

        Args:
            state: The state; changed in place.
            worlds: Indices of the worlds.
            starts: Start poses of their robots, float64 [chosen world, robot, 3].
        """
        kinds = self._groups[np.minimum(worlds, len(self._groups) - 1)]
        codes = self.arena_indices[worlds] * len(self._rows) + kinds
        for code in dict.fromkeys(codes.tolist()):
            here, model = worlds[codes == code], self._model(*divmod(code, len(self._rows)))
            state.robots[here] = model.world.state.robots[0]
            state.bodies[here] = model.world.state.bodies[0]
        robots: Any = state.robots[worlds]
        robots["kind"] = self._kind_numbers[np.minimum(worlds, len(self._kind_numbers) - 1)]
        for axis, name in enumerate(("x_mm", "y_mm", "heading_rad")):
            robots[name] = starts[:, :, axis]
        robots["start_x_mm"], robots["start_y_mm"] = starts[:, :, 0], starts[:, :, 1]
        robots["trail"] = starts[:, :, None, :]
        state.robots[worlds] = robots

    def fit(self, state: State, worlds: NDArray[np.int64], turrets: Sequence[tuple[Any, ...]]) -> None:
        """Put turrets on the robots of worlds that have been reset: of each robot, names and classes."""
        for its in dict.fromkeys(turrets):
            carriers = np.flatnonzero([carried == its for carried in turrets])
            for name, value in self._fitted(its).items():
                state.robots[name][np.ix_(worlds, carriers)] = value

    def _fitted(self, turrets: tuple[Any, ...]) -> dict[str, Any]:
        """Return what some turrets write into the record of a robot, by field, when they are fitted."""
        if turrets not in self._fields:
            model = Simulation(self.arenas[0], robot=self.specs[0])
            before = model.world.state.robots.copy()
            for each in turrets:
                if each != CAMERA:  # which would take a picture at once
                    model.fit(1, each if isinstance(each, str) else each())
            after = model.world.state.robots
            changed = [name for name in before.dtype.names or () if (before[name] != after[name]).any()]
            self._fields[turrets] = {name: after[name][0, 0].copy() for name in changed}
            if CAMERA in turrets:
                self._fields[turrets]["camera_taken_ns"] = NO_PICTURE
            if after["has_gripper"].any():
                make_ready(MEETING)
        return self._fields[turrets]


def _kinds_of(
    robot: str | RobotSpec | Sequence[Any], worlds: int, robots: int, response: str | None
) -> list[tuple[RobotSpec, ...]]:
    """Return the kinds of the robots, one row for each world, or one row for all worlds."""

    def row_of(row: Any) -> tuple[RobotSpec, ...]:
        return tuple(specs_of(row, robots, response))

    if isinstance(robot, str | RobotSpec):
        return [row_of(robot)]
    if not isinstance(robot, Sequence) or len(robot) != worlds:
        raise ParameterError(
            f"robot must name one kind for all, or one for each of {worlds} worlds, but it was {shown(robot)}."
        )
    return [row_of(row) for row in robot]


def random_starts(
    arena: Arena,
    count: int,
    *,
    seed: int,
    robots: int | None = None,
    radius_mm: float = 27.5,
    clear_mm: float = 5.0,
    apart_mm: float = 0.0,
) -> NDArray[np.float64]:
    """Return random free poses, uniformly distributed over an arena: x_mm, y_mm, heading_rad.

    Args:
        arena: The arena.
        count: Number of poses, or of worlds if `robots` is given.
        seed: Seed of the random generator.
        robots: Number of robots in each world, which are clear of each other, too.
        radius_mm: Radius of a robot [mm].
        clear_mm: Least distance of its edge from walls, balls, cylinders and the other robots of its world [mm].
        apart_mm: Least distance of its edge from the other robots of its world [mm], if that is more than `clear_mm`.

    Returns:
        float64 [count, 3], or [count, robot, 3] if `robots` is given.
    """
    rng = np.random.default_rng(seed)
    if robots is None:
        return _free_poses(rng, arena, count, radius_mm, clear_mm)
    poses = np.zeros((count, robots, 3))
    for robot in range(robots):
        todo = np.arange(count)
        for _ in range(ATTEMPTS):
            tried = _free_poses(rng, arena, len(todo), radius_mm, clear_mm)
            across, up = (poses[todo, :robot, axis] - tried[:, None, axis] for axis in range(2))
            is_free = (np.hypot(across, up) > 2 * radius_mm + max(clear_mm, apart_mm)).all(axis=1)
            poses[todo[is_free], robot] = tried[is_free]
            todo = todo[~is_free]
            if not len(todo):
                break
        else:
            raise ParameterError(
                f"the arena {shown(arena.name)} must have room for {robots} robots of {radius_mm:g} mm, but {ATTEMPTS} "
                f"random places for robot {robot + 1} were all taken. Take a larger one, or fewer robots."
            )
    return poses


def _free_poses(
    rng: np.random.Generator, arena: Arena, count: int, radius_mm: float, clear_mm: float
) -> NDArray[np.float64]:
    """Return random free poses of lone robots, float64 [count, 3]."""
    poses = np.zeros((0, 3))
    for _ in range(ATTEMPTS):
        if len(poses) >= count:
            break
        tried = rng.uniform((0, 0, -math.pi), (arena.width_mm, arena.height_mm, math.pi), (2 * count + 100, 3))
        free = np.array([arena.free_for(x_mm, y_mm, radius_mm + clear_mm) for x_mm, y_mm, _ in tried.tolist()])
        for body in arena.bodies:
            free &= np.hypot(tried[:, 0] - body.x_mm, tried[:, 1] - body.y_mm) > radius_mm + clear_mm + body.radius_mm
        poses = np.concatenate([poses, tried[free]])
    if len(poses) < count:
        raise ParameterError(
            f"the arena {shown(arena.name)} must have free places for a robot of {radius_mm:g} mm, but only "
            f"{len(poses)} of {count} were found. Take a larger one, or a smaller clear_mm."
        )
    return poses[:count]
