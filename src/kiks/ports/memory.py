"""The port in memory: a serial port without a wire, in the program's own process, whose waits cost no time.

It has the methods of a pyserial port, so that a program cannot tell the difference. A program that reads waits in
simulated time: up to the instant at which the characters have arrived, or its time-out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from kiks.errors import LinkError, ParameterError
from kiks.sim.wire import BACKLOG_LIMIT
from kiks.units import ns_from_s, s_from_ns

if TYPE_CHECKING:
    from kiks.sim.simulation import Simulation


class SimPort:
    """The computer's end of a simulated robot's line.

    Attributes:
        timeout: Longest time a read waits [s] of simulated time; None waits for ever.
    """

    def __init__(self, sim: Simulation, robot: int) -> None:
        self.sim = sim
        self.robot = robot
        self.timeout: float | None = None
        self._wire = sim.wires[robot - 1]
        self._program = sim.program
        self._has_read = True
        self._is_claimed = False

    # ---- what pyserial's ports have ----

    @property
    def baudrate(self) -> int:
        """Speed of the line [bit/s]; setting it sets the robot's end too, as its mode selector would."""
        return self._wire.line.baud

    @baudrate.setter
    def baudrate(self, baud: int) -> None:
        if not isinstance(baud, int) or not 75 <= baud <= 4_000_000:
            raise ParameterError(
                f"baudrate must be a whole number from 75 to 4000000 bit/s, but it was {baud!r}. Usual: 9600."
            )
        with self.sim.lock:
            self._wire.set_baud(baud)

    def write(self, data: bytes) -> int:
        """Send characters; return how many. They leave one after the other while the program goes on."""
        sim, wire, count = self.sim, self._wire, len(data)
        with sim.lock:
            self._enter(is_command=self._has_read)
            self._has_read = False
            while data:
                room_ns = wire.line.sending_until_ns - BACKLOG_LIMIT * wire.line.character_ns
                if room_ns > sim.now_ns:
                    sim.advance_to(room_ns)
                wire.send(data[:BACKLOG_LIMIT], sim.now_ns)
                data = data[BACKLOG_LIMIT:]
            self._program.leave(has_acted=True)
        return count

    def read(self, size: int = 1) -> bytes:
        """Return `size` characters, fewer if the time-out is over first.

        Raises:
            LinkError: If there is no time-out and no reply can come any more.
        """
        return self._read(size, None)

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Return everything up to and including a terminator, less if the time-out is over first.

        Raises:
            LinkError: If there is no time-out and no reply can come any more.
        """
        return self._read(size, expected)

    def readline(self, size: int | None = -1) -> bytes:
        """Return a line with its end, or what came of it before the time-out.

        Raises:
            LinkError: If there is no time-out and no reply can come any more.
        """
        return self._read(None if size is None or size < 0 else size, b"\n")

    @property
    def in_waiting(self) -> int:
        """Characters that have arrived and were not read. Asking again and again lets time pass."""
        sim = self.sim
        with sim.lock:
            self._enter(is_command=False)
            self._pass(self._program.ask())
            count = self._wire.line.arrived_count(sim.now_ns)
            self._program.leave(has_acted=False)
        return count

    def flush(self) -> None:
        """Wait until everything has been sent."""
        with self.sim.lock:
            self.sim.advance_to(self._wire.line.sending_until_ns)

    def reset_input_buffer(self) -> None:
        """Drop the characters that have arrived and were not read."""
        with self.sim.lock:
            self.sim.advance_to(self.sim.now_ns)
            self._wire.line.take(self._wire.line.arrived_count(self.sim.now_ns))

    def reset_output_buffer(self) -> None:
        """Do nothing: what was written is on the line already."""

    def claim(self, holder: str) -> None:
        """Take the line for this port alone, as opening it by name does; `close` gives it back.

        Args:
            holder: Who it is, in words for the next one who tries.

        Raises:
            LinkError: If somebody holds it already.
        """
        if self._wire.holder is not None:
            raise LinkError(
                f"a port must be free to be opened, but robot {self.robot} is in use by {self._wire.holder}. "
                f"Close it there first, or open another robot."
            )
        self._wire.holder = holder
        self._is_claimed = True

    def close(self) -> None:
        """Hang up: forget what nobody read. The robot drives on, and the port may be opened again."""
        with self.sim.lock:
            if self._is_claimed:
                self._wire.holder = None
                self._is_claimed = False
            self._wire.hang_up()

    # ---- time, as the program lives it ----

    def ask_ns(self) -> int:
        """Return the simulated time [ns]; asking again and again lets time pass, so that a loop may wait for it."""
        with self.sim.lock:
            self._enter(is_command=False)
            self._pass(self._program.ask())
            self._program.leave(has_acted=False)
            return self.sim.now_ns

    @property
    def time_s(self) -> float:
        """The simulated time [s], asked for in the same way."""
        return s_from_ns(self.ask_ns())

    def sleep(self, seconds: float) -> None:
        """Let simulated time pass [s] without waiting for it.

        Raises:
            ParameterError: If it is negative or not finite.
        """
        with self.sim.lock:
            self._enter(is_command=False)
            self.sim.run(seconds)
            self._program.leave(has_acted=True)

    # ---- inside ----

    def _enter(self, *, is_command: bool) -> None:
        if self._program.thinks:
            self._pass(self._program.enter(is_command=is_command))

    def _pass(self, time_ns: int) -> None:
        if time_ns:
            self.sim.advance_to(self.sim.now_ns + time_ns)

    def _read(self, size: int | None, terminator: bytes | None) -> bytes:
        """Wait, in simulated time, for `size` characters or a terminator, whichever comes first."""
        sim, wire, line = self.sim, self._wire, self._wire.line
        with sim.lock:
            self._enter(is_command=False)
            self._has_read = True
            deadline_ns = _NEVER if self.timeout is None else sim.now_ns + ns_from_s(self.timeout)
            # What completes the read is known as soon as the robot has answered, before the characters arrive.
            while not (count := _complete(line.waiting, size, terminator)) and wire.pending:
                event_ns = wire.next_ns
                if event_ns is None or event_ns > deadline_ns:
                    break
                sim.advance_to(event_ns)
            arrival_ns = line.arrival_ns(count) if count else None
            if arrival_ns is not None and arrival_ns <= deadline_ns:
                sim.advance_to(arrival_ns)
                data = line.take(count)
            elif size == 0:
                data = b""
            elif deadline_ns is _NEVER:
                raise LinkError(
                    f"robot {self.robot} must have been asked something before its answer is read, but no command is "
                    f"on the line, so the read would never end. Send one that ends in a line feed, or set a timeout."
                )
            else:
                # A read that does not wait (timeout 0) is a question like any other.
                sim.advance_to(max(deadline_ns, sim.now_ns + (self._program.ask() if self.timeout == 0 else 0)))
                arrived = line.arrived_count(sim.now_ns)
                data = line.take(arrived if size is None else min(arrived, size))
            self._program.leave(has_acted=bool(data))
        return data


_NEVER = 1 << 63
"""A deadline [ns] that no simulation reaches."""


def _complete(waiting: bytearray, size: int | None, terminator: bytes | None) -> int:
    """Return how many of the waiting characters make a read complete, 0 while they do not."""
    if terminator is not None:
        found = waiting.find(terminator)
        if found >= 0:
            end = found + len(terminator)
            return end if size is None or end < size else size
    return size if size is not None and size <= len(waiting) else 0
