"""How time passes while real programs are connected: live, or in lockstep with them.

Live: the world runs at a multiple of real time, whoever is there, and bytes are sent when they come.
Lockstep: the world stands still until a whole command is there, and then runs to the end of the reply. How the
operating system cuts the bytes, and how long the program really took, has no influence.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Protocol

from kiks.clock.line import BACKLOG_LIMIT
from kiks.clock.pace import Pace
from kiks.ports.endpoint import Channel
from kiks.sim.simulation import Simulation
from kiks.sim.wire import Wire
from kiks.units import NS_PER_S

IDLE_S = 0.05
"""Longest sleep [s]: a request to stop is noticed within it."""

COALESCE_S = 0.002
"""How long the characters of a reply that is under way are collected before they are handed over [s]."""

SLICE_NS = NS_PER_S
"""Most simulated time that passes before the ports are looked at again [ns]."""

TERMINATORS = (b"\r", b"\n")

_TERMINATOR = re.compile(rb"[\r\n]")


@dataclass(eq=False)
class Link:
    """A robot's line and the client on it.

    Attributes:
        robot: Number of the robot, from 1.
        wire: Its line in the simulation.
        channel: The client; None while there is none.
        kept: The beginning of a command, kept back until its end is there (lockstep only).
        last: The last character that was sent before it (lockstep only).
        events: What the channel's descriptor is being waited for.
        refused: Endpoints at which somebody was turned away since the client came.
    """

    robot: int
    wire: Wire
    channel: Channel | None = None
    kept: bytearray = field(default_factory=bytearray)
    last: bytes = b"\n"
    events: int = 0
    refused: set[str] = field(default_factory=set)

    def clear(self) -> None:
        """Forget what a client has left behind; the robot drives on."""
        self.kept.clear()
        self.last = b"\n"
        self.refused.clear()
        self.wire.hang_up()


class Timing(Protocol):
    """One of the two ways. All of it is called with the simulation's lock held."""

    def start(self) -> None:
        """Begin now."""

    def advance(self, links: Iterable[Link]) -> float:
        """Let pass the time that is due, hand over what has arrived, and return how long nothing will happen [s]."""

    def receive(self, link: Link, data: bytes) -> None:
        """Take characters from a client."""

    def is_full(self, link: Link) -> bool:
        """Say whether the client has to wait until the line has carried what it sent."""


class Live:
    """The world runs at the pace of the wall clock."""

    def __init__(self, sim: Simulation, pace: Pace) -> None:
        self._sim = sim
        self._pace = pace

    def start(self) -> None:
        """Bind the simulated time of now to the wall clock of now."""
        self._pace.start(self._sim.now_ns)

    def _catch_up(self) -> bool:
        """Let time pass up to now, a slice at most; say whether that was all."""
        sim, due_ns = self._sim, self._pace.now_ns()
        until_ns = min(due_ns, sim.now_ns + SLICE_NS)
        sim.advance_to(until_ns)
        sim.sync()
        return until_ns == due_ns

    def advance(self, links: Iterable[Link]) -> float:
        """Run up to the wall clock and deliver the characters that have arrived."""
        sim, pace = self._sim, self._pace
        has_caught_up = self._catch_up()
        pace.report(sim.now_ns)
        next_ns = sim.next_event_ns()
        wait_s = IDLE_S if next_ns is None else min(pace.wall_wait_s(next_ns), IDLE_S)
        for link in links:
            line = link.wire.line
            if link.channel is None:
                continue
            if line.waiting:
                link.channel.write(line.take(line.arrived_count(sim.now_ns)))
                last_ns = line.arrival_ns(len(line.waiting)) if line.waiting else None
                if last_ns is not None:
                    wait_s = min(wait_s, COALESCE_S, pace.wall_wait_s(last_ns))
            if self.is_full(link):
                wait_s = min(wait_s, pace.wall_wait_s(line.sending_until_ns - BACKLOG_LIMIT * line.character_ns))
        return wait_s if has_caught_up else 0.0

    def receive(self, link: Link, data: bytes) -> None:
        """Send the characters now."""
        self._catch_up()
        link.wire.send(data, self._sim.now_ns)

    def is_full(self, link: Link) -> bool:
        """Say whether as many characters are on the line as a serial driver holds."""
        line = link.wire.line
        return line.sending_until_ns - self._sim.now_ns > BACKLOG_LIMIT * line.character_ns


class Lockstep:
    """The world moves while a command and its reply are on the line, and for the thinking time before it."""

    def __init__(self, sim: Simulation, thinking_ns: int) -> None:
        self._sim = sim
        self._thinking_ns = thinking_ns

    def start(self) -> None:
        """Do nothing: time passes with the first command."""

    def advance(self, links: Iterable[Link]) -> float:
        """Let no time pass."""
        return IDLE_S

    def receive(self, link: Link, data: bytes) -> None:
        """Carry out the commands that are complete; keep the rest."""
        kept = link.kept
        kept += data
        begin = 0
        while begin < len(kept):
            match = _TERMINATOR.search(kept, begin, begin + BACKLOG_LIMIT)
            if match is not None:
                end = match.end()
            elif len(kept) - begin >= BACKLOG_LIMIT:
                # No command is as long as that: the robot may drop it, so that it is not kept for ever.
                end = begin + BACKLOG_LIMIT
            else:
                break
            self._exchange(link, bytes(kept[begin:end]))
            begin = end
        del kept[:begin]

    def _exchange(self, link: Link, piece: bytes) -> None:
        """Send a command, let time pass up to the last character of its reply, and hand that over."""
        sim, wire, line = self._sim, link.wire, link.wire.line
        last, link.last = link.last, piece[-1:]
        if piece in TERMINATORS and last in TERMINATORS:
            # The LF of CR LF left right behind the CR. The robot is silent about an empty line, so nobody waits for it.
            wire.send(piece, line.sending_until_ns if last + piece == b"\r\n" else sim.now_ns)
            if not wire.firmware.spec.quirks.answer_empty_lines:
                return
        else:
            sim.advance_to(sim.now_ns + self._thinking_ns)
            wire.send(piece, sim.now_ns)
        while wire.pending and (next_ns := wire.next_ns) is not None:
            sim.advance_to(next_ns)
        if line.waiting:
            count = len(line.waiting)
            sim.advance_to(line.arrival_ns(count) or sim.now_ns)
            if link.channel is not None:
                link.channel.write(line.take(count))

    def is_full(self, link: Link) -> bool:
        """Say no: a command is carried out before the next one is read."""
        return False
