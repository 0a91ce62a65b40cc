"""An arena while it is drawn: a raster to paint in, what stands in it, and the way back and forth.

Every operation checks before it changes anything, or takes back what it did: a sketch is always an arena. Lengths are
millimetres, y points up, headings are radians; brightness 0 is floor, so drawing with 0 erases.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError, KiksError, ParameterError, shown
from kiks.model.arena import Arena
from kiks.model.arena_objects import THINGS_MAX, Ball, Cylinder, Lamp, Pose, checked_places
from kiks.model.brush import Area, Point, rectangle_cells, stroke_cells
from kiks.model.free_disc import OVERLAP_MM, free_place, room_mm
from kiks.model.materials import brightness_of
from kiks.model.picture import decode_picture
from kiks.model.raster import is_number
from kiks.model.sketch_history import BoxPatch, Canvas, History, Patch, ThingPatch, WholePatch
from kiks.model.sketch_things import (
    AnyThing,
    SketchRobot,
    Thing,
    name_of,
    numbered,
    overlap_of,
    radius_of,
    robot_radius_mm,
)

WIDTH_MAX_MM = 1000.0
"""Widest brush [mm]."""

POINTS_MAX = 10_000
"""Most points of one stroke."""

_FAR_MM = 1e5


class Sketch:
    """An arena that is drawn.

    Args:
        arena: The initial arena.
        kinds: The kind of each robot; robots beyond the arena's starts are put where there is room.

    Attributes:
        things: What stands or hangs in it, by numbers that stay the same; numbers rise with time.
        version: Rises with each step, forth or back.

    Example:
        >>> sketch = Sketch(Arena.box(400, 300))
        >>> sketch.line([(100, 50), (100, 250)], width_mm=10, brightness="wood")
        >>> int(sketch.arena().brightness[150, 100])
        190
        >>> sketch.undo(), int(sketch.arena().brightness[150, 100])
        (True, 0)
    """

    def __init__(self, arena: Arena, kinds: Sequence[str] = ("khepera",)) -> None:
        self.things: dict[int, Thing] = {}
        self._next, self._history, self.version = len(kinds) + 1, History(), 0
        self._canvas = Canvas(arena.brightness.copy(), arena.mm_per_cell, arena.name)
        pairs = enumerate(zip(arena.starts, kinds, strict=False), 1)
        started = {number: SketchRobot(*start, kind) for number, (start, kind) in pairs}
        self._enter(arena, started, dict(list(enumerate(kinds, 1))[len(started) :]))

    @property
    def brightness(self) -> npt.NDArray[np.uint8]:
        """The raster as it is now, uint8 [row, column], row 0 at the bottom; not to be written to."""
        view = self._canvas.brightness.view()
        view.setflags(write=False)
        return view

    @property
    def arena_number(self) -> int:
        """Number of the arena at the beginning; drawing does not change it."""
        return self._canvas.number

    @property
    def width_mm(self) -> float:
        """Width of the raster [mm]."""
        return self._shape[1] * self._canvas.mm_per_cell

    @property
    def height_mm(self) -> float:
        """Height of the raster [mm]."""
        return self._shape[0] * self._canvas.mm_per_cell

    @property
    def can_undo(self) -> bool:
        """Whether there is a step to undo."""
        return bool(self._history.undoable)

    @property
    def can_redo(self) -> bool:
        """Whether there is a step to redo."""
        return bool(self._history.redoable)

    def of(self, kind: type[AnyThing]) -> dict[int, AnyThing]:
        """Return all things of a kind by their numbers, in order."""
        return {number: thing for number, thing in sorted(self.things.items()) if isinstance(thing, kind)}

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each robot."""
        return tuple(robot.kind for robot in self.of(SketchRobot).values())

    def arena(self) -> Arena:
        """Return what is drawn."""
        return Arena(
            self._canvas.brightness.copy(),
            self._canvas.mm_per_cell,
            self._canvas.name,
            starts=tuple(Pose(robot.x_mm, robot.y_mm, robot.heading_rad) for robot in self.of(SketchRobot).values()),
            lamps=tuple(self.of(Lamp).values()),
            balls=tuple(self.of(Ball).values()),
            cylinders=tuple(self.of(Cylinder).values()),
        )

    # ---- the whole arena ----

    def picture(self, data: bytes, *, mm_per_pixel: float = 1.0, name: str = "picture") -> None:
        """Begin with a picture; robots stay where the floor is free. See `Arena.from_image`.

        Args:
            data: The bytes of a PNG, TIF, PGM or BMP file.
            mm_per_pixel: Edge of a pixel [mm].
            name: What people call the arena.
        """
        self.begin(Arena.from_array(decode_picture(data, mm_per_pixel), mm_per_pixel=mm_per_pixel, name=name))

    def begin(self, arena: Arena) -> None:
        """Begin with another arena, a box or a maze, as one step.

        Robots go to its starts; those beyond stay where they are, or go to the nearest place with room.
        """
        before, canvas = WholePatch(self._canvas, self.things), self._canvas
        wanted: dict[int, SketchRobot | str] = {
            number: SketchRobot(*arena.starts[index], robot.kind) if index < len(arena.starts) else robot
            for index, (number, robot) in enumerate(self.of(SketchRobot).items())
        }
        self._canvas = Canvas(arena.brightness.copy(), arena.mm_per_cell, arena.name, number=self._next)
        try:
            self._enter(arena, {}, wanted)
        except KiksError:
            self._canvas = canvas
            before.swap(canvas, self.things)
            raise
        self._push(before)

    def _enter(self, arena: Arena, robots: dict[int, SketchRobot], wanted: dict[int, SketchRobot | str]) -> None:
        """Put all robots into a raster without objects, each at its place or the nearest free one."""
        self.things.clear()
        self.things.update(robots)
        for thing in (*arena.bodies, *arena.lamps):
            self._add(thing)
        for number, wish in wanted.items():
            self.things[number] = self._seat(number, wish)

    def _seat(self, number: int, wish: SketchRobot | str) -> SketchRobot:
        """Return a free place for a robot: its own, the one nearest to it, or of a mere kind the roomiest."""
        if isinstance(wish, SketchRobot) and self._obstacle(wish) is None:
            return wish
        kind, near = (wish, None) if isinstance(wish, str) else (wish.kind, (wish.x_mm, wish.y_mm))
        arena = Arena(self._canvas.brightness.copy(), self._canvas.mm_per_cell, self._canvas.name)
        there = [thing for thing in self.things.values() if not isinstance(thing, Lamp)]
        discs = [(thing.x_mm, thing.y_mm, radius_of(thing)) for thing in there]
        place = free_place(arena, discs, robot_radius_mm(kind), near, f"robot {number}")
        return SketchRobot(*place, math.pi / 2 if isinstance(wish, str) else wish.heading_rad, kind)

    # ---- walls ----

    def rectangle(self, x0_mm: float, y0_mm: float, x1_mm: float, y1_mm: float, brightness: int | str = 255) -> None:
        """Fill a rectangle between two corners."""
        corner, opposite = self._cells([(x0_mm, y0_mm), (x1_mm, y1_mm)])
        self._paint(rectangle_cells(self._shape, corner, opposite), brightness)

    def line(self, points_mm: Sequence[Point], *, width_mm: float, brightness: int | str = 255) -> None:
        """Draw a line through points with a round brush: from one to another, freehand through many, a dot at one."""
        if not is_number(width_mm) or not 0 < width_mm <= WIDTH_MAX_MM:
            raise ParameterError(f"width_mm must be above 0 and up to {WIDTH_MAX_MM:g}, but it was {shown(width_mm)}.")
        if not 1 <= len(points_mm) <= POINTS_MAX:
            raise ParameterError(
                f"points_mm must be 1 to {POINTS_MAX} points, but they were {len(points_mm)}. Draw in shorter strokes."
            )
        points = self._cells(points_mm)
        self._paint(stroke_cells(self._shape, points, width_mm / self._canvas.mm_per_cell), brightness)

    def clear(self) -> None:
        """Remove all walls; objects stay."""
        self.rectangle(0, 0, self.width_mm, self.height_mm, 0)

    @property
    def _shape(self) -> tuple[int, int]:
        rows, columns = self._canvas.brightness.shape
        return rows, columns

    def _cells(self, points_mm: Sequence[Point]) -> list[Point]:
        for point in points_mm:
            if len(point) != 2 or not all(is_number(value) and abs(value) <= _FAR_MM for value in point):
                raise ParameterError(f"A point must be x and y, up to {_FAR_MM:g} mm away, but it was {shown(point)}.")
        return [(x_mm / self._canvas.mm_per_cell, y_mm / self._canvas.mm_per_cell) for x_mm, y_mm in points_mm]

    def _paint(self, areas: Iterable[Area], brightness: int | str) -> None:
        grey = brightness_of(brightness)
        if isinstance(grey, bool) or not isinstance(grey, int) or not 0 <= grey <= 255:
            raise ParameterError(f"brightness must be 0 (floor) to 255 or a material, but it was {shown(brightness)}.")
        covered = list(areas)
        if not covered:
            return
        box = (
            slice(min(area.rows.start for area in covered), max(area.rows.stop for area in covered)),
            slice(min(area.columns.start for area in covered), max(area.columns.stop for area in covered)),
        )
        raster = self._canvas.brightness
        before = raster[box].copy()
        for rows, columns, mask in covered:
            raster[rows, columns][... if mask is None else mask] = grey
        if np.array_equal(before, raster[box]):
            return
        try:
            if grey:
                self._check_walls(box)
        except ArenaError:
            raster[box] = before
            raise
        self._push(BoxPatch(box, before))

    def _check_walls(self, box: tuple[slice, slice]) -> None:
        """Check that after a wall was drawn there is floor, and nothing stands in it."""
        if self._canvas.brightness.all():
            raise ArenaError("An arena must have floor, but nothing but wall would remain. Leave a place for a robot.")
        rows, columns = (
            (piece.start * self._canvas.mm_per_cell, piece.stop * self._canvas.mm_per_cell) for piece in box
        )
        for number, thing in self.things.items():
            if isinstance(thing, Lamp):
                continue
            reach_mm = radius_of(thing) + 3 * self._canvas.mm_per_cell
            is_near = rows[0] - reach_mm <= thing.y_mm <= rows[1] + reach_mm
            if is_near and columns[0] - reach_mm <= thing.x_mm <= columns[1] + reach_mm:
                gap_mm = self._gap_mm(thing)
                if gap_mm < -OVERLAP_MM:
                    raise ArenaError(
                        f"A wall must leave room for what stands in the arena, but it would be {-gap_mm:.1f} mm inside "
                        f"{numbered(self.things, number)} at ({thing.x_mm:g}, {thing.y_mm:g}) mm. Move that first."
                    )

    # ---- things ----

    def add(self, thing: Thing) -> int:
        """Put a robot, ball, cylinder or lamp into the arena; return its number."""
        checked = self._checked(thing)
        alike = [
            each for each in self.things.values() if isinstance(each, SketchRobot) == isinstance(thing, SketchRobot)
        ]
        if len(alike) >= THINGS_MAX:
            raise ParameterError(f"There must be at most {THINGS_MAX} of these, but there are {len(alike)} already.")
        self._push(ThingPatch(self._next, None))
        self._add(checked)
        return self._next - 1

    def change(self, number: int, thing: Thing) -> None:
        """Put something in the place of a thing: the same one elsewhere, or with other numbers."""
        before = self._thing(number)
        checked = self._checked(thing, but=number)
        self._push(ThingPatch(number, before))
        self.things[number] = checked

    def remove(self, number: int) -> None:
        """Take a thing away."""
        thing = self._thing(number)
        self._push(ThingPatch(number, thing))
        del self.things[number]

    def note(self, number: int, thing: Thing) -> None:
        """Take over where a thing has gone by itself, which is no step to take back."""
        self._thing(number)
        self.things[number] = thing

    def _thing(self, number: int) -> Thing:
        if number not in self.things:
            raise ParameterError(
                f"number must be that of a thing, but it was {shown(number)}. There are {[*self.things]}."
            )
        return self.things[number]

    def _add(self, thing: Thing) -> None:
        self.things[self._next] = thing
        self._next += 1

    def _checked(self, thing: Thing, but: int = 0) -> Thing:
        raster, cell = self._canvas.brightness, self._canvas.mm_per_cell
        checked: Thing
        if isinstance(thing, SketchRobot):
            robot_radius_mm(thing.kind)
            (pose,) = checked_places("start", Pose, [(thing.x_mm, thing.y_mm, thing.heading_rad)], raster, cell)
            checked = SketchRobot(*pose, thing.kind)
        else:
            (checked,) = checked_places(name_of(type(thing)), type(thing), [thing], raster, cell)  # type: ignore[assignment]
        if (obstacle := self._obstacle(checked, but)) is not None:
            raise ArenaError(
                f"The place must be free, but at ({thing.x_mm:g}, {thing.y_mm:g}) mm {obstacle}. Take another place."
            )
        return checked

    def _obstacle(self, thing: Thing, but: int = 0) -> str | None:
        """Return the obstacle of a thing as text; None if its place is free."""
        if isinstance(thing, Lamp):
            return None
        gap_mm = self._gap_mm(thing)
        if gap_mm < -OVERLAP_MM:
            return f"a wall is {-gap_mm:.1f} mm inside it"
        return overlap_of(thing, self.things, but)

    def _gap_mm(self, thing: SketchRobot | Ball | Cylinder) -> float:
        radius_mm = radius_of(thing)
        canvas = self._canvas
        return room_mm(canvas.brightness, canvas.mm_per_cell, thing.x_mm, thing.y_mm, radius_mm) - radius_mm

    # ---- steps ----

    def undo(self) -> bool:
        """Take the last step back; return whether there was one."""
        return self._swap(self._history.undoable, self._history.redoable)

    def redo(self) -> bool:
        """Do again what was taken back last; return whether there was something."""
        return self._swap(self._history.redoable, self._history.undoable)

    def take_back(self) -> None:
        """Undo the last step without a redo."""
        if self.undo():
            self._history.redoable.pop()

    def _push(self, patch: Patch) -> None:
        self._history.push(patch)
        self.version += 1

    def _swap(self, source: list[Patch], target: list[Patch]) -> bool:
        if not source:
            return False
        patch = source[-1]
        other = patch.swap(self._canvas, self.things)
        try:
            if isinstance(patch, BoxPatch):
                self._check_walls(patch.box)
            elif isinstance(patch, ThingPatch) and patch.number in self.things:
                self._checked(self.things[patch.number], but=patch.number)
        except ArenaError:
            other.swap(self._canvas, self.things)
            raise
        source.pop()
        target.append(other)
        self.version += 1
        return True
