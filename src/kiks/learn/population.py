"""The populations of an evolution, one for each side, and the trials of the rivals of one side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from kiks.errors import ParameterError
from kiks.learn import seeds
from kiks.learn.algorithm import Algorithm, Floats
from kiks.learn.archive import Archive
from kiks.learn.evolution_log import TRIALS
from kiks.learn.finals import FINALISTS, Contender
from kiks.learn.seeds import seed_for
from kiks.learn.task import Task
from kiks.model.array_checks import check_numbers


class Population:
    """The candidates of a side.

    Args:
        task: The task.
        parameter_count: Number of parameters of a candidate.
        algorithm: What proposes the candidates.
        size: Number of candidates in a generation; None for as many as the algorithm proposes first.
        archive: The archive of the side; None if the task has no axes.

    Attributes:
        favourites: The candidate of each generation that the algorithm considered best, else the fittest.
        prefers_elites: Whether the algorithm prefers none of its last candidates, so that those of the archive count.
    """

    def __init__(
        self, task: Task, parameter_count: int, algorithm: Algorithm, size: int | None, archive: Archive | None
    ) -> None:
        self.algorithm, self.archive = algorithm, archive
        self.favourites: list[Contender] = []
        self.prefers_elites = False
        self._parameter_count = parameter_count
        self._names = ("fitness", *task.measure_names)
        self._axes, self._objectives = task.axes, task.objectives
        self._size = size
        self._asked: Floats | None = None
        if size is None:
            self._size = len(self.candidates)

    @property
    def candidates(self) -> Floats:
        """The candidates of the next generation, float64 [candidate, parameter]; the same until `tell`."""
        if self._asked is None:
            shape = (self._size, self._parameter_count)
            self._asked = check_numbers("candidates of ask()", self.algorithm.ask(), shape)
            if not len(self._asked):
                raise ParameterError("candidates of ask() must be at least one, but there were none.")
        return self._asked

    @property
    def is_asked(self) -> bool:
        """Whether candidates were asked for that have no values yet."""
        return self._asked is not None

    def opponents(self, count: int) -> Floats:
        """Return opponents for the other side, float64 [opponent, parameter]: the last favourites, in turn if fewer.

        In the first generation they are candidates.
        """
        latest = [each.parameters for each in self.favourites[-count:][::-1]]
        known = latest or self.candidates.tolist()
        return np.array([known[number % len(known)] for number in range(count)])

    def tell(self, values: Floats, generation: int) -> None:
        """Take the values of the candidates, fitness and measures or fitness alone, float64 [candidate, value]."""
        own, fitness, behaviours = self.candidates, values[:, 0], np.zeros((len(values), 0))
        has_measures = values.shape[1] == len(self._names)
        if has_measures:
            places = values[:, [self._names.index(axis.measure) for axis in self._axes]]
            behaviours = np.concatenate([places, self.objectives(values)], axis=1)
        self.algorithm.tell(fitness.copy(), behaviours)
        if self.archive is not None and has_measures:
            self.archive.add(own, values, generation)
        best = Contender(tuple(own[fitness.argmax()].tolist()), generation)
        favourite = self._favourite(best)
        self.favourites.append(favourite or best)
        self.prefers_elites = favourite is None
        self._asked = None

    def objectives(self, values: Floats) -> Floats:
        """Return the objectives of values [candidate, value], more is better, float64 [candidate, objective]."""
        signs = np.array([-1.0 if name.startswith("-") else 1.0 for name in self._objectives])
        chosen: Floats = values[:, [self._names.index(name.removeprefix("-")) for name in self._objectives]] * signs
        return chosen

    def _favourite(self, best: Contender) -> Contender | None:
        """Return the candidate that the algorithm considers best; None if it prefers none.

        Args:
            best: The fittest of the generation, for an algorithm of a user's that does not say what it prefers.
        """
        if getattr(self.algorithm, "favourite", None) is None:
            return best
        preferred = self.algorithm.favourite()
        if preferred is None and self.archive is not None:
            return None
        # None without an archive is a mistake of the user's algorithm, which the check says.
        parameters = check_numbers("parameters of favourite()", preferred, (self._parameter_count,))
        return Contender(tuple(parameters.tolist()), best.generation)

    @property
    def elites(self) -> list[Contender]:
        """The elites of the archive, the best first."""
        elites = () if self.archive is None else self.archive.best_first()
        return [Contender(each.parameters, each.generation) for each in elites]


class Trials:
    """The trials of the rivals of one side: each drives in the same worlds, in which no generation trains.

    Args:
        seed: Seed of the evolution.

    Attributes:
        seeds: Seeds of the worlds.
        rival: The candidate that is tried with the next generation; None if there is none.
        fitness: Mean fitness of those that were tried.
    """

    def __init__(self, seed: int) -> None:
        self.seeds = [seed_for(seed, seeds.TRIALS, number) for number in range(TRIALS)]
        self.rival: Contender | None = None
        self.fitness: dict[Contender, float] = {}

    @property
    def rows(self) -> list[Floats]:
        """The candidates that are tried, float64 [trial, parameter], or none."""
        return [] if self.rival is None else [np.tile(self.rival.parameters, (TRIALS, 1))]

    def tell(self, values: Floats) -> tuple[Contender, Floats] | None:
        """Take the values of the trials, float64 [trial, value]; return the rival with its means if it is the best."""
        if self.rival is None:
            return None
        rival, means = self.rival, values.mean(axis=0)
        is_best = all(means[0] > fitness for fitness in self.fitness.values())
        self.fitness[rival] = float(means[0])
        return (rival, means) if is_best else None

    def choose(self, population: Population) -> None:
        """Choose the next rival: the favourite, or the best elite that was not tried yet."""
        if population.prefers_elites:
            untried = (elite for elite in population.elites if elite not in self.fitness)
            self.rival = next(untried, None)
        else:
            self.rival = population.favourites[-1]

    def finalists(self, elites: Sequence[Contender]) -> list[Contender]:
        """Return the finalists, each once: the first of the rivals, the best first, then the first of some elites."""
        rivals = sorted(self.fitness, key=lambda each: -self.fitness[each])
        return different([*different(rivals)[:FINALISTS], *different(elites)[:FINALISTS]])


def different(contenders: Iterable[Contender]) -> list[Contender]:
    """Return the contenders without those whose parameters an earlier one has."""
    found: dict[tuple[float, ...], Contender] = {}
    for each in contenders:
        found.setdefault(each.parameters, each)
    return list(found.values())
