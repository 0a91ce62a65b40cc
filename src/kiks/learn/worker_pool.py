"""The executor for workers that live elsewhere: hands out chunks, gathers values, has done again what was lost."""

from __future__ import annotations

import logging
from typing import Protocol

import numpy as np

from kiks.errors import WorkError
from kiks.learn.chunks import LOSSES_ALLOWED, Chunk, Chunks
from kiks.learn.evaluation import Answer, Floats, Integers, Lost, Raised, Ready, Values
from kiks.learn.executor import Executor, work_error

_log = logging.getLogger("kiks.learn")


class WorkerPool(Protocol):
    """Workers somewhere, known by numbers that are used once. Who is asked for something gives one answer."""

    def open(self) -> None:
        """Make everything ready for workers."""

    def close(self) -> None:
        """End all workers, whatever they do."""

    def muster(self) -> int:
        """Ask all that have nothing to do whether they are there, start who is missing; return how many are to be."""
        ...

    def hand(self, worker: int, candidates: Floats, seeds: Integers) -> None:
        """Give a chunk to a worker that is ready."""

    def wait(self) -> list[tuple[int, Answer]]:
        """Return who answered what, as soon as somebody has; nothing if nobody has for a while."""
        ...

    def dismiss(self, worker: int) -> None:
        """End a worker, whatever it does; it gives no answer. One that is gone may be dismissed as well."""


class CrewExecutor(Executor):
    """Evaluates with a crew: who is done with a chunk gets the next.

    Args:
        crew: The workers.
    """

    def __init__(self, crew: WorkerPool) -> None:
        super().__init__()
        self._crew = crew
        self._candidate_s: dict[int, float] = {}

    def _open(self) -> None:
        self._crew.open()

    def _close(self) -> None:
        self._crew.close()

    def _evaluate(self, candidates: Floats, seeds: Integers) -> Floats:
        generation = _Generation(self._crew, candidates, seeds, self._candidate_s)
        try:
            return generation.run()
        finally:
            generation.end()


class _Generation:
    """One generation on its way.

    Args:
        crew: The workers.
        candidates: Parameters [candidate, parameter].
        seeds: A seed for each [candidate].
        candidate_s: How long each worker needs for a candidate [s], the mean of its latest chunks; is kept up to date.
    """

    def __init__(self, crew: WorkerPool, candidates: Floats, seeds: Integers, candidate_s: dict[int, float]) -> None:
        self._crew = crew
        self._candidates = candidates
        self._seeds = seeds
        self._candidate_s = candidate_s
        self._worker_count = crew.muster()
        self._chunks = Chunks(len(candidates), worker_count=self._worker_count)
        self._ready: list[int] = []
        self._flying: dict[int, Chunk] = {}
        self._values: Floats = np.empty((0, 0))
        self._failed_start_count = 0

    def run(self) -> Floats:
        """Return the values [candidate, value]."""
        while self._chunks or self._flying:
            self._hand_out()
            answers = self._crew.wait()
            for worker, answer in answers:
                self._accept(worker, answer)
            if not answers and not self._flying:
                _log.warning("No worker is there yet. The evaluation goes on when one comes.")
            if not answers or any(isinstance(answer, Lost) for _, answer in answers):
                # With one worker others may be gone that seem ready: a computer takes all of its with it.
                self._ready.clear()
                self._crew.muster()
        return self._values

    def end(self) -> None:
        """Dismiss who still evaluates, for nobody waits for it."""
        for worker in self._flying:
            self._crew.dismiss(worker)

    def _hand_out(self) -> None:
        while self._ready and self._chunks:
            worker = self._ready.pop(0)
            chunk = self._chunks.take(self._candidate_s.get(worker))
            self._flying[worker] = chunk
            part = slice(chunk.first, chunk.end)
            self._crew.hand(worker, self._candidates[part], self._seeds[part])

    def _accept(self, worker: int, answer: Answer) -> None:
        chunk = self._flying.pop(worker, None)
        match answer:
            case Raised():
                if chunk is None:
                    self._crew.dismiss(worker)
                raise work_error(f"evaluate() for {chunk}" if chunk else "prepare()", answer)
            case Lost():
                self._candidate_s.pop(worker, None)
                if chunk:
                    self._do_again(chunk, answer)
                else:
                    self._count_failed_start(answer)
                return
            case Values():
                assert chunk is not None
                self._keep(chunk, answer)
                candidate_s = answer.duration_s / len(chunk)
                self._candidate_s[worker] = (self._candidate_s.get(worker, candidate_s) + candidate_s) / 2
            case Ready():
                pass
        self._failed_start_count = 0
        self._ready.append(worker)

    def _keep(self, chunk: Chunk, answer: Values) -> None:
        value_count = answer.values.shape[1]
        if len(self._values) == 0:
            self._values = np.empty((len(self._candidates), value_count))
        elif value_count != self._values.shape[1]:
            raise WorkError(
                f"evaluate() must return as many values for each candidate, but it was {value_count} for {chunk} and"
                f" {self._values.shape[1]} for others. Let the count depend on the work alone."
            )
        self._values[chunk.first : chunk.end] = answer.values

    def _do_again(self, chunk: Chunk, lost: Lost) -> None:
        chunk.loss_count += 1
        if chunk.loss_count == LOSSES_ALLOWED:
            raise WorkError(
                f"A worker must outlive an evaluation, but {chunk.loss_count} in a row were lost with {chunk}; the"
                f" last one {lost.how}. Evaluate these candidates with 'threads' to see why. Memory may be short."
            )
        _log.warning("A worker %s; with it went %s, which are evaluated again.", lost.how, chunk)
        self._chunks.give_back(chunk)

    def _count_failed_start(self, lost: Lost) -> None:
        self._failed_start_count += 1
        if self._failed_start_count == max(self._worker_count, LOSSES_ALLOWED):
            raise WorkError(
                f"A worker must live until its first evaluation, but {self._failed_start_count} in a row did not; the"
                f" last one {lost.how}. See what they printed. A program that uses processes must start under"
                " `if __name__ == '__main__':`."
            )
