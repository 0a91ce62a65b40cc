"""From the characters that arrive to lines (khepera-protocol.md 3.1): CR or LF ends one, pieces may be of any size."""

from __future__ import annotations

import re

LINE_LIMIT = 256
"""Longest line kept [bytes]; a longer one is dropped up to its end and answered as unknown (khepera-protocol.md 3.1)."""

OVERFLOW = b"?"
"""What stands for a line that was too long: no command, no tool."""

_TERMINATOR = re.compile(rb"[\r\n]")


class Receiver:
    r"""The robot's input buffer.

    Example:
        >>> receiver = Receiver()
        >>> receiver.feed(b"D,5")
        []
        >>> receiver.feed(b",5\r\nN\n")
        [(2, b'D,5,5'), (3, b''), (5, b'N')]
    """

    def __init__(self) -> None:
        self._partial = bytearray()
        self._is_overflowing = False

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """Take characters; return each line that they complete with the index of its terminator in `data`."""
        lines = []
        begin = 0
        for match in _TERMINATOR.finditer(data):
            end = match.start()
            self._keep(data[begin:end])
            lines.append((end, OVERFLOW if self._is_overflowing else bytes(self._partial)))
            self.clear()
            begin = end + 1
        self._keep(data[begin:])
        return lines

    def _keep(self, part: bytes) -> None:
        if len(self._partial) + len(part) > LINE_LIMIT:
            self._is_overflowing = True
            self._partial.clear()
        elif not self._is_overflowing:
            self._partial += part

    def clear(self) -> None:
        """Forget a line that is not complete."""
        self._partial.clear()
        self._is_overflowing = False
