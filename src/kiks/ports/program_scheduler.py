"""The scheduler of several programs in one world: which acts next, and how far the world may run.

The run must not depend on the order in which the operating system runs the programs, on how it splits their bytes, or
on how fast they are. So the scheduler is a conservative discrete-event scheduler. A program that thinks acts no earlier
than a known simulated time: the end of its last reply plus its thinking time. The earliest of these times is the
horizon. Events up to the horizon are done in the order of simulated time; at one instant, first those of the robots,
then those of the programs by rank.

Why that is repeatable: list all events that are done, each with its instant and rank. An event is done only when it is
the earliest that is known, and when every program that thinks has a later instant and rank. So the list is in order,
whatever came first in real time. What a program does is a function of the answers that it gets, and the answers are a
function of the list so far. So the initial state determines the list. Only the real time of an event varies.

Why there is no deadlock: of all known events and all thinking programs one is the earliest. If it is an event, it is
done. If it is a program, it will act, or it is silent, and then a policy decides.

Why the end is repeatable: the world advances for a program that waits, and then up to the latest instant that a program
has seen, as far as the horizon allows. When the last program has left, commands under way still act, and the world
stops at the latest instant that any program has seen. That does not depend on which program left first.

A program for which the world does not wait acts when its command comes, no earlier than now. If the world waits for no
program, time stands still until a command comes, and runs to the end of its reply, as with one program alone.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable

from kiks.clock.patience import Patience
from kiks.errors import counted
from kiks.model.checks import check_choice
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.simulation import Simulation

START_WARNING_S = 1.0
"""Wait for the start after which the log names missing programs [s of real time]."""

START_PATIENCE_S = 10.0
"""Longest wait for programs that do not come [s of real time]."""

VISIT_PATIENCE_S = 60.0
"""Longest wait for programs that a person starts elsewhere [s of real time]."""

PATIENCE_S = 2.0
"""Default wait for a silent program [s of real time]."""

IMPATIENT_SHARE = 0.1
"""Share of the patience for a program that delays one for which the world does not wait. Both may be the same program,
which has several ports open and uses them in turn."""

POLICIES = ("wait", "drop", "ignore")
"""Policies for a program that is silent while others wait."""

STEPS = 64
"""Most events between two checks of the ports."""


class Participant(ABC):
    """A program as the scheduler sees it. It acts, waits for the world, or thinks.

    Args:
        name: Its name in messages.
        rank: Its place in the order of programs that act at the same instant.

    Attributes:
        acts_from_ns: While it thinks: the earliest simulated time at which it may act [ns].
        waits: Whether it waits for the world.
        is_here: Whether it has joined the run.
        is_waited_for: Whether the world waits for it while it thinks.
        has_left: Whether it has gone and all its requests are done.
        stands: Whether a debugger has stopped it: no patience runs out meanwhile.
        has_been_reported: Whether the log has said that it is silent.
        patience: Measures the real time for which it delays others; set by `ProgramScheduler.join`.
        advice: What its user can do if it is silent, as a sentence.
    """

    patience: Patience
    advice = "--patience gives it more time, --when-silent wait all it wants."

    def __init__(self, name: str, rank: int) -> None:
        self.name = name
        self.rank = rank
        self.acts_from_ns = 0
        self.waits = False
        self.is_here = True
        self.is_waited_for = True
        self.has_left = False
        self.stands = False
        self.has_been_reported = False

    @abstractmethod
    def next_ns(self) -> int | None:
        """Return the time of its next known event [ns]; None if it has none."""

    @property
    def is_held_up(self) -> bool:
        """Whether it can go on only when the world does."""
        return self.waits or self.next_ns() is not None

    @abstractmethod
    def act(self) -> None:
        """Do its next event; the world has reached its time."""

    def note_standing(self) -> None:  # noqa: B027
        """Note that a debugger has stopped a program, or lets it go on."""

    @abstractmethod
    def check_wait(self) -> None:
        """Go on if the event that it waits for has happened."""

    @abstractmethod
    def drop(self) -> None:
        """Disconnect the program, because it was silent for too long."""


class ProgramScheduler:
    """Decides which program acts next and how far the world may run.

    Args:
        sim: The world.
        expected: Number of programs that begin together; 0: the world has begun already.
        missing: Returns the names of the missing programs, for the log.
        log: The log.
        is_once: Whether later programs act as soon as they come; otherwise `expected` programs begin together again.
        when_silent: What happens to a program that is silent while others wait: 'wait', 'drop' or 'ignore'.
        patience_s: How long a program may be silent [s of real time].
        new_patience: Makes patiences with another wall clock.
        start_patience_s: How long the world waits for the programs with which it begins [s of real time]; without a
            limit if `when_silent` is 'wait'.
        may_begin: Returns whether the world begins although programs are missing; then nothing else ends the wait.

    Attributes:
        loop: The event loop of the world.
        participants: The programs, in the order in which they have come.
        has_begun: Whether the world has begun.
        doubt: Why the run might not be repeatable; empty if the world has waited for all programs so far.
    """

    def __init__(
        self,
        sim: Simulation,
        *,
        expected: int,
        missing: Callable[[], str],
        log: logging.Logger,
        is_once: bool = False,
        when_silent: str = "ignore",
        patience_s: float = PATIENCE_S,
        new_patience: Callable[[float], Patience] = Patience,
        start_patience_s: float = START_PATIENCE_S,
        may_begin: Callable[[], bool] | None = None,
    ) -> None:
        check_policy(when_silent, patience_s)
        self.participants: list[Participant] = []
        self.has_begun = expected == 0
        self.doubt = ""
        self.loop = sim.loop
        self._expected = expected
        self._is_once = is_once
        self._missing = missing
        self._when_silent = when_silent
        self._patience_s = patience_s
        self._new_patience = new_patience
        self._log = log
        self._start_patience_s = start_patience_s
        self._start_timeout = new_patience(start_patience_s)
        self._may_begin = may_begin
        self._has_reported_missing = False
        self._seen_ns = 0

    def join(self, participant: Participant) -> None:
        """Add a program."""
        participant.patience = self._new_patience(self._patience_s)
        self.participants.append(participant)

    @property
    def drive(self) -> bool:
        """Whether the scheduler moves the world's time: some program holds it, or waits for it."""
        return any(
            not participant.has_left and (participant.is_waited_for or participant.is_held_up)
            for participant in self.participants
        )

    def note_seen(self, time_ns: int) -> None:
        """Note that a program has seen an instant [ns]."""
        self._seen_ns = max(self._seen_ns, time_ns)

    def advance(self) -> float | None:
        """Do some of the events that may be done.

        Call it again when a program has sent a request.

        Returns:
            Time for which nothing more will happen [s]; None if nothing happens until a request comes.
        """
        if not self.has_begun:
            return self._wait_for_all()
        # Not all events at once: a server also has to look at its ports.
        for _ in range(STEPS):
            is_stuck, holders = self._step()
            if is_stuck:
                break
        else:
            return 0.0
        # Time passes up to what a program has seen, even if no event is due there; but not past one that thinks.
        if self.participants and self._seen_ns > self.loop.world.now_ns:
            horizon_ns = min((participant.acts_from_ns for participant in self._thinking()), default=NEVER_NS)
            self.loop.advance_to(min(self._seen_ns, horizon_ns))
        return self._check_patience(holders) if len(self.participants) > 1 else None

    def finish(self) -> None:
        """Advance the world to its end after the last program has left: commands under way still act."""
        loop = self.loop
        # With no program left, nothing else would let these commands act.
        while any(wire.pending for wire in loop.wires):
            loop.advance_to(loop.next_event_ns() or 0)
        loop.advance_to(self._seen_ns)

    # ---- events ----

    def _step(self) -> tuple[bool, list[Participant]]:
        """Do the earliest event if it may be done.

        Returns:
            Whether it may not, and then the programs that might still act before it.
        """
        loop = self.loop
        actor: Participant | None = None
        first = horizon = (NEVER_NS, 0)
        is_waited = False
        for participant in self.participants:
            # The list changes, so the next step looks anew.
            if participant.has_left:
                self._remove(participant)
                return False, []
            if participant.waits:
                is_waited = True
                continue
            due_ns = participant.next_ns()
            # What it has sent already decides when it acts, whatever it computes meanwhile.
            if due_ns is not None:
                if actor is None or (due_ns, participant.rank) < first:
                    first, actor = (due_ns, participant.rank), participant
            elif participant.is_waited_for and (participant.acts_from_ns, participant.rank) < horizon:
                horizon = (participant.acts_from_ns, participant.rank)
        event_ns = loop.next_event_ns()
        is_event = event_ns is not None and (actor is not None or is_waited) and event_ns <= first[0]
        if event_ns is not None and is_event:
            # Before anything that a program does at the same instant.
            first, actor = (event_ns, -1), None
        # A world with an end stops when nothing before that end can come any more.
        loop.check_end(min(first, horizon)[0])
        if actor is None and not is_event:
            return True, []
        # A program that thinks may still act before this event: the order must not depend on who is faster.
        if first > horizon:
            return True, [
                participant for participant in self._thinking() if (participant.acts_from_ns, participant.rank) < first
            ]
        if actor is not None:
            # It has done something, so it is not silent.
            actor.patience.renew()
            actor.act()
            return False, []
        loop.advance_to(first[0])
        for participant in self.participants:
            if participant.waits:
                participant.check_wait()
        return False, []

    def _thinking(self) -> list[Participant]:
        """Return the programs that hold the world."""
        return [
            participant
            for participant in self.participants
            if participant.is_waited_for
            and not participant.waits
            and not participant.has_left
            and participant.next_ns() is None
        ]

    def _remove(self, participant: Participant) -> None:
        """Remove a program that has left."""
        self.participants.remove(participant)
        if not self.participants:
            self.finish()
            # The next programs begin together, too, unless one alone may begin.
            self.has_begun = self._is_once or self._expected <= 1

    # ---- programs that delay others ----

    def _wait_for_all(self) -> float | None:
        """Begin when all programs are there or the wait is over; return the time until the next check [s]."""
        self.participants = [participant for participant in self.participants if not participant.has_left]
        present_count = sum(participant.is_here for participant in self.participants)
        if self.participants and present_count >= self._expected:
            self.has_begun = True
            return 0.0
        if self._may_begin is not None:
            if self._may_begin():
                self._begin_without("as a person wanted")
            return None
        # No program is here yet: the patience begins with the first one.
        if not self.participants:
            self._start_timeout.renew()
            self._has_reported_missing = False
            return None
        if self._is_standing:
            return None
        # One alone delays no other, however long it takes to begin.
        if self._expected == 1:
            return None
        left_s = self._start_timeout.left_s()
        warning_s = left_s - (self._start_patience_s - START_WARNING_S)
        if warning_s > 0:
            return warning_s
        waits_on = self._when_silent == "wait"
        if left_s > 0 or waits_on:
            if not self._has_reported_missing:
                self._has_reported_missing = True
                self._log.warning(
                    "the world begins when %s there. Missing: %s. %s",
                    f"{counted(self._expected, 'program')} {'is' if self._expected == 1 else 'are'}",
                    self._missing(),
                    "It waits until all are there." if waits_on else f"It waits {left_s:.0f} s more.",
                )
            return None if waits_on else left_s
        self._begin_without(f"which did not come within {self._start_patience_s:g} s")
        return 0.0

    def note_doubt(self, why: str) -> None:
        """Note why the run might not be repeatable; the first reason is told."""
        self.doubt = self.doubt or why

    @property
    def _is_standing(self) -> bool:
        return any(participant.stands and not participant.has_left for participant in self.participants)

    def note_standing(self) -> None:
        """Note that a debugger has stopped a program, or lets it go on: all patience begins anew."""
        for patience in (self._start_timeout, *(participant.patience for participant in self.participants)):
            patience.renew()
        for participant in self.participants:
            participant.note_standing()

    def _begin_without(self, why: str) -> None:
        """Begin without the missing programs."""
        self._log.warning(
            "the world has begun without %s, %s. A program that comes now acts from now on, and the run is not "
            "repeatable.",
            self._missing(),
            why,
        )
        self.note_doubt("the world did not wait for every program")
        for participant in self.participants:
            participant.is_waited_for = participant.is_waited_for and participant.is_here
        # One that comes later begins at once.
        self._expected = 1
        self.has_begun = True

    def _check_patience(self, holders: list[Participant]) -> float | None:
        """Give up programs that have delayed others for too long; return the time until the next check [s]."""
        if self._is_standing:
            return None
        held_up = [participant for participant in self.participants if participant.is_held_up]
        # They delay no other program.
        if not held_up:
            holders = []
        is_in_turn = self._when_silent == "ignore" and not all(participant.is_waited_for for participant in held_up)
        share = IMPATIENT_SHARE if is_in_turn else 1.0
        wait_s: float | None = None
        for participant in self.participants:
            if participant not in holders:
                participant.patience.renew()
                continue
            left_s = participant.patience.left_s(share=share)
            if left_s > 0:
                wait_s = left_s if wait_s is None else min(wait_s, left_s)
            elif self._when_silent != "wait":
                self._give_up(participant, participant.patience.waited_s())
                wait_s = 0.0
            elif not participant.has_been_reported:
                participant.has_been_reported = True
                self._log.warning(
                    "the world waits for %s: it has done nothing for %.1f s while others wait. Continue it, or end it.",
                    participant.name,
                    participant.patience.waited_s(),
                )
        return wait_s

    def _give_up(self, participant: Participant, waited_s: float) -> None:
        self.note_doubt("the world did not wait for every program")
        if self._when_silent == "drop":
            self._log.warning(
                "%s must act within %g s while others wait, but it did not: it is disconnected. "
                "--patience gives it more time.",
                participant.name,
                self._patience_s,
            )
            participant.drop()
            return
        participant.is_waited_for = False
        if participant.has_been_reported:
            return
        participant.has_been_reported = True
        self._log.warning(
            "%s must act while others wait, but it did nothing for %.1f s: from now on the world does not wait for it, "
            "and the run is not repeatable. %s",
            participant.name,
            waited_s,
            participant.advice,
        )


def check_policy(when_silent: str, patience_s: float) -> None:
    """Check the policy for silent programs."""
    check_choice("when_silent", when_silent, POLICIES, "'wait', 'drop' or 'ignore'")
    Patience(patience_s)
