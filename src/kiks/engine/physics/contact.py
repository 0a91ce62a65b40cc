"""Contact of a robot with walls: a disc against the raster, with friction at the rim and slipping wheels.

A robot that hits a wall at an angle slides along it, friction at its rim turns it, and its wheels turn more slowly than
commanded. It never sinks in, never jitters, and can always drive out backwards.

Assumption: the tyres drag with a force proportional to their slip, the same in all directions. Then the motion that the
wheels command and the resulting one differ like the velocities of a free disc before and after an impulse. The disc has
mass 1 and a radius of gyration of half the wheel base, and keeps no momentum from one tick to the next.

Method: move a short piece; the wall pushes the disc back along its gradient, which yields the normal impulse N;
friction, at most mu N, opposes the remaining sliding at the rim (Coulomb). No push leads farther than the commanded
motion, so walls add no energy.

Symbols: (u, v) the piece's displacement [mm], q its turn [rad], R the body's radius, h half the wheel base,
n the wall's normal, t = (-ny, nx) along the wall. The rim's point at the wall moves by s = (u, v).t - R q along t.
An impulse T along t changes the displacement by T t and the turn by -R T/h^2, hence s by T (1 + R^2/h^2).
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

from kiks.engine.compiling import entry, kernel
from kiks.engine.simd.lanes import floor
from kiks.engine.simd.rasters import corners

Ground: Any = namedtuple("Ground", ("clearance", "cell_mm", "pad"))
"""The walls as contact sees them.

* clearance: distance of cells to the nearest wall [mm], float32 [rows, columns];
* cell_mm: edge of a cell [mm];
* pad: cells of the border around the arena.
"""

PIECE_MM = 1.0
"""Longest piece of a motion near a wall [mm]: short against the radius, so the robot does not jump over walls."""

PIECES_MAX = 100.0
"""Most pieces of a motion in a tick: three times as many as the fastest robot that a file may describe needs."""

SETTLED_MM = 1e-5
"""Penetration that counts as none [mm]."""

PUSHES = 100
"""Most steps out of the walls. One wall takes one or two, a corner of 90 degrees three, a sharper one more."""

LEAST_GAIN = 0.2
"""Smallest gain of clearance per path that a step out assumes; in a corner of 23 degrees the gain is that large."""

ROUND_A_CORNER = 1.001
"""Factor by which a push may exceed the commanded motion: beyond a convex corner the nearest free place is 0.02 %
farther."""


@kernel
def clearance_mm(ground: Any, x: Any, y: Any) -> Any:
    """Return the distance from a point to the nearest wall's surface [mm], interpolated between cell centres."""
    field, cell, pad = ground
    # A little less than the last cell, so that its neighbour to the right is one, too; NaN becomes 0.
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
def slope(ground: Any, x: Any, y: Any) -> Any:
    """Return the unit vector away from the nearest wall, and the gain of clearance per path along it.

    The gain is 1 at a wall, less between two walls, and 0 without a wall, with the vector (0, 0). It is the difference
    over one cell, from half a cell on one side to half a cell on the other; these places lie within 3 x 3 cells.
    """
    field, cell, pad = ground
    # The square of 3 x 3 cells must lie in the raster, whatever the place is.
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
    # In the middle between two walls there is no way out that is better than another.
    if length < 1e-9:
        return 0.0, 0.0, 0.0
    return gx / length, gy / length, length / cell


@kernel
def push_out(ground: Any, radius: Any, from_x: Any, from_y: Any, x: Any, y: Any) -> Any:
    """Return the free place nearest to (x, y), which a disc has entered from the free place (from_x, from_y).

    Each step goes along the gradient by the depth. With straight walls such a step never increases the distance to a
    free place, so the disc ends no farther from its start than commanded, and energy does not grow. Between two walls,
    where a step gains less than the depth, the step is longer by that ratio. If walls are not straight, in a pinch,
    this may fail; then the disc goes back along its path.
    """
    allowed = distance(from_x, from_y, x, y) * ROUND_A_CORNER
    depth = radius - clearance_mm(ground, x, y)
    for _ in range(PUSHES):
        if depth <= SETTLED_MM:
            break
        nx, ny, gain = slope(ground, x, y)
        # Where clearance hardly grows, a step as long as the depth over the gain would leap across a passage.
        push = depth / max(gain, LEAST_GAIN)
        x += push * nx
        y += push * ny
        depth = radius - clearance_mm(ground, x, y)
    way = distance(from_x, from_y, x, y)
    if depth <= SETTLED_MM and way <= allowed:
        return x, y
    # A start that was itself a little in the wall, as a hand may put it, gets that much farther.
    allowed += max(radius - clearance_mm(ground, from_x, from_y), 0.0)
    if depth <= SETTLED_MM and way <= allowed:
        return x, y
    # Only a pinch comes here: the way back to the start is free at its end, so halving it finds a free place.
    low, high = 0.0, allowed / way if way > allowed else 1.0
    for _ in range(24):
        middle = 0.5 * (low + high)
        px, py = from_x + middle * (x - from_x), from_y + middle * (y - from_y)
        if clearance_mm(ground, px, py) >= radius - SETTLED_MM:
            low = middle
        else:
            high = middle
    return from_x + low * (x - from_x), from_y + low * (y - from_y)


@kernel
def distance(x0: Any, y0: Any, x1: Any, y1: Any) -> Any:
    """Return the distance between two points."""
    return math.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))


@kernel
def is_free(ground: Any, parameters: Any, x: Any, y: Any) -> Any:
    """Return whether a robot touches no wall at (x, y)."""
    return clearance_mm(ground, x, y) >= parameters.radius_mm - SETTLED_MM


@kernel
def slide(ground: Any, robot: Any, parameters: Any, u: Any, v: Any, q: Any) -> Any:
    """Move a touching robot by (u, v) as far as walls allow; return the displacement and the turn."""
    radius = parameters.radius_mm
    x, y = robot.x_mm, robot.y_mm
    wanted_x, wanted_y = x + u, y + v
    free_x, free_y = push_out(ground, radius, x, y, wanted_x, wanted_y)
    push_x, push_y = free_x - wanted_x, free_y - wanted_y
    normal = math.sqrt(push_x * push_x + push_y * push_y)
    du, dv = free_x - x, free_y - y
    # Without a push there is no normal force, and so no friction.
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
        # Friction may have moved it into another wall, as in a corner.
        free_x, free_y = push_out(ground, radius, x, y, x + du, y + dv)
        du, dv = free_x - x, free_y - y
    robot.x_mm, robot.y_mm = free_x, free_y
    return du, dv, q


@entry
def clearance_of_disc(clearance: Any, cell_mm: Any, pad: Any, x: Any, y: Any, radius: Any) -> Any:
    """Return the gap between a disc at (x, y) and the nearest wall [mm], negative inside one."""
    return clearance_mm(Ground(clearance, cell_mm, pad), x, y) - radius
