"""What a program that only asks and asks costs: so that no loop spins while simulated time stands still."""

from __future__ import annotations

FIRST_POLL_NS = 1_000
LONGEST_POLL_NS = 1_000_000

FREE_POLLS = 100
"""Questions about locks and the like, in a row, that cost nothing."""


class Waiting:
    """The length of a run of questions without an answer (is a byte there? what time is it?).

    The first question is free, so a program that looks at the clock once a loop is not slowed. Who asks again without
    doing anything in between is waiting: each further question lets twice as much time pass, up to 1 ms.

    Example:
        >>> waiting = Waiting()
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
