"""A serial line in simulated time: the arrival of each character of commands and replies.

The next character waits for the one before it; both directions work at once (khepera-protocol.md 2.1).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from kiks.units import BITS_PER_CHARACTER, character_ns

BACKLOG_LIMIT = 4096
"""Characters on the way to the robot beyond which a sender must wait: the size of a serial driver's buffer."""

OUTPUT_LIMIT = 1 << 20
"""Most characters that wait for a reader; further replies are lost, as in any serial driver."""

TO_ROBOT, TO_HOST = 0, 1
"""Directions."""

Delay = Callable[[int, int, int], int]
"""Returns a delay [ns] for a direction, a count of characters, and when they are sent [ns]."""


class SerialTiming:
    """Both directions of one robot's line.

    Args:
        baud: Its speed [bit/s].
        bits: Bits of a character.

    Attributes:
        waiting: Unread characters for the host, arrived or not.
        delay: By how much a link that is not a cable is late; None for a cable.
        sending_until_ns: When the last character for the robot will have left, and arrived if it is a cable [ns].
        hearing_until_ns: When it will have arrived over another link [ns]; 0 for a cable.
        taken_ns: When the last character arrived that the host has read [ns].
        lost_count: Characters that were dropped because the host did not read.
    """

    def __init__(self, baud: int, bits: int = BITS_PER_CHARACTER) -> None:
        self._bits = bits
        self.set_baud(baud)
        self.delay: Delay | None = None
        self.sending_until_ns = 0
        self.taken_ns = 0
        self.lost_count = 0
        self.hearing_until_ns = 0
        self._answering_until_ns = 0
        self.waiting = bytearray()
        # The replies in `waiting`, oldest first: start of the first character [ns], time of one [ns], their count.
        self._pieces: deque[list[int]] = deque()

    def set_baud(self, baud: int) -> None:
        """Change the speed for all later characters."""
        self.baud = baud
        self.character_ns = character_ns(baud, self._bits)

    def save(self) -> tuple[int, int, int, int]:
        """Return the speed [bit/s] and until when characters leave, reach the robot, and reach the host [ns]."""
        return self.baud, self.sending_until_ns, self.hearing_until_ns, self._answering_until_ns

    def restore(self, baud: int, sending_until_ns: int, hearing_until_ns: int, answering_until_ns: int) -> None:
        """Go back to what `save` returned; the host has read everything."""
        self.set_baud(baud)
        self.sending_until_ns, self.hearing_until_ns = sending_until_ns, hearing_until_ns
        self._answering_until_ns = answering_until_ns
        self.forget()

    def room_ns(self, count: int = 0) -> int:
        """Return when the buffer of the sender has room for some characters [ns]; it holds `BACKLOG_LIMIT`."""
        return self.sending_until_ns - (BACKLOG_LIMIT - count) * self.character_ns

    def send(self, count: int, at_ns: int) -> int:
        """Send characters to the robot; return the start of the first one there [ns]."""
        start_ns = max(at_ns, self.sending_until_ns)
        self.sending_until_ns = start_ns + count * self.character_ns
        if self.delay is not None:
            start_ns = max(at_ns + self.delay(TO_ROBOT, count, at_ns), self.hearing_until_ns)
            self.hearing_until_ns = start_ns + count * self.character_ns
        return start_ns

    def carry(self, count: int, at_ns: int) -> int:
        """Send characters to the host that another object stores; return the start of the first one there [ns]."""
        if self.delay is not None:
            at_ns += self.delay(TO_HOST, count, at_ns)
        start_ns = max(at_ns, self._answering_until_ns)
        self._answering_until_ns = start_ns + count * self.character_ns
        return start_ns

    def answer(self, data: bytes, at_ns: int) -> int | None:
        """Send a reply to the host; return its start [ns], None if it is empty or lost."""
        if not data:
            return None
        if len(self.waiting) + len(data) > OUTPUT_LIMIT:
            self.lost_count += len(data)
            return None
        start_ns = self.carry(len(data), at_ns)
        self.waiting += data
        self._pieces.append([start_ns, self.character_ns, len(data)])
        return start_ns

    @property
    def reply_count(self) -> int:
        """Number of characters of the oldest waiting reply."""
        return self._pieces[0][2] if self._pieces else 0

    @property
    def reply_end_ns(self) -> int | None:
        """When the last character of the oldest waiting reply arrives [ns]; None if none waits."""
        return self.arrival_ns(self.reply_count)

    def arrived_count(self, now_ns: int, *, in_whole_replies: bool = False) -> int:
        """Return the number of waiting characters that have arrived, or of those in replies that have arrived whole."""
        count = 0
        for start_ns, step_ns, length in self._pieces:
            if start_ns + length * step_ns <= now_ns:
                count += length
                continue
            return count if in_whole_replies else count + max((now_ns - start_ns) // step_ns, 0)
        return count

    def arrival_ns(self, count: int) -> int | None:
        """Return the arrival time of the waiting character number `count` [ns]; None if fewer wait."""
        for start_ns, step_ns, length in self._pieces:
            if count <= length:
                return start_ns + count * step_ns
            count -= length
        return None

    def take(self, count: int) -> bytes:
        """Remove and return the first `count` waiting characters."""
        if count == len(self.waiting):
            if count:
                start_ns, step_ns, length = self._pieces[-1]
                self.taken_ns = start_ns + length * step_ns
            taken = bytes(self.waiting)
            self.forget()
            return taken
        taken = bytes(self.waiting[:count])
        del self.waiting[:count]
        left = len(taken)
        while left:
            piece = self._pieces[0]
            gone = min(left, piece[2])
            piece[0] += gone * piece[1]
            piece[2] -= gone
            left -= gone
            self.taken_ns = piece[0]
            if not piece[2]:
                self._pieces.popleft()
        return taken

    def cut_short(self, until_ns: int, now_ns: int) -> None:
        """Remove characters that would reach the robot later than `until_ns` [ns], and all for the host."""
        self.sending_until_ns = min(self.sending_until_ns, until_ns)
        self.hearing_until_ns = min(self.hearing_until_ns, until_ns)
        self._answering_until_ns = min(self._answering_until_ns, now_ns)

    def forget(self) -> None:
        """Drop all unread characters."""
        self.waiting.clear()
        self._pieces.clear()
