"""The clock of the user's program: the cost of its thinking and of its polling."""

from __future__ import annotations

from kiks.clock.thinking import Thinking, ThinkingFixed, ThinkingLive, parse_thinking
from kiks.units import NS_PER_S

FIRST_POLL_NS = 1_000
LONGEST_POLL_NS = 1_000_000

FREE_POLLS = 100
"""Consecutive polls of locks and the like that cost nothing."""


class ThreadClock:
    """What a thread of a program pays: for consecutive polls (is a byte there? what time is it?), and for thinking.

    Polling takes no simulated time by itself, so a program that polls in a loop would spin while time stands still.
    Therefore each consecutive poll costs twice the last, from 1 us up to 1 ms. The first one is free, so a program that
    reads the clock once per loop is not slowed.

    Attributes:
        has_read: Whether it has read since it last thought: one thought may lead to commands to several robots.

    Example:
        >>> thread = ThreadClock()
        >>> [thread.ask() for _ in range(4)]
        [0, 1000, 2000, 4000]
        >>> thread.act(); thread.ask()
        0
    """

    def __init__(self) -> None:
        self.has_read = False
        self._next_ns = 0
        self._poll_count = 0

    def ask(self) -> int:
        """Return the cost of this poll [ns]."""
        cost_ns = self._next_ns
        self._next_ns = min(cost_ns * 2, LONGEST_POLL_NS) if cost_ns else FIRST_POLL_NS
        return cost_ns

    def poll(self) -> int:
        """Return the cost of a poll [ns] that other threads answer: is the lock free?

        The first hundred in a row are free, so a program may check some locks without losing time.
        """
        self._poll_count += 1
        return self.ask() if self._poll_count > FREE_POLLS else 0

    def act(self) -> None:
        """Note that the program has done something else."""
        self._next_ns = 0
        self._poll_count = 0


class _FreeClock(ThreadClock):
    """What a thread pays that a debugger has stopped: nothing."""

    def ask(self) -> int:
        """Return 0."""
        return 0


EPOCH_S = 946_684_800
"""Calendar time at the start of a simulation [s since 1970]: 1 January 2000, so that runs repeat."""


class ProgramClock:
    """The clock of one program, with one thinking policy for all its ports and clocks.

    Args:
        thinking: A policy, as for `parse_thinking`.

    Attributes:
        thinks: Whether thinking costs time.
        measures: Whether thinking costs the real time that it takes.
        thread: What the running thread pays.
        act_count: Number of calls of ports and clocks.
        has_asked_person: Whether the program has read what a person typed.
        doubt: Why the program might do something else next time; empty if it will not.
        is_real_time: Whether thinking takes as long as it does on this computer.
    """

    def __init__(self, thinking: str) -> None:
        policy = parse_thinking(thinking)
        self._policy = None if isinstance(policy, ThinkingFixed) and policy.time_ns == 0 else policy
        self._stopped: tuple[Thinking | None, ThreadClock, int] = None, ThreadClock(), 0
        self.thinks = self._policy is not None
        self._live = policy if isinstance(policy, ThinkingLive) else None
        self.measures = self._live is not None
        self.thread = ThreadClock()
        self.act_count = 0
        self.doubt = ""
        self.has_asked_person = False
        self.is_real_time = self._live is not None and self._live.factor == 1

    def enter(self, *, is_command: bool) -> int:
        """Return the thinking time to charge at a call [ns]; see `Thinking.enter`."""
        return self._policy.enter(is_command=is_command) if self._policy is not None else 0

    def ask(self) -> int:
        """Return the cost of a poll [ns], which grows while the program does nothing else."""
        return self.thread.ask()

    def poll(self) -> int:
        """Return the cost of a poll [ns] of a lock or the like; see `ThreadClock.poll`."""
        self.act_count += 1
        return self.thread.poll()

    def go_on(self) -> None:
        """Note that another thread of the program thinks now."""
        if self._policy is not None:
            self._policy.leave()

    def leave(self, *, has_acted: bool) -> None:
        """Note that the program goes on now, after an action or a poll."""
        self.act_count += 1
        if has_acted:
            self.thread.act()
        if self._policy is not None:
            self._policy.leave()

    def set_thought(self, time_ns: int) -> None:
        """Note for how long the program has thought by now [ns]; see `Thinking.set_thought`."""
        if self._policy is not None:
            self._policy.set_thought(time_ns)

    def thought_ns(self) -> int:
        """Return for how long the program has thought, if that is measured [ns], else 0."""
        return self._policy.thought_ns() if self._policy is not None else 0

    def stand(self, stands: bool) -> None:
        """Note that a debugger has stopped the program, or lets it go on: it neither thinks nor pays meanwhile."""
        if stands:
            self._stopped = self._policy, self.thread, self.thought_ns()
            self._policy, self.thread = None, _FreeClock()
        else:
            self._policy, self.thread, thought_ns = self._stopped
            self.set_thought(thought_ns)

    def repeat(self, measured_ns: list[int]) -> None:
        """Charge the thinking times that an earlier run has measured [ns], if thinking is 'live', then new ones."""
        if self._live is not None:
            self._live.repeat(measured_ns)

    @property
    def measured_ns(self) -> list[int]:
        """Times that thinking 'live' has measured so far [ns]; `save_thinking` stores them for 'replay'."""
        return [] if self._live is None else self._live.measured_ns


def calendar_ns(now_ns: int) -> int:
    """Return a simulated time as nanoseconds since 1970."""
    return EPOCH_S * NS_PER_S + now_ns
