"""One tick of the world, 10 ms of it, as a list of phases."""

from __future__ import annotations

from typing import Any

from numba import types

from kiks.engine.bunch import (
    BUNCH,
    copy_motion,
    give_back,
    make_lanes,
    make_room,
    note_ways,
    set_end,
    show_places,
    square_of_move,
    take,
    whose,
)
from kiks.engine.compiling import entry, inlined, kernel, linked
from kiks.engine.meeting import meet_others
from kiks.engine.physics.grasp import carry_lifted
from kiks.engine.physics.motion import move, note_contact, remember_pose, room_left, room_of
from kiks.engine.physics.motor import control_motors, latch_encoders, turn_motors
from kiks.engine.scene import OPEN_SCENE, open_scene
from kiks.engine.simd.lanes import LANES, greatest, load, root, wide
from kiks.engine.simd.masks import anywhere, everywhere, holds, opposite
from kiks.engine.simd.records import copy_lanes, copy_record8, one_of, open_record8
from kiks.engine.simd.stack_arrays import stack_integers


@entry
def advance(scene: Any, tick: Any, tick_count: Any) -> Any:
    """Let time pass in the first world of a scene.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`); its world is changed.
        tick: Number of the first tick.
        tick_count: Ticks to do.
    """
    scene = open_scene(scene[0])
    advance_world(scene, tick, tick_count, make_lanes(scene.robots.shape[1]), make_room(scene, 1))


@kernel
def advance_world(scene: Any, tick: Any, tick_count: Any, lanes: Any, room: Any) -> Any:
    """Let time pass in the first world of an open scene; memory as for `kiks.engine.bunch.take`."""
    worlds, ticks, until = stack_integers(1), stack_integers(1), stack_integers(1)
    worlds[0], ticks[0], until[0] = 0, tick, tick + tick_count
    bunch = take(scene, worlds, ticks, lanes, room)
    advance_bunch(scene, bunch, until)
    give_back(scene, bunch)


@linked(types.void(OPEN_SCENE, BUNCH, types.int64[::1]))
def advance_bunch(scene: Any, bunch: Any, until: Any) -> Any:
    """Let time pass in the worlds of a bunch.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        bunch: The bunch (`kiks.engine.bunch`).
        until: The tick that each of its worlds is to reach, int64; a world that has reached it does no tick.
    """
    set_end(scene, bunch, until)
    while True:
        is_any, wheels_mm = turn_wheels(bunch)
        # A world without a robot is alone in its bunch.
        if not is_any and (bunch.robots.shape[0] > 0 or bunch.ticks[0] >= until[0]):
            break
        if bunch.has_company or bunch.has_grippers:
            meet_others(scene, bunch, until, wheels_mm)
        longest_mm = move_freely(scene, bunch)
        for k in range(until.shape[0]):
            if bunch.ticks[k] < until[k]:
                if bunch.has_company:
                    note_ways(scene, bunch, k, longest_mm)
                if bunch.has_grippers:
                    show_places(scene, bunch, k)
                    carry_lifted(scene, bunch.worlds[k])
                bunch.ticks[k] += 1


@inlined
def turn_wheels(bunch: Any) -> Any:
    """Phases: the motors of all robots turn their wheels.

    Returns:
        Whether any robot has a tick to do; the longest way of a wheel in it [mm].
    """
    is_any, longest = False, wide(0.0)
    for place in range(bunch.robots.shape[0]):
        eight, parameters = open_record8(bunch.robots[place]), open_record8(bunch.kinds[place])
        is_due = eight.tick_count < eight.until
        if anywhere(is_due):
            is_any = True
            # Some finish a tick or two before the others: restoring them costs less than masking each operation.
            if not everywhere(is_due):
                copy_record8(eight, open_record8(bunch.before[place]))
            remember_pose(eight)
            latch_encoders(eight)
            control_motors(eight, parameters)
            left, right = turn_motors(eight, parameters, 0), turn_motors(eight, parameters, 1)
            eight.left_pulses, eight.right_pulses = left, right
            eight.way_mm = max(abs(left), abs(right)) * parameters.pulse_mm
            longest = max(longest, eight.way_mm)
    return is_any, greatest(longest)


@inlined
def move_freely(scene: Any, bunch: Any) -> Any:
    """Phases: the robots that can touch nothing but walls move; the contacts of all are counted.

    Returns:
        The longest way of a robot [mm].
    """
    longest = wide(0.0)  # its square
    for place in range(bunch.robots.shape[0]):
        eight, parameters = open_record8(bunch.robots[place]), open_record8(bunch.kinds[place])
        is_due = eight.tick_count < eight.until
        if not anywhere(is_due):
            continue
        chance = load(bunch.seeds[LANES * place :]), eight.number, eight.tick_count
        is_near = eight.is_near > 0.0
        # Those that have met others move, too, and then get back where collisions have brought them.
        room_mm = room_of(scene.ground, eight, parameters, eight.way_mm, eight.room_mm)
        is_touching = move(scene.ground, eight, parameters, eight.left_pulses, eight.right_pulses, room_mm, chance)
        if anywhere(is_near):
            for lane in range(LANES):
                if holds(is_near, lane):
                    k, number = whose(scene, LANES * place + lane)
                    copy_motion(scene.robots[bunch.worlds[k], number], one_of(eight, lane))
            is_touching = (is_near & (eight.is_touching_discs > 0.0)) | (opposite(is_near) & is_touching)
            eight.is_near = 0.0
        eight.room_mm = room_left(room_mm, eight.x_mm - eight.trail[0, 0], eight.y_mm - eight.trail[0, 1])
        longest = max(longest, square_of_move(eight))
        note_contact(eight, is_touching)
        eight.tick_count = eight.tick_count + 1.0
        if not everywhere(is_due):
            copy_lanes(open_record8(bunch.before[place]), eight, opposite(is_due))
    return root(greatest(longest))
