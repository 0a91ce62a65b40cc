"""Choose where evaluations run: on threads here, or on a Ray cluster. The values are the same to the bit."""

from __future__ import annotations

import os

from kiks.errors import ParameterError, nearest, shown
from kiks.learn.evaluation import Evaluation, Executor, Floats, Integers, Raised, Ready, Worker, work_error
from kiks.model.checks import check_kind

KINDS = ("threads", "ray")


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


def executor_for(where: str, work: Evaluation) -> Executor:
    """Return an executor for one work, to be used in a `with` statement.

    Args:
        where: "threads" for one per core, "threads:4" for four; "ray" for the Ray cluster that this program is
            connected to, else for one of its own on this computer; "ray:ADDRESS" for a running cluster, "ray:auto" for
            the one that this computer belongs to.
        work: Evaluates candidates.

    Example:
        >>> import numpy as np
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
            f"Evaluations must run on 'threads[:COUNT]', 'ray' or 'ray:ADDRESS', but it was {shown(where)}."
            f"{nearest(kind, KINDS)}"
        )
    if kind == "threads":
        return ThreadsExecutor(work, thread_count=_count(where, detail))
    from kiks.learn.ray_executor import RayExecutor, RayPool

    return RayExecutor(RayPool(work, address=detail or None))


def _count(where: str, detail: str) -> int:
    """Return the number of threads that `where` asks for."""
    if not detail:
        return len(os.sched_getaffinity(0))
    if not detail.isdecimal() or int(detail) < 1:
        raise ParameterError(
            f"The count in {shown(where)} must be a whole number from 1, but it was {shown(detail)}. Left out, it "
            "is one a core."
        )
    return int(detail)
