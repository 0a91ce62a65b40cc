"""Kinematics: from the paths of two wheels to a pose, along the exact arc, in short pieces near walls.

Derivation: with wheel paths l and r [mm] the centre moves s = (l + r)/2 along an arc that turns by q = (r - l)/b. Its
chord has the length s sinc(q/2) and the direction heading + q/2 (khepera-protocol.md 7.3).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import extending, types

from kiks.engine.compiling import inlined, kernel
from kiks.engine.numbers import SMALL_RAD, sin_cos, sin_cos_of_small, sinc, uniform
from kiks.engine.physics.contact import PIECE_MM, PIECES_MAX, clearance_mm, is_free, slide
from kiks.engine.simd.lanes import floor, greatest, lane_of, with_lane
from kiks.engine.simd.masks import anywhere, choose, everywhere, holds, lane_count, opposite
from kiks.engine.simd.records import one_of
from kiks.engine.state import TRAIL_LENGTH
from kiks.units import TICK_NS

STREAM_SLIP = 1
"""Random stream of the slip ratios (`kiks.engine.sensing.proximity` has the next)."""

ROUNDED_MM = 0.001
"""More than the rounding of clearances [mm]."""

CONTACT_TICKS = 20
"""Ticks without a touch after which a contact is over: a touch within 0.2 s belongs to the same contact."""


@inlined
def remember_pose(robot: Any) -> Any:
    """Phase: store the pose at this tick boundary, for sensors that were sampled some milliseconds ago."""
    for k in range(TRAIL_LENGTH - 1, 0, -1):
        for axis in range(3):
            robot.trail[k, axis] = robot.trail[k - 1, axis]
    robot.trail[0, 0] = robot.x_mm
    robot.trail[0, 1] = robot.y_mm
    robot.trail[0, 2] = robot.heading_rad


@inlined
def room_of(ground: Any, robot: Any, parameters: Any, way_mm: Any, known_mm: Any) -> Any:
    """Return the clearance of a robot [mm], or less if no wall is near; of one robot or eight.

    Far from walls it is not looked up in each tick, as its raster may be too large for the processor's caches.

    Args:
        ground: The walls as contact sees them.
        robot: Record of the robot.
        parameters: Record of its constants.
        way_mm: Longest way that it may go.
        known_mm: What is known to be left of the clearance (`room_left`).
    """
    if everywhere(known_mm >= least_room(ground, parameters, way_mm)):
        return known_mm
    return clearance_mm(ground, robot.x_mm, robot.y_mm)


@inlined
def room_left(room_mm: Any, dx: Any, dy: Any) -> Any:
    """Return what is left of a clearance after a way (dx, dy) [mm]: it is interpolated along each axis."""
    return room_mm - abs(dx) - abs(dy) - ROUNDED_MM


@inlined
def least_room(ground: Any, parameters: Any, way_mm: Any) -> Any:
    """Return the clearance from which on a robot touches no wall on its way [mm].

    Between cell centres the error of the clearance is below one and a half cells.
    """
    return parameters.radius_mm + way_mm + 2.0 * ground.cell_mm


@inlined
def move(ground: Any, robot: Any, parameters: Any, left: Any, right: Any, room_mm: Any, chance: Any) -> Any:
    """Phase: drive along the arc that the wheels command, as far as walls allow; count the paths of the rims.

    Args:
        ground: The walls as contact sees them.
        robot: Record of the robot, or of eight.
        parameters: Record of its constants.
        left: Path of the left wheel without a wall [pulses].
        right: Path of the right wheel without a wall [pulses].
        room_mm: The clearance, or less where it is at least `least_room`.
        chance: Share of its command at which a blocked wheel turns, or the source of it (`slip_ratio_of`).

    Returns:
        Whether it touched a wall.
    """
    pulse = parameters.pulse_mm
    travel = max(abs(left), abs(right)) * pulse
    arc = 0.5 * (left + right) * pulse
    turn = (right - left) * pulse / parameters.wheel_base_mm
    is_near = room_mm < least_room(ground, parameters, travel)
    if anywhere(is_near):
        pieces = choose(is_near, min(max(1.0, -floor(-travel / PIECE_MM)), PIECES_MAX), 1.0)
        return move_near(ground, robot, parameters, (left, right), (arc, turn), pieces, chance)
    x, y, _, _ = end_of_arc(robot, arc * sinc(0.5 * turn), turn)
    drive(robot, x, y, robot.heading_rad + turn, arc)
    robot.wheel_pulses[0] += left
    robot.wheel_pulses[1] += right
    return is_near


@kernel
def move_near(ground: Any, robot: Any, parameters: Any, paths: Any, whole: Any, pieces: Any, chance: Any) -> Any:
    """Drive along an arc in pieces, with contact.

    Args:
        ground: The walls as contact sees them.
        robot: Record of the robot, or of eight.
        parameters: Record of its constants.
        paths: Paths of the wheels without a wall [pulses].
        whole: The arc [mm] and its turn [rad].
        pieces: Number of pieces.
        chance: As in `move`.

    Returns:
        Whether it touched a wall.
    """
    left, right = paths
    arc, turn = whole
    way_left, way_right = left * parameters.pulse_mm, right * parameters.pulse_mm
    rim_left, rim_right = left, right
    if anywhere(pieces > 1.0):
        arc, turn = arc / pieces, turn / pieces
        way_left, way_right = way_left / pieces, way_right / pieces
        rim_left, rim_right = left / pieces, right / pieces
    chord = arc * sinc(0.5 * turn)
    made_left, made_right = 0.0, 0.0
    is_touching = pieces < 1.0  # nowhere yet
    for piece in range(np.int64(greatest(pieces))):
        is_moving = piece < pieces
        x, y, sine, cosine = end_of_arc(robot, chord, turn)
        is_going = is_moving & is_free(ground, parameters, x, y)
        if anywhere(is_going):
            x, y = choose(is_going, x, robot.x_mm), choose(is_going, y, robot.y_mm)
            heading = choose(is_going, robot.heading_rad + turn, robot.heading_rad)
            drive(robot, x, y, heading, choose(is_going, arc, 0.0))
            made_left += choose(is_going, rim_left, 0.0)
            made_right += choose(is_going, rim_right, 0.0)
        is_blocked = is_moving & opposite(is_going)
        if anywhere(is_blocked):
            is_touching = is_touching | is_blocked
            for lane in range(lane_count(is_blocked)):
                if holds(is_blocked, lane):
                    one, its = one_of(robot, lane), one_of(parameters, lane)
                    arc_of_it = lane_of(chord, lane), lane_of(sine, lane), lane_of(cosine, lane), lane_of(turn, lane)
                    ways = lane_of(way_left, lane), lane_of(way_right, lane)
                    slip_ratio = slip_ratio_of(chance, its, lane)
                    rims = scrape(ground, one, its, arc_of_it, ways, slip_ratio)
                    made_left = with_lane(made_left, lane, lane_of(made_left, lane) + rims[0])
                    made_right = with_lane(made_right, lane, lane_of(made_right, lane) + rims[1])
    robot.slip_pulses[0] += left - made_left
    robot.slip_pulses[1] += right - made_right
    robot.wheel_pulses[0] += made_left
    robot.wheel_pulses[1] += made_right
    return is_touching


@inlined
def end_of_arc(robot: Any, chord: Any, turn: Any) -> Any:
    """Return the place of a free robot after an arc, x and y [mm], and sine and cosine of its chord's direction."""
    sine, cosine = sin_cos(robot.heading_rad + 0.5 * turn)
    return robot.x_mm + chord * cosine, robot.y_mm + chord * sine, sine, cosine


@inlined
def drive(robot: Any, x: Any, y: Any, heading: Any, arc: Any) -> Any:
    """Move to a pose, x and y [mm] and heading [rad], after an arc [mm]."""
    robot.x_mm, robot.y_mm, robot.heading_rad = x, y, heading
    count_path(robot, arc)


@kernel
def scrape(ground: Any, robot: Any, parameters: Any, piece: Any, ways: Any, slip_ratio: Any) -> Any:
    """Drive a piece of an arc that leads into a wall; return the paths of the wheels' rims [pulses].

    Args:
        ground: The walls as contact sees them.
        robot: Record of the robot.
        parameters: Record of its constants.
        piece: The chord [mm], sine and cosine of its direction, and the turn [rad].
        ways: Commanded paths of the wheels [mm].
        slip_ratio: Share of its command at which a blocked wheel turns.
    """
    chord, sine, cosine, turn = piece
    base = parameters.wheel_base_mm
    u, v, q = slide(ground, robot, parameters, chord * cosine, chord * sine, turn)
    robot.heading_rad += q
    along = u * cosine + v * sine
    count_path(robot, math.sqrt(u * u + v * v) if along > 0.0 else -math.sqrt(u * u + v * v))
    # The rim follows the floor, plus the slip ratio times the rest of its commanded path.
    rim_left = slip(along - 0.5 * q * base, ways[0], slip_ratio) / parameters.pulse_mm
    rim_right = slip(along + 0.5 * q * base, ways[1], slip_ratio) / parameters.pulse_mm
    return rim_left, rim_right


@kernel
def draw_slip(parameters: Any, seed: Any, number: Any, tick: Any) -> Any:
    """Return the share of its command at which a blocked wheel of a robot turns in a tick."""
    drawn = uniform(seed, 0, number, STREAM_SLIP, tick, 0)
    return parameters.slip_ratio_min + drawn * (parameters.slip_ratio_max - parameters.slip_ratio_min)


def slip_ratio_of(chance: Any, parameters: Any, lane: Any) -> Any:
    """Return a given slip ratio, or draw one from the seeds, the numbers and the ticks of eight robots."""
    raise NotImplementedError("only kernels can call this")


@extending.overload(slip_ratio_of)  # type: ignore[untyped-decorator, unused-ignore]
def _overload_slip_ratio_of(chance: Any, parameters: Any, lane: Any) -> Any:
    def given(chance: Any, parameters: Any, lane: Any) -> Any:
        return chance

    def drawn(chance: Any, parameters: Any, lane: Any) -> Any:
        seeds, numbers, tick = chance
        return draw_slip(parameters, lane_of(seeds, lane), lane_of(numbers, lane), lane_of(tick, lane))

    return given if isinstance(chance, types.Float) else drawn


@inlined
def count_path(robot: Any, way_mm: Any) -> Any:
    """Add a path to the distance driven forwards, or backwards if it is negative."""
    robot.forwards_mm += max(way_mm, 0.0)
    robot.backwards_mm -= min(way_mm, 0.0)


@inlined
def note_contact(robot: Any, is_touching: Any) -> Any:
    """Phase: count the contacts; a lasting contact counts once, even with short gaps.

    A ball that is pushed along runs ahead by hundredths of a millimetre whenever the motors falter.
    """
    robot.contact_count += choose(is_touching & (robot.is_touching == 0), 1, 0)
    robot.is_touching = choose(is_touching, CONTACT_TICKS, max(robot.is_touching - 1, 0))


@kernel
def between_nought_and(limit: Any, value: Any) -> Any:
    """Return a value, limited to the range between 0 and a limit of either sign."""
    return min(max(value, 0.0), limit) if limit > 0.0 else max(min(value, 0.0), limit)


@kernel
def give_way(robot: Any, parameters: Any, dx: Any, dy: Any, wheels: Any, slip_ratio: Any) -> Any:
    """Correct the wheel counts of a robot that was pushed by (dx, dy) [mm].

    A push brakes the wheels, at most to a stop, and turns none faster: a gear of 25:1 cannot be driven from the wheel.

    Args:
        robot: Record of the robot.
        parameters: Record of its constants.
        dx: The push [mm].
        dy: The push [mm].
        wheels: Paths that its wheels have made [pulses].
        slip_ratio: Share of its command at which a blocked wheel turns.
    """
    sine, cosine = sin_cos(robot.heading_rad)
    pushed = (dx * cosine + dy * sine) / parameters.pulse_mm
    for wheel in range(2):
        path = wheels[wheel]
        lost = between_nought_and(path, -pushed)
        robot.wheel_pulses[wheel] -= (1.0 - slip_ratio) * lost
        robot.slip_pulses[wheel] += (1.0 - slip_ratio) * lost
        # Subtract the path that was counted as driven but was not.
        if lost > 0.0:
            robot.forwards_mm -= 0.5 * lost * parameters.pulse_mm
        else:
            robot.backwards_mm += 0.5 * lost * parameters.pulse_mm


@kernel
def slip(floor_path: Any, wanted_path: Any, slip_ratio: Any) -> Any:
    """Return the path of a rim that slips on the floor."""
    return floor_path + slip_ratio * (wanted_path - floor_path)


@kernel
def moment_of(tick_count: Any, time_ns: Any) -> Any:
    """Return the tick of a time at most 20 ms before the end of the last tick, and the place of the time in it.

    Returns:
        The number of ticks since that tick ended, and its share, 0..1, after the time; for `Lanes`, lanes.
    """
    age_ns = max(1.0 * tick_count * TICK_NS - time_ns, 0.0)
    ticks_ago = min(floor(age_ns * (1.0 / TICK_NS)), TRAIL_LENGTH - 1.0)
    return ticks_ago, min((age_ns - ticks_ago * TICK_NS) * (1.0 / TICK_NS), 1.0)


@kernel
def pose_between(robot: Any, ticks_ago: Any, share: Any) -> Any:
    """Return x, y and heading within the tick that ended `ticks_ago` ticks ago, after a share of it, on its arc."""
    x0, y0, heading = boundary(robot, ticks_ago, 0), boundary(robot, ticks_ago, 1), boundary(robot, ticks_ago, 2)
    dx = boundary(robot, ticks_ago - 1, 0) - x0
    dy = boundary(robot, ticks_ago - 1, 1) - y0
    turn = boundary(robot, ticks_ago - 1, 2) - heading
    # The chord to a point on the arc is shorter by the ratio of sines, and turned back by the rest of the half angle.
    length = share * sinc(0.5 * share * turn) / sinc(0.5 * turn)
    back = 0.5 * (share - 1.0) * turn
    sine, cosine = sin_cos_of_small(back) if everywhere(abs(back) < SMALL_RAD) else sin_cos(back)
    x = x0 + length * (dx * cosine - dy * sine)
    y = y0 + length * (dx * sine + dy * cosine)
    return x, y, heading + share * turn


@inlined
def boundary(robot: Any, ticks_ago: Any, axis: Any) -> Any:
    """Return x, y or heading at the beginning of the tick that ended `ticks_ago` ticks ago; -1 is the next tick."""
    now = robot.x_mm if axis == 0 else (robot.y_mm if axis == 1 else robot.heading_rad)
    value = choose(ticks_ago == 0, robot.trail[0, axis], now)
    for k in range(1, TRAIL_LENGTH):
        value = choose(ticks_ago == k, robot.trail[k, axis], value)
    return value
