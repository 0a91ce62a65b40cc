"""The command table: one function per letter; its first line is the command's entry in the reference.

Source: khepera-protocol.md section 4. A function gets as many whole numbers as the table says and returns the values
of its reply; the letter in lower case, the commas and the line end are put around them in one place.
"""

from __future__ import annotations

import logging

import numpy as np

from kiks.engine.physics import motor
from kiks.firmware.firmware import Firmware
from kiks.firmware.robot_kind import RobotCommand
from kiks.units import ns_from_s

Reply = tuple[object, ...]

_log = logging.getLogger("kiks.turrets")


PROTOCOL_ERROR = b"z,Protocol error\r\n"
NO_TURRET = b"z,Turret order not supported\r\n"


class CommandRefusedError(Exception):
    """A command that the robot does not carry out; the argument is its reply."""


_LONG = 2**62


def _clamp(value: int, low: int, high: int) -> int:
    return min(max(value, low), high)


def _limit(value: int) -> int:
    """Fit a number of any length into the kernels' 64 bits; every command clamps to much less."""
    return value if -_LONG < value < _LONG else (_LONG if value > 0 else -_LONG)


def _in_range(value: int, low: int, high: int) -> int:
    if not low <= value <= high:
        raise CommandRefusedError(PROTOCOL_ERROR)
    return value


def _gains(*values: int) -> list[int]:
    if min(values) < 0:
        raise CommandRefusedError(PROTOCOL_ERROR)
    return [min(value, 32767) for value in values]


def set_speed_gains(robot: Firmware, kp: int, ki: int, kd: int) -> Reply:
    """Set the gains of the speed controllers of both motors."""
    robot.view.speed_gains[:] = _gains(kp, ki, kd)
    return ()


def version(robot: Firmware) -> Reply:
    """Report the versions of the BIOS and of the protocol."""
    return (robot.spec.firmware.bios_version, robot.spec.firmware.protocol_version)


def go_to_position(robot: Firmware, left: int, right: int) -> Reply:
    """Move each wheel to a counter reading along a trapezoid of speed; the reply does not wait for the arrival."""
    motor.set_position(robot.robots, 0, robot.number, _limit(left), _limit(right))
    return ()


def set_speed(robot: Firmware, left: int, right: int) -> Reply:
    """Turn the wheels at these speeds until the next command that moves them."""
    left, right = (_clamp(speed, -motor.SPEED_MAX, motor.SPEED_MAX) for speed in (left, right))
    motor.set_speed(robot.robots, 0, robot.number, left, right)
    return ()


def read_speed(robot: Firmware) -> Reply:
    """Report the speeds measured in the last 10 ms."""
    return tuple(robot.view.measured_speed.tolist())


def set_position_gains(robot: Firmware, kp: int, ki: int, kd: int) -> Reply:
    """Set the gains of the position controllers of both motors."""
    robot.view.position_gains[:] = _gains(kp, ki, kd)
    return ()


def set_counters(robot: Firmware, left: int, right: int) -> Reply:
    """Set the position counters; nothing moves."""
    # Beyond 32 bits the low ones count (khepera-protocol.md 4.8).
    motor.set_counters(robot.robots, 0, robot.number, left & 0xFFFFFFFF, right & 0xFFFFFFFF)
    return ()


def read_counters(robot: Firmware) -> Reply:
    """Report the position counters."""
    view = robot.view
    return tuple(((view.pulse_count + view.counter_offset + 2**31) % 2**32 - 2**31).tolist())


def read_analog(robot: Firmware, channel: int) -> Reply:
    """Report an analogue input.

    Channel 0 is the charger, 1 the reflected and 2 the ambient light of the sensor being scanned, 3 to 5 are those of
    the General I/O turret, and 6 is the current [mA].
    """
    _in_range(channel, 0, 6)
    if channel in (1, 2):
        readings = robot.sense("proximity" if channel == 1 else "ambient")
        return (readings[robot.now_ns // ns_from_s(robot.spec.proximity.slot_ms * 1e-3) % len(readings)],)
    if channel == 6:
        power = sum(abs(pwm) for pwm in robot.view.pwm.tolist()) / (2 * motor.PWM_MAX)
        return (100 + round(300 * power),)
    return (int(robot.view.analog_inputs[channel - 3]),) if channel >= 3 else (0,)


def set_profile(robot: Firmware, max_left: int, acc_left: int, max_right: int, acc_right: int) -> Reply:
    """Set the largest speed and the acceleration of position moves; applies at once, to a move in progress too."""
    robot.view.profile_speed[:] = _clamp(max_left, 1, 127), _clamp(max_right, 1, 127)
    robot.view.profile_acceleration[:] = _clamp(acc_left, 1, 255), _clamp(acc_right, 1, 255)
    return ()


def read_status(robot: Firmware) -> Reply:
    """Report for each motor: T on target, M mode (0 speed, 1 position, 2 PWM), E error (command minus measurement)."""
    view = robot.view
    on_target, mode = view.on_target.tolist(), view.motor_mode.tolist()
    error = [motor.controller_error(robot.robots, 0, robot.number, wheel) for wheel in (0, 1)]
    return (on_target[0], mode[0], error[0], on_target[1], mode[1], error[1])


def set_led(robot: Firmware, led: int, action: int) -> Reply:
    """Switch the lateral (0) or the frontal (1) LED: 0 off, 1 on, 2 toggle."""
    _in_range(led, 0, 1)
    _in_range(action, 0, 2)
    robot.view.led[led] = 1 - robot.view.led[led] if action == 2 else action
    return ()


def read_proximity(robot: Firmware) -> Reply:
    """Report the reflected light of the eight sensors, clockwise from the left; more is nearer."""
    return tuple(robot.sense("proximity"))


def read_ambient(robot: Firmware) -> Reply:
    """Report the ambient light of the eight sensors, clockwise from the left; less is brighter."""
    return tuple(robot.sense("ambient"))


def set_pwm(robot: Firmware, left: int, right: int) -> Reply:
    """Feed the motors without control."""
    motor.set_pwm(robot.robots, 0, robot.number, _limit(left), _limit(right))
    return ()


def read_bus(robot: Firmware, address: int) -> Reply:
    """Read a byte from the extension bus; where nothing is fitted it is 0."""
    _in_range(address, 0, 63)
    return (int(robot.view.bus_inputs[address]),)


def send_to_turret(robot: Firmware, turret: int, order: str, *values: int) -> Reply:
    """Pass an order to a turret, whose number comes before its answer; order B asks for its version and revision."""
    fitted = robot.turrets.get(turret)
    if fitted is None:
        raise CommandRefusedError(NO_TURRET)
    if order == "B":
        return (turret, "b", *fitted.revision)
    try:
        answer = fitted.order(order, tuple(map(_limit, values)))
        reply = None if answer is None else tuple(map(int, answer))
    except Exception:  # a turret of a user's own may do anything, but a program on the wire never sees that
        _log.exception("Turret %d (%s) must not raise, but order %s did.", turret, fitted.name, order)
        reply = None
    if reply is None:
        raise CommandRefusedError(PROTOCOL_ERROR)
    return (turret, order.lower(), *reply)


def write_bus(robot: Firmware, data: int, address: int) -> Reply:
    """Write the low 8 bits of a number to the extension bus: data first, then the address."""
    _in_range(address, 0, 63)
    robot.view.bus[address] = np.uint8(data & 0xFF)
    return ()


_PWM = "-255..255, clamped"
_GAINS = "0..32767, more is clamped, a negative number is an error"

COMMANDS: tuple[RobotCommand, ...] = (
    RobotCommand("A", "speed controller gains", ("Kp", "Ki", "Kd"), (), _GAINS, set_speed_gains),
    RobotCommand("B", "version", (), ("bios", "protocol"), "", version),
    RobotCommand(
        "C", "go to position", ("left", "right"), (), "pulses, magnitude at most 8388606, clamped", go_to_position
    ),
    RobotCommand("D", "set speed", ("left", "right"), (), "pulses/10 ms, -127..127, clamped", set_speed),
    RobotCommand("E", "read speed", (), ("left", "right"), "pulses/10 ms", read_speed, "speeds"),
    RobotCommand("F", "position controller gains", ("Kp", "Ki", "Kd"), (), _GAINS, set_position_gains),
    RobotCommand("G", "set position counters", ("left", "right"), (), "pulses, low 32 bits", set_counters),
    RobotCommand(
        "H", "read position counters", (), ("left", "right"), "pulses, signed 32 bits", read_counters, "positions"
    ),
    RobotCommand("I", "read analogue input", ("channel",), ("value",), "channel 0..6, value 0..1023", read_analog),
    RobotCommand(
        "J",
        "speed profile",
        ("max_left", "acc_left", "max_right", "acc_right"),
        (),
        "1..127 pulses/10 ms and 1..255 pulses/256 per (10 ms)^2, clamped",
        set_profile,
    ),
    RobotCommand(
        "K",
        "controller status",
        (),
        ("T_left", "M_left", "E_left", "T_right", "M_right", "E_right"),
        "T 0 or 1, M 0..2, E in pulses or pulses/10 ms",
        read_status,
    ),
    RobotCommand("L", "LED", ("led", "action"), (), "led 0..1, action 0..2", set_led),
    RobotCommand(
        "N", "proximity sensors", (), tuple(f"s{i}" for i in range(8)), "0..1023", read_proximity, "proximity"
    ),
    RobotCommand(
        "O", "ambient light sensors", (), tuple(f"s{i}" for i in range(8)), "0..1023", read_ambient, "ambient"
    ),
    RobotCommand("P", "set PWM", ("left", "right"), (), _PWM, set_pwm),
    RobotCommand("R", "read extension bus", ("address",), ("data",), "address 0..63, data 0..255", read_bus),
    RobotCommand(
        "T",
        "message to a turret",
        ("turret", "order", "..."),
        ("turret", "order", "..."),
        "turret: a number, order: a capital letter, then the numbers that the turret takes",
        send_to_turret,
    ),
    RobotCommand("W", "write extension bus", ("data", "address"), (), "address 0..63, low 8 bits of data", write_bus),
)
"""All commands. The parameters of T are a turret's order; `Firmware` parses them."""
