"""An e-puck as an object: one method per command, the same for simulated and real robots."""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.client.serial_robot import SerialRobot, whole
from kiks.errors import LinkError, shown
from kiks.model.checks import check_choice, check_count, check_kind

GREY, COLOUR = "grey", "colour"
"""Modes of the camera, numbered 0 and 1 in its command (epuck-protocol.md 6.4)."""

IMAGE_REQUEST = b"\xb7\x00"

CALIBRATION_S = 10.0
"""Longest time that a calibration may take [s]; 2 s are expected (epuck-protocol.md 9.4)."""


class CameraSettings(NamedTuple):
    """How an e-puck's camera takes its pictures (I).

    Attributes:
        mode: 0 grey, 1 colour (RGB565), 2 YUV.
        width: Of the picture [pixels].
        height: Of the picture [pixels].
        zoom: Steps on the sensor, which has 640 x 480 pixels, from one pixel of the picture to the next.
        size: Of the picture [bytes].

    Example:
        >>> import kiks
        >>> kiks.EPuck(kiks.Simulation(robot="epuck").port(1)).camera()
        CameraSettings(mode=1, width=40, height=40, zoom=8, size=3200)
    """

    mode: int
    width: int
    height: int
    zoom: int
    size: int


class EPuck(SerialRobot):
    """An e-puck at the end of a serial line: a cable, Bluetooth, or a simulation.

    Args:
        port: As for `kiks.Khepera`: a port of a simulation, a name such as '/dev/rfcomm0', or an open port.
        baud: Speed of the line [bit/s]. Left out, an open port keeps its own; one that is opened by name has 115200.

    Raises:
        LinkError: As for `kiks.Khepera`.

    Example:
        >>> import kiks
        >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), robot="epuck")
        >>> with kiks.EPuck(sim.port(1)) as robot:
        ...     robot.set_speed(500, 500)
        ...     robot.pause(1.0)
        ...     robot.steps()
        (495, 495)
    """

    usual_baud: ClassVar[int] = 115_200  # epuck-protocol.md section 2
    stop_bits: ClassVar[int] = 1

    # ---- motion ----

    def set_speed(self, left: float, right: float) -> None:
        """Set the wheel speeds (D) [steps/s]: rounded, and cut to ±1000 by the robot; 1000 are 129 mm/s."""
        self._command(b"D,%d,%d\n" % whole(-32768, 32767, left=left, right=right))

    def stop(self) -> None:
        """Set both speeds to 0. LEDs stay as they are; the command S would switch them off.

        Example:
            >>> import kiks
            >>> robot = kiks.EPuck(kiks.Simulation(robot="epuck").port(1))
            >>> robot.set_speed(500, 500)
            >>> robot.stop()
            >>> robot.speed()
            (0, 0)
        """
        self.set_speed(0, 0)

    def speed(self) -> tuple[int, int]:
        """Return the speeds that were asked for last, left and right [steps/s] (E): the robot measures none."""
        left, right = self._query(b"E\n", 2)
        return left, right

    def steps(self) -> tuple[int, int]:
        """Return the counters of steps, left and right (Q); a step is 0.13 mm. They have 16 bits, an e-puck2's 32.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(kiks.Arena.box(500, 500), robot="epuck")
            >>> robot = kiks.EPuck(sim.port(1))
            >>> robot.set_steps(100, -100)
            >>> robot.steps()
            (100, -100)
        """
        left, right = self._query(b"Q\n", 2)
        return left, right

    def set_steps(self, left: int = 0, right: int = 0) -> None:
        """Set the counters of steps (P); the wheels do not move."""
        self._command(b"P,%d,%d\n" % whole(-32768, 32767, left=left, right=right))

    # ---- senses ----

    def proximity(self) -> list[int]:
        """Return the reflected light of the eight sensors, clockwise from the front right (N); more is nearer."""
        return self._query(b"N\n", 8)

    def ambient(self) -> list[int]:
        """Return the light around, as `proximity` (O); less is brighter."""
        return self._query(b"O\n", 8)

    def calibrate(self) -> None:
        """Take what the proximity sensors read now as the reading of nothing near (K), and wait until that is done.

        Raises:
            LinkError: If the end does not come.

        Example:
            >>> import kiks
            >>> sim = kiks.Simulation(robot="epuck")
            >>> kiks.EPuck(sim.port(1)).calibrate()
            >>> round(sim.time_s)
            2
        """
        self.port.write(b"K\n")
        lines, end_s = b"", self.time_s + CALIBRATION_S
        while not lines.endswith(b"finished\r\n") and self.time_s < end_s:
            lines += self.port.read_until(b"\n")
        if not lines.endswith(b"finished\r\n"):
            raise self._unexpected(b"K\n", lines)

    def ground(self) -> list[int]:
        """Return the floor sensors (M): left, centre, right; then both cliff sensors, where the program has them.

        Example:
            >>> import kiks
            >>> robot = kiks.EPuck(kiks.Simulation(robot="epuck").port(1))
            >>> len(robot.ground())
            5
        """
        return self._numbers(b"M\n")

    def acceleration(self) -> list[int]:
        """Return the accelerometer's x, y and z [counts] (A)."""
        return self._query(b"A\n", 3)

    def microphones(self) -> list[int]:
        """Return the amplitudes of the three microphones [counts] (U)."""
        return self._query(b"U\n", 3)

    def selector(self) -> int:
        """Return the position of the selector, 0 to 15 (C)."""
        return self._query(b"C\n", 1)[0]

    # ---- the camera ----

    def camera(self) -> CameraSettings:
        """Return how pictures are taken (I)."""
        return CameraSettings(*self._query(b"I\n", 5))

    def set_camera(self, mode: str = COLOUR, width: int = 40, height: int = 40, zoom: int = 8) -> None:
        """Choose how pictures are taken (J): 'grey' or 'colour', and which of the sensor's 640 x 480 pixels.

        A picture that is too large for the robot becomes its usual one: see `camera`. Width and height are at most 255,
        as an image tells each of them in a byte.

        Example:
            >>> import kiks
            >>> robot = kiks.EPuck(kiks.Simulation(robot="epuck").port(1))
            >>> robot.set_camera("grey", 40, 30, 8)
            >>> robot.image().shape
            (30, 40)
        """
        check_choice("mode", mode, (GREY, COLOUR))
        size = *whole(1, 255, width=width, height=height), *whole(1, 640, zoom=zoom)
        self._command(b"J,%d,%d,%d,%d\n" % (int(mode == COLOUR), *size))

    def image(self) -> NDArray[np.uint8]:
        """Return a picture: greys, shape [height, width], or red, green and blue, [height, width, 3]; 0 to 255.

        Example:
            >>> import kiks
            >>> robot = kiks.EPuck(kiks.Simulation(robot="epuck").port(1))
            >>> robot.image().shape
            (40, 40, 3)
        """
        self.port.write(IMAGE_REQUEST)
        head = self.port.read(3)
        if len(head) < 3 or not (head[1] and head[2] and head[0] <= 2):
            raise self._unexpected(IMAGE_REQUEST, head)
        mode, width, height = head
        size = (1 + (mode > 0)) * width * height
        data = self.port.read(size)
        if len(data) < size:
            raise self._timed_out(IMAGE_REQUEST, head + data)
        if mode > 1:
            raise LinkError("the camera must be in mode 0 or 1, but it takes pictures in YUV. Call `set_camera` first.")
        if not mode:
            return np.frombuffer(data, np.uint8).reshape(height, width)
        pixels = np.frombuffer(data, ">u2").reshape(height, width).astype(np.int64)
        bits = np.stack((pixels >> 11, pixels >> 5 & 63, pixels & 31), axis=-1)
        return np.rint(bits * (255 / 31, 255 / 63, 255 / 31)).astype(np.uint8)

    # ---- other commands ----

    def led(self, led: int, is_on: bool = True) -> None:
        """Switch an LED of the ring on or off (L): 0 is ahead, the others follow clockwise up to 7.

        Example:
            >>> import kiks
            >>> robot = kiks.EPuck(kiks.Simulation(robot="epuck").port(1))
            >>> robot.led(0)
        """
        self._command(b"L,%d,%d\n" % (check_count("led", led, 0, 7, "0 is ahead."), check_kind("is_on", is_on, bool)))

    def body_led(self, is_on: bool = True) -> None:
        """Switch the green light of the body on or off (B)."""
        self._command(b"B,%d\n" % check_kind("is_on", is_on, bool))

    def front_led(self, is_on: bool = True) -> None:
        """Switch the red LED ahead on or off (F)."""
        self._command(b"F,%d\n" % check_kind("is_on", is_on, bool))

    def sound(self, number: int) -> None:
        """Play one of five sounds, or stop (T); the reply does not wait for the end."""
        self.port.write(b"T,%d\n" % check_count("number", number, 0, 5, "0 stops."))
        self.read_confirmation(b"T\n")

    def version(self) -> str:
        """Return the version of the robot's program (V).

        Example:
            >>> import kiks
            >>> kiks.EPuck(kiks.Simulation(robot="epuck").port(1)).version()
            'Version 1.2.2 August 2008 GCtronic'
        """
        reply = self.send("V")
        if self._has_hardware_line(reply):
            self.port.read_until(b"\n")
        return reply.removeprefix("v,")

    @staticmethod
    def _has_hardware_line(reply: str) -> bool:
        # The programs of 2006 and January 2008 know no hardware version (epuck-protocol.md section 4).
        return not reply.endswith(("September 2006", "January 2008"))

    def _numbers(self, request: bytes) -> list[int]:
        """Return the numbers of a reply that has more or fewer of them on other robots."""
        self.port.write(request)
        reply = self.port.read_until(b"\n")
        letter, *words = reply.rstrip().split(b",")
        if letter != request[:1].lower() or not words:
            raise self._unexpected(request, reply)
        try:
            return list(map(int, words))
        except ValueError:
            raise LinkError(
                f"the reply to {shown(request)} must be whole numbers, but it was {shown(reply)}. Is this an e-puck?"
            ) from None
