"""A record of what went over a robot's line and when, and of where the time went."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from kiks.sim.ring_buffer import RingBuffer

PIECE_LIMIT = 4096
"""Most pieces that are kept: a second of uninterrupted traffic at 115200 bit/s has about 300."""

THOUGHT_LIMIT = 4096
"""Most spans of thinking that are kept."""

_TERMINATORS = b"\r\n"

Span = tuple[int, int]
"""Beginning and end [ns]."""


class WirePiece(NamedTuple):
    """Characters that belong together: a command with its end, a reply, or a part of a command.

    Attributes:
        is_sent: True: to the robot. False: from the robot.
        data: The characters.
        first_ns: When the first character began [ns]; over a link that is not a cable, when it was sent.
        last_ns: When the last character has arrived [ns].
        acted_ns: When the command acts that ends here, or that this replies to [ns]; None for a part of a command.
    """

    is_sent: bool
    data: bytes
    first_ns: int
    last_ns: int
    acted_ns: int | None


class TimeShares(NamedTuple):
    """Where the time of a window went [ns]: each instant counts once, for the first of these that it belongs to.

    Attributes:
        link_ns: Characters were on the line, either way.
        robot_ns: The robot processed a command.
        thinking_ns: The program thought.
        waiting_ns: All else: the program waited, or there was no program.
    """

    link_ns: int
    robot_ns: int
    thinking_ns: int
    waiting_ns: int

    @property
    def window_ns(self) -> int:
        """Length of the window [ns]."""
        return sum(self)


class WireLog:
    """Keeps the newest pieces that went over one robot's line.

    Args:
        now_ns: When the record begins [ns].

    Attributes:
        pieces: What went over the line. A piece is recorded once it is certain, which is before it has arrived.
    """

    def __init__(self, now_ns: int) -> None:
        self.pieces: RingBuffer[WirePiece] = RingBuffer(PIECE_LIMIT)
        self._thoughts: RingBuffer[Span] = RingBuffer(THOUGHT_LIMIT)
        self._begin_ns = now_ns

    def send(self, data: bytes, start_ns: int, character_ns: int, acts: list[tuple[int, int]], air_ns: int = 0) -> None:
        """Note characters for the robot.

        Args:
            data: The characters.
            start_ns: When the first character begins [ns].
            character_ns: How long each takes [ns].
            acts: For each command that they complete: the index of its terminator, and when it acts [ns].
            air_ns: For how long they were on a link that is not a cable [ns].
        """
        if len(acts) == 1 and acts[0][0] == len(data) - 1:  # the usual case: one whole line
            end_ns = start_ns + len(data) * character_ns
            self.pieces.append(WirePiece(True, data, start_ns - air_ns, end_ns, acts[0][1]))
            return
        begin, begin_ns = 0, start_ns - air_ns
        pieces: list[tuple[int, int, int | None]] = []
        for index, acted_ns in acts:
            end = index + 1
            # The LF of CR LF belongs to the command before it.
            while end < len(data) and data[end] in _TERMINATORS and all(end != other for other, _ in acts):
                end += 1
            pieces.append((begin, end, acted_ns))
            begin = end
        if begin < len(data):
            pieces.append((begin, len(data), None))
        self.pieces.add(
            WirePiece(True, data[first:end], begin_ns + first * character_ns, start_ns + end * character_ns, acted_ns)
            for first, end, acted_ns in pieces
        )

    def answer(self, data: bytes, start_ns: int, character_ns: int, acted_ns: int, air_ns: int = 0) -> None:
        """Note a reply."""
        end_ns = start_ns + len(data) * character_ns
        self.pieces.append(WirePiece(False, data, start_ns - air_ns, end_ns, acted_ns))

    def think(self, from_ns: int, until_ns: int) -> None:
        """Note that the program of this line has thought."""
        self._thoughts.append((from_ns, until_ns))

    @property
    def since_ns(self) -> int:
        """The record is complete from this time on [ns]."""
        first, pieces = self.pieces.since(0)
        first_thought, thoughts = self._thoughts.since(0)
        return max(
            self._begin_ns,
            pieces[0].first_ns if first and pieces else 0,
            thoughts[0][0] if first_thought and thoughts else 0,
        )

    def shares(self, from_ns: int, until_ns: int, *, thinks_since_ns: int | None = None) -> TimeShares:
        """Return where the time of a window went; the window begins later if the record does.

        Args:
            from_ns: When the window begins [ns].
            until_ns: When it ends [ns].
            thinks_since_ns: From this time on, all time that neither line nor robot takes counts as thinking [ns].
        """
        pieces, thoughts = self.pieces.since(0)[1], self._thoughts.since(0)[1]
        # A real program says nothing of its thinking: it has all time that line and robot leave.
        if thinks_since_ns is not None:
            thoughts.append((thinks_since_ns, until_ns))
        return share_time(
            (max(from_ns, self.since_ns), until_ns),
            link=[(piece.first_ns, piece.last_ns) for piece in pieces],
            robot=[(piece.last_ns, piece.acted_ns) for piece in pieces if piece.is_sent and piece.acted_ns is not None],
            thinking=thoughts,
        )


def share_time(window: Span, *, link: Iterable[Span], robot: Iterable[Span], thinking: Iterable[Span]) -> TimeShares:
    """Give each instant of a window to the first claim on it, so the shares add up to the window exactly.

    Example:
        >>> share_time((0, 10), link=[(0, 2), (5, 8)], robot=[(1, 6)], thinking=[(9, 20)])
        TimeShares(link_ns=5, robot_ns=3, thinking_ns=1, waiting_ns=1)
    """
    taken: list[Span] = []
    taken_ns = [0]
    for spans in (link, robot, thinking):
        taken = _union(taken, spans, window)
        taken_ns.append(sum(until_ns - from_ns for from_ns, until_ns in taken))
    _, link_ns, robot_ns, thinking_ns = taken_ns
    whole_ns = max(window[1] - window[0], 0)
    return TimeShares(link_ns, robot_ns - link_ns, thinking_ns - robot_ns, whole_ns - thinking_ns)


def _union(taken: list[Span], spans: Iterable[Span], window: Span) -> list[Span]:
    """Return the union of spans within a window, sorted and disjoint."""
    begin_ns, end_ns = window
    inside = [
        (max(from_ns, begin_ns), min(until_ns, end_ns))
        for from_ns, until_ns in spans
        if max(from_ns, begin_ns) < min(until_ns, end_ns)
    ]
    union: list[Span] = []
    for from_ns, until_ns in sorted([*taken, *inside]):
        if union and from_ns <= union[-1][1]:
            union[-1] = (union[-1][0], max(union[-1][1], until_ns))
        else:
            union.append((from_ns, until_ns))
    return union
