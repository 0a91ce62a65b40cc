"""The algorithms: they propose candidates and learn from their fitness.

An algorithm draws all random numbers from its seed, and depends on nothing but the values that it is told: the same
seed and values give the same candidates. So an evolution resumes by telling all generations again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, library, nearest, shown
from kiks.learn.algorithm_name import AlgorithmName
from kiks.learn.task import Axis

Floats = NDArray[np.float64]


class Algorithm(Protocol):
    """Proposes candidates. `ask` and `tell` alternate; an algorithm of a user's own may do without `favourite`."""

    def ask(self) -> Floats:
        """Return the next generation, float64 [candidate, parameter]."""
        ...

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Take their fitness, float64 [candidate], and their behaviours, float64 [candidate, axis]."""

    def favourite(self) -> Floats | None:
        """Return the best parameters according to the algorithm, float64 [parameter].

        None if it looks for many behaviours and prefers none: then the best one of the evolution's archive counts.
        """
        ...


class Setting(NamedTuple):
    """What an algorithm begins with.

    Attributes:
        parameter_count: Number of parameters of a candidate.
        population: Number of candidates in a generation.
        seed: Seed of its random numbers.
        axes: Axes along which behaviours differ.
        spread: Standard deviation of each parameter at the beginning.
    """

    parameter_count: int
    population: int
    seed: int
    axes: Sequence[Axis]
    spread: float


class Cma:
    """CMA-ES: a normal distribution whose mean and covariance adapt to the successful candidates."""

    def __init__(self, setting: Setting) -> None:
        cma = library("cma")
        rng = np.random.default_rng(setting.seed)
        options = {
            "popsize": setting.population,
            "randn": lambda *shape: rng.standard_normal(shape),
            "seed": np.nan,  # leaves the random numbers of the process alone
            "verbose": -9,
            "verb_log": 0,
        }
        self._strategy: Any = cma.CMAEvolutionStrategy(np.zeros(setting.parameter_count), setting.spread, options)
        self._candidates: list[Floats] = []

    def ask(self) -> Floats:
        """Return the next generation."""
        self._candidates = self._strategy.ask()
        return np.array(self._candidates)

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Take their fitness."""
        self._strategy.tell(self._candidates, (-fitness).tolist())

    def favourite(self) -> Floats:
        """Return the mean of the distribution."""
        return np.array(self._strategy.mean)


class Ga:
    """A genetic algorithm: tournaments of three, each parameter from either parent, normal mutations, one elite."""

    MUTATION = 0.07
    """Standard deviation of a mutation, relative to that of the first generation."""

    RIVALS = 3
    """Number of candidates in a tournament."""

    def __init__(self, setting: Setting) -> None:
        self._rng = np.random.default_rng(setting.seed)
        self._spread = setting.spread
        self._candidates = self._spread * self._rng.standard_normal((setting.population, setting.parameter_count))
        self._favourite = self._candidates[0]

    def ask(self) -> Floats:
        """Return the next generation."""
        return self._candidates.copy()

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Breed the next generation."""
        rng, (population, parameter_count) = self._rng, self._candidates.shape
        self._favourite = self._candidates[np.argmax(fitness)].copy()
        rivals = rng.integers(population, size=(2, population, self.RIVALS))
        winners = np.take_along_axis(rivals, fitness[rivals].argmax(axis=2)[:, :, None], axis=2)[:, :, 0]
        mothers, fathers = self._candidates[winners]
        children = np.where(rng.random((population, parameter_count)) < 0.5, mothers, fathers)
        children += self.MUTATION * self._spread * rng.standard_normal(children.shape)
        children[0] = self._favourite
        self._candidates = children

    def favourite(self) -> Floats:
        """Return the best of the last generation."""
        best: Floats = self._favourite.copy()
        return best


class Roulette:
    """A simple genetic algorithm: a roulette wheel, one-point crossover, mutation, and nobody survives.

    Fitness is scaled linearly before the wheel turns, so that the best candidate has `BEST` times the chance of an
    average one, or less if the worst would have none (Goldberg, Genetic Algorithms in Search, Optimization, and Machine
    Learning, 1989). Genes begin, and mutate, evenly spread with the deviation of the first generation; they have no
    bounds.
    """

    BEST = 2.0
    """Chance of the best candidate on the wheel, as a multiple of the mean one."""

    CROSSOVER, MUTATION = 0.1, 0.2
    """Chance that a pair of children is crossed, and that a gene mutates."""

    def __init__(self, setting: Setting) -> None:
        self._rng = np.random.default_rng(setting.seed)
        self._reach = setting.spread * np.sqrt(3.0)
        self._candidates = self._rng.uniform(-self._reach, self._reach, (setting.population, setting.parameter_count))
        self._favourite = self._candidates[0]

    def ask(self) -> Floats:
        """Return the next generation."""
        return self._candidates.copy()

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Breed the next generation."""
        rng, (population, parameter_count) = self._rng, self._candidates.shape
        self._favourite = self._candidates[np.argmax(fitness)].copy()
        children = self._candidates[rng.choice(population, population, p=self.chances(fitness))]
        for first in range(0, population - 1, 2):
            if rng.random() < self.CROSSOVER:
                tail = np.arange(parameter_count) >= rng.integers(1, max(parameter_count, 2))
                pair = children[first : first + 2]
                children[first : first + 2] = np.where(tail, pair[::-1], pair)
        mutates = rng.random(children.shape) < self.MUTATION
        self._candidates = children + mutates * rng.uniform(-self._reach, self._reach, children.shape)

    def chances(self, fitness: Floats) -> Floats:
        """Return the chance of each candidate on the wheel, float64 [candidate]."""
        mean, best, worst = fitness.mean(), fitness.max(), fitness.min()
        if best <= mean or worst >= mean:
            return np.full(len(fitness), 1.0 / len(fitness))
        gain = min((self.BEST - 1.0) / (best - mean), 1.0 / (mean - worst))
        scaled = np.maximum(1.0 + gain * (fitness - mean), 0.0)
        chances: Floats = scaled / scaled.sum()
        return chances

    def favourite(self) -> Floats:
        """Return the best of the last generation."""
        best: Floats = self._favourite.copy()
        return best


class Diverse:
    """Finds many behaviours: new candidates come from an archive of those that differ. pyribs keeps it and proposes.

    Behaviours are counted in cells of the axes, so that axes with different units count alike.
    """

    def __init__(self, setting: Setting) -> None:
        axes = setting.axes
        if not axes:
            raise ParameterError(
                "the task must have axes along which behaviours differ for this algorithm, but it has none. "
                "Give it some, or take cma."
            )
        self._low, self._high = (np.array([getattr(axis, name) for axis in axes]) for name in ("low", "high"))
        self._cell = (self._high - self._low) / [axis.cells for axis in axes]
        schedulers, archives = library("ribs.schedulers"), library("ribs.archives")
        archive = self.make_archive(archives, setting)
        self._scheduler: Any = schedulers.Scheduler(
            archive, self.make_emitters(library("ribs.emitters"), archive, setting)
        )

    def make_archive(self, archives: Any, setting: Setting) -> Any:
        """Return the archive: one elite for each cell."""
        cells = [axis.cells for axis in setting.axes]
        ranges = [(0, count) for count in cells]
        return archives.GridArchive(solution_dim=setting.parameter_count, dims=cells, ranges=ranges, seed=setting.seed)

    def make_emitters(self, emitters: Any, archive: Any, setting: Setting) -> list[Any]:
        """Return what proposes candidates."""
        raise NotImplementedError

    def ask(self) -> Floats:
        """Return the next generation."""
        return np.array(self._scheduler.ask())

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Put candidates into the archive that are new, or better than what is there."""
        if behaviours.shape[1] != len(self._low):
            raise ParameterError(
                "tell() must be given fitness and measures for this algorithm, but it was given fitness alone."
            )
        inside = np.clip(behaviours, self._low, self._high)  # what lies beyond an end is nothing new
        self._scheduler.tell(fitness, (inside - self._low) / self._cell)

    def favourite(self) -> None:
        """Return None: it prefers none of its behaviours."""


class MapElites(Diverse):
    """MAP-Elites: keeps the best candidate for each cell of a map of behaviours; all of them are parents.

    A new candidate lies near an elite, moved along the line to another one (Vassiliades and Mouret 2018).
    """

    NEAR, ALONG = 0.2, 0.2
    """Standard deviation of a child's distance from its parent in all directions, and along the line."""

    def make_emitters(self, emitters: Any, archive: Any, setting: Setting) -> list[Any]:
        """Return an emitter of variations of elites."""
        count, seed, rng = setting.population, setting.seed, np.random.default_rng(setting.seed)
        first = setting.spread * rng.standard_normal((count, setting.parameter_count))
        sigmas = {"iso_sigma": self.NEAR * setting.spread, "line_sigma": self.ALONG}
        return [emitters.IsoLineEmitter(archive, **sigmas, initial_solutions=first, batch_size=count, seed=seed)]


class CmaMe(Diverse):
    """CMA-ME: several CMA-ES that follow what improves the map most; each begins again at an elite when it finds none.

    Source: Fontaine and others, Covariance matrix adaptation for the rapid illumination of behavior space, 2020.
    """

    STRATEGY = 40
    """Number of candidates of a strategy; a larger population has several."""

    RANKER, SELECTION, RESTART = "2imp", "filter", "no_improvement"
    """What pyribs ranks candidates by, which of them it follows, and when a strategy begins again."""

    def make_emitters(self, emitters: Any, archive: Any, setting: Setting) -> list[Any]:
        """Return the strategies."""
        parts = np.array_split(np.arange(setting.population), max(1, setting.population // self.STRATEGY))
        return [
            emitters.EvolutionStrategyEmitter(
                archive,
                x0=np.zeros(setting.parameter_count),
                sigma0=setting.spread,
                ranker=self.RANKER,
                selection_rule=self.SELECTION,
                restart_rule=self.RESTART,
                batch_size=len(part),
                seed=child,
            )
            for part, child in zip(parts, np.random.SeedSequence(setting.seed).spawn(len(parts)), strict=True)
        ]


class Novelty(CmaMe):
    """Novelty search: the same strategies follow what was not seen before, and fitness does not count.

    Novelty is the mean distance from the nearest behaviours of an archive, which those that are novel enough enter
    (Lehman and Stanley, Abandoning objectives, 2011).
    """

    NEIGHBOURS, NOVEL_CELLS = 15, 1.0
    """Number of nearest behaviours that count, and the least novelty for the archive [cells]."""

    RANKER, SELECTION, RESTART = "nov", "mu", "basic"

    def make_archive(self, archives: Any, setting: Setting) -> Any:
        """Return the archive of novel behaviours."""
        return archives.ProximityArchive(
            solution_dim=setting.parameter_count,
            measure_dim=len(setting.axes),
            k_neighbors=self.NEIGHBOURS,
            novelty_threshold=self.NOVEL_CELLS,
            seed=setting.seed,
        )


ALGORITHMS: dict[str, Callable[[Setting], Algorithm]] = {
    AlgorithmName.CMA.value: Cma,
    AlgorithmName.GA.value: Ga,
    AlgorithmName.MAP_ELITES.value: MapElites,
    AlgorithmName.CMA_ME.value: CmaMe,
    AlgorithmName.NOVELTY.value: Novelty,
    AlgorithmName.ROULETTE.value: Roulette,
}
"""The algorithms by their names."""


def make_algorithm(name: str, setting: Setting) -> Algorithm:
    """Return an algorithm."""
    if name not in ALGORITHMS:
        raise ParameterError(
            f"algorithm must be one of {', '.join(ALGORITHMS)}, or an object with ask and tell, but it was "
            f"{shown(name)}.{nearest(str(name), map(str, ALGORITHMS))}"
        )
    return ALGORITHMS[name](setting)
