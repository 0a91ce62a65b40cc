"""From the characters that arrive to lines (khepera-protocol.md 3.1): CR or LF ends one, pieces may be of any size."""

from __future__ import annotations

import re

LINE_LIMIT = 256
"""Longest line that may be a command [bytes]; a longer one is answered as unknown (khepera-protocol.md 3.1)."""

LINE_ENDS = (b"\r", b"\n")

_LINE_END = re.compile(rb"[\r\n]")


class Receiver:
    r"""The input buffer of a robot whose commands are lines.

    Of a line that is too long one character more than the limit is kept: enough to see that it is too long.

    Args:
        keeps_empty_lines: False: an empty line vanishes here and costs no time, so that CR LF is one line end.

    Example:
        >>> receiver = Receiver()
        >>> receiver.feed(b"D,5")
        []
        >>> receiver.feed(b",5\r\nN\n")
        [(2, b'D,5,5'), (5, b'N')]
    """

    def __init__(self, *, keeps_empty_lines: bool = False) -> None:
        self._keeps_empty_lines = keeps_empty_lines
        self._partial = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """Take characters; return each line that they complete with the index of its terminator in `data`."""
        if (
            not self._partial
            and data.find(b"\n") == len(data) - 1
            and 1 < len(data) <= LINE_LIMIT
            and b"\r" not in data
        ):
            return [(len(data) - 1, data[:-1])]  # what nearly every program sends: one whole line
        lines = []
        begin = 0
        for match in _LINE_END.finditer(data):
            end = match.start()
            self._keep(data[begin:end])
            if self._partial or self._keeps_empty_lines:
                lines.append((end, bytes(self._partial)))
            self.clear()
            begin = end + 1
        self._keep(data[begin:])
        return lines

    def complete_length(self, data: bytes | bytearray) -> int:
        """Return the length of the first command in some characters, with its end; 0 if none is complete."""
        match = _LINE_END.search(data)
        return 0 if match is None else match.end()

    def _keep(self, part: bytes) -> None:
        self._partial += part[: LINE_LIMIT + 1 - len(self._partial)]

    @property
    def partial(self) -> bytes:
        """The line that is not complete, as far as it is kept."""
        return bytes(self._partial)

    @partial.setter
    def partial(self, part: bytes) -> None:
        self._partial[:] = part

    def clear(self) -> None:
        """Forget a line that is not complete."""
        self._partial.clear()

    def closing(self) -> bytes:
        """Return the characters that end what is not complete, or change nothing."""
        return b"\n"
