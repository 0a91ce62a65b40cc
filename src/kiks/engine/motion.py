"""From the paths of two wheels to a pose: the exact arc, cut into short pieces where a wall is near.

Derivation: with wheel paths l and r [mm] the centre moves s = (l + r)/2 along an arc that turns by q = (r - l)/b. Its
chord has the length s sinc(q/2) and the direction heading + q/2 (khepera-protocol.md 7.3).
"""

from __future__ import annotations

import math
from typing import Any

from kiks.engine.compiling import kernel
from kiks.engine.contact import PIECE_MM, clearance_mm, resolve
from kiks.engine.numbers import sin_cos, sinc

CONTACT_TICKS = 20
"""Ticks without a touch after which a contact is over: what touches again within 0.2 s is the same one."""


@kernel
def remember_pose(robot: Any) -> Any:
    """Phase: keep the pose at this tick boundary, for sensors that were sampled a little while ago."""
    for k in range(robot.trail.shape[0] - 1, 0, -1):
        for axis in range(3):
            robot.trail[k, axis] = robot.trail[k - 1, axis]
    robot.trail[0, 0] = robot.x_mm
    robot.trail[0, 1] = robot.y_mm
    robot.trail[0, 2] = robot.heading_rad


@kernel
def move(field: Any, cell: Any, pad: Any, robot: Any, parameters: Any, left: Any, right: Any, slip_ratio: Any) -> Any:
    """Phase: drive along the arc that the wheels ask for, as far as the walls let it; count what the rims did.

    Args:
        field: Distance of cells to the nearest wall [mm], shape [rows, columns].
        cell: Edge of a cell [mm].
        pad: Cells of the border around the arena.
        robot: Record of the robot.
        parameters: Record of its constants.
        left: Path that the left wheel would make without a wall [pulses].
        right: The same of the right wheel.
        slip_ratio: Share of its command at which a blocked wheel turns.

    Returns:
        Whether it touched a wall.
    """
    pulse = parameters.pulse_mm
    base = parameters.wheel_base_mm
    travel = max(abs(left), abs(right)) * pulse
    pieces = 1
    if clearance_mm(field, cell, pad, robot.x_mm, robot.y_mm) < parameters.radius_mm + travel + 2.0 * cell:
        pieces = math.ceil(travel / PIECE_MM) if travel > PIECE_MM else 1
    arc = 0.5 * (left + right) * pulse / pieces
    turn = (right - left) * pulse / base / pieces
    is_touching = False
    rim_left, rim_right = 0.0, 0.0
    for _ in range(pieces):
        sine, cosine = sin_cos(robot.heading_rad + 0.5 * turn)
        chord = arc * sinc(0.5 * turn)
        u, v, q, touched = resolve(field, cell, pad, robot, parameters, chord * cosine, chord * sine, turn)
        robot.heading_rad += q
        if touched:
            is_touching = True
            # The rim goes with the floor, but for the slip ratio of what it wanted more.
            along = u * cosine + v * sine
            rim_left += slip(along - 0.5 * q * base, left * pulse / pieces, slip_ratio) / pulse
            rim_right += slip(along + 0.5 * q * base, right * pulse / pieces, slip_ratio) / pulse
            count_path(robot, math.sqrt(u * u + v * v) if along > 0.0 else -math.sqrt(u * u + v * v))
        else:
            rim_left += left / pieces
            rim_right += right / pieces
            count_path(robot, arc)
    robot.slip_pulses[0] += left - rim_left
    robot.slip_pulses[1] += right - rim_right
    robot.wheel_pulses[0] += rim_left
    robot.wheel_pulses[1] += rim_right
    return is_touching


@kernel
def count_path(robot: Any, way_mm: Any) -> Any:
    """Add a piece of path to what the robot has driven ahead, or back if it is negative."""
    if way_mm > 0.0:
        robot.forwards_mm += way_mm
    else:
        robot.backwards_mm -= way_mm


@kernel
def note_contact(robot: Any, is_touching: Any) -> Any:
    """Phase: count the contacts; one that lasts counts once, with gaps in it, too.

    A ball that is pushed along runs ahead by hundredths of a millimetre whenever the motors falter.
    """
    if is_touching:
        if robot.is_touching == 0:
            robot.contact_count += 1
        robot.is_touching = CONTACT_TICKS
    elif robot.is_touching > 0:
        robot.is_touching -= 1


@kernel
def between_nought_and(limit: Any, value: Any) -> Any:
    """Return a value, or 0 or the limit if it is beyond one of them."""
    return min(max(value, 0.0), limit) if limit > 0.0 else max(min(value, 0.0), limit)


@kernel
def give_way(robot: Any, parameters: Any, dx: Any, dy: Any, wheels: Any, slip_ratio: Any) -> Any:
    """Let a robot that something has pushed by (dx, dy) [mm] count what its rims did.

    A push brakes the wheels, at most to a stop, and turns none faster: gears of 25:1 cannot be driven from the wheel.

    Args:
        robot: Record of the robot.
        parameters: Record of its constants.
        dx: How far it was pushed [mm].
        dy: How far it was pushed [mm].
        wheels: The paths that its wheels have made [pulses].
        slip_ratio: Share of its command at which a blocked wheel turns.
    """
    sine, cosine = sin_cos(robot.heading_rad)
    pushed = (dx * cosine + dy * sine) / parameters.pulse_mm
    for wheel in range(2):
        path = wheels[wheel]
        lost = between_nought_and(path, -pushed)
        robot.wheel_pulses[wheel] -= (1.0 - slip_ratio) * lost
        robot.slip_pulses[wheel] += (1.0 - slip_ratio) * lost
        # What was counted as driven and was not is taken off again.
        if lost > 0.0:
            robot.forwards_mm -= 0.5 * lost * parameters.pulse_mm
        else:
            robot.backwards_mm += 0.5 * lost * parameters.pulse_mm


@kernel
def slip(floor_path: Any, wanted_path: Any, slip_ratio: Any) -> Any:
    """Return the path of a rim that wants more than the floor under it gives."""
    return floor_path + slip_ratio * (wanted_path - floor_path)


@kernel
def pose_between(robot: Any, ticks_ago: Any, share: Any) -> Any:
    """Return x, y and heading within the tick that ended `ticks_ago` ticks ago, after a share of it, on its arc."""
    x0, y0, heading = robot.trail[ticks_ago, 0], robot.trail[ticks_ago, 1], robot.trail[ticks_ago, 2]
    if ticks_ago == 0:
        dx, dy, turn = robot.x_mm - x0, robot.y_mm - y0, robot.heading_rad - heading
    else:
        dx = robot.trail[ticks_ago - 1, 0] - x0
        dy = robot.trail[ticks_ago - 1, 1] - y0
        turn = robot.trail[ticks_ago - 1, 2] - heading
    # The chord to a point on the arc is shorter by the ratio of sines, and turned back by the rest of the half angle.
    length = share * sinc(0.5 * share * turn) / sinc(0.5 * turn)
    sine, cosine = sin_cos(0.5 * (share - 1.0) * turn)
    x = x0 + length * (dx * cosine - dy * sine)
    y = y0 + length * (dx * sine + dy * cosine)
    return x, y, heading + share * turn
