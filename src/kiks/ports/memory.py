"""The port in memory: a serial port without a wire, in the program's own process, whose waits cost no time.

A program that reads waits in simulated time: up to the instant at which the characters have arrived, or its time-out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import SHOWN_MAX, LinkError, shown
from kiks.model.checks import check_kind
from kiks.ports.port import VirtualPort
from kiks.ports.read_completion import NEVER_NS, Read, end_of_read, end_of_wait, is_complete, never_ends

if TYPE_CHECKING:
    from kiks.sim.simulation import Simulation
    from kiks.sim.wire import Wire


class SimPort(VirtualPort):
    """The computer's end of a robot's line in a simulation of this process.

    Attributes:
        sim: The simulation.
        robot: Number of the robot, from 1.
    """

    def __init__(self, sim: Simulation, robot: int) -> None:
        super().__init__(NearLine(sim, robot), sim.program)
        self.sim = sim
        self.robot = robot


class NearLine:
    """A robot's line in this process: the program's time is the simulation's."""

    def __init__(self, sim: Simulation, robot: int) -> None:
        self.lock = sim.lock
        self._sim = sim
        self._robot = robot
        self._wire = sim.wires[robot - 1]
        self._is_claimed = False

    @property
    def now_ns(self) -> int:
        """The simulated time [ns]."""
        return self._sim.now_ns

    def pass_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]."""
        self._sim.advance_to(time_ns)

    def think(self, time_ns: int) -> None:
        """Let the time pass that the program has thought [ns]; it is one program, whichever of its ports it uses."""
        sim = self._sim
        from_ns = sim.now_ns
        sim.advance_to(from_ns + time_ns)
        for wire in sim.wires:
            if wire is self._wire or wire.holder is not None:
                wire.think(from_ns, from_ns + time_ns)

    def send(self, data: bytes) -> None:
        """Put characters on the line; wait while it is full."""
        sim, wire = self._sim, self._wire
        while data:
            room_ns = wire.line.room_ns
            if room_ns > sim.now_ns:
                sim.advance_to(room_ns)
            wire.send(data[:BACKLOG_LIMIT], sim.now_ns)
            data = data[BACKLOG_LIMIT:]

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator; see `Line.read`.

        Raises:
            LinkError: If it could wait for ever.
        """
        sim, wire = self._sim, self._wire
        begin_ns = sim.now_ns
        deadline_ns = NEVER_NS if timeout_ns is None else begin_ns + timeout_ns
        while (end := end_of_read(wire, size, terminator, deadline_ns, begin_ns + poll_ns)) is None:
            sim.advance_to(wire.next_ns or 0)
        end_ns, count = end
        if end_ns == NEVER_NS:
            raise never_ends(self._robot)
        sim.advance_to(end_ns)
        return wire.line.take(count)

    def arrived_count(self) -> int:
        """Return how many characters have arrived and were not read."""
        return self._wire.line.arrived_count(self._sim.now_ns)

    def sent_ns(self) -> int:
        """Return when everything will have been sent [ns]."""
        return max(self._wire.line.sending_until_ns, self._sim.now_ns)

    def room_ns(self) -> int:
        """Return when the line takes more characters [ns]."""
        return max(self._wire.line.room_ns, self._sim.now_ns)

    def wait_for(self, reads: Sequence[Read], until_ns: int) -> list[bool]:
        """Let time pass until one of several reads is complete; see `Line.wait_for`."""
        sim = self._sim
        while True:
            end_ns, is_known = end_of_wait(sim.wires, reads, until_ns)
            if end_ns < NEVER_NS:
                sim.advance_to(end_ns)
            if is_known:
                return [is_complete(sim.wires[read.robot - 1], read, sim.now_ns) for read in reads]

    def drop_arrived(self) -> None:
        """Forget the characters that have arrived and were not read."""
        self._wire.line.take(self.arrived_count())

    @property
    def baud(self) -> int:
        """Speed of the line [bit/s]."""
        return self._wire.line.baud

    def set_baud(self, baud: int) -> None:
        """Set both ends to a speed [bit/s]."""
        self._wire.set_baud(baud)

    def claim(self, holder: str) -> None:
        """Take the line for one alone.

        Raises:
            LinkError: If somebody holds it already.
        """
        claim(self._wire, self._robot, holder)
        self._is_claimed = True

    def hang_up(self) -> None:
        """Give the line back and forget what nobody read."""
        if self._is_claimed:
            self._wire.holder = None
            self._is_claimed = False
        self._wire.hang_up()


def claim(wire: Wire, robot: int, holder: str) -> None:
    """Let somebody have a robot's line alone.

    Raises:
        ParameterError: If the holder is no text.
        LinkError: If somebody holds it already.
    """
    if wire.holder is not None:
        raise LinkError(
            f"a port must be free to be opened, but robot {robot} is in use by {wire.holder}. "
            f"Close it there first, or open another robot."
        )
    check_kind("holder", holder, str, "It says who has the port.")
    wire.holder = holder if holder.isprintable() and len(holder) <= 2 * SHOWN_MAX else shown(holder)
