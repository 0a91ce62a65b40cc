"""A robot and the body that its gripper holds on the floor, in collisions (`kiks.engine.physics.collisions`).

The two are one rigid body: equal masses, and the robot turns as in `kiks.engine.physics.contact`. Derivation: let r
lead from the robot to the place where it holds the body, e be the body's deviation from it, and k the radius of
gyration. An impulse p moves the body by -p and the robot by p, which also turns by (r x p)/k^2. That cancels e if p =
e/2 along r, and p = e/(2 + r^2/k^2) across.

So a hold is one more constraint that each sweep of `resolve_overlaps` enforces, after the overlaps: a push on either
moves both, and if both are blocked, the sweeps find that.
"""

from __future__ import annotations

import math
from typing import Any

from kiks.engine.compiling import kernel
from kiks.engine.numbers import sin_cos
from kiks.engine.physics.contact import clearance_mm, slope
from kiks.engine.physics.motion import between_nought_and

REACH = 3.0
"""Longest path of a held body, in paths of the faster wheel: it is 72 mm from the middle of wheels 53 mm apart."""

SETTLED_MM = 1e-9


@kernel
def held_place(robot: Any, body: Any) -> Any:
    """Return the place at which a robot holds a body [mm]."""
    sine, cosine = sin_cos(robot.heading_rad)
    ahead, aside = body.hold_ahead_mm, body.hold_aside_mm
    return robot.x_mm + ahead * cosine - aside * sine, robot.y_mm + ahead * sine + aside * cosine


@kernel
def is_dragged(body: Any) -> Any:
    """Return whether a body is held on the floor."""
    return body.holder != 0 and body.is_lifted == 0


@kernel
def carry_along(scene: Any, world: Any, room: Any, duration_s: Any) -> Any:
    """Move held bodies with their robots by one piece, without regard to obstacles, and set their speeds."""
    robots, bodies = scene.robots, scene.bodies
    for row in range(bodies.shape[1]):
        body = bodies[world, row]
        if is_dragged(body):
            robot = robots[world, body.holder - 1]
            robot.piece_headings[1] = robot.heading_rad
            disc = robots.shape[1] + row
            body.x_mm, body.y_mm = held_place(robot, body)
            body.velocity_x = (body.x_mm - room.discs[disc].start_x) / duration_s
            body.velocity_y = (body.y_mm - room.discs[disc].start_y) / duration_s


@kernel
def enforce_holds(scene: Any, world: Any, room: Any) -> Any:
    """Bring robots and held bodies together again after pushes; return the largest deviation [mm]."""
    robots, bodies, kinds = scene.robots, scene.bodies, scene.kinds
    worst = 0.0
    for row in range(bodies.shape[1]):
        body = bodies[world, row]
        if not is_dragged(body):
            continue
        body.velocity_x = body.velocity_y = 0.0
        robot = robots[world, body.holder - 1]
        # The walls come first: what is left of the deviation then turns and moves the robot.
        depth = body.radius_mm - clearance_mm(scene.ground, body.x_mm, body.y_mm)
        if depth > 0.0:
            nx, ny, _ = slope(scene.ground, body.x_mm, body.y_mm)
            body.x_mm += depth * nx
            body.y_mm += depth * ny
        error = pull_together(robot, kinds[robot.kind], body)
        if error > SETTLED_MM:
            room.discs[body.holder - 1].is_touching = True
            room.discs[body.holder - 1].is_pushed = room.discs[robots.shape[1] + row].is_pushed = True
            worst = max(worst, error)
    return worst


@kernel
def pull_together(robot: Any, parameters: Any, body: Any) -> Any:
    """Share a held body's deviation from its place between it and the robot; return the deviation [mm]."""
    x, y = held_place(robot, body)
    dx, dy = body.x_mm - x, body.y_mm - y
    error = math.sqrt(dx * dx + dy * dy)
    if error <= SETTLED_MM:
        return error
    rx, ry = x - robot.x_mm, y - robot.y_mm
    length = math.sqrt(rx * rx + ry * ry)
    ux, uy = rx / length, ry / length
    gyration = 0.5 * parameters.wheel_base_mm
    leverage = length / gyration
    along = 0.5 * (dx * ux + dy * uy)
    across = (dy * ux - dx * uy) / (2.0 + leverage * leverage)
    px, py = along * ux - across * uy, along * uy + across * ux
    robot.x_mm += px
    robot.y_mm += py
    robot.heading_rad += across * leverage / gyration
    body.x_mm -= px
    body.y_mm -= py
    return error


@kernel
def return_held(scene: Any, world: Any, room: Any, stuck_mm: Any) -> Any:
    """Return robots with held bodies to where the piece began, if one of the two has returned or they are apart.

    Returns:
        Whether any of them returned.
    """
    robots, bodies = scene.robots, scene.bodies
    has_gone = False
    for row in range(bodies.shape[1]):
        body = bodies[world, row]
        if not is_dragged(body):
            continue
        number, disc = body.holder - 1, robots.shape[1] + row
        robot = robots[world, number]
        x, y = held_place(robot, body)
        dx, dy = body.x_mm - x, body.y_mm - y
        is_back = room.discs[number].is_back and room.discs[disc].is_back
        # They are one body: one of them alone cannot return.
        if room.discs[number].is_back or room.discs[disc].is_back or dx * dx + dy * dy > stuck_mm * stuck_mm:
            robot.heading_rad = robot.piece_headings[0]
            robot.x_mm, robot.y_mm = room.discs[number].start_x, room.discs[number].start_y
            body.x_mm, body.y_mm = room.discs[disc].start_x, room.discs[disc].start_y
            room.discs[number].is_back = room.discs[disc].is_back = True
            has_gone = has_gone or not is_back
    return has_gone


@kernel
def turn_back(scene: Any, world: Any, room: Any, pieces: Any) -> Any:
    """Correct the wheel counts of robots whose load kept them from turning; a new piece begins.

    As in `kiks.engine.physics.motion.give_way`: a wheel loses at most its path, and turns on by its slip ratio.
    """
    robots, bodies, kinds = scene.robots, scene.bodies, scene.kinds
    for row in range(bodies.shape[1]):
        body = bodies[world, row]
        if not is_dragged(body):
            continue
        number = body.holder - 1
        robot = robots[world, number]
        parameters = kinds[robot.kind]
        turn = robot.heading_rad - robot.piece_headings[1]
        rim = 0.5 * turn * parameters.wheel_base_mm / parameters.pulse_mm
        sine, cosine = sin_cos(robot.heading_rad)
        disc = room.discs[number]
        dx, dy = robot.x_mm - disc.moved_x, robot.y_mm - disc.moved_y
        pushed = (dx * cosine + dy * sine) / parameters.pulse_mm
        for wheel in range(2):
            path = (disc.left if wheel == 0 else disc.right) / pieces
            gone = between_nought_and(path, -pushed)  # the loss that `give_way` has counted
            lost = between_nought_and(path, gone + (rim if wheel == 0 else -rim)) - gone
            robot.wheel_pulses[wheel] -= (1.0 - disc.slip_ratio) * lost
            robot.slip_pulses[wheel] += (1.0 - disc.slip_ratio) * lost
        robot.piece_headings[0] = robot.heading_rad


@kernel
def carry_lifted(scene: Any, world: Any) -> Any:
    """Phase: move lifted bodies with their robots."""
    robots, bodies = scene.robots, scene.bodies
    for row in range(bodies.shape[1]):
        body = bodies[world, row]
        if body.holder != 0 and body.is_lifted != 0:
            body.x_mm, body.y_mm = held_place(robots[world, body.holder - 1], body)
