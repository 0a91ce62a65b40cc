"""Balls and cylinders: rolling, bouncing off walls, and passing on speed.

Source of the constants: kiks-behaviour.md 3.6. All masses are equal; a kick does not slow the robot.

* Friction decelerates a body by `friction_mm_s2` until it rests.
* Off a wall or a standing robot, the normal speed is reflected times 0.25.
* Two bodies share their speeds along the line of their centres: u = ((1 - e) u + (1 + e) v)/2 and v likewise, with
  e = 0.95. That keeps their momentum and never adds energy.
* A robot that runs into a body at the speed V gives it 0.975 V; in addition the body's own speed towards the robot is
  reflected times 0.25. Cylinders give way to robots and keep none of that speed (thesis 3.4, "Pushable objects").
"""

from __future__ import annotations

import math
from typing import Any

from kiks.engine.compiling import kernel
from kiks.engine.physics.contact import SETTLED_MM, clearance_mm, push_out, slope

BOUNCE = 0.95
"""Restitution between two bodies."""

WALL_BOUNCE = 0.25
"""Restitution at a wall or a standing robot."""


@kernel
def remember_place(body: Any) -> Any:
    """Phase: store the place at this tick boundary, for sensors that were sampled some milliseconds ago."""
    for k in range(body.trail.shape[0] - 1, 0, -1):
        body.trail[k, 0], body.trail[k, 1] = body.trail[k - 1, 0], body.trail[k - 1, 1]
    body.trail[0, 0], body.trail[0, 1] = body.x_mm, body.y_mm


@kernel
def speed_of(body: Any) -> Any:
    """Return the speed of a body [mm/s]."""
    return math.sqrt(body.velocity_x * body.velocity_x + body.velocity_y * body.velocity_y)


@kernel
def roll(ground: Any, body: Any, duration_s: Any) -> Any:
    """Let a body roll or slide with friction, and bounce off a wall."""
    speed = speed_of(body)
    if speed == 0.0:
        return
    slower = max(speed - body.friction_mm_s2 * duration_s, 0.0)
    way = 0.5 * (speed + slower) * duration_s
    # It rests before the time is over: then the way follows from its energy, and not from the mean of its speeds.
    if slower == 0.0 and body.friction_mm_s2 > 0.0:
        way = 0.5 * speed * speed / body.friction_mm_s2
    x, y = body.x_mm, body.y_mm
    wanted_x, wanted_y = x + way * body.velocity_x / speed, y + way * body.velocity_y / speed
    body.velocity_x *= slower / speed
    body.velocity_y *= slower / speed
    if clearance_mm(ground, wanted_x, wanted_y) < body.radius_mm - SETTLED_MM:
        nx, ny, _ = slope(ground, wanted_x, wanted_y)
        wanted_x, wanted_y = push_out(ground, body.radius_mm, x, y, wanted_x, wanted_y)
        towards = body.velocity_x * nx + body.velocity_y * ny
        # A body that rolls along a wall or away from it keeps its speed.
        if towards < 0.0:
            body.velocity_x -= (1.0 + WALL_BOUNCE) * towards * nx
            body.velocity_y -= (1.0 + WALL_BOUNCE) * towards * ny
    body.x_mm, body.y_mm = wanted_x, wanted_y


@kernel
def collide(first: Any, second: Any, nx: Any, ny: Any) -> Any:
    """Exchange speeds of two touching bodies along the line (nx, ny) from the first to the second."""
    u = first.velocity_x * nx + first.velocity_y * ny
    v = second.velocity_x * nx + second.velocity_y * ny
    # They part already: a second hit would pull them back.
    if u <= v:
        return
    passed = 0.5 * (1.0 + BOUNCE) * (u - v)
    first.velocity_x -= passed * nx
    first.velocity_y -= passed * ny
    second.velocity_x += passed * nx
    second.velocity_y += passed * ny


@kernel
def kick(body: Any, robot_speed: Any, nx: Any, ny: Any) -> Any:
    """Change the speed of a body that a robot touches.

    Args:
        body: Record of the body.
        robot_speed: Speed of the robot along the line (nx, ny) from it to the body [mm/s].
        nx: Direction of the line.
        ny: Direction of the line.
    """
    speed = body.velocity_x * nx + body.velocity_y * ny
    if robot_speed > 0.0:
        after = 0.5 * (1.0 + BOUNCE) * body.kick_share * robot_speed - WALL_BOUNCE * min(speed, 0.0)
    else:
        after = robot_speed - WALL_BOUNCE * (speed - robot_speed)
    # A robot never slows a body down: one that is faster runs away from it.
    if after > speed:
        body.velocity_x += (after - speed) * nx
        body.velocity_y += (after - speed) * ny
