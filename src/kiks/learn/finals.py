"""The finals of an evolution: its best candidates drive again, and the best of these becomes the champion.

A candidate is known as good because it did well in a few worlds, where it may have been lucky. In the finals it drives
in worlds that are new to all. They are held by successive halving: in each round those that are left drive in twice as
many new worlds as in the round before, and the better half goes on. So each round costs the same, and most of the time
goes to candidates that are hard to tell apart (Karnin, Koren and Somekh, Almost optimal exploration in multi-armed
bandits, ICML 2013).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.learn.generation_loop import seed_for
from kiks.model.array_checks import check_numbers

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FINALISTS = 16
"""Most rivals in the finals, and most elites."""

SHARE = 0.1
"""Evaluations of the finals, as a share of those of the evolution."""

FINALS_SEED = 20
"""Purpose of the seeds of their worlds; evolutions and co-evolutions have others."""


@dataclass(frozen=True)
class Contender:
    """A candidate that may become the champion.

    Attributes:
        parameters: Its parameters.
        generation: The generation that found it.
    """

    parameters: tuple[float, ...]
    generation: int


def finalists_of(rivals: Iterable[Contender], elites: Iterable[Contender] = ()) -> list[Contender]:
    """Return the finalists, each once: the first of the rivals, then the first of the elites.

    Args:
        rivals: Rivals, the best first.
        elites: Elites of an archive, the best first.
    """
    return _different([*_different(rivals)[:FINALISTS], *_different(elites)[:FINALISTS]])


def _different(contenders: Iterable[Contender]) -> list[Contender]:
    """Return the contenders without those whose parameters an earlier one has."""
    found: dict[tuple[float, ...], Contender] = {}
    for each in contenders:
        found.setdefault(each.parameters, each)
    return list(found.values())


class Finals:
    """Finals: `ask`, evaluate with `seeds`, and `tell`, round by round until `is_over`.

    Args:
        finalists: At least two finalists; of equal ones, the first wins.
        seed: Seed of the evolution.
        evaluations: Number of evaluations of the evolution so far: the finals take a tenth of them, or as few as a
            round needs.
        value_count: Number of values of a candidate.

    Attributes:
        finalists: The finalists.
        candidates: Their parameters, float64 [finalist, parameter].
        value_count: Number of values of a candidate.
        sizes: Number of finalists in each round.
        worlds: Number of new evaluations of each of them in each round.
        seconds: Time of their end [s of the wall clock, since the evolution began].
    """

    def __init__(self, finalists: Sequence[Contender], seed: int, evaluations: int, value_count: int) -> None:
        self.finalists = tuple(finalists)
        self.sizes = [len(self.finalists)]
        while self.sizes[-1] > 2:
            self.sizes.append((self.sizes[-1] + 1) // 2)
        cost = sum(size << number for number, size in enumerate(self.sizes))
        first = max(int(SHARE * evaluations) // cost, 1)
        self.worlds = [first << number for number in range(len(self.sizes))]
        self.seconds = 0.0
        self.value_count = value_count
        self._seed = seed
        self._left = list(range(len(self.finalists)))
        none = np.zeros(0, np.int64)
        self._told = [(none, none, np.zeros((0, value_count)))]
        self.candidates = np.array([each.parameters for each in self.finalists])

    @property
    def evaluation_count(self) -> int:
        """Number of evaluations in all rounds."""
        return sum(size * count for size, count in zip(self.sizes, self.worlds, strict=True))

    @property
    def round(self) -> int:
        """Number of the next round, from 0."""
        return len(self._told) - 1

    @property
    def is_over(self) -> bool:
        """Whether the winner is known."""
        return self.round == len(self.sizes)

    # ---- rounds ----

    def ask(self) -> Floats:
        """Return the candidates of the next round, float64 [candidate, parameter]: each so often as it drives."""
        return self.candidates[self._of_evaluation()]

    @property
    def seeds(self) -> Integers:
        """Seeds of the worlds of the candidates that `ask` returns, int64 [candidate]; the same for each finalist."""
        begin, count = sum(self.worlds[: self.round]), self.worlds[self.round]
        seeds = [seed_for(self._seed, FINALS_SEED, number) for number in range(begin, begin + count)]
        return np.tile(np.array(seeds, np.int64), len(self._left))

    def tell(self, values: ArrayLike) -> None:
        """Take the values of the candidates of `ask`: the better half goes on.

        Args:
            values: Fitness, then the measures, float64 [candidate, 1 + measure].
        """
        numbers, seeds = self._of_evaluation(), self.seeds
        given = check_numbers("values", values, (len(numbers), self.value_count))
        self._told.append((numbers, seeds, given))
        best_first = sorted(self._left, key=lambda finalist: -self.means(finalist)[0])
        self._left = sorted(best_first[: (len(best_first) + 1) // 2])

    def tell_all(self, values: Floats) -> None:
        """Take the values of all rounds, float64 [evaluation, value], as `evaluated` returns them."""
        while not self.is_over:
            count = len(self._of_evaluation())
            self.tell(values[:count])
            values = values[count:]

    def _of_evaluation(self) -> Integers:
        """Return the number of the finalist of each evaluation in the next round, int64 [candidate]."""
        return np.repeat(np.array(self._left, np.int64), self.worlds[self.round])

    # ---- results ----

    def means(self, finalist: int) -> Floats:
        """Return the mean values of a finalist over all its evaluations so far, float64 [value]."""
        numbers, _, values = self.evaluated
        means: Floats = values[numbers == finalist].mean(axis=0)
        return means

    @property
    def winner(self) -> int:
        """Number of the finalist that won; before the end, of the first that is left."""
        return self._left[0]

    @property
    def evaluated(self) -> tuple[Integers, Integers, Floats]:
        """All evaluations so far: finalist and seed, int64 [evaluation], and values, float64 [evaluation, value]."""
        numbers, seeds, values = zip(*self._told, strict=True)
        return np.concatenate(numbers), np.concatenate(seeds), np.concatenate(values)
