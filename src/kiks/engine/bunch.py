"""A bunch: some worlds whose robots are moved together, eight at a time, in lanes.

Robots of one world or of several fill the lanes in the order of their worlds and numbers, so hardly a lane stays empty.
While a bunch exists, its lanes hold what moves in the robots. Their records in the scene follow where others need them:
the poses before neighbours are searched; what collisions change, of robots that may collide; the tracks, before sensors
are read; all the rest at the end.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np
from numba import types
from numba.np.numpy_support import from_dtype

from kiks.engine.compiling import inlined, kernel, spliced
from kiks.engine.grid import PAIRS_PER_DISC, count_discs, disc_at, enter_all, has_changed, note_moves, note_places
from kiks.engine.simd.lanes import LANES
from kiks.engine.simd.records import EIGHT, EIGHT_KINDS, fill_lanes, load_lane, one_of, open_record8, store_lane
from kiks.engine.simd.stack_arrays import stack_integers, stack_records
from kiks.engine.state import TRAIL_LENGTH

DISC = np.dtype(
    [
        ("left", "f8"),  # of a near robot: the paths of its wheels [pulses] and its slip ratio
        ("right", "f8"),
        ("slip_ratio", "f8"),
        ("room_mm", "f8"),  # of a near robot: what is known of its clearance at the start of a piece [mm]
        ("start_x", "f8"),  # its place at the start of a piece [mm]
        ("start_y", "f8"),
        ("moved_x", "f8"),  # where wheels and speed have moved it [mm]
        ("moved_y", "f8"),
        ("is_near", "?"),  # may collide in this tick, or rolls
        ("is_touching", "?"),  # has touched something
        ("is_driven", "?"),  # a wheel drives it, directly or through other discs
        ("is_pushed", "?"),  # was pushed since the last check for walls
        ("is_back", "?"),  # has returned to where the piece began
    ],
    align=True,
)
"""What collisions note about a disc."""

Room: Any = namedtuple("Room", ("discs", "near", "pairs", "awake", "awake_counts"))
"""Scratch memory for the collisions of a tick. Things are near if they may collide in this tick, or roll.

* discs: records of `DISC`;
* near: the near discs, int64 [disc];
* pairs: discs that may collide in this tick, two for each pair, the lower number first, int64 [2 * pair];
* awake: bodies that have moved of late, int64 [body] for each world of the bunch;
* awake_counts: their numbers, int64 [world of the bunch].
"""


def _list(element: Any) -> Any:
    return types.Array(element, 1, "C")


_tuple: Any = types.NamedTuple
_integers = _list(types.int64)

ROOM = _tuple((_list(from_dtype(DISC)), *(_integers,) * 4), Room)
"""Numba's type of a `Room`."""

FEW_DISCS = 16
"""Discs up to which scratch memory lies on the stack."""

_FEW_PAIRS = 2 * PAIRS_PER_DISC * FEW_DISCS


@spliced
def make_room(scene: Any, world_count: Any) -> Any:
    """Return scratch memory for the discs of a world, on the stack for few discs, and for bodies of some worlds."""
    robot_count, disc_count = count_discs(scene)
    discs, near, pairs = stack_records(FEW_DISCS, DISC), stack_integers(FEW_DISCS), stack_integers(_FEW_PAIRS)
    if disc_count > FEW_DISCS:
        discs, near = np.empty(disc_count, DISC), np.empty(disc_count, np.int64)
        pairs = np.empty(2 * PAIRS_PER_DISC * disc_count, np.int64)
    awake, awake_counts = stack_integers(FEW_DISCS), stack_integers(LANES)
    if (disc_count - robot_count) * world_count > FEW_DISCS:
        awake = np.empty((disc_count - robot_count) * world_count, np.int64)
    for disc in range(disc_count):
        discs[disc].is_near = False
    return Room(discs, near, pairs, awake, awake_counts)


@kernel
def wake_all(scene: Any, room: Any, k: Any) -> Any:
    """Wake all bodies of a world of the bunch."""
    body_count = scene.bodies.shape[1]
    room.awake_counts[k] = body_count
    for row in range(body_count):
        room.awake[body_count * k + row] = row


Bunch: Any = namedtuple(
    "Bunch", ("worlds", "ticks", "robots", "before", "kinds", "seeds", "room", "has_company", "has_grippers")
)
"""A bunch.

* worlds: indices of its worlds in the scene, int64 [world of the bunch];
* ticks: ticks done in each of them, int64 [world of the bunch];
* robots: the robots, records of `EIGHT`; the last lanes may repeat another robot;
* before: space for records of robots whose world has done its ticks before others;
* kinds: the constants of the robots, records of `EIGHT_KINDS`;
* seeds: the seed of each lane's world, int64 [lane];
* room: scratch memory for collisions (`Room`);
* has_company: whether worlds hold anything that moves besides a lone robot;
* has_grippers: whether any robot has a gripper.
"""

BUNCH = _tuple(
    (
        *(_integers, _integers, *(_list(from_dtype(each)) for each in (EIGHT, EIGHT, EIGHT_KINDS)), _integers),
        *(ROOM, types.boolean, types.boolean),
    ),
    Bunch,
)
"""Numba's type of a `Bunch`."""


def worlds_in_bunch(robot_count: int) -> int:
    """Return the number of worlds whose robots fill lanes without gaps; one, if a world's robots nearly do."""
    return LANES // math.gcd(LANES, robot_count) if robot_count < 4 * LANES else 1


LaneMemory: Any = namedtuple("LaneMemory", ("robots", "before", "kinds", "seeds"))
"""Memory for the lanes of a bunch, as in `Bunch`."""


@spliced
def make_lanes(count: Any) -> Any:
    """Return memory for the lanes of some robots, on the stack if they are few."""
    robots, before, kinds = stack_records(1, EIGHT), stack_records(1, EIGHT), stack_records(1, EIGHT_KINDS)
    seeds = stack_integers(LANES)
    eights = -(-count // LANES)
    if eights > 1:
        robots, before, kinds = np.empty(eights, EIGHT), np.empty(eights, EIGHT), np.empty(eights, EIGHT_KINDS)
        seeds = np.empty(eights * LANES, np.int64)
    return LaneMemory(robots, before, kinds, seeds)


@kernel
def take(scene: Any, worlds: Any, ticks: Any, lanes: Any, room: Any) -> Any:
    """Take the robots of some worlds into lanes.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        worlds: Indices of the worlds, int64.
        ticks: Ticks done in each of them, int64; changed when ticks are done.
        lanes: Memory for the robots (`make_lanes`).
        room: Scratch memory for collisions in these worlds (`make_room`).
    """
    robot_count = scene.robots.shape[1]
    # Only worlds with company have room for pairs.
    has_company, has_grippers, eight, lane = scene.grid.pairs.shape[1] > 0, False, -1, LANES - 1
    for k in range(worlds.shape[0]):
        wake_all(scene, room, k)
        if has_company and has_changed(scene, worlds[k]):
            enter_all(scene, worlds[k])
        for number in range(robot_count):
            robot = scene.robots[worlds[k], number]
            eight, lane = (eight, lane + 1) if lane < LANES - 1 else (eight + 1, 0)
            eights, kinds = lanes.robots[eight], lanes.kinds[eight]
            if lane == 0:
                # The lanes that no other robot takes repeat this one.
                fill_lanes(eights, robot)
                fill_lanes(kinds, scene.kinds[robot.kind])
                eights.is_near[:] = 0.0
                eights.room_mm[:] = 0.0
            else:
                load_lane(eights, lane, robot)
                load_lane(kinds, lane, scene.kinds[robot.kind])
            eights.number[lane:] = number
            eights.tick_count[lane:] = ticks[k]
            lanes.seeds[LANES * eight + lane : LANES * (eight + 1)] = scene.seeds[worlds[k]]
            # A gripper that was taken off may have held something.
            has_grippers = has_grippers or robot.has_gripper != 0 or robot.held_row != 0
    # There may be memory for more worlds than these.
    used = eight + 1
    its = lanes.robots[:used], lanes.before[:used], lanes.kinds[:used], lanes.seeds[: LANES * used], room
    return Bunch(worlds, ticks, *its, has_company, has_grippers)


@kernel
def give_back(scene: Any, bunch: Any) -> Any:
    """Write the robots back to the scene."""
    robot_count = scene.robots.shape[1]
    for place in range(bunch.worlds.shape[0] * robot_count):
        k, number = whose(scene, place)
        store_lane(bunch.robots[place // LANES], place % LANES, scene.robots[bunch.worlds[k], number])
    for k in range(bunch.worlds.shape[0]):
        if bunch.has_company:
            note_places(scene, bunch.worlds[k])


@kernel
def set_end(scene: Any, bunch: Any, until: Any) -> Any:
    """Set the tick that each world of the bunch is to reach, int64 [world of the bunch]."""
    eight, lane = -1, LANES - 1
    for k in range(bunch.worlds.shape[0]):
        for _ in range(scene.robots.shape[1]):
            eight, lane = (eight, lane + 1) if lane < LANES - 1 else (eight + 1, 0)
            bunch.robots[eight].until[lane:] = until[k]


@inlined
def whose(scene: Any, place: Any) -> Any:
    """Return the world of the bunch, and the robot in it, whose place among the lanes this is."""
    robot_count = scene.robots.shape[1]
    return place // robot_count, place % robot_count


@spliced
def robot_in(scene: Any, bunch: Any, k: Any, number: Any) -> Any:
    """Return a robot of a world of the bunch as it is in its lane, and its record in the scene."""
    place = k * scene.robots.shape[1] + number
    eight = open_record8(bunch.robots[place // LANES])
    return one_of(eight, place % LANES), scene.robots[bunch.worlds[k], number]


@inlined
def place_of(scene: Any, bunch: Any, k: Any, disc: Any) -> Any:
    """Return the place of a disc in a world of the bunch, and its radius [mm]."""
    robot_count = scene.robots.shape[1]
    if disc < robot_count:
        place = k * robot_count + disc
        its = one_of(open_record8(bunch.kinds[place // LANES]), place % LANES)
        one, _ = robot_in(scene, bunch, k, disc)
        return one.x_mm, one.y_mm, its.radius_mm
    return disc_at(scene, bunch.worlds[k], disc)


@kernel
def show_places(scene: Any, bunch: Any, k: Any) -> Any:
    """Write the poses of a world's robots to the scene."""
    for number in range(scene.robots.shape[1]):
        one, robot = robot_in(scene, bunch, k, number)
        copy_pose(one, robot)


@kernel
def note_ways(scene: Any, bunch: Any, k: Any, longest_mm: Any) -> Any:
    """Note how far the things of a world have moved in this tick, its robots at most so far [mm]."""
    world, room, body_count = bunch.worlds[k], bunch.room, scene.bodies.shape[1]
    # Squares of the two longest ways.
    longest = longest_mm * longest_mm
    second = longest if scene.robots.shape[1] > 1 else 0.0
    for place in range(room.awake_counts[k]):
        square = square_of_move(scene.bodies[world, room.awake[body_count * k + place]])
        longest, second = max(longest, square), max(second, min(longest, square))
    note_moves(scene, world, math.sqrt(longest), math.sqrt(second))


@inlined
def square_of_move(thing: Any) -> Any:
    """Return the square of how far a body, or robots, have moved since the last tick boundary [mm^2]."""
    dx, dy = thing.x_mm - thing.trail[0, 0], thing.y_mm - thing.trail[0, 1]
    return dx * dx + dy * dy


@kernel
def show_tracks(scene: Any, bunch: Any) -> Any:
    """Write the robots' present and past poses to the scene, for sensors."""
    for k in range(bunch.worlds.shape[0]):
        for number in range(scene.robots.shape[1]):
            one, robot = robot_in(scene, bunch, k, number)
            copy_pose(one, robot)
            for ago in range(TRAIL_LENGTH):
                for axis in range(3):
                    robot.trail[ago, axis] = one.trail[ago, axis]


@kernel
def show_robot(scene: Any, bunch: Any, k: Any, number: Any) -> Any:
    """Write all that moves in a robot of a world of the bunch to the scene."""
    place = k * scene.robots.shape[1] + number
    store_lane(bunch.robots[place // LANES], place % LANES, scene.robots[bunch.worlds[k], number])


@kernel
def take_robot(scene: Any, bunch: Any, k: Any, number: Any) -> Any:
    """Take all that moves in a robot of a world of the bunch from the scene, where something has changed it."""
    place = k * scene.robots.shape[1] + number
    load_lane(bunch.robots[place // LANES], place % LANES, scene.robots[bunch.worlds[k], number])


@inlined
def copy_pose(source: Any, target: Any) -> Any:
    """Copy the pose of a robot."""
    target.x_mm, target.y_mm, target.heading_rad = source.x_mm, source.y_mm, source.heading_rad


@inlined
def copy_motion(source: Any, target: Any) -> Any:
    """Copy what a collision changes of a robot."""
    copy_pose(source, target)
    target.forwards_mm, target.backwards_mm = source.forwards_mm, source.backwards_mm
    for wheel in range(2):
        target.wheel_pulses[wheel] = source.wheel_pulses[wheel]
        target.slip_pulses[wheel] = source.slip_pulses[wheel]
