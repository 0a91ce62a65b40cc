"""The e-puck's firmware: a line or a request comes in, a reply goes out; never an exception (epuck-protocol.md 3)."""

from __future__ import annotations

import re
from collections.abc import Callable
from struct import Struct

from kiks.engine.state import State
from kiks.firmware.epuck.commands import COMMANDS
from kiks.firmware.epuck.personality import BUFFER_BYTES
from kiks.firmware.epuck.receiver import SercomReceiver
from kiks.firmware.epuck.requests import REQUESTS, words
from kiks.firmware.epuck.robot import CALIBRATION_NS, RESET_NS, EPuckRobot
from kiks.model.robot import RobotSpec

UNKNOWN = b"z,Command not found\r\n"

_NUMBER = re.compile(rb",[ \t\v\f]*([+-]?[0-9]+)")


class EPuckFirmware(EPuckRobot):
    r"""The firmware of one e-puck.

    Example:
        >>> from kiks.engine.state import State
        >>> from kiks.model.robot import RobotSpec
        >>> state = State.empty(world_count=1, robot_count=1)
        >>> spec = RobotSpec.load("khepera").with_changes(firmware__protocol_version="AS12")
        >>> robot = EPuckFirmware(spec, state, 0, lambda sense: [0] * 8)
        >>> robot.execute(b"D,600,-2000", 0), robot.execute(b"e", 0), robot.execute(b"X", 0)
        (b'd\r\n', b'e,600,-2000\r\n', b'z,Command not found\r\n')
        >>> robot.execute(b"\xbb\xb2", 0).hex(" ", 2)
        '5802 30f8 0000 0000 0000 0000 0000 0000 0000 0000'
    """

    def __init__(self, spec: RobotSpec, state: State, number: int, sense: Callable[[str], list[int]]) -> None:
        super().__init__(spec, state, number, sense)
        letter = self.personality.letter
        self._commands = {row.letter.encode(): row for row in COMMANDS if letter in row.within}
        rows = (row for row in REQUESTS if letter in row.within)
        self._requests = {row.code: (row, Struct("<" + row.arguments)) for row in rows}
        self.receiver = SercomReceiver({code: (form.size, row.asks) for code, (row, form) in self._requests.items()})

    def execute(self, command: bytes, now_ns: int) -> bytes:
        """Carry out a line without its terminator, or a binary request without its 0, at a time [ns]."""
        self.now_ns = now_ns
        if command[:1] >= b"\x80":
            return self._answer_request(command)
        row = self._commands.get(self._letter(command))
        if row is None:
            return UNKNOWN
        if row.slot:
            count = len(row.parameters)
            found = numbers(command, count)
            # A field may be longer than what the command takes, and shorter: then the other numbers may be left out.
            stored = self.remember(row.slot, found)
            values = row.act(self, *stored[:count], *found[len(stored) :])
        else:
            values = row.act(self)
        if self.personality.letter in row.silent:
            return b""
        if values and isinstance(values[0], bytes):
            return values[0]
        return ",".join((row.letter.lower(), *map(str, values))).encode() + b"\r\n"

    def busy_ns(self, command: bytes) -> int:
        """Return for how long the robot takes no other command once it has begun to carry one out [ns]."""
        letter = self._letter(command)
        return CALIBRATION_NS if letter == b"K" else RESET_NS if letter == b"R" and self.personality.resets else 0

    def _letter(self, line: bytes) -> bytes:
        return line[:1] if line[:1] in self.personality.cased else line[:1].upper()

    def _answer_request(self, request: bytes) -> bytes:
        """Carry out the letters of a request; return their answers, in one block."""
        at_once, block = bytearray(), bytearray()
        place = 0
        while place < len(request):
            row, form = self._requests[request[place]]
            arguments = form.unpack_from(request, place + 1)
            place += 1 + form.size
            if len(block) < BUFFER_BYTES or not row.asks:
                if row.slot:
                    self.remember(row.slot, arguments)
                found = row.act(self, *arguments)
                answer = found if isinstance(found, bytes) else words(found)
                at_once += answer[: row.at_once]
                block += answer[row.at_once :]
        return bytes(at_once + block)


def numbers(line: bytes, count: int) -> list[int]:
    """Return the numbers of a line, at most some, up to the first that is none, as C's `scanf` does.

    Example:
        >>> numbers(b"D, 5,-7", 2), numbers(b"D,5x,7", 2), numbers(b"D 5,7", 2)
        ([5, -7], [5], [])
    """
    found: list[int] = []
    place = 1
    while len(found) < count and (match := _NUMBER.match(line, place)):
        found.append(int(match[1]))
        place = match.end()
    return found
