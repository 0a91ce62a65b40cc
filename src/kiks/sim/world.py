"""Robots in an arena: where they are, and the ticks in which they and all else move."""

from __future__ import annotations

import os
import threading
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine import step
from kiks.engine.parameters import PARAMETERS, pack
from kiks.engine.physics import contact
from kiks.engine.scene import enter_everybody, make_scene
from kiks.engine.sensing import proximity
from kiks.engine.sensing.rays import sight_of
from kiks.engine.state import State
from kiks.errors import ParameterError, shown
from kiks.model.arena import PAD, Arena
from kiks.model.checks import check_count, check_heading, check_kind, check_number, wrapped
from kiks.model.free_disc import OVERLAP_MM
from kiks.model.robot import RobotSpec
from kiks.sim.free_space import Floor
from kiks.sim.paths import Paths, Watcher
from kiks.units import TICK_NS, s_from_ns

TICKS_AT_ONCE = 10_000
"""Most ticks that a kernel does before Python may look for Ctrl-C: some milliseconds for a lone robot."""


class World(Floor):
    """Robots in an arena. Time passes in ticks, up to whatever time is asked for.

    Args:
        arena: Where they are.
        specs: What each robot is.
        seed: Seed of all random numbers.

    Attributes:
        lock: Held by whoever looks at the world or changes it.
        now_ns: The simulated time [ns].
        watchers: Who looks on as ticks are done.

    Raises:
        ArenaError: If the arena has no free place for a robot.
    """

    def __init__(self, arena: Arena, specs: Sequence[RobotSpec], seed: int) -> None:
        self._take(arena)
        self.specs = list(specs)
        self.seed = seed
        self.lock = threading.RLock()
        self.now_ns = 0
        self.state = State.empty(world_count=1, robot_count=len(self.specs))
        self._tell_kinds()
        self.watchers: list[Watcher] = []
        self._paths: Paths | None = None
        for index, pose in enumerate(self.start_poses(seed).tolist()):
            self._put(index, *pose)
        self._enter()

    def _tell_kinds(self) -> None:
        """Write down the constants of all kinds of robots, and of which kind each is."""
        kinds = list(dict.fromkeys(self.specs))
        self.state.robots["kind"][0] = [kinds.index(spec) for spec in self.specs]
        # Of that very type, not of an equal one: compiled functions would compare the two field by field at each call.
        self._kinds = np.zeros(len(kinds), PARAMETERS)
        for kind, spec in enumerate(kinds):
            self._kinds[kind : kind + 1] = pack(spec)

    def _take(self, arena: Arena) -> None:
        """Take the walls of an arena for those that there are."""
        self.arena = arena
        self.ground = (arena.clearance, float(arena.mm_per_cell), PAD)
        self.sight = sight_of(arena)

    def set_arena(self, arena: Arena) -> None:
        """Put other walls around everything; time, robots, programs, balls, cylinders and lamps stay as they are.

        Args:
            arena: The walls; what else the arena holds is only kept in `arena`.

        Raises:
            ParameterError: If a robot, ball or cylinder would be deeper in a wall than it is.
        """
        check_arena(arena)
        # What follows from the walls may take a while: it is found before anybody has to wait.
        ground = (arena.clearance, float(arena.mm_per_cell), PAD)
        sight_of(arena)
        with self.lock:
            self.sync()
            for disc, (x_mm, y_mm, radius_mm) in enumerate(self._discs().tolist()):
                if radius_mm < 0:
                    continue
                gap_mm = contact.clearance_of_disc(*ground, x_mm, y_mm, radius_mm)
                before_mm = contact.clearance_of_disc(*self.ground, x_mm, y_mm, radius_mm)
                if gap_mm < min(before_mm, -OVERLAP_MM):
                    raise ParameterError(
                        f"The walls must leave room for all that is there, but one would be {-gap_mm:.1f} mm inside "
                        f"{self._name(disc)} at ({x_mm:.0f}, {y_mm:.0f}) mm. Move that away first."
                    )
            self._take(arena)
            self._enter()

    def _enter(self) -> None:
        """Make the scene anew, as must be when the arrays of the state were replaced."""
        self.scene = make_scene(self.state, self._kinds, self.arena.width_mm, self.arena.height_mm)
        self._look_again()

    def _look_again(self) -> None:
        """Let everybody see that something has come, gone, or been put elsewhere."""
        enter_everybody(self.scene)

    # ---- time ----

    @property
    def time_s(self) -> float:
        """Simulated time since the start [s]."""
        return s_from_ns(self.now_ns)

    def sync(self) -> None:
        """Do the ticks that have begun: the engine is behind the clock until somebody looks."""
        self.tick_to(self.now_ns)

    def tick_to(self, time_ns: int) -> None:
        """Do the ticks that have begun up to a time [ns]."""
        ticks = -(-time_ns // TICK_NS) - self.state.tick_count
        while ticks > 0:
            count = ticks if ticks < TICKS_AT_ONCE else TICKS_AT_ONCE
            for watcher in self.watchers:
                count = min(count, watcher.ticks_left(self.state.tick_count))
            step.advance(self.scene, self.ground, self.seed, self.state.tick_count, count)
            self.state.tick_count += count
            ticks -= count
            for watcher in self.watchers:
                watcher.look(self.state)

    # ---- robots ----

    def index_of(self, robot: int) -> int:
        """Return the index of a robot by its number.

        Raises:
            ParameterError: If there is no such robot.
        """
        if not isinstance(robot, int | np.integer) or not 1 <= robot <= self.robot_count:
            numbers = "robot 1" if self.robot_count == 1 else f"robots 1 to {self.robot_count}"
            raise ParameterError(
                f"robot must be the number of one there is, but it was {shown(robot)}. This simulation has {numbers}."
            )
        return int(robot) - 1

    def pose(self, robot: int) -> tuple[float, float, float]:
        """Return where a robot is at this very instant: x_mm, y_mm, heading_rad (not wrapped).

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self.index_of(robot)
        with self.lock:
            self.sync()
            x_mm, y_mm, heading_rad = proximity.pose_of(self.state.robots, self.state.tick_count, self.now_ns, index)
        return x_mm, y_mm, heading_rad

    def poses(self) -> NDArray[np.float64]:
        """Return where all robots are at this very instant, float64 [robot, 3]: x_mm, y_mm, heading_rad."""
        return np.array([self.pose(robot) for robot in range(1, self.robot_count + 1)])

    def place(self, robot: int, x_mm: float, y_mm: float, heading_rad: float) -> None:
        """Lift a robot and put it down somewhere else; its wheels and counters do not notice.

        Args:
            robot: Number of the robot, from 1.
            x_mm: From the arena's lower left corner to the right.
            y_mm: From the arena's lower left corner upwards.
            heading_rad: Counter-clockwise from the x axis; wrapped to one turn beyond a million.

        Raises:
            ParameterError: If there is no such robot, a number is not finite, or something is in the way.
        """
        index = self.index_of(robot)
        x_mm, y_mm = check_number("x_mm", x_mm), check_number("y_mm", y_mm)
        heading_rad = check_heading("heading_rad", heading_rad)
        with self.lock:
            self.sync()
            radius_mm = self.specs[index].body.radius_mm
            self._check_free(f"the place of robot {robot}", x_mm, y_mm, radius_mm, but=index)
            self._put(index, x_mm, y_mm, heading_rad)
            self._look_again()

    def _add_robot(self, spec: RobotSpec) -> int:
        """Put one more robot where the arena has a start for it, if that is free, else at a random place."""
        index, discs = self.robot_count, self._discs()
        place = None
        if index < len(self.arena.starts):
            start = self.arena.starts[index]
            if self._obstacle(start.x_mm, start.y_mm, spec.body.radius_mm, discs) is None:
                place = tuple(start)
        if place is None:
            place = self._random_place(index, self.seed, spec.body.radius_mm, discs, index + 1)
        self.specs.append(spec)
        robots = np.zeros((1, index + 1), self.state.robots.dtype)
        robots[:, :index] = self.state.robots
        self.state.robots = robots
        self._tell_kinds()
        self._put(index, *place)
        return index

    def _put(self, index: int, x_mm: float, y_mm: float, heading_rad: float) -> None:
        robot: Any = self.state.robots[0, index]
        heading_rad = wrapped(heading_rad)
        robot["x_mm"], robot["y_mm"], robot["heading_rad"] = x_mm, y_mm, heading_rad
        robot["trail"][:] = (x_mm, y_mm, heading_rad)
        robot["start_x_mm"], robot["start_y_mm"] = x_mm, y_mm

    def travelled_mm(self, robot: int) -> float:
        """Return the length of a robot's path so far [mm].

        Raises:
            ParameterError: If there is no such robot.
        """
        forwards_mm, backwards_mm, _ = self.distances_mm()[self.index_of(robot)]
        return float(forwards_mm + backwards_mm)

    def distances_mm(self) -> NDArray[np.float64]:
        """Return how far robots have come, float64 [robot, 3] [mm].

        The columns are the way driven forwards, the way driven backwards, and the straight distance from where the
        robot started or was put last.
        """
        with self.lock:
            self.sync()
            robots: Any = self.state.robots[0]
            straight = np.hypot(robots["x_mm"] - robots["start_x_mm"], robots["y_mm"] - robots["start_y_mm"])
            return np.column_stack([robots["forwards_mm"], robots["backwards_mm"], straight])

    def record_paths(self, every_s: float = 0.1, *, points_max: int | None = None) -> None:
        """Keep where all robots, balls and cylinders are from now on; what was kept before is dropped.

        Args:
            every_s: Time between two points [s]: whole hundredths, at least one.
            points_max: Most points that are kept, from 2. When there are more, every second one is dropped, and from
                then on half as many come; None for all.

        Raises:
            ParameterError: If one is none of these.
        """
        ticks = 100 * check_number("every_s", every_s, 0, 1e7, "Take 0.1.")
        if ticks < 1 - 1e-9 or abs(ticks - round(ticks)) > 1e-6:
            raise ParameterError(f"every_s must be a multiple of 0.01 s, but it was {shown(every_s)}. Take 0.1.")
        if points_max is not None:
            check_count("points_max", points_max, 2, 10**9, "Take 10000.")
        with self.lock:
            self.sync()
            self.watchers = [each for each in self.watchers if each is not self._paths]
            self._paths = Paths(round(ticks), self.state, points_max)
            self.watchers.append(self._paths)

    def paths(self) -> NDArray[np.float64]:
        """Return the paths since `record_paths`, float64 [robot, point, 4]: time_s, x_mm, y_mm, heading_rad.

        Raises:
            ParameterError: If none were recorded.
        """
        with self.lock:
            return self._recorded().array()

    def body_paths(self) -> dict[int, list[tuple[float, float]]]:
        """Return where balls and cylinders were since `record_paths`, by their numbers: x_mm, y_mm.

        Raises:
            ParameterError: If nothing was recorded.
        """
        with self.lock:
            return self._recorded().of_bodies()

    def _recorded(self) -> Paths:
        self.sync()
        if self._paths is None:
            raise ParameterError("paths must be recorded before they are asked for. Call record_paths() first.")
        return self._paths

    def contacts(self, robot: int) -> int:
        """Return how often a robot has met something so far: a wall, a robot, a ball or a cylinder.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self.index_of(robot)
        with self.lock:
            self.sync()
            return int(self.state.robots["contact_count"][0, index])

    def state_hash(self) -> str:
        """Return 16 hexadecimal digits that any two equal runs agree on."""
        with self.lock:
            self.sync()
            return self.state.hash()


def check_kinds(kinds: object, response: object = None) -> None:
    """Raise a ParameterError unless robots may be named so.

    Args:
        kinds: The name of a kind, a robot file or a `RobotSpec`, or a list of such.
        response: The name of a response of their proximity sensors, or None.

    Raises:
        ParameterError: If one is something else.
    """
    for kind in kinds if isinstance(kinds, list | tuple) else (kinds,):
        if not isinstance(kind, str | os.PathLike | RobotSpec):
            raise ParameterError(
                f"robot must be the name of a kind, a robot file or a kiks.RobotSpec, but it was {shown(kind)}. "
                "Take 'khepera'."
            )
    if response is not None and not isinstance(response, str):
        raise ParameterError(f"response must be a name such as 'thesis', but it was {shown(response)}.")


def check_arena(arena: object) -> None:
    """Raise a ParameterError unless this is an arena."""
    check_kind("arena", arena, Arena, "Read a file with kiks.Arena.load(path).")
