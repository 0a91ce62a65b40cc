"""The second e-puck over Wi-Fi: commands of 21 bytes come in, and a stream of packets goes out (epuck2-wifi.md 1 to 6).

The robot goes on with what it was told last: it sends the packets that this command asks for, round by round, until
another one comes. In each round it reads at most one command, samples its sensors, and carries the command out, whether
that is a new one or not.

A round whose packets find no room, as the program does not read, is silent, and the robot goes on reading commands. The
real one blocks then, but only when the computer's buffers are full, too, after ten seconds or more. And as what a robot
does never depends on what is read, a recording needs no reads to make the same run again.

Not modelled are the on-board avoidance (bit 1 of the settings), the LED 2, which shows the state of the radio, and what
F8 of `requests` lacks: gyroscope, magnetometer, distance sensor, memory card and remote.
"""

from __future__ import annotations

from dataclasses import replace
from struct import Struct

import numpy as np

from kiks.engine.state import REGISTER_BYTES
from kiks.firmware.epuck.kind import EPUCK
from kiks.firmware.epuck.requests import all_sensors, encoded, set_all
from kiks.firmware.epuck.robot import MEMORY, EPuckRobot
from kiks.firmware.receiver import Receiver
from kiks.model.window import Window

COMMAND = Struct("<3Bhh14B")
"""Id, request, settings, left, right, LEDs, red, green and blue of the LEDs 2, 4, 6 and 8, sound (epuck2-wifi.md 2)."""

COMMAND_ID = 0x80

IMAGES, SENSORS = 1, 2
"""The bits of a request; without any bit it asks for empty packets."""

SILENCE = 4
"""A request of another bit alone: nothing is sent."""

IMAGE_PACKET, SENSOR_PACKET, EMPTY_PACKET = b"\1", b"\2", b"\3"
"""The ids of packets (epuck2-wifi.md 3)."""

WINDOW = Window(0, 0, 160, 120, 4)
"""The whole sensor of the camera, by every fourth pixel (epuck2-wifi.md 5)."""

PACKET_BYTES = {IMAGES: 1 + 2 * WINDOW.width * WINDOW.height, SENSORS: 1 + 104}
"""The sizes of packets, with their ids."""

ROUND_NS = 20_000_000
"""Time of a round without an image [ns] (epuck2-wifi.md 6)."""

IMAGE_ROUND_NS = 100_000_000
"""Time of a round with an image [ns]: about 10 in a second (epuck2-wifi.md 6)."""

UNREAD_MAX = 5
"""As many commands as these at once: all but the newest are dropped (epuck2-wifi.md 2)."""

BUFFER_BYTES = 5760
"""What the robot's radio holds for a program that does not read [?]; a round that has begun goes out whole."""

SELECTOR = 15
"""The position in which the robot speaks over Wi-Fi (epuck2-wifi.md 1)."""

UNCHANGED = 255
"""Stands for a share of a colour that stays as it is: any above 100 does."""

_STRANGE, _ACTIVE, _GONE = range(3)

_OF_LINES = ("P", "B", "F", "L", "T", "W", "X", "free")
_SHARED = [(name, MEMORY[name]) for name in MEMORY.names or () if name not in _OF_LINES]
_FIELDS = [*_SHARED, ("command", np.dtype(("u1", COMMAND.size))), ("client", np.dtype(("u1", 1)))]
_FREE = REGISTER_BYTES - np.dtype(_FIELDS).itemsize

WIFI_MEMORY = np.dtype([*_FIELDS, ("free", np.dtype(("u1", _FREE)))])
"""What the robot remembers: of `MEMORY` all but what lines need, the last `command`, and what the `client` is: one that
has sent no command yet, one that gets packets, or one that is gone, whose last commands still act."""


class WifiReceiver(Receiver):
    r"""The input of the radio.

    Attributes:
        unread: Commands that have arrived and that the robot has not read yet.

    Example:
        >>> receiver = WifiReceiver()
        >>> receiver.feed(b"\x80" + bytes(19)), receiver.feed(b"\1\x80")
        ([], [(0, b'\x80\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x01')])
        >>> receiver.partial
        b'\x80'
    """

    def __init__(self) -> None:
        super().__init__()
        self.unread = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """Take bytes; return each command that they complete with the index of its last one in `data`."""
        before, whole = len(self._partial), bytes(self._partial) + data
        ends = range(COMMAND.size, len(whole) + 1, COMMAND.size)
        self._partial[:] = whole[len(ends) * COMMAND.size :]
        return [(end - 1 - before, whole[end - COMMAND.size : end]) for end in ends]

    def keep(self, command: bytes) -> None:
        """Let a command wait; of `UNREAD_MAX` only the newest will be read, so a further one takes its place."""
        del self.unread[(UNREAD_MAX - 1) * COMMAND.size :]
        self.unread += command

    def read(self) -> bytes:
        """Return the next command that waits, or nothing."""
        if len(self.unread) == UNREAD_MAX * COMMAND.size:
            del self.unread[: -COMMAND.size]
        command = bytes(self.unread[: COMMAND.size])
        del self.unread[: COMMAND.size]
        return command

    @property
    def partial(self) -> bytes:
        """The commands that wait, and the one that is not complete."""
        return bytes(self.unread + self._partial)

    @partial.setter
    def partial(self, part: bytes) -> None:
        whole = len(part) - len(part) % COMMAND.size
        self.unread[:], self._partial[:] = part[:whole], part[whole:]

    @staticmethod
    def complete_length(data: bytes | bytearray) -> int:
        """Return the length of the first command in some bytes; 0 if none is complete."""
        return COMMAND.size if len(data) >= COMMAND.size else 0

    def closing(self) -> bytes:
        """Return the bytes that end a command that is not complete."""
        return bytes(-len(self._partial) % COMMAND.size)


class EPuckWifiFirmware(EPuckRobot):
    r"""The firmware of a second e-puck with the radio.

    Example:
        >>> from kiks.engine.state import State
        >>> from kiks.model.robot import RobotSpec
        >>> state = State.empty(world_count=1, robot_count=1)
        >>> spec = RobotSpec.load("khepera").with_changes(firmware__protocol_version="AS20")
        >>> robot = EPuckWifiFirmware(spec, state, 0, lambda sense: [0] * {"positions": 2}.get(sense, 8))
        >>> robot.execute(b"\x80" + bytes(20), 0), robot.wakes_ns
        (b'', 0)
        >>> robot.wake(0), robot.wakes_ns
        (b'\x03', 20000000)
    """

    receiver: WifiReceiver
    layout = WIFI_MEMORY

    def reset(self) -> None:
        """Set everything to what it is when the power comes; the body stays where it is."""
        self.receiver = WifiReceiver()
        super().reset()
        self.selector = SELECTOR

    def execute(self, command: bytes, now_ns: int) -> bytes:
        """Let a command wait until the next round, which begins now [ns] if the robot rests; answer nothing."""
        self.now_ns = now_ns
        self.receiver.keep(command)
        if self.memory.client[0] == _GONE:
            self.memory.client[:] = _STRANGE
        if self.wakes_ns is None:
            self.wakes_ns = now_ns
        return b""

    def leave(self) -> None:
        """Send nothing more: the next program hears nothing before it has sent a command."""
        self.memory.client[:] = _GONE

    def wake(self, now_ns: int) -> bytes:
        """Go on with a calibration, or do a round; return its packets."""
        if self.memory.task[0]:
            super().wake(now_ns)
            # No packet comes meanwhile, as the robot waits for the end [I].
            if self.wakes_ns is None and self._goes_on():
                self.wakes_ns = now_ns
            return b""
        self.now_ns = now_ns
        self._take_command()
        client, request = int(self.memory.client[0]), int(self.memory.command[1])
        packets = b"" if client != _ACTIVE or self._is_full() else self._packets(request)
        self.wakes_ns = None
        if self._goes_on():
            self.wakes_ns = now_ns + (IMAGE_ROUND_NS if request & IMAGES else ROUND_NS)
        if client != _STRANGE:
            _, _, *arguments = COMMAND.unpack(self.memory.command.tobytes())
            arguments[4:7] = [UNCHANGED] * 3  # the LED 2
            set_all(self, *arguments)
        return packets

    def _take_command(self) -> None:
        """Read a command; a program has to begin with the right id, which is not checked again (epuck2-wifi.md 2)."""
        if command := self.receiver.read():
            self.memory.command[:] = tuple(command)
            if self.memory.client[0] == _STRANGE and command[0] == COMMAND_ID:
                self.memory.client[:] = _ACTIVE

    def _goes_on(self) -> bool:
        """Return whether a round follows without another command."""
        request = int(self.memory.command[1])
        is_sending = self.memory.client[0] == _ACTIVE and (request == 0 or bool(request & (IMAGES | SENSORS)))
        return is_sending or bool(self.receiver.unread)

    def _packets(self, request: int) -> bytes:
        """Return the packets of a round: an image, then the sensors as they were before it."""
        image = IMAGE_PACKET + encoded(self.picture(WINDOW), 1) if request & IMAGES else b""
        sensors = SENSOR_PACKET + all_sensors(self) + bytes(1) if request & SENSORS else b""
        return EMPTY_PACKET if request == 0 else image + sensors

    def _is_full(self) -> bool:
        """Return whether so much is unread that there is no room for another round."""
        request = int(self.memory.command[1])
        return self.unread_count() > BUFFER_BYTES + sum(count for bit, count in PACKET_BYTES.items() if request & bit)

    @property
    def will_speak(self) -> bool:
        """Whether it sends something by itself before it gets another command, or some of it is read."""
        return super().will_speak and not self._is_full()


def speeds_command(left: float, right: float) -> bytes:
    """Return the command that turns the wheels and does nothing else but switch LEDs off and end the stream.

    So a robot whose program is gone stays silent. The program that goes on gets packets again with its next command.
    """
    return COMMAND.pack(COMMAND_ID, SILENCE, 0, int(left), int(right), 0, *(UNCHANGED,) * 12, 0)


EPUCK_WIFI = replace(
    EPUCK,
    firmware=EPuckWifiFirmware,
    commands=(),
    usual="",
    speeds=speeds_command,
    speeds_reply=b"",
    senses=dict.fromkeys(EPUCK.senses, "sensor packet"),
)
