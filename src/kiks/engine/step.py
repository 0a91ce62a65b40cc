"""One tick of the world, 10 ms of it, as a list of phases."""

from __future__ import annotations

from typing import Any

from kiks.engine.bodies import remember_place
from kiks.engine.company import make_room, move_alone, move_together
from kiks.engine.compiling import entry, kernel
from kiks.engine.gripper import move_gripper, tend_grippers
from kiks.engine.hold import carry_lifted
from kiks.engine.motion import note_contact, remember_pose
from kiks.engine.motor import control_motors, latch_encoders, turn_motors
from kiks.engine.numbers import uniform
from kiks.engine.proximity import STREAM_SLIP
from kiks.engine.scene import count_discs, enter_all


@entry
def advance(scene: Any, ground: Any, seed: Any, tick: Any, tick_count: Any) -> Any:
    """Let time pass.

    Args:
        scene: What there is (`kiks.engine.scene`); changed in place.
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
    """Let time pass in a world of one robot: what is below, without company."""
    for now in range(tick, tick + tick_count):
        left, right, slip_ratio = turn_wheels(scene, seed, world, 0, now)
        if scene[0][world, 0].has_gripper != 0:
            move_gripper(scene[0][world, 0], 0.0)
        is_touching = move_alone(scene, ground, world, 0, left, right, slip_ratio)
        note_contact(scene[0][world, 0], is_touching)


@kernel
def advance_many(scene: Any, ground: Any, seed: Any, world: Any, tick: Any, tick_count: Any) -> Any:
    """Let time pass in a world of several things."""
    robots, bodies, _, _ = scene
    room = make_room(scene)
    neighbour_count, slack_mm = 0, -1.0
    for now in range(tick, tick + tick_count):
        for number in range(robots.shape[1]):
            left, right, slip_ratio = turn_wheels(scene, seed, world, number, now)
            room.ways[number, 0], room.ways[number, 1], room.ways[number, 2] = left, right, slip_ratio
        for number in range(bodies.shape[1]):
            remember_place(bodies[world, number])
        if tend_grippers(scene, ground, world):
            slack_mm = -1.0
        neighbour_count, slack_mm = move_together(scene, ground, world, room, neighbour_count, slack_mm)
        carry_lifted(scene, world)
    enter_all(scene, world)


@kernel
def turn_wheels(scene: Any, seed: Any, world: Any, number: Any, now: Any) -> Any:
    """Phases of a robot before it moves; return the paths of its wheels [pulses] and their slip ratio, if blocked."""
    robots, _, kinds, _ = scene
    robot = robots[world, number]
    parameters = kinds[robot.kind]
    remember_pose(robot)
    latch_encoders(robot)
    control_motors(robot, parameters)
    left = turn_motors(robot, parameters, 0)
    right = turn_motors(robot, parameters, 1)
    drawn = uniform(seed, world, number, STREAM_SLIP, now, 0)
    return left, right, parameters.slip_ratio_min + drawn * (parameters.slip_ratio_max - parameters.slip_ratio_min)
