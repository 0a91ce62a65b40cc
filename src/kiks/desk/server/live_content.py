"""What people can edit of a running world, as values: its walls, and things with numbers that stay the same."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose, Wall
from kiks.model.cells import covered
from kiks.model.data_file import Coordinate, Text
from kiks.model.project import Project, ProjectRobot
from kiks.sim.from_project import rounded_pose


class Robot(NamedTuple):
    """A robot of a project at its start: x [mm], y [mm], heading [rad]."""

    x_mm: float
    y_mm: float
    heading_rad: float = math.pi / 2
    robot: ProjectRobot = ProjectRobot()


class RobotProperties(NamedTuple):
    """What people set of a robot: name, position [mm], heading [deg]."""

    name: Text
    x_mm: Coordinate
    y_mm: Coordinate
    heading_deg: Coordinate


Thing = Robot | Ball | Cylinder | Lamp
KINDS = (Robot, Ball, Cylinder, Lamp)

Selected = int | Wall
"""What a person has selected: the number of a thing, or a wall with a shape."""


class Content(NamedTuple):
    """What people can edit.

    Attributes:
        walls: The walls, an arena without objects.
        things: What stands or hangs in it, by numbers that stay the same.
    """

    walls: Arena
    things: Mapping[int, Thing]

    def of(self, kind: type[Thing]) -> dict[int, Any]:
        """Return the things of a kind, in the world's order: a robot that comes back stands where it stood."""
        found = {number: thing for number, thing in self.things.items() if isinstance(thing, kind)}
        return dict(sorted(found.items())) if kind is Robot else found

    def arena(self) -> Arena:
        """Return the arena with all that stands or hangs in it."""
        robots, balls, cylinders, lamps = (tuple(self.of(kind).values()) for kind in KINDS)
        starts = tuple(Pose(*each[:3]) for each in robots)
        return replace(self.walls, starts=starts, balls=balls, cylinders=cylinders, lamps=lamps)

    def in_project(self, project: Project) -> Project:
        """Return a project with this content instead of its own."""
        return replace(project, arena=self.arena(), robots=tuple(each.robot for each in self.of(Robot).values()))

    def properties(self, selected: Selected) -> Any:
        """Return the record of what people set of a thing or a wall; None if it has gone."""
        if isinstance(selected, Wall):
            return selected if selected in self.walls.walls else None
        thing = self.things.get(selected)
        if not isinstance(thing, Robot):
            return thing
        heading_deg = round(math.degrees(thing.heading_rad) % 360, 3)
        return RobotProperties(thing.robot.name, thing.x_mm, thing.y_mm, heading_deg)

    def wall_at(self, x_mm: float, y_mm: float) -> Wall | None:
        """Return the uppermost wall with a shape at a place."""
        return next((each for each in reversed(self.walls.walls) if _covers(self.walls, each, x_mm, y_mm)), None)

    def without(self, selected: Selected) -> Content:
        """Return the content without a thing or a wall."""
        if isinstance(selected, Wall):
            walls = tuple(each for each in self.walls.walls if each != selected)
            return self._replace(walls=replace(self.walls, walls=walls))
        return self._replace(things={number: thing for number, thing in self.things.items() if number != selected})

    def with_properties(self, selected: Selected, changed: Any) -> Content:
        """Return the content with another record of what people set of a thing or a wall."""
        if isinstance(selected, Wall):
            walls = tuple(changed if each == selected else each for each in self.walls.walls)
            return self._replace(walls=replace(self.walls, walls=walls))
        if isinstance(changed, RobotProperties):
            name, x_mm, y_mm, heading_deg = changed
            robot = replace(self.of(Robot)[selected].robot, name=name)
            changed = Robot(*rounded_pose(x_mm, y_mm, math.radians(heading_deg % 360)), robot)
        return self._replace(things={**self.things, selected: changed})

    def with_change(self, here: Content, there: Content) -> Content:
        """Return the content with what changes from here to there; what has moved since then stays where it is."""
        things = {
            number: _changed(thing, here.things.get(number), there.things[number])
            for number, thing in self.things.items()
            if number in there.things
        }
        things |= {number: thing for number, thing in there.things.items() if number not in here.things}
        return Content(there.walls, things)


def _changed(now: Any, here: Thing | None, there: Thing) -> Any:
    """Return a thing of now with what of it changes from here to there."""
    if here is None:
        return now
    values = zip(now._fields, here, there, strict=True)
    return now._replace(**{name: after for name, before, after in values if after != before})


def values_of(record: Any) -> dict[str, Any]:
    """Return the values of a record by their names, without those that are left out."""
    return record.table() if isinstance(record, Wall) else record._asdict()


def _covers(arena: Arena, wall: Wall, x_mm: float, y_mm: float) -> bool:
    """Return whether a wall covers a place; a place outside, or one that is no number, it does not."""
    if not (0 <= x_mm < arena.width_mm and 0 <= y_mm < arena.height_mm):
        return False
    cells = covered(arena.ground.shape, wall.cells(arena.ground.shape, arena.mm_per_cell))
    return bool(cells[int(y_mm / arena.mm_per_cell), int(x_mm / arena.mm_per_cell)])
