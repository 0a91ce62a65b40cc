"""How a generation is cut into chunks: large enough to be worth the way, small enough that all workers end together.

Chunks never show in results: values follow from parameters and seed alone (`Evaluation`).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

SHORTEST_S = 0.05
"""How long a chunk takes at least [s], where there is as much to do: a hundred times what it costs to send it."""

LANES = 8
"""The engine steps so many worlds at once; a chunk of fewer takes as long as one of so many."""

LOSSES_ALLOWED = 3
"""How many workers a chunk may cost."""


@dataclass
class Chunk:
    """Candidates `first` to `end` - 1 of a generation, and how many workers were lost with them."""

    first: int
    end: int
    loss_count: int = 0

    def __len__(self) -> int:
        return self.end - self.first

    def __str__(self) -> str:
        return f"candidate {self.first}" if len(self) == 1 else f"candidates {self.first} to {self.end - 1}"


class Chunks:
    """What of a generation is still to be given to workers.

    Args:
        candidate_count: How many there are.
        worker_count: Among how many workers.

    Example:
        >>> chunks = Chunks(1000, worker_count=4)
        >>> print(chunks.take(None))
        candidates 0 to 7
        >>> print(chunks.take(0.001))  # a candidate takes a millisecond
        candidates 8 to 63
    """

    def __init__(self, candidate_count: int, *, worker_count: int) -> None:
        self._candidate_count = candidate_count
        self._worker_count = worker_count
        self._next = 0
        self._again: deque[Chunk] = deque()

    def __bool__(self) -> bool:
        return bool(self._again) or self._next < self._candidate_count

    def take(self, candidate_s: float | None) -> Chunk:
        """Return a chunk for a worker that needs so long for a candidate [s]; None if it has done none yet."""
        if self._again:
            return self._again.popleft()
        first = self._next
        self._next = min(first + self._size(candidate_s), self._candidate_count)
        return Chunk(first, self._next)

    def give_back(self, chunk: Chunk) -> None:
        """Have a chunk done once more, whole and first of all."""
        self._again.append(chunk)

    def _size(self, candidate_s: float | None) -> int:
        """Return how many candidates: if all workers were as fast, all would end after the same number of chunks."""
        share = -(-self._candidate_count // self._worker_count)
        if candidate_s is None:
            return min(LANES, share)
        round_count = max(1, int(share * candidate_s / SHORTEST_S))
        size = -(-share // round_count)
        return min(-(-size // LANES) * LANES, share)
