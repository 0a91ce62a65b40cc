"""The way of a program to a world of this process that it may share with others, each with a thread of its own.

Whoever needs an answer moves the world as far as it may go; only if somebody else has to act first does it wait. Who is
alone has nobody to wait for: then the line is that of the port in memory, and a third of the cost.
"""

from __future__ import annotations

import contextlib
import threading
from dataclasses import dataclass
from typing import Protocol

from kiks.errors import LinkError
from kiks.ports.messages import Answer, Kind, Request
from kiks.ports.programs import Programs
from kiks.ports.remote_link import Connection, FarLine
from kiks.sim.local_line import LocalLine
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S

LOOK_S = 0.05
"""How often a program that waits for others looks whether it still has to [s of real time]."""

SLICE_NS = NS_PER_S
"""Simulated time that passes in one go while a program pauses [ns]."""


class Awaited(Protocol):
    """What a program lets be known of the answer that it waits for.

    Attributes:
        is_cancelled: Whether it does not wait any more.
        is_held: Whether it does not say so at present: then no time is to pass for it.
    """

    is_cancelled: bool
    is_held: bool


@dataclass
class Patient:
    """A program that waits for whatever it has asked for."""

    is_cancelled: bool = False
    is_held: bool = False


class NearConnection(Connection):
    """A program's way to a world of this process; `close` ends it. It belongs to the thread that makes it.

    Args:
        programs: Those who share the world.
        name: Who it is, for a person.
        rank: Its place among those who act at the same instant.
        awaited: Whether it still waits for its answer.

    Raises:
        KiksError: If the world has ended.
    """

    def __init__(self, programs: Programs, name: str, rank: int, awaited: Awaited) -> None:
        super().__init__(is_late=True)
        self._awaited = awaited
        self._thread = threading.get_ident()
        self._programs = programs
        self._world = programs.sim.lock
        self._participant = programs.admit(name, rank)
        self._is_resting = False

    def _say(self, request: Request) -> None:
        with self._world:
            # Who was given up because it said nothing counts again.
            self._participant.is_waited_for = not self._is_resting
            self._participant.hear(request)
            # Others may have waited for nothing but this.
            if self._programs.is_shared and request.kind is Kind.REACHED:
                self._programs.move()

    def _wait(self, ticket: int) -> Answer:
        participant, programs = self._participant, self._programs
        with self._world:
            while (answer := participant.answer) is None or answer.ticket != ticket:
                if participant.is_closed:
                    raise LinkError("the world must be there to answer, but it has ended. Open the port again.")
                self._check_awaited()
                wait_s = programs.move()
                if participant.answer is None or participant.answer.ticket != ticket:
                    programs.wait(LOOK_S if wait_s is None else min(wait_s, LOOK_S))
        return answer

    def attend(self) -> None:
        """Let others look at the world, and wait while the program does not say that it waits; the lock is held.

        Raises:
            LinkError: If it does not wait any more.
        """
        self._programs.wait(0)
        self._check_awaited()
        while self._awaited.is_held:
            self._programs.wait(LOOK_S)
            self._check_awaited()

    def cancel(self) -> None:
        """Let what the program waits for end at once, even if the world stands still; any thread may say so."""
        gate = self._programs.sim.gate
        if gate is not None:
            gate.keep(self._look_at_gate)

    def _look_at_gate(self) -> None:
        gate = self._programs.sim.gate
        if threading.get_ident() == self._thread or not self._awaited.is_cancelled:
            assert gate is not None
            gate.leave(self._look_at_gate)
            self._check_awaited()

    def _check_awaited(self) -> None:
        if self._awaited.is_cancelled:
            raise LinkError("the answer must be waited for, but the program was interrupted. Ask again.")

    @property
    def is_alone(self) -> bool:
        """Say whether nobody else takes part, and everything is done that this program has said."""
        return not (self._programs.is_shared or self._participant.is_held_up or self._participant.has_left)

    def live(self, time_ns: int) -> bool:
        """Let time pass [ns] while the program thinks; say whether it did: nobody else is there."""
        sim = self._programs.sim
        with self._world:
            if not self.is_alone or self._is_resting:
                return False
            sim.advance_to(sim.now_ns + time_ns)
            sim.sync()
            return True

    def come_to(self, time_ns: int) -> None:
        """Go on from a time [ns] to which the program has moved the world itself."""
        self._now_ns = self._told_ns = self._participant.acts_from_ns = time_ns
        self._is_to_meet = False

    def rest(self) -> None:
        """Let the others go on without this program, until `wake`; what was said is still done."""
        self._is_resting = True
        with self._world:
            self._participant.is_waited_for = False
            self._programs.move()
        # Its time begins again when it next needs the world.
        self._is_to_meet = True

    def wake(self) -> None:
        """Be one of those again whom the world waits for."""
        self._is_resting = False

    def close(self) -> None:
        """Leave; what was said is still done."""
        with self._world:
            self._participant.leave()
            # Who has gone waits for nothing: others move the world on.
            with contextlib.suppress(LinkError):
                self._programs.move()


class VisitorLine(FarLine):
    """A robot's line in a world of this process; see `Line`.

    Args:
        connection: The program's way to the world.
        sim: The world.
        robot: Number of the robot, from 1.
    """

    def __init__(self, connection: NearConnection, sim: Simulation, robot: int) -> None:
        super().__init__(connection, robot)
        self.lock = sim.lock
        self._sim = sim
        self._way = connection
        self._near = LocalLine(sim.loop, robot)

    def think(self, time_ns: int) -> None:
        """Let the time pass that the program has thought [ns]."""
        if self._way.is_alone:
            # Some of it may have passed already, as it did: see `NearConnection.live`.
            self._near.think(max(time_ns - (self._sim.now_ns - self._way.now_ns), 0))
            self._way.come_to(self._sim.now_ns)
        else:
            super().think(time_ns)

    def pass_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]."""
        now_ns = self.now_ns
        while now_ns + SLICE_NS < time_ns:
            now_ns += SLICE_NS
            self._pass_to(now_ns)
            if self._way.is_alone:
                # What has passed is done here, not in one go when it is looked at.
                self._sim.sync()
            self._way.attend()
        self._pass_to(time_ns)

    def _pass_to(self, time_ns: int) -> None:
        if self._way.is_alone:
            self._near.pass_to(time_ns)
            self._way.come_to(self._sim.now_ns)
        else:
            super().pass_to(time_ns)

    def send(self, data: bytes) -> None:
        """Put characters on the line; wait while it is full."""
        if self._way.is_alone:
            self._near.send(data)
            self._way.come_to(self._sim.now_ns)
        else:
            super().send(data)

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator; see `Line.read`.

        Raises:
            LinkError: If it could wait for ever.
        """
        if not self._way.is_alone:
            return super().read(size, terminator, timeout_ns, poll_ns)
        data = self._near.read(size, terminator, timeout_ns, poll_ns)
        self._way.come_to(self._sim.now_ns)
        return data
