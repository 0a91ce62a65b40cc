"""Collisions of robots, balls and cylinders with each other and with walls.

Nothing may sink into anything by more than half a millimetre, however many things push. A body that gives way does not
slow a robot (kiks-behaviour.md 3.6); a body that cannot give way stops it.

Things that may collide within a tick move in pieces of two millimetres. After each piece, sweeps resolve the overlaps:
pair by pair in the order of numbers, each disc gives way by half, and then walls push discs back, until all are free.
In the first sweeps a body in front of a robot gives way by all of the overlap. If that does not help, because the body
is squeezed, the robot gives way, too. Discs that still overlap after the last sweep return to where the piece began,
which was free. Speeds change in hits only (`kiks.engine.physics.balls`), so resolving overlaps adds no energy.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from kiks.engine.compiling import kernel
from kiks.engine.physics.balls import collide, kick, roll, speed_of
from kiks.engine.physics.contact import PIECES_MAX, clearance_mm, outward
from kiks.engine.physics.grasp import begin_holds, carry_along, keep_holds, return_held, turn_back, way_of_held
from kiks.engine.physics.motion import give_way, move, note_contact
from kiks.engine.scene import count_discs, disc_at, enter_all, find_near, is_on_floor
from kiks.engine.simd.f64x8 import floor
from kiks.engine.simd.stack_arrays import stack_integers
from kiks.units import NS_PER_S, TICK_NS

PIECE_MM = 2.0
"""Longest piece of a motion among discs [mm]: no disc is smaller."""

RESOLVED_MM = 0.01
"""Overlap that counts as resolved [mm]: sweeps halve the rest, so a smaller value takes more sweeps."""

TOUCHING_MM = 0.02
"""Gap that counts as a touch [mm]."""

STUCK_MM = 0.1
"""Overlap above which a disc is stuck [mm]."""

SWEEPS = 60
"""Most sweeps after a piece. Two discs take one, a robot that presses a disc against a wall ten."""

YIELDING_SWEEPS = 6
"""Sweeps in which a body gives way to a robot by all of the overlap."""

NEAR_LIMIT = 64
"""Most discs that are near enough to one to collide with it within a tick."""

PAIRS_PER_DISC = 32
"""Space for pairs per disc: discs that do not overlap cannot have as many neighbours of their own size or larger."""

TICK_S = TICK_NS / NS_PER_S

SLACK_MM = 10.0
"""Distance by which two discs may approach before neighbours are searched again [mm]."""

HASTE = 4.0
"""Largest approach of two discs in a tick, in paths of the fastest: a disc that is hit may be faster than that."""

Room: Any = namedtuple(
    "Room",
    ("ways", "starts", "moved", "neighbours", "pairs", "is_near", "is_touching", "is_driven", "is_pushed", "is_back"),
)
"""Scratch memory of a tick.

* ways: paths of the left and right wheel [pulses] and slip ratio, float64 [robot_count, 3];
* starts: places at the start of a piece [mm], float64 [disc_count, 2];
* moved: places to which wheels and speeds have moved the discs [mm], float64 [disc_count, 2];
* neighbours: pairs of discs, the lower number first, that may collide before the next search, int64 [pair, 2];
* pairs: those of them that may collide in this tick, int64 [pair, 2];
* is_near: whether a disc may collide in this tick, or rolls, bool [disc_count];
* is_touching: whether it has touched something, bool [disc_count];
* is_driven: whether a wheel drives it, directly or through other discs, bool [disc_count];
* is_pushed: whether it was pushed since the last check for walls, bool [disc_count];
* is_back: whether it has returned to where the piece began, bool [disc_count].
"""


@kernel
def make_room(scene: Any) -> Any:
    """Return scratch memory for the discs of a world."""
    robot_count, disc_count = count_discs(scene)
    return Room(
        np.empty((robot_count, 3)),
        np.empty((disc_count, 2)),
        np.empty((disc_count, 2)),
        np.empty((PAIRS_PER_DISC * disc_count, 2), np.int64),
        np.empty((PAIRS_PER_DISC * disc_count, 2), np.int64),
        np.zeros(disc_count, np.bool_),
        np.zeros(disc_count, np.bool_),
        np.zeros(disc_count, np.bool_),
        np.zeros(disc_count, np.bool_),
        np.zeros(disc_count, np.bool_),
    )


@kernel
def move_alone(scene: Any, ground: Any, world: Any, number: Any, left: Any, right: Any, slip_ratio: Any) -> Any:
    """Phase: drive a robot that can collide with walls only; return whether it touched one."""
    field, cell, pad = ground
    robot = scene[0][world, number]
    return move(field, cell, pad, robot, scene[2][robot.kind], left, right, slip_ratio)


@kernel
def move_together(scene: Any, ground: Any, world: Any, room: Any, neighbour_count: Any, slack_mm: Any) -> Any:
    """Phase: drive and roll, collide, and count the contacts.

    Args:
        scene: The scene.
        ground: The arena's clearance, as contact sees it.
        world: Index of the world.
        room: Scratch memory.
        neighbour_count: Number of neighbour pairs in it.
        slack_mm: Distance by which discs may approach before neighbours are searched again; below 0 at first.

    Returns:
        `neighbour_count` and `slack_mm` for the next tick.
    """
    robots = scene[0]
    robot_count, disc_count = count_discs(scene)
    fastest_mm = 0.0
    for disc in range(disc_count):
        way = way_of(scene, world, room, disc)
        fastest_mm = max(fastest_mm, way)
        room.is_near[disc] = disc >= robot_count and way > 0.0
        if disc < robot_count:
            room.is_driven[disc] = way > 0.0
        else:
            holder = scene[1][world, disc - robot_count].holder
            room.is_driven[disc] = holder > 0 and room.is_driven[holder - 1]
        room.is_touching[disc] = False
    held_mm = way_of_held(scene, world, room)
    fastest_mm = max(fastest_mm, held_mm)
    nearer_mm = HASTE * fastest_mm + TOUCHING_MM
    if slack_mm < nearer_mm:
        slack_mm = max(SLACK_MM, nearer_mm)
        neighbour_count = find_neighbours(scene, world, room, slack_mm)
    slack_mm -= nearer_mm
    pair_count = find_pairs(scene, world, room, neighbour_count, nearer_mm)
    begin_holds(scene, world, room)
    fastest_mm = 0.0
    for disc in range(disc_count):
        if room.is_near[disc]:
            fastest_mm = max(fastest_mm, way_of(scene, world, room, disc))
        elif disc < robot_count:
            left, right, slip_ratio = room.ways[disc, 0], room.ways[disc, 1], room.ways[disc, 2]
            room.is_touching[disc] = move_alone(scene, ground, world, disc, left, right, slip_ratio)
    fastest_mm = max(fastest_mm, held_mm)
    pieces = np.int64(min(max(1.0, -floor(-fastest_mm / PIECE_MM)), PIECES_MAX))
    for _ in range(pieces):
        drive_and_roll(scene, ground, world, room, pieces)
        carry_along(scene, world, room, TICK_S / pieces)
        hit(scene, world, room, pair_count, TICK_S / pieces)
        if not resolve_overlaps(scene, ground, world, room, pair_count):
            return_stuck(scene, ground, world, room, pair_count)
        for number in range(robot_count):
            if room.is_near[number]:
                robot = robots[world, number]
                dx, dy = robot.x_mm - room.moved[number, 0], robot.y_mm - room.moved[number, 1]
                if dx != 0.0 or dy != 0.0:
                    parameters = scene[2][robot.kind]
                    give_way(robot, parameters, dx, dy, room.ways[number, :2] / pieces, room.ways[number, 2])
        turn_back(scene, world, room, pieces)
    for number in range(robot_count):
        note_contact(robots[world, number], room.is_touching[number])
    return neighbour_count, slack_mm


@kernel
def way_of(scene: Any, world: Any, room: Any, disc: Any) -> Any:
    """Return the path of a disc in this tick without obstacles [mm]; that of the faster wheel for a robot."""
    robots, bodies, kinds, _ = scene
    if disc < robots.shape[1]:
        pulse = kinds[robots[world, disc].kind].pulse_mm
        return max(abs(room.ways[disc, 0]), abs(room.ways[disc, 1])) * pulse
    return speed_of(bodies[world, disc - robots.shape[1]]) * TICK_S


@kernel
def find_neighbours(scene: Any, world: Any, room: Any, reach_mm: Any) -> Any:
    """List all pairs of discs with a gap of at most `reach_mm`; return their number.

    The pairs are in the order of the discs' numbers, so the time of the search does not matter.
    """
    enter_all(scene, world)
    found = stack_integers(NEAR_LIMIT)
    neighbour_count = 0
    for disc in range(count_discs(scene)[1]):
        if is_on_floor(scene, world, disc):
            x, y, radius = disc_at(scene, world, disc)
            count = find_near(scene, world, x, y, radius + reach_mm, disc, found)
            put_in_order(found, count)
            for k in range(count):
                if found[k] > disc and neighbour_count < room.neighbours.shape[0]:
                    room.neighbours[neighbour_count, 0], room.neighbours[neighbour_count, 1] = disc, found[k]
                    neighbour_count += 1
    return neighbour_count


@kernel
def put_in_order(numbers: Any, count: Any) -> Any:
    """Sort the first `count` numbers."""
    for k in range(1, count):
        number, place = numbers[k], k
        while place > 0 and numbers[place - 1] > number:
            numbers[place] = numbers[place - 1]
            place -= 1
        numbers[place] = number


@kernel
def find_pairs(scene: Any, world: Any, room: Any, neighbour_count: Any, reach_mm: Any) -> Any:
    """List the neighbours with a gap of at most `reach_mm` and mark them as near; return the number of pairs."""
    robot_count = scene[0].shape[1]
    pair_count = 0
    for k in range(neighbour_count):
        first, second = room.neighbours[k, 0], room.neighbours[k, 1]
        x, y, radius = disc_at(scene, world, first)
        other_x, other_y, other_radius = disc_at(scene, world, second)
        dx, dy, apart = other_x - x, other_y - y, radius + other_radius + reach_mm
        if dx * dx + dy * dy < apart * apart:
            room.is_near[first] = room.is_near[second] = True
            # A robot and the body that it holds do not push each other.
            if second < robot_count or scene[1][world, second - robot_count].holder != first + 1:
                room.pairs[pair_count, 0], room.pairs[pair_count, 1] = first, second
                pair_count += 1
    return pair_count


@kernel
def drive_and_roll(scene: Any, ground: Any, world: Any, room: Any, pieces: Any) -> Any:
    """Move all near discs by one piece, with walls as the only obstacles."""
    field, cell, pad = ground
    bodies = scene[1]
    robot_count, disc_count = count_discs(scene)
    for disc in range(disc_count):
        if not room.is_near[disc]:
            continue
        room.starts[disc, 0], room.starts[disc, 1], _ = disc_at(scene, world, disc)
        if disc < robot_count:
            left, right, slip_ratio = room.ways[disc, 0] / pieces, room.ways[disc, 1] / pieces, room.ways[disc, 2]
            if move_alone(scene, ground, world, disc, left, right, slip_ratio):
                room.is_touching[disc] = True
        else:
            roll(field, cell, pad, bodies[world, disc - robot_count], TICK_S / pieces)
        room.moved[disc, 0], room.moved[disc, 1], _ = disc_at(scene, world, disc)


@kernel
def overlap_of(scene: Any, world: Any, first: Any, second: Any) -> Any:
    """Return the overlap of two discs [mm], negative for a gap, and the direction from the first to the second."""
    x, y, radius = disc_at(scene, world, first)
    other_x, other_y, other_radius = disc_at(scene, world, second)
    dx, dy, apart = other_x - x, other_y - y, radius + other_radius + TOUCHING_MM
    square = dx * dx + dy * dy
    if square >= apart * apart:
        return -TOUCHING_MM, 1.0, 0.0
    length = math.sqrt(square)
    if length < 1e-9:
        return radius + other_radius, 1.0, 0.0
    return radius + other_radius - length, dx / length, dy / length


@kernel
def hit(scene: Any, world: Any, room: Any, pair_count: Any, duration_s: Any) -> Any:
    """Change the speeds of bodies that touch something."""
    robots, bodies, _, _ = scene
    robot_count = robots.shape[1]
    for pair in range(pair_count):
        first, second = room.pairs[pair, 0], room.pairs[pair, 1]
        if second < robot_count:
            continue
        overlap, nx, ny = overlap_of(scene, world, first, second)
        if overlap <= -TOUCHING_MM:
            continue
        body = bodies[world, second - robot_count]
        if first < robot_count:
            dx = room.moved[first, 0] - room.starts[first, 0]
            dy = room.moved[first, 1] - room.starts[first, 1]
            kick(body, (dx * nx + dy * ny) / duration_s, nx, ny)
        else:
            collide(bodies[world, first - robot_count], body, nx, ny)


@kernel
def shift(scene: Any, world: Any, disc: Any, dx: Any, dy: Any) -> Any:
    """Move a disc by (dx, dy) [mm]."""
    robots, bodies, _, _ = scene
    if disc < robots.shape[1]:
        robot = robots[world, disc]
        robot.x_mm += dx
        robot.y_mm += dy
    else:
        body = bodies[world, disc - robots.shape[1]]
        body.x_mm += dx
        body.y_mm += dy


@kernel
def resolve_overlaps(scene: Any, ground: Any, world: Any, room: Any, pair_count: Any) -> Any:
    """Resolve all overlaps in sweeps; return whether all discs are free."""
    field, cell, pad = ground
    disc_count = count_discs(scene)[1]
    room.is_pushed[:] = False
    for sweep in range(SWEEPS):
        worst = 0.0
        for pair in range(pair_count):
            first, second = room.pairs[pair, 0], room.pairs[pair, 1]
            overlap, nx, ny = overlap_of(scene, world, first, second)
            if overlap > 0.0:
                separate(scene, world, room, sweep, first, second, overlap * nx, overlap * ny)
                worst = max(worst, overlap)
        worst = max(worst, keep_holds(scene, ground, world, room))
        for disc in range(disc_count):
            if room.is_pushed[disc]:
                x, y, radius = disc_at(scene, world, disc)
                depth = radius - clearance_mm(field, cell, pad, x, y)
                room.is_pushed[disc] = depth > 0.0
                if depth > 0.0:
                    nx, ny = outward(field, cell, pad, x, y)
                    shift(scene, world, disc, depth * nx, depth * ny)
                    worst = max(worst, depth)
        if worst <= RESOLVED_MM:
            return True
    return False


@kernel
def separate(
    scene: Any, world: Any, room: Any, sweep: Any, first: Any, second: Any, overlap_x: Any, overlap_y: Any
) -> Any:
    """Separate two discs by their overlap (overlap_x, overlap_y) [mm], directed from the first to the second.

    Each gives way by half. A body gives way to a robot by all of it: in the first sweeps, and in all sweeps if no wheel
    drives either of them, because a rolling body does not move a standing robot.
    """
    robot_count = scene[0].shape[1]
    room.is_touching[first] = room.is_touching[second] = True
    room.is_pushed[first] = room.is_pushed[second] = True
    is_driven = room.is_driven[first] or room.is_driven[second]
    room.is_driven[first] = room.is_driven[second] = is_driven
    is_yielding = first < robot_count and second >= robot_count and (sweep < YIELDING_SWEEPS or not is_driven)
    back = 0.0 if is_yielding else 0.5
    shift(scene, world, first, -back * overlap_x, -back * overlap_y)
    shift(scene, world, second, (1.0 - back) * overlap_x, (1.0 - back) * overlap_y)


@kernel
def return_stuck(scene: Any, ground: Any, world: Any, room: Any, pair_count: Any) -> Any:
    """Return stuck discs to where the piece began, and discs that are in their way there, too."""
    field, cell, pad = ground
    disc_count = count_discs(scene)[1]
    room.is_back[:] = False
    is_done = False
    while not is_done:
        is_done = True
        for disc in range(disc_count):
            if room.is_near[disc] and not room.is_back[disc]:
                x, y, radius = disc_at(scene, world, disc)
                if radius - clearance_mm(field, cell, pad, x, y) > STUCK_MM:
                    return_disc(scene, world, room, disc)
                    is_done = False
        for pair in range(pair_count):
            first, second = room.pairs[pair, 0], room.pairs[pair, 1]
            if room.is_back[first] and room.is_back[second]:
                continue
            if overlap_of(scene, world, first, second)[0] > STUCK_MM:
                return_disc(scene, world, room, first)
                return_disc(scene, world, room, second)
                is_done = False
        if return_held(scene, world, room, STUCK_MM):
            is_done = False


@kernel
def return_disc(scene: Any, world: Any, room: Any, disc: Any) -> Any:
    """Return a disc to where the piece began, at rest."""
    x, y, _ = disc_at(scene, world, disc)
    shift(scene, world, disc, room.starts[disc, 0] - x, room.starts[disc, 1] - y)
    room.is_back[disc] = True
    if disc >= scene[0].shape[1]:
        body = scene[1][world, disc - scene[0].shape[1]]
        body.velocity_x = body.velocity_y = 0.0
