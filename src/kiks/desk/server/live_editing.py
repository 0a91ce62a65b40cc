"""Drawing in a running world: a sketch follows the world, and each edit of the sketch is applied to the world."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from kiks.desk.server.desk import Desk
from kiks.engine.state import BALL
from kiks.errors import KiksError, ParameterError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp
from kiks.model.atomic_files import inside
from kiks.model.project import ProjectRobot
from kiks.model.sketch import Sketch
from kiks.model.sketch_things import SketchRobot, Thing, radius_of
from kiks.sim.simulation import Simulation

Done = TypeVar("Done")

LAMP_REACH_MM = 20.0
"""Distance within which a click hits a lamp [mm]."""

_LARGE_CELLS = 4_000_000


class Editing:
    """Edits the world of a desk; all browsers of the desk share it and its undo history.

    The world moves on while people draw, so the sketch follows it before each step, and undoes a step that the world
    refuses. Walls, bodies and lamps change in the running world; a different number of robots or another arena starts a
    new world. Each edit takes a checkpoint for resets.

    Args:
        desk: The desk.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._lock = asyncio.Lock()
        self._sim: Simulation | None = None
        self._sketch = Sketch(Arena.box(100, 100), kinds=())
        self._bodies: dict[int, int] = {}  # body numbers in the world by numbers in the sketch
        self._lamps: list[int] = []  # lamp numbers in the sketch, in the world's order
        self._robots: dict[int, ProjectRobot] = {}  # project robots by numbers in the sketch
        self._arena_number = -1  # of the sketch's arena when the world was built

    @property
    def can_undo(self) -> bool:
        """Whether this world has a step to undo."""
        return self._sim is self._desk.sim and self._sketch.can_undo

    @property
    def can_redo(self) -> bool:
        """Whether this world has a step to redo."""
        return self._sim is self._desk.sim and self._sketch.can_redo

    # ---- steps ----

    async def draw(self, act: Callable[[Sketch], object]) -> None:
        """Edit the sketch and the world.

        Args:
            act: At most one step of the sketch.
        """
        await self._do(act, Sketch.take_back)

    async def undo(self) -> None:
        """Undo the last step."""
        await self._do(Sketch.undo, Sketch.redo)

    async def redo(self) -> None:
        """Redo the step that was undone last."""
        await self._do(Sketch.redo, Sketch.undo)

    async def place(self, thing: Thing) -> None:
        """Put a robot, ball, cylinder or lamp into the world."""
        await self.draw(lambda sketch: sketch.add(thing))

    async def remove(self, x_mm: float, y_mm: float) -> None:
        """Remove the thing at a place."""
        await self.draw(lambda sketch: sketch.remove(_thing_at(sketch, x_mm, y_mm)))

    async def begin(self, arena: Arena) -> None:
        """Begin with another arena and the same robots, as a step that can be undone.

        Raises:
            LinkError: If the world cannot be replaced.
        """
        await self.draw(lambda sketch: sketch.begin(arena))

    async def _do(self, act: Callable[[Sketch], object], take_back: Callable[[Sketch], object]) -> None:
        self._desk.check_present()
        async with self._lock:
            await self._follow()
            sketch = self._sketch
            before, version = sketch.arena(), sketch.version
            things = dict(sketch.things)
            await _aside(sketch, lambda: act(sketch))
            if sketch.version == version:
                return
            try:
                await self._apply(before, things)
            except KiksError:
                take_back(sketch)
                raise

    async def _apply(self, before: Arena, things: dict[int, Thing]) -> None:
        """Apply the change of the sketch to the world."""
        sketch, desk = self._sketch, self._desk
        arena = sketch.arena()
        robots = sketch.of(SketchRobot)
        have_changed = robots.keys() != {number for number, thing in things.items() if isinstance(thing, SketchRobot)}
        if have_changed or sketch.arena_number != self._arena_number:
            for number, robot in robots.items():
                self._robots.setdefault(number, ProjectRobot(robot.kind))
            project = await desk.present_project()
            await desk.replace(replace(project, arena=arena, robots=tuple(self._robots[number] for number in robots)))
            self._meet()
            return
        # The arena caches its wall faces, which take a while: compute them before locking the world.
        if not np.array_equal(arena.brightness, before.brightness):
            await asyncio.to_thread(lambda: arena.faces)
        await desk.do(lambda sim: self._change(sim, before, arena, things))
        # Resets return to here: the places of the old checkpoint may be walls by now.
        await desk.mark()
        desk.project = await desk.present_project()
        desk.tell()

    def _change(self, sim: Simulation, before: Arena, arena: Arena, things: dict[int, Thing]) -> None:
        """Apply the difference of one step to the world."""
        now = self._sketch.things
        for number, thing in things.items():
            if number in now:
                continue
            if isinstance(thing, Lamp):
                sim.remove_lamp(self._lamps.index(number) + 1)
                self._lamps.remove(number)
            elif not isinstance(thing, SketchRobot):
                sim.remove_body(self._bodies.pop(number))
        if not np.array_equal(arena.brightness, before.brightness):
            sim.set_arena(arena)
        for number, thing in now.items():
            if number not in things:
                self._add(sim, number, thing)
            elif thing != things[number]:
                self._move(sim, number, thing)

    def _add(self, sim: Simulation, number: int, thing: Thing) -> None:
        if isinstance(thing, Lamp):
            sim.add_lamp(thing.x_mm, thing.y_mm, thing.power_w, is_on=thing.is_on)
            self._lamps.append(number)
        elif isinstance(thing, Ball | Cylinder):
            add = sim.add_ball if isinstance(thing, Ball) else sim.add_cylinder
            self._bodies[number] = add(
                thing.x_mm,
                thing.y_mm,
                radius_mm=thing.radius_mm,
                friction_mm_s2=thing.friction_mm_s2,
                brightness=thing.brightness,
            )

    def _move(self, sim: Simulation, number: int, thing: Thing) -> None:
        if isinstance(thing, Lamp):
            sim.lamps[self._lamps.index(number)] = (thing.x_mm, thing.y_mm, thing.power_w, float(thing.is_on))
        elif isinstance(thing, SketchRobot):
            sim.place([*self._sketch.of(SketchRobot)].index(number) + 1, thing.x_mm, thing.y_mm, thing.heading_rad)
        else:
            sim.move_body(self._bodies[number], thing.x_mm, thing.y_mm)

    # ---- following the world ----

    async def _follow(self) -> None:
        """Update the sketch from the world, in which things have moved and may have been changed from outside."""
        if not await self._desk.do(self._note):
            project = await self._desk.present_project()
            kinds = [self._file(robot.kind) for robot in project.robots]
            arena = project.arena
            self._sketch = await _aside(arena, lambda: Sketch(arena, kinds))
            self._robots = dict(zip(self._sketch.of(SketchRobot), project.robots, strict=True))
            self._meet()

    def _note(self, sim: Simulation) -> bool:
        """Copy the present places into the sketch; return False if the world has other things or walls."""
        if sim is not self._sim or sim is not self._desk.sim:
            return False
        bodies = {int(body["number"]): body for body in sim.bodies()}
        is_known = set(bodies) == set(self._bodies.values()) and len(sim.lamps) == len(self._lamps)
        if not is_known or not np.array_equal(sim.arena.brightness, self._sketch.brightness):
            return False
        sketch = self._sketch
        for (number, robot), pose in zip(sketch.of(SketchRobot).items(), sim.poses().tolist(), strict=True):
            x_mm, y_mm, heading_rad = pose
            sketch.note(number, SketchRobot(x_mm, y_mm, heading_rad, robot.kind))
        for number, there in self._bodies.items():
            thing = sketch.things[number]
            x_mm, y_mm = float(bodies[there]["x_mm"]), float(bodies[there]["y_mm"])
            sketch.note(number, thing._replace(x_mm=x_mm, y_mm=y_mm))
        for number, (x_mm, y_mm, power_w, is_on) in zip(self._lamps, sim.lamps.tolist(), strict=True):
            sketch.note(number, Lamp(x_mm, y_mm, power_w, is_on != 0))
        return True

    def _meet(self) -> None:
        """Match the things of the sketch with those of a world that was just built from it."""
        self._sim = self._desk.sim
        self._arena_number = self._sketch.arena_number
        bodies = self._sim.bodies()
        balls = [int(body["number"]) for body in bodies if body["what"] == BALL]
        cylinders = [int(body["number"]) for body in bodies if body["what"] != BALL]
        self._bodies = dict(zip(self._sketch.of(Ball), balls, strict=True))
        self._bodies |= dict(zip(self._sketch.of(Cylinder), cylinders, strict=True))
        self._lamps = list(self._sketch.of(Lamp))

    def _file(self, kind: str) -> str:
        return str(inside(self._desk.folder, kind, "kind")) if kind.lower().endswith(".toml") else kind


def _thing_at(sketch: Sketch, x_mm: float, y_mm: float) -> int:
    def gap_mm(thing: Thing) -> float:
        reach_mm = LAMP_REACH_MM if isinstance(thing, Lamp) else radius_of(thing)
        return math.hypot(thing.x_mm - x_mm, thing.y_mm - y_mm) - reach_mm

    number = min(sketch.things, key=lambda number: gap_mm(sketch.things[number]), default=0)
    if number == 0 or gap_mm(sketch.things[number]) > 0:
        raise ParameterError(
            "A thing must be at the place of a click, but nothing is there. Click a robot, a ball, a cylinder or "
            "a lamp."
        )
    return number


async def _aside(what: Arena | Sketch, act: Callable[[], Done]) -> Done:
    """Run a slow action (a large arena) in a thread, so that other browsers need not wait; any other at once."""
    return await asyncio.to_thread(act) if what.brightness.size > _LARGE_CELLS else act()
