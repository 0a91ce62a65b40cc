"""Example worlds."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from kiks.demos.scenes import oval
from kiks.model import pitch
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.project import Project, ProjectRobot


def _objects() -> Project:
    arena = replace(
        Arena.box(800, 600, brightness="wood"),
        name="Balls and cylinders",
        starts=(Pose(120, 300, 0.0),),
        balls=(Ball(400, 150), Ball(600, 450)),
        cylinders=tuple(Cylinder(350 + 120 * column, 300) for column in range(4)),
        lamps=(Lamp(700, 300),),
    )
    return Project(arena, robots=(ProjectRobot(turrets=("gripper", "k213")),))


def _swarm() -> Project:
    starts = tuple(
        Pose(200 + 200 * column, 200 + 200 * row, math.radians(36 * (5 * row + column)))
        for row in range(4)
        for column in range(5)
    )
    arena = replace(Arena.box(1200, 1000, rounded_mm=200), name="Twenty robots", starts=starts)
    return Project(arena, robots=(ProjectRobot(turrets=("radio",)),) * len(starts))


EXAMPLES: dict[str, Callable[[], Project]] = {
    "Classic box": lambda: Project(Arena.default()),
    "Empty square metre": lambda: Project(replace(Arena.box(1000, 1000), name="Square metre")),
    "Maze with a lamp in the exit": lambda: Project(Arena.maze(columns=5, rows=5)),
    "Balls, cylinders and a gripper": _objects,
    "Race track": lambda: Project(
        replace(Arena.from_array(oval(), name="Track"), starts=(Pose(300.0, 80.0, 0.0),)), baud=38400
    ),
    "Football pitch": lambda: Project(
        pitch.arena(balls=(Ball(pitch.MIDDLE_X_MM, pitch.MIDDLE_Y_MM, 21.0, pitch.FRICTION_MM_S2),)),
        robots=(ProjectRobot(turrets=("k213",)),) * 2,
        baud=38400,
    ),
    "Twenty robots": _swarm,
}
"""Factories of the examples by name."""
