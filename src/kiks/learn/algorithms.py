"""The algorithms: they propose candidates and learn from their fitness.

An algorithm draws all random numbers from its seed, and depends on nothing but the values that it is told: the same
seed and values give the same candidates. So an evolution resumes by telling all generations again.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from kiks.errors import ParameterError, installing, nearest, shown
from kiks.learn.task import SPREAD, Axis

Floats = NDArray[np.float64]


class Algorithm(Protocol):
    """Proposes candidates. `ask` and `tell` alternate; an algorithm of a user's own may do without `favourite`."""

    def ask(self) -> Floats:
        """Return the next generation, float64 [candidate, parameter]."""
        ...

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Take their fitness, float64 [candidate], and their behaviours, float64 [candidate, axis]."""

    def favourite(self) -> Floats:
        """Return the best parameters according to the algorithm, float64 [parameter]."""
        ...


class Cma:
    """CMA-ES: a normal distribution whose mean and covariance adapt to the successful candidates.

    Args:
        parameter_count: Number of parameters of a candidate.
        population: Number of candidates in a generation.
        seed: Seed of its random numbers.
        spread: Standard deviation of each parameter at the beginning.
    """

    def __init__(
        self, parameter_count: int, population: int, seed: int, axes: Sequence[Axis] = (), spread: float = SPREAD
    ) -> None:
        cma = library("cma")
        rng = np.random.default_rng(seed)
        options = {
            "popsize": population,
            "randn": lambda *shape: rng.standard_normal(shape),
            "seed": np.nan,  # leaves the random numbers of the process alone
            "verbose": -9,
            "verb_log": 0,
        }
        self._strategy: Any = cma.CMAEvolutionStrategy(np.zeros(parameter_count), spread, options)
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
    """A genetic algorithm: tournaments of three, each parameter from either parent, normal mutations, one elite.

    Args:
        parameter_count: Number of parameters of a candidate.
        population: Number of candidates in a generation.
        seed: Seed of its random numbers.
        spread: Standard deviation of each parameter at the beginning.
    """

    MUTATION = 0.07
    """Standard deviation of a mutation, relative to that of the first generation."""

    RIVALS = 3
    """Number of candidates in a tournament."""

    def __init__(
        self, parameter_count: int, population: int, seed: int, axes: Sequence[Axis] = (), spread: float = SPREAD
    ) -> None:
        self._rng = np.random.default_rng(seed)
        self._spread = spread
        self._candidates = spread * self._rng.standard_normal((population, parameter_count))
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


class MapElites:
    """MAP-Elites: keeps the best candidate for each cell of a map of behaviours; all of them are parents.

    A new candidate lies near an elite, moved along the line to another one (Vassiliades and Mouret 2018).

    Args:
        parameter_count: Number of parameters of a candidate.
        population: Number of candidates in a generation.
        seed: Seed of its random numbers.
        axes: Axes of the map.
        spread: Standard deviation of each parameter at the beginning.

    Raises:
        ParameterError: If there are no axes.
    """

    NEAR, ALONG = 0.1, 0.2
    """Standard deviation of a child's distance from its parent in all directions, and along the line."""

    def __init__(
        self, parameter_count: int, population: int, seed: int, axes: Sequence[Axis] = (), spread: float = SPREAD
    ) -> None:
        if not axes:
            raise ParameterError(
                "map-elites must have axes along which behaviours differ, but this task has none. Give it some."
            )
        archives, emitters = library("ribs.archives"), library("ribs.emitters")
        schedulers = library("ribs.schedulers")
        first = spread * np.random.default_rng(seed).standard_normal((population, parameter_count))
        self.archive: Any = archives.GridArchive(
            solution_dim=parameter_count,
            dims=[axis.cells for axis in axes],
            ranges=[(axis.low, axis.high) for axis in axes],
            seed=seed,
        )
        emitter = emitters.IsoLineEmitter(
            self.archive,
            iso_sigma=self.NEAR * spread,
            line_sigma=self.ALONG,
            initial_solutions=first,
            batch_size=population,
            seed=seed,
        )
        self._scheduler: Any = schedulers.Scheduler(self.archive, [emitter])

    def ask(self) -> Floats:
        """Return the next generation."""
        return np.array(self._scheduler.ask())

    def tell(self, fitness: Floats, behaviours: Floats) -> None:
        """Put candidates on the map that are better than the elites of their cells."""
        self._scheduler.tell(fitness, behaviours)

    def favourite(self) -> Floats:
        """Return the best elite of the map."""
        return np.array(self.archive.best_elite["solution"])

    def heat_map(self) -> Floats:
        """Return the fitness in each cell, NaN in empty ones, float64 [cell of axis 0, ...]."""
        heat: Floats = np.full(self.archive.dims, np.nan)
        elites = self.archive.data(["index", "objective"], return_type="dict")
        heat[np.unravel_index(elites["index"], self.archive.dims)] = elites["objective"]
        return heat


ALGORITHMS: dict[str, type[Cma] | type[Ga] | type[MapElites]] = {"cma": Cma, "ga": Ga, "map-elites": MapElites}
"""The algorithms by their names."""


def make_algorithm(
    name: str, parameter_count: int, population: int, seed: int, axes: Sequence[Axis], spread: float
) -> Algorithm:
    """Return an algorithm.

    Raises:
        ParameterError: If the name is unknown, or its library is not installed.
    """
    if name not in ALGORITHMS:
        raise ParameterError(
            f"algorithm must be one of {', '.join(ALGORITHMS)}, or an object with ask and tell, but it was "
            f"{shown(name)}.{nearest(str(name), ALGORITHMS)}"
        )
    return ALGORITHMS[name](parameter_count, population, seed, axes, spread)


def library(name: str) -> Any:
    """Return a module of the libraries for learning.

    Raises:
        ParameterError: If it is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise ParameterError(
            f"This needs {package}, but it cannot be imported ({error}). {installing('learn')}."
        ) from None
