"""A co-evolution: the two sides of a contest evolve against each other, and a tournament tells who progressed.

Each candidate meets champions of the other side, those of the last generations, and its fitness is its mean over these
contests. Fitness is relative: it falls when the opponents become better. So a tournament follows, in which the champion
of each generation meets the champions of all generations of the other side (Floreano and Nolfi, God save the Red
Queen! Competition in co-evolutionary robotics, Genetic Programming 1997).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.errors import ParameterError, shown
from kiks.export.tables import write_parquet
from kiks.learn.algorithms import make_algorithm
from kiks.learn.champion import Champion
from kiks.learn.contest import Contest
from kiks.learn.evaluation import evaluate
from kiks.learn.evolution_log import LOG, Folder, Generation, Identity
from kiks.learn.generation_loop import run_generations, seed_for
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_count, check_kind
from kiks.version import __version__

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

OPPONENTS = 10
"""Default number of opponents of a candidate (Floreano and Nolfi 1997)."""

TRIALS = 2
"""Default number of contests of each pair in the tournament."""

_ALGORITHM_SEED, _CONTEST_SEED, TOURNAMENT_SEED, _SQUARE_SEED = 10, 11, 12, 13
"""Purposes of seeds."""


@dataclass(frozen=True)
class Tournament:
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

    def save(self, path: str | Path) -> None:
        """Write a Parquet file with a row for each pair: the generations of both sides, and the fitness of both."""
        places = np.meshgrid(self.generations, self.generations, indexing="ij")
        columns = {f"{side}_generation": place.ravel() for side, place in zip(self.sides, places, strict=True)}
        columns |= {side: scores.ravel() for side, scores in zip(self.sides, self.scores, strict=True)}
        write_parquet(columns, path, "the tournament")


class Coevolution:
    """A co-evolution of the two sides of a contest.

    In each generation, every candidate of a side meets `opponents` champions of the other side: those of the last
    generations, in turn if there are fewer; in the first generation, candidates of the other side. All candidates of a
    generation have the same starts.

    Args:
        contest: The contest.
        algorithm: 'ga' (a genetic algorithm) or 'cma' (CMA-ES), for both sides.
        seed: Seed of all random numbers: the same seed gives the same evolution, with any number of workers.
        population: Number of candidates of each side; that of the contest if left out.
        opponents: Number of opponents of each candidate.
        folder: Folder of its generations, its champions and its log. If it holds generations of the same evolution, the
            evolution continues after them, as if it had never stopped. Left out, nothing is written.

    Attributes:
        contest: The contest.
        generations: The generations, in order. A row of `candidates` is one of the first side followed by one of the
            second side. A row of `values` has their mean values over their own contests, as in `contest.value_names`;
            `seeds` has the seed of the first of these.

    Example:
        >>> import kiks
        >>> contest = kiks.tasks.pursuit(seconds=2)
        >>> coevolution = kiks.Coevolution(contest, seed=1, population=4, opponents=2)
        >>> predator, prey = coevolution.run(generations=2)
        >>> coevolution.master_tournament(trials=1).scores.shape
        (2, 2, 2)
    """

    def __init__(
        self,
        contest: Contest,
        algorithm: str = "ga",
        *,
        seed: int = 0,
        population: int | None = None,
        opponents: int = OPPONENTS,
        folder: str | Path | None = None,
    ) -> None:
        self.contest = check_kind("contest", contest, Contest, "kiks.tasks.pursuit() returns one.")
        self.name = check_kind("algorithm", algorithm, str)
        self.population = check_count("population", contest.population if population is None else population, 4)
        self.opponents = check_count("opponents", opponents, 1, 1000)
        self.seed = check_count("seed", seed, most=2**63 - 1)
        self.generations: list[Generation] = []
        self._algorithms = [
            make_algorithm(
                algorithm,
                side.parameter_count,
                self.population,
                seed_for(self.seed, _ALGORITHM_SEED, number),
                (),
                contest.spread,
            )
            for number, side in enumerate(contest.sides)
        ]
        self._favourites: list[list[Floats]] = [[], []]
        self._asked: list[Floats] = []
        self._earlier_s, self._start_s = 0.0, perf_counter()
        self._folder = None if folder is None else Folder(folder)
        if self._folder is not None:
            self._resume(self._folder)

    # ---- ask and tell ----

    def ask(self) -> Floats:
        """Return the pairs of the next generation, float64 [pair, parameter]; the same until `tell`.

        The contests of the first side come first: for each of its candidates, one with each opponent.
        """
        own = self._populations()
        rivals = [self._opponents_from(side) for side in range(2)]
        first = [np.repeat(own[0], self.opponents, axis=0), np.tile(rivals[1], (self.population, 1))]
        second = [np.tile(rivals[0], (self.population, 1)), np.repeat(own[1], self.opponents, axis=0)]
        return np.concatenate([np.concatenate(first, axis=1), np.concatenate(second, axis=1)])

    @property
    def seeds(self) -> Integers:
        """Seeds of the pairs that `ask` returns, int64 [pair].

        Contests with the same opponent have the same seed, so that the fitness of candidates can be compared.
        """
        begin = len(self.generations) * self.opponents
        seeds = [seed_for(self.seed, _CONTEST_SEED, begin + number) for number in range(self.opponents)]
        return np.tile(np.array(seeds, np.int64), 2 * self.population)

    def tell(self, values: ArrayLike) -> None:
        """Take the values of the pairs of `ask`.

        Args:
            values: Float64 [pair, value], as `Contest.evaluate` returns them.
        """
        value_count, measure_count = len(self.contest.value_names), len(self.contest.measures)
        given = check_numbers("values", values, (2 * self.population * self.opponents, value_count))
        means = given.reshape(2, self.population, self.opponents, value_count).mean(axis=2)
        is_of_second = np.repeat([False, True, False, True], [1, 1, measure_count, measure_count])
        seconds = self._earlier_s + perf_counter() - self._start_s
        self._tell(np.where(is_of_second, means[1], means[0]), seconds)
        if self._folder is not None:
            self._folder.save(len(self.generations) - 1, self.generations[-1])

    def _tell(self, values: Floats, seconds: float) -> None:
        own = self._populations()
        for side, algorithm in enumerate(self._algorithms):
            algorithm.tell(values[:, side], np.zeros((self.population, 0)))
            favourite = algorithm.favourite()
            best = own[side][values[:, side].argmax()] if favourite is None else favourite
            self._favourites[side].append(best.copy())
        generation = Generation(
            candidates=self._both_populations(),
            values=values,
            seeds=np.full(self.population, self.seeds[0]),
            population=self.population,
            champion_fitness=np.nan,
            seconds=seconds,
        )
        self.generations.append(generation)
        self._asked = []

    def _populations(self) -> list[Floats]:
        """Return the candidates of both sides, float64 [candidate, parameter] each."""
        if not self._asked:
            self._asked = [algorithm.ask() for algorithm in self._algorithms]
        return self._asked

    def _both_populations(self) -> Floats:
        """Return the candidates of both sides in one row each, float64 [candidate, parameter]."""
        return np.concatenate(self._populations(), axis=1)

    def _opponents_from(self, side: int) -> Floats:
        """Return the opponents that a side provides, float64 [opponent, parameter]."""
        latest = self._favourites[side][-self.opponents :][::-1] or list(self._populations()[side])
        return np.array([latest[number % len(latest)] for number in range(self.opponents)])

    # ---- run ----

    def run(
        self,
        *,
        generations: int | None = None,
        seconds: float | None = None,
        executor: Executor | None = None,
        each: Callable[[Coevolution], Any] | None = None,
    ) -> tuple[Champion, Champion]:
        """Evolve.

        Args:
            generations: Total number of generations, including earlier ones.
            seconds: No generation begins later than this [s of the wall clock].
            executor: Evaluates candidates, such as a `ThreadPoolExecutor`; the cores of this computer do if left out.
            each: Called after each generation.

        Returns:
            The champions of the last generation.

        Raises:
            WorkError: If the contest cannot be evaluated.
        """
        run_generations(self, generations=generations, seconds=seconds, executor=executor, each=each)
        return self.champion(0), self.champion(1)

    def save_log(self) -> None:
        """Write the champions of the last generation and the log into the folder, if there is one."""
        if self._folder is not None and self.generations:
            for side, name in enumerate(self.contest.side_names):
                self.champion(side).save(self._folder.path / f"{name}.toml")
            self._write_log(self._folder.path / LOG)

    def _write_log(self, path: Path) -> None:
        """Write a row for each row of the generations' candidates."""
        counts = np.arange(1, len(self.generations) + 1)
        columns = {
            "generation": np.repeat(counts, self.population),
            "candidate": np.tile(np.arange(self.population), len(counts)),
        }
        table = np.concatenate([each.values for each in self.generations])
        columns |= {name: table[:, number] for number, name in enumerate(self.contest.value_names)}
        columns["seconds"] = np.repeat([each.seconds for each in self.generations], self.population)
        columns["contests"] = np.repeat(counts * 2 * self.population * self.opponents, self.population)
        write_parquet(columns, path, "the log")

    # ---- results ----

    @property
    def work(self) -> Contest:
        """The contest."""
        return self.contest

    @property
    def figures(self) -> dict[str, float]:
        """What the last generation achieved: the best and the mean fitness of each side."""
        of_sides = list(zip(self.contest.side_names, self.generations[-1].values.T, strict=False))
        best = {f"best {name}": fitness.max() for name, fitness in of_sides}
        return best | {f"mean {name}": fitness.mean() for name, fitness in of_sides}

    @property
    def driven_s(self) -> float:
        """Total time for which the robots of the last generation drove [s]."""
        return 2 * self.population * self.opponents * self.contest.driven_s

    def champion(self, side: int | str, generation: int | None = None) -> Champion:
        """Return the champion of a side in a generation: the candidate that the algorithm considers best.

        Its fitness and its measures are those of the best candidate of its generation.

        Args:
            side: Number or name of the side.
            generation: Number of the generation, from 1; the last one if left out.
        """
        contest, count = self.contest, len(self.generations)
        if not isinstance(side, int | str) or side not in (0, 1, *contest.side_names):
            raise ParameterError(
                f"side must be 0, 1 or one of {', '.join(contest.side_names)}, but it was {shown(side)}."
            )
        index = contest.side_names.index(side) if isinstance(side, str) else side
        if not count:
            raise ParameterError("tell() must be called for a generation before there is a champion, but it was not.")
        number = check_count("generation", count if generation is None else generation, 1, count)
        values, measure_count = self.generations[number - 1].values, len(contest.measures)
        best = values[values[:, index].argmax()].tolist()
        first = 2 + index * measure_count
        return Champion(
            controller=contest.sides[index].controller,
            parameters=tuple(self._favourites[index][number - 1].tolist()),
            task=contest.name,
            fitness=best[index],
            measures=dict(zip(contest.measure_names, best[first : first + measure_count], strict=True)),
            generation=number,
            algorithm=self.name,
            seed=self.seed,
            robot=contest.sides[index].robot,
            timing=contest.timing,
        )

    def master_tournament(
        self, *, trials: int = TRIALS, every: int = 1, executor: Executor | None = None
    ) -> Tournament:
        """Let the champion of each generation meet the champions of all generations of the other side.

        Args:
            trials: Number of contests of each pair. In each trial all champions have the same starts, a different one
                with each opponent.
            every: Take only each so-many-th generation, the last one included.
            executor: Evaluates candidates, such as a `ThreadPoolExecutor`; the cores of this computer do if left out.

        Raises:
            WorkError: If the contest cannot be evaluated.
        """
        trials, every = check_count("trials", trials, 1, 10_000), check_count("every", every, 1)
        count = len(self.generations)
        if not count:
            raise ParameterError("tell() must be called for a generation before a tournament, but it was not.")
        chosen = np.arange(count - 1, -1, -every)[::-1]
        first, second = (np.array(favourites)[chosen] for favourites in self._favourites)
        size = len(chosen)
        pairs = np.concatenate([np.repeat(first, size, axis=0), np.tile(second, (size, 1))], axis=1)
        scores = np.zeros((2, size, size))
        starts = latin_square(size, seed_for(self.seed, _SQUARE_SEED)).ravel()
        for trial in range(trials):
            numbers = range(trial * size, (trial + 1) * size)
            seeds = np.array([seed_for(self.seed, TOURNAMENT_SEED, number) for number in numbers], np.int64)
            scores += evaluate(self.contest, pairs, seeds[starts], executor)[:, :2].T.reshape(2, size, size)
        return Tournament(self.contest.side_names, chosen + 1, scores / trials)

    # ---- folders ----

    def _resume(self, folder: Folder) -> None:
        """Take the generations of the folder."""
        contest = self.contest
        algorithm = f"{self.name}, {self.opponents} opponents"
        controllers = " and ".join(side.controller.name for side in contest.sides)
        folder.check_identity(
            Identity(contest.name, algorithm, self.seed, self.population, controllers, contest.digest(), __version__)
        )
        for values, seconds in folder.saved_generations(self._both_populations, len(contest.value_names)):
            self._tell(values, seconds)
        self._earlier_s = self.generations[-1].seconds if self.generations else 0.0


def latin_square(size: int, seed: int) -> Integers:
    """Return a square whose rows and columns hold each number from 0 to size - 1 once, int64 [row, column].

    Rows and columns are shuffled: equal numbers form no lines, which would be seen in the tournament's picture.
    """
    rng = np.random.default_rng(seed)
    square: Integers = (rng.permutation(size)[:, None] + rng.permutation(size)) % size
    return square
