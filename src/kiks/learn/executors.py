"""Choose where evaluations run: on threads here, or on a Ray cluster. The values are the same to the bit."""

from __future__ import annotations

import os

from kiks.errors import ParameterError, nearest, shown
from kiks.learn.evaluation import Evaluation
from kiks.learn.executor import Executor, ThreadsExecutor
from kiks.model.checks import check_kind

KINDS = ("threads", "ray")


def executor_for(where: str, work: Evaluation) -> Executor:
    """Return an executor for one work, to be used in a `with` statement.

    Args:
        where: "threads" for one per core, "threads:4" for four; "ray" for the Ray cluster that this program is
            connected to, else for one of its own on this computer; "ray:ADDRESS" for a running cluster, "ray:auto" for
            the one that this computer belongs to.
        work: Evaluates candidates.

    Raises:
        ParameterError: If `where` is unknown, or the work has no method `evaluate`.

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
            f"Evaluations must run on 'threads[:COUNT]', 'ray' or 'ray:ADDRESS', but it was {shown(where)}."
            f"{nearest(kind, KINDS)}"
        )
    if kind == "threads":
        return ThreadsExecutor(work, thread_count=_count(where, detail))
    from kiks.learn.ray_executor import RayPool
    from kiks.learn.worker_pool import PoolExecutor

    return PoolExecutor(RayPool(work, address=detail or None))


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
