"""One tick of the world, 10 ms of it, as a list of phases."""

from __future__ import annotations

from typing import Any

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.physics.balls import remember_place
from kiks.engine.physics.collisions import make_room, move_together
from kiks.engine.physics.grasp import carry_lifted
from kiks.engine.physics.gripper import move_gripper, tend_grippers
from kiks.engine.physics.motion import draw_slip, move, note_contact, remember_pose
from kiks.engine.physics.motor import control_motors, latch_encoders, turn_motors
from kiks.engine.scene import count_discs, enter_all
from kiks.engine.simd.masks import anywhere, everywhere, opposite
from kiks.engine.simd.records import (
    EIGHT,
    copy_lanes,
    copy_record8,
    only,
    open_record8,
    stack_record,
)


@entry
def advance(scene: Any, ground: Any, seed: Any, tick: Any, tick_count: Any) -> Any:
    """Let time pass.

    Args:
        scene: The scene (`kiks.engine.scene`); changed in place.
        ground: Distance of cells to the nearest wall [mm], shape [rows, columns]; edge of a cell [mm]; cells of the
            border around the arena.
        seed: Seed of the run.
        tick: Number of the first tick.
        tick_count: Ticks to do.
    """
    for world in range(scene[0].shape[0]):
        if count_discs(scene)[1] == 1:
            advance_one(scene, ground, seed, world, tick, tick_count)
        else:
            advance_many(scene, ground, seed, world, tick, tick_count)


@kernel
def advance_one(scene: Any, ground: Any, seed: Any, world: Any, tick: Any, tick_count: Any) -> Any:
    """Let time pass in a world with one robot and nothing else."""
    robot = scene[0][world, 0]
    parameters = scene[2][robot.kind]
    for now in range(tick, tick + tick_count):
        advance_alone(robot, parameters, ground, (seed, world, 0, now))


@inlined
def advance_alone(robot: Any, parameters: Any, ground: Any, chance: Any) -> Any:
    """Let a tick pass for a lone robot, or for eight, each in its own world."""
    field, cell, pad = ground
    left, right = turn_wheels(robot, parameters)
    has_gripper = robot.has_gripper != 0
    if anywhere(has_gripper):
        move_gripper(only(robot, has_gripper), 0.0)
    is_touching = move(field, cell, pad, robot, parameters, left, right, chance)
    note_contact(robot, is_touching)


@kernel
def advance_eight(eight: Any, parameters: Any, ground: Any, seeds: Any, until: Any) -> Any:
    """Let time pass in eight worlds of one robot each.

    Args:
        eight: The robots, a `Record8` of `EIGHT`.
        parameters: Their constants, a `Record8` of `EIGHT_KINDS`.
        ground: The arena, as in `advance`.
        seeds: Seeds of the eight worlds, `Words`; each is the first world of its seed.
        until: Final tick number of each world, `Lanes`; a world that has reached it does no tick.
    """
    before = open_record8(stack_record(EIGHT))
    while True:
        now = eight.tick_count
        is_due = now < until
        if not anywhere(is_due):
            break
        # Some finish a tick or two before the others: restoring them costs less than masking each operation.
        if not everywhere(is_due):
            copy_record8(eight, before)
        advance_alone(eight, parameters, ground, (seeds, 0, 0, now))
        eight.tick_count = now + 1.0
        if not everywhere(is_due):
            copy_lanes(before, eight, opposite(is_due))


@kernel
def advance_many(scene: Any, ground: Any, seed: Any, world: Any, tick: Any, tick_count: Any) -> Any:
    """Let time pass in a world with several discs."""
    robots, bodies, kinds, _ = scene
    room = make_room(scene)
    neighbour_count, slack_mm = 0, -1.0
    for now in range(tick, tick + tick_count):
        for number in range(robots.shape[1]):
            robot = robots[world, number]
            parameters = kinds[robot.kind]
            room.ways[number, 0], room.ways[number, 1] = turn_wheels(robot, parameters)
            room.ways[number, 2] = draw_slip(parameters, seed, world, number, now)
        for number in range(bodies.shape[1]):
            remember_place(bodies[world, number])
        if tend_grippers(scene, ground, world):
            slack_mm = -1.0
        neighbour_count, slack_mm = move_together(scene, ground, world, room, neighbour_count, slack_mm)
        carry_lifted(scene, world)
    enter_all(scene, world)


@inlined
def turn_wheels(robot: Any, parameters: Any) -> Any:
    """Do the phases of a robot before it moves; return the paths of its wheels [pulses]."""
    remember_pose(robot)
    latch_encoders(robot)
    control_motors(robot, parameters)
    return turn_motors(robot, parameters, 0), turn_motors(robot, parameters, 1)
