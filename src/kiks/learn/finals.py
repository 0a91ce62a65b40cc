"""The finals of an evolution: after the last generation its best candidates drive again, and the best become champions.

A candidate is known as good because it did well in a few worlds, where it may have been lucky. In the finals it drives
in worlds that are new to all. They are held by successive halving: in each round those that are left drive in twice as
many new worlds as in the round before, and the better half goes on. So each round costs the same, and most of the time
goes to candidates that are hard to tell apart (Karnin, Koren and Somekh, Almost optimal exploration in multi-armed
bandits, ICML 2013).

The fitness of two sides is relative: it falls when the opponents become better. So their finals are a master
tournament, in which the champion of each generation meets the champions of all generations of the other side (Floreano
and Nolfi, God save the Red Queen! Competition in co-evolutionary robotics, Genetic Programming 1997).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from kiks.learn import seeds
from kiks.learn.evaluation import Floats, Integers
from kiks.learn.seeds import seed_for

Evaluate = Callable[[Floats, Integers], Floats]

FINALISTS = 16
"""Most rivals in the finals, and most elites."""

SHARE = 0.1
"""Evaluations of the finals, as a share of those of the evolution."""


@dataclass(frozen=True)
class Contender:
    """A candidate that may become the champion.

    Attributes:
        parameters: Its parameters.
        generation: The generation that found it.
    """

    parameters: tuple[float, ...]
    generation: int


@dataclass(frozen=True)
class Finals:
    """Finals that were held.

    Attributes:
        finalists: The finalists.
        numbers: Number of the finalist of each evaluation, int64 [evaluation].
        seeds: Seed of each evaluation, int64 [evaluation].
        values: Fitness, then the measures, float64 [evaluation, value].
        seconds: Time of their end [s of the wall clock, since the evolution began].
    """

    finalists: tuple[Contender, ...]
    numbers: Integers
    seeds: Integers
    values: Floats
    seconds: float = 0.0

    def means(self, finalist: int) -> Floats:
        """Return the mean values of a finalist over its evaluations, float64 [value]."""
        means: Floats = self.values[self.numbers == finalist].mean(axis=0)
        return means

    @property
    def winner(self) -> int:
        """Number of the finalist that won: the best of those that drove most often; of equal ones, the first."""
        counts = np.bincount(self.numbers, minlength=len(self.finalists))
        return max(range(len(self.finalists)), key=lambda number: (counts[number], self.means(number)[0]))


def halving_rounds(count: int, evaluations: int) -> tuple[list[int], list[int]]:
    """Return the number of finalists in each round, and of new worlds in which each of them drives.

    Args:
        count: Number of finalists.
        evaluations: Number of evaluations of the evolution: the finals take a tenth, or as few as a round needs.
    """
    sizes = [count]
    while sizes[-1] > 2:
        sizes.append((sizes[-1] + 1) // 2)
    cost = sum(size << number for number, size in enumerate(sizes))
    first = max(int(SHARE * evaluations) // cost, 1)
    return sizes, [first << number for number in range(len(sizes))]


def hold_finals(
    finalists: Sequence[Contender],
    seed: int,
    evaluations: int,
    evaluate: Evaluate,
    each_round: Callable[[int, list[int]], Any] | None = None,
) -> Finals:
    """Hold finals by successive halving.

    Args:
        finalists: At least two finalists, all different.
        seed: Seed of the evolution.
        evaluations: Number of its evaluations so far.
        evaluate: Returns the values [candidate, value] of candidates [candidate, parameter] with seeds [candidate].
        each_round: Called before each round with its number and the numbers of finalists in all rounds.
    """
    sizes, worlds = halving_rounds(len(finalists), evaluations)
    parameters, left, begin = np.array([each.parameters for each in finalists]), list(range(len(finalists))), 0
    finals = Finals(tuple(finalists), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 0)))
    for number, count in enumerate(worlds):
        if each_round is not None:
            each_round(number, sizes)
        drawn = [seed_for(seed, seeds.FINALS, world) for world in range(begin, begin + count)]
        rows, of_rows = np.repeat(left, count), np.tile(np.array(drawn, np.int64), len(left))
        values = evaluate(parameters[rows], of_rows)
        finals = Finals(
            finals.finalists,
            np.concatenate([finals.numbers, rows]),
            np.concatenate([finals.seeds, of_rows]),
            np.concatenate([finals.values, values]) if begin else values,
        )
        begin += count
        best_first = sorted(left, key=lambda finalist: -finals.means(finalist)[0])
        left = sorted(best_first[: (len(left) + 1) // 2])
    return finals


# ---- two sides ----


@dataclass(frozen=True)
class MasterTournament:
    """The master tournament: the champion of each generation against those of the other side.

    Attributes:
        sides: Names of the sides.
        generations: Numbers of the generations, from 1, int64 [generation].
        scores: Fitness of the sides, float64 [side, generation of the first side, generation of the second side].
    """

    sides: tuple[str, str]
    generations: Integers
    scores: Floats

    @property
    def means(self) -> Floats:
        """Mean fitness of each champion against all champions of the other side, float64 [side, generation]."""
        return np.stack([self.scores[0].mean(axis=1), self.scores[1].mean(axis=0)])

    @property
    def best(self) -> tuple[int, int]:
        """The generation of each side whose champion has the highest mean."""
        first, second = (int(self.generations[each.argmax()]) for each in self.means)
        return first, second


def hold_tournament(champions: Sequence[Floats], seed: int, trials: int, evaluate: Evaluate) -> Floats:
    """Return the fitness of all pairs of champions, float64 [side, champion of the first, champion of the second side].

    Args:
        champions: Parameters of the champions of each side, float64 [champion, parameter] each, as many of both.
        seed: Seed of the evolution.
        trials: Number of evaluations of each pair. In each trial all champions have the same starts, a different one
            with each opponent.
        evaluate: As for `hold_finals`.
    """
    first, second = champions
    size = len(first)
    pairs = np.concatenate([np.repeat(first, size, axis=0), np.tile(second, (size, 1))], axis=1)
    scores, starts = np.zeros((2, size, size)), latin_square(size, seed_for(seed, seeds.SQUARE)).ravel()
    for trial in range(trials):
        numbers = range(trial * size, (trial + 1) * size)
        drawn = np.array([seed_for(seed, seeds.TOURNAMENT, number) for number in numbers], np.int64)
        values = evaluate(pairs, drawn[starts])
        scores += values.reshape(size, size, 2, -1)[:, :, :, 0].transpose(2, 0, 1)
    return scores / trials


def latin_square(size: int, seed: int) -> Integers:
    """Return a square whose rows and columns hold each number from 0 to size - 1 once, int64 [row, column].

    Rows and columns are shuffled: equal numbers form no lines, which would be seen in the tournament's picture.
    """
    rng = np.random.default_rng(seed)
    square: Integers = (rng.permutation(size)[:, None] + rng.permutation(size)) % size
    return square
