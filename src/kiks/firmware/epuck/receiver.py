"""From the characters that arrive to commands (epuck-protocol.md 3): lines, and binary requests that end with a 0.

A letter of a request that asks for nothing acts as soon as its arguments are there, as on the robot: so programs that
leave out the closing 0 drive, too. From the first question on, all letters up to the 0 are one command, so that their
answers are one block; they act when the 0 arrives, which in programs comes some milliseconds later at most.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from kiks.firmware.receiver import LINE_LIMIT, Receiver

_ENDS = b"\r\n"
_LINE_END = re.compile(rb"[\r\n]")
_BLANK = b"\x80"
"""A letter that opens a request and does nothing."""


class SercomReceiver(Receiver):
    r"""The input of an e-puck.

    A line that is too long keeps its first characters, and a request its first letters.

    Args:
        arguments: For each binary letter how many bytes follow it, and whether it asks for something.

    Example:
        >>> receiver = SercomReceiver({0xBC: (4, False), 0xB2: (0, True), 0xAF: (0, True)})
        >>> receiver.feed(b"\nD,5,5\r\xbc\1\0\1\0\xb2\xaf")
        [(6, b'D,5,5'), (11, b'\xbc\x01\x00\x01\x00')]
        >>> receiver.partial, receiver.feed(b"\0")
        (b'\xb2\xaf', [(0, b'\xb2\xaf')])
    """

    def __init__(self, arguments: Mapping[int, tuple[int, bool]]) -> None:
        super().__init__()
        self._arguments = arguments
        # Beyond this there is no room for the longest letter any more.
        self._request_limit = LINE_LIMIT - 1 - max(count for count, _ in arguments.values())
        self.clear()

    def clear(self) -> None:
        """Forget what is not complete."""
        # What is kept of a line or of a request, where the last letter of that begins, and how many bytes it lacks.
        self._kept = bytearray()
        self._begin = self._missing = 0
        self._in_line = self._in_request = False

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """Take characters; return each command that they complete with the index of its last one in `data`."""
        if (
            not (self._in_line or self._in_request)
            and data.find(b"\n") == len(data) - 1
            and 1 < len(data) <= LINE_LIMIT
            and 0 < data[0] < 0x80
            and b"\r" not in data
        ):
            return [(len(data) - 1, data[:-1])]  # what nearly every program sends: one whole line
        commands: list[tuple[int, bytes]] = []
        place = 0
        while place < len(data):
            if self._in_line:
                place = self._take_line(data, place, commands)
            elif self._in_request:
                place = self._take_request(data, place, commands)
            elif data[place]:
                self._in_request = data[place] >= 0x80
                self._in_line = not self._in_request
            else:
                place += 1
        return commands

    def _take_line(self, data: bytes, place: int, commands: list[tuple[int, bytes]]) -> int:
        """Take the characters of a line; the robot waits here for one that is no terminator, whatever it is."""
        while not self._kept and place < len(data) and data[place] in _ENDS:
            place += 1
        match = _LINE_END.search(data, place)
        end = len(data) if match is None else match.start()
        self._kept += data[place : min(end, place + LINE_LIMIT - len(self._kept))]
        if match is not None:
            commands.append((end, self.partial))
            self.clear()
        return end + 1

    def _take_request(self, data: bytes, place: int, commands: list[tuple[int, bytes]]) -> int:
        """Take the bytes of a request; those that are no letter of this robot do nothing."""
        while place < len(data):
            if self._missing:
                part = data[place : place + self._missing]
                self._kept += part
                self._missing -= len(part)
                place += len(part)
            elif not data[place]:
                if self._kept:
                    commands.append((place, bytes(self._kept)))
                self.clear()
                return place + 1
            elif (letter := data[place]) in self._arguments:
                self._begin, self._missing = len(self._kept), self._arguments[letter][0]
                self._kept.append(letter)
                place += 1
            else:
                place += 1
                continue
            if not self._missing:
                self._end_letter(place - 1, commands)
        return place

    def _end_letter(self, index: int, commands: list[tuple[int, bytes]]) -> None:
        if len(self._kept) > self._request_limit:
            del self._kept[self._begin :]
        elif not self._begin and not self._arguments[self._kept[0]][1]:
            commands.append((index, bytes(self._kept)))
            self._kept.clear()

    def complete_length(self, data: bytes | bytearray) -> int:
        """Return the length of the first line or request in some characters, with its end; 0 if none is complete."""
        place = len(data) - len(data.lstrip(b"\0"))
        if place < len(data) and data[place] < 0x80:
            match = _LINE_END.search(data, place)
            return 0 if match is None else match.end()
        while place < len(data) and data[place]:
            place += 1 + self._arguments.get(data[place], (0,))[0]
        return place + 1 if place < len(data) else 0

    @property
    def partial(self) -> bytes:
        """Characters that bring a new receiver to this one's state; empty if it waits for either mode."""
        kept = bytes(self._kept)
        if self._in_line:
            # After a terminator the robot takes any character for the first one of a line.
            return kept if kept and 0 < kept[0] < 0x80 else b"\n" + kept
        return kept or _BLANK * self._in_request

    @partial.setter
    def partial(self, part: bytes) -> None:
        self.clear()
        self.feed(part)

    def closing(self) -> bytes:
        """Return the characters that end what is not complete."""
        if self._in_request:
            return bytes(self._missing + 1)
        return b"\n" if self._kept else b""
