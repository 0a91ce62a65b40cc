"""Genetic algorithms: with real parameters, with bits, and NSGA-II for several objectives."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.errors import ParameterError, library
from kiks.learn.algorithm import Floats, Positive, Setting, Share
from kiks.model.data_file import Number, OneOf, Whole, record


class Genetic:
    """An algorithm whose candidates have children, and which prefers the fittest of the last generation."""

    _candidates: Floats
    _fittest: Floats

    def ask(self) -> Floats:
        """Return the next generation."""
        return self._candidates.copy()

    def favourite(self) -> Floats:
        """Return the fittest of the last generation."""
        return self._fittest.copy()


def breed(mothers: Floats, fathers: Floats, mutation: float, rng: np.random.Generator) -> Floats:
    """Return a child of each pair: each parameter is that of either parent, with a normal mutation."""
    children: Floats = np.where(rng.random(mothers.shape) < 0.5, mothers, fathers)
    children += mutation * rng.standard_normal(children.shape)
    return children


class Ga(Genetic):
    """A genetic algorithm: tournaments, each parameter from either parent, normal mutations, one elite."""

    @record
    class Options:
        """Options of the genetic algorithm.

        Args:
            mutation: Standard deviation of a mutation, relative to that of the first generation.
            rivals: Number of candidates in a tournament.
        """

        mutation: Positive = 0.07
        rivals: Annotated[Whole, Field(ge=1, le=1000)] = 3

    def __init__(self, setting: Setting, options: Options) -> None:
        self._rng, self._options = np.random.default_rng(setting.seed), options
        self._spread = setting.spread
        self._candidates = self._spread * self._rng.standard_normal((setting.population, setting.parameter_count))
        self._fittest = self._candidates[0]

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Breed the next generation."""
        population = len(self._candidates)
        self._fittest = self._candidates[np.argmax(fitness)].copy()
        entrants = self._rng.integers(population, size=(2, population, self._options.rivals))
        winners = np.take_along_axis(entrants, fitness[entrants].argmax(axis=2)[:, :, None], axis=2)[:, :, 0]
        mothers, fathers = self._candidates[winners]
        self._candidates = breed(mothers, fathers, self._options.mutation * self._spread, self._rng)
        self._candidates[0] = self._fittest  # elitism: what was found is not lost by mutation


class Sga(Genetic):
    """A simple genetic algorithm: selection, one-point crossover, mutation; the children replace all parents.

    Bits of a parameter are a binary number, the highest first. Real numbers begin, and mutate, evenly spread with the
    deviation of the first generation; they have no bounds. Fitness is scaled linearly before a roulette wheel turns, so
    that the best candidate has `BEST` times the chance of an average one, or less if the worst would have none
    (Goldberg, Genetic Algorithms in Search, Optimization, and Machine Learning, 1989).
    """

    @record
    class Options:
        """Options of the simple genetic algorithm.

        Args:
            bits: Number of bits of a parameter; 0 for real numbers.
            limit: Parameters of bits lie within +-limit.
            selection: 'best': the best have equally many children; 'roulette': each has what its fitness is worth.
            parents: Share of the population that counts among the best.
            crossover: Probability that two children exchange all genes from a random place on.
            mutation: Probability that a gene mutates.
        """

        bits: Annotated[Whole, Field(ge=0, le=32)] = 5
        limit: Positive = 10.0
        selection: Annotated[str, OneOf(("best", "roulette"))] = "best"
        parents: Annotated[Number, Field(gt=0, le=1)] = 0.2
        crossover: Share = 0.6
        mutation: Share = 0.05

    BEST = 2.0
    """Chance of the best candidate on the wheel, as a multiple of the mean one."""

    def __init__(self, setting: Setting, options: Options) -> None:
        self._options, self._rng = options, np.random.default_rng(setting.seed)
        self._reach = setting.spread * np.sqrt(3.0)
        count, size, reach = setting.population, setting.parameter_count, self._reach
        self._genes: NDArray[Any] = (
            self._rng.integers(2, size=(count, size * options.bits))
            if options.bits
            else self._rng.uniform(-reach, reach, (count, size))
        )
        self._fittest = self.ask()[0]

    def ask(self) -> Floats:
        """Return the next generation."""
        bits, limit = self._options.bits, self._options.limit
        if not bits:
            return self._genes.copy()
        # Whole numbers from 0 to 2^bits - 1, spread over -limit to limit with both ends.
        numbers = self._genes.reshape(len(self._genes), -1, bits) @ 2 ** np.arange(bits)[::-1]
        candidates: Floats = numbers * (2.0 * limit / (2**bits - 1)) - limit
        return candidates

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Breed the next generation."""
        rng, options, (count, size) = self._rng, self._options, self._genes.shape
        self._fittest = self.ask()[fitness.argmax()]
        if options.selection == "best":
            best = np.argsort(-fitness, kind="stable")[: max(1, round(options.parents * count))]
            # Pairs for the crossover are neighbours, so equal parents must not stand side by side.
            children: NDArray[Any] = self._genes[rng.permutation(np.resize(best, count))]
        else:
            children = self._genes[rng.choice(count, count, p=self._chances(fitness))]
        for first in range(0, count - 1, 2):
            if rng.random() < options.crossover:
                tail = np.arange(size) >= rng.integers(1, max(size, 2))
                pair = children[first : first + 2]
                children[first : first + 2] = np.where(tail, pair[::-1], pair)
        mutates = rng.random(children.shape) < options.mutation
        if options.bits:
            self._genes = children ^ mutates
        else:
            self._genes = children + mutates * rng.uniform(-self._reach, self._reach, children.shape)

    def _chances(self, fitness: Floats) -> Floats:
        """Return the chance of each candidate on the wheel, float64 [candidate]."""
        mean, best, worst = fitness.mean(), fitness.max(), fitness.min()
        if best <= mean or worst >= mean:  # all are equal: nothing can be scaled
            return np.full(len(fitness), 1.0 / len(fitness))
        # The steepest line through the mean by which the best gets `BEST` at most, and the worst no less than nothing.
        gain = min((self.BEST - 1.0) / (best - mean), 1.0 / (mean - worst))
        scaled = np.maximum(1.0 + gain * (fitness - mean), 0.0)
        chances: Floats = scaled / scaled.sum()
        return chances


class Nsga2(Genetic):
    """NSGA-II: several objectives; non-dominated candidates survive, ties are broken by crowding distance.

    Each generation has other worlds. So its first half are the survivors of the last one, evaluated again, so a lucky
    evaluation is not kept; the other half are their children. DEAP ranks them (Deb and others, A fast and elitist
    multiobjective genetic algorithm: NSGA-II, 2002); children are made as those of `Ga`.
    """

    @record
    class Options:
        """Options of NSGA-II.

        Args:
            mutation: Standard deviation of a mutation, relative to that of the first generation.
        """

        mutation: Positive = 0.07

    def __init__(self, setting: Setting, options: Options) -> None:
        if len(setting.objectives) < 2:
            raise ParameterError(
                f"the task must have at least two objectives for nsga2, but it has {len(setting.objectives)}. "
                "Give it some, such as objectives=['path_mm', '-contacts'], or take another algorithm."
            )
        self._setting, self._options, self._rng = setting, options, np.random.default_rng(setting.seed)
        self._candidates = setting.spread * self._rng.standard_normal((setting.population, setting.parameter_count))
        self._fittest = self._candidates[0]
        # The number of objectives is a matter of the class in DEAP; a minus was applied to the values already.
        weights = {"weights": (1.0,) * len(setting.objectives)}
        self._fitness: Any = type("Fitness", (library("deap.base").Fitness,), weights)

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Keep the best half, and breed from it."""
        population = len(self._candidates)
        objectives = behaviours[:, len(self._setting.axes) :]
        if objectives.shape[1] != len(self._setting.objectives):
            raise ParameterError("tell() must be given fitness and measures for nsga2, but it was given fitness alone.")
        self._fittest = self._candidates[fitness.argmax()].copy()
        ranked = [
            # DEAP sorts objects that have a fitness; a number is enough to find the candidate again.
            SimpleNamespace(number=number, fitness=self._fitness(values))
            for number, values in enumerate(objectives.tolist())
        ]
        survivors = library("deap.tools").selNSGA2(ranked, population // 2)
        fronts = library("deap.tools").sortNondominated(survivors, len(survivors))
        best_first = [
            each.number for front in fronts for each in sorted(front, key=lambda each: -each.fitness.crowding_dist)
        ]
        parents = self._candidates[best_first]
        # Parents are sorted, so the lower number wins a tournament of two.
        winners = self._rng.integers(len(parents), size=(2, population - len(parents), 2)).min(axis=2)
        (mothers, fathers), mutation = parents[winners], self._options.mutation * self._setting.spread
        self._candidates = np.concatenate([parents, breed(mothers, fathers, mutation, self._rng)])
