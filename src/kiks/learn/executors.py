"""Where evaluations run: on threads here, in processes here, on a Ray cluster; with the same values to the bit."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from typing import Self

import numpy as np

from kiks.errors import ParameterError, WorkError, nearest, shown
from kiks.learn.evaluation import Evaluation, Floats, Integers, Raised, Ready, Worker, check_candidates
from kiks.model.checks import check_kind

KINDS = ("threads", "processes", "ray")


def executor_for(where: str, work: Evaluation) -> Executor:
    """Return an executor for one work, to be used in a `with` statement.

    Args:
        where: "threads" or "processes", with a count ("processes:4") or as many as this program may use cores; "ray"
            for the Ray cluster that this program is connected to, else for one of its own on this computer;
            "ray:ADDRESS" for a running one, "ray:auto" for the one that this computer belongs to.
        work: What evaluates candidates.

    Raises:
        ParameterError: If there is no such place, the work cannot be pickled, or Ray is not installed.

    Example:
        >>> class Squares:
        ...     def prepare(self):
        ...         pass
        ...     def evaluate(self, candidates, seeds, threads):
        ...         return candidates**2
        >>> with executor_for("threads", Squares()) as executor:
        ...     executor.evaluate(np.array([[1.0], [2.0], [3.0]]), np.zeros(3, dtype=np.int64))
        array([[1.],
               [4.],
               [9.]])
    """
    check_kind("the place of evaluations", where, str, "Usual: 'threads'.")
    if not callable(getattr(work, "evaluate", None)):
        raise ParameterError(f"work must be a kiks.Task, or another Evaluation, but it was {shown(work)}.")
    kind, colon, detail = where.partition(":")
    if kind not in KINDS or (colon and not detail):
        raise ParameterError(
            "Evaluations must run on 'threads[:COUNT]', 'processes[:COUNT]', 'ray' or 'ray:ADDRESS', but it was"
            f" {shown(where)}.{nearest(kind, KINDS)}"
        )
    if kind == "threads":
        return ThreadsExecutor(work, thread_count=_count(where, detail))
    from kiks.learn.worker_pool import CrewExecutor

    if kind == "processes":
        from kiks.learn.processes import ProcessCrew

        return CrewExecutor(ProcessCrew(work, worker_count=_count(where, detail)))
    from kiks.learn.ray_executor import RayCrew

    return CrewExecutor(RayCrew(work, address=detail or None))


def _count(where: str, detail: str) -> int:
    """Return how many threads or processes are wanted."""
    if not detail:
        return len(os.sched_getaffinity(0))
    if not detail.isdecimal() or int(detail) < 1:
        raise ParameterError(
            f"The count in {shown(where)} must be a whole number from 1, but it was {shown(detail)}. Left out, it "
            "is one a core."
        )
    return int(detail)


class Executor(ABC):
    """Evaluates candidates, generation by generation: in a `with` statement, called by one thread."""

    def __init__(self) -> None:
        self._is_open = False

    def __enter__(self) -> Self:
        """Open it.

        Raises:
            ParameterError: If the work cannot be sent to workers, or these cannot be reached.
            WorkError: If the work raises when it is prepared; workers elsewhere say so at the first evaluation.
        """
        self._open()
        self._is_open = True
        return self

    def __exit__(self, *_: object) -> None:
        self._is_open = False
        self._close()

    def evaluate(self, candidates: Floats, seeds: Integers) -> Floats:
        """Return what the candidates are worth.

        Args:
            candidates: Parameters [candidate, parameter].
            seeds: A seed for each [candidate].

        Returns:
            Values [candidate, value], in the order of the candidates; [0, 0] if there are none.

        Raises:
            ParameterError: If candidates and seeds have not these shapes and types.
            WorkError: If the work raises, its workers are lost again and again, or the executor is not open.
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
    """Evaluates here; the work itself shares a generation among threads.

    Args:
        work: What evaluates candidates.
        thread_count: How many threads it may use.
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
    error.add_note(f"In the worker:\n{raised.story}")
    return error
