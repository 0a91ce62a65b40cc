"""The executor for workers on other computers: sends out chunks, gathers values, and sends lost chunks again.

A generation is cut into chunks: large enough to be worth sending, small enough that all workers finish together. Chunks
never show in results, because a candidate's values follow from its parameters and its seed alone (`Evaluation`).
"""

from __future__ import annotations

import logging
from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from kiks.errors import WorkError
from kiks.learn.evaluation import Answer, Floats, Integers, Lost, Raised, Ready, Values
from kiks.learn.executor import Executor, work_error

_log = logging.getLogger("kiks.learn")

CHUNK_S_MIN = 0.05
"""Shortest time that a chunk takes [s], if there is enough work: a hundred times what it costs to send it."""

LANES = 8
"""Worlds that the engine steps at once; a chunk of fewer candidates takes as long as one of these."""

LOSSES_MAX = 3
"""Workers that may be lost in a row with one chunk, or before their first evaluation."""


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
    """The candidates of a generation that no worker has yet.

    Args:
        candidate_count: Number of candidates in the generation.
        worker_count: Number of workers that share them.

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
        self._lost: deque[Chunk] = deque()

    def __bool__(self) -> bool:
        return bool(self._lost) or self._next < self._candidate_count

    def take(self, candidate_s: float | None) -> Chunk:
        """Return a chunk for a worker that takes `candidate_s` [s] per candidate; None if it has done none yet."""
        if self._lost:
            return self._lost.popleft()
        first = self._next
        self._next = min(first + self._size(candidate_s), self._candidate_count)
        return Chunk(first, self._next)

    def return_lost(self, chunk: Chunk) -> None:
        """Queue a lost chunk: it is the next to be taken."""
        self._lost.append(chunk)

    def _size(self, candidate_s: float | None) -> int:
        """Return the size of the next chunk: equally fast workers finish after the same number of chunks."""
        share = -(-self._candidate_count // self._worker_count)
        if candidate_s is None:
            return min(LANES, share)
        round_count = max(1, int(share * candidate_s / CHUNK_S_MIN))
        size = -(-share // round_count)
        return min(-(-size // LANES) * LANES, share)


class WorkerPool(Protocol):
    """Workers, each with a number that is used once. A worker answers each request once."""

    def open(self) -> None:
        """Get everything ready for workers."""

    def close(self) -> None:
        """End all workers, even busy ones."""

    def refill(self) -> int:
        """Ping idle workers, replace lost ones, return the number of workers wanted."""
        ...

    def send(self, worker: int, candidates: Floats, seeds: Integers) -> None:
        """Send a chunk to a worker that is ready."""

    def wait(self) -> list[tuple[int, Answer]]:
        """Wait for answers and return them with their workers; an empty list after a while without any."""
        ...

    def end(self, worker: int) -> None:
        """End a worker, even a busy one, without an answer from it. Does nothing if it has ended already."""


class PoolExecutor(Executor):
    """Evaluates with a pool of workers: a worker that has finished a chunk gets the next.

    Args:
        pool: The workers.
    """

    def __init__(self, pool: WorkerPool) -> None:
        super().__init__()
        self._pool = pool
        self._candidate_s: dict[int, float] = {}

    def _open(self) -> None:
        self._pool.open()

    def _close(self) -> None:
        self._pool.close()

    def _evaluate(self, candidates: Floats, seeds: Integers) -> Floats:
        generation = _Generation(self._pool, candidates, seeds, self._candidate_s)
        try:
            return generation.run()
        finally:
            generation.end()


class _Generation:
    """The evaluation of one generation.

    Args:
        pool: The workers.
        candidates: Parameters [candidate, parameter].
        seeds: A seed for each [candidate].
        candidate_s: Time per candidate of each worker [s], the mean of its latest chunks; kept up to date here.
    """

    def __init__(self, pool: WorkerPool, candidates: Floats, seeds: Integers, candidate_s: dict[int, float]) -> None:
        self._pool = pool
        self._candidates = candidates
        self._seeds = seeds
        self._candidate_s = candidate_s
        self._worker_count = pool.refill()
        self._chunks = Chunks(len(candidates), worker_count=self._worker_count)
        self._ready: list[int] = []
        self._busy: dict[int, Chunk] = {}
        self._values: Floats = np.empty((0, 0))
        self._failed_start_count = 0

    def run(self) -> Floats:
        """Return the values [candidate, value]."""
        while self._chunks or self._busy:
            self._send_chunks()
            answers = self._pool.wait()
            for worker, answer in answers:
                self._accept(worker, answer)
            if not answers and not self._busy:
                _log.warning("No worker is there yet. The evaluation goes on when one comes.")
            if not answers or any(isinstance(answer, Lost) for _, answer in answers):
                # A lost computer takes all of its workers along, even those that are listed as ready.
                self._ready.clear()
                self._pool.refill()
        return self._values

    def end(self) -> None:
        """End the workers that still evaluate; their answers are no longer needed."""
        for worker in self._busy:
            self._pool.end(worker)

    def _send_chunks(self) -> None:
        while self._ready and self._chunks:
            worker = self._ready.pop(0)
            chunk = self._chunks.take(self._candidate_s.get(worker))
            self._busy[worker] = chunk
            part = slice(chunk.first, chunk.end)
            self._pool.send(worker, self._candidates[part], self._seeds[part])

    def _accept(self, worker: int, answer: Answer) -> None:
        chunk = self._busy.pop(worker, None)
        match answer:
            case Raised():
                if chunk is None:
                    self._pool.end(worker)
                raise work_error(f"evaluate() for {chunk}" if chunk else "prepare()", answer)
            case Lost():
                self._candidate_s.pop(worker, None)
                if chunk:
                    self._send_again(chunk, answer)
                else:
                    self._count_failed_start(answer)
                return
            case Values():
                assert chunk is not None
                self._store(chunk, answer)
                candidate_s = answer.duration_s / len(chunk)
                self._candidate_s[worker] = (self._candidate_s.get(worker, candidate_s) + candidate_s) / 2
            case Ready():
                pass
        self._failed_start_count = 0
        self._ready.append(worker)

    def _store(self, chunk: Chunk, answer: Values) -> None:
        value_count = answer.values.shape[1]
        if len(self._values) == 0:
            self._values = np.empty((len(self._candidates), value_count))
        elif value_count != self._values.shape[1]:
            raise WorkError(
                f"evaluate() must return as many values for each candidate, but it was {value_count} for {chunk} and"
                f" {self._values.shape[1]} for others. Let the count depend on the work alone."
            )
        self._values[chunk.first : chunk.end] = answer.values

    def _send_again(self, chunk: Chunk, lost: Lost) -> None:
        chunk.loss_count += 1
        if chunk.loss_count == LOSSES_MAX:
            raise WorkError(
                f"A worker must outlive an evaluation, but {chunk.loss_count} in a row were lost with {chunk}; the"
                f" last one {lost.how}. Evaluate these candidates with 'threads' to see why. Memory may be short."
            )
        _log.warning("A worker %s; with it went %s, which are evaluated again.", lost.how, chunk)
        self._chunks.return_lost(chunk)

    def _count_failed_start(self, lost: Lost) -> None:
        self._failed_start_count += 1
        if self._failed_start_count == max(self._worker_count, LOSSES_MAX):
            raise WorkError(
                f"A worker must live until its first evaluation, but {self._failed_start_count} in a row did not; the"
                f" last one {lost.how}. See what they printed."
            )
