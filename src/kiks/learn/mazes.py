"""The standard maze of Kheperax, in the size of a Khepera.

Kheperax (Grillotti and Cully 2023, "Kheperax: a Lightweight JAX-based Robot Control Environment for Benchmarking
Quality-Diversity Algorithms") has it in units of its side, for a robot with a radius of 0.015; the figures here are
those of `get_target_maze_map("standard")` in its version 0.2.0. Drawn for a robot of 27.5 mm it is 1.83 m wide.
"""

from __future__ import annotations

import math
from dataclasses import replace

from kiks.learn.rooms import WALL_MM, Stroke, draw
from kiks.model.arena import Arena, Pose

SIDE_MM = 27.5 / 0.015
"""Side of the maze [mm]."""

GOAL_MM = (0.15 * SIDE_MM, 0.9 * SIDE_MM)
"""Where the robot is to go."""

_SEGMENTS = (
    ((0.25, 0.25), (0.25, 0.75)),
    ((0.14, 0.45), (0.0, 0.65)),
    ((0.25, 0.75), (0.0, 0.8)),
    ((0.25, 0.75), (0.66, 0.875)),
    ((0.355, 0.0), (0.525, 0.185)),
    ((0.25, 0.5), (0.75, 0.215)),
    ((1.0, 0.25), (0.435, 0.55)),
    ((0.0, 0.8), (0.0, 1.0)),
    ((0.355, 0.0), (1.0, 0.0)),
)
"""Walls within, in sides of the maze."""

_START = (0.15, 0.15, math.pi / 2)
"""x and y, in sides of the maze, and heading [rad]."""


def kheperax() -> Arena:
    """Return the maze, with its start."""
    side = round(SIDE_MM + 2 * WALL_MM)
    strokes = [Stroke(_place(*begin), _place(*end)) for begin, end in _SEGMENTS]
    x_mm, y_mm = _place(*_START[:2])
    return replace(draw(side, side, strokes, "kheperax"), starts=(Pose(x_mm, y_mm, _START[2]),))


def goal_mm() -> tuple[float, float]:
    """Return x and y of the goal in the arena [mm]."""
    return GOAL_MM[0] + WALL_MM, GOAL_MM[1] + WALL_MM


def _place(x: float, y: float) -> tuple[float, float]:
    """Return a place in the arena, whose outer wall lies around the maze [mm]."""
    return x * SIDE_MM + WALL_MM, y * SIDE_MM + WALL_MM
