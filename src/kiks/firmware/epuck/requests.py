"""The table of binary requests: a row for each letter, in bytes of its own (epuck-protocol.md 5).

The bytes of most are those of a capital letter of the ASCII commands, negated, and of a small letter for a variant.
Numbers have 16 bits, the low byte first. A function gets the robot and numbers, and returns whole numbers that the
answer has, or its bytes.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kiks.firmware.epuck import commands
from kiks.firmware.epuck.commands import I2C_VALUE, always, sensed
from kiks.firmware.epuck.personality import EVERY
from kiks.firmware.epuck.robot import EPuckRobot, Numbers
from kiks.model.window import SENSOR_HEIGHT, SENSOR_WIDTH, Window

SAMPLES = 100
"""How many the robot keeps of each microphone (epuck-protocol.md 6.3)."""

SILENCE_COUNTS = 2048
"""What a microphone gives without a sound: the middle of 12 bits [?]."""

STOP_SOUND = 0x20
"""The bit that stops a sound; those below begin one (epuck2-wifi.md 2)."""

AIR_TEMPERATURE_C = 25
"""What the second e-puck reads where its program asks the sensor at all [?]."""

FAR_MM = 2000
"""What the distance sensor of the second e-puck reads where it sees nothing (epuck-protocol.md 6.3)."""

DARK_FLOOR_COUNTS = 1023
"""Ambient light under the robot (epuck2-wifi.md 4)."""


@dataclass(frozen=True)
class BinaryRequest:
    """A row of the table.

    Attributes:
        code: Its byte.
        act: Carries it out.
        arguments: The bytes that follow, as `struct` has them.
        asks: Whether it answers.
        within: The letters of the personalities that know it.
        slot: The field of the memory that keeps its numbers.
        at_once: How many bytes of the answer go out before those that were asked for earlier.
    """

    code: int
    act: Callable[..., Numbers | bytes]
    arguments: str = ""
    asks: bool = True
    within: str = EVERY
    slot: str = ""
    at_once: int = 0


def words(numbers: Numbers) -> bytes:
    r"""Return the low 16 bits of numbers, low byte first.

    Example:
        >>> words((1, -1))
        b'\x01\x00\xff\xff'
    """
    return struct.pack(f"<{len(numbers)}H", *(number & 0xFFFF for number in numbers))


def _raw_acceleration(robot: EPuckRobot) -> Numbers:
    zero = robot.personality.raw_acceleration_zero
    return tuple(axis + zero for axis in robot.sense("accelerometer"))


def _spherical_acceleration(robot: EPuckRobot) -> bytes:
    """Return the magnitude, and the orientation and inclination [degrees]; flat on the floor both are 0.

    The orientation is counted from -y over -x [?].
    """
    x, y, z = robot.sense("accelerometer")
    magnitude = math.sqrt(x * x + y * y + z * z)
    inclination = math.degrees(math.atan2(math.hypot(x, y), z))
    orientation = math.degrees(math.atan2(x, y)) + 180.0 if 5.0 <= inclination <= 160.0 else 0.0
    return struct.pack("<fff", magnitude, orientation, inclination)


def _picture(robot: EPuckRobot) -> bytes:
    """Return the mode, width and height, a byte each, and the pixels, row by row."""
    mode, width, height, zoom = robot.memory.J.tolist()
    x, y = robot.memory.corner.tolist()
    # Commands give sizes that the sensor has; a saved state that is not of ours may hold any.
    width, height = min(max(width, 1), SENSOR_WIDTH), min(max(height, 1), SENSOR_HEIGHT)
    pixels = robot.picture(Window(x, y, width, height, zoom))
    return bytes((mode & 0xFF, width & 0xFF, height & 0xFF)) + encoded(pixels, mode)


def encoded(pixels: NDArray[np.uint8], mode: int) -> bytes:
    """Return the pixels of a picture as the robot sends them.

    Args:
        pixels: Red, green and blue, [height, width, 3].
        mode: 0 grey (the shares of the colours in it are those of television, ITU-R BT.601), 2 YUV: the grey, then in
            turn the difference of blue and of red to it [?]; any other RGB565, RRRRRGGG before GGGBBBBB.
    """
    red, green, blue = np.moveaxis(pixels.reshape(-1, 3).astype(np.int64), 1, 0)
    grey = (77 * red + 150 * green + 29 * blue) >> 8
    if mode == 0:
        return grey.astype(np.uint8).tobytes()
    if mode == 2:
        colour = np.where(np.arange(grey.size) % 2 == 0, (blue - grey) * 144 >> 8, (red - grey) * 183 >> 8) + 128
        pair = grey, np.clip(colour, 0, 255)
    else:
        pair = red & 0xF8 | green >> 5, (green & 0x1C) << 3 | blue >> 3
    return np.stack(pair, axis=1).astype(np.uint8).tobytes()


def _set_led(robot: EPuckRobot, led: int, action: int) -> Numbers:
    """Switch a LED of the ring, or the body's (8) or the front one (9) where the personality knows them."""
    if robot.personality.requests_name_body and led in (8, 9):
        return (commands.set_body_led if led == 8 else commands.set_front_led)(robot, action)
    return commands.set_ring_led(robot, led, action)


def _floor(robot: EPuckRobot) -> Numbers:
    return tuple(robot.sense("ground")[: robot.personality.floor_words])


def _proximity(robot: EPuckRobot) -> Numbers:
    return tuple(robot.proximity(is_calibrated=robot.personality.calibrates_requests))


def _samples(robot: EPuckRobot) -> bytes:
    """Return the samples of the microphones, square waves of the amplitudes that they hear, and the last place."""
    lows = [(SILENCE_COUNTS - amplitude // 2, amplitude) for amplitude in robot.sense("microphones")]
    waves = [words((low, low + amplitude) * (SAMPLES // 2)) for low, amplitude in lows]
    return b"".join(waves) + bytes((SAMPLES - 1,))


# ---- of the second e-puck ----


def _four_microphones(robot: EPuckRobot) -> Numbers:
    """Return right, left, back and front; the last, which the first e-puck lacks, hears the mean of the sides."""
    right, left, back = robot.sense("microphones")
    return right, left, back, (right + left) // 2


def all_sensors(robot: EPuckRobot) -> bytes:
    """Return the 103 bytes of F8 (epuck2-wifi.md 4)."""
    seen = (*robot.proximity(), *robot.sense("ambient"), FAR_MM, *_four_microphones(robot))
    return (
        words(tuple(robot.sense("accelerometer")))
        + _spherical_acceleration(robot)
        + bytes((*bytes(6 + 12), AIR_TEMPERATURE_C))  # without a gyroscope and a magnetometer
        + words((*seen, *robot.counters(), robot.personality.battery_counts))
        + bytes((*bytes(1 + 3), robot.selector))  # without a memory card and a remote
        + words((*robot.sense("ground")[:3], *(DARK_FLOOR_COUNTS,) * 3))
        + bytes(1)
    )


def set_all(robot: EPuckRobot, settings: int, left: int, right: int, leds: int, *colours_and_sound: int) -> Numbers:
    """Carry out the 19 bytes of F7 (epuck2-wifi.md 2).

    Args:
        robot: The robot.
        settings: Bit 0 calibrates, bit 2 makes the next two set the counters.
        left: The speed of this wheel [steps/s], or its counter.
        right: As above.
        leds: A bit each for the LEDs 0, 2, 4 and 6 of the ring, body and front.
        colours_and_sound: As of `_set_colours`, and the bits of the sounds.
    """
    *colours, sound = colours_and_sound
    if settings & 1:
        robot.calibrate(is_silent=True)
    if settings & 4:
        robot.set_counters(left, right)
    else:
        robot.set_speeds(*robot.remember("D", (left, right)))
    states = [leds >> bit & 1 for bit in range(6)]
    robot.memory.ring[::2] = states[:4]
    robot.memory.body[:], robot.memory.front[:] = states[4:]
    _set_colours(robot, *colours)
    if sound:
        # Sounds have the numbers of their bits; the lowest one plays.
        robot.play(0 if sound & STOP_SOUND else (sound & -sound).bit_length())
    return ()


def _set_colours(robot: EPuckRobot, *shares: int) -> Numbers:
    """Set red, green and blue [%] of the LEDs 1, 3, 5 and 7; more than 100 leaves what is."""
    colours = robot.memory.colours
    colours[:] = [old if share > 100 else share for old, share in zip(colours.tolist(), shares, strict=True)]
    robot.memory.ring[1::2] = colours.reshape(4, 3).any(axis=1)
    return ()


_ZERO = always(bytes(1))

REQUESTS: tuple[BinaryRequest, ...] = (
    BinaryRequest(0x9F, _raw_acceleration),  # -'a'
    BinaryRequest(0xBF, _spherical_acceleration),  # -'A'
    BinaryRequest(0x9E, lambda robot: (robot.personality.battery_counts,), within="AB"),  # -'b'
    BinaryRequest(0xBC, EPuckRobot.set_speeds, "hh", asks=False, slot="D"),  # -'D'
    BinaryRequest(0xBB, commands.read_speeds),  # -'E'
    BinaryRequest(0x99, always((0, 0, 0)), within="AB"),  # -'g'
    BinaryRequest(0xB7, _picture),  # -'I'
    BinaryRequest(0xB4, _set_led, "bb", asks=False, slot="L"),  # -'L'
    BinaryRequest(0xB3, _floor),  # -'M'
    BinaryRequest(0xB2, _proximity),  # -'N'
    BinaryRequest(0xB1, sensed("ambient")),  # -'O'
    BinaryRequest(0xB0, EPuckRobot.set_counters, "hh", asks=False, within="ABW", slot="P"),  # -'P'
    BinaryRequest(0xAF, EPuckRobot.counters),  # -'Q'
    BinaryRequest(0x8C, lambda robot: bytes((robot.personality.temperature_c,)), within="AB"),  # -'t'
    BinaryRequest(0x8B, sensed("microphones")),  # -'u'
    BinaryRequest(0xAB, _samples, within="12AW", at_once=3 * 2 * SAMPLES),  # -'U'
    BinaryRequest(0xA9, always(()), "BBB", asks=False, within="AB", slot="W"),  # -'W'
    BinaryRequest(0x89, always(()), "35B", asks=False, within="AB"),  # -'w', a panel of coloured LEDs
    BinaryRequest(0xA7, always(bytes((I2C_VALUE,))), "BB", within="B", slot="W"),  # -'Y'
    BinaryRequest(0xF8, all_sensors, within="B"),
    BinaryRequest(0xF7, set_all, "BhhB12BB", asks=False, within="B"),
    BinaryRequest(0xF6, _set_colours, "12B", asks=False, within="B"),
    BinaryRequest(0xF5, _ZERO, within="B"),  # button
    BinaryRequest(0xF4, _four_microphones, within="B"),
    BinaryRequest(0xF3, always((FAR_MM,)), within="B"),
    BinaryRequest(0xF2, _ZERO, within="B"),  # memory card
    BinaryRequest(0xF1, _ZERO, "B", within="B"),  # magnetometer on or off
    BinaryRequest(0xF0, _ZERO, "B", within="B"),  # mode of the proximity sensors
    BinaryRequest(0xEF, _ZERO, "B", within="B"),  # distance sensor on or off
)
"""All requests. -'W' of BT20 has no arguments and no effect, so there it is a letter like those that nothing knows."""
