"""Balls, cylinders and lamps of a world: added, moved and removed from outside."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.scalar_math import sin_cos
from kiks.engine.scene import enter_worlds
from kiks.engine.state import BALL, BODY, CYLINDER
from kiks.errors import ArenaError, KiksError, ParameterError, counted, shown
from kiks.meant import nearest
from kiks.model.arena import Arena, Ball, Cylinder, Lamp
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_count, check_heading, check_kind, check_number
from kiks.model.free_disc import OVERLAP_MM
from kiks.sim.free_space import PRESSED_MM
from kiks.sim.world import ITSELF, World

CHANGES = ("radius_mm", "friction_mm_s2", "brightness")
"""What can be set of a ball or cylinder besides its place."""


@dataclass(frozen=True)
class Checkpoint:
    """Where everything stood: what `Simulation.reset` goes back to.

    Attributes:
        poses: float64 [robot, 3].
        bodies: Records of `BODY`, shape [1, body].
        lamps: float64 [lamp, 4].
    """

    poses: NDArray[np.float64]
    bodies: NDArray[np.void]
    lamps: NDArray[np.float64]

    def __repr__(self) -> str:
        robots, things = len(self.poses), self.bodies.shape[1] + len(self.lamps)
        return f"<{type(self).__name__}: {counted(robots, 'robot')}, {counted(things, 'thing')}>"


class Things:
    """The balls, cylinders and lamps of a world; at first those of its arena.

    Attributes:
        body_count: Bodies created so far, i.e. the last number.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self.body_count = 0
        for body in world.arena.bodies:
            try:
                self._add(body, PRESSED_MM)
            except ParameterError as error:
                raise ArenaError(f"Arena {shown(world.arena.name)}: {error}") from None

    # ---- balls and cylinders ----

    def add_body(self, kind: type[Ball | Cylinder], x_mm: float, y_mm: float, changes: dict[str, Any]) -> int:
        """Add a ball or cylinder at rest; return its number."""
        _check_changes(changes)
        return self._add(self._made(kind, {"x_mm": x_mm, "y_mm": y_mm} | changes))

    def _made(self, kind: type[Ball | Cylinder], values: dict[str, Any]) -> Ball | Cylinder:
        """Return a checked ball or cylinder."""
        body = kind(**values)
        # An arena checks it, so bodies of programs and of files obey the same rules.
        balls, cylinders = ((body,), ()) if isinstance(body, Ball) else ((), (body,))
        return self._checked(balls=balls, cylinders=cylinders).bodies[0]

    def _add(self, body: Ball | Cylinder, overlap_mm: float = OVERLAP_MM) -> int:
        what, name = (BALL, "ball") if isinstance(body, Ball) else (CYLINDER, "cylinder")
        free_space, state = self._world.free_space, self._world.state
        free_space.check_free(f"the place of a {name}", body.x_mm, body.y_mm, body.radius_mm, overlap_mm=overlap_mm)
        self.body_count += 1
        record = np.zeros(1, BODY)
        record["number"], record["what"] = self.body_count, what
        record["x_mm"], record["y_mm"], record["trail"][:] = body.x_mm, body.y_mm, (body.x_mm, body.y_mm)
        record["radius_mm"], record["brightness"] = body.radius_mm, body.brightness
        # A cylinder takes over none of a robot's speed: it lies still when it is not pushed any more.
        record["friction_mm_s2"], record["kick_share"] = body.friction_mm_s2, 1.0 if what == BALL else 0.0
        bodies = np.zeros((1, state.bodies.shape[1] + 1), BODY)
        bodies[:, :-1], bodies[:, -1] = state.bodies, record
        state.bodies = bodies
        self._world.rebuild_scene()
        return self.body_count

    def move_body(self, body: int, x_mm: float, y_mm: float, speed_mm_s: float, heading_rad: float) -> None:
        """Put a ball or cylinder down at a free place, rolling from there."""
        x_mm, y_mm = check_number("x_mm", x_mm), check_number("y_mm", y_mm)
        speed_mm_s = check_number("speed_mm_s", speed_mm_s, 0, 1000)
        sine, cosine = sin_cos(check_heading("heading_rad", heading_rad))
        index, world = self._body_index(body), self._world
        record: Any = world.state.bodies[0, index]
        disc, radius_mm = world.robot_count + index, float(record["radius_mm"])
        world.free_space.check_free(f"the place of body {body}", x_mm, y_mm, radius_mm, but=disc)
        # No gripper holds it any more.
        record["holder"] = record["is_lifted"] = 0
        record["x_mm"], record["y_mm"], record["trail"][:] = x_mm, y_mm, (x_mm, y_mm)
        record["velocity_x"], record["velocity_y"] = speed_mm_s * cosine, speed_mm_s * sine
        enter_worlds(world.scene, ITSELF)

    def change_body(self, body: int, changes: dict[str, Any]) -> None:
        """Change the size, friction or brightness of a ball or cylinder where it is."""
        index, world = self._body_index(body), self._world
        record: Any = world.state.bodies[0, index]
        kind: type[Ball | Cylinder] = Ball if record["what"] == BALL else Cylinder
        _check_changes(changes)
        # The other values stay, and the whole body is checked anew: rules may join two of them.
        now = {name: record[name].item() for name in ("x_mm", "y_mm", *CHANGES)}
        changed = self._made(kind, now | changes)
        disc = world.robot_count + index
        world.free_space.check_free(
            f"the place of body {body}", changed.x_mm, changed.y_mm, changed.radius_mm, but=disc
        )
        for name in CHANGES:
            record[name] = getattr(changed, name)
        world.rebuild_scene()

    def remove_body(self, body: int) -> None:
        """Remove a ball or cylinder."""
        state = self._world.state
        state.bodies = np.delete(state.bodies, self._body_index(body), axis=1)
        self._world.rebuild_scene()

    def _body_index(self, body: int) -> int:
        numbers = self._world.state.bodies["number"][0].tolist()
        if not isinstance(body, int | np.integer) or body not in numbers:
            existing = f"The numbers are {shown(numbers)}" if numbers else "There is none"
            raise ParameterError(f"body must be the number of an existing body, but it was {shown(body)}. {existing}.")
        return int(numbers.index(body))

    # ---- lamps ----

    def add_lamp(self, x_mm: float, y_mm: float, power_w: float, is_on: bool) -> int:
        """Add a lamp; return its row in `lamps`, counted from 1."""
        added = self._checked(lamps=(Lamp(x_mm, y_mm, power_w, is_on),)).lamps
        self._world.lamps = np.vstack([self._world.lamps, added])
        return len(self._world.lamps)

    def remove_lamp(self, lamp: int) -> None:
        """Remove a lamp."""
        lamps = self._world.lamps
        if not len(lamps):
            raise ParameterError(f"lamp must be the row of a lamp, but it was {shown(lamp)}. There is none.")
        lamp = check_count("lamp", lamp, 1, len(lamps), "It is a row of lamps.")
        # Switches name lamps by their rows, and those behind a removed one move up.
        if any(switch.lamp >= lamp for switch in self._world.arena.lamp_switches):
            raise ParameterError(
                f"lamp must come after all that the arena switches in the course of the run, but it was {lamp}. Switch "
                "it off instead."
            )
        self._world.lamps = np.delete(lamps, lamp - 1, axis=0)

    def _checked(self, **things: Any) -> Arena:
        """Return an arena with these things alone: so they are checked by the rules of arena files."""
        nothing: dict[str, Any] = {"starts": (), "lamps": (), "balls": (), "cylinders": (), "lamp_switches": ()}
        try:
            return replace(self._world.arena, **nothing | things)
        except KiksError as error:
            raise ParameterError(str(error)) from None

    # ---- all of them ----

    def checkpoint(self) -> Checkpoint:
        """Return where robots, bodies and lamps are."""
        world = self._world
        bodies = world.bodies()
        # The tracks begin at this instant: after a reset no sensor sees what was before it.
        bodies["trail"] = np.stack([bodies["x_mm"], bodies["y_mm"]], axis=-1)[:, None]
        saved = Checkpoint(world.places()[0], bodies[None], world.lamps.copy())
        for array in (saved.poses, saved.bodies, saved.lamps):
            array.setflags(write=False)
        return saved

    def reset(self, checkpoint: Checkpoint) -> None:
        """Move robots, bodies and lamps back to a checkpoint."""
        world = self._world
        check_kind("checkpoint", checkpoint, Checkpoint, "checkpoint() returns one.")
        if len(checkpoint.poses) != world.robot_count:
            raise ParameterError(
                f"checkpoint must be of {counted(world.robot_count, 'robot')}, but it was of {len(checkpoint.poses)}. "
                "Take it from the same simulation."
            )
        check_numbers("poses of a checkpoint", checkpoint.poses, (world.robot_count, 3))
        world.state.bodies = checkpoint.bodies.copy()
        world.lamps = checkpoint.lamps.copy()
        for index, pose in enumerate(checkpoint.poses.tolist()):
            world.put_robot(index, *pose)
        world.rebuild_scene()


def _check_changes(changes: dict[str, Any]) -> None:
    if unknown := [name for name in changes if name not in CHANGES]:
        raise ParameterError(
            f"changes of a body must be {', '.join(CHANGES)}, but they were {shown(unknown)}. `move_body` moves it."
            f"{nearest(unknown[0], CHANGES)}"
        )
