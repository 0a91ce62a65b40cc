"""When a read is complete: one rule for the port in memory and for programs in other processes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from kiks.errors import LinkError, shown

if TYPE_CHECKING:
    from kiks.clock.serial_timing import SerialTiming
    from kiks.sim.wire import Wire

NEVER_NS = 1 << 63
"""A time that no simulation reaches [ns]."""

REPLY_END = b""
"""The terminator of a read that gets all replies that have arrived whole, and at least one: as sockets bring them."""


class Read(NamedTuple):
    """A read that a thread of a program waits for.

    Attributes:
        robot: Number of the robot, from 1.
        size: How many characters at most; None: up to the terminator.
        terminator: What ends the read; None: the size alone; `REPLY_END`: the end of a reply.
    """

    robot: int
    size: int | None
    terminator: bytes | None = None


def end_of_read(
    wire: Wire, size: int | None, terminator: bytes | None, deadline_ns: int, begin_ns: int, poll_ns: int = 0
) -> tuple[int, int] | None:
    """Return when a read ends [ns] and with how many characters; None while that depends on a command to come.

    It is known once the robot has answered, before the characters arrive: no other program can send to this robot.

    Args:
        wire: The robot's line, with every command carried out that acts up to now.
        size: How many characters at most; None: up to the terminator.
        terminator: As of a `Read`.
        deadline_ns: When it ends at the latest [ns]; `NEVER_NS` if it has no time-out, and is returned if it would
            never end.
        begin_ns: When it begins [ns].
        poll_ns: What it costs at least if it is in vain [ns].
    """
    line = wire.line
    count = _complete(line, size, terminator)
    if count:
        arrival_ns = line.arrival_ns(count)
        if arrival_ns is not None and arrival_ns <= deadline_ns:
            if terminator == REPLY_END:
                count = line.arrived_count(max(arrival_ns, begin_ns), in_whole_replies=True)
            return arrival_ns, count if size is None else min(count, size)
    elif size == 0:
        return 0, 0
    end_ns = max(deadline_ns, begin_ns + poll_ns)
    may_speak = wire.pending or wire.firmware.speaks_by_itself
    if may_speak and wire.next_ns is not None and wire.next_ns <= end_ns:
        return None
    if end_ns >= NEVER_NS:
        return NEVER_NS, 0
    arrived = line.arrived_count(end_ns, in_whole_replies=terminator == REPLY_END)
    return end_ns, arrived if size is None else min(arrived, size)


def end_of_wait(wires: Sequence[Wire], reads: Sequence[Read], until_ns: int) -> tuple[int, bool]:
    """Return up to when nothing can change for those who wait for the first of several reads.

    Args:
        wires: The lines of all robots, with every command carried out that acts up to now.
        reads: What is waited for.
        until_ns: When the wait ends at the latest [ns]; `NEVER_NS` if it has no end.

    Returns:
        A time [ns], and whether the wait ends there; if not, a robot acts then, and the question is to be asked again.
    """
    end_ns, next_ns = until_ns, NEVER_NS
    for robot, size, terminator in reads:
        wire = wires[robot - 1]
        end = end_of_read(wire, size, terminator, until_ns, 0)
        if end is not None:
            end_ns = min(end_ns, end[0])
        elif wire.next_ns is not None:
            next_ns = min(next_ns, wire.next_ns)
    return (next_ns, False) if next_ns <= end_ns and next_ns < NEVER_NS else (end_ns, True)


def is_complete(wire: Wire, read: Read, now_ns: int) -> bool:
    """Return whether what a read waits for has arrived."""
    count = _complete(wire.line, read.size, read.terminator)
    return read.size == 0 or 0 < count <= wire.line.arrived_count(now_ns)


def is_ended(data: bytes, terminator: bytes | None) -> bool:
    """Return whether what was read ends a read, whatever its size."""
    return bool(data) and terminator is not None and data.endswith(terminator)


def never_ends(robot: int, wire: Wire) -> LinkError:
    """Return the error of a read without time-out to which no answer can come."""
    partial = wire.firmware.receiver.partial.decode("latin-1")
    found = f"{shown(partial)} has no end of line" if partial else "no command is on the line"
    return LinkError(
        f"robot {robot} must have been asked something before its answer is read, but {found}, so the read would never "
        "end. Send a command that ends in a line feed, or set a timeout."
    )


def _complete(line: SerialTiming, size: int | None, terminator: bytes | None) -> int:
    """Return how many of the waiting characters make a read complete, 0 while they do not."""
    waiting = line.waiting
    if terminator == REPLY_END:
        return line.reply_count
    if terminator is not None:
        found = waiting.find(terminator)
        if found >= 0:
            end = found + len(terminator)
            return end if size is None or end < size else size
    return size if size is not None and size <= len(waiting) else 0
