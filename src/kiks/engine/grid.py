"""Discs (robots, balls and cylinders), and a grid that finds those near a place or near each other.

Discs are numbered from 0, robots first, then bodies. The squares of the grid, 64 mm wide, cover the arena. `entries`
lists the discs square by square, row by row, and `spots` beside it their x, y and radius [mm]. `begins` tells where
each square begins and where a row ends. So the discs of a row of squares are one stretch of memory, and `find_near`
reads one for each row that a circle touches. A robot among a thousand is hardly more expensive than one alone.

`pairs` lists the discs that are near each other, and `neighbours` those that the sensors of each robot might see, both
with some slack: only when things have moved that far, the grid is written anew and searched again. Until then a search
adds that path to its reach. All of this follows from the places of the discs and is no part of the state.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np

from kiks.engine.compiling import inlined, kernel
from kiks.engine.simd.stack_arrays import stack_integers

SQUARE_MM = 64.0
"""Edge of a square of the grid [mm]: somewhat larger than a robot, so a square holds one or two."""

NEAR_LIMIT = 128
"""Most discs that are listed as near to one."""

PAIRS_PER_DISC = 32
"""Space for pairs per disc: discs that do not overlap cannot have as many neighbours of their own size or larger."""

NEIGHBOURS = 40
"""Numbers of a robot's list of neighbours: how many there are, -1 if they are too many for the list, and then they."""

SIGHT_SLACK_MM = 60.0
"""How much farther than its sensors a robot's list of neighbours reaches [mm]."""

_ROUNDED_MM = 1e-6  # more than the rounding of the ways in a tick

Grid: Any = namedtuple(
    "Grid", ("begins", "entries", "spots", "pairs", "neighbours", "places", "crowds", "widest_mm", "sight_mm")
)
"""The grid of each world.

* begins: int32 [world, row, column + 1];
* entries: discs, int32 [world, disc];
* spots: x, y and radius of the entries [mm], float64 [world, disc, 3];
* pairs: discs that are near each other, the lower number first and in rising order, int32 [world, pair, 2];
* neighbours: of each robot, in rising order, int32 [world, robot, `NEIGHBOURS`];
* places: where the discs were when kernels last moved them [mm], float64 [world, disc, 2];
* crowds: records of `CROWD`, shape [world];
* widest_mm: the largest radius [mm];
* sight_mm: how far from a robot's centre the edges of its neighbours are, at most, when they are listed [mm].
"""

CROWD = np.dtype(
    [
        ("pair_count", "i8"),
        ("slack_mm", "f8"),  # distance by which two discs may still approach before pairs must be listed again
        ("sight_mm", "f8"),  # up to where neighbours have been listed, -1 if they have not
        ("moved_mm", "f8"),  # longest path that a disc can have made since the grid was written
    ]
)
"""What is known of the discs of a world."""


def squares_of(height_mm: float, width_mm: float) -> tuple[int, int]:
    """Return the number of rows and columns of the grid."""
    return int(height_mm // SQUARE_MM) + 1, int(width_mm // SQUARE_MM) + 1


@kernel
def count_discs(scene: Any) -> Any:
    """Return the number of robots in a world, and the number of discs."""
    robot_count = scene.robots.shape[1]
    return robot_count, robot_count + scene.bodies.shape[1]


@kernel
def disc_at(scene: Any, world: Any, disc: Any) -> Any:
    """Return the place of a disc and its radius [mm]."""
    if disc < scene.robots.shape[1]:
        robot = scene.robots[world, disc]
        return robot.x_mm, robot.y_mm, scene.kinds[robot.kind].radius_mm
    body = scene.bodies[world, disc - scene.robots.shape[1]]
    return body.x_mm, body.y_mm, body.radius_mm


@kernel
def is_on_floor(scene: Any, world: Any, disc: Any) -> Any:
    """Return whether a disc collides and is visible: not if it is a body that a gripper has lifted."""
    return disc < scene.robots.shape[1] or scene.bodies[world, disc - scene.robots.shape[1]].is_lifted == 0


@kernel
def square_of(begins: Any, x: Any, y: Any) -> Any:
    """Return column and row of the square over a place [mm], of the nearest one outside the arena."""
    column = min(max(0.0, x * (1.0 / SQUARE_MM)), begins.shape[2] - 2.0)
    row = min(max(0.0, y * (1.0 / SQUARE_MM)), begins.shape[1] - 1.0)
    return np.int64(column), np.int64(row)


@kernel
def enter_all(scene: Any, world: Any) -> Any:
    """Enter the discs of a world into its grid, in each square in the order of their numbers."""
    begins, entries, spots = scene.grid.begins, scene.grid.entries, scene.grid.spots
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
    crowd = scene.grid.crowds[world]
    crowd.moved_mm = 0.0
    # Pairs and neighbours are listed when things move.
    crowd.pair_count = 0
    crowd.slack_mm = crowd.sight_mm = -1.0


@kernel
def find_near(scene: Any, world: Any, x: Any, y: Any, reach_mm: Any, itself: Any, found: Any) -> Any:
    """List the discs whose edge may be within `reach_mm` of a place, except one, in the order of their numbers.

    Args:
        scene: The scene.
        world: Index of the world.
        x: The place [mm].
        y: The place [mm].
        reach_mm: Largest distance of an edge [mm]; discs that are somewhat farther may be listed, too.
        itself: The disc to leave out.
        found: int64 [limit]; further discs are left out.

    Returns:
        Their number.
    """
    begins, entries, spots = scene.grid.begins, scene.grid.entries, scene.grid.spots
    if entries.shape[1] == 1 and itself == 0:
        return 0
    reach_mm += scene.grid.crowds[world].moved_mm
    farthest = reach_mm + scene.grid.widest_mm
    count = 0
    first_column, first_row = square_of(begins, x - farthest, y - farthest)
    last_column, last_row = square_of(begins, x + farthest, y + farthest)
    for row in range(first_row, last_row + 1):
        for place in range(begins[world, row, first_column], begins[world, row, last_column + 1]):
            dx, dy, far = spots[world, place, 0] - x, spots[world, place, 1] - y, reach_mm + spots[world, place, 2]
            if count < found.shape[0]:
                # Which discs are near is unpredictable, so no branch depends on it.
                found[count] = entries[world, place]
                count += (dx * dx + dy * dy < far * far) & (entries[world, place] != itself)
    put_in_order(found, count)
    return count


@inlined
def find_around(scene: Any, world: Any, x: Any, y: Any, reach_mm: Any, robot: Any, found: Any) -> Any:
    """Do what `find_near` does for a robot, from its list of neighbours if that reaches as far."""
    if scene.grid.entries.shape[1] == 1:
        return 0
    crowd, neighbours = scene.grid.crowds[world], scene.grid.neighbours
    here_x, here_y, _ = disc_at(scene, world, robot)
    # Both the robot and the others have moved since then.
    far_mm = reach_mm + 2.0 * crowd.moved_mm + abs(x - here_x) + abs(y - here_y)
    if not far_mm <= crowd.sight_mm or neighbours[world, robot, 0] < 0:
        return find_near(scene, world, x, y, reach_mm, robot, found)
    count, far = 0, reach_mm + scene.grid.widest_mm
    for k in range(1, neighbours[world, robot, 0] + 1):
        other_x, other_y, _ = disc_at(scene, world, neighbours[world, robot, k])
        found[count] = neighbours[world, robot, k]
        count += (other_x - x) * (other_x - x) + (other_y - y) * (other_y - y) < far * far
    return count


@inlined
def put_in_order(numbers: Any, count: Any) -> Any:
    """Sort the first `count` numbers, which are few or nearly in order."""
    for k in range(1, count):
        number, place = numbers[k], k
        while place > 0 and numbers[place - 1] > number:
            numbers[place] = numbers[place - 1]
            place -= 1
        numbers[place] = number


@kernel
def list_pairs(scene: Any, world: Any, reach_mm: Any) -> Any:
    """Write the grid anew, and list all pairs of discs with a gap of at most `reach_mm`, and all neighbours of robots.

    They are in the order of the discs' numbers, so nothing depends on when they are listed.
    """
    enter_all(scene, world)
    crowd, pairs, neighbours = scene.grid.crowds[world], scene.grid.pairs, scene.grid.neighbours
    found = stack_integers(NEAR_LIMIT)
    robot_count, disc_count = count_discs(scene)
    for disc in range(disc_count):
        if is_on_floor(scene, world, disc):
            x, y, radius = disc_at(scene, world, disc)
            near_mm, is_robot = radius + reach_mm, disc < robot_count
            count = find_near(scene, world, x, y, max(near_mm, scene.grid.sight_mm * is_robot), disc, found)
            if is_robot:
                neighbours[world, disc, 0] = count if count < NEIGHBOURS else -1
                for k in range(min(count, NEIGHBOURS - 1)):
                    neighbours[world, disc, k + 1] = found[k]
                if count == NEAR_LIMIT:
                    count = find_near(scene, world, x, y, near_mm, disc, found)
            for k in range(count):
                other_x, other_y, other_radius = disc_at(scene, world, found[k])
                dx, dy, far = other_x - x, other_y - y, near_mm + other_radius
                if found[k] > disc and dx * dx + dy * dy < far * far and crowd.pair_count < pairs.shape[1]:
                    pairs[world, crowd.pair_count, 0], pairs[world, crowd.pair_count, 1] = disc, found[k]
                    crowd.pair_count += 1
    crowd.slack_mm, crowd.sight_mm = reach_mm, scene.grid.sight_mm


@kernel
def note_moves(scene: Any, world: Any, longest_mm: Any, second_mm: Any) -> Any:
    """Note how far the discs of a world have moved in a tick: the longest way and the second longest [mm]."""
    crowd = scene.grid.crowds[world]
    crowd.slack_mm -= longest_mm + second_mm + _ROUNDED_MM
    crowd.moved_mm += longest_mm + _ROUNDED_MM


@kernel
def note_places(scene: Any, world: Any) -> Any:
    """Note where the discs of a world are, for `has_changed`."""
    for disc in range(scene.grid.places.shape[1]):
        x, y, _ = disc_at(scene, world, disc)
        scene.grid.places[world, disc, 0], scene.grid.places[world, disc, 1] = x, y


@kernel
def has_changed(scene: Any, world: Any) -> Any:
    """Return whether Python has moved a disc since `note_places`: then pairs must be listed again."""
    for disc in range(scene.grid.places.shape[1]):
        x, y, _ = disc_at(scene, world, disc)
        if x != scene.grid.places[world, disc, 0] or y != scene.grid.places[world, disc, 1]:
            return True
    return False
