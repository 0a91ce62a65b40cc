"""Free space in a world: what is in the way of a robot or body, and where robots start."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from kiks.engine.physics import contact
from kiks.engine.scalar_math import uniform
from kiks.engine.state import BALL, State
from kiks.errors import ArenaError, ParameterError, counted, shown
from kiks.model.arena import PAD, Arena
from kiks.model.checks import check_heading
from kiks.model.free_disc import OVERLAP_MM
from kiks.model.robot import RobotSpec

STREAM_PLACE = 4
"""Random stream of the places of robots for which the arena gives no start pose."""

ATTEMPTS = 10_000
"""Random places that are tried for a robot."""

PRESSED_MM = 0.5
"""How deep robots and bodies may begin in each other and in walls [mm]: in a world that was saved, some press upon
others, and none is ever deeper than this."""


class FreeSpace:
    """Tells what is in the way of a robot or body in an arena, and where robots may start.

    Attributes:
        ground: What the engine needs to find the distance to the nearest wall.
    """

    def __init__(self, arena: Arena, specs: list[RobotSpec], state: State) -> None:
        self.arena = arena
        self.ground = (arena.clearance, float(arena.mm_per_cell), PAD)
        self._specs = specs
        self._state = state

    @property
    def _robot_count(self) -> int:
        return len(self._specs)

    def start_poses(self, seed: int) -> NDArray[np.float64]:
        """Return where robots start in this arena with a seed, float64 [robot, 3]: x_mm, y_mm, heading_rad."""
        poses = np.zeros((self._robot_count, 3))
        # A robot without a place yet blocks nothing.
        bodies = [(body.x_mm, body.y_mm, body.radius_mm) for body in self.arena.bodies]
        discs = np.array([(0.0, 0.0, -math.inf)] * self._robot_count + bodies).reshape(-1, 3)
        for index, spec in enumerate(self._specs):
            poses[index] = self._start(index, seed, discs)
            discs[index] = *poses[index, :2], spec.body.radius_mm
        return poses

    def check_start_poses(self, poses: NDArray[np.float64], whose: str) -> None:
        """Check that robots could stand at these poses while bodies are where they are.

        Args:
            poses: x_mm, y_mm, heading_rad, float64 [robot, 3], finite; headings are wrapped in place (`check_heading`).
            whose: Whose poses they are, for the message.
        """
        discs = self.discs()
        discs[: self._robot_count, :2] = poses[:, :2]
        for index, (x_mm, y_mm, heading_rad) in enumerate(poses.tolist()):
            poses[index, 2] = check_heading("heading_rad", heading_rad)
            obstacle = self.obstacle(x_mm, y_mm, self._specs[index].body.radius_mm, discs, index, PRESSED_MM)
            if obstacle is not None:
                raise ParameterError(
                    f"the start of robot {index + 1} {whose} must be free, but at ({x_mm:g}, {y_mm:g}) mm "
                    f"{self._is_inside(obstacle)}. Move it."
                )

    def _start(self, index: int, seed: int, others: NDArray[np.float64]) -> tuple[float, float, float]:
        """Return the arena's start pose for a robot, else a free place; for the first the roomiest, if it is free."""
        radius_mm = self._specs[index].body.radius_mm
        # Alone in an arena without starts, a robot begins where it has the most room.
        if index == 0 and not self.arena.starts:
            widest = self.arena.find_start(radius_mm)
            if self.obstacle(widest.x_mm, widest.y_mm, radius_mm, others) is None:
                return widest
        if index < len(self.arena.starts):
            start = self.arena.starts[index]
            # Bodies that overlap it are reported when they are added.
            robots = others[: self._robot_count]
            obstacle = self.obstacle(start.x_mm, start.y_mm, radius_mm, robots, overlap_mm=PRESSED_MM)
            if obstacle is not None:
                raise ArenaError(
                    f"Arena {shown(self.arena.name)}: start {index + 1} at ({start.x_mm:g}, {start.y_mm:g}) mm must be "
                    f"free, but {self._is_inside(obstacle)}. Move it."
                )
            return start
        return self.random_place(index, seed, radius_mm, others, self._robot_count)

    def random_place(
        self, index: int, seed: int, radius_mm: float, others: NDArray[np.float64], count: int
    ) -> tuple[float, float, float]:
        """Return a random free place for one of some robots."""
        for attempt in range(ATTEMPTS):
            x, y, turn = (uniform(seed, 0, index, STREAM_PLACE, attempt, axis) for axis in range(3))
            x, y = x * self.arena.width_mm, y * self.arena.height_mm
            if self.obstacle(x, y, radius_mm, others) is None:
                return x, y, 2 * math.pi * turn
        raise ArenaError(
            f"Arena {shown(self.arena.name)} must have room for {counted(count, 'robot')}, but {ATTEMPTS} random "
            f"places for robot {index + 1} were all taken. Ask for fewer, give start poses, or take a larger arena."
        )

    def discs(self) -> NDArray[np.float64]:
        """Return place and radius [mm] of everything that may be in the way, float64 [disc, 3], robots first."""
        robots, bodies = self._state.robots[0], self._state.bodies[0]
        radii = [spec.body.radius_mm for spec in self._specs]
        # A lifted body blocks nothing.
        body_radii = np.where(bodies["is_lifted"] != 0, -math.inf, bodies["radius_mm"])
        return np.vstack(
            [
                np.column_stack([robots["x_mm"], robots["y_mm"], radii]),
                np.column_stack([bodies["x_mm"], bodies["y_mm"], body_radii]),
            ]
        )

    def wall_gap_mm(self, x_mm: float, y_mm: float, radius_mm: float) -> float:
        """Return the gap between a disc and the nearest wall [mm]; negative where they overlap."""
        return float(contact.clearance_of_disc(*self.ground, float(x_mm), float(y_mm), radius_mm))

    def name_of(self, disc: int) -> str:
        """Return what people call a disc: 'robot 2', 'ball 1' or 'cylinder 3'; a negative number is that of a wall."""
        if disc < 0:
            return "wall"
        if disc < self._robot_count:
            return f"robot {disc + 1}"
        body = self._state.bodies[0, disc - self._robot_count]
        return f"{'ball' if body['what'] == BALL else 'cylinder'} {body['number']}"

    def obstacle(
        self,
        x_mm: float,
        y_mm: float,
        radius_mm: float,
        discs: NDArray[np.float64],
        but: int = -1,
        overlap_mm: float = OVERLAP_MM,
    ) -> tuple[int, float] | None:
        """Return which disc is in the way and how deep it overlaps [mm]; None if the place is free.

        -1 is a wall, -2 what is outside of the arena. The disc `but` is ignored.
        """
        inside = 0 <= x_mm <= self.arena.width_mm and 0 <= y_mm <= self.arena.height_mm
        gap_mm = self.wall_gap_mm(x_mm, y_mm, radius_mm)
        # Outside there is no raster, so the gap to a wall says nothing there.
        if not inside or gap_mm < -overlap_mm:
            return -1 if inside else -2, -gap_mm
        overlaps_mm = radius_mm + discs[:, 2] - np.hypot(discs[:, 0] - x_mm, discs[:, 1] - y_mm)
        # Nothing is in its own way.
        if but >= 0:
            overlaps_mm[but] = -math.inf
        if len(overlaps_mm) and overlaps_mm.max() > overlap_mm:
            return int(overlaps_mm.argmax()), float(overlaps_mm.max())
        return None

    def _is_inside(self, obstacle: tuple[int, float]) -> str:
        """Say in words what is in the way."""
        disc, depth_mm = obstacle
        return (
            "it is outside of the arena"
            if disc == -2
            else f"{'a ' if disc < 0 else ''}{self.name_of(disc)} is {depth_mm:.1f} mm inside it"
        )

    def may_lie(self, disc: int) -> Callable[[float, float], bool]:
        """Return a function that says whether a disc (robots first, from 0) could lie at a place [mm].

        It holds as long as nothing else moves.
        """
        discs = self.discs()
        radius_mm = float(discs[disc, 2])
        return lambda x_mm, y_mm: self.obstacle(x_mm, y_mm, radius_mm, discs, disc) is None

    def check_free(
        self, what: str, x_mm: float, y_mm: float, radius_mm: float, but: int = -1, overlap_mm: float = OVERLAP_MM
    ) -> None:
        """Check that a disc [mm] would overlap neither a wall nor another disc than `but`."""
        obstacle = self.obstacle(x_mm, y_mm, radius_mm, self.discs(), but, overlap_mm)
        if obstacle is not None:
            raise ParameterError(
                f"{what} must be free, but at ({x_mm:g}, {y_mm:g}) mm {self._is_inside(obstacle)}. "
                f"The arena is {self.arena.width_mm:g} x {self.arena.height_mm:g} mm; a radius of "
                f"{radius_mm:g} mm is needed."
            )
