"""The interfaces of evaluations and executors, and a worker: the same in this process and on another computer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from traceback import format_exception
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, WorkError

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Evaluation(Protocol):
    """Evaluates candidates: an object with two methods, which a cluster must be able to pickle.

    The values of a candidate must follow from its parameters and its seed alone, not from its neighbours in the call
    nor from the count of threads: then an evolution has the same bits wherever it runs.
    """

    def prepare(self) -> None:
        """Do costly work that each worker needs once: compile kernels, build arenas."""

    def evaluate(self, candidates: Floats, seeds: Integers, threads: int) -> Floats:
        """Return the values of candidates.

        Args:
            candidates: Parameters [candidate, parameter]; a copy, of at least one candidate.
            seeds: A seed for each [candidate].
            threads: How many threads it may use.

        Returns:
            Values [candidate, value].
        """
        ...


def check_candidates(candidates: object, seeds: object) -> tuple[Floats, Integers]:
    """Return candidates and seeds as arrays, checked.

    Args:
        candidates: Parameters, float64 [candidate, parameter].
        seeds: A seed for each, int64 [candidate].
    """
    candidates, seeds = _array(candidates), _array(seeds)
    if candidates.ndim != 2 or candidates.dtype != np.float64:
        raise ParameterError(
            f"candidates must be a float64 array [candidate, parameter], but it was {candidates.dtype} of shape"
            f" {candidates.shape}. A single candidate is parameters[np.newaxis]."
        )
    if seeds.shape != candidates.shape[:1] or seeds.dtype != np.int64:
        raise ParameterError(
            f"seeds must be an int64 array with one seed for each of {len(candidates)} candidates, but it was"
            f" {seeds.dtype} of shape {seeds.shape}. np.full(count, seed) gives the same seed to all."
        )
    return candidates, seeds


def _array(values: object) -> NDArray[Any]:
    try:
        return np.asarray(values)
    except ValueError:  # lists of different lengths
        return np.empty(0, object)


@dataclass(frozen=True)
class Ready:
    """A worker's answer: it is ready for candidates."""


@dataclass(frozen=True)
class Values:
    """A worker's answer: the values of its candidates.

    Attributes:
        values: [candidate, value].
        duration_s: How long the evaluation took [s of the wall clock].
    """

    values: Floats
    duration_s: float


@dataclass(frozen=True)
class Raised:
    """A worker's answer: the work raised.

    Attributes:
        what: Type and message of the exception.
        traceback: Its traceback, as text.
    """

    what: str
    traceback: str

    @classmethod
    def of(cls, error: BaseException) -> Raised:
        """Return an exception as an answer."""
        return cls(f"{type(error).__name__}: {error}", "".join(format_exception(error)))


@dataclass(frozen=True)
class Lost:
    """Stands for an answer: the worker has ended.

    Attributes:
        how: How it ended; continues a sentence that begins with "the worker".
    """

    how: str


Answer = Ready | Values | Raised | Lost


class Worker:
    """Prepares an evaluation once, then evaluates chunks.

    Args:
        load: Returns the evaluation; called once.
        threads: Number of threads that an evaluation may use.
    """

    def __init__(self, load: Callable[[], Evaluation], *, threads: int) -> None:
        self._load = load
        self._threads = threads

    def prepare(self) -> Ready | Raised:
        """Load and prepare the evaluation."""
        try:
            self._work = self._load()
            self._work.prepare()
        except Exception as error:
            return Raised.of(error)
        return Ready()

    def evaluate(self, candidates: Floats, seeds: Integers) -> Values | Raised:
        """Evaluate a chunk: candidates [candidate, parameter] with their seeds [candidate].

        The evaluation gets copies, because Ray's shared memory must not be written to.
        """
        try:
            start_s = perf_counter()
            values = self._work.evaluate(candidates.copy(), seeds.copy(), self._threads)
            duration_s = perf_counter() - start_s
            if not isinstance(values, np.ndarray) or values.ndim != 2 or len(values) != len(candidates):
                given = f"shape {values.shape}" if isinstance(values, np.ndarray) else repr(values)
                raise ValueError(
                    f"evaluate() must return an array [candidate, value] for {len(candidates)} candidates, but it was"
                    f" {given}."
                )
            return Values(values.astype(np.float64, casting="safe"), duration_s)
        except Exception as error:
            return Raised.of(error)


class Executor(ABC):
    """Evaluates candidates, generation by generation: in a `with` statement, called by one thread."""

    def __init__(self) -> None:
        self._is_open = False

    def __enter__(self) -> Self:
        """Open it.

        Raises:
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


def work_error(where: str, raised: Raised) -> WorkError:
    """Return the error for work that raised in `where`, with the worker's traceback as a note."""
    error = WorkError(f"Evaluation must not raise, but its {where} raised {raised.what}")
    error.add_note(f"In the worker:\n{raised.traceback}")
    return error
