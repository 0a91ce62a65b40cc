"""Where the body may be: a disc against the raster, with friction that turns it and wheels that slip.

Need: a robot that meets a wall at an angle slides along it, is turned by the friction at its rim, and its wheels run
on slower than commanded; it never sinks in, never jitters, and always drives out backwards.
Assumption: the tyres drag with a force proportional to their slip, the same in all directions. Then the motion that
the wheels want and the one they get differ like the velocities of a free disc before and after an impulse, a disc of
mass 1 whose radius of gyration is half the wheel base; and there is no momentum from one tick to the next.
Method: move a short piece; let the wall push the disc back along its gradient, which yields the normal impulse N; let
friction, at most mu N, oppose what remains of the sliding at the rim (Coulomb). No push leads farther than the wheels
wanted to go, so that walls give no energy.

Symbols: (u, v) the piece's displacement [mm], q its turn [rad], R the body's radius, h half the wheel base,
n the wall's normal, t = (-ny, nx) along the wall. The rim's point at the wall moves by s = (u, v).t - R q along t.
An impulse T along t changes the displacement by T t and the turn by -R T/h^2, hence s by T (1 + R^2/h^2).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel

PIECE_MM = 1.0
"""Longest piece of a motion near a wall [mm]: short against the radius, so that no wall is jumped over."""

SETTLED_MM = 1e-5
"""Penetration that counts as none [mm]."""

PUSHES = 100
"""Most steps out of the walls. One wall takes one or two, a corner of 90 degrees ten, a sharp one many."""

ROUND_A_CORNER = 1.001
"""How much farther than wanted a disc may get: beyond a convex corner the nearest free place is 0.02 % farther."""


@kernel
def clearance_mm(field: Any, cell: Any, pad: Any, x: Any, y: Any) -> Any:
    """Return the distance from a point to the nearest wall's surface [mm], interpolated between cell centres."""
    column = min(max(x / cell + (pad - 0.5), 0.0), field.shape[1] - 1.001)
    row = min(max(y / cell + (pad - 0.5), 0.0), field.shape[0] - 1.001)
    i = np.int64(column)
    j = np.int64(row)
    fx = column - i
    fy = row - j
    low = field[j, i] * (1.0 - fx) + field[j, i + 1] * fx
    high = field[j + 1, i] * (1.0 - fx) + field[j + 1, i + 1] * fx
    return low * (1.0 - fy) + high * fy - 0.5 * cell


@kernel
def outward(field: Any, cell: Any, pad: Any, x: Any, y: Any) -> Any:
    """Return the unit vector away from the nearest wall, (0, 0) where there is none."""
    gx = clearance_mm(field, cell, pad, x + 0.5 * cell, y) - clearance_mm(field, cell, pad, x - 0.5 * cell, y)
    gy = clearance_mm(field, cell, pad, x, y + 0.5 * cell) - clearance_mm(field, cell, pad, x, y - 0.5 * cell)
    length = math.sqrt(gx * gx + gy * gy)
    if length < 1e-9:
        return 0.0, 0.0
    return gx / length, gy / length


@kernel
def push_out(field: Any, cell: Any, pad: Any, radius: Any, from_x: Any, from_y: Any, x: Any, y: Any) -> Any:
    """Return the free place nearest to (x, y), which a disc has entered from the free place (from_x, from_y).

    Each step goes by the depth along the gradient. Towards any free place beyond straight walls that is never a step
    away, so the disc ends no farther from where it came than it wanted to go, and energy does not grow. Where walls
    are no longer straight, in a pinch, that is no law but a condition: else it goes back along the way.
    """
    reach = distance(from_x, from_y, x, y)
    for _ in range(PUSHES):
        depth = radius - clearance_mm(field, cell, pad, x, y)
        if depth <= SETTLED_MM:
            break
        nx, ny = outward(field, cell, pad, x, y)
        x += depth * nx
        y += depth * ny
    way = distance(from_x, from_y, x, y)
    sunk = max(radius - clearance_mm(field, cell, pad, from_x, from_y), 0.0)
    allowed = reach * ROUND_A_CORNER + sunk
    if depth <= SETTLED_MM and way <= allowed:
        return x, y
    low, high = 0.0, min(allowed / way, 1.0) if way > 0.0 else 0.0
    for _ in range(24):
        middle = 0.5 * (low + high)
        px, py = from_x + middle * (x - from_x), from_y + middle * (y - from_y)
        if clearance_mm(field, cell, pad, px, py) >= radius - SETTLED_MM:
            low = middle
        else:
            high = middle
    return from_x + low * (x - from_x), from_y + low * (y - from_y)


@kernel
def distance(x0: Any, y0: Any, x1: Any, y1: Any) -> Any:
    """Return how far two points are from each other."""
    return math.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))


@kernel
def resolve(field: Any, cell: Any, pad: Any, robot: Any, parameters: Any, u: Any, v: Any, q: Any) -> Any:
    """Move a robot by at most (u, v), turn it by about q; return the displacement, the turn, and whether it touched."""
    radius = parameters.radius_mm
    x, y = robot.x_mm, robot.y_mm
    wanted_x, wanted_y = x + u, y + v
    if clearance_mm(field, cell, pad, wanted_x, wanted_y) >= radius - SETTLED_MM:
        robot.x_mm, robot.y_mm = wanted_x, wanted_y
        return u, v, q, False
    free_x, free_y = push_out(field, cell, pad, radius, x, y, wanted_x, wanted_y)
    push_x, push_y = free_x - wanted_x, free_y - wanted_y
    normal = math.sqrt(push_x * push_x + push_y * push_y)
    du, dv = free_x - x, free_y - y
    if normal > 0.0:
        tx, ty = -push_y / normal, push_x / normal
        gyration = 0.5 * parameters.wheel_base_mm
        leverage = radius * radius / (gyration * gyration)
        slide = du * tx + dv * ty - radius * q
        limit = parameters.wall_friction * normal
        friction = min(max(-slide / (1.0 + leverage), -limit), limit)
        du += friction * tx
        dv += friction * ty
        q -= radius * friction / (gyration * gyration)
        free_x, free_y = push_out(field, cell, pad, radius, x, y, x + du, y + dv)
        du, dv = free_x - x, free_y - y
    robot.x_mm, robot.y_mm = free_x, free_y
    return du, dv, q, True


@entry
def clearance_of_disc(field: Any, cell: Any, pad: Any, x: Any, y: Any, radius: Any) -> Any:
    """Return how far a disc at (x, y) is from the nearest wall [mm], negative inside one."""
    return clearance_mm(field, cell, pad, x, y) - radius
