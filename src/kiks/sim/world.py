"""Robots in an arena: where they are, and the ticks in which they and all else move."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine import contact, proximity, step
from kiks.engine.numbers import uniform
from kiks.engine.parameters import PARAMETERS, pack
from kiks.engine.rays import sight_of
from kiks.engine.scene import enter_everybody, make_scene
from kiks.engine.state import BALL, State
from kiks.errors import ArenaError, ParameterError
from kiks.model.arena import PAD, Arena
from kiks.model.robot import RobotSpec
from kiks.model.room import OVERLAP_MM
from kiks.sim.paths import Paths
from kiks.units import TICK_NS, s_from_ns

STREAM_PLACE = 4
"""Random stream of the places of robots for which the arena gives no start pose."""

ATTEMPTS = 10_000
"""Random places that are tried for a robot."""

PRESSED_MM = 0.5
"""How deep robots and bodies may begin in each other and in walls [mm]: in a world that was saved, some press upon
others, and none is ever deeper than this."""


class World:
    """Robots in an arena. Time passes in ticks, up to whatever time is asked for.

    Args:
        arena: Where they are.
        specs: What each robot is.
        seed: Seed of all random numbers.

    Attributes:
        lock: Held by whoever looks at the world or changes it.
        now_ns: The simulated time [ns].

    Raises:
        ArenaError: If the arena has no free place for a robot.
    """

    def __init__(self, arena: Arena, specs: Sequence[RobotSpec], seed: int) -> None:
        self._take(arena)
        self.specs = list(specs)
        self.seed = seed
        self.robot_count = len(self.specs)
        self.lock = threading.RLock()
        self.now_ns = 0
        self.state = State.empty(world_count=1, robot_count=self.robot_count)
        kinds = list(dict.fromkeys(self.specs))
        self.state.robots["kind"][0] = [kinds.index(spec) for spec in self.specs]
        # Of that very type, not of an equal one: compiled functions would compare the two field by field at each call.
        self._kinds = np.zeros(len(kinds), PARAMETERS)
        for kind, spec in enumerate(kinds):
            self._kinds[kind : kind + 1] = pack(spec)
        self._paths: Paths | None = None
        for index, pose in enumerate(self.start_poses(seed).tolist()):
            self._put(index, *pose)
        self._enter()

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
            count = ticks if self._paths is None else min(ticks, self._paths.ticks_left(self.state.tick_count))
            step.advance(self.scene, self.ground, self.seed, self.state.tick_count, count)
            self.state.tick_count += count
            ticks -= count
            if self._paths is not None:
                self._paths.look(self.state)

    # ---- robots ----

    def index_of(self, robot: int) -> int:
        """Return the index of a robot by its number.

        Raises:
            ParameterError: If there is no such robot.
        """
        if not isinstance(robot, int) or not 1 <= robot <= self.robot_count:
            numbers = "robot 1" if self.robot_count == 1 else f"robots 1 to {self.robot_count}"
            raise ParameterError(
                f"robot must be the number of one there is, but it was {robot!r}. This simulation has {numbers}."
            )
        return robot - 1

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
            heading_rad: Counter-clockwise from the x axis.

        Raises:
            ParameterError: If there is no such robot, a number is not finite, or something is in the way.
        """
        index = self.index_of(robot)
        check_finite(x_mm=x_mm, y_mm=y_mm, heading_rad=heading_rad)
        with self.lock:
            self.sync()
            radius_mm = self.specs[index].body.radius_mm
            self._check_free(f"the place of robot {robot}", x_mm, y_mm, radius_mm, but=index)
            self._put(index, float(x_mm), float(y_mm), float(heading_rad))
            self._look_again()

    def _put(self, index: int, x_mm: float, y_mm: float, heading_rad: float) -> None:
        robot: Any = self.state.robots[0, index]
        robot["x_mm"], robot["y_mm"], robot["heading_rad"] = x_mm, y_mm, heading_rad
        robot["trail"][:] = (x_mm, y_mm, heading_rad)
        robot["start_x_mm"], robot["start_y_mm"] = x_mm, y_mm

    def start_poses(self, seed: int) -> NDArray[np.float64]:
        """Return where robots start in this arena with a seed, float64 [robot, 3]: x_mm, y_mm, heading_rad.

        Raises:
            ArenaError: If there is no free place for one.
        """
        poses = np.zeros((self.robot_count, 3))
        # Robots that have no place yet are nowhere.
        bodies = [(body.x_mm, body.y_mm, body.radius_mm) for body in self.arena.bodies]
        discs = np.array([(0.0, 0.0, -math.inf)] * self.robot_count + bodies).reshape(-1, 3)
        for index, spec in enumerate(self.specs):
            poses[index] = self._start(index, seed, discs)
            discs[index] = *poses[index, :2], spec.body.radius_mm
        return poses

    def check_start_poses(self, poses: NDArray[np.float64], whose: str) -> None:
        """Raise a ParameterError unless robots could stand at poses, float64 [robot, 3], bodies being where they are.

        Args:
            poses: The poses.
            whose: Whose they are, for the message.

        Raises:
            ParameterError: If a number is not finite, or something is in the way.
        """
        discs = self._discs()
        discs[: self.robot_count, :2] = poses[:, :2]
        for index, (x_mm, y_mm, heading_rad) in enumerate(poses.tolist()):
            check_finite(x_mm=x_mm, y_mm=y_mm, heading_rad=heading_rad)
            obstacle = self._obstacle(x_mm, y_mm, self.specs[index].body.radius_mm, discs, index, PRESSED_MM)
            if obstacle is not None:
                raise ParameterError(
                    f"the start of robot {index + 1} {whose} must be free, but at ({x_mm:g}, {y_mm:g}) mm "
                    f"{self._is_inside(obstacle)}. Move it."
                )

    def _start(self, index: int, seed: int, others: NDArray[np.float64]) -> tuple[float, float, float]:
        """Return the arena's start pose for a robot, else a free place; for the first the roomiest, if it is free.

        Raises:
            ArenaError: If there is no free place for it.
        """
        radius_mm = self.specs[index].body.radius_mm
        if index == 0 and not self.arena.starts:
            widest = self.arena.find_start(radius_mm)
            if self._obstacle(widest.x_mm, widest.y_mm, radius_mm, others) is None:
                return widest
        if index < len(self.arena.starts):
            start = self.arena.starts[index]
            # Whatever else the arena puts there says so itself.
            robots = others[: self.robot_count]
            obstacle = self._obstacle(start.x_mm, start.y_mm, radius_mm, robots, overlap_mm=PRESSED_MM)
            if obstacle is not None:
                raise ArenaError(
                    f"Arena {self.arena.name!r}: start {index + 1} at ({start.x_mm:g}, {start.y_mm:g}) mm must be "
                    f"free, but {self._is_inside(obstacle)}. Move it."
                )
            return start
        for attempt in range(ATTEMPTS):
            x, y, turn = (uniform(seed, 0, index, STREAM_PLACE, attempt, axis) for axis in range(3))
            x, y = x * self.arena.width_mm, y * self.arena.height_mm
            if self._obstacle(x, y, radius_mm, others) is None:
                return x, y, 2 * math.pi * turn
        raise ArenaError(
            f"Arena {self.arena.name!r} must have room for {self.robot_count} robots, but {ATTEMPTS} random places for "
            f"robot {index + 1} were all taken. Ask for fewer, give start poses, or take a larger arena."
        )

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

    def record_paths(self, every_s: float = 0.1) -> None:
        """Keep the poses of all robots from now on, for `paths`; what was kept before is dropped.

        Args:
            every_s: Time between two points [s]: whole hundredths, at least one.

        Raises:
            ParameterError: If it is none of these.
        """
        ticks = every_s * 100 if isinstance(every_s, int | float) else math.nan
        if not 1 - 1e-9 <= ticks <= 1e9 or abs(ticks - round(ticks)) > 1e-6:
            raise ParameterError(f"every_s must be a multiple of 0.01 s, but it was {every_s!r}. Take 0.1.")
        with self.lock:
            self.sync()
            self._paths = Paths(round(ticks), self.state)

    def paths(self) -> NDArray[np.float64]:
        """Return the paths since `record_paths`, float64 [robot, point, 4]: time_s, x_mm, y_mm, heading_rad.

        Raises:
            ParameterError: If none were recorded.
        """
        with self.lock:
            self.sync()
            if self._paths is None:
                raise ParameterError("paths must be recorded before they are asked for. Call record_paths() first.")
            return self._paths.array()

    def contacts(self, robot: int) -> int:
        """Return how often a robot has met something so far: a wall, a robot, a ball or a cylinder.

        Raises:
            ParameterError: If there is no such robot.
        """
        index = self.index_of(robot)
        with self.lock:
            self.sync()
            return int(self.state.robots["contact_count"][0, index])

    # ---- places ----

    def _discs(self) -> NDArray[np.float64]:
        """Return place and radius [mm] of everything that may be in the way, float64 [disc, 3], robots first."""
        robots, bodies = self.state.robots[0], self.state.bodies[0]
        radii = [spec.body.radius_mm for spec in self.specs]
        # What a gripper has lifted is in nobody's way.
        body_radii = np.where(bodies["is_lifted"] != 0, -math.inf, bodies["radius_mm"])
        return np.vstack(
            [
                np.column_stack([robots["x_mm"], robots["y_mm"], radii]),
                np.column_stack([bodies["x_mm"], bodies["y_mm"], body_radii]),
            ]
        )

    def _name(self, disc: int) -> str:
        if disc < self.robot_count:
            return f"robot {disc + 1}"
        body = self.state.bodies[0, disc - self.robot_count]
        return f"{'ball' if body['what'] == BALL else 'cylinder'} {body['number']}"

    def _obstacle(
        self,
        x_mm: float,
        y_mm: float,
        radius_mm: float,
        discs: NDArray[np.float64],
        but: int = -1,
        overlap_mm: float = OVERLAP_MM,
    ) -> tuple[int, float] | None:
        """Return which disc but one is in the way of a disc, -1 for a wall, and how deep [mm]; None if it is free."""
        inside = 0 <= x_mm <= self.arena.width_mm and 0 <= y_mm <= self.arena.height_mm
        gap_mm = contact.clearance_of_disc(*self.ground, float(x_mm), float(y_mm), radius_mm)
        if not inside or gap_mm < -overlap_mm:
            return -1, -float(gap_mm)
        overlaps_mm = radius_mm + discs[:, 2] - np.hypot(discs[:, 0] - x_mm, discs[:, 1] - y_mm)
        if but >= 0:
            overlaps_mm[but] = -math.inf
        if len(overlaps_mm) and overlaps_mm.max() > overlap_mm:
            return int(overlaps_mm.argmax()), float(overlaps_mm.max())
        return None

    def _is_inside(self, obstacle: tuple[int, float]) -> str:
        """Say in words what is in the way."""
        disc, depth_mm = obstacle
        return f"{'a wall' if disc < 0 else self._name(disc)} is {depth_mm:.1f} mm inside it"

    def freedom(self, disc: int) -> Callable[[float, float], bool]:
        """Return a function that says whether a disc, robots counted first, from 0, could lie at a place [mm].

        It holds as long as nothing else moves.
        """
        discs = self._discs()
        radius_mm = float(discs[disc, 2])
        return lambda x_mm, y_mm: self._obstacle(x_mm, y_mm, radius_mm, discs, disc) is None

    def _check_free(
        self,
        what: str,
        x_mm: float,
        y_mm: float,
        radius_mm: float,
        but: int = -1,
        overlap_mm: float = OVERLAP_MM,
    ) -> None:
        """Raise a ParameterError if a disc [mm] would be in a wall or, but for one disc, in something else."""
        obstacle = self._obstacle(x_mm, y_mm, radius_mm, self._discs(), but, overlap_mm)
        if obstacle is not None:
            raise ParameterError(
                f"{what} must be free, but at ({x_mm:g}, {y_mm:g}) mm {self._is_inside(obstacle)}. "
                f"The arena is {self.arena.width_mm:g} x {self.arena.height_mm:g} mm; a radius of "
                f"{radius_mm:g} mm is needed."
            )

    def state_hash(self) -> str:
        """Return 16 hexadecimal digits that any two equal runs agree on."""
        with self.lock:
            self.sync()
            return self.state.hash()


def check_finite(**numbers: float) -> None:
    """Raise a ParameterError if one of the numbers, named, is none or not finite."""
    for name, value in numbers.items():
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise ParameterError(f"{name} must be a finite number, but it was {value!r}.")
