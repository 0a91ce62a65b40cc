"""The user's program, as the clock sees it: what its thinking and its waiting cost."""

from __future__ import annotations

from kiks.clock.thinking import ThinkingFixed, ThinkingLive, parse_thinking
from kiks.units import NS_PER_S

FIRST_POLL_NS = 1_000
LONGEST_POLL_NS = 1_000_000

FREE_POLLS = 100
"""Questions about locks and the like, in a row, that cost nothing."""


class PollCost:
    """The length of a run of questions without an answer (is a byte there? what time is it?).

    The first question is free, so a program that looks at the clock once a loop is not slowed. Who asks again without
    doing anything in between is waiting: each further question lets twice as much time pass, up to 1 ms.

    Example:
        >>> waiting = PollCost()
        >>> [waiting.ask() for _ in range(4)]
        [0, 1000, 2000, 4000]
        >>> waiting.act(); waiting.ask()
        0
    """

    def __init__(self) -> None:
        self._next_ns = 0
        self._poll_count = 0

    def ask(self) -> int:
        """Return the time that this question takes [ns]."""
        cost_ns = self._next_ns
        self._next_ns = min(cost_ns * 2, LONGEST_POLL_NS) if cost_ns else FIRST_POLL_NS
        return cost_ns

    def poll(self) -> int:
        """Return the time that a question takes [ns] to which other threads know the answer: is the lock free?

        The first hundred in a row are free: a program may look at a few locks without losing its time.
        """
        self._poll_count += 1
        return self.ask() if self._poll_count > FREE_POLLS else 0

    def act(self) -> None:
        """Note that the program did something else."""
        self._next_ns = 0
        self._poll_count = 0


EPOCH_S = 946_684_800
"""What a program's calendar says when a simulation starts [s since 1970]: 1 January 2000, so that runs repeat."""


class ProgramClock:
    """One program, with one thinking policy for all the ports and clocks that it uses.

    Args:
        thinking: A policy that `parse_thinking` knows.

    Attributes:
        thinks: Whether its thinking costs time.
        measures: Whether that is as long as it really takes.
        waiting: What the questions of the thread cost that runs.
        act_count: How often it has called a port or a clock.

    Raises:
        ParameterError: If it knows none of that name.
    """

    def __init__(self, thinking: str) -> None:
        policy = parse_thinking(thinking)
        self._policy = None if isinstance(policy, ThinkingFixed) and policy.time_ns == 0 else policy
        self.thinks = self._policy is not None
        self.measures = isinstance(policy, ThinkingLive)
        self.waiting = PollCost()
        self.act_count = 0

    def enter(self, *, is_command: bool) -> int:
        """Return what the program has to pay as it calls [ns]; see `Thinking.enter`."""
        return self._policy.enter(is_command=is_command) if self._policy is not None else 0

    def ask(self) -> int:
        """Return the time that a question takes [ns], more and more while nothing else is done."""
        return self.waiting.ask()

    def poll(self) -> int:
        """Return the time that a question takes [ns] which is none about time or bytes; see `PollCost.poll`."""
        self.act_count += 1
        return self.waiting.poll()

    def go_on(self) -> None:
        """Note that another thread of it thinks now."""
        if self._policy is not None:
            self._policy.leave()

    def leave(self, *, has_acted: bool) -> None:
        """Note that the program goes on now, after it has done something or has only asked."""
        self.act_count += 1
        if has_acted:
            self.waiting.act()
        if self._policy is not None:
            self._policy.leave()

    @property
    def measured_ns(self) -> list[int]:
        """What thinking 'live' has measured so far [ns]; `save_thinking` keeps it for 'replay'."""
        return self._policy.measured_ns if isinstance(self._policy, ThinkingLive) else []


def calendar_ns(now_ns: int) -> int:
    """Return a simulated time as nanoseconds since 1970."""
    return EPOCH_S * NS_PER_S + now_ns
