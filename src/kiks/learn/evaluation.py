"""Evaluates the candidates of a task: on all cores of this computer, or by any executor, with the same values.

An executor is an object with `submit`, as in `concurrent.futures`: threads, Dask, mpi4py, loky, or a Ray cluster
(`kiks.learn.ray_executor`). A generation is cut into chunks. They do not show in results, because the values of a
candidate follow from its parameters and its seed alone.
"""

from __future__ import annotations

from concurrent.futures import Executor, Future
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.errors import KiksError, ParameterError, WorkError, shown
from kiks.learn.fingerprint import differing
from kiks.model.array_checks import Numbers, check_array
from kiks.version import __version__

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

CHUNK_MIN, CHUNKS_MAX = 4, 256
"""Fewest candidates of a chunk, as sending one takes a millisecond or two; and most chunks of a generation."""

_CANDIDATES = Numbers((None, None), advice="They are [candidate, parameter]; a single one is parameters[np.newaxis].")


def evaluate(task: Any, candidates: Floats, seeds: Integers, executor: Executor | None = None) -> Floats:
    """Return the values of candidates.

    Args:
        task: The task, or what has its `evaluate` and `digest`.
        candidates: Parameters, float64 [candidate, parameter].
        seeds: A seed for each, int64 [candidate].
        executor: Evaluates them, each chunk with one thread. Left out, the cores of this computer do.

    Returns:
        Values, float64 [candidate, value], in the order of the candidates: the same to the bit wherever they come from.

    Raises:
        WorkError: If the task raises, or a worker is lost and the executor does not repeat its chunk.

    Example:
        >>> import kiks
        >>> from concurrent.futures import ThreadPoolExecutor
        >>> task, candidates, seeds = kiks.tasks.avoid(seconds=1), np.ones((9, 18)), np.arange(9)
        >>> with ThreadPoolExecutor(2) as threads:
        ...     bool((evaluate(task, candidates, seeds, threads) == evaluate(task, candidates, seeds)).all())
        True
    """
    candidates, seeds = check_candidates(candidates, seeds)
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise ParameterError(
            f"executor must have submit() as those of concurrent.futures have, but it was {shown(executor)}. "
            "ThreadPoolExecutor(2) is one; left out, all cores of this computer evaluate."
        )
    count = len(candidates)
    size = max(count, 1) if executor is None else max(CHUNK_MIN, -(-count // CHUNKS_MAX))
    parts = [slice(first, first + size) for first in range(0, max(count, 1), size)]
    futures: list[Future[Floats]] = []
    values: list[Floats] = []
    try:
        if executor is None:
            return task.evaluate(candidates, seeds)  # type: ignore[no-any-return]
        here = _identity(task)
        futures += [executor.submit(_evaluate_chunk, task, here, candidates[part], seeds[part]) for part in parts]
        for future in futures:
            values.append(future.result())
        return np.concatenate(values)
    except Exception as raised:
        error = getattr(raised, "cause", None) or raised  # Ray wraps what a worker raises
        if isinstance(error, KiksError):
            raise error from None
        part, text = parts[len(values)], " ".join(str(error).split())
        raise WorkError(
            f"Cannot evaluate candidates {part.start} to {min(part.stop, count) - 1}: {type(error).__name__}: {text}. "
            "Evaluate them alone, in one process, to see why."
        ) from raised
    finally:
        for future in futures:
            future.cancel()


def check_candidates(candidates: object, seeds: object) -> tuple[Floats, Integers]:
    """Return candidates and seeds as arrays, checked.

    Args:
        candidates: Parameters, float64 [candidate, parameter].
        seeds: A seed for each, int64 [candidate].
    """
    rows = check_array(candidates, _CANDIDATES, "candidates")
    return rows, check_seeds(seeds, len(rows))


def check_seeds(seeds: object, count: int | None = None) -> Integers:
    """Return seeds as an array, checked: so many, or any number."""
    advice = "np.full(count, seed) gives the same seed to all."
    return check_array(seeds, Numbers((count,), 0, is_whole=True, advice=advice), "seeds")


def _evaluate_chunk(task: Any, there: dict[str, str], candidates: Floats, seeds: Integers) -> Floats:
    """Return the values of a chunk, in a worker; refuse the work of a program whose modules differ from those here."""
    if names := differing(there, _identity(task)):
        raise ParameterError(
            f"all computers must have the same KiKS and the same modules of yours, but on one these differ: {names}. "
            "Install the same on all."
        )
    return task.evaluate(candidates, seeds, 1)  # type: ignore[no-any-return]


@lru_cache(maxsize=4)
def _identity(task: Any) -> dict[str, str]:
    """Return what must be the same where a candidate is evaluated."""
    found: dict[str, str] = {"KiKS": __version__} | task.digest()
    return found
