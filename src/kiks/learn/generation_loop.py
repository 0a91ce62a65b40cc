"""The loop over the generations of an evolution, and derived seeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from time import perf_counter
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError
from kiks.learn.evaluation import Work, evaluate
from kiks.model.checks import check_number

LOG_EVERY_S = 10.0
"""Time between two writes of the log [s]; each writes the whole log."""


class Named(Work, Protocol):
    """A task with a name."""

    @property
    def name(self) -> str:
        """Its name."""
        ...


class Evolving(Protocol):
    """An evolution, of the controllers of a task or of both sides of a contest."""

    @property
    def work(self) -> Named:
        """The task or the contest: it evaluates the candidates."""
        ...

    @property
    def generations(self) -> Sequence[Any]:
        """The generations so far."""
        ...

    @property
    def seeds(self) -> NDArray[np.int64]:
        """Seeds of the candidates that `ask` returns, int64 [candidate]."""
        ...

    def ask(self) -> NDArray[np.float64]:
        """Return the candidates of the next generation, float64 [candidate, parameter]."""
        ...

    def tell(self, values: NDArray[np.float64]) -> None:
        """Take their values, float64 [candidate, value]."""

    def save_log(self) -> None:
        """Write the results so far."""

    @property
    def figures(self) -> Mapping[str, float]:
        """What the last generation achieved, by name, the most important first."""
        ...

    @property
    def driven_s(self) -> float:
        """Total time for which the robots of the last generation drove [s]."""
        ...


Some = TypeVar("Some", bound=Evolving)


def run_generations(
    evolution: Some,
    *,
    generations: int | None,
    seconds: float | None,
    executor: Executor | None,
    each: Callable[[Some], Any] | None,
    finish: Callable[[Executor | None], Any] | None = None,
) -> None:
    """Evolve.

    Args:
        evolution: The evolution.
        generations: Total number of generations, including earlier ones.
        seconds: No generation begins later than this [s of the wall clock].
        executor: Evaluates candidates, such as a `ThreadPoolExecutor`; the cores of this computer do if left out.
        each: Called after each generation.
        finish: Called with the executor after the last generation, unless the run is interrupted.

    Raises:
        WorkError: If candidates cannot be evaluated.
    """
    if generations is None and seconds is None:
        raise ParameterError("generations or seconds must be given, but neither was: the run would never end.")
    for name, value in (("generations", generations), ("seconds", seconds)):
        if value is not None:
            check_number(name, value, 0)
    begin_s, logged_s = perf_counter(), -np.inf
    try:
        while (generations is None or len(evolution.generations) < generations) and (
            seconds is None or perf_counter() - begin_s < seconds
        ):
            evolution.tell(evaluate(evolution.work, evolution.ask(), evolution.seeds, executor))
            if perf_counter() - logged_s > LOG_EVERY_S:
                evolution.save_log()
                logged_s = perf_counter()
            if each is not None:
                each(evolution)
        if finish is not None:
            finish(executor)
    finally:
        evolution.save_log()


def seed_for(seed: int, purpose: int, number: int = 0) -> int:
    """Return a seed that is derived from that of an evolution.

    Args:
        seed: Seed of the evolution.
        purpose: What it is for.
        number: Number of the seed for that purpose.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(purpose, number))
    return int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(2))
