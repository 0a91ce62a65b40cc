"""What a tick is for things that may meet: grippers and collisions. A lone robot without a gripper needs none of it."""

from __future__ import annotations

from typing import Any

from numba import types

from kiks.engine.bunch import BUNCH, copy_motion, robot_in, wake_all
from kiks.engine.compiling import inlined, linked
from kiks.engine.physics.collisions import collide_near_things, find_near_things, remember_places
from kiks.engine.physics.gripper import move_grippers
from kiks.engine.scene import MEETING, OPEN_SCENE


@linked(types.void(OPEN_SCENE, BUNCH, types.int64[::1], types.float64), part=MEETING)
def meet_others(scene: Any, bunch: Any, until: Any, wheels_mm: Any) -> Any:
    """Do the phases of `meet` in the worlds that have a tick to do."""
    for k in range(until.shape[0]):
        if bunch.ticks[k] < until[k]:
            meet(scene, bunch, k, wheels_mm)


@inlined
def meet(scene: Any, bunch: Any, k: Any, wheels_mm: Any) -> Any:
    """Phases: grippers move, and the things of a world that may collide move; the other robots have not moved yet."""
    world, room = bunch.worlds[k], bunch.room
    remember_places(scene, world, room, k)
    if bunch.has_grippers and move_grippers(scene, world):
        # A body that was lifted or put down has no pairs yet: they are listed again, and all bodies wake.
        scene.grid.crowds[world].slack_mm = -1.0
        wake_all(scene, room, k)
    near_count, pair_count, longest_mm = find_near_things(scene, bunch, k, wheels_mm)
    robot_count = scene.robots.shape[1]
    # Collisions work on the records of the scene, which lag behind the lanes; only near robots are copied there.
    for place in range(near_count):
        if room.near[place] < robot_count:
            one, robot = robot_in(scene, bunch, k, room.near[place])
            copy_motion(one, robot)
    if near_count > 0:
        collide_near_things(scene, world, room, near_count, pair_count, longest_mm)
    for place in range(near_count):
        if room.near[place] < robot_count:
            one, _ = robot_in(scene, bunch, k, room.near[place])
            one.is_near, one.is_touching_discs = 1.0, room.discs[room.near[place]].is_touching
