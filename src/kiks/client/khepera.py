"""A Khepera as an object: one method per command, the same for simulated and real robots."""

from __future__ import annotations

import re
from typing import NamedTuple

from kiks.client.serial_robot import SerialRobot, whole
from kiks.errors import LinkError, ParameterError, shown
from kiks.model.checks import SECONDS_MAX, check_count, check_kind, check_number

ARRIVAL_MAX_S = 600.0
"""Longest wait for the wheels to arrive [s]: at the usual speed a robot drives a hundred metres in that time."""


class Status(NamedTuple):
    """Report of one motor (K).

    Attributes:
        on_target: True once a position move has ended.
        mode: 0 speed, 1 position, 2 PWM.
        error: Command minus measurement [pulses/10 ms, or pulses in position mode].

    Example:
        >>> import kiks
        >>> sim = kiks.Simulation(seed=1)
        >>> kiks.Khepera(sim.port(1)).status()
        (Status(on_target=False, mode=0, error=0), Status(on_target=False, mode=0, error=0))
    """

    on_target: bool
    mode: int
    error: int


PLAIN = (float, int)
"""Classes of numbers that are checked here, without the call of a function for each command."""


class Khepera(SerialRobot):
    """A robot at the end of a serial line.

    Args:
        port: A port of a simulation (`sim.port(1)`), a name ('kiks://1', '/dev/ttyUSB0', 'socket://127.0.0.1:10020'),
            or an open pyserial port with a timeout.
        baud: Speed of the line [bit/s]. Left out, an open port keeps its own, and one that is opened by name has 9600.

    Raises:
        LinkError: If the port cannot be opened; from every method, if it was closed or the robot does not send the
            expected reply.

    Example:
        >>> import kiks
        >>> sim = kiks.Simulation(kiks.Arena.box(500, 500))
        >>> with kiks.Khepera(sim.port(1)) as robot:
        ...     robot.set_speed(10, 10)
        ...     robot.pause(1.0)
        ...     robot.encoders()
        (965, 965)
    """

    # ---- motion ----

    def set_speed(self, left: float, right: float) -> None:
        """Set the wheel speeds (D) [pulses/10 ms]: rounded, and cut to ±127 as controllers' are; 1 is 8 mm/s.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.set_speed(5, -5)
            >>> robot.pause(0.5)
            >>> robot.speed()
            (5, -5)
        """
        # Infinity and what is no number do not differ from themselves by 0.
        if left.__class__ not in PLAIN or right.__class__ not in PLAIN or not left - left == right - right == 0:
            left, right = check_number("left", left), check_number("right", right)
        self._command(b"D,%d,%d\n" % (round(min(max(-127, left), 127)), round(min(max(-127, right), 127))))

    def stop(self) -> None:
        """Set both speeds to 0."""
        self.set_speed(0, 0)

    def speed(self) -> tuple[int, int]:
        """Return the measured speeds, left and right [pulses/10 ms] (E).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.set_speed(5, 5)
            >>> robot.pause(0.5)
            >>> robot.speed()
            (5, 5)
        """
        left, right = self._query(b"E\n", 2)
        return left, right

    def encoders(self) -> tuple[int, int]:
        """Return the position counters, left and right [pulses] (H). A pulse is 0.08 mm.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.set_speed(5, 5)
            >>> robot.pause(1)
            >>> robot.encoders()  # 12.5 pulses are a millimetre
            (482, 482)
        """
        left, right = self._query(b"H\n", 2)
        return left, right

    def set_encoders(self, left: int = 0, right: int = 0) -> None:
        """Set the position counters [pulses] (G). Numbers are rounded.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.set_encoders(100, -100)
            >>> robot.encoders()
            (100, -100)
        """
        self._command(b"G,%d,%d\n" % whole(-(2**31), 2**31 - 1, left=left, right=right))

    def move_to(self, left: int, right: int, *, wait: bool = False, poll_s: float = 0.02) -> None:
        """Move the wheels to counter readings [pulses] along a trapezoid of speed (C). They are rounded.

        Args:
            left: Target of the left wheel.
            right: Target of the right wheel.
            wait: True to return when both wheels report their arrival.
            poll_s: Pause between two polls [s].

        Raises:
            LinkError: If the reply is unexpected, or the wheels do not arrive within `ARRIVAL_MAX_S`.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.move_to(500, 500, wait=True)
            >>> robot.encoders()
            (503, 503)
        """
        check_kind("wait", wait, bool)
        check_number("poll_s", poll_s, 0, SECONDS_MAX)
        self._command(b"C,%d,%d\n" % whole(-8388606, 8388606, left=left, right=right))
        end_s = self.time_s + ARRIVAL_MAX_S
        while wait and not all(motor.on_target for motor in self.status()):
            if self.time_s > end_s:
                raise LinkError(
                    f"both wheels must arrive within {ARRIVAL_MAX_S:g} s, but one has not. Does a wall hold the robot?"
                )
            self.pause(poll_s)

    def set_profile(self, speed: int = 20, acceleration: int = 64) -> None:
        """Set the trapezoid of both wheels (J): speed [pulses/10 ms], acceleration [pulses/256 per (10 ms)^2].

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.set_profile(speed=10)
            >>> robot.move_to(500, 500, wait=True)
        """
        profile = whole(1, 127, speed=speed) + whole(1, 255, acceleration=acceleration)
        self._command(b"J,%d,%d,%d,%d\n" % (profile * 2))

    def set_pwm(self, left: int, right: int) -> None:
        """Set the PWM of the motors, -255 to 255, without a controller (P).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.set_pwm(50, 50)
            >>> robot.pause(1)
            >>> sim.travelled_mm(1) > 0
            True
        """
        self._command(b"P,%d,%d\n" % whole(-255, 255, left=left, right=right))

    def set_speed_gains(self, kp: int = 3800, ki: int = 800, kd: int = 100) -> None:
        """Set the gains of the speed controllers (A).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.set_speed_gains(kp=3000)
        """
        self._command(b"A,%d,%d,%d\n" % whole(0, 32767, kp=kp, ki=ki, kd=kd))

    def set_position_gains(self, kp: int = 3000, ki: int = 20, kd: int = 4000) -> None:
        """Set the gains of the position controllers (F)."""
        self._command(b"F,%d,%d,%d\n" % whole(0, 32767, kp=kp, ki=ki, kd=kd))

    def status(self) -> tuple[Status, Status]:
        """Return the reports of the two controllers, left and right (K).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.status()[0]
            Status(on_target=False, mode=0, error=0)
        """
        t1, m1, e1, t2, m2, e2 = self._query(b"K\n", 6)
        return Status(bool(t1), m1, e1), Status(bool(t2), m2, e2)

    # ---- senses ----

    def proximity(self) -> list[int]:
        """Return the eight proximity readings, clockwise from the left; 1023 is near, 0 nothing (N).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> sim.place(1, 250, 460, 1.5708)  # 10 mm before a wall
            >>> robot.proximity()
            [4, 1022, 985, 1023, 1023, 0, 0, 7]
        """
        return self._query(b"N\n", 8)

    def ambient(self) -> list[int]:
        """Return the eight light readings, clockwise from the left; about 450 is dark, 50 bright (O).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> lamp = sim.add_lamp(250, 300)
            >>> robot.ambient()
            [446, 421, 70, 71, 414, 458, 440, 449]
        """
        return self._query(b"O\n", 8)

    def analog(self, channel: int) -> int:
        """Return an analogue input [4 mV], channel 0 to 6 (I).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.analog(3)
            0
        """
        channel = check_count("channel", channel, 0, 6, "Channels 3 to 5 are inputs of the General I/O turret.")
        return self._query(b"I,%d\n" % channel, 1)[0]

    # ---- other commands ----

    def led(self, led: int, action: int) -> None:
        """Switch an LED (L): 0 lateral, 1 frontal; 0 off, 1 on, 2 toggle.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.led(0, 1)
        """
        led = check_count("led", led, 0, 1, "0 is the lateral one, 1 the frontal one.")
        action = check_count("action", action, 0, 2, "0 is off, 1 on, 2 toggle.")
        self._command(b"L,%d,%d\n" % (led, action))

    def version(self) -> tuple[str, str]:
        """Return the versions of BIOS and protocol (B).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> robot.version()
            ('5.02', '5.01')
        """
        words = self.send("B").split(",")
        if len(words) != 3 or words[0] != "b":
            raise LinkError(f"the reply to 'B' must be b,x.xx,y.yy, but it was {','.join(words)!r}. Is it a Khepera?")
        return words[1], words[2]

    def read_bus(self, address: int) -> int:
        """Return a byte of the extension bus (R)."""
        return self._query(b"R,%d\n" % _address(address), 1)[0]

    def write_bus(self, data: int, address: int) -> None:
        """Write a byte to the extension bus (W)."""
        data = check_count("data", data, 0, 255, "It is a byte.")
        self._command(b"W,%d,%d\n" % (data, _address(address)))

    def turret(self, number: int, order: str) -> list[int]:
        """Pass an order such as 'N' or 'D,1' to a turret (T); return the values of its reply.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> gripper = sim.fit(1, "gripper")
            >>> robot.turret(1, "B")
            [1, 0]
        """
        if not isinstance(order, str) or not re.fullmatch(r"[A-Za-z](,[ 0-9+-]+)*", order):
            raise ParameterError(f"order must be a letter and numbers such as 'N' or 'D,1', but it was {shown(order)}.")
        request = f"T,{check_count('number', number, 0, 99)},{order}"
        reply = self.send(request)
        start = f"t,{number},{order[:1].lower()}"
        if not reply.startswith(start):
            raise LinkError(
                f"the reply to {shown(request)} must begin with {shown(start)}, but it was {shown(reply)}. Is the "
                "turret fitted?"
            )
        try:
            return [int(word) for word in reply[len(start) :].split(",")[1:]]
        except ValueError:
            raise LinkError(
                f"the reply to {shown(request)} must be whole numbers, but it was {shown(reply)}. Use send() for "
                "its text."
            ) from None

    def image(self) -> list[int]:
        """Return the 64 greys 0..255 of the K213 camera's last picture, the leftmost first (T,2,N).

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), seed=1)
            >>> robot = kiks.Khepera(sim.port(1))
            >>> camera = sim.fit(1, "k213")
            >>> len(robot.image())
            64
        """
        pixels = self.turret(2, "N")
        if len(pixels) != 64:
            raise LinkError(f"the reply to 'T,2,N' must be 64 greys, but it was {len(pixels)}. Is turret 2 a K213?")
        return pixels


def _address(address: int) -> int:
    """Return an address of the extension bus, checked."""
    return check_count("address", address, 0, 63, "The extension bus has 64 addresses.")
