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

from kiks.engine.compiling import entry, kernel
from kiks.engine.simd.f64x8 import corners, floor

PIECE_MM = 1.0
"""Longest piece of a motion near a wall [mm]: short against the radius, so that no wall is jumped over."""

PIECES_MAX = 100.0
"""Most pieces of a motion in a tick: three times what the fastest robot that a file may describe needs."""

SETTLED_MM = 1e-5
"""Penetration that counts as none [mm]."""

PUSHES = 100
"""Most steps out of the walls. One wall takes one or two, a corner of 90 degrees three, a sharp one more."""

LEAST_GAIN = 0.2
"""Clearance that a step out is taken to gain per way at least; along the middle of a corner of 23 degrees it does."""

ROUND_A_CORNER = 1.001
"""How much farther than wanted a disc may get: beyond a convex corner the nearest free place is 0.02 % farther."""


@kernel
def clearance_mm(field: Any, cell: Any, pad: Any, x: Any, y: Any) -> Any:
    """Return the distance from a point to the nearest wall's surface [mm], interpolated between cell centres."""
    column = min(max(0.0, x / cell + (pad - 0.5)), field.shape[1] - 1.001)
    row = min(max(0.0, y / cell + (pad - 0.5)), field.shape[0] - 1.001)
    i = floor(column)
    j = floor(row)
    fx = column - i
    fy = row - j
    left, right, left_above, right_above = corners(field, i, j)
    low = left * (1.0 - fx) + right * fx
    high = left_above * (1.0 - fx) + right_above * fx
    return low * (1.0 - fy) + high * fy - 0.5 * cell


@kernel
def outward(field: Any, cell: Any, pad: Any, x: Any, y: Any) -> Any:
    """Return the unit vector away from the nearest wall, (0, 0) where there is none."""
    nx, ny, _ = slope(field, cell, pad, x, y)
    return nx, ny


@kernel
def slope(field: Any, cell: Any, pad: Any, x: Any, y: Any) -> Any:
    """Return the unit vector away from the nearest wall, and by how much the clearance grows per way along it.

    That is 1 at a wall, less between two walls, and 0 where there is none, with the vector (0, 0). It is taken across a
    cell, from half a cell on one side to half a cell on the other; those places lie among three times three cells.
    """
    column = min(max(0.0, x / cell + (pad - 1.0)), field.shape[1] - 2.001)
    row = min(max(0.0, y / cell + (pad - 1.0)), field.shape[0] - 2.001)
    i = floor(column)
    j = floor(row)
    fx = column - i
    fy = row - j
    a, b, d, e = corners(field, i, j)
    _, c, _, f = corners(field, i + 1.0, j)
    _, _, g, h = corners(field, i, j + 1.0)
    _, _, _, k = corners(field, i + 1.0, j + 1.0)
    left, right = max(0.5 - fx, 0.0), max(fx - 0.5, 0.0)
    low, high = max(0.5 - fy, 0.0), max(fy - 0.5, 0.0)
    to_left = (b - a) * low + (e - d) * (1.0 - low - high) + (h - g) * high
    to_right = (c - b) * low + (f - e) * (1.0 - low - high) + (k - h) * high
    downwards = (d - a) * left + (e - b) * (1.0 - left - right) + (f - c) * right
    upwards = (g - d) * left + (h - e) * (1.0 - left - right) + (k - f) * right
    gx = to_left * (1.0 - fx) + to_right * fx
    gy = downwards * (1.0 - fy) + upwards * fy
    length = math.sqrt(gx * gx + gy * gy)
    if length < 1e-9:
        return 0.0, 0.0, 0.0
    return gx / length, gy / length, length / cell


@kernel
def push_out(field: Any, cell: Any, pad: Any, radius: Any, from_x: Any, from_y: Any, x: Any, y: Any) -> Any:
    """Return the free place nearest to (x, y), which a disc has entered from the free place (from_x, from_y).

    Each step goes by the depth along the gradient. Towards any free place beyond straight walls that is never a step
    away, so the disc ends no farther from where it came than it wanted to go, and energy does not grow. Between two
    walls, where such a step gains less than the depth, it is longer by as much. Where walls are no longer straight, in
    a pinch, that is no law but a condition: else it goes back along the way.
    """
    allowed = distance(from_x, from_y, x, y) * ROUND_A_CORNER
    depth = radius - clearance_mm(field, cell, pad, x, y)
    for _ in range(PUSHES):
        if depth <= SETTLED_MM:
            break
        nx, ny, gain = slope(field, cell, pad, x, y)
        push = depth / max(gain, LEAST_GAIN)
        x += push * nx
        y += push * ny
        depth = radius - clearance_mm(field, cell, pad, x, y)
    way = distance(from_x, from_y, x, y)
    if depth <= SETTLED_MM and way <= allowed:
        return x, y
    allowed += max(radius - clearance_mm(field, cell, pad, from_x, from_y), 0.0)
    if depth <= SETTLED_MM and way <= allowed:
        return x, y
    low, high = 0.0, allowed / way if way > allowed else 1.0
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
def is_free(field: Any, cell: Any, pad: Any, parameters: Any, x: Any, y: Any) -> Any:
    """Say whether a robot touches no wall at (x, y)."""
    return clearance_mm(field, cell, pad, x, y) >= parameters.radius_mm - SETTLED_MM


@kernel
def slide(field: Any, cell: Any, pad: Any, robot: Any, parameters: Any, u: Any, v: Any, q: Any) -> Any:
    """Move a robot that touches where (u, v) leads it as far as walls let it; return the displacement and the turn."""
    radius = parameters.radius_mm
    x, y = robot.x_mm, robot.y_mm
    wanted_x, wanted_y = x + u, y + v
    free_x, free_y = push_out(field, cell, pad, radius, x, y, wanted_x, wanted_y)
    push_x, push_y = free_x - wanted_x, free_y - wanted_y
    normal = math.sqrt(push_x * push_x + push_y * push_y)
    du, dv = free_x - x, free_y - y
    if normal > 0.0:
        tx, ty = -push_y / normal, push_x / normal
        gyration = 0.5 * parameters.wheel_base_mm
        leverage = radius * radius / (gyration * gyration)
        sliding = du * tx + dv * ty - radius * q
        limit = parameters.wall_friction * normal
        friction = min(max(-sliding / (1.0 + leverage), -limit), limit)
        du += friction * tx
        dv += friction * ty
        q -= radius * friction / (gyration * gyration)
        free_x, free_y = push_out(field, cell, pad, radius, x, y, x + du, y + dv)
        du, dv = free_x - x, free_y - y
    robot.x_mm, robot.y_mm = free_x, free_y
    return du, dv, q


@entry
def clearance_of_disc(field: Any, cell: Any, pad: Any, x: Any, y: Any, radius: Any) -> Any:
    """Return how far a disc at (x, y) is from the nearest wall [mm], negative inside one."""
    return clearance_mm(field, cell, pad, x, y) - radius
