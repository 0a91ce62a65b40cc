"""The table of ASCII commands: a row for each letter, and the functions that they share with binary requests.

Source: epuck-protocol.md 4. A function gets the robot and numbers, and returns the values of the reply. Of a line the
letter in lower case, commas and CR LF are put around them; a value of bytes is a whole reply.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from kiks.firmware.epuck.personality import EVERY
from kiks.firmware.epuck.robot import EPuckRobot, Numbers, switched
from kiks.firmware.robot_kind import RobotCommand
from kiks.model.window import SENSOR_HEIGHT, SENSOR_WIDTH

Reply = tuple[object, ...]

I2C_VALUE = 255
"""What a read on the I2C bus gives where nothing is fitted: its lines are high at rest [?]."""

ONES_MAX = 3456
"""Most characters of the link test [?]: the size of the buffer for pictures of AS12 (epuck-protocol.md 6.4)."""


@dataclass(frozen=True)
class LineCommand(RobotCommand):
    """A row of the table.

    Attributes:
        within: The letters of the personalities that know it.
        listed: Those whose help names it.
        silent: Those that carry it out without a reply.
        slot: The field of the memory that keeps its numbers.
    """

    within: str = EVERY
    listed: str = EVERY
    silent: str = ""
    slot: str = ""


def always(reply: Any) -> Callable[..., Any]:
    """Return a function that answers the same, whatever it gets: for what no robot of KiKS has."""
    return lambda robot, *numbers: reply


def sensed(sense: str) -> Callable[[EPuckRobot], Numbers]:
    """Return a function that answers what a sense reads."""
    return lambda robot: tuple(robot.sense(sense))


def read_acceleration(robot: EPuckRobot) -> Numbers:
    """Report the acceleration along x, y and z."""
    return tuple(axis + robot.personality.acceleration_zero for axis in robot.sense("accelerometer"))


def read_floor(robot: EPuckRobot) -> Numbers:
    """Report the floor under the left, middle and right sensor, and those for cliffs, left and right."""
    return tuple(robot.sense("ground")[: robot.personality.floor_count])


def read_speeds(robot: EPuckRobot) -> Numbers:
    """Report the speeds that were asked for last."""
    return tuple((robot.memory.D + robot.memory.held).tolist())


def stop(robot: EPuckRobot) -> Numbers:
    """Stop the wheels, and switch the ring of LEDs off."""
    robot.memory.ring[:] = 0
    robot.memory.held += robot.memory.D
    if robot.personality.stop_clears_all:
        robot.memory.held[:] = robot.memory.body[:] = robot.memory.front[:] = 0
    return robot.set_speeds(0, 0)


def set_body_led(robot: EPuckRobot, action: int) -> Numbers:
    """Switch the LEDs in the body."""
    robot.memory.body[:] = switched(int(robot.memory.body[0]), action)
    return ()


def set_front_led(robot: EPuckRobot, action: int) -> Numbers:
    """Switch the LED in front."""
    robot.memory.front[:] = switched(int(robot.memory.front[0]), action)
    return ()


def set_ring_led(robot: EPuckRobot, led: int, action: int) -> Numbers:
    """Switch a LED of the ring. Any number but 0 to 7 is the whole ring: the lowest bit of the action is its state."""
    ring = robot.memory.ring
    if 0 <= led < len(ring):
        ring[led] = switched(int(ring[led]), action)
    else:
        ring[:] = action & 1
    return ()


def picture_size(mode: int, width: int, height: int) -> int:
    """Return the size of a picture [bytes]: grey has one for each pixel, colours have two."""
    return width * height * (1 if mode == 0 else 2)


def set_camera(
    robot: EPuckRobot, mode: int, width: int, height: int, zoom: int, x: int | None = None, y: int | None = None
) -> Numbers:
    """Choose what pictures are: mode 0 grey, 1 colours (RGB565), 2 YUV; pixels; every how many pixels of the sensor.

    A picture without a corner is in the middle, and one with a corner that is too far out is moved in. One that is too
    large, for the buffer or for the sensor, becomes a small one in the middle.
    """
    personality = robot.personality
    is_on_sensor = zoom > 0 and 0 < width * zoom <= SENSOR_WIDTH and 0 < height * zoom <= SENSOR_HEIGHT
    if not is_on_sensor or picture_size(mode, width, height) > personality.picture_bytes:
        mode, (width, height) = 1, personality.picture_size
        zoom = zoom if 0 < zoom <= min(SENSOR_WIDTH // width, SENSOR_HEIGHT // height) else 8
        x = y = None
    corners = (SENSOR_WIDTH - width * zoom, x), (SENSOR_HEIGHT - height * zoom, y)
    robot.memory.J[:] = mode, width, height, zoom
    robot.memory.corner[:] = [
        most // 2 if given is None or not personality.places_picture else min(max(given, 0), most)
        for most, given in corners
    ]
    return ()


def read_camera(robot: EPuckRobot) -> Numbers:
    """Report what pictures are, and their size in bytes."""
    mode, width, height, zoom = robot.memory.J.tolist()
    return mode, width, height, zoom, picture_size(mode, width, height)


def read_help(robot: EPuckRobot) -> Reply:
    """List the commands; the first versions have a tabulator in one line (epuck-protocol.md 4.1)."""
    letter, column = robot.personality.letter, robot.personality.help_column
    text = "\n"
    for row in (row for row in COMMANDS if letter in row.within and letter in row.listed):
        count = min(len(row.parameters), len(getattr(robot.memory, row.slot))) if row.slot else 0
        request = f'"{row.letter}{",#" * count}"'
        blanks = "\t     " if row.letter == "H" and column == 12 else " " * (column - len(request))
        text += f"{request}{blanks}{row.name}\r\n"
    return (text.encode(),)


def calibrate(robot: EPuckRobot) -> Reply:
    """Make the proximity readings of the next seconds the zeros; it ends with a second line."""
    robot.calibrate()
    return (" Starting calibration - Remove any object in sensors range",)


def restart(robot: EPuckRobot) -> Reply:
    """Reset the robot; its last character is lost, as that happens at once (epuck-protocol.md 9.2)."""
    if robot.personality.resets:
        robot.restart()
    return (b"r\r",)


def read_ones(_: EPuckRobot, count: int) -> Reply:
    """Report as many ones as are asked for."""
    return ("1" * min(count, ONES_MAX),)


def read_i2c(robot: EPuckRobot, module: int, register: int) -> Reply:
    """Read from the I2C bus; the value comes in a second line."""
    return (module, f"{register}\r\ny,{I2C_VALUE}")


_BOTH, _XYZ, _EIGHT = ("left", "right"), ("x", "y", "z"), tuple(f"s{number}" for number in range(8))
_FLOOR, _CAMERA = ("left", "centre", "right", "cliff_left", "cliff_right"), ("mode", "width", "height", "zoom")
_I2C = ("module", "register", "value")
_ON, _COUNTS = "0 off, 1 on, else over", "0..4095"
_REMOTE = b"g IR check : 0x0, address : 0x0, data : 0x0\r\n"

_Row = LineCommand

COMMANDS: tuple[LineCommand, ...] = (
    _Row("A", "accelerometer", (), _XYZ, "768 counts are 1 g", read_acceleration, "accelerometer"),
    _Row("B", "body LED", ("action",), (), _ON, set_body_led, slot="B"),
    _Row(
        "b", "battery", (), ("counts",), "", lambda robot: (f"{robot.personality.battery_counts} (100%)",), within="AB"
    ),
    _Row("C", "selector", (), ("position",), "0..15", lambda robot: (robot.selector,)),
    _Row("D", "set speed", _BOTH, (), "steps/s, clamped by the motors", EPuckRobot.set_speeds, slot="D"),
    _Row("E", "read requested speed", (), _BOTH, "steps/s", read_speeds),
    _Row("F", "front LED", ("action",), (), _ON, set_front_led, slot="F"),
    _Row("G", "TV remote", (), ("check", "address", "data"), "hexadecimal", always((_REMOTE,))),
    _Row("g", "gyroscope", (), _XYZ, "", always((0, 0, 0)), within="AB"),
    _Row("H", "help", (), (), "", read_help),
    _Row("I", "read camera settings", (), (*_CAMERA, "size"), "size in bytes", read_camera),
    _Row("J", "set camera", (*_CAMERA, "x", "y"), (), "mode 0..2; x and y may be left out", set_camera, slot="J"),
    _Row("K", "calibrate proximity sensors", (), (), "takes 2 s", calibrate),
    _Row("L", "ring LED", ("led", "action"), (), f"led 0..7, else all; {_ON}", set_ring_led, slot="L"),
    _Row("M", "floor sensors", (), _FLOOR, "0 black..1000 white", read_floor, "ground"),
    _Row("N", "proximity sensors", (), _EIGHT, _COUNTS, lambda robot: tuple(robot.proximity()), "proximity"),
    _Row("O", "ambient light sensors", (), _EIGHT, _COUNTS, sensed("ambient"), "ambient"),
    _Row("P", "set step counters", _BOTH, (), "steps, low 16 bits", EPuckRobot.set_counters, slot="P"),
    _Row("Q", "read step counters", (), _BOTH, "steps, signed", EPuckRobot.counters, "positions"),
    _Row("R", "reset", (), (), "takes 0.4 s", restart, silent="B"),
    _Row("S", "stop, ring LEDs off", (), (), "", stop),
    _Row("T", "play a sound", ("sound",), (), "1..5, else stop", EPuckRobot.play, within="12AB", slot="T"),
    # No line reaches this one: 't' becomes 'T' (epuck-protocol.md 3.1).
    _Row("t", "temperature", (), ("degrees",), "only in binary", always(()), within="AB"),
    _Row("U", "microphone amplitudes", (), ("m0", "m1", "m2"), _COUNTS, sensed("microphones"), "microphones"),
    _Row("V", "version", (), (), "", lambda robot: (robot.personality.version,)),
    _Row("W", "write to I2C", _I2C, (), "", always(()), within="2ABW", listed="AB", silent="2W", slot="W"),
    _Row("X", "test the link", ("n",), ("ones",), "", read_ones, within="2W", listed="", slot="X"),
    _Row("Y", "read from I2C", _I2C[:2], _I2C, "", read_i2c, within="AB", slot="W"),
    _Row("Z", "list I2C modules", (), (), "", always((b"",)), within="AB", listed=""),
)
"""All commands; the names are the texts of `H`."""
