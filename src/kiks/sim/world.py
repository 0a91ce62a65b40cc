"""The world: an arena with all that stands and moves in it, and the ticks in which it moves.

`kiks.sim.simulation.Simulation` holds the lock and brings the world up to date before it calls anything here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from threading import RLock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.clock.own_lock import OwnLock
from kiks.engine import step
from kiks.engine.parameters import PARAMETERS, pack
from kiks.engine.scene import Scene, enter_worlds
from kiks.engine.sensing import observe, proximity
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.engine.state import State
from kiks.errors import ParameterError, shown
from kiks.model.arena import Arena
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_heading, check_number, wrapped
from kiks.model.free_disc import OVERLAP_MM
from kiks.model.robot import RobotSpec
from kiks.sim.free_space import FreeSpace
from kiks.sim.paths import Watcher
from kiks.units import TICK_NS

SLICE_TICKS = (100, 10_000)
"""Least and most ticks of one kernel call."""

SLICE_MOVES = 100_000
"""Ticks of one kernel call times the things that move: some milliseconds, after which Python can react to Ctrl-C."""

ITSELF = np.zeros(1, np.int64)
"""The one world of a scene."""

NEVER_TICK = 2**62
"""A tick that never comes."""


class World:
    """An arena with robots, balls, cylinders and lamps. Time passes in ticks.

    Args:
        arena: The walls, and where robots start.
        specs: What each robot is.
        seed: Seed of all random numbers.
        poses: Where robots are, float64 [robot, 3], whatever is there; where they start in the arena if left out.
        lock: That of a world whose place this one takes; a new one if left out.

    Attributes:
        lock: Held by every thread that reads or changes the world.
        now_ns: The simulated time [ns].
        state: Everything that changes.
        scene: The state, arranged for the engine.
        sight: The arena as rays see it of the walls.
        networks: What the responses of the robots need besides rays.
        free_space: What is in the way of what.
        watchers: Objects that read the state after ticks of their own choice.
        change_count: How often something other than time and the robots' lines has changed the world.
        on_change: Called at each of these changes.
        lamps_exposed: Whether a caller holds the writable array of lamps.
        advance: Lets time pass in the scene: the engine's, or what does something before and after it.
        score: See `Simulation.score`.
    """

    def __init__(
        self,
        arena: Arena,
        specs: Sequence[RobotSpec],
        seed: int,
        poses: NDArray[np.float64] | None = None,
        lock: RLock | None = None,
    ) -> None:
        self.lock = OwnLock() if lock is None else lock
        self.now_ns = 0
        self.seed = seed
        self.specs = list(specs)
        self.state = State.empty(world_count=1, robot_count=len(self.specs))
        self.watchers: tuple[Watcher, ...] = ()
        self._from_tick = self._due_tick = self._switch_tick = NEVER_TICK
        self.change_count = 0
        self.on_change: Callable[[], None] = lambda: None
        self.lamps_exposed = False
        self.advance: Callable[[Any, int, int], object] = step.advance
        self.score: dict[int | str, float | str] = {}
        self._lamps = np.array(arena.lamps, np.float64).reshape(-1, 4)
        self.free_space = FreeSpace(arena, self.specs, self.state)
        self._pack_specs()
        begins = poses is None
        poses = self.free_space.start_poses(seed) if poses is None else poses
        for index, pose in enumerate(poses.tolist()):
            self.put_robot(index, *pose)
        self.rebuild_scene()
        if begins:  # else a saved state follows, with the lamps of its time
            _check_switches(arena, len(self._lamps))
            self._switch_lamps(after_tick=-1)

    @property
    def robot_count(self) -> int:
        """Number of robots."""
        return len(self.specs)

    @property
    def lamps(self) -> NDArray[np.float64]:
        """The lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off: float64 [lamp, 4]."""
        return self._lamps

    @lamps.setter
    def lamps(self, lamps: NDArray[np.float64]) -> None:
        lamps = check_numbers("lamps", lamps, (None, 4))
        _check_switches(self.arena, len(lamps))
        self._lamps = lamps
        self.note_change()
        self._scene.set_lamps(self._lamps[None])

    def expose_lamps(self) -> NDArray[np.float64]:
        """Return the lamps to a caller who may write to them."""
        self.lamps_exposed = True
        self.on_change()
        return self._lamps

    def note_change(self) -> None:
        """Note that something other than time and the robots' lines has changed the world."""
        self.change_count += 1
        self.on_change()

    def _pack_specs(self) -> None:
        """Pack the constants of all kinds of robots for the engine, and note the kind of each robot."""
        kinds = list(dict.fromkeys(self.specs))
        self.state.robots["kind"][0] = [kinds.index(spec) for spec in self.specs]
        # Of that very type, not of an equal one: compiled functions would compare the two field by field at each call.
        self.kinds = np.zeros(len(kinds), PARAMETERS)
        for kind, spec in enumerate(kinds):
            self.kinds[kind : kind + 1] = pack(spec)
        self._networks = networks_for(*(spec.proximity.response for spec in self.specs))

    @property
    def arena(self) -> Arena:
        """The walls, and what stood in them at the beginning."""
        return self.free_space.arena

    def set_arena(self, free_space: FreeSpace) -> None:
        """Replace the walls by those of another arena."""
        for disc, (x_mm, y_mm, radius_mm) in enumerate(free_space.discs().tolist()):
            # A lifted body is above all walls.
            if radius_mm < 0:
                continue
            gap_mm = free_space.wall_gap_mm(x_mm, y_mm, radius_mm)
            before_mm = self.free_space.wall_gap_mm(x_mm, y_mm, radius_mm)
            # What was in a wall before may stay as deep, or a saved world could not be edited.
            if gap_mm < min(before_mm, -OVERLAP_MM):
                raise ParameterError(
                    f"The walls must leave room for all that is there, but one would be {-gap_mm:.1f} mm inside "
                    f"{free_space.name_of(disc)} at ({x_mm:.0f}, {y_mm:.0f}) mm. Move that away first."
                )
        self.take_walls(free_space)

    def take_walls(self, free_space: FreeSpace) -> None:
        """Replace the walls, whatever would be in them."""
        self.free_space = free_space
        self.rebuild_scene()

    def rebuild_scene(self) -> None:
        """Arrange the state for the engine again: needed when its arrays were replaced."""
        lamps, seeds = self._lamps[None], [self.seed]
        things: int = self.state.robots.shape[1] + self.state.bodies.shape[1]
        self._slice_ticks = min(max(SLICE_MOVES // max(things, 1), SLICE_TICKS[0]), SLICE_TICKS[1])
        self._scene = Scene(self.state, self.kinds, [self.arena], self._networks, lamps, seeds)
        self.scene = self._scene.record
        self._switch_lamps(self.state.tick_count)

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """The arrays of the scene by name."""
        return self._scene.arrays

    # ---- time ----

    @property
    def slice_ns(self) -> int:
        """Simulated time that takes some milliseconds of real time [ns]."""
        return self._slice_ticks * TICK_NS

    def tick_to(self, time_ns: int) -> None:
        """Do the ticks that have begun up to a time [ns]."""
        state, end = self.state, -(-time_ns // TICK_NS)
        while state.tick_count < end:
            begin = state.tick_count
            until = min(end, begin + self._slice_ticks, self._due_tick)
            # First: the exception of a signal comes after the kernel, whose ticks have then been done.
            state.tick_count = until
            self.advance(self.scene, begin, until - begin)
            if until >= self._from_tick:
                if until >= self._switch_tick:
                    self._switch_lamps(begin)
                self._look()

    def watch(self, watcher: Watcher) -> None:
        """Let an object read the state after ticks of its own choice."""
        self.watchers = (*self.watchers, watcher)
        self._look()

    def unwatch(self, watcher: Watcher) -> None:
        """Stop that, if it was watching."""
        self.watchers = tuple(each for each in self.watchers if each is not watcher)
        self._look()

    def _switch_lamps(self, after_tick: int) -> None:
        """Switch the lamps whose ticks come after one, up to the present, and find out when the next one does."""
        now_tick, switches = self.state.tick_count, self.arena.lamp_switches
        for switch in switches:
            if after_tick < switch.tick <= now_tick:
                self._lamps[switch.lamp - 1, 3] = switch.is_on
        # Ticks stop at a switch as at a watcher's look: it acts between two ticks, as in a batch.
        self._switch_tick = min((switch.tick for switch in switches if switch.tick > now_tick), default=NEVER_TICK)
        self._from_tick, self._due_tick = (min(each, self._switch_tick) for each in (self._from_tick, self._due_tick))

    def _look(self) -> None:
        """Let watchers look that are due, and find out when the next ones are."""
        state = self.state
        from_tick = due_tick = self._switch_tick
        for watcher in self.watchers:
            if watcher.from_tick <= state.tick_count:
                watcher.look(state)
            if watcher.from_tick < from_tick:
                from_tick = watcher.from_tick
            if watcher.due_tick < due_tick:
                due_tick = watcher.due_tick
        self._from_tick, self._due_tick = from_tick, due_tick

    # ---- robots ----

    def index_of(self, robot: int) -> int:
        """Return the index of a robot by its number."""
        return index_of_robot(robot, self.robot_count)

    def pose(self, index: int) -> tuple[float, float, float]:
        """Return where a robot is at this instant: x_mm, y_mm, heading_rad."""
        x_mm, y_mm, heading_rad = proximity.pose_of(self.state.robots, self.state.tick_count, self.now_ns, index)
        return x_mm, y_mm, heading_rad

    def places(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return where everything is at this instant, which may be in the middle of a tick.

        Returns:
            x_mm, y_mm and heading_rad of robots, float64 [robot, 3]; x_mm and y_mm of bodies, float64 [body, 2].
        """
        poses, places = np.empty((self.robot_count, 3)), np.empty((self.state.bodies.shape[1], 2))
        observe.places_at(self.scene, self.state.tick_count, self.now_ns, poses, places)
        return poses, places

    def bodies(self) -> NDArray[np.void]:
        """Return a copy of the records of balls and cylinders, shape [body], with their places at this instant."""
        bodies: NDArray[np.void] = self.state.bodies[0].copy()
        bodies["x_mm"], bodies["y_mm"] = self.places()[1].T
        return bodies

    def place_robot(self, index: int, x_mm: float, y_mm: float, heading_rad: float) -> None:
        """Put a robot down at a free place."""
        x_mm, y_mm = check_number("x_mm", x_mm), check_number("y_mm", y_mm)
        heading_rad = check_heading("heading_rad", heading_rad)
        radius_mm = self.specs[index].body.radius_mm
        self.free_space.check_free(f"the place of robot {index + 1}", x_mm, y_mm, radius_mm, but=index)
        self.put_robot(index, x_mm, y_mm, heading_rad)
        enter_worlds(self.scene, ITSELF)

    def put_robot(self, index: int, x_mm: float, y_mm: float, heading_rad: float) -> None:
        """Write a robot's pose into the state, whatever is there."""
        robot: Any = self.state.robots[0, index]
        heading_rad = wrapped(heading_rad)
        robot["x_mm"], robot["y_mm"], robot["heading_rad"] = x_mm, y_mm, heading_rad
        # No track leads to the new place: sensors look back by up to 20 ms, and it did not drive there.
        robot["trail"][:] = (x_mm, y_mm, heading_rad)
        robot["start_x_mm"], robot["start_y_mm"] = x_mm, y_mm

    def add_robot(self, spec: RobotSpec, place: Sequence[float] | None = None) -> int:
        """Add a robot; return its index.

        Args:
            spec: Its kind.
            place: Its pose, whatever is there; if left out, the arena's start pose for it, if that is free, else a
                random place.
        """
        index, discs, radius_mm = self.robot_count, self.free_space.discs(), spec.body.radius_mm
        if place is not None:
            x_mm, y_mm, heading_rad = check_numbers("pose", place, (3,)).tolist()
            place = (x_mm, y_mm, check_heading("heading_rad", heading_rad))
        if place is None and index < len(self.arena.starts):
            start = self.arena.starts[index]
            if self.free_space.obstacle(start.x_mm, start.y_mm, radius_mm, discs) is None:
                place = tuple(start)
        if place is None:
            place = self.free_space.random_place(index, self.seed, radius_mm, discs, index + 1)
        self.specs.append(spec)
        # Firmwares hold views of the old array: `Firmware.take` gives them those of the new one.
        robots = np.zeros((1, index + 1), self.state.robots.dtype)
        robots[:, :index] = self.state.robots
        self.state.robots = robots
        self._pack_specs()
        self.put_robot(index, *place)
        self.rebuild_scene()
        return index

    def distances_mm(self) -> NDArray[np.float64]:
        """Return how far robots have come, float64 [robot, 3] [mm]: forwards, backwards, straight from their start."""
        robots: Any = self.state.robots[0]
        distances_mm = np.empty((len(robots), 3))
        distances_mm[:, 0], distances_mm[:, 1] = robots["forwards_mm"], robots["backwards_mm"]
        np.hypot(robots["x_mm"] - robots["start_x_mm"], robots["y_mm"] - robots["start_y_mm"], out=distances_mm[:, 2])
        return distances_mm


def _check_switches(arena: Arena, lamp_count: int) -> None:
    """Check that all lamps are there that an arena switches."""
    if (last := max((switch.lamp for switch in arena.lamp_switches), default=0)) > lamp_count:
        raise ParameterError(
            f"lamp_switches of the arena {shown(arena.name)} must name lamps from 1 to {lamp_count}, but one names "
            f"lamp {last}. Add the lamp, or remove the switch."
        )


def index_of_robot(robot: int, count: int) -> int:
    """Return the index of a robot by its number, among so many."""
    if not isinstance(robot, int | np.integer) or not 1 <= robot <= count:
        numbers = {0: "no robot", 1: "robot 1"}.get(count, f"robots 1 to {count}")
        raise ParameterError(
            f"robot must be the number of an existing robot, but it was {shown(robot)}. This simulation has {numbers}."
        )
    return int(robot) - 1
