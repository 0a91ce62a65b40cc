"""The link of a program to a world of this process, which it may share with other programs, each in its own thread.

A program that needs an answer moves the world itself as far as it may go, and waits only while another program must act
first. While a program is alone, its line is that of a port in memory, at a third of the cost.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeVar, TypeVarTuple

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.errors import LinkError
from kiks.ports.messages import Answer, Kind, Request
from kiks.ports.programs import Programs
from kiks.ports.remote_link import Connection, RemoteLine
from kiks.sim.local_line import LocalLine
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

Given = TypeVarTuple("Given")
Result = TypeVar("Result")

POLL_S = 0.05
"""Longest wait for other programs before a program checks whether it was cancelled [s of real time]."""

SLICE_NS = NS_PER_S
"""Simulated time that passes in one piece while a program pauses [ns]."""

WATCHED_SLICE_NS = NS_PER_S // 10
"""The same if the program shares a watched world: a pause that is interrupted has run ahead of the world so far."""


class PendingAnswer(Protocol):
    """State of the answer that a program waits for."""

    @property
    def is_cancelled(self) -> bool:
        """Whether the program has stopped waiting."""

    @property
    def is_held(self) -> bool:
        """Whether the program has yet to confirm that it waits; until then its pause must not go on."""


@dataclass
class AwaitedAnswer:
    """An answer for which the program waits until it arrives."""

    is_cancelled: bool = False
    is_held: bool = False


class LocalConnection(Connection):
    """The connection of a program to a world of this process; it belongs to the thread that makes it.

    Args:
        programs: The programs that share the world.
        name: Name of the program, for a person.
        rank: Order among programs that act at the same instant.
        pending: State of the answer that the program waits for.
        advice: What its user can do if it is silent while others wait, as a sentence.
    """

    def __init__(self, programs: Programs, name: str, rank: int, pending: PendingAnswer, advice: str) -> None:
        super().__init__(is_late=True)
        self._pending = pending
        self._thread = threading.get_ident()
        self._programs = programs
        self._world = programs.sim.lock
        self._participant = programs.admit(name, rank)
        self._participant.advice = advice
        self._is_resting = False

    def _transmit(self, request: Request) -> None:
        with self._world:
            # The scheduler may have stopped waiting for this program because it was silent.
            self._participant.is_waited_for = not self._is_resting
            self._participant.add_request(request)
            # Other programs may wait for this alone.
            if self._programs.is_shared and request.kind is Kind.REACHED:
                self._programs.move()

    def _wait(self, ticket: int) -> Answer:
        participant, programs = self._participant, self._programs
        with self._world:
            while (answer := participant.answer) is None or answer.ticket != ticket:
                if participant.is_closed:
                    raise LinkError("the world must be there to answer, but it has ended. Open the port again.")
                self._check_pending()
                wait_s = programs.move()
                if participant.answer is None or participant.answer.ticket != ticket:
                    programs.wait(POLL_S if wait_s is None else min(wait_s, POLL_S))
        return answer

    def yield_world(self) -> None:
        """Release the lock, which the caller holds, for other threads, and wait while the pending answer is held.

        Raises:
            LinkError: If the answer was cancelled.
        """
        self._programs.wait(0)
        self._check_pending()
        while self._pending.is_held:
            self._programs.wait(POLL_S)
            self._check_pending()

    def cancel(self) -> None:
        """Make the program's thread check its pending answer at once, even in a paused world; for any thread."""
        gate = self._programs.sim.gate
        if gate is not None:
            gate.keep(self._check_at_gate)

    def _check_at_gate(self) -> None:
        gate = self._programs.sim.gate
        is_own = threading.get_ident() == self._thread
        if is_own or not self._pending.is_cancelled:
            assert gate is not None
            gate.leave(self._check_at_gate)
        if is_own:
            self._check_pending()

    def _check_pending(self) -> None:
        if self._pending.is_cancelled:
            raise LinkError("the answer must be waited for, but the program was interrupted. Ask again.")

    @property
    def is_alone(self) -> bool:
        """Whether no other program takes part and all requests of this one are done."""
        return not (self._programs.is_shared or self._participant.is_held_up or self._participant.has_left)

    def live(self, time_ns: int) -> bool:
        """Let time pass [ns] while the program computes; return False, without an effect, if it is not alone."""
        sim = self._programs.sim
        with self._world:
            if not self.is_alone or self._is_resting:
                return False
            sim.advance_to(sim.now_ns + time_ns)
            sim.sync()
            return True

    def meet(self) -> None:
        """Advance the world to the program's time, when it is the program's turn."""
        now_ns = self.ask(Kind.MEET).now_ns
        # All other programs act later.
        with self._world:
            self._programs.sim.advance_to(now_ns)

    def set_time(self, time_ns: int) -> None:
        """Set the program's time to that of the world [ns], after the program has moved the world itself."""
        self._now_ns = self._told_ns = self._participant.acts_from_ns = time_ns
        self._needs_time = False

    def halt(self) -> None:
        """Leave the world at once, for a person who has stopped the program: its robots stop and are free."""
        with self._world:
            self._participant.is_stopped = True
            self._participant.disconnect()

    def rest(self) -> None:
        """Let the world run without this program until `wake`; earlier requests are still done."""
        self._is_resting = True
        with self._world:
            self._participant.is_waited_for = False
            self._programs.move()
        # Its next request takes the time from the world.
        self._needs_time = True

    def wake(self) -> None:
        """Make the world wait for this program again."""
        self._is_resting = False

    def close(self) -> None:
        """Leave the world; earlier requests are still done."""
        with self._world:
            self._participant.leave()
            # A failure concerns the other programs only, which move the world on.
            with contextlib.suppress(LinkError):
                self._programs.move()


class SharedLine(RemoteLine):
    """A robot's line in a world of this process; see `Line`. It is a line in memory while the program is alone.

    Args:
        connection: The program's connection to the world.
        sim: The world.
        robot: Number of the robot, from 1.
    """

    _connection: LocalConnection

    def __init__(self, connection: LocalConnection, sim: Simulation, robot: int) -> None:
        super().__init__(connection, robot)
        self.lock = sim.lock
        self._sim = sim
        self._local_line = LocalLine(sim.loop, robot)

    def think(self, time_ns: int) -> None:
        """Let the thinking time of the program pass [ns]."""
        if self._connection.is_alone:
            # `LocalConnection.live` may have let some of it pass already.
            time_ns = max(time_ns - (self._sim.now_ns - self._connection.now_ns), 0)
        self._act(self._local_line.think, super().think, time_ns)

    def pass_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]."""
        now_ns = self.now_ns
        while now_ns + (slice_ns := self._slice_ns()) < time_ns:
            now_ns += slice_ns
            self._act(self._local_line.pass_to, super().pass_to, now_ns)
            if not self._connection.is_alone:
                # Wait for the world: the program's own time needs no wait.
                self._connection.meet()
            # Simulate each slice here, not all of them when the state is read.
            self._sim.sync()
            self._connection.yield_world()
        self._act(self._local_line.pass_to, super().pass_to, time_ns)

    def send(self, data: bytes, spare: int) -> bool:
        """Put characters on the line, if it has room for them and some more; see `Line.send`."""
        return self._act(self._local_line.send, super().send, data, spare)

    def room_ns(self, count: int) -> int:
        """Return when the line has room for some characters [ns]; a time that is over: it has."""
        return self._act(self._local_line.room_ns, super().room_ns, count)

    @property
    def taken_ns(self) -> int:
        """When the last character arrived that was read [ns]."""
        return self._local_line.taken_ns

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator; see `Line.read`.

        Raises:
            LinkError: If it could wait for ever.
        """
        return self._act(self._local_line.read, super().read, size, terminator, timeout_ns, poll_ns)

    def _slice_ns(self) -> int:
        gate = self._sim.gate
        is_watched = gate is not None and gate.speed is not None
        return WATCHED_SLICE_NS if is_watched and not self._connection.is_alone else SLICE_NS

    def _act(self, alone: Callable[[*Given], Result], shared: Callable[[*Given], Result], *args: *Given) -> Result:
        """Call the method of the line that serves this program now."""
        if not self._connection.is_alone:
            return shared(*args)
        result = alone(*args)
        self._ahead_count = BACKLOG_LIMIT  # to be asked for, should another program join
        self._connection.set_time(self._sim.now_ns)
        return result
