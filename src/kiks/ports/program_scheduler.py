"""Several programs in one world, in true time: who may act next, and how far the world may run.

Need: what happens must not depend on the order in which the operating system runs the programs, on how it cuts their
bytes, or on how fast they are.
Method: the conservative rule. A program that thinks is known to act no earlier than a certain simulated time: the end
of the reply that it has been given, plus its thinking time. The earliest of these times is the horizon, and nothing is
done beyond it. What may be done is done in the order of simulated time: at one instant first what the robots do, then
what the programs do, in the order of their ranks.


Why that is repeatable: think of the list of all that is done, each thing with its instant and rank. A thing is done
only when it is the first of all that are known, and when every program that thinks stands behind it with its own
instant and rank. So the list is in order, whatever came first in real time. What a program does is a function of what
it has been told; what it is told is a function of the list so far; so the whole list is one function of the beginning.
Only the real time at which a thing is done varies.

Why it goes on: of all things known and all programs that think one is the first. If it is a thing, it is done. If it is
a program, it will act; or it is silent, and there is a policy for that.

Why the end is repeatable: the world is advanced for somebody who waits, and then up to the latest instant that a
program has been told, as far as the horizon allows. When the last program has gone, commands under way still act,
and the world stops at the latest instant that any of them has lived to see: that does not depend on who went first.

A program that is not waited for acts when its command comes, no earlier than now. With nobody to hold the world time
stands still until a command comes, and runs to the end of its reply: as one program alone sees it.
"""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Callable

from kiks.clock.patience import Patience
from kiks.errors import ParameterError, nearest, shown
from kiks.sim.read_completion import NEVER_NS
from kiks.sim.simulation import Simulation

START_WORD_S = 1.0
"""How long the beginning is waited for before a word is said [s of real time]."""

START_PATIENCE_S = 10.0
"""How long the world waits for programs that do not come [s of real time]."""

VISIT_PATIENCE_S = 60.0
"""How long the beginning is waited for if programs come that a person starts elsewhere [s of real time]."""

PATIENCE_S = 2.0
"""How long the world waits for a silent program [s of real time], if nothing else is said."""

IMPATIENT_SHARE = 0.1
"""Share of the patience for a program that holds up one which is not waited for: both may be the same program, which
holds several ports and talks to them in turn."""

POLICIES = ("wait", "drop", "ignore")
"""What may be done about a program that is silent while others wait."""

STEPS = 64
"""Most things that are done before the ports are looked at again."""


class Participant(ABC):
    """A program, as one that takes its turn in the world. It acts, waits for the world, or thinks.

    Args:
        name: Who it is, for a person.
        rank: Its place among those who act at the same instant.

    Attributes:
        acts_from_ns: While it thinks: the earliest simulated time at which it may do something [ns].
        waits: Whether it waits for the world.
        is_here: Whether it has taken part yet.
        is_waited_for: Whether the world waits for it while it thinks.
        has_left: Whether it has gone and everything that it left behind is done.
        has_been_named: Whether a person has been told that the world waits for it.
        patience: How long it has been holding up others in real time; `ProgramScheduler.join` puts it there.
    """

    patience: Patience

    def __init__(self, name: str, rank: int) -> None:
        self.name = name
        self.rank = rank
        self.acts_from_ns = 0
        self.waits = False
        self.is_here = True
        self.is_waited_for = True
        self.has_left = False
        self.has_been_named = False

    @abstractmethod
    def next_ns(self) -> int | None:
        """Return when it does the next thing that is known [ns]; None if it has yet to say what that is."""

    @property
    def is_held_up(self) -> bool:
        """Say whether it can do nothing in real time before the world has gone on."""
        return self.waits or self.next_ns() is not None

    @abstractmethod
    def act(self) -> None:
        """Do that thing: the world has got there."""

    @abstractmethod
    def look(self) -> None:
        """Go on if what it waits for has happened."""

    @abstractmethod
    def drop(self) -> None:
        """Part from the program, because it was silent for too long."""


class ProgramScheduler:
    """Who may act next.

    Args:
        sim: The world.
        expected: How many programs begin together; 0: the world has begun already.
        missing: Returns who of them is not there yet, in words for a person.
        log: Where a person is told.
        is_once: Whether those who come after them act from when they come; else as many begin together again.
        when_silent: What happens to a program that is silent while others wait: 'wait', 'drop' or 'ignore'.
        patience_s: How long it may be [s of real time].
        new_patience: For tests: makes patiences with their own wall clock.
        start_patience_s: How long the world waits for those with whom it begins [s of real time], unless it is told to
            wait for all that are silent.

    Raises:
        ParameterError: If there is no such policy, or the patience is out of range.

    Attributes:
        participants: Those who take part, in the order in which they have come.
        has_begun: Whether the world has begun.
        is_repeatable: Whether the world has waited for everybody so far.
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
    ) -> None:
        check_policy(when_silent, patience_s)
        self.participants: list[Participant] = []
        self.has_begun = expected == 0
        self.is_repeatable = True
        self._sim = sim
        self._expected = expected
        self._is_once = is_once
        self._missing = missing
        self._when_silent = when_silent
        self._patience_s = patience_s
        self._new_patience = new_patience
        self._log = log
        self._start_patience_s = start_patience_s
        self._start = new_patience(start_patience_s)
        self._has_named_missing = False
        self._seen_ns = 0

    def join(self, participant: Participant) -> None:
        """Let a program take part from now on."""
        participant.patience = self._new_patience(self._patience_s)
        self.participants.append(participant)

    @property
    def drive(self) -> bool:
        """Say whether the world's time is moved here: some program holds it, or waits for it."""
        return any(
            not participant.has_left and (participant.is_waited_for or participant.is_held_up)
            for participant in self.participants
        )

    def see(self, time_ns: int) -> None:
        """Note that a program has been told of an instant [ns]."""
        self._seen_ns = max(self._seen_ns, time_ns)

    def advance(self) -> float | None:
        """Do what may be done, some of it at least; return for how long nothing more will happen [s], None: for ever.

        Call it again when a program has been heard.
        """
        if not self.has_begun:
            wait_s = self._wait_for_all()
            if not self.has_begun:
                return wait_s
        for _ in range(STEPS):
            is_stuck, holders = self._step()
            if is_stuck:
                break
        else:
            return 0.0
        if self.participants:
            horizon_ns = min((participant.acts_from_ns for participant in self._thinking()), default=NEVER_NS)
            self._sim.advance_to(min(self._seen_ns, horizon_ns))
        return self._bear_with(holders)

    def finish(self) -> None:
        """Bring the world to its end, when the last program has gone: commands under way still act."""
        sim = self._sim
        while any(wire.pending for wire in sim.wires):
            sim.advance_to(sim.next_event_ns() or 0)
        sim.advance_to(self._seen_ns)

    # ---- one thing after the other ----

    def _step(self) -> tuple[bool, list[Participant]]:
        """Do the first of all things if it may be done; else say so, and who might still act before it."""
        sim = self._sim
        actor: Participant | None = None
        first = horizon = (NEVER_NS, 0)
        is_waited = False
        for participant in self.participants:
            if participant.has_left:
                self._let_go(participant)
                return False, []
            if participant.waits:
                is_waited = True
                continue
            due_ns = participant.next_ns()
            if due_ns is not None:
                if actor is None or (due_ns, participant.rank) < first:
                    first, actor = (due_ns, participant.rank), participant
            elif participant.is_waited_for and (participant.acts_from_ns, participant.rank) < horizon:
                horizon = (participant.acts_from_ns, participant.rank)
        event_ns = sim.next_event_ns()
        if event_ns is not None and (actor is not None or is_waited) and event_ns <= first[0]:
            # Before anything that a program does at the same instant.
            first, actor = (event_ns, -1), None
        elif actor is None:
            return True, []
        if first > horizon:
            return True, [
                participant for participant in self._thinking() if (participant.acts_from_ns, participant.rank) < first
            ]
        if actor is not None:
            actor.patience.renew()
            actor.act()
            return False, []
        sim.advance_to(first[0])
        for participant in self.participants:
            if participant.waits:
                participant.look()
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

    def _let_go(self, participant: Participant) -> None:
        """Take out a program that has gone."""
        self.participants.remove(participant)
        if not self.participants:
            self.finish()
            # The next programs begin together, too, unless one alone may begin.
            self.has_begun = self._is_once or self._expected <= 1

    # ---- those who keep others waiting ----

    def _wait_for_all(self) -> float | None:
        """Begin when all are there, or have been waited for; return how long nothing will happen [s]."""
        self.participants = [participant for participant in self.participants if not participant.has_left]
        if not self.participants:
            self._start.renew()
            self._has_named_missing = False
            return None
        here = sum(participant.is_here for participant in self.participants)
        if here >= self._expected:
            self.has_begun = True
            return 0.0
        left_s = self._start.left_s()
        word_s = left_s - (self._start_patience_s - START_WORD_S)
        if word_s > 0:
            return word_s
        waits_on = self._when_silent == "wait"
        if left_s > 0 or waits_on:
            if not self._has_named_missing:
                self._has_named_missing = True
                self._log.warning(
                    "the world begins when %d programs are there, but %s is missing. %s",
                    self._expected,
                    self._missing(),
                    "It waits until all are there." if waits_on else f"It waits {left_s:.0f} s more.",
                )
            return None if waits_on else left_s
        self._log.warning(
            "the world has begun without %s, which did not come within %g s. Who comes now acts from now on, and the "
            "run is not repeatable.",
            self._missing(),
            self._start_patience_s,
        )
        self.is_repeatable = False
        for participant in self.participants:
            participant.is_waited_for = participant.is_here
        self._expected = 1
        self.has_begun = True
        return 0.0

    def _bear_with(self, holders: list[Participant]) -> float | None:
        """Lose patience with those who have kept others waiting for too long; return how long it still lasts [s]."""
        held_up = [participant for participant in self.participants if participant.is_held_up]
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
            elif not participant.has_been_named:
                participant.has_been_named = True
                self._log.warning(
                    "the world waits for %s: it has done nothing for %.1f s while others wait. Continue it, or end it.",
                    participant.name,
                    participant.patience.waited_s(),
                )
        return wait_s

    def _give_up(self, participant: Participant, waited_s: float) -> None:
        self.is_repeatable = False
        if self._when_silent == "drop":
            self._log.warning(
                "%s must act within %g s while others wait, but it did not: the world parts from it. "
                "--patience gives it more time.",
                participant.name,
                self._patience_s,
            )
            participant.drop()
            return
        participant.is_waited_for = False
        self._log.warning(
            "%s must act while others wait, but it did nothing for %.1f s: from now on the world does not wait for it, "
            "and the run is not repeatable. --patience gives it more time, --when-silent wait all it wants.",
            participant.name,
            waited_s,
        )


def check_policy(when_silent: str, patience_s: float) -> None:
    """Check what is to happen to a silent program, and when.

    Raises:
        ParameterError: If there is no such policy, or the patience is out of range.
    """
    if when_silent not in POLICIES:
        raise ParameterError(
            f"when_silent must be 'wait', 'drop' or 'ignore', but it was {shown(when_silent)}."
            f"{nearest(str(when_silent), POLICIES)}"
        )
    Patience(patience_s)
