"""The two ways in which time passes while real programs are connected.

Live: the world runs at a multiple of real time, with or without clients, and bytes are sent when they come.
Lockstep (`lockstep.py`): the world waits for each command, and then runs to the end of the reply.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Protocol

from kiks.clock.pace import Pace
from kiks.ports.endpoint import Channel
from kiks.sim.simulation import Simulation
from kiks.sim.wire import Wire
from kiks.units import NS_PER_S

IDLE_S = 0.05
"""Longest sleep [s]: the server notices a request to stop within this time."""

COALESCE_S = 0.002
"""Time for which the server collects characters of a reply before it hands them over [s]."""

SLICE_NS = NS_PER_S
"""Most simulated time between two checks of the ports [ns]."""

LEFT_BEHIND_NS = 2 * NS_PER_S
"""Time for which commands of a client that has gone still act [ns]. Without a limit, a client that is killed in the
middle of a flood would keep the next one waiting for minutes."""

_log = logging.getLogger("kiks.serve")


@dataclass(eq=False)
class ServedRobot:
    """A robot's line and the client on it.

    Attributes:
        robot: Number of the robot, from 1.
        wire: Its line in the simulation.
        channel: The client; None while there is none.
        is_leaving: Whether the client has gone, and its commands still act.
        is_dropped: Whether the server must disconnect the client.
        events: The events that the selector reports of the channel's descriptor.
        refused: Endpoints at which another client was rejected since this one came.
    """

    robot: int
    wire: Wire
    channel: Channel | None = None
    is_leaving: bool = False
    is_dropped: bool = False
    events: int = 0
    refused: set[str] = field(default_factory=set)

    def clear(self) -> None:
        """Forget everything about the last client; the robot drives on."""
        self.is_leaving = self.is_dropped = False
        self.refused.clear()
        self.wire.hang_up()


class TimePolicy(Protocol):
    """One of the two ways. The server calls it with the simulation's lock held.

    Attributes:
        forgets: Whether commands of a client that has gone may be dropped; which ones then depends on real time.
    """

    forgets: bool

    def start(self) -> None:
        """Begin now."""

    def enter(self, served: ServedRobot) -> None:
        """Add a client."""

    def leave(self, served: ServedRobot) -> None:
        """Let the remaining commands of a client that has gone act."""

    def has_left(self, served: ServedRobot) -> bool:
        """Return whether the next client may come."""

    def catch_up(self) -> None:
        """Let the time that is due pass; the server then reads what the clients have sent."""

    def advance(self, served_robots: Iterable[ServedRobot]) -> float:
        """Hand over the characters that have arrived; return the time until the next event [s of real time]."""

    def receive(self, served: ServedRobot, data: bytes) -> None:
        """Take characters of a client."""

    def is_full(self, served: ServedRobot) -> bool:
        """Return whether the client must wait until the line has carried its characters."""


class Live:
    """The world runs at the pace of the wall clock."""

    forgets = True

    def __init__(self, sim: Simulation, pace: Pace) -> None:
        self._sim = sim
        self._pace = pace
        self._is_behind = False

    def start(self) -> None:
        """Bind the present simulated time to the present wall clock."""
        self._pace.start(self._sim.now_ns)

    def enter(self, served: ServedRobot) -> None:
        """Do nothing: the world runs with or without clients."""

    def leave(self, served: ServedRobot) -> None:
        """Let the commands on the line act, unless that takes too long."""
        now_ns = self._sim.now_ns
        if served.wire.drop_after(now_ns + LEFT_BEHIND_NS, now_ns):
            _log.warning(
                "the client of robot %d has gone, but its commands were more than %g s ahead of the robot: the rest of "
                "them is dropped. Read a line after each command.",
                served.robot,
                LEFT_BEHIND_NS / NS_PER_S,
            )

    def has_left(self, served: ServedRobot) -> bool:
        """Return True: the next client's commands follow on the line."""
        return True

    def catch_up(self) -> None:
        """Let time pass up to now, at most one slice."""
        sim, due_ns = self._sim, self._pace.now_ns()
        until_ns = min(due_ns, sim.now_ns + SLICE_NS)
        sim.advance_to(until_ns)
        sim.sync()
        self._is_behind = until_ns < due_ns
        self._pace.report(sim.now_ns)

    def advance(self, served_robots: Iterable[ServedRobot]) -> float:
        """Hand over the characters that have arrived."""
        sim, pace = self._sim, self._pace
        next_ns = sim.next_event_ns()
        wait_s = IDLE_S if next_ns is None else min(pace.wall_wait_s(next_ns), IDLE_S)
        for served in served_robots:
            line = served.wire.line
            if served.channel is None:
                continue
            if line.waiting:
                by_character = served.channel.by_character
                served.channel.write(line.take(line.arrived_count(sim.now_ns, in_whole_replies=not by_character)))
                if (end_ns := line.reply_end_ns) is not None:
                    wait_s = min(wait_s, pace.wall_wait_s(end_ns), COALESCE_S if by_character else IDLE_S)
            if self.is_full(served):
                wait_s = min(wait_s, pace.wall_wait_s(line.room_ns()))
        return 0.0 if self._is_behind else wait_s

    def receive(self, served: ServedRobot, data: bytes) -> None:
        """Send the characters now."""
        served.wire.send(data, self._sim.now_ns)

    def is_full(self, served: ServedRobot) -> bool:
        """Return whether the line is as full as the buffer of a serial driver."""
        return served.wire.line.room_ns() > self._sim.now_ns
