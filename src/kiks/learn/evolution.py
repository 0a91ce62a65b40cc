"""An evolution: it evaluates generations of candidates and keeps the best one, the champion.

Each generation drives in its own worlds, and its best candidate may have been lucky. So the candidate that the
algorithm considers best, the rival, is tried together with the next generation. Its trial worlds stay the same for the
whole evolution, and no generation trains in them. The best rival there is the champion.

An algorithm that looks for many behaviours prefers none. Then the rivals are the elites of the archive that were not
tried yet, the fittest first.

The best of many rivals may have been lucky in its trials, too. So at the end of a run, the best rivals drive in the
finals (`kiks.learn.finals`), with the best elites of such an algorithm. The winner is the champion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.errors import ParameterError
from kiks.learn.algorithms import Algorithm, make_algorithm
from kiks.learn.archive import CHAMPION, Archive
from kiks.learn.champion import Champion
from kiks.learn.evaluation import evaluate
from kiks.learn.evolution_log import Folder, Generation, Identity
from kiks.learn.finals import Contender, Finals, finalists_of
from kiks.learn.fingerprint import fingerprints
from kiks.learn.generation_loop import run_generations, seed_for
from kiks.learn.task import Task
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_count, check_kind
from kiks.version import __version__

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

TRIALS = 8
"""Trials of a rival, each in as many worlds as a candidate of the population gets."""

_ALGORITHM_SEED, WORLDS_SEED, TRIAL_SEED, BASELINE_SEED = range(4)
"""Purposes of seeds."""


class Evolution:
    """An evolution.

    Args:
        task: The task.
        algorithm: 'cma' (CMA-ES) or 'ga' (a genetic algorithm); for many different behaviours 'map-elites', 'cma-me'
            or 'novelty'. The task's own if left out. Or an object with `ask()`, which returns candidates, float64
            [candidate, parameter], each time as many, and `tell(fitness, behaviours)`, float64 [candidate] and
            [candidate, axis]. It may have `favourite()`, which returns the parameters that it considers best; else
            these are the best of the last generation.
        seed: Seed of all random numbers: the same seed gives the same evolution, with any number of workers.
        population: Number of candidates in a generation; the task's own if left out, or as many as `ask` returns, if
            the algorithm is an object.
        folder: Folder of its generations, its champion, its archive and its log. If it holds generations of the same
            evolution, the evolution continues after them, as if it had never stopped. Left out, nothing is written.

    Attributes:
        task: The task.
        algorithm: The state of the algorithm.
        archive: The best candidate of each cell of a map along the task's axes; None if it has no axes.
        generations: The generations with their values, in order.
        finals: The finals, if they were held after the last generation; else None.

    Example:
        >>> import kiks
        >>> evolution = kiks.Evolution(kiks.tasks.avoid(seconds=2), "ga", seed=1, population=8)
        >>> evolution.tell(evolution.task.evaluate(evolution.ask(), evolution.seeds))
        >>> evolution.champion.generation
        1
    """

    def __init__(
        self,
        task: Task,
        algorithm: object = None,
        *,
        seed: int = 0,
        population: int | None = None,
        folder: str | Path | None = None,
    ) -> None:
        self.task = check_kind("task", task, Task, "kiks.tasks.load() returns one.")
        self.seed = check_count("seed", seed, most=2**63 - 1)
        self.generations: list[Generation] = []
        self.finals: Finals | None = None
        self._asked: Floats | None = None
        self.algorithm: Algorithm
        if is_algorithm(algorithm):
            self.name, self.algorithm = type(algorithm).__name__, algorithm
            self._asked = self._candidates(None if population is None else check_count("population", population, 1))
            self.population = len(self._asked)
        else:
            name = task.algorithm if algorithm is None else algorithm
            self.name = str(check_kind("algorithm", name, str, "Or give an object with ask and tell."))
            self.population = check_count("population", task.population if population is None else population, 4)
            self.algorithm = make_algorithm(
                self.name,
                task.parameter_count,
                self.population,
                seed_for(self.seed, _ALGORITHM_SEED),
                task.axes,
                task.spread,
            )
        self._trial_seeds = [seed_for(self.seed, TRIAL_SEED, number) for number in range(TRIALS)]
        self._rival: Contender | None = None
        self._tried: dict[Contender, float] = {}  # mean fitness of their trials
        self._tries_elites = False
        self._best: Champion | None = None
        self._world = task.world()
        unknown = self._champion(Contender((0.0,) * task.parameter_count, 0), np.zeros(len(task.value_names)))
        self.archive = Archive(task.axes, task.value_names, unknown) if task.axes else None
        self._earlier_s, self._start_s = 0.0, perf_counter()
        self._folder = None if folder is None else Folder(folder)
        if self._folder is not None:
            self._resume(self._folder)

    # ---- ask and tell ----

    def ask(self) -> Floats:
        """Return the candidates of the next generation, float64 [candidate, parameter]; the same until `tell`.

        After the population come the trials of the last generation's rival, if there is one.
        """
        if self._asked is None:
            asked = self._candidates(self.population)
            if self._rival is not None:
                asked = np.concatenate([asked, np.tile(self._rival.parameters, (TRIALS, 1))])
            self._asked = asked
        return self._asked.copy()

    def _candidates(self, count: int | None) -> Floats:
        """Return candidates of the algorithm, a copy.

        Args:
            count: Number of candidates; any from 1 if None.
        """
        candidates = check_numbers("candidates of ask()", self.algorithm.ask(), (count, self.task.parameter_count))
        if not len(candidates):
            raise ParameterError("candidates of ask() must be at least one, but there were none.")
        return candidates

    @property
    def seeds(self) -> Integers:
        """Seeds of the worlds of the candidates that `ask` returns, int64 [candidate].

        All candidates of a population drive in the same worlds, so their fitness can be compared.
        """
        seeds = [seed_for(self.seed, WORLDS_SEED, len(self.generations))] * self.population
        return np.array(seeds + ([] if self._rival is None else self._trial_seeds), np.int64)

    def tell(self, values: ArrayLike) -> None:
        """Take the values of the candidates of `ask`.

        Args:
            values: Fitness, then the measures, float64 [candidate, 1 + measure], as `Task.evaluate` returns them; or
                fitness alone, float64 [candidate]. More is better.
        """
        self._tell(values, self._now_s())
        if self._folder is not None:
            self._folder.save(len(self.generations) - 1, self.generations[-1])

    def _now_s(self) -> float:
        """Return the time since the evolution began [s of the wall clock]."""
        return self._earlier_s + perf_counter() - self._start_s

    def _tell(self, values: ArrayLike, seconds: float) -> None:
        if self._asked is None:
            raise ParameterError("ask() must come before each tell(), but it did not.")
        given = check_numbers("values", values)
        given = given[:, None] if given.ndim == 1 else given
        count, value_count = len(self._asked), len(self.task.value_names)
        if given.ndim != 2 or len(given) != count or given.shape[1] not in (1, value_count):
            raise ParameterError(
                f"values must be numbers [candidate] or [candidate, value], here ({count},) or {(count, value_count)}, "
                f"but their shape was {given.shape}."
            )
        fitness, trials = given[: self.population, 0], given[self.population :]
        if self._rival is not None:
            means = trials.mean(axis=0)
            self._tried[self._rival] = float(means[0])
            if self._best is None or means[0] > self._best.fitness:
                self._best = self._champion(self._rival, means)
        best_fitness = np.nan if self._best is None else self._best.fitness
        generation = Generation(self._asked, given, self.seeds, self.population, best_fitness, seconds)
        behaviours = np.zeros((self.population, 0))
        if given.shape[1] == value_count:
            columns = [self.task.value_names.index(axis.measure) for axis in self.task.axes]
            behaviours = given[: self.population, columns]
        self.algorithm.tell(fitness.copy(), behaviours)
        if self.archive is not None and given.shape[1] == value_count:
            self.archive.add(self._asked[: self.population], given[: self.population], len(self.generations) + 1)
        self._rival = self._next_rival(self._asked[int(fitness.argmax())])
        self.generations.append(generation)
        self._asked = self.finals = None

    def _next_rival(self, best: Floats) -> Contender | None:
        """Return the candidate to try next; None if all elites were tried.

        Args:
            best: The best candidate of the generation, for an algorithm that does not say what it prefers.
        """
        favourite: Any = getattr(self.algorithm, "favourite", None)
        preferred = best if favourite is None else favourite()
        self._tries_elites = preferred is None and self.archive is not None
        if self._tries_elites:
            return next((elite for elite in self._elites() if elite not in self._tried), None)
        preferred = check_numbers("parameters of favourite()", preferred, (self.task.parameter_count,))
        return Contender(tuple(preferred.tolist()), len(self.generations) + 1)

    def _elites(self) -> Iterator[Contender]:
        """Yield the elites of the archive, the best first."""
        if self.archive is not None:
            yield from (Contender(each.parameters, each.generation) for each in self.archive.best_first())

    # ---- run ----

    def run(
        self,
        *,
        generations: int | None = None,
        seconds: float | None = None,
        executor: Executor | None = None,
        each: Callable[[Evolution], Any] | None = None,
        each_round: Callable[[Finals], Any] | None = None,
    ) -> Champion:
        """Evolve, and hold the finals.

        Args:
            generations: Total number of generations, including earlier ones.
            seconds: No generation begins later than this [s of the wall clock].
            executor: Evaluates candidates, such as a `ThreadPoolExecutor`; the cores of this computer do if left out.
            each: Called after each generation.
            each_round: Called before each round of the finals.

        Returns:
            The champion.

        Raises:
            WorkError: If the task cannot be evaluated.
        """
        finish = partial(self.hold_finals, each_round=each_round)
        run_generations(self, generations=generations, seconds=seconds, executor=executor, each=each, finish=finish)
        return self.champion

    def hold_finals(
        self, executor: Executor | None = None, *, each_round: Callable[[Finals], Any] | None = None
    ) -> Champion:
        """Hold the finals, unless they were held after this generation; `run` does so at its end.

        A single rival, or none, has no finals.

        Args:
            executor: Evaluates candidates, such as a `ThreadPoolExecutor`; the cores of this computer do if left out.
            each_round: Called before each round.

        Returns:
            The champion.

        Raises:
            WorkError: If the task cannot be evaluated.
        """
        finals = None if self.finals else self._new_finals()
        if finals is not None:
            while not finals.is_over:
                if each_round is not None:
                    each_round(finals)
                finals.tell(evaluate(self.task, finals.ask(), finals.seeds, executor))
            finals.seconds = self._now_s()
            if self._folder is not None:
                self._folder.save_finals(len(self.generations) - 1, finals)
            self.finals = finals
        return self.champion

    def _new_finals(self) -> Finals | None:
        """Return finals before their first round; None if there are too few finalists."""
        rivals = sorted(self._tried, key=lambda each: -self._tried[each])
        finalists = finalists_of(rivals, self._elites() if self._tries_elites else ())
        if len(finalists) < 2:
            return None
        evaluations = sum(len(each.values) for each in self.generations)
        return Finals(finalists, self.seed, evaluations, len(self.task.value_names))

    def save_log(self) -> None:
        """Write the champion, the archive and the log into the folder, if there is one."""
        if self._folder is not None and self.generations:
            self.champion.save(self._folder.path / CHAMPION)
            if self.archive is not None:
                self.archive.save(self._folder.path)
            self._folder.save_log(self.generations, self.task.value_names)

    # ---- results ----

    @property
    def work(self) -> Task:
        """The task."""
        return self.task

    @property
    def figures(self) -> dict[str, float]:
        """What the last generation achieved: best fitness, that of the champion, mean fitness."""
        fitness = self.generations[-1].fitness
        return {"best": fitness.max(), "champion": self.champion.fitness, "mean": fitness.mean()}

    @property
    def driven_s(self) -> float:
        """Total time for which the robots of the last generation drove [s]."""
        return len(self.generations[-1].values) * self.task.driven_s

    @property
    def champion(self) -> Champion:
        """The winner of the finals; before these, the best rival; before the first trial, the best candidate."""
        if self.finals is not None:
            winner = self.finals.winner
            return self._champion(self.finals.finalists[winner], self.finals.means(winner))
        if self._best is not None:
            return self._best
        if not self.generations:
            raise ParameterError("tell() must be called for a generation before there is a champion, but it was not.")
        first = self.generations[-1]
        best = int(first.fitness.argmax())
        contender = Contender(tuple(first.candidates[best].tolist()), len(self.generations))
        return self._champion(contender, first.values[best])

    def _champion(self, contender: Contender, values: Floats) -> Champion:
        task, named = self.task, dict(zip(self.task.value_names, values.tolist(), strict=False))
        return Champion(
            controller=task.controller,
            parameters=contender.parameters,
            task=task.name,
            fitness=float(values[0]),
            measures={name: named[name] for name in task.measure_names if name in named},
            generation=contender.generation,
            algorithm=self.name,
            seed=self.seed,
            robot=task.kinds[0],
            timing=task.timings[0],
            world=self._world,
        )

    # ---- folders ----

    def _resume(self, folder: Folder) -> None:
        """Take the generations of the folder."""
        task = self.task
        controller = task.controller.name
        digest = task.digest() | fingerprints({"algorithm": type(self.algorithm)})
        folder.check_identity(
            Identity(task.name, self.name, self.seed, self.population, controller, digest, __version__, task.file)
        )
        for values, seconds in folder.saved_generations(self.ask, len(task.value_names)):
            self._tell(values, seconds)
        self._earlier_s = self.generations[-1].seconds if self.generations else 0.0
        finals = self._new_finals()
        saved = None if finals is None else folder.saved_finals(len(self.generations) - 1, finals)
        if finals is not None and saved is not None:
            values, finals.seconds = saved
            finals.tell_all(values)
            self.finals = finals


def is_algorithm(algorithm: object) -> TypeGuard[Algorithm]:
    """Return whether an object is an algorithm of a user's own."""
    return all(callable(getattr(algorithm, name, None)) for name in ("ask", "tell")) and not isinstance(algorithm, type)
