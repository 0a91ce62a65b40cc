"""The lessons that come with KiKS: what `kiks/Avoid-v0` and the other environments are about."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kiks.control.measure import measure
from kiks.control.measures import avoidance, near_light_share, nearest_lamp_mm, wall_following
from kiks.errors import ParameterError, nearest, shown
from kiks.learn.lesson import Lesson
from kiks.learn.rooms import corridors, pillars
from kiks.model.arena import Arena, Cylinder, Lamp, Pose

ARRIVED_MM = 60.0
"""How near to a lamp a robot has arrived [mm]: a lamp's light then comes from above more than from aside."""


@measure(notes=2)
def nearer_to_light(moment: Any, notes: Any) -> None:
    """How much nearer to a lamp that burns it has come since its first step [0.1 m], and 1 once it has arrived."""
    distance_mm = nearest_lamp_mm(moment)
    if notes[1] > 0.0:
        notes[0] += (notes[1] - distance_mm) / 100.0
        notes[0] += 1.0 if distance_mm <= ARRIVED_MM < notes[1] else 0.0
    notes[1] = distance_mm


@measure(notes=2)
def drawn_together(moment: Any, notes: Any) -> None:
    """How much smaller the distances between all pairs of bodies have become since its first step, in all [0.1 m]."""
    total_mm = 0.0
    for one in range(moment.bodies.shape[0]):
        for other in range(one):
            across = moment.bodies[one].x_mm - moment.bodies[other].x_mm
            up = moment.bodies[one].y_mm - moment.bodies[other].y_mm
            total_mm += (across * across + up * up) ** 0.5
    if notes[1] > 0.0:
        notes[0] += (notes[1] - total_mm) / 100.0
    notes[1] = total_mm


def avoid() -> Lesson:
    """Drive fast and straight, far from everything."""
    return Lesson("Avoid", (pillars(),), avoidance)


def follow_wall() -> Lesson:
    """Drive fast and straight with a wall on the left."""
    return Lesson("FollowWall", (corridors(),), wall_following("left"))


def light() -> Lesson:
    """Go to a lamp."""
    arena = replace(Arena.box(1000, 1000), lamps=(Lamp(500, 500),))
    return Lesson("Light", (arena,), nearer_to_light, near_light_share(ARRIVED_MM), ("proximity", "ambient"))


def gather() -> Lesson:
    """Push cylinders together."""
    cylinders = tuple(Cylinder(x_mm, y_mm) for x_mm in (200, 500, 800) for y_mm in (200, 500, 800))
    arena = replace(Arena.box(1000, 1000), cylinders=cylinders, starts=(Pose(350, 350, 0.0),))
    return Lesson("Gather", (arena,), drawn_together)


def maze() -> Lesson:
    """Find the way out of a maze, in whose exit a lamp hangs."""
    arena = Arena.maze(columns=3, rows=3, seed=1)
    senses = ("proximity", "ambient")
    return Lesson("Maze", (arena,), nearer_to_light, near_light_share(ARRIVED_MM), senses, starts="arena")


LESSONS: dict[str, Callable[[], Lesson]] = {
    "Avoid": avoid,
    "FollowWall": follow_wall,
    "Light": light,
    "Gather": gather,
    "Maze": maze,
}
"""What makes them, by the names of their environments."""


@functools.lru_cache(maxsize=16)
def _named(name: str) -> Lesson:
    return LESSONS[name]()


def lesson_of(lesson: str | Lesson) -> Lesson:
    """Return a lesson, given or by its name.

    Raises:
        ParameterError: If there is none of that name.
    """
    if isinstance(lesson, Lesson):
        return lesson
    if not isinstance(lesson, str) or lesson not in LESSONS:
        raise ParameterError(
            f"lesson must be a Lesson or one of {', '.join(LESSONS)}, but it was {shown(lesson)}."
            f"{nearest(shown(lesson), tuple(LESSONS))}"
        )
    return _named(lesson)
