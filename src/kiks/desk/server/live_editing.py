"""Editing a running world: an edit makes other content of the present one; what differs is applied to the world.

Content never changes, so the history is a list of it. A world moves on while people edit it, and undoing a step changes
nothing but what the step changed.
"""

from __future__ import annotations

import asyncio
import math
import pickle
import zlib
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from typing import Any, NamedTuple

from kiks.desk.server.desk import Desk
from kiks.desk.server.live_content import KINDS, Content, Robot, Selected, Thing, values_of
from kiks.engine.state import BALL
from kiks.errors import ParameterError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Wall
from kiks.model.arena_objects import THINGS_MAX
from kiks.model.data_file import check
from kiks.model.free_disc import free_place
from kiks.sim.simulation import Simulation

LAMP_REACH_MM = 20.0
"""Distance within which a click hits a lamp [mm]."""

HISTORY_BYTES_MAX = 64 << 20
"""Memory that packed steps may take in each direction; the last step stays whatever it takes."""

STEPS_MAX = 1000
"""Most steps that can be undone."""

HISTORIES_MAX = 100
"""Most edits to whose times people can go back and still undo the steps before."""

_LARGE_CELLS = 4_000_000


class _Step(NamedTuple):
    """A step that can be taken: what was there and what will be there."""

    here: Content
    there: Content
    is_another_arena: bool


class _EditHistory(NamedTuple):
    """What can be undone in a world, and what it takes to find it there.

    Attributes:
        numbers: Of the things in the world, in its order: robots, balls, cylinders, lamps.
        undoable: Packed steps that can be undone, the next one last.
        redoable: Packed steps that can be redone, the next one last.
    """

    numbers: tuple[int, ...] = ()
    undoable: tuple[bytes, ...] = ()
    redoable: tuple[bytes, ...] = ()


class _Earlier(NamedTuple):
    """The history after an edit at a time [ns], for people who go on from there, and what was known of the world."""

    time_ns: int
    known: tuple[Any, ...]
    history: _EditHistory


class Editing:
    """Edits the world of a desk; all browsers of the desk share it and its history.

    Walls, bodies and lamps change in the running world; a different number of robots or another arena starts a new
    world. Each edit takes a checkpoint for resets. The world itself refuses what cannot be.

    Args:
        desk: The desk.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._lock = asyncio.Lock()
        self._fresh = count(1)
        self._known: tuple[Any, ...] = ()  # what of the world only edits change
        self._history = _EditHistory()
        self._run: object = None
        self._earlier: deque[_Earlier] = deque(maxlen=HISTORIES_MAX)  # of this run, the last one is the present one

    @property
    def can_undo(self) -> bool:
        """Whether this world has a step to undo."""
        return bool(self._present_history.undoable)

    @property
    def can_redo(self) -> bool:
        """Whether this world has a step to redo."""
        return bool(self._present_history.redoable)

    @property
    def _present_history(self) -> _EditHistory:
        """The history of the world that is shown, as far as it is known before an edit asks that world."""
        return self._history if self._is_known else next((each.history for each in self._reached()), _EditHistory())

    @property
    def _is_known(self) -> bool:
        return self._known[:1] == (self._desk.sim,)

    # ---- steps ----

    async def draw(self, paint: Callable[[Arena], Arena]) -> None:
        """Change the walls by a function from an arena to an arena, such as `kiks.model.brush.line`."""
        await self._edit(lambda now: now._replace(walls=paint(now.walls)))

    async def place(self, thing: Thing) -> None:
        """Put a robot, ball, cylinder or lamp into the world."""

        def added(now: Content) -> Content:
            if len(now.things) >= THINGS_MAX:
                raise ParameterError(f"There must be at most {THINGS_MAX} things, but there are {len(now.things)}.")
            return now._replace(things={**now.things, next(self._fresh): thing})

        await self._edit(added)

    async def select(self, what: str, index: int, x_mm: float, y_mm: float) -> Selected | None:
        """Return what a person selects: a thing by its kind and index among what is drawn, or the wall at a place."""
        async with self._lock:
            now = await self._content()
            bodies = _in_order(self._desk.sim)
        numbers = {
            "robot": [*now.of(Robot)],
            "lamp": [*now.of(Lamp)],
            "body": [number for _, number in sorted(zip(bodies, (*now.of(Ball), *now.of(Cylinder)), strict=False))],
        }.get("robot" if what == "sensor" else what)
        if numbers is not None:
            return numbers[index] if 0 <= index < len(numbers) else None
        return now.wall_at(x_mm, y_mm)

    async def properties(self, selected: Selected) -> Any:
        """Return the record of what people set of a thing or a wall; None if it has gone."""
        async with self._lock:
            return (await self._content()).properties(selected)

    async def change(self, selected: Selected, **values: Any) -> Selected:
        """Change what people set of a thing or a wall, by the names in its record; return what is selected then.

        Raises:
            ParameterError: If a value breaks the rule of its field, or the world has no room for that.
        """
        after = selected

        def changed(now: Content) -> Content:
            nonlocal after
            if (before := now.properties(selected)) is None:
                raise ParameterError("What is changed must be there, but it has gone. Select something else.")
            kind, known = type(before), values_of(before)
            made = check(kind, known | values, kind.__name__.removesuffix("Properties").lower())
            after = made if isinstance(selected, Wall) else selected
            then = now if made == before else now.with_properties(selected, made)
            then.arena()  # which checks places
            return then

        await self._edit(changed)
        return after

    async def remove_selected(self, selected: Selected) -> None:
        """Remove a thing or a wall."""
        await self._edit(lambda now: now.without(selected))

    async def remove(self, x_mm: float, y_mm: float) -> None:
        """Remove the thing or the wall at a place."""
        await self._edit(lambda now: now.without(self._thing_at(now, x_mm, y_mm)))

    async def begin(self, arena: Arena) -> None:
        """Begin with another arena and the same robots, as a step that can be undone.

        Robots go to its starts; those beyond stay where they are, or go to the nearest place with room.

        Raises:
            LinkError: If the world cannot be replaced.
        """
        await self._edit(lambda now: self._in_another_arena(now, arena), is_another_arena=True)

    async def undo(self) -> None:
        """Undo the last step."""
        async with self._lock:
            now = await self._content()
            if undoable := self._history.undoable:
                then, step = _taken(undoable[-1], now)
                await self._apply(now, then, step, undoable[:-1], _pushed(self._history.redoable, step))

    async def redo(self) -> None:
        """Redo the step that was undone last."""
        async with self._lock:
            now = await self._content()
            if redoable := self._history.redoable:
                then, step = _taken(redoable[-1], now)
                await self._apply(now, then, step, _pushed(self._history.undoable, step), redoable[:-1])

    async def _edit(self, edit: Callable[[Content], Content], *, is_another_arena: bool = False) -> None:
        async with self._lock:
            now = await self._content()
            # A large arena takes a while: other browsers need not wait for it.
            is_large = now.walls.brightness.size > _LARGE_CELLS
            then = await asyncio.to_thread(edit, now) if is_large else edit(now)
            if then != now:
                step = _Step(then, now, is_another_arena)
                await self._apply(now, then, step, _pushed(self._history.undoable, step), ())

    # ---- the history, also of those who go on from the past ----

    def _reached(self) -> list[_Earlier]:
        """Return the histories up to the present of a world that goes on from the past, the last one first."""
        if self._run is not self._desk.looking.run or self._desk.past is not None:
            return []
        now_ns = self._desk.sim.now_ns
        return [each for each in reversed(self._earlier) if each.time_ns <= now_ns]

    def _recall(self, known: tuple[Any, ...], thing_count: int) -> None:
        """Go back to the history of a world that goes on from the past; it is empty in any other unknown world.

        Args:
            known: What is known of the world.
            thing_count: How many things it has.
        """
        reached = [] if self._is_known else self._reached()
        here = (_lasting(known), thing_count)
        found = next((each for each in reached if (each.known, len(each.history.numbers)) == here), None)
        if found is None:
            self._history = _EditHistory(tuple(next(self._fresh) for _ in range(thing_count)))
        else:
            self._history = found.history
            while self._earlier[-1] is not found:
                self._earlier.pop()
        self._known = known

    # ---- the world ----

    async def _content(self) -> Content:
        """Return what is in the world now; if something else than an edit has changed it, the history ends."""
        self._desk.check_present()
        known, project = await self._desk.do(_known_parts), await self._desk.present_project()
        arena = project.arena
        robots = [Robot(*start, robot) for start, robot in zip(arena.starts, project.robots, strict=False)]
        things: list[Thing] = [*robots, *arena.bodies, *arena.lamps]
        if known != self._known or len(things) != len(self._history.numbers):
            self._recall(known, len(things))
        walls = replace(arena, starts=(), balls=(), cylinders=(), lamps=())
        return Content(walls, dict(zip(self._history.numbers, things, strict=True)))

    async def _apply(
        self, now: Content, then: Content, step: _Step, undoable: tuple[bytes, ...], redoable: tuple[bytes, ...]
    ) -> None:
        """Change the world, and note what can be undone and redone in it then."""
        desk, time_ns = self._desk, 0
        desk.check_unlocked()
        desk.debugging.note_change()
        if step.is_another_arena or now.of(Robot).keys() != then.of(Robot).keys():
            await desk.alter(then.in_project(await desk.present_project()))
        else:
            # The faces of walls take a while: they are computed before the world is locked.
            if then.walls is not now.walls:
                await asyncio.to_thread(lambda: then.walls.faces)
            time_ns = await desk.do(lambda sim: _change(sim, now, then))
            desk.project = replace(desk.project, robots=tuple(each.robot for each in then.of(Robot).values()))
            # Resets return to here: the places of the old checkpoint may be walls by now.
            await desk.do(desk.mark)
            desk.project = await desk.present_project()
            desk.renew_scene()
        self._known = await desk.do(_known_parts)
        numbers = tuple(number for kind in KINDS for number in then.of(kind))
        self._history = _EditHistory(numbers, undoable, redoable)
        if self._run is not (run := desk.looking.run):
            self._run = run
            self._earlier.clear()
        self._earlier.append(_Earlier(time_ns, _lasting(self._known), self._history))

    def _in_another_arena(self, now: Content, arena: Arena) -> Content:
        discs = [(body.x_mm, body.y_mm, body.radius_mm) for body in arena.bodies]
        things: dict[int, Thing] = {}
        for index, (number, robot) in enumerate(now.of(Robot).items()):
            x_mm, y_mm, heading_rad = (*arena.starts, *[robot[:3]] * (index + 1))[index]
            radius_mm = self._desk.sim.specs[index].body.radius_mm
            x_mm, y_mm = free_place(arena, discs, radius_mm, (x_mm, y_mm), f"robot {index + 1}")
            discs.append((x_mm, y_mm, radius_mm))
            things[number] = Robot(x_mm, y_mm, heading_rad, robot.robot)
        things |= {next(self._fresh): thing for thing in (*arena.bodies, *arena.lamps)}
        return Content(replace(arena, starts=(), balls=(), cylinders=(), lamps=()), things)

    def _thing_at(self, now: Content, x_mm: float, y_mm: float) -> Selected:
        """Return what a click hits: the number of a thing, or a wall."""
        bodies = {number: body for kind in (Ball, Cylinder) for number, body in now.of(kind).items()}
        bodies |= {number: spec.body for number, spec in zip(now.of(Robot), self._desk.sim.specs, strict=False)}
        reaches_mm = dict.fromkeys(now.of(Lamp), LAMP_REACH_MM)
        reaches_mm |= {number: body.radius_mm for number, body in bodies.items()}
        gaps_mm = {
            number: math.hypot(thing.x_mm - x_mm, thing.y_mm - y_mm) - reaches_mm[number]
            for number, thing in now.things.items()
        }
        if gaps_mm and min(gaps_mm.values()) <= 0:
            return min(gaps_mm, key=gaps_mm.__getitem__)
        if (wall := now.wall_at(x_mm, y_mm)) is None:
            raise ParameterError(
                "A thing must be at the place of a click, but nothing is there. Click a robot, a ball, a cylinder, "
                "a lamp, or a wall that was drawn as a line, box or disc."
            )
        return wall


def _known_parts(sim: Simulation) -> tuple[Any, ...]:
    return sim, sim.arena, sim.bodies()["number"].tolist(), len(sim.world.lamps)


def _lasting(known: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return what of it is the same in another world that goes on from a time of this one."""
    sim, arena, numbers, lamp_count = known
    return sim.robot_count, zlib.crc32(arena.brightness.tobytes()), numbers, lamp_count


def _in_order(sim: Simulation) -> list[int]:
    """Return the indices of bodies in the order of a project, which has all balls before all cylinders."""
    are_balls = (sim.bodies()["what"] == BALL).tolist()
    return sorted(range(len(are_balls)), key=lambda index: not are_balls[index])


def _change(sim: Simulation, now: Content, then: Content) -> int:
    """Apply the difference between two contents to a world that has the robots of both; return the time [ns]."""
    numbers = sim.bodies()["number"].tolist()
    bodies = dict(zip((*now.of(Ball), *now.of(Cylinder)), (numbers[index] for index in _in_order(sim)), strict=True))
    for robot, (number, before) in enumerate(now.of(Robot).items(), 1):
        if before[:3] != (pose := then.things[number][:3]):
            sim.place(robot, *pose)
    for row, (number, lamp) in enumerate(now.of(Lamp).items()):
        if (after := then.things.get(number, lamp)) != lamp:
            sim.lamps[row] = after
    for number, body in bodies.items():
        if (after := then.things.get(number)) is not None and after != now.things[number]:
            _change_body(sim, body, now.things[number]._asdict(), after._asdict())
    for row, number in reversed([*enumerate(now.of(Lamp), 1)]):
        if number not in then.things:
            sim.remove_lamp(row)
    for number, body in bodies.items():
        if number not in then.things:
            sim.remove_body(body)
    if then.walls is not now.walls:
        sim.set_arena(then.walls)
    for thing in (thing for number, thing in then.things.items() if number not in now.things):
        if isinstance(thing, Lamp):
            sim.add_lamp(**thing._asdict())
        elif not isinstance(thing, Robot):
            add = sim.add_ball if isinstance(thing, Ball) else sim.add_cylinder
            add(**thing._asdict())
    return sim.now_ns


def _change_body(sim: Simulation, body: int, before: dict[str, Any], after: dict[str, Any]) -> None:
    """Give a ball or cylinder other values; what moves stays in motion if it stays at its place."""
    changes = {name: value for name, value in after.items() if value != before[name]}
    place = {name: changes.pop(name) for name in ("x_mm", "y_mm") if name in changes}
    if place:
        sim.move_body(body, after["x_mm"], after["y_mm"])
    if changes:
        sim.change_body(body, **changes)


def _taken(packed: bytes, now: Content) -> tuple[Content, _Step]:
    """Return what a packed step makes of the present content, and the step that leads back."""
    step: _Step = pickle.loads(zlib.decompress(packed))
    then = step.there if step.is_another_arena else now.with_change(step.here, step.there)
    return then, _Step(then, now, step.is_another_arena)


def _pushed(steps: tuple[bytes, ...], step: _Step) -> tuple[bytes, ...]:
    """Return packed steps with another one, without the oldest ones if there are too many: rasters pack well."""
    steps = (*steps, zlib.compress(pickle.dumps(step), 1))
    while len(steps) > 1 and (len(steps) > STEPS_MAX or sum(map(len, steps)) > HISTORY_BYTES_MAX):
        steps = steps[1:]
    return steps
