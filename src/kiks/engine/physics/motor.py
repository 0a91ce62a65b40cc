"""The two motors: set points, trajectory generator, the firmware's PID controller, and the motor model.

`E`, `K` and `H` answer like the real robot while it accelerates, arrives and stalls. Source: khepera-protocol.md 6.1 to
6.4 (K-Team's algorithm and gains; the plant is inferred there).
Assumption: a wheel that slips at a wall turns at 10-15 % of its command and stays there (thesis 3.3). A loop closed
over the slip would wind up to full power instead. So the controllers regulate the path without the slip
(`slip_pulses`), while the encoders, and with them E, H and K, count the real path of the wheel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.simd.lanes import floor
from kiks.engine.simd.masks import anywhere, choose, everywhere, lane_count
from kiks.engine.simd.records import one_of
from kiks.engine.state import MODE_POSITION, MODE_PWM, MODE_SPEED
from kiks.model.robot import Motor
from kiks.units import NS_PER_S, TICK_NS

TICK_S = TICK_NS / NS_PER_S

PWM_MAX = 255
"""Full power (khepera-protocol.md 4.16)."""

SPEED_MAX = 127
"""Largest speed command [pulses/10 ms] (khepera-protocol.md 4.5)."""

TARGET_MAX = 2**23 - 2
"""Largest magnitude of a target position [pulses] (khepera-protocol.md 4.4)."""


@kernel
def clamp(value: Any, limit: Any) -> Any:
    """Return a value limited to +-limit."""
    return min(max(value, -limit), limit)


@kernel
def wrap_int32(value: Any) -> Any:
    """Return the low 32 bits of a whole number as a signed one: a counter that overflows."""
    return value - 4294967296.0 * floor((value + 2147483648.0) * (1.0 / 4294967296.0))


@kernel
def counter(robot: Any, wheel: Any) -> Any:
    """Return a position counter as command H reports it [pulses]."""
    return wrap_int32(robot.pulse_count[wheel] + robot.counter_offset[wheel])


def wheel_speeds(robots: Any, motors: Sequence[Motor]) -> NDArray[np.float64]:
    """Return how fast wheels turn, in the unit of each motor: measured; a stepper has at once what it is told.

    Args:
        robots: Records of `kiks.engine.state.ROBOT`, the last axis being that of the motors.
        motors: What turns the wheels of each.
    """
    limits = np.array([motor.steps_per_s_max for motor in motors]).reshape(-1, 1)
    told = np.clip(robots["speed_setpoint"], -limits, limits)
    speeds: NDArray[np.float64] = np.where(limits > 0, told, robots["measured_speed"])
    return speeds


# ---- set points: written by the commands A, C, D, F, G, J, P and a reset ----


@kernel
def change_mode(robot: Any, wheel: Any, mode: Any) -> Any:
    """Switch the controller of a motor; the new one begins with an empty memory (khepera-protocol.md 6.3)."""
    is_other = robot.motor_mode[wheel] != mode
    robot.motor_mode[wheel] = mode
    robot.error_sum[wheel] = choose(is_other, 0, robot.error_sum[wheel])
    robot.last_error[wheel] = choose(is_other, 0, robot.last_error[wheel])
    robot.on_target[wheel] = 0


@kernel
def command_speed(robot: Any, left_pulses: Any, right_pulses: Any) -> Any:
    """Command D: turn the wheels at these speeds [pulses/10 ms], or those of a stepper [steps/s]."""
    for wheel in range(2):
        change_mode(robot, wheel, MODE_SPEED)
        robot.speed_setpoint[wheel] = left_pulses if wheel == 0 else right_pulses


@kernel
def command_pwm(robot: Any, left_pwm: Any, right_pwm: Any) -> Any:
    """Command P: set the power of the motors without control, -255 to 255."""
    for wheel in range(2):
        change_mode(robot, wheel, MODE_PWM)
        robot.pwm_setpoint[wheel] = clamp(left_pwm if wheel == 0 else right_pwm, PWM_MAX)


@kernel
def command_position(robot: Any, left_pulses: Any, right_pulses: Any) -> Any:
    """Command C: move the wheels to these counter readings [pulses], along a trapezoid of speed."""
    for wheel in range(2):
        if robot.motor_mode[wheel] == MODE_POSITION:
            # The move does not make up for slip: it starts where the wheel is, and where its counter is after an
            # overflow of 32 bits.
            overflow = robot.pulse_count[wheel] + robot.counter_offset[wheel] - counter(robot, wheel)
            robot.trajectory_pulses[wheel] -= robot.slip_count[wheel] + overflow
        else:
            robot.trajectory_pulses[wheel] = counter(robot, wheel)
            robot.trajectory_speed[wheel] = robot.controlled_speed[wheel]
        robot.slip_pulses[wheel] -= robot.slip_count[wheel]
        robot.slip_count[wheel] = 0
        change_mode(robot, wheel, MODE_POSITION)
        robot.target_pulses[wheel] = clamp(left_pulses if wheel == 0 else right_pulses, TARGET_MAX)


@kernel
def command_counters(robot: Any, left_pulses: Any, right_pulses: Any) -> Any:
    """Command G: set the counters [pulses]. A move in progress is shifted with them, so the wheels do not move."""
    for wheel in range(2):
        offset = wrap_int32(left_pulses if wheel == 0 else right_pulses) - robot.pulse_count[wheel]
        shift = offset - robot.counter_offset[wheel]
        robot.counter_offset[wheel] = offset
        robot.target_pulses[wheel] += shift
        robot.trajectory_pulses[wheel] += shift


@kernel
def position_error(robot: Any, wheel: Any) -> Any:
    """Return the lag of a wheel behind its trajectory [pulses], across the overflow of 32 bits."""
    return wrap_int32(floor(robot.trajectory_pulses[wheel] + 0.5) - counter(robot, wheel))


@entry
def set_speed(robots: Any, world: Any, robot: Any, left_pulses: Any, right_pulses: Any) -> Any:
    """Call `command_speed` for one robot of an array."""
    command_speed(robots[world, robot], left_pulses, right_pulses)


@entry
def set_pwm(robots: Any, world: Any, robot: Any, left_pwm: Any, right_pwm: Any) -> Any:
    """Call `command_pwm` for one robot of an array."""
    command_pwm(robots[world, robot], left_pwm, right_pwm)


@entry
def set_position(robots: Any, world: Any, robot: Any, left_pulses: Any, right_pulses: Any) -> Any:
    """Call `command_position` for one robot of an array."""
    command_position(robots[world, robot], left_pulses, right_pulses)


@entry
def set_counters(robots: Any, world: Any, robot: Any, left_pulses: Any, right_pulses: Any) -> Any:
    """Call `command_counters` for one robot of an array."""
    command_counters(robots[world, robot], left_pulses, right_pulses)


@entry
def controller_error(robots: Any, world: Any, robot: Any, wheel: Any) -> Any:
    """Return the error that command K reports: command minus measurement [pulses or pulses/10 ms]."""
    state = robots[world, robot]
    if state.motor_mode[wheel] == MODE_SPEED:
        return np.int64(state.speed_setpoint[wheel]) - state.measured_speed[wheel]
    if state.motor_mode[wheel] == MODE_POSITION:
        return np.int64(position_error(state, wheel))
    return np.int64(0)


# ---- phases of a tick ----


@inlined
def latch_encoders(robot: Any) -> Any:
    """Phase: count the whole pulses of the wheels, in total and since the last tick."""
    for wheel in range(2):
        pulses = floor(robot.wheel_pulses[wheel])
        slipped = floor(robot.wheel_pulses[wheel] + robot.slip_pulses[wheel]) - pulses
        robot.measured_speed[wheel] = pulses - robot.pulse_count[wheel]
        robot.controlled_speed[wheel] = robot.measured_speed[wheel] + slipped - robot.slip_count[wheel]
        robot.pulse_count[wheel] = pulses
        robot.slip_count[wheel] = slipped


@kernel
def advance_trajectory(robot: Any, wheel: Any) -> Any:
    """Move the commanded position one tick along its trapezoid (khepera-protocol.md 6.2)."""
    acceleration = robot.profile_acceleration[wheel] / 256.0
    fastest = np.float64(robot.profile_speed[wheel])
    distance = robot.target_pulses[wheel] - robot.trajectory_pulses[wheel]
    side = 1.0 if distance >= 0.0 else -1.0
    distance = abs(distance)
    speed = robot.trajectory_speed[wheel] * side
    if distance < 1.0 and abs(speed) <= acceleration:
        robot.trajectory_pulses[wheel] = robot.target_pulses[wheel]
        robot.trajectory_speed[wheel] = 0.0
        robot.on_target[wheel] = 1
        # The integrator has compensated friction on the way. Left in, it would hold the wheel beyond the target.
        robot.error_sum[wheel] = 0
        return
    if speed < 0.0:  # it still moves away from the target
        speed = min(speed + acceleration, 0.0)
    elif distance < speed * speed / (2.0 * acceleration):
        # Brake as hard as the distance requires, even beyond the set acceleration: this guarantees the arrival.
        speed = max(speed - speed * speed / (2.0 * max(distance, 1e-9)), 0.0)
    elif speed < fastest:
        speed = min(speed + acceleration, fastest)
    elif speed > fastest:
        speed = max(speed - acceleration, fastest)
    if 0.0 <= speed < acceleration:
        speed = min(acceleration, distance)  # the rest of the path: no standstill short of the target
    speed = min(speed, max(distance, 0.0)) if speed > 0.0 else speed
    robot.trajectory_speed[wheel] = speed * side
    robot.trajectory_pulses[wheel] += speed * side


@inlined
def pid(robot: Any, wheel: Any, gains: Any, error: Any, scale: Any) -> Any:
    """Return the power that the firmware's controller demands (khepera-protocol.md 6.3), in whole numbers as there.

    All are below 2^53, except a demand that is far beyond full power anyway.
    """
    error_sum = robot.error_sum[wheel] + error
    demand = gains[0] * error + gains[1] * error_sum + gains[2] * (error - robot.last_error[wheel])
    power = floor(abs(demand) / scale)
    # The integrator stops while the power is clipped, unless the error reduces it (anti-windup).
    is_working = (power <= PWM_MAX) | ((error < 0) != (demand <= 0))
    robot.error_sum[wheel] = choose(is_working, error_sum, robot.error_sum[wheel])
    robot.last_error[wheel] = error
    return clamp(choose(demand >= 0, power, -power), PWM_MAX)


@inlined
def control_motors(robot: Any, parameters: Any) -> Any:
    """Phase: each motor's controller compares its set point with the encoders and sets the power."""
    for wheel in range(2):
        is_simple = robot.motor_mode[wheel] == MODE_SPEED
        if everywhere(is_simple):
            robot.pwm[wheel] = control_speed(robot, parameters, wheel)
        else:
            for lane in range(lane_count(is_simple)):
                control_motor(one_of(robot, lane), one_of(parameters, lane), wheel)


@inlined
def control_speed(robot: Any, parameters: Any, wheel: Any) -> Any:
    """Return the power of a motor under speed control."""
    error = robot.speed_setpoint[wheel] - robot.controlled_speed[wheel]
    error = choose(parameters.steps_per_s_max > 0.0, 0, error)  # a stepper has no regulator
    return pid(robot, wheel, robot.speed_gains, error, parameters.gain_scale)


@kernel
def control_motor(robot: Any, parameters: Any, wheel: Any) -> Any:
    """Set the power of one motor according to its mode."""
    mode = robot.motor_mode[wheel]
    if mode == MODE_SPEED:
        robot.pwm[wheel] = control_speed(robot, parameters, wheel)
    elif mode == MODE_POSITION:
        if robot.on_target[wheel] == 0:
            advance_trajectory(robot, wheel)
        error = position_error(robot, wheel) - robot.slip_count[wheel]
        robot.pwm[wheel] = pid(robot, wheel, robot.position_gains, error, parameters.gain_scale)
    else:
        robot.pwm[wheel] = robot.pwm_setpoint[wheel]


@inlined
def turn_motors(robot: Any, parameters: Any, wheel: Any) -> Any:
    """Phase: the motor follows its power with a lag; return its wheel's path in this tick, without walls [pulses]."""
    power = robot.pwm[wheel]
    driving = max(abs(power) - parameters.dead_band_pwm, 0.0) / (PWM_MAX - parameters.dead_band_pwm)
    final = driving * parameters.free_speed_pulses * parameters.motor_gain[wheel]
    final = choose(power >= 0.0, final, -final)
    difference = robot.motor_speed[wheel] - final
    path = final + difference * parameters.lag_ticks
    final = final + difference * parameters.lag_decay
    is_stepper = parameters.steps_per_s_max > 0.0
    if anywhere(is_stepper):
        steps = step_speed(robot, parameters, wheel)
        final, path = choose(is_stepper, steps, final), choose(is_stepper, steps, path)
    robot.motor_speed[wheel] = final
    return path


@inlined
def step_speed(robot: Any, parameters: Any, wheel: Any) -> Any:
    """Return the path of a stepper's wheel in a tick [steps]: no ramp and no slip of the motor itself.

    A timer emits a step each time that a whole number of its periods has passed, so the speed is a quotient of whole
    numbers: 600 steps/s are 625 (epuck-protocol.md section 1).
    """
    wanted = clamp(robot.speed_setpoint[wheel], parameters.steps_per_s_max)
    size = max(abs(wanted), 1.0)
    steps = choose(wanted == 0.0, 0.0, parameters.timer_hz / floor(parameters.timer_hz / size) * TICK_S)
    return choose(wanted >= 0.0, steps, -steps) * parameters.motor_gain[wheel]


@kernel
def steps_at(robot: Any, parameters: Any, wheel: Any, tick_count: Any, time_ns: Any) -> Any:
    """Return the counter of a stepper at a time in the last tick or at its end [steps].

    It counts the steps that were sent, whether the wheel could follow or not: what slip has swallowed, too.
    """
    ticks = (tick_count * TICK_NS - time_ns) / TICK_NS
    path = robot.wheel_pulses[wheel] + robot.slip_pulses[wheel] - robot.motor_speed[wheel] * ticks
    # Sums of speeds such as 9.0909 miss a whole number by their rounding.
    steps = floor(path / parameters.motor_gain[wheel] + 1e-6)
    return steps - parameters.counter_range * floor(steps / parameters.counter_range + 0.5)
