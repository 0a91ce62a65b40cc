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
from typing import Any

import numpy as np

from kiks.engine.bunch import place_of, robot_in, show_places
from kiks.engine.compiling import kernel
from kiks.engine.grid import disc_at, list_pairs
from kiks.engine.physics.balls import collide, kick, remember_place, roll, speed_of
from kiks.engine.physics.contact import PIECES_MAX, clearance_mm, slope
from kiks.engine.physics.grasp import REACH, carry_along, enforce_holds, is_dragged, return_held, turn_back
from kiks.engine.physics.motion import draw_slip, give_way, move, room_left, room_of
from kiks.engine.simd.lanes import floor
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

TICK_S = TICK_NS / NS_PER_S

SLACK_TICKS, SLACK_MM = 8.0, (10.0, 30.0)
"""Ticks after which neighbours are searched again, and limits of the approach up to which they are known [mm]."""

HASTE = 4.0
"""Largest approach of two discs in a tick, in paths of the fastest: a disc that is hit may be faster than that."""


@kernel
def remember_places(scene: Any, world: Any, room: Any, k: Any) -> Any:
    """Phase: store the places of bodies at this tick boundary.

    A body falls asleep when it rests and its whole track is where it is: then nothing about it changes.
    """
    kept, first = 0, scene.bodies.shape[1] * k
    for place in range(first, first + room.awake_counts[k]):
        row = room.awake[place]
        body = scene.bodies[world, row]
        remember_place(body)
        is_awake = body.velocity_x != 0.0 or body.velocity_y != 0.0 or body.holder != 0
        for ago in range(1, body.trail.shape[0]):
            is_awake = is_awake or body.trail[ago, 0] != body.x_mm or body.trail[ago, 1] != body.y_mm
        if is_awake:
            room.awake[first + kept] = row
            kept += 1
    room.awake_counts[k] = kept


@kernel
def find_near_things(scene: Any, bunch: Any, k: Any, wheels_mm: Any) -> Any:
    """Phase: find the things that may collide in a tick, or roll.

    Args:
        scene: The scene.
        bunch: The bunch (`kiks.engine.bunch`).
        k: A world of it.
        wheels_mm: The longest way of a wheel in all its worlds [mm].

    Returns:
        The numbers of near discs and of pairs, and the longest path of any of them [mm].
    """
    world, room = bunch.worlds[k], bunch.room
    robots, bodies, crowd = scene.robots, scene.bodies, scene.grid.crowds[world]
    robot_count = robots.shape[1]
    bodies_mm, held_mm, near_count = 0.0, 0.0, 0
    awake = room.awake[bodies.shape[1] * k :][: room.awake_counts[k]]
    for row in awake:
        body = bodies[world, row]
        bodies_mm = max(bodies_mm, speed_of(body) * TICK_S)
        if is_dragged(body):
            held_mm = max(held_mm, REACH * robot_in(scene, bunch, k, body.holder - 1)[0].way_mm)
    # A held body swings around its robot: it may go farther in a tick than any wheel.
    bodies_mm = max(bodies_mm, held_mm)
    nearer_mm = HASTE * max(wheels_mm, bodies_mm) + TOUCHING_MM
    # The pairs that were listed last are complete only up to a gap, of which moves have used up a part.
    if crowd.slack_mm < nearer_mm:
        show_places(scene, bunch, k)
        list_pairs(scene, world, max(min(max(SLACK_TICKS * nearer_mm, SLACK_MM[0]), SLACK_MM[1]), nearer_mm))
    # Most ticks of most worlds end here.
    if crowd.pair_count == 0 and awake.shape[0] == 0:
        return 0, 0, 0.0
    # What is near depends on this world alone.
    fastest_mm = bodies_mm
    for number in range(robot_count):
        fastest_mm = max(fastest_mm, robot_in(scene, bunch, k, number)[0].way_mm)
    nearer_mm = HASTE * fastest_mm + TOUCHING_MM
    for row in awake:
        body = bodies[world, row]
        # A rolling body moves even if it can hit nothing, and a dragged one wherever its robot goes.
        if speed_of(body) > 0.0 or is_dragged(body):
            near_count = add_near(scene, bunch, k, robot_count + row, near_count)
        if is_dragged(body):
            near_count = add_near(scene, bunch, k, body.holder - 1, near_count)
            robots[world, body.holder - 1].piece_headings[0] = robots[world, body.holder - 1].heading_rad
    pair_count = 0
    for place in range(crowd.pair_count):
        first, second = np.int64(scene.grid.pairs[world, place, 0]), np.int64(scene.grid.pairs[world, place, 1])
        x, y, radius = place_of(scene, bunch, k, first)
        other_x, other_y, other_radius = place_of(scene, bunch, k, second)
        dx, dy, apart = other_x - x, other_y - y, radius + other_radius + nearer_mm
        if dx * dx + dy * dy < apart * apart:
            near_count = add_near(scene, bunch, k, first, near_count)
            near_count = add_near(scene, bunch, k, second, near_count)
            # A robot and the body that it holds do not push each other.
            if second < robot_count or bodies[world, second - robot_count].holder != first + 1:
                room.pairs[2 * pair_count], room.pairs[2 * pair_count + 1] = first, second
                pair_count += 1
    # The number of pieces follows from what is near: a fast robot far away costs and changes nothing here.
    longest_mm = held_mm
    for place in range(near_count):
        disc = room.near[place]
        if disc >= robot_count:
            longest_mm = max(longest_mm, speed_of(bodies[world, disc - robot_count]) * TICK_S)
        else:
            longest_mm = max(longest_mm, robot_in(scene, bunch, k, disc)[0].way_mm)
    wake(scene, room, k, near_count)
    return near_count, pair_count, longest_mm


@kernel
def add_near(scene: Any, bunch: Any, k: Any, disc: Any, near_count: Any) -> Any:
    """Add a disc to those that are near, if it is not among them; return their number."""
    room = bunch.room
    noted = room.discs[disc]
    if noted.is_near:
        return near_count
    room.near[near_count] = disc
    noted.is_near, noted.is_touching = True, False
    if disc < scene.robots.shape[1]:
        one, robot = robot_in(scene, bunch, k, disc)
        noted.left, noted.right, noted.is_driven = one.left_pulses, one.right_pulses, one.way_mm > 0.0
        noted.room_mm, noted.start_x, noted.start_y = one.room_mm, one.x_mm, one.y_mm
        noted.slip_ratio = draw_slip(scene.kinds[robot.kind], scene.seeds[bunch.worlds[k]], disc, bunch.ticks[k])
    else:
        holder = scene.bodies[bunch.worlds[k], disc - scene.robots.shape[1]].holder
        noted.is_driven = holder > 0 and robot_in(scene, bunch, k, holder - 1)[0].way_mm > 0.0
    return near_count + 1


@kernel
def wake(scene: Any, room: Any, k: Any, near_count: Any) -> Any:
    """Wake the bodies that are near: they may move."""
    robot_count, first = scene.robots.shape[1], scene.bodies.shape[1] * k
    for place in range(near_count):
        row = room.near[place] - robot_count
        if row >= 0:
            # Awake bodies are few: a look through their list is cheap.
            is_awake = False
            for other in range(room.awake_counts[k]):
                is_awake = is_awake or room.awake[first + other] == row
            if not is_awake:
                room.awake[first + room.awake_counts[k]] = row
                room.awake_counts[k] += 1


@kernel
def collide_near_things(scene: Any, world: Any, room: Any, near_count: Any, pair_count: Any, longest_mm: Any) -> Any:
    """Phase: drive, roll and collide, of the things that are near; none is near afterwards.

    Args:
        scene: The scene.
        world: Index of the world.
        room: Scratch memory.
        near_count: Number of near discs.
        pair_count: Number of pairs.
        longest_mm: Longest path of a near thing [mm].
    """
    robot_count = scene.robots.shape[1]
    pieces = np.int64(min(max(1.0, -floor(-longest_mm / PIECE_MM)), PIECES_MAX))
    for _ in range(pieces):
        drive_and_roll(scene, world, room, near_count, pieces)
        # Held bodies first follow their robots blindly; the sweeps below find what is in their way.
        carry_along(scene, world, room, TICK_S / pieces)
        hit(scene, world, room, pair_count, TICK_S / pieces)
        if not resolve_overlaps(scene, world, room, near_count, pair_count):
            return_stuck(scene, world, room, near_count, pair_count)
        for place in range(near_count):
            number = room.near[place]
            if number < robot_count:
                robot = scene.robots[world, number]
                dx, dy = robot.x_mm - room.discs[number].moved_x, robot.y_mm - room.discs[number].moved_y
                if dx != 0.0 or dy != 0.0:
                    parameters = scene.kinds[robot.kind]
                    disc = room.discs[number]
                    # Wheels have counted the whole piece: what others have pushed the robot back is taken off again.
                    wheels = disc.left / pieces, disc.right / pieces
                    give_way(robot, parameters, dx, dy, wheels, disc.slip_ratio)
        turn_back(scene, world, room, pieces)
    for place in range(near_count):
        room.discs[room.near[place]].is_near = False


@kernel
def drive_and_roll(scene: Any, world: Any, room: Any, near_count: Any, pieces: Any) -> Any:
    """Move all near discs by one piece, with walls as the only obstacles."""
    robot_count = scene.robots.shape[1]
    for place in range(near_count):
        disc = room.near[place]
        noted, (x, y, _) = room.discs[disc], disc_at(scene, world, disc)
        if disc < robot_count:
            robot = scene.robots[world, disc]
            parameters, left, right = scene.kinds[robot.kind], noted.left / pieces, noted.right / pieces
            way_mm = max(abs(left), abs(right)) * parameters.pulse_mm
            known_mm = room_left(noted.room_mm, x - noted.start_x, y - noted.start_y)
            noted.room_mm = room_of(scene.ground, robot, parameters, way_mm, known_mm)
            if move(scene.ground, robot, parameters, left, right, noted.room_mm, noted.slip_ratio):
                noted.is_touching = True
        else:
            roll(scene.ground, scene.bodies[world, disc - robot_count], TICK_S / pieces)
        # Where the piece began is free: what is stuck at its end returns there.
        noted.start_x, noted.start_y = x, y
        noted.moved_x, noted.moved_y, _ = disc_at(scene, world, disc)


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
    # Discs with one centre, such as those of a damaged file, have no direction: any one takes them apart.
    if length < 1e-9:
        return radius + other_radius, 1.0, 0.0
    return radius + other_radius - length, dx / length, dy / length


@kernel
def hit(scene: Any, world: Any, room: Any, pair_count: Any, duration_s: Any) -> Any:
    """Change the speeds of bodies that touch something."""
    robots, bodies = scene.robots, scene.bodies
    robot_count = robots.shape[1]
    for pair in range(pair_count):
        first, second = room.pairs[2 * pair], room.pairs[2 * pair + 1]
        # Robots have no momentum, and pushes are for the sweeps: only bodies get speeds in hits.
        if second < robot_count:
            continue
        overlap, nx, ny = overlap_of(scene, world, first, second)
        if overlap <= -TOUCHING_MM:
            continue
        body = bodies[world, second - robot_count]
        if first < robot_count:
            dx = room.discs[first].moved_x - room.discs[first].start_x
            dy = room.discs[first].moved_y - room.discs[first].start_y
            kick(body, (dx * nx + dy * ny) / duration_s, nx, ny)
        else:
            collide(bodies[world, first - robot_count], body, nx, ny)


@kernel
def shift(scene: Any, world: Any, disc: Any, dx: Any, dy: Any) -> Any:
    """Move a disc by (dx, dy) [mm]."""
    robots, bodies = scene.robots, scene.bodies
    if disc < robots.shape[1]:
        robot = robots[world, disc]
        robot.x_mm += dx
        robot.y_mm += dy
    else:
        body = bodies[world, disc - robots.shape[1]]
        body.x_mm += dx
        body.y_mm += dy


@kernel
def resolve_overlaps(scene: Any, world: Any, room: Any, near_count: Any, pair_count: Any) -> Any:
    """Resolve all overlaps in sweeps; return whether all discs are free."""
    for place in range(near_count):
        room.discs[room.near[place]].is_pushed = False
    for sweep in range(SWEEPS):
        worst = 0.0
        for pair in range(pair_count):
            first, second = room.pairs[2 * pair], room.pairs[2 * pair + 1]
            overlap, nx, ny = overlap_of(scene, world, first, second)
            if overlap > 0.0:
                separate(scene, world, room, sweep, first, second, overlap * nx, overlap * ny)
                worst = max(worst, overlap)
        worst = max(worst, enforce_holds(scene, world, room))
        for place in range(near_count):
            disc = room.near[place]
            # Motion itself keeps discs off walls: only what was pushed since may be in one.
            if room.discs[disc].is_pushed:
                x, y, radius = disc_at(scene, world, disc)
                depth = radius - clearance_mm(scene.ground, x, y)
                room.discs[disc].is_pushed = depth > 0.0
                if depth > 0.0:
                    nx, ny, _ = slope(scene.ground, x, y)
                    shift(scene, world, disc, depth * nx, depth * ny)
                    worst = max(worst, depth)
        # The largest overlap that this sweep found counts as none.
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
    robot_count = scene.robots.shape[1]
    room.discs[first].is_touching = room.discs[second].is_touching = True
    room.discs[first].is_pushed = room.discs[second].is_pushed = True
    # Drive passes on: a robot that pushes a row of discs drives the last one, too.
    is_driven = room.discs[first].is_driven or room.discs[second].is_driven
    room.discs[first].is_driven = room.discs[second].is_driven = is_driven
    is_yielding = first < robot_count and second >= robot_count and (sweep < YIELDING_SWEEPS or not is_driven)
    back = 0.0 if is_yielding else 0.5
    shift(scene, world, first, -back * overlap_x, -back * overlap_y)
    shift(scene, world, second, (1.0 - back) * overlap_x, (1.0 - back) * overlap_y)


@kernel
def return_stuck(scene: Any, world: Any, room: Any, near_count: Any, pair_count: Any) -> Any:
    """Return stuck discs to where the piece began, and discs that are in their way there, too."""
    for place in range(near_count):
        room.discs[room.near[place]].is_back = False
    is_done = False
    while not is_done:
        is_done = True
        for place in range(near_count):
            disc = room.near[place]
            if not room.discs[disc].is_back:
                x, y, radius = disc_at(scene, world, disc)
                if radius - clearance_mm(scene.ground, x, y) > STUCK_MM:
                    return_disc(scene, world, room, disc)
                    is_done = False
        for pair in range(pair_count):
            first, second = room.pairs[2 * pair], room.pairs[2 * pair + 1]
            # Both were free there, and so they are now.
            if room.discs[first].is_back and room.discs[second].is_back:
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
    shift(scene, world, disc, room.discs[disc].start_x - x, room.discs[disc].start_y - y)
    room.discs[disc].is_back = True
    if disc >= scene.robots.shape[1]:
        body = scene.bodies[world, disc - scene.robots.shape[1]]
        body.velocity_x = body.velocity_y = 0.0
