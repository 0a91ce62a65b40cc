"""The two ways in which time passes while real programs are connected.

Live: the world runs at a multiple of real time, with or without clients, and bytes are sent when they come.
Lockstep (`lockstep.py`): the world waits for each command, and then runs to the end of the reply.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
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


class Client(Protocol):
    """A program at a robot's line. The server calls it with the simulation's lock held."""

    @property
    def is_full(self) -> bool:
        """Whether it must wait until the line has carried its characters."""

    @property
    def has_left(self) -> bool:
        """Whether it has gone, and the next one may come."""

    def receive(self, data: bytes) -> None:
        """Take characters of it."""

    def leave(self) -> None:
        """Let its remaining commands act, as it has gone."""


@dataclass(eq=False)
class ServedRobot:
    """A robot's line and the client on it.

    Attributes:
        robot: Number of the robot, from 1.
        wire: Its line in the simulation.
        client: The client, or the last one that was there.
        channel: The connection to it; None while there is none.
        is_leaving: Whether the client has gone, and its commands still act.
        is_dropped: Whether the server must disconnect the client.
        events: The events that the selector reports of the channel's descriptor.
        refused: Endpoints at which another client was rejected since this one came.
    """

    robot: int
    wire: Wire
    client: Client = field(init=False)
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


class TimePolicy(ABC):
    """One of the two ways. The server calls it with the simulation's lock held.

    Attributes:
        forgets: Whether commands of a client that has gone may be dropped; which ones then depends on real time.
    """

    forgets = False

    def start(self) -> None:  # noqa: B027
        """Begin now."""

    @abstractmethod
    def enter(self, served: ServedRobot) -> Client:
        """Return the client that has come to a robot."""

    def catch_up(self) -> None:  # noqa: B027
        """Let the time that is due pass; the server then reads what the clients have sent."""

    @abstractmethod
    def advance(self, served_robots: Iterable[ServedRobot]) -> float:
        """Hand over the characters that have arrived; return the time until the next event [s of real time]."""


class Live(TimePolicy):
    """The world runs at the pace of the wall clock."""

    forgets = True

    def __init__(self, sim: Simulation, pace: Pace) -> None:
        self._sim = sim
        self._pace = pace
        self._is_behind = False

    def start(self) -> None:
        """Bind the present simulated time to the present wall clock."""
        self._pace.start(self._sim.now_ns)

    def enter(self, served: ServedRobot) -> LiveClient:
        """Return the client that has come to a robot; the world runs with or without clients."""
        return LiveClient(served, self._sim)

    def catch_up(self) -> None:
        """Let time pass up to now, at most one slice."""
        sim, due_ns = self._sim, self._pace.now_ns()
        # After a pause of the computer the ports are served in between.
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
            line, channel = served.wire.line, served.channel
            if channel is None:
                continue
            if line.waiting:
                channel.write(line.take(line.arrived_count(sim.now_ns, in_whole_replies=not channel.by_character)))
                # What is left of a reply: not each character is worth a system call.
                if (end_ns := line.reply_end_ns) is not None:
                    wait_s = min(wait_s, pace.wall_wait_s(end_ns), COALESCE_S if channel.by_character else IDLE_S)
            if line.room_ns() > sim.now_ns:
                wait_s = min(wait_s, pace.wall_wait_s(line.room_ns()))
        return 0.0 if self._is_behind else wait_s


class LiveClient:
    """A client whose bytes go out as they come."""

    has_left = True
    """The next client's commands follow on the line."""

    def __init__(self, served: ServedRobot, sim: Simulation) -> None:
        self._served = served
        self._sim = sim

    def receive(self, data: bytes) -> None:
        """Send the characters now."""
        self._served.wire.send(data, self._sim.now_ns)

    @property
    def is_full(self) -> bool:
        """Whether the line is as full as the buffer of a serial driver."""
        return self._served.wire.line.room_ns() > self._sim.now_ns

    def leave(self) -> None:
        """Let the commands on the line act, unless that takes too long."""
        now_ns = self._sim.now_ns
        if self._served.wire.drop_after(now_ns + LEFT_BEHIND_NS, now_ns):
            _log.warning(
                "the client of robot %d has gone, but its commands were more than %g s ahead of the robot: the rest of "
                "them is dropped. Read a line after each command.",
                self._served.robot,
                LEFT_BEHIND_NS / NS_PER_S,
            )
