"""What there is in a world besides its walls: discs, each a robot, a ball or a cylinder, and who is near whom.

Discs are counted through: robots first, from 0, then bodies. All of it is one argument, `scene`, a plain tuple:

* robots: records of `ROBOT`, shape [world_count, robot_count];
* bodies: records of `BODY`, shape [world_count, body_count];
* kinds: records of `PARAMETERS`, one for each kind of robot; a robot's `kind` says which is its own;
* near: `heads` int32 [world_count, rows, columns], `links` int32 [world_count, disc_count], and the largest
  radius [mm].

Need: a robot among a thousand must not cost much more than one alone, so nobody may look at all the others.
Method: squares of 64 mm lie over the arena. `heads` has the first disc of each square and `links` the next one behind
each disc, -1 for none; `find_near` looks at the squares that a circle touches. Both follow from the places of the
discs and are no part of the state: `enter_all` writes them afresh whenever something has moved.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.compiling import entry, kernel
from kiks.engine.state import TRAIL_LENGTH, State
from kiks.units import TICK_NS

SQUARE_MM = 64.0
"""Edge of a square of the grid [mm]: somewhat more than a robot, so that a square holds one or two."""

Scene = tuple[Any, Any, Any, tuple[Any, Any, float]]


def make_scene(state: State, kinds: NDArray[np.void], width_mm: float, height_mm: float) -> Scene:
    """Return the scene of a state, with everybody entered.

    Args:
        state: The state; when its arrays are replaced, a new scene is due.
        kinds: Constants of the kinds of robots, records of `PARAMETERS`.
        width_mm: Width of the arena [mm].
        height_mm: Height of the arena [mm].
    """
    world_count, robot_count = state.robots.shape
    rows, columns = (int(size_mm // SQUARE_MM) + 1 for size_mm in (height_mm, width_mm))
    heads = np.full((world_count, rows, columns), -1, np.int32)
    links = np.full((world_count, robot_count + state.bodies.shape[1]), -1, np.int32)
    widest_mm = max(kinds["radius_mm"].max(), state.bodies["radius_mm"].max(initial=0.0))
    scene = (state.robots, state.bodies, kinds, (heads, links, float(widest_mm)))
    enter_everybody(scene)
    return scene


@kernel
def count_discs(scene: Any) -> Any:
    """Return how many robots there are in a world, and how many discs."""
    robots, bodies, _, _ = scene
    return robots.shape[1], robots.shape[1] + bodies.shape[1]


@kernel
def disc_at(scene: Any, world: Any, disc: Any) -> Any:
    """Return where a disc is and its radius [mm]."""
    robots, bodies, kinds, _ = scene
    if disc < robots.shape[1]:
        robot = robots[world, disc]
        return robot.x_mm, robot.y_mm, kinds[robot.kind].radius_mm
    body = bodies[world, disc - robots.shape[1]]
    return body.x_mm, body.y_mm, body.radius_mm


@kernel
def is_on_floor(scene: Any, world: Any, disc: Any) -> Any:
    """Say whether others can meet and see a disc: a body that a gripper has lifted they cannot."""
    robots, bodies, _, _ = scene
    return disc < robots.shape[1] or bodies[world, disc - robots.shape[1]].is_lifted == 0


@kernel
def square_of(heads: Any, x: Any, y: Any) -> Any:
    """Return column and row of the square over a place [mm], of the nearest one outside the arena."""
    column = min(max(np.int64(x * (1.0 / SQUARE_MM)), 0), heads.shape[2] - 1)
    return column, min(max(np.int64(y * (1.0 / SQUARE_MM)), 0), heads.shape[1] - 1)


@kernel
def enter_all(scene: Any, world: Any) -> Any:
    """Write down which disc is over which square, for all of a world, so that each chain counts upwards."""
    heads, links, _ = scene[3]
    heads[world] = -1
    for disc in range(count_discs(scene)[1] - 1, -1, -1):
        if is_on_floor(scene, world, disc):
            x, y, _ = disc_at(scene, world, disc)
            column, row = square_of(heads, x, y)
            links[world, disc] = heads[world, row, column]
            heads[world, row, column] = disc


@entry
def enter_everybody(scene: Any) -> Any:
    """Write down where everybody is, in all worlds: for Python, after it has moved something."""
    for world in range(scene[0].shape[0]):
        enter_all(scene, world)


@kernel
def find_near(scene: Any, world: Any, x: Any, y: Any, reach_mm: Any, itself: Any, found: Any) -> Any:
    """Write the discs whose edge is within a reach [mm] of a place into `found`, without one; return how many.

    Args:
        scene: What there is.
        world: Index of the world.
        x: The place [mm].
        y: The place [mm].
        reach_mm: How far an edge may be away.
        itself: The disc that does not count.
        found: int64 [limit]; what is beyond its end is left out.
    """
    heads, links, widest = scene[3]
    if links.shape[1] == 1 and itself == 0:
        return 0
    farthest = reach_mm + widest
    count = 0
    first_column, first_row = square_of(heads, x - farthest, y - farthest)
    last_column, last_row = square_of(heads, x + farthest, y + farthest)
    for row in range(first_row, last_row + 1):
        for column in range(first_column, last_column + 1):
            disc = heads[world, row, column]
            while disc >= 0:
                disc_x, disc_y, radius = disc_at(scene, world, disc)
                dx, dy, far = disc_x - x, disc_y - y, reach_mm + radius
                if dx * dx + dy * dy < far * far and disc != itself and count < found.shape[0]:
                    found[count] = disc
                    count += 1
                disc = links[world, disc]
    return count


@kernel
def moment_of(tick_count: Any, time_ns: Any) -> Any:
    """Return the tick of a time at most 20 ms before the end of the last one, and how much of it was yet to come.

    Returns:
        How many ticks ago it ended, and the share of it, 0..1, that lies behind the time.
    """
    age_ns = max(tick_count * TICK_NS - time_ns, 0)
    ticks_ago = min(age_ns // TICK_NS, TRAIL_LENGTH - 1)
    return ticks_ago, min((age_ns - ticks_ago * TICK_NS) * (1.0 / TICK_NS), 1.0)


@kernel
def place_at(thing: Any, ticks_ago: Any, back: Any) -> Any:
    """Return where the centre of a robot or body was at a moment of `moment_of` [mm]."""
    x, y = thing.x_mm, thing.y_mm
    if ticks_ago > 0:
        x, y = thing.trail[ticks_ago - 1, 0], thing.trail[ticks_ago - 1, 1]
    return x + back * (thing.trail[ticks_ago, 0] - x), y + back * (thing.trail[ticks_ago, 1] - y)
