"""The scene: the discs of a world (robots, balls and cylinders), and a grid that finds neighbours.

Discs are numbered from 0, robots first, then bodies. A scene is one argument of kernels, a plain tuple:

* robots: records of `ROBOT`, shape [world_count, robot_count];
* bodies: records of `BODY`, shape [world_count, body_count];
* kinds: records of `PARAMETERS`, one for each kind of robot; a robot's `kind` is the index of its own;
* near: `begins` int32 [world_count, rows, columns + 1], `entries` int32 and `spots` float64 [3], both [world_count,
  disc_count], and the largest radius [mm].

The grid makes a robot among a thousand hardly more expensive than one alone. Its squares of 64 mm cover the arena.
`entries` lists the discs square by square, row by row, and `spots` beside it their x, y and radius [mm]. `begins` tells
where each square begins and where a row ends. So the discs of a row of squares are one stretch of memory, and
`find_near` reads one for each row that a circle touches. The grid follows from the places of the discs and is no part
of the state: `enter_all` writes it anew whenever something has moved.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.compiling import entry, kernel
from kiks.engine.simd.f64x8 import floor
from kiks.engine.state import TRAIL_LENGTH, State
from kiks.units import TICK_NS

SQUARE_MM = 64.0
"""Edge of a square of the grid [mm]: somewhat larger than a robot, so a square holds one or two."""

Scene = tuple[Any, Any, Any, tuple[Any, Any, Any, float]]


def make_scene(state: State, kinds: NDArray[np.void], width_mm: float, height_mm: float) -> Scene:
    """Return the scene of a state, with all discs in the grid.

    Args:
        state: The state; when its arrays are replaced, it needs a new scene.
        kinds: Constants of the kinds of robots, records of `PARAMETERS`.
        width_mm: Width of the arena [mm].
        height_mm: Height of the arena [mm].
    """
    world_count, robot_count = state.robots.shape
    rows, columns = (int(size_mm // SQUARE_MM) + 1 for size_mm in (height_mm, width_mm))
    disc_count = robot_count + state.bodies.shape[1]
    begins = np.zeros((world_count, rows, columns + 1), np.int32)
    entries, spots = np.zeros((world_count, disc_count), np.int32), np.zeros((world_count, disc_count, 3))
    widest_mm = max(kinds["radius_mm"].max(), state.bodies["radius_mm"].max(initial=0.0))
    scene = (state.robots, state.bodies, kinds, (begins, entries, spots, float(widest_mm)))
    enter_all_worlds(scene)
    return scene


@kernel
def count_discs(scene: Any) -> Any:
    """Return the number of robots in a world, and the number of discs."""
    robots, bodies, _, _ = scene
    return robots.shape[1], robots.shape[1] + bodies.shape[1]


@kernel
def disc_at(scene: Any, world: Any, disc: Any) -> Any:
    """Return the place of a disc and its radius [mm]."""
    robots, bodies, kinds, _ = scene
    if disc < robots.shape[1]:
        robot = robots[world, disc]
        return robot.x_mm, robot.y_mm, kinds[robot.kind].radius_mm
    body = bodies[world, disc - robots.shape[1]]
    return body.x_mm, body.y_mm, body.radius_mm


@kernel
def is_on_floor(scene: Any, world: Any, disc: Any) -> Any:
    """Return whether a disc collides and is visible: not if it is a body that a gripper has lifted."""
    robots, bodies, _, _ = scene
    return disc < robots.shape[1] or bodies[world, disc - robots.shape[1]].is_lifted == 0


@kernel
def square_of(begins: Any, x: Any, y: Any) -> Any:
    """Return column and row of the square over a place [mm], of the nearest one outside the arena."""
    column = min(max(0.0, x * (1.0 / SQUARE_MM)), begins.shape[2] - 2.0)
    row = min(max(0.0, y * (1.0 / SQUARE_MM)), begins.shape[1] - 1.0)
    return np.int64(column), np.int64(row)


@kernel
def enter_all(scene: Any, world: Any) -> Any:
    """Enter the discs of a world into its grid, in each square in the order of their numbers."""
    begins, entries, spots, _ = scene[3]
    disc_count = count_discs(scene)[1]
    begins[world] = 0
    for disc in range(disc_count):
        if is_on_floor(scene, world, disc):
            x, y, _ = disc_at(scene, world, disc)
            column, row = square_of(begins, x, y)
            begins[world, row, column] += 1
    # Turn counts into the end of each square, and then, disc by disc, into its beginning.
    total = np.int32(0)
    for row in range(begins.shape[1]):
        for column in range(begins.shape[2]):
            total += begins[world, row, column]
            begins[world, row, column] = total
    for disc in range(disc_count - 1, -1, -1):
        if is_on_floor(scene, world, disc):
            x, y, radius = disc_at(scene, world, disc)
            column, row = square_of(begins, x, y)
            place = begins[world, row, column] - 1
            begins[world, row, column] = place
            entries[world, place] = disc
            spots[world, place, 0], spots[world, place, 1], spots[world, place, 2] = x, y, radius


@entry
def enter_all_worlds(scene: Any) -> Any:
    """Update the grids of all worlds: for Python, after it has moved something."""
    for world in range(scene[0].shape[0]):
        enter_all(scene, world)


@entry
def enter_worlds(scene: Any, worlds: Any) -> Any:
    """Update the grids of some worlds, int64 [world]."""
    for world in worlds:
        enter_all(scene, world)


@kernel
def find_near(scene: Any, world: Any, x: Any, y: Any, reach_mm: Any, itself: Any, found: Any) -> Any:
    """Write the discs whose edge is within `reach_mm` of a place into `found`, except one; return their number.

    Args:
        scene: The scene.
        world: Index of the world.
        x: The place [mm].
        y: The place [mm].
        reach_mm: Largest distance of an edge [mm].
        itself: The disc to leave out.
        found: int64 [limit]; further discs are left out.
    """
    begins, entries, spots, widest = scene[3]
    if entries.shape[1] == 1 and itself == 0:
        return 0
    farthest = reach_mm + widest
    count = 0
    first_column, first_row = square_of(begins, x - farthest, y - farthest)
    last_column, last_row = square_of(begins, x + farthest, y + farthest)
    for row in range(first_row, last_row + 1):
        for place in range(begins[world, row, first_column], begins[world, row, last_column + 1]):
            dx, dy, far = spots[world, place, 0] - x, spots[world, place, 1] - y, reach_mm + spots[world, place, 2]
            if dx * dx + dy * dy < far * far and entries[world, place] != itself and count < found.shape[0]:
                found[count] = entries[world, place]
                count += 1
    return count


@kernel
def moment_of(tick_count: Any, time_ns: Any) -> Any:
    """Return the tick of a time at most 20 ms before the end of the last tick, and the place of the time in it.

    Returns:
        The number of ticks since that tick ended, and its share, 0..1, after the time; for `Lanes`, lanes.
    """
    age_ns = max(1.0 * tick_count * TICK_NS - time_ns, 0.0)
    ticks_ago = min(floor(age_ns * (1.0 / TICK_NS)), TRAIL_LENGTH - 1.0)
    return ticks_ago, min((age_ns - ticks_ago * TICK_NS) * (1.0 / TICK_NS), 1.0)
