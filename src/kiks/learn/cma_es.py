"""CMA-ES, by the library cma."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field

from kiks.errors import library
from kiks.learn.algorithm import Floats, Setting
from kiks.model.data_file import OneOf, Switch, Whole, record


class Cma:
    """CMA-ES: a normal distribution whose mean and covariance adapt to the successful candidates.

    After a restart, a strategy may have more candidates than a generation has: its update waits for all of them.
    IPOP: Auger and Hansen, A restart CMA evolution strategy with increasing population size, 2005. BIPOP: Hansen,
    Benchmarking a BI-population CMA-ES on the BBOB-2009 function testbed, 2009.
    """

    @record
    class Options:
        """Options of CMA-ES.

        Args:
            separable: Whether the covariance stays diagonal: for hundreds of parameters (Ros and Hansen 2008).
            active: Whether bad candidates count, too, against their directions.
            restarts: How a stalled strategy restarts: 'ipop' each time with twice as many candidates, 'bipop' with many
                or few of them in turn, 'none' not at all.
            starts: How many strategies are started, which take turns; the best one continues alone.
            race: Number of generations that each of them has before.
        """

        separable: Switch = False
        active: Switch = True
        restarts: Annotated[str, OneOf(("none", "ipop", "bipop"))] = "none"
        starts: Annotated[Whole, Field(ge=1, le=100)] = 1
        race: Annotated[Whole, Field(ge=1, le=10_000)] = 15

    JUDGED = 5
    """Number of last generations by which the strategies of a race are judged: each has worlds of its own."""

    def __init__(self, setting: Setting, options: Options) -> None:
        self._setting, self._options, self._rng = setting, options, np.random.default_rng(setting.seed)
        self._doublings, self._evaluations = 0, {False: 0, True: 0}  # of large strategies, and of small ones
        self._mean = np.zeros(setting.parameter_count)
        self._strategy: Any
        self._racing: list[tuple[Any, list[float]]] = []  # strategies that wait for their turn, with their fitness
        for _ in range(options.starts):
            self._begin(np.zeros(setting.parameter_count), setting.spread, 1)
            self._racing.append((self._strategy, []))
        self._strategy, self._fitness = self._racing.pop(0)

    def _begin(self, mean: Floats, spread: float, generations: int, *, is_small: bool = False) -> None:
        """Begin a strategy whose candidates fill so many generations."""
        options = {
            "popsize": self._setting.population * generations,
            "randn": lambda *shape: self._rng.standard_normal(shape),
            "seed": np.nan,  # leaves the random numbers of the process alone
            "verbose": -9,
            "verb_log": 0,
            "CMA_diagonal": self._options.separable,
            "CMA_active": self._options.active,
        }
        self._strategy = library("cma").CMAEvolutionStrategy(mean, spread, options)
        self._candidates: list[Floats] = []
        self._costs: list[float] = []
        self._is_small = is_small

    def ask(self) -> Floats:
        """Return the next generation."""
        if not self._candidates:
            self._candidates = self._strategy.ask()
        # After a restart there may be more than a generation has: they are handed out in portions.
        first = len(self._costs)
        return np.array(self._candidates[first : first + self._setting.population])

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Take their fitness."""
        self._costs += (-fitness).tolist()  # the library minimizes
        self._evaluations[self._is_small] += len(fitness)
        if len(self._costs) == len(self._candidates):  # a restarted strategy waits for several generations
            self._strategy.tell(self._candidates, self._costs)
            self._candidates, self._costs, self._mean = [], [], np.array(self._strategy.mean)
            if self._racing:
                self._take_turns(fitness)
            elif self._options.restarts != "none" and self._strategy.stop():
                self._restart()

    def _take_turns(self, fitness: Floats) -> None:
        """Let the next strategy continue, or the best one alone if each has had its generations."""
        # The better half: candidates at the rim of the distribution say little about where it leads.
        self._fitness.append(float(np.sort(fitness)[len(fitness) // 2 :].mean()))
        self._racing.append((self._strategy, self._fitness))
        if all(len(each) == self._options.race for _, each in self._racing):
            best = max(self._racing, key=lambda each: np.mean(each[1][-self.JUDGED :]))
            (self._strategy, _), self._racing = best, []
        else:
            self._strategy, self._fitness = self._racing.pop(0)

    def _restart(self) -> None:
        rng, spread = self._rng, self._setting.spread
        # BIPOP: small strategies get as many evaluations as large ones, and start closer to their mean.
        is_small = (
            self._options.restarts == "bipop"
            and self._doublings > 0
            and self._evaluations[True] < self._evaluations[False]
        )
        self._doublings += not is_small
        generations = 2.0**self._doublings
        # A small one has a random size between the first one's and half of the last large one's (Hansen 2009).
        if is_small:
            generations = (0.5 * generations) ** (rng.random() ** 2)
            spread *= 10.0 ** (-2.0 * rng.random())
        mean = self._setting.spread * rng.standard_normal(self._setting.parameter_count)
        self._begin(mean, spread, round(generations), is_small=is_small)

    def favourite(self) -> Floats:
        """Return the mean of the distribution that has learned last."""
        mean: Floats = self._mean.copy()
        return mean
