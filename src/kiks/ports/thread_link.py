"""The link of a program to a world of this process, which it may share with others, each in its own thread.

A program that needs an answer moves the world itself as far as it may go, and waits only while another program must act
first.
"""

from __future__ import annotations

import contextlib
import threading

from kiks.errors import LinkError
from kiks.ports.link import Link
from kiks.ports.messages import Answer, AwaitedAnswer, Request, Verb
from kiks.ports.programs import Programs
from kiks.units import NS_PER_S

POLL_S = 0.05
"""Longest wait for other programs before a program checks whether it was cancelled [s of real time]."""

SLICE_NS = NS_PER_S
"""Simulated time that passes in one piece while a program pauses [ns]."""

WATCHED_SLICE_NS = NS_PER_S // 10
"""The same if the program shares a watched world: a pause that is interrupted has run ahead of the world so far."""


class ThreadLink(Link):
    """The link of a program to a world of this process; it belongs to the thread that makes it.

    Args:
        programs: The programs that share the world.
        name: Name of the program, for a person.
        rank: Order among programs that act at the same instant.
        awaited: The answer that the program waits for.
        advice: What its user can do if it is silent while others wait, as a sentence.
    """

    def __init__(self, programs: Programs, name: str, rank: int, awaited: AwaitedAnswer, advice: str) -> None:
        super().__init__(programs.sim.lock, is_late=True)
        self._awaited = awaited
        self._thread = threading.get_ident()
        self._programs = programs
        self._participant = programs.admit(name, rank)
        self._participant.advice = advice
        self._is_resting = False

    def _transmit(self, request: Request) -> None:
        with self.lock:
            # The scheduler may have stopped waiting for this program because it was silent.
            self._participant.is_waited_for = not self._is_resting
            self._participant.add_request(request)
            # Other programs may wait for this alone.
            if self._programs.is_shared and request.kind == Verb.REACHED:
                self._programs.move()

    def _wait(self, ticket: int) -> Answer:
        participant, programs = self._participant, self._programs
        with self.lock:
            # It moves the world itself as far as it may go, and waits only for other programs.
            while (answer := participant.answer) is None or answer.ticket != ticket:
                if participant.is_closed:
                    raise LinkError("the world must be there to answer, but it has ended. Open the port again.")
                self._awaited.check()
                wait_s = programs.move()
                if participant.answer is None or participant.answer.ticket != ticket:
                    programs.wait(POLL_S if wait_s is None else min(wait_s, POLL_S))
        return answer

    @property
    def slice_ns(self) -> int:  # type: ignore[override]
        """See `Link`."""
        gate = self._programs.sim.loop.gate
        is_watched = gate is not None and gate.speed is not None and not self.is_alone
        return WATCHED_SLICE_NS if is_watched else SLICE_NS

    def _end_slice(self) -> None:
        # Wait for the world: the program's own time needs no wait.
        self.meet()
        # Simulate each slice here, not all of them when the state is read.
        self._programs.sim.sync()
        self._yield_world()

    def _yield_world(self) -> None:
        """Release the lock, which the caller holds, for other threads, and wait while the awaited answer is held.

        Raises:
            LinkError: If the answer was cancelled.
        """
        self._programs.wait(0)
        self._awaited.check()
        # Octave has yet to confirm that it still waits: what was interrupted must not go on.
        while self._awaited.is_held:
            self._programs.wait(POLL_S)
            self._awaited.check()

    def cancel(self) -> None:
        """Make the program's thread check its awaited answer at once, even in a paused world; for any thread."""
        gate = self._programs.sim.loop.gate
        if gate is not None:
            gate.keep(self._check_at_gate)

    def _check_at_gate(self) -> None:
        gate = self._programs.sim.loop.gate
        is_own = threading.get_ident() == self._thread
        if is_own or not self._awaited.is_given_up:
            assert gate is not None
            gate.leave(self._check_at_gate)
        if is_own:
            self._awaited.check()

    @property
    def is_alone(self) -> bool:
        """Whether no other program takes part and all requests of this one are done."""
        return not (self._programs.is_shared or self._participant.is_held_up or self._participant.has_left)

    def live(self, time_ns: int) -> bool:
        """Let time pass [ns] while the program computes; return False, without an effect, if it is not alone."""
        sim = self._programs.sim
        with self.lock:
            if not self.is_alone or self._is_resting:
                return False
            sim.advance_to(sim.now_ns + time_ns)
            sim.sync()
            return True

    def meet(self) -> None:
        """Advance the world to the program's time, when it is the program's turn."""
        now_ns = self.ask(Verb.MEET).now_ns
        # All other programs act later.
        with self.lock:
            self._programs.sim.advance_to(now_ns)

    def halt(self) -> None:
        """Leave the world at once, for a person who has stopped the program: its robots stop and are free."""
        with self.lock:
            self._participant.is_stopped = True
            self._participant.disconnect()

    def rest(self) -> None:
        """Let the world run without this program until `wake`; earlier requests are still done."""
        self._is_resting = True
        with self.lock:
            self._participant.is_waited_for = False
            self._programs.move()
        # Its next request takes the time from the world.
        self._needs_time = True

    def wake(self) -> None:
        """Make the world wait for this program again."""
        self._is_resting = False

    def close(self) -> None:
        """Leave the world; earlier requests are still done."""
        with self.lock:
            self._participant.leave()
            # A failure concerns the other programs only, which move the world on.
            with contextlib.suppress(LinkError):
                self._programs.move()
