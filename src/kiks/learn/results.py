"""Results of finished evolutions, one for each seed, and what two groups of them say about each other.

Sources: Mann and Whitney (1947) for U; Vargha and Delaney (2000), section 5, for the effect size A and its names.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.control.controller import Controller
from kiks.errors import ParameterError
from kiks.learn import seeds
from kiks.learn.evolution import Evolution
from kiks.learn.evolution_log import IDENTITY, TRIALS, Digest, Folder, check_alike
from kiks.learn.exam import PASS_SHARE, imperfect_robots
from kiks.learn.fingerprint import tell_unseen
from kiks.learn.seeds import seed_for
from kiks.learn.task import Task
from kiks.model.atomic_files import path_of, replace_file
from kiks.model.data_file import TEXT_MAX, Number, Text, Whole, check, parse_json, read_file, record
from kiks.model.limits import RESULT_FILE_BYTES_MAX
from kiks.version import __version__

Floats = NDArray[np.float64]

RESULT, SUMMARY = "result.json", "summary.json"
"""Names in the folder of an evolution, and in that of several."""

EFFECTS = ((0.06, "negligible"), (0.14, "small"), (0.21, "medium"), (0.5, "large"))
"""Names of effect sizes: largest |A - 0.5|, and the name."""

RANDOM_COUNT = 40
"""Number of random controllers: as many as the first generation has by default."""

_FREE = {"controller", "spread", "exam"}
"""Arguments of a task that may differ when the fitness of two evolutions is compared."""

_Count = Annotated[Whole, Field(ge=0, lt=2**63)]
_GENERATIONS_MAX = 1_000_000


@record
class Baselines:
    """Fitness in the trial worlds of an evolution.

    Attributes:
        standing: Mean fitness of standing still in all trials.
        random: Median fitness of random controllers, each in one of the trials in turn.
    """

    standing: Number
    random: Number


@record
class ExamScore:
    """How many starts of an exam a champion solved, with its own robot and with imperfect ones."""

    solved: _Count
    starts: Annotated[Whole, Field(ge=1, lt=2**63)]
    imperfect_solved: _Count
    imperfect_starts: Annotated[Whole, Field(ge=1, lt=2**63)]
    text: Text

    @property
    def is_passed(self) -> bool:
        """Whether enough starts were solved."""
        return self.solved >= PASS_SHARE * self.starts

    @property
    def share(self) -> float:
        """Share of the starts that were solved."""
        return self.solved / self.starts


@record
class Result:
    """The result of a finished evolution, a file in its folder.

    Attributes:
        result: Version of the format.
        task: Name of the task.
        task_digest: The task's digest.
        algorithm: The algorithm.
        controller: Name of the controller.
        population: Number of candidates in a generation.
        seed: The seed.
        kiks: Version of KiKS.
        fitness: Fitness of the champion; of two sides that of the first, its mean in the tournament.
        generation: The generation that found it.
        seconds: Time of the evolution with its finals [s of the wall clock].
        generations: Number of generations.
        evaluations: Number of evaluations until the end of each generation that has a champion, and of the finals, if
            there were any [step]. The first generation has none, because no rival was tried, unless it is the only one.
        champion_fitness: Fitness of the champion then [step].
        baselines: Its baselines; None of two sides, whose fitness is relative.
        exam: The exam; None if the task has none.
    """

    result: Literal[1]
    task: Text
    task_digest: Digest
    algorithm: Text
    controller: Text
    population: _Count
    seed: _Count
    kiks: Text
    fitness: Number
    generation: _Count
    seconds: Annotated[Number, Field(ge=0)]
    generations: _Count
    evaluations: Annotated[tuple[_Count, ...], Field(min_length=1, max_length=_GENERATIONS_MAX)]
    champion_fitness: Annotated[tuple[Number, ...], Field(min_length=1, max_length=_GENERATIONS_MAX)]
    baselines: Baselines | None = None
    exam: ExamScore | None = None

    def __post_init__(self) -> None:
        if len(self.evaluations) != len(self.champion_fitness):
            raise ParameterError(
                f"evaluations and champion_fitness must have equal lengths, but they had {len(self.evaluations)} and "
                f"{len(self.champion_fitness)}."
            )

    def save(self, folder: Path) -> None:
        """Write it into the folder of the evolution."""
        replace_file(folder / RESULT, json.dumps(asdict(self)) + "\n", "the result")


def result_of(evolution: Evolution) -> Result:
    """Return the result of an evolution: this examines its champion and measures baselines."""
    task, champion = evolution.task, evolution.champion
    score = None
    if task.exam is not None:
        own = task.exam.examine(champion, robots=task.robots)
        imperfect = task.exam.examine(champion, robots=task.robots, kinds=imperfect_robots(champion)).solved
        score = ExamScore(
            solved=int(own.solved.sum()),
            starts=len(own.solved),
            imperfect_solved=int(imperfect.sum()),
            imperfect_starts=len(imperfect),
            text=str(own)[:TEXT_MAX],
        )
    generations, finals, tournament = evolution.generations, evolution.finals, evolution.tournament
    evaluations, fitness = np.cumsum([each.evaluations for each in generations]), [champion.fitness]
    if tournament is not None:
        evaluations, fitness = evaluations[tournament.generations - 1], tournament.means[0].tolist()
    elif len(generations) > 1:
        evaluations, fitness = evaluations[1:], [each.champion_fitness for each in generations[1:]]
    if finals is not None:
        evaluations = np.append(evaluations, evaluations[-1] + len(finals.values))
        fitness.append(champion.fitness)
    return Result(
        result=1,
        task=task.name,
        task_digest=task.digest(),
        algorithm=evolution.name,
        controller=" and ".join(side.controller.name for side in task.sides),
        population=evolution.population,
        seed=evolution.seed,
        kiks=__version__,
        fitness=champion.fitness if tournament is None else tournament.means[0].max(),
        generation=champion.generation,
        seconds=(finals or generations[-1]).seconds,
        generations=len(generations),
        evaluations=tuple(evaluations.tolist()),
        champion_fitness=tuple(fitness),
        baselines=None if task.against else baselines_of(task, evolution.seed),
        exam=score,
    )


def baselines_of(task: Task, seed: int) -> Baselines:
    """Return the baselines of the evolution of a task with a seed."""
    trials = np.array([seed_for(seed, seeds.TRIALS, number) for number in range(TRIALS)])
    still = Controller(_stand, senses=task.controller.senses, parameters=1)
    standing = task.with_changes(controller=still).evaluate(np.zeros((TRIALS, 1)), trials)
    rng = np.random.default_rng(seed_for(seed, seeds.BASELINES))
    drawn = task.spread * rng.standard_normal((RANDOM_COUNT, task.parameter_count))
    random = task.evaluate(drawn, np.resize(trials, RANDOM_COUNT))
    return Baselines(float(standing[:, 0].mean()), float(np.median(random[:, 0])))


def _stand(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[0] = wheels[1] = 0.0


# ---- folders ----


def load_result(folder: Path) -> Result | None:
    """Return the result of the evolution in a folder; None if it is not finished."""
    file = folder / RESULT
    if not file.exists():
        return None
    what = f"The result of an evolution {str(file)!r}"
    data = read_file(file, what, bytes_max=RESULT_FILE_BYTES_MAX)
    found = check(Result, parse_json(data, what), what, advice="Remove the file, and evolve again.")
    return found if found.generations == Folder(folder).generation_count() else None


def seed_folder(folder: Path, seed: int) -> Path:
    """Return the folder of the evolution with a seed, one of several."""
    return folder / f"seed-{seed}"


def load_results(folder: str | Path) -> list[Result]:
    """Return the results of the evolutions in a folder of `kiks evolve --seeds`, by seed, or of the one in a folder."""
    path = path_of(folder, "folder")
    homes = [path] if (path / IDENTITY).exists() else [each.parent for each in path.glob(f"seed-*/{IDENTITY}")]
    if not homes:
        raise ParameterError(
            f"{str(path)!r} must be a folder of `kiks evolve`, but it holds no evolution. Name one with {IDENTITY}, or "
            "one of kiks evolve --seeds."
        )
    results = []
    for home in homes:
        result = load_result(home)
        if result is None:
            raise ParameterError(
                f"the evolution in {str(home)!r} must be finished, but it is not. The command that began it goes on."
            )
        results.append(result)
    results.sort(key=lambda each: each.seed)
    names = ("task", "kiks", "algorithm", "controller", "population")
    for each in results:
        check_alike(results[0], each, names, f"the evolutions in {str(path)!r}", "Name a folder for each kind.")
    return results


def comparable(first: Sequence[Result], second: Sequence[Result]) -> list[list[Result]]:
    """Return two groups of the same task, with the same KiKS; without their exams if these differ."""
    one, other = first[0], second[0]
    check_alike(one, other, ("task", "kiks"), "evolutions that are compared", "Compare two of one task.", _FREE)
    tell_unseen(one.task_digest, "Fitness is compared")
    is_alike = one.task_digest.get("exam") == other.task_digest.get("exam")
    if not is_alike:
        logging.getLogger("kiks.learn").warning("The exams differ, so they are left out.")
    return [[each if is_alike else replace(each, exam=None) for each in group] for group in (first, second)]


def save_summary(results: Sequence[Result], folder: Path) -> None:
    """Write the summary of several evolutions."""
    replace_file(folder / SUMMARY, json.dumps(summary_of(results), indent=1) + "\n", "the summary")


def summary_of(results: Sequence[Result]) -> dict[str, Any]:
    """Return the results of several evolutions without their curves, and what they have in common."""
    low, median, high = quartiles(results)
    summary: dict[str, Any] = {"median_fitness": median, "quartiles_fitness": [low, high]}
    if (passed := passed_count(results)) is not None:
        summary["exams_passed"] = passed
    summary["evolutions"] = [
        {name: value for name, value in asdict(each).items() if name not in ("evaluations", "champion_fitness")}
        | {"evaluations": each.evaluations[-1]}
        for each in results
    ]
    return summary


# ---- statistics ----


def quartiles(results: Sequence[Result]) -> tuple[float, float, float]:
    """Return lower quartile, median and upper quartile of the champions' fitness."""
    low, median, high = np.percentile([each.fitness for each in results], (25, 50, 75)).tolist()
    return low, median, high


def passed_count(results: Sequence[Result]) -> int | None:
    """Return the number of champions that passed the exam; None if there was none."""
    exams = [each.exam for each in results]
    return None if None in exams else sum(each.is_passed for each in exams if each is not None)


@dataclass(frozen=True)
class Difference:
    """What the Mann-Whitney test says about two samples.

    Attributes:
        u: U of the first sample.
        p: Two-sided p.
        a: Vargha and Delaney's A: the probability that one of the first sample exceeds one of the second, ties half.
    """

    u: float
    p: float
    a: float

    @property
    def effect(self) -> str:
        """The name of the effect size."""
        return next(name for least, name in EFFECTS if abs(self.a - 0.5) < least or least == EFFECTS[-1][0])


def difference(first: Sequence[float], second: Sequence[float]) -> Difference:
    """Return what the Mann-Whitney test says about two samples.

    Example:
        >>> found = difference([3.0, 4.0, 5.0], [1.0, 2.0, 3.0])
        >>> found.u, round(found.a, 2), found.effect
        (8.5, 0.94, 'large')
    """
    from scipy.stats import mannwhitneyu

    if len({*first, *second}) == 1:
        return Difference(len(first) * len(second) / 2, 1.0, 0.5)
    found = mannwhitneyu(first, second, alternative="two-sided")
    return Difference(float(found.statistic), float(found.pvalue), float(found.statistic) / (len(first) * len(second)))


def curves(results: Sequence[Result]) -> tuple[Floats, Floats]:
    """Return the champions' fitness over evaluations, as far as all evolutions go.

    Returns:
        Numbers of evaluations [step], and fitness [evolution, step].
    """
    end = min(each.evaluations[-1] for each in results)
    steps = np.unique([number for each in results for number in each.evaluations if number <= end])
    # At first an evolution has no champion.
    steps = steps[steps >= max(each.evaluations[0] for each in results)]
    rows = [
        np.array(each.champion_fitness)[np.searchsorted(each.evaluations, steps, side="right") - 1] for each in results
    ]
    return steps.astype(np.float64), np.array(rows)
