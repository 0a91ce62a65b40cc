"""The gripper: arm, jaws, and the ball or cylinder that they hold.

Source: kiks-behaviour.md 3.5 (jaws 37 mm long, half gap 0.5 + 27 mm * opening/200) and khepera-protocol.md 10.2 (arm
255 down in front, 127 upright, 0 folded back, a full swing in about 1 s). The sources leave some points open; KiKS
assumes:

* the jaws begin at the robot's rim; arm and jaws do not collide with anything, only the held body does;
* the arm is down from 215 on: a robot's programs lift to 190 or less and put down at 240 (10.2);
* the jaws close in half a second.

The gripper grips a body when its arm is down and its closing jaws touch the body: the body's centre is between them, it
fits between them, and no other gripper holds it. The jaws then move it to their middle and stop at its width.

On the floor, the held body and the robot are one rigid body (`kiks.engine.physics.grasp`). A lifted body is a disc in
front of the robot that collides with nothing and that no sensor sees. It comes down only where the floor is free;
elsewhere the arm stays above the floor and open jaws wait. So no body ends inside another. If the jaws open when its
centre is beyond the edge of the arena, it falls outside: it stays where it is for good, lifted and without a holder.
"""

from __future__ import annotations

import math
from typing import Any

from kiks.engine.compiling import entry, kernel
from kiks.engine.grid import count_discs, disc_at, is_on_floor
from kiks.engine.numbers import sin_cos
from kiks.engine.physics.contact import clearance_mm
from kiks.engine.physics.grasp import held_place
from kiks.engine.scene import open_scene
from kiks.engine.simd.masks import choose

ARM_MAX = 255.0
"""The arm down in front (khepera-protocol.md 10.2)."""

ARM_START = 127.0
"""The arm at power-on: upright (kiks-behaviour.md 3.5)."""

BARRIER_BROKEN = 255
"""What the light barrier between the jaws reads with something in it; clients take less than 100 for nothing (10.2)."""

ARM_DOWN = 215.0
"""From here on, a body between the jaws stands on the floor."""

ARM_STEP = 2.55
"""Step of the arm per tick: a full swing takes 1 s (khepera-protocol.md 10.2)."""

JAWS_MAX = 200.0
"""The jaws fully open (kiks-behaviour.md 3.5)."""

JAWS_STEP = 4.0
"""Step of the jaws per tick: from open to closed in 0.5 s."""

JAW_LENGTH_MM = 37.0
"""Length of the jaws [mm] (kiks-behaviour.md 3.5)."""

GAP_MM, GAP_PER_STEP = 0.5, 27.0 / 200.0
"""Half the gap between the closed jaws [mm], and its growth per step of their opening (kiks-behaviour.md 3.5)."""

LOOSE_MM = 0.5
"""Deviation from the held place at which a body counts as moved away [mm]."""

FREE_MM = 0.01
"""Overlap with which a body may come down [mm], as `kiks.sim.world` allows it."""

GAP_TO_ROBOT_MM = 0.02
"""Least gap between a robot and what it holds [mm]."""


@kernel
def half_gap_mm(jaws: Any) -> Any:
    """Return the distance of each jaw from the middle [mm]."""
    return GAP_MM + GAP_PER_STEP * jaws


@kernel
def move_arm(robot: Any) -> Any:
    """Move the arm by one tick."""
    robot.arm += min(max(robot.arm_target - robot.arm, -ARM_STEP), ARM_STEP)


@kernel
def move_gripper(robot: Any, least_jaws: Any) -> Any:
    """Phase: move arm and jaws by one tick; the jaws stop at a width."""
    move_arm(robot)
    target = choose(robot.is_closing != 0, least_jaws, JAWS_MAX)
    robot.jaws += min(max(target - robot.jaws, -JAWS_STEP), JAWS_STEP)


@kernel
def move_grippers(scene: Any, world: Any) -> Any:
    """Phase: move all grippers; grip, lift, put down and let go. Return whether any body changed holder or level."""
    robots, bodies = scene.robots, scene.bodies
    has_any = False
    for number in range(robots.shape[1]):
        robots[world, number].held_row = 0
        has_any = has_any or robots[world, number].has_gripper != 0
    # Without a gripper no body is held: none need be looked at.
    if not has_any:
        return False
    has_changed = False
    for row in range(bodies.shape[1]):
        holder = bodies[world, row].holder
        if holder > 0:
            if not is_in_its_place(scene, world, row) and put_down(scene, world, row):
                has_changed = True
            else:
                robots[world, holder - 1].held_row = row + 1
    for number in range(robots.shape[1]):
        robot = robots[world, number]
        if robot.has_gripper == 0:
            continue
        if robot.held_row > 0:
            has_changed = move_holding_gripper(scene, world, number) or has_changed
        else:
            before = half_gap_mm(robot.jaws)
            move_gripper(robot, 0.0)
            if robot.arm >= ARM_DOWN and half_gap_mm(robot.jaws) < before:
                has_changed = grip(scene, world, number, before) or has_changed
    return has_changed


@kernel
def move_holding_gripper(scene: Any, world: Any, number: Any) -> Any:
    """Move a gripper that holds a body; return whether the body was let go, lifted or put on the floor."""
    robot = scene.robots[world, number]
    body = scene.bodies[world, robot.held_row - 1]
    row = robot.held_row - 1
    # Open jaws let go at once, unless there is no room for the body below.
    if robot.is_closing == 0 and put_down(scene, world, row):
        robot.held_row = 0
        move_gripper(robot, 0.0)
        return True
    width = (body.radius_mm - GAP_MM) / GAP_PER_STEP
    is_waiting = robot.is_closing == 0
    robot.jaws = max(robot.jaws, width)
    arm = robot.arm
    if is_waiting:  # the floor below is not free: the jaws stay as they are
        move_arm(robot)
    else:
        move_gripper(robot, width)
        centre(scene, world, number, body)
    if robot.arm < ARM_DOWN:
        has_changed = body.is_lifted == 0
        body.is_lifted = 1
        return has_changed
    if body.is_lifted == 0:
        return False
    if is_free(scene, world, row):
        body.is_lifted = 0
        return True
    # No room below: the arm waits a step above the floor, and tries again in the next tick.
    robot.arm = min(arm, ARM_DOWN - ARM_STEP)
    return False


@kernel
def centre(scene: Any, world: Any, number: Any, body: Any) -> Any:
    """Let closing jaws move the held body to their middle, without pushing it into the robot."""
    robot = scene.robots[world, number]
    most = max(half_gap_mm(robot.jaws) - body.radius_mm, 0.0)
    body.hold_aside_mm = min(max(body.hold_aside_mm, -most), most)
    apart = scene.kinds[robot.kind].radius_mm + body.radius_mm + GAP_TO_ROBOT_MM
    # The nearest place ahead, at this distance aside, at which robot and body do not overlap.
    square = apart * apart - body.hold_aside_mm * body.hold_aside_mm
    body.hold_ahead_mm = max(body.hold_ahead_mm, math.sqrt(square))


@kernel
def from_robot(robot: Any, body: Any) -> Any:
    """Return the place of a body relative to a robot: ahead and to the left of its centre [mm]."""
    sine, cosine = sin_cos(robot.heading_rad)
    dx, dy = body.x_mm - robot.x_mm, body.y_mm - robot.y_mm
    return dx * cosine + dy * sine, dy * cosine - dx * sine


@kernel
def is_between_jaws(robot: Any, parameters: Any, body: Any) -> Any:
    """Return whether a loose body in the arena has its centre where a robot's jaws are when the arm is down."""
    ahead, aside = from_robot(robot, body)
    begin = parameters.radius_mm
    is_loose = body.holder == 0 and body.is_lifted == 0
    return is_loose and begin <= ahead <= begin + JAW_LENGTH_MM and abs(aside) <= half_gap_mm(robot.jaws)


@kernel
def grip(scene: Any, world: Any, number: Any, half_gap_before: Any) -> Any:
    """Grip the first body that the jaws have touched in this tick; return whether there was one."""
    robots, bodies, kinds = scene.robots, scene.bodies, scene.kinds
    robot = robots[world, number]
    for row in range(bodies.shape[1]):
        body = bodies[world, row]
        if not is_between_jaws(robot, kinds[robot.kind], body):
            continue
        ahead, aside = from_robot(robot, body)
        # It may have come nearer to a jaw in the last tick, too.
        if half_gap_mm(robot.jaws) <= abs(aside) + body.radius_mm <= half_gap_before + LOOSE_MM:
            body.holder = number + 1
            body.hold_ahead_mm, body.hold_aside_mm = ahead, aside
            body.velocity_x = body.velocity_y = 0.0
            robot.held_row = row + 1
            return True
    return False


@kernel
def is_in_its_place(scene: Any, world: Any, row: Any) -> Any:
    """Return whether a held body is where its gripper holds it."""
    robots, bodies = scene.robots, scene.bodies
    body = bodies[world, row]
    robot = robots[world, body.holder - 1]
    if robot.has_gripper == 0:
        return False
    x, y = held_place(robot, body)
    # A hand may have moved the robot: a lifted body comes along, one on the floor is left behind.
    if body.is_lifted != 0:
        body.x_mm, body.y_mm = x, y
    dx, dy = body.x_mm - x, body.y_mm - y
    return dx * dx + dy * dy < LOOSE_MM * LOOSE_MM


@kernel
def put_down(scene: Any, world: Any, row: Any) -> Any:
    """Let a held body go, at rest; return False if the floor is not free. Beyond the edge it leaves the arena."""
    body = scene.bodies[world, row]
    is_out = body.is_lifted != 0 and is_beyond(scene.ground, body.x_mm, body.y_mm)
    if body.is_lifted != 0 and not is_out and not is_free(scene, world, row):
        return False
    body.holder, body.is_lifted = 0, is_out
    body.velocity_x = body.velocity_y = 0.0
    return True


@kernel
def is_beyond(ground: Any, x_mm: Any, y_mm: Any) -> Any:
    """Return whether a place is beyond the edge of the arena."""
    rows, columns = ground.clearance.shape
    width_mm, height_mm = (columns - 2 * ground.pad) * ground.cell_mm, (rows - 2 * ground.pad) * ground.cell_mm
    return x_mm < 0.0 or x_mm > width_mm or y_mm < 0.0 or y_mm > height_mm


@kernel
def is_free(scene: Any, world: Any, row: Any) -> Any:
    """Return whether the floor under a lifted body is free."""
    robot_count, disc_count = count_discs(scene)
    x, y, radius = disc_at(scene, world, robot_count + row)
    if clearance_mm(scene.ground, x, y) < radius - FREE_MM:
        return False
    for disc in range(disc_count):
        if disc != robot_count + row and is_on_floor(scene, world, disc):
            other_x, other_y, other_radius = disc_at(scene, world, disc)
            dx, dy, apart = other_x - x, other_y - y, radius + other_radius - FREE_MM
            if dx * dx + dy * dy < apart * apart:
                return False
    return True


@kernel
def find_between(scene: Any, world: Any, number: Any) -> Any:
    """Return the row of the body that a robot's gripper holds or has between its jaws, from 0; -1 for none."""
    robots, bodies, kinds = scene.robots, scene.bodies, scene.kinds
    robot = robots[world, number]
    found = -1
    for row in range(bodies.shape[1]):
        body = bodies[world, row]
        if body.holder == number + 1:
            return row
        if robot.arm >= ARM_DOWN and found < 0 and is_between_jaws(robot, kinds[robot.kind], body):
            found = row
    return found


# ---- for Python ----


@entry
def find_object(scene: Any, number: Any) -> Any:
    """Call `find_between` for the first world of a scene."""
    return find_between(open_scene(scene[0]), 0, number)
