"""Things in an arena besides robots: balls, cylinders and lamps, put there, moved and taken away from outside."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.numbers import sin_cos
from kiks.engine.state import BALL, BODY, CYLINDER
from kiks.errors import ArenaError, KiksError, ParameterError, counted, shown
from kiks.model.arena import Arena, Ball, Cylinder, Lamp
from kiks.model.checks import check_heading, check_number, check_numbers
from kiks.model.free_disc import OVERLAP_MM
from kiks.model.robot import RobotSpec
from kiks.sim.free_space import PRESSED_MM
from kiks.sim.world import World


@dataclass(frozen=True)
class Checkpoint:
    """Where everything stood: what `Things.reset` takes back.

    Attributes:
        poses: float64 [robot, 3].
        bodies: Records of `BODY`, shape [1, body].
        lamps: float64 [lamp, 4].
    """

    poses: NDArray[np.float64]
    bodies: NDArray[np.void]
    lamps: NDArray[np.float64]


class Things(World):
    """A world with balls, cylinders and lamps, those of the arena to begin with.

    Args:
        arena: Where they are.
        specs: What each robot is.
        seed: Seed of all random numbers.

    Raises:
        ArenaError: If something has no free place where the arena puts it.
    """

    def __init__(self, arena: Arena, specs: Sequence[RobotSpec], seed: int) -> None:
        super().__init__(arena, specs, seed)
        self.lamps = np.array(arena.lamps, np.float64).reshape(-1, 4)
        self._body_count = 0
        for body in arena.bodies:
            try:
                self._add(body, PRESSED_MM)
            except ParameterError as error:
                raise ArenaError(f"Arena {shown(arena.name)}: {error}") from None

    def __repr__(self) -> str:
        robots = counted(self.robot_count, "robot")
        return f"<{type(self).__name__}: {robots} in {shown(self.arena.name)} at {self.time_s:.3f} s, seed {self.seed}>"

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Return a picture of it as it stands, which notebooks show."""
        from kiks.drawing import draw_world, png_for_notebook

        radii_mm = [spec.body.radius_mm for spec in self.specs]
        with self.lock:
            image = draw_world(self.arena, self.lamps, self.bodies(), self.poses(), radii_mm)
        return png_for_notebook(image)

    @property
    def lamps(self) -> NDArray[np.float64]:
        """The lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off: float64 [lamp, 4].

        Write to it to move or switch them; a lamp at a place that is no number is nowhere.

        Raises:
            ParameterError: If it is set to anything but finite numbers of that shape.
        """
        return self._lamps

    @lamps.setter
    def lamps(self, lamps: NDArray[np.float64]) -> None:
        self._lamps = check_numbers("lamps", lamps, (None, 4))

    def add_ball(self, x_mm: float, y_mm: float, **changes: Any) -> int:
        """Put a ball into the arena, at rest; return its number.

        Args:
            x_mm: Its centre [mm].
            y_mm: Its centre [mm].
            **changes: `radius_mm`, `friction_mm_s2` or `brightness` (1..255 or a material), where not the usual ones.

        Raises:
            ParameterError: If a value is out of range, or something is in the way.

        Example:
            >>> from kiks import Arena, Simulation
            >>> sim = Simulation(Arena.box(500, 500))
            >>> ball = sim.add_ball(100, 100)
            >>> sim.move_body(ball, 100, 100, speed_mm_s=200.0)
            >>> sim.run(0.5)
            >>> round(float(sim.bodies()["x_mm"][0]), 1)
            197.5
        """
        return self._add_checked(Ball, x_mm, y_mm, changes)

    def add_cylinder(self, x_mm: float, y_mm: float, **changes: Any) -> int:
        """Put a cylinder into the arena; return its number.

        Args:
            x_mm: Its centre [mm].
            y_mm: Its centre [mm].
            **changes: `radius_mm`, `friction_mm_s2` or `brightness` (1..255 or a material), where not the usual ones.

        Raises:
            ParameterError: If a value is out of range, or something is in the way.
        """
        return self._add_checked(Cylinder, x_mm, y_mm, changes)

    def _add_checked(
        self, kind: Callable[..., Ball | Cylinder], x_mm: float, y_mm: float, changes: dict[str, Any]
    ) -> int:
        try:
            body = kind(x_mm, y_mm, **changes)
        except TypeError:
            raise ParameterError(
                f"changes of a body must be radius_mm, friction_mm_s2 or brightness, but they were {list(changes)}."
            ) from None
        balls, cylinders = ((body,), ()) if isinstance(body, Ball) else ((), (body,))
        try:
            # In an arena of its own, so that the rules are those of arena files.
            alone = replace(self.arena, starts=(), lamps=(), balls=balls, cylinders=cylinders)
        except KiksError as error:
            raise ParameterError(str(error)) from None
        with self.lock:
            self.sync()
            return self._add(alone.bodies[0])

    def _add(self, body: Ball | Cylinder, overlap_mm: float = OVERLAP_MM) -> int:
        what, name = (BALL, "ball") if isinstance(body, Ball) else (CYLINDER, "cylinder")
        self._check_free(f"the place of a {name}", body.x_mm, body.y_mm, body.radius_mm, overlap_mm=overlap_mm)
        self._body_count += 1
        record = np.zeros(1, BODY)
        record["number"], record["what"] = self._body_count, what
        record["x_mm"], record["y_mm"], record["trail"][:] = body.x_mm, body.y_mm, (body.x_mm, body.y_mm)
        record["radius_mm"], record["brightness"] = body.radius_mm, body.brightness
        record["friction_mm_s2"], record["kick_share"] = body.friction_mm_s2, 1.0 if what == BALL else 0.0
        bodies = np.zeros((1, self.state.bodies.shape[1] + 1), BODY)
        bodies[:, :-1], bodies[:, -1] = self.state.bodies, record
        self.state.bodies = bodies
        self._enter()
        return self._body_count

    def add_lamp(self, x_mm: float, y_mm: float, power_w: float = 1.0, *, is_on: bool = True) -> int:
        """Hang a lamp into the arena; return its row in `lamps`, counted from 1.

        Raises:
            ParameterError: If it would hang outside the arena, or a value is out of range.
        """
        hung: tuple[Lamp, ...] = (Lamp(x_mm, y_mm, power_w, is_on),)
        try:
            hung = replace(self.arena, starts=(), balls=(), cylinders=(), lamps=hung).lamps
        except KiksError as error:
            raise ParameterError(str(error)) from None
        with self.lock:
            self.sync()
            self.lamps = np.vstack([self.lamps, hung])
            return len(self.lamps)

    def remove_lamp(self, lamp: int) -> None:
        """Take a lamp away; those behind it move up a row.

        Raises:
            ParameterError: If there is no such lamp.
        """
        with self.lock:
            if not isinstance(lamp, int) or not 1 <= lamp <= len(self.lamps):
                raise ParameterError(
                    f"lamp must be a row of lamps from 1 to {len(self.lamps)}, but it was {shown(lamp)}."
                )
            self.sync()
            self.lamps = np.delete(self.lamps, lamp - 1, axis=0)

    def bodies(self) -> NDArray[np.void]:
        """Return a copy of what there is of balls and cylinders: records of `kiks.engine.state.BODY`, shape [body].

        Of their fields `number`, `what` (3 a ball, 4 a cylinder), `x_mm`, `y_mm`, `velocity_x` and `velocity_y` [mm/s],
        `radius_mm` and `brightness` are of use.
        """
        with self.lock:
            self.sync()
            copied: NDArray[np.void] = self.state.bodies[0].copy()
        return copied

    def move_body(
        self, body: int, x_mm: float, y_mm: float, *, speed_mm_s: float = 0.0, heading_rad: float = 0.0
    ) -> None:
        """Lift a ball or cylinder and put it down somewhere else, or set it rolling.

        Args:
            body: Its number.
            x_mm: Where its centre goes [mm].
            y_mm: Where its centre goes [mm].
            speed_mm_s: How fast it rolls from there [mm/s].
            heading_rad: Where to.

        Raises:
            ParameterError: If there is no such body, a number is out of range, or something is in the way.
        """
        x_mm, y_mm = check_number("x_mm", x_mm), check_number("y_mm", y_mm)
        speed_mm_s = check_number("speed_mm_s", speed_mm_s, 0, 1000)
        sine, cosine = sin_cos(check_heading("heading_rad", heading_rad))
        with self.lock:
            self.sync()
            index = self._body_index(body)
            record: Any = self.state.bodies[0, index]
            radius_mm = float(record["radius_mm"])
            self._check_free(f"the place of body {body}", x_mm, y_mm, radius_mm, but=self.robot_count + index)
            self._release(index)
            record["x_mm"], record["y_mm"], record["trail"][:] = x_mm, y_mm, (x_mm, y_mm)
            record["velocity_x"], record["velocity_y"] = speed_mm_s * cosine, speed_mm_s * sine
            self._look_again()

    def remove_body(self, body: int) -> None:
        """Take a ball or cylinder away.

        Raises:
            ParameterError: If there is no such body.
        """
        with self.lock:
            self.sync()
            index = self._body_index(body)
            self.state.bodies = np.delete(self.state.bodies, index, axis=1)
            self._enter()

    def _body_index(self, body: int) -> int:
        numbers = self.state.bodies["number"][0].tolist()
        if not isinstance(body, int) or body not in numbers:
            raise ParameterError(
                f"body must be the number of one there is, but it was {shown(body)}. There are {shown(numbers)}."
            )
        return int(numbers.index(body))

    def _release(self, index: int) -> None:
        """Take a body out of whatever gripper holds it."""
        self.state.bodies["holder"][0, index] = self.state.bodies["is_lifted"][0, index] = 0

    def checkpoint(self) -> Checkpoint:
        """Return where everything stands, for `reset`."""
        with self.lock:
            self.sync()
            saved = Checkpoint(self.poses(), self.state.bodies.copy(), self.lamps.copy())
        for array in (saved.poses, saved.bodies, saved.lamps):
            array.setflags(write=False)
        return saved

    def reset(self, checkpoint: Checkpoint) -> None:
        """Put everything back where it stood at a checkpoint; what was added since goes, what was removed comes back.

        Time goes on, and so do programs, wheels and counters: it is as if a hand had tidied up.

        Raises:
            ParameterError: If it is no checkpoint, or one of a simulation with another number of robots.
        """
        if not isinstance(checkpoint, Checkpoint):
            raise ParameterError(
                f"checkpoint must be what checkpoint() has returned, but it was {shown(checkpoint)}. Call that before."
            )
        if len(checkpoint.poses) != self.robot_count:
            raise ParameterError(
                f"checkpoint must be of {self.robot_count} robots, but it was of {len(checkpoint.poses)}. "
                "Take it from the same simulation."
            )
        check_numbers("poses of a checkpoint", checkpoint.poses, (self.robot_count, 3))
        with self.lock:
            self.sync()
            self.state.bodies = checkpoint.bodies.copy()
            self._lamps = checkpoint.lamps.copy()
            for index, pose in enumerate(checkpoint.poses.tolist()):
                self._put(index, *pose)
            self._enter()
