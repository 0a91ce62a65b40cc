"""The line behind a port in memory: program and simulation run in one process, so waiting takes no real time.

A program that reads waits in simulated time: until the characters have arrived, or until its timeout.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kiks.errors import SHOWN_MAX, LinkError, shown
from kiks.model.checks import check_kind
from kiks.sim.event_loop import EventLoop
from kiks.sim.read_completion import NEVER_NS, Read, end_of_read, end_of_wait, is_complete, never_ends
from kiks.sim.robot_state import state_of
from kiks.sim.wire import Wire


class LocalLine:
    """A robot's line in this process: the program's time is that of the simulation.

    Args:
        loop: The event loop of the simulation.
        robot: Number of the robot, from 1.
    """

    def __init__(self, loop: EventLoop, robot: int) -> None:
        self.lock = loop.lock
        self._loop = loop
        self._world = loop.world
        self._robot = robot
        self._wire = loop.wires[robot - 1]
        self._is_claimed = False
        self.pass_to = self.wait_for_room = loop.advance_to

    @property
    def now_ns(self) -> int:
        """The simulated time [ns]."""
        return self._world.now_ns

    known_ns = now_ns

    def think(self, time_ns: int) -> None:
        """Let the time pass that the program has thought [ns]; all ports of a simulation belong to one program."""
        from_ns = self._world.now_ns
        self._loop.advance_to(from_ns + time_ns)
        for wire in self._loop.wires:
            if wire is self._wire or wire.holder is not None:
                wire.think(from_ns, from_ns + time_ns)

    def send(self, data: bytes, spare: int) -> bool:
        """Put characters on the line, if it has room for them and some more; see `Line.send`."""
        wire, now_ns = self._wire, self._world.now_ns
        if wire.line.room_ns(len(data) + spare) > now_ns:
            return False
        wire.send(data, now_ns)
        return True

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator; see `Line.read`."""
        world, advance_to, wire = self._world, self._loop.advance_to, self._wire
        begin_ns = world.now_ns
        deadline_ns = NEVER_NS if timeout_ns is None else begin_ns + timeout_ns
        while (end := end_of_read(wire, size, terminator, deadline_ns, begin_ns, poll_ns)) is None:
            advance_to(wire.next_ns or 0)
        end_ns, count = end
        if end_ns == NEVER_NS:
            raise never_ends(self._robot, wire)
        advance_to(end_ns)
        if not count:
            wire.note_wait(end_ns)
        return wire.line.take(count)

    def arrived_count(self) -> int:
        """Return how many characters have arrived and were not read."""
        return self._wire.arrived_count(self._world.now_ns)

    def sent_ns(self) -> int:
        """Return when everything will have been sent [ns]."""
        return max(self._wire.line.sending_until_ns, self._world.now_ns)

    @property
    def taken_ns(self) -> int:
        """When the last character arrived that was read [ns]."""
        return self._wire.line.taken_ns

    def room_ns(self, count: int) -> int:
        """Return when the line has room for some characters [ns]; a time that is over: it has."""
        return self._wire.line.room_ns(count)

    def wake(self) -> None:
        """Do nothing: no other thread of the program goes on while one waits."""

    def wait_for(self, reads: Sequence[Read], until_ns: int) -> list[bool]:
        """Let time pass until one of several reads is complete; see `Line.wait_for`."""
        loop, world = self._loop, self._world
        while True:
            end_ns, is_known = end_of_wait(loop.wires, reads, until_ns)
            if end_ns < NEVER_NS:
                loop.advance_to(end_ns)
            if is_known:
                return [is_complete(loop.wires[read.robot - 1], read, world.now_ns) for read in reads]

    def drop_arrived(self) -> None:
        """Drop the characters that have arrived and were not read."""
        self._wire.line.take(self.arrived_count())

    @property
    def baud(self) -> int:
        """Speed of the line [bit/s]."""
        return self._wire.line.baud

    def set_baud(self, baud: int) -> None:
        """Set both ends to a speed [bit/s]."""
        self._wire.set_baud(baud)

    def claim(self, holder: str) -> None:
        """Reserve the line for one program."""
        claim(self._wire, self._robot, holder)
        self._is_claimed = True

    def hang_up(self) -> None:
        """Release the line and drop what was not read."""
        if self._is_claimed:
            self._wire.holder = None
            self._is_claimed = False
        self._wire.hang_up()

    def stand(self, stands: bool) -> None:
        """Do nothing: the world does nothing without its one program."""

    def look(self) -> tuple[Any, ...]:
        """Return what is to be known of the robot; see `state_of`."""
        return state_of(self._loop, self._robot)


def claim(wire: Wire, robot: int, holder: str) -> None:
    """Reserve a robot's line for one program.

    Raises:
        LinkError: If another program holds it.
    """
    if wire.holder is not None:
        raise LinkError(
            f"a port must be free to be opened, but robot {robot} is in use by {wire.holder}. "
            f"Close it there first, or open another robot."
        )
    check_kind("holder", holder, str, "It says who has the port.")
    wire.holder = holder if holder.isprintable() and len(holder) <= 2 * SHOWN_MAX else shown(holder)
