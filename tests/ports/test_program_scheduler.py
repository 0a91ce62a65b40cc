"""The scheduler: the simulated run does not depend on the order in which requests arrive in real time."""

import heapq
import logging
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share

from kiks.clock.patience import Patience
from kiks.ports import program_scheduler
from kiks.ports.program_scheduler import Participant, ProgramScheduler

Steps = Sequence[tuple[int, int]]
"""Commands of a program: for each one, the time until its answer and the thinking time after the answer [ns]."""

Log = list[tuple[Any, ...]]
Choose = Callable[[int], int]
"""Chooses what the operating system does next: returns a number from 0 to below its argument."""

ANSWER_NS = 4
"""Time from the answer's event until the program has the answer [ns]."""


class FakeWorld:
    """A world whose only events are answers, some time after their commands."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.loop = self.world = self
        self.wires = ()
        self.log: Log = []
        self.answered: set[int] = set()
        self._events: list[tuple[int, int]] = []

    def answer_at(self, time_ns: int, rank: int) -> None:
        heapq.heappush(self._events, (time_ns, rank))

    def next_event_ns(self) -> int | None:
        return self._events[0][0] if self._events else None

    def check_end(self, time_ns: int) -> None:
        """Time has no end here."""

    def advance_to(self, time_ns: int) -> None:
        while self._events and self._events[0][0] <= time_ns:
            event_ns, rank = heapq.heappop(self._events)
            assert event_ns >= self.now_ns
            self.now_ns = event_ns
            self.answered.add(rank)
            self.log.append(("answer", event_ns, rank))
        self.now_ns = max(self.now_ns, time_ns)


class FakeProgram(Participant):
    """A program that sends commands, waits for each answer, thinks, and leaves.

    Its thinking time depends on all earlier events.
    """

    def __init__(self, rank: int, steps: Steps, world: FakeWorld, scheduler: ProgramScheduler) -> None:
        super().__init__(f"program {rank}", rank)
        self.is_here = False
        self.has_sent = False
        self._steps = list(steps)
        self._think_ns = 0
        self._world, self._scheduler = world, scheduler

    @property
    def can_send(self) -> bool:
        return not (self.has_sent or self.waits or self.has_left)

    def send(self) -> None:
        self.is_here = self.has_sent = True

    def next_ns(self) -> int | None:
        return max(self.acts_from_ns, self._world.now_ns) if self.has_sent else None

    def act(self) -> None:
        world = self._world
        at_ns = max(self.acts_from_ns, world.now_ns)
        world.advance_to(at_ns)
        self.has_sent = False
        if not self._steps:
            world.log.append(("leave", at_ns, self.rank))
            self.has_left = True
            return
        world.log.append(("command", at_ns, self.rank))
        answer_ns, self._think_ns = self._steps.pop(0)
        world.answer_at(at_ns + answer_ns, self.rank)
        self.waits = True

    def check_wait(self) -> None:
        if self.rank in self._world.answered:
            self._world.answered.remove(self.rank)
            self.waits = False
            end_ns = self._world.now_ns + ANSWER_NS
            self._scheduler.note_seen(end_ns)
            self.acts_from_ns = end_ns + self._think_ns + len(self._world.log) % 3

    def drop(self) -> None:
        raise AssertionError("the policy is to wait")


@pytest.fixture(autouse=True)
def _one_step_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let requests arrive between any two events."""
    monkeypatch.setattr(program_scheduler, "STEPS", 1)


def scheduler_of(world: Any, expected: int, wall_ns: Callable[[], int], **options: Any) -> ProgramScheduler:
    log, patience = logging.getLogger("kiks.test"), partial(Patience, wall_ns=wall_ns)
    return ProgramScheduler(world, expected=expected, missing=str, log=log, new_patience=patience, **options)


def run(programs: Sequence[Steps], choose: Choose) -> Log:
    """Run programs; return all events, and the time at which the world ends."""
    world: Any = FakeWorld()
    scheduler = scheduler_of(world, len(programs), lambda: 0, when_silent="wait")
    fakes = [FakeProgram(rank, steps, world, scheduler) for rank, steps in enumerate(programs, 1)]
    for fake in fakes:
        scheduler.join(fake)
    may_advance = True
    while thinking := [fake for fake in fakes if fake.can_send] + [None] * may_advance:
        chosen = thinking[choose(len(thinking))]
        if chosen is None:
            may_advance = scheduler.advance() == 0.0
        else:
            chosen.send()
            may_advance = True
    assert all(fake.has_left for fake in fakes)
    assert not scheduler.doubt
    return [*world.log, ("end", world.now_ns)]


TIMES_NS = st.integers(0, 12)
PROGRAMS = st.lists(st.lists(st.tuples(TIMES_NS, TIMES_NS), max_size=6), min_size=1, max_size=5)


@pytest.mark.slow
@settings(max_examples=share(100, 3000))
@given(programs=PROGRAMS, orders=st.lists(st.randoms(use_true_random=False), min_size=2, max_size=6))
def test_any_order_gives_the_same_run(programs: Sequence[Steps], orders: Sequence[Any]) -> None:
    first, *others = (run(programs, order.randrange) for order in orders)
    assert all(other == first for other in others)
    times_ns = [entry[1] for entry in first]
    assert times_ns == sorted(times_ns)
    assert sum(entry[0] == "command" for entry in first) == sum(len(steps) for steps in programs)


def test_a_program_that_is_silent_again_is_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    world: Any = FakeWorld()
    wall_ns = [0]
    scheduler = scheduler_of(world, 2, lambda: wall_ns[0])
    busy, mute = (FakeProgram(rank, [(10, 10)] * 20, world, scheduler) for rank in (1, 2))
    mute.advice = "Close its port."
    for fake in (busy, mute):
        scheduler.join(fake)
    for _ in range(3):
        mute.is_waited_for = True  # as the connection of a program does when that sends something again
        mute.send()
        for _ in range(2):
            busy.send()
            while scheduler.advance() == 0.0:
                pass
            wall_ns[0] += 3_000_000_000
            while scheduler.advance() == 0.0:
                pass
        assert not mute.is_waited_for
        assert busy.can_send
    assert [record.getMessage() for record in caplog.records] == [
        "program 2 must act while others wait, but it did nothing for 3.0 s: from now on the world does not wait for "
        "it, and the run is not repeatable. Close its port."
    ]
