"""The base class of executors, and the executor that runs on threads."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Self

import numpy as np

from kiks.errors import WorkError
from kiks.learn.evaluation import Evaluation, Floats, Integers, Raised, Ready, Worker, check_candidates


class Executor(ABC):
    """Evaluates candidates, generation by generation: in a `with` statement, called by one thread."""

    def __init__(self) -> None:
        self._is_open = False

    def __enter__(self) -> Self:
        """Open it.

        Raises:
            ParameterError: If the work cannot be sent to workers, or these cannot be reached.
            WorkError: If the work raises when it is prepared; on a cluster the first evaluation raises this.
        """
        self._open()
        self._is_open = True
        return self

    def __exit__(self, *_: object) -> None:
        self._is_open = False
        self._close()

    def evaluate(self, candidates: Floats, seeds: Integers) -> Floats:
        """Return the values of candidates.

        Args:
            candidates: Parameters [candidate, parameter].
            seeds: A seed for each [candidate].

        Returns:
            Values [candidate, value], in the order of the candidates; [0, 0] if there are none.

        Raises:
            ParameterError: If candidates and seeds have not these shapes and types.
            WorkError: If the work raises, too many workers are lost, or the executor is not open.
        """
        if not self._is_open:
            raise WorkError(
                "An executor must be open, but it is closed. Use it inside `with executor_for(...) as executor:`."
            )
        candidates, seeds = check_candidates(candidates, seeds)
        return self._evaluate(candidates, seeds) if len(candidates) else np.empty((0, 0))

    @abstractmethod
    def _open(self) -> None: ...

    @abstractmethod
    def _close(self) -> None: ...

    @abstractmethod
    def _evaluate(self, candidates: Floats, seeds: Integers) -> Floats: ...


class ThreadsExecutor(Executor):
    """Evaluates in this process; the work itself shares a generation among threads.

    Args:
        work: Evaluates candidates.
        thread_count: Number of threads that it may use.
    """

    def __init__(self, work: Evaluation, *, thread_count: int) -> None:
        super().__init__()
        self._worker = Worker(lambda: work, threads=thread_count)

    def _open(self) -> None:
        answer = self._worker.prepare()
        if not isinstance(answer, Ready):
            raise work_error("prepare()", answer)

    def _close(self) -> None:
        pass

    def _evaluate(self, candidates: Floats, seeds: Integers) -> Floats:
        answer = self._worker.evaluate(candidates, seeds)
        if isinstance(answer, Raised):
            raise work_error(f"evaluate() for candidates 0 to {len(candidates) - 1}", answer)
        return answer.values


def work_error(where: str, raised: Raised) -> WorkError:
    """Return the error for work that raised in `where`, with the worker's traceback as a note."""
    error = WorkError(f"Evaluation must not raise, but its {where} raised {raised.what}")
    error.add_note(f"In the worker:\n{raised.traceback}")
    return error
