"""An evolution: it evaluates generations of candidates and keeps the best one, the champion.

Each generation drives in its own worlds, and its best candidate may have been lucky. So the candidate that the
algorithm considers best, the rival, is tried together with the next generation. Its trial worlds stay the same for the
whole evolution, and no generation trains in them. The best rival there is the champion.

An algorithm that looks for many behaviours prefers none. Then the rivals are the elites of the archive that were not
tried yet, the fittest first.

The two sides of a task evolve against each other: two populations, each with an algorithm of its own. Each candidate
meets champions of the other side, those of the last generations, and its fitness is its mean over these meetings.

At the end of a run the best candidates drive in the finals (`kiks.learn.finals`), which decide about the champions.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from kiks.errors import ParameterError, counted, shown
from kiks.learn import seeds
from kiks.learn.algorithm import Algorithm, Setting
from kiks.learn.algorithms import make_algorithm, whole_name
from kiks.learn.archive import Archive
from kiks.learn.champion import Champion
from kiks.learn.evaluation import Floats, Integers, evaluate
from kiks.learn.evolution_log import EvolutionFolder, Generation, Identity
from kiks.learn.finals import Contender, Finals, MasterTournament, halving_rounds, hold_finals, hold_tournament
from kiks.learn.fingerprint import fingerprints
from kiks.learn.population import Population, Trials
from kiks.learn.seeds import seed_for
from kiks.learn.task import Task
from kiks.meant import nearest
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_count, check_kind, check_number
from kiks.upwards import shown_in_notebooks
from kiks.version import __version__

LOG_EVERY_S = 10.0
"""Time between two writes of the log [s]; each writes the whole log."""

OPPONENTS = 10
"""Default number of opponents of a candidate (Floreano and Nolfi 1997)."""

MEETINGS = 2
"""Default number of evaluations of each pair in the tournament."""

TOURNAMENT_MAX = 100
"""Most champions of a side in the tournament of a run; of a longer evolution, champions at equal intervals."""


@shown_in_notebooks("kiks.learn.notebook", "evolution")
class Evolution:
    """An evolution.

    Args:
        task: The task.
        algorithm: 'cma' (CMA-ES), 'ga' or 'sga' (genetic algorithms), 'nsga2' (several objectives) or 'neat' (networks
            that grow); for many different behaviours 'map-elites', 'cma-me' or 'novelty'. With options behind a colon,
            such as 'cma:separable=true,restarts=ipop'. The task's own if left out. Or, for a task of one side, an
            object with `ask()`, which returns candidates, float64 [candidate, parameter], each time as many, and
            `tell(fitness, behaviours)`, float64 [candidate] and [candidate, axis and objective]. It may have
            `favourite()`, which returns the parameters that it considers best; else these are the best of the last
            generation.
        seed: Seed of all random numbers: the same seed gives the same evolution, with any number of workers.
        population: Number of candidates of a side in a generation; the task's own if left out, or as many as `ask`
            returns, if the algorithm is an object.
        opponents: Number of opponents of each candidate in a task of two sides: champions of the last generations, in
            turn if there are fewer; in the first generation, candidates of the other side. Ten if left out.
        folder: Folder of its generations, its champions, its archive and its log. If it holds generations of the same
            evolution, the evolution continues after them, as if it had never stopped. Left out, nothing is written.

    Attributes:
        task: The task.
        generations: The generations with their values, in order. Two sides stand side by side in a row.
        finals: The finals of one side, if they were held after the last generation; else None.
        tournament: The master tournament of two sides, if it was held after the last generation; else None.

    Example:
        >>> import kiks
        >>> evolution = kiks.Evolution(kiks.tasks.avoid(seconds=2), "ga", seed=1, population=8)
        >>> evolution.tell(evolution.task.evaluate(evolution.ask(), evolution.seeds))
        >>> evolution.champion.generation
        1
        >>> evolution = kiks.Evolution(kiks.tasks.pursuit(seconds=2), seed=1, population=4, opponents=2)
        >>> _ = evolution.run(generations=2)
        >>> predator, prey = evolution.champions
        >>> evolution.champion_of("prey", generation=1).generation
        1
        >>> evolution.master_tournament(trials=1).scores.shape
        (2, 2, 2)
        >>> evolution.hold_finals().generation == predator.generation
        True
        >>> evolution.save_log()  # into its folder, if it has one
    """

    def __init__(
        self,
        task: Task,
        algorithm: object = None,
        *,
        seed: int = 0,
        population: int | None = None,
        opponents: int | None = None,
        folder: str | Path | None = None,
    ) -> None:
        self.task = check_kind("task", task, Task, "kiks.tasks.load() returns one.")
        self.seed = check_count("seed", seed, most=2**63 - 1)
        if opponents is not None and not task.against:
            raise ParameterError(f"opponents must be left out of a task of one side, but it was {shown(opponents)}.")
        given = OPPONENTS if opponents is None else opponents
        self.opponents = check_count("opponents", given, 1, 1000) if task.against else 1
        self.generations: list[Generation] = []
        self.finals: Finals | None = None
        self.tournament: MasterTournament | None = None
        self._first_purpose = seeds.TWO_SIDES if task.against else 0
        self._world = None if task.against else task.project()
        self._names = ("fitness", *task.measure_names)
        algorithms: list[Algorithm]
        if is_algorithm(algorithm) and not task.against:
            self.name, algorithms = type(algorithm).__name__, [algorithm]
            size = None if population is None else check_count("population", population, 1)
        else:
            name = task.algorithm if algorithm is None else algorithm
            advice = "" if task.against else "Or give an object with ask and tell."
            self.name = whole_name(check_kind("algorithm", name, str, advice))
            size = check_count("population", task.population if population is None else population, 4)
            algorithms = [make_algorithm(self.name, each) for each in self._settings(size)]
        self._populations = [
            Population(task, side.parameter_count, each, size, self._new_archive(number))
            for number, (side, each) in enumerate(zip(task.sides, algorithms, strict=True))
        ]
        # An object of a user's is asked at once: how many candidates it returns may decide.
        asked_first = is_algorithm(algorithm) and not task.against
        self.population = len(self._populations[0].candidates) if asked_first or size is None else size
        self._trials = Trials(self.seed)
        self._best: Champion | None = None  # on trial
        self._earlier_s, self._start_s = 0.0, perf_counter()
        self._folder = None if folder is None else EvolutionFolder(folder)
        if self._folder is not None:
            self._resume(self._folder)

    def _settings(self, size: int) -> Iterator[Setting]:
        """Yield what the algorithm of each side begins with."""
        task, purpose = self.task, seeds.ALGORITHM + self._first_purpose
        for number, side in enumerate(task.sides):
            drawn = seed_for(self.seed, purpose, number)
            yield Setting(side.parameter_count, size, drawn, task.axes, task.spread, task.objectives, side.controller)

    def _new_archive(self, side: int) -> Archive | None:
        """Return an empty archive of a side, which has its champions from one like them; None without axes."""
        if not self.task.axes:
            return None
        placeholder = Contender((0.0,) * self.task.sides[side].parameter_count, 0)
        return Archive(self.task.axes, self._names, self._champion(side, placeholder, np.zeros(len(self._names))))

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.task.name!r}: {counted(len(self.generations), 'generation')}>"

    @property
    def algorithms(self) -> list[Algorithm]:
        """The state of each side's algorithm."""
        return [each.algorithm for each in self._populations]

    @property
    def archives(self) -> list[Archive]:
        """For each side, the best candidate of each cell of a map along the task's axes; none without axes."""
        return [each.archive for each in self._populations if each.archive is not None]

    @property
    def archive(self) -> Archive | None:
        """The archive of the first side; None if the task has no axes."""
        return self._populations[0].archive

    # ---- ask and tell ----

    def ask(self) -> Floats:
        """Return the candidates of the next generation, float64 [candidate, parameter]; the same until `tell`.

        After the population of one side come the trials of the last generation's rival, if there is one. Of two sides
        it returns pairs: for each candidate of the first side one with each opponent, then the same for the second.
        """
        rows = []
        for own in self._populations:
            parts = [
                np.repeat(each.candidates, self.opponents, axis=0)
                if each is own
                else np.tile(each.opponents(self.opponents), (self.population, 1))
                for each in self._populations
            ]
            rows.append(np.concatenate(parts, axis=1))
        return np.concatenate([*rows, *self._trials.rows])

    def _rows(self) -> Floats:
        """Return the candidates as they are saved: the sides side by side, then the trials."""
        return np.concatenate(
            [np.concatenate([each.candidates for each in self._populations], axis=1), *self._trials.rows]
        )

    @property
    def seeds(self) -> Integers:
        """Seeds of the worlds of the candidates that `ask` returns, int64 [candidate].

        All candidates of a population drive in the same worlds, or with the same opponent in the same worlds, so that
        their fitness can be compared.
        """
        purpose, begin = seeds.WORLDS + self._first_purpose, len(self.generations) * self.opponents
        drawn = [seed_for(self.seed, purpose, begin + number) for number in range(self.opponents)]
        drawn *= self.population * len(self._populations)
        return np.array(drawn + ([] if self._trials.rival is None else self._trials.seeds), np.int64)

    def tell(self, values: ArrayLike) -> None:
        """Take the values of the candidates of `ask`.

        Args:
            values: Fitness, then the measures, float64 [candidate, value], as `Task.evaluate` returns them; or, of one
                side, fitness alone, float64 [candidate]. More is better.
        """
        if not self._populations[0].is_asked:
            raise ParameterError("ask() must come before each tell(), but it did not.")
        given = check_numbers("values", values)
        given = given[:, None] if given.ndim == 1 else given
        sides, value_count = len(self._populations), len(self.task.value_names)
        pairs = sides * self.population * self.opponents
        count = pairs + sum(map(len, self._trials.rows))
        widths = {value_count} if self.task.against else {1, value_count}
        if given.ndim != 2 or len(given) != count or given.shape[1] not in widths:
            raise ParameterError(
                f"values must be numbers [candidate] or [candidate, value], here ({count},) or {(count, value_count)}, "
                f"but their shape was {given.shape}."
            )
        # Of each side, the mean over the opponents of its own candidates.
        means = given[:pairs].reshape(sides, self.population, self.opponents, -1).mean(axis=2)
        width = given.shape[1] // sides
        own = [means[side, :, side * width : (side + 1) * width] for side in range(sides)]
        self._tell(np.concatenate([np.concatenate(own, axis=1), given[pairs:]]), self._now_s())
        if self._folder is not None:
            self._folder.save(len(self.generations) - 1, self.generations[-1])

    def _now_s(self) -> float:
        """Return the time since the evolution began [s of the wall clock]."""
        return self._earlier_s + perf_counter() - self._start_s

    def _tell(self, values: Floats, seconds: float) -> None:
        """Take the values of the rows that are saved, float64 [row, value]."""
        number, asked, seeds_there = len(self.generations) + 1, self._rows(), self.seeds
        if (best := self._trials.tell(values[self.population :])) is not None:
            self._best = self._champion(0, *best)
        evaluations = len(seeds_there)
        if self.task.against:
            seeds_there = np.full(self.population, seeds_there[0])
        best_fitness = np.nan if self._best is None else self._best.fitness
        generation = Generation(asked, values, seeds_there, self.population, evaluations, best_fitness, seconds)
        parts = np.split(values[: self.population], len(self._populations), axis=1)
        for population, part in zip(self._populations, parts, strict=True):
            population.tell(part, number)
        if not self.task.against:
            self._trials.choose(self._populations[0])
        self.generations.append(generation)
        self.finals, self.tournament = None, None

    # ---- run ----

    def run(
        self,
        *,
        generations: int | None = None,
        seconds: float | None = None,
        executor: Executor | None = None,
        each: Callable[[Evolution], Any] | None = None,
        each_round: Callable[[int, list[int]], Any] | None = None,
    ) -> Champion:
        """Evolve, and hold the finals.

        Args:
            generations: Total number of generations, including earlier ones.
            seconds: No generation begins later than this [s of the wall clock].
            executor: Evaluates candidates, such as a `ThreadPoolExecutor`; the cores of this computer do if left out.
            each: Called after each generation.
            each_round: As for `hold_finals`.

        Returns:
            The champion, of two sides that of the first; `champions` has both.

        Raises:
            WorkError: If the task cannot be evaluated.

        Example:
            >>> import kiks
            >>> evolution = kiks.Evolution(kiks.tasks.avoid(seconds=1), "ga", seed=1, population=8)
            >>> champion = evolution.run(generations=2)
            >>> champion.task
            'avoid'
        """
        if generations is None and seconds is None:
            raise ParameterError("generations or seconds must be given, but neither was: the run would never end.")
        for name, value in (("generations", generations), ("seconds", seconds)):
            if value is not None:
                check_number(name, value, 0)
        begin_s, logged_s = perf_counter(), -np.inf
        try:
            while (generations is None or len(self.generations) < generations) and (
                seconds is None or perf_counter() - begin_s < seconds
            ):
                self.tell(evaluate(self.task, self.ask(), self.seeds, executor))
                if perf_counter() - logged_s > LOG_EVERY_S:
                    self.save_log()
                    logged_s = perf_counter()
                if each is not None:
                    each(self)
            if self.generations:
                self.hold_finals(executor, each_round=each_round)
        finally:
            self.save_log()
        return self.champion

    def hold_finals(
        self, executor: Executor | None = None, *, each_round: Callable[[int, list[int]], Any] | None = None
    ) -> Champion:
        """Hold the finals, unless they were held after this generation; `run` does so at its end.

        A single rival, or none, has no finals. Those of two sides are a master tournament.

        Args:
            executor: As for `run`.
            each_round: Called before each round with its number, from 0, and the number of candidates in each round.

        Returns:
            The champion, of two sides that of the first.

        Raises:
            WorkError: If the task cannot be evaluated.
        """
        if self.task.against:
            every = max(1, -(-len(self.generations) // TOURNAMENT_MAX))
            self.tournament = self.tournament or self.master_tournament(every=every, executor=executor)
        elif self.finals is None and len(finalists := self._finalists()) > 1:
            work = partial(evaluate, self.task, executor=executor)
            held = hold_finals(finalists, self.seed, self._evaluation_count, work, each_round)
            self.finals = replace(held, seconds=self._now_s())
            if self._folder is not None:
                self._folder.save_finals(len(self.generations) - 1, self.finals)
        return self.champion

    def _finalists(self) -> list[Contender]:
        population = self._populations[0]
        return self._trials.finalists(population.elites if population.prefers_elites else ())

    @property
    def _evaluation_count(self) -> int:
        return sum(each.evaluations for each in self.generations)

    def master_tournament(
        self, *, trials: int = MEETINGS, every: int = 1, executor: Executor | None = None
    ) -> MasterTournament:
        """Let the champion of each generation meet the champions of all generations of the other side.

        Args:
            trials: Number of evaluations of each pair.
            every: Take only each so-many-th generation, the last one included.
            executor: As for `run`.

        Raises:
            WorkError: If the task cannot be evaluated.
        """
        trials, every = check_count("trials", trials, 1, 10_000), check_count("every", every, 1)
        if not self.task.against:
            raise ParameterError(f"a tournament must have two sides, but the task {shown(self.task.name)} has one.")
        if not self.generations:
            raise ParameterError("tell() must be called for a generation before a tournament, but it was not.")
        chosen = np.arange(len(self.generations) - 1, -1, -every)[::-1]
        champions = [np.array([each.parameters for each in side.favourites])[chosen] for side in self._populations]
        scores = hold_tournament(champions, self.seed, trials, partial(evaluate, self.task, executor=executor))
        first, second = (side.name for side in self.task.sides)
        return MasterTournament((first, second), chosen + 1, scores)

    def save_log(self) -> None:
        """Write the champions, the archives and the log into the folder, if there is one."""
        if self._folder is not None and self.generations:
            for side, champion in zip(self.task.sides, self.champions, strict=True):
                champion.save(self._folder.champion_file(side.name))
            for side, archive in zip(self.task.sides, self.archives, strict=False):
                archive.save(self._folder.path, side.name)
            self._folder.save_log(self.generations, self.task.value_names)
            if self.tournament is not None:
                self._folder.save_tournament(self.tournament)

    # ---- results ----

    @property
    def figures(self) -> dict[str, float]:
        """Best, champion's and mean fitness of the last generation; of two sides, best and mean of each."""
        last = self.generations[-1]
        if not self.task.against:
            return {"best": last.fitness.max(), "champion": self.champion.fitness, "mean": last.fitness.mean()}
        fitness = {side.name: last.fitness_of(number) for number, side in enumerate(self.task.sides)}
        best = {f"best {name}": each.max() for name, each in fitness.items()}
        return best | {f"mean {name}": each.mean() for name, each in fitness.items()}

    @property
    def driven_s(self) -> float:
        """Total time for which the robots of the last generation drove [s]."""
        return self.generations[-1].evaluations * self.task.driven_s

    @property
    def champions(self) -> tuple[Champion, ...]:
        """The champion of each side.

        Of one side: the winner of the finals; before these, the best rival; before the first trial, the best candidate.
        Of two sides: the best of the tournament; before it, those of the last generation.
        """
        if self.task.against:
            best = (None, None) if self.tournament is None else self.tournament.best
            return tuple(self.champion_of(side, generation) for side, generation in enumerate(best))
        if self.finals is not None:
            winner = self.finals.winner
            return (self._champion(0, self.finals.finalists[winner], self.finals.means(winner)),)
        return (self.champion_of() if self._best is None else self._best,)

    @property
    def champion(self) -> Champion:
        """The champion of the first side, see `champions`."""
        return self.champions[0]

    def champion_of(self, side: int | str = 0, generation: int | None = None) -> Champion:
        """Return the champion of a side in a generation: the candidate that the algorithm considers best.

        Its fitness and its measures are those of the best candidate of its generation.

        Args:
            side: Number or name of the side.
            generation: Number of the generation, from 1; the last one if left out.
        """
        names = [each.name for each in self.task.sides]
        if not isinstance(side, int | str) or side not in (*range(len(names)), *names):
            hint = nearest(side, names)
            raise ParameterError(f"side must be 0, 1 or one of {', '.join(names)}, but it was {shown(side)}.{hint}")
        if not self.generations:
            raise ParameterError("tell() must be called for a generation before there is a champion, but it was not.")
        count = len(self.generations)
        index = names.index(side) if isinstance(side, str) else side
        number = check_count("generation", count if generation is None else generation, 1, count) - 1
        held = self.generations[number]
        best = int(held.fitness_of(index).argmax())
        values = np.split(held.values, len(names), axis=1)[index][best]
        contender = self._populations[index].favourites[number]
        if not self.task.against:
            contender = Contender(tuple(held.candidates[best].tolist()), number + 1)
        return self._champion(index, contender, values)

    @property
    def front(self) -> tuple[Champion, ...]:
        """The Pareto front of the last generation of one side, by the first objective, the best first.

        They are the non-dominated candidates: no other one is better in an objective and as good in all others.
        All have driven in the same worlds. Each is there as a champion, so that it can be saved and driven.
        """
        if len(self.task.objectives) < 2 or self.task.against or not self.generations:
            raise ParameterError(
                "a front must have a task of one side with at least two objectives, and a generation with measures, "
                f"but the task has {len(self.task.sides)} and {len(self.task.objectives)}, and there are "
                f"{counted(len(self.generations), 'generation')}."
            )
        last, number = self.generations[-1], len(self.generations)
        if last.values.shape[1] < len(self._names):
            raise ParameterError(
                "tell() must be given fitness and measures for a front, but it was given fitness alone."
            )
        objectives = self._populations[0].objectives(last.values[: self.population])
        found = [
            self._champion(0, Contender(tuple(last.candidates[k].tolist()), number), last.values[k])
            for k in first_front(objectives).tolist()
        ]
        return tuple(found)

    def _champion(self, side: int, contender: Contender, values: Floats) -> Champion:
        task, own = self.task, self.task.sides[side]
        named = dict(zip(self._names, values.tolist(), strict=False))
        return Champion(
            controller=own.controller,
            parameters=contender.parameters,
            task=task.name,
            fitness=named.pop("fitness"),
            measures=named,
            generation=contender.generation,
            algorithm=self.name,
            seed=self.seed,
            robot=own.robot[0] if isinstance(own.robot, tuple) else own.robot,
            timing=task.timings[0],
            world=self._world,
        )

    # ---- folders ----

    def _resume(self, folder: EvolutionFolder) -> None:
        """Take the generations of the folder."""
        task = self.task
        controllers = " and ".join(side.controller.name for side in task.sides)
        algorithm = f"{self.name}, {self.opponents} opponents" if task.against else self.name
        digest = task.digest() | fingerprints({"algorithm": type(self.algorithms[0])})
        identity = Identity(
            *(task.name, algorithm, self.seed, self.population, controllers, digest, __version__, task.file),
            sides={side.name: side.parameter_count for side in task.sides},
            measures=task.measure_names,
            axes=task.axes,
        )
        folder.check_identity(identity)
        for number in range(folder.generation_count()):
            saved = folder.generation(number, identity)
            if not np.array_equal(self._rows(), saved["candidates"]):
                raise ParameterError(
                    f"the evolution in {str(folder.path)!r} must continue to the bit, but generation {number + 1} "
                    "would have other candidates here: the libraries or the computer have changed. Continue on the "
                    "computer where it began, or take a new folder."
                )
            self._tell(saved["values"], float(saved["seconds"]))
        self._earlier_s = self.generations[-1].seconds if self.generations else 0.0
        if len(finalists := self._finalists()) > 1:
            sizes, worlds = halving_rounds(len(finalists), self._evaluation_count)
            count = sum(size * each for size, each in zip(sizes, worlds, strict=True))
            self.finals = folder.saved_finals(len(self.generations) - 1, finalists, count, len(task.value_names))


def first_front(objectives: Floats) -> Integers:
    """Return the non-dominated candidates, int64 [candidate], by the first objective, the best first; each place once.

    Args:
        objectives: More is better, float64 [candidate, objective].

    Example:
        >>> first_front(np.array([[1.0, 3.0], [2.0, 2.0], [1.0, 2.0], [3.0, 1.0], [2.0, 2.0]])).tolist()
        [3, 1, 0]
    """
    points, first = np.unique(objectives, axis=0, return_index=True)
    is_as_good = (points[:, None] >= points).all(axis=2)
    is_dominated = is_as_good.sum(axis=0) > 1  # each is as good as itself
    front: Integers = first[~is_dominated][::-1]
    return front


def is_algorithm(algorithm: object) -> TypeGuard[Algorithm]:
    """Return whether an object is an algorithm of a user's own."""
    return all(callable(getattr(algorithm, name, None)) for name in ("ask", "tell")) and not isinstance(algorithm, type)
