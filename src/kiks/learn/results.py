"""Results of finished evolutions, one for each seed, and groups of them that are compared."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from kiks.control.controller import Controller
from kiks.control.senses import AnySense
from kiks.errors import ParameterError
from kiks.learn import seeds
from kiks.learn.evolution import Evolution
from kiks.learn.evolution_log import IDENTITY, TRIALS, Digest, EvolutionFolder, check_alike
from kiks.learn.exam import PASS_SHARE, Exam, imperfect_robots
from kiks.learn.seeds import seed_for
from kiks.learn.statistics import Solved, median_interval, wilson_interval
from kiks.learn.task import Task
from kiks.meant import nearest_file
from kiks.model.atomic_files import path_of, replace_file
from kiks.model.data_file import TEXT_MAX, Number, Text, Whole, check, parse_json, read_file, record
from kiks.model.limits import RESULT_FILE_BYTES_MAX
from kiks.version import __version__

Floats = NDArray[np.float64]

RESULT, SUMMARY = "result.json", "summary.json"
"""Names in the folder of an evolution, and in that of several."""

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
class SideScore:
    """What the second side of an evolution has reached, as `Result` says it of the first.

    Attributes:
        side: Name of the side.
        fitness: As that of `Result`.
        generation: As that of `Result`.
        champion_fitness: As that of `Result`.
    """

    side: Text
    fitness: Number
    generation: _Count
    champion_fitness: Annotated[tuple[Number, ...], Field(min_length=1, max_length=_GENERATIONS_MAX)]


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
        fitness: Fitness of the champion; of two sides that of the first, its mean against all champions of the other
            side of its own evolution.
        generation: The generation that found it.
        seconds: Time of the evolution with its finals [s of the wall clock].
        generations: Number of generations.
        evaluations: Number of evaluations until the end of each generation that has a champion [step]. The first
            generation has none, because no rival was tried, unless it is the only one.
        champion_fitness: Fitness of the champion then, on trial [step]; of two sides, in the tournament.
        finals: Number of evaluations of the finals.
        baselines: Its baselines; None of two sides, whose fitness is relative.
        exam: The exam; None if the task has none.
        solved: Number of evaluations after which the champion first passed the exam; None if none did.
        side: Name of the first of two sides.
        against: The second side.
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
    finals: _Count = 0
    baselines: Baselines | None = None
    exam: ExamScore | None = None
    solved: _Count | None = None
    side: Text = ""
    against: SideScore | None = None

    @property
    def evaluation_count(self) -> int:
        """Number of all evaluations, with those of the finals."""
        return self.evaluations[-1] + self.finals

    def __post_init__(self) -> None:
        if len(self.evaluations) != len(self.champion_fitness):
            raise ParameterError(
                f"evaluations and champion_fitness must have equal lengths, but they had {len(self.evaluations)} and "
                f"{len(self.champion_fitness)}."
            )

    def save(self, folder: Path) -> None:
        """Write it into the folder of the evolution."""
        replace_file(folder / RESULT, json.dumps(asdict(self)) + "\n", "the result")


def examined(evolution: Evolution) -> Result:
    """Return the result of an evolution: this examines its champions and measures baselines."""
    task, champion = evolution.task, evolution.champion
    generations, finals, tournament = evolution.generations, evolution.finals, evolution.tournament
    evaluations, fitness = np.cumsum([each.evaluations for each in generations]), [champion.fitness]
    final_count, side, against = 0 if finals is None else len(finals.values), "", None
    if tournament is not None:
        evaluations, fitness = evaluations[tournament.generations - 1], tournament.means[0].tolist()
        means, (side, other) = tournament.means[1], tournament.sides
        against = SideScore(other, float(means.max()), tournament.best[1], tuple(means.tolist()))
    elif len(generations) > 1:
        evaluations, fitness = evaluations[1:], [each.champion_fitness for each in generations[1:]]
    score = solved = None
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
        solved = _first_solved(evolution, task.exam)
        if solved is None and score.is_passed:
            solved = int(evaluations[-1]) + final_count
    return Result(
        result=1,
        task=task.name,
        task_digest=task.digest(),
        algorithm=evolution.name,
        controller=" and ".join(each.controller.name for each in task.sides),
        population=evolution.population,
        seed=evolution.seed,
        kiks=__version__,
        fitness=champion.fitness if tournament is None else tournament.means[0].max(),
        generation=champion.generation,
        seconds=(finals or generations[-1]).seconds,
        generations=len(generations),
        evaluations=tuple(evaluations.tolist()),
        champion_fitness=tuple(fitness),
        finals=final_count,
        baselines=None if task.against else measured_baselines(task, evolution.seed),
        exam=score,
        solved=solved,
        side=side,
        against=against,
    )


def _first_solved(evolution: Evolution, exam: Exam) -> int | None:
    """Return the number of evaluations after which a champion, on trial, first passed the exam; None if none did."""
    known, evaluations = -np.inf, 0
    for each in evolution.generations:
        evaluations += each.evaluations
        if each.champion_fitness > known:  # the rival on trial has become the champion
            known, rival = each.champion_fitness, each.candidates[each.population]
            champion = replace(evolution.champion, parameters=tuple(rival.tolist()))
            if exam.examine(champion, robots=evolution.task.robots).is_passed:
                return evaluations
    return None


def measured_baselines(task: Task, seed: int) -> Baselines:
    """Return the baselines of the evolution of a task with a seed."""
    trials = np.array([seed_for(seed, seeds.TRIALS, number) for number in range(TRIALS)])
    standing = task.with_changes(controller=_still(task.controller.senses)).evaluate(np.zeros((TRIALS, 1)), trials)
    rng = np.random.default_rng(seed_for(seed, seeds.BASELINES))
    drawn = task.spread * rng.standard_normal((RANDOM_COUNT, task.parameter_count))
    random = task.evaluate(drawn, np.resize(trials, RANDOM_COUNT))
    return Baselines(float(standing[:, 0].mean()), float(np.median(random[:, 0])))


@lru_cache(16)
def _still(senses: tuple[AnySense, ...]) -> Controller:
    """Return a controller that stands still, the same each time, so that it is compiled once."""
    return Controller(_stand, senses=senses, parameters=1)


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
    return found if found.generations == EvolutionFolder(folder).generation_count() else None


def seed_folder(folder: Path, seed: int) -> Path:
    """Return the folder of the evolution with a seed, one of several."""
    return folder / f"seed-{seed}"


def evolutions_in(folder: str | Path) -> list[Path]:
    """Return the folders of the evolutions in a folder of `kiks evolve --seeds`, or the folder of a single one."""
    path = path_of(folder, "folder")
    found = [path] if (path / IDENTITY).exists() else [each.parent for each in path.glob(f"seed-*/{IDENTITY}")]
    if not found:
        raise ParameterError(
            f"{str(path)!r} must be a folder of `kiks evolve`, but it holds no evolution. Name one with {IDENTITY}, or "
            f"one of kiks evolve --seeds.{nearest_file(path) if not path.exists() else ''}"
        )
    return sorted(found)


def load_results(folder: str | Path) -> list[Result]:
    """Return the results of the evolutions in a folder of `kiks evolve --seeds`, by seed, or of the one in a folder."""
    path, results = path_of(folder, "folder"), []
    for place in evolutions_in(path):
        result = load_result(place)
        if result is None:
            raise ParameterError(
                f"the evolution in {str(place)!r} must be finished, but it is not. The command that began it goes on."
            )
        results.append(result)
    results.sort(key=lambda each: each.seed)
    names = ("task", "kiks", "algorithm", "controller", "population")
    for each in results:
        check_alike(results[0], each, names, f"the evolutions in {str(path)!r}", "Name a folder for each kind.")
    return results


def comparable(groups: Mapping[str, Sequence[Result]]) -> dict[str, list[Result]]:
    """Return groups of the same task, with the same KiKS; without their exams if these differ."""
    (one, *_), *others = groups.values()
    for other, *_ in others:
        advice = "Compare evolutions of one task."
        check_alike(one, other, ("task", "kiks"), "evolutions that are compared", advice, _FREE)
    is_alike = all(other.task_digest.get("exam") == one.task_digest.get("exam") for other, *_ in others)
    if not is_alike:
        logging.getLogger("kiks.learn").warning("The exams differ, so they are left out.")
    return {
        name: [each if is_alike else replace(each, exam=None, solved=None) for each in group]
        for name, group in groups.items()
    }


def of_sides(groups: Mapping[str, Sequence[Result]]) -> dict[str, dict[str, list[Result]]]:
    """Return groups of evolutions by the names of their sides: of two, the results of each side; of one, the groups."""
    first = next(iter(groups.values()))[0]
    named = {first.side: {name: list(group) for name, group in groups.items()}}
    if first.against is not None:
        named[first.against.side] = {name: [_second(each) for each in group] for name, group in groups.items()}
    return named


def _second(result: Result) -> Result:
    score = result.against
    assert score is not None
    reached = {name: getattr(score, name) for name in ("fitness", "generation", "champion_fitness")}
    return replace(result, **reached)


def save_summary(results: Sequence[Result], folder: Path) -> None:
    """Write the summary of several evolutions."""
    replace_file(folder / SUMMARY, json.dumps(summary_of(results), indent=1) + "\n", "the summary")


def summary_of(results: Sequence[Result]) -> dict[str, Any]:
    """Return the results of several evolutions without their curves, and what they have in common."""
    low, median, high = quartiles(results)
    fitness = [each.fitness for each in results]
    summary: dict[str, Any] = {"median_fitness": median, "quartiles_fitness": [low, high]}
    summary["median_fitness_interval"] = median_interval(fitness)
    if (passed := passed_count(results)) is not None:
        summary |= {"exams_passed": passed, "exams_passed_interval": wilson_interval(passed, len(results))}
    summary["evolutions"] = evolutions = []
    for each in results:
        known = asdict(each) | {"evaluations": each.evaluation_count}
        for score in (known, known["against"] or {}):
            score.pop("champion_fitness", None)
        evolutions.append(known)
    return summary


# ---- figures of several ----


TITLES = {
    "fitness": "Fitness",
    "exam": "Share of the exam's starts solved",
    "solved": "Evaluations until the exam was first passed",
}
"""What is compared of evolutions of one side."""


def title_of(name: str) -> str:
    """Return what is compared in plain words: a key of `TITLES`, or a side of co-evolutions."""
    return TITLES.get(name, f"Fitness of the {name} against strangers")


def quartiles(results: Sequence[Result]) -> tuple[float, float, float]:
    """Return lower quartile, median and upper quartile of the champions' fitness."""
    low, median, high = np.percentile([each.fitness for each in results], (25, 50, 75)).tolist()
    return low, median, high


def passed_count(results: Sequence[Result]) -> int | None:
    """Return the number of champions that passed the exam; None if there was none."""
    exams = [each.exam for each in results]
    return None if None in exams else sum(each.is_passed for each in exams if each is not None)


def solved_of(results: Sequence[Result]) -> Solved | None:
    """Return when evolutions solved their task; None if there was no exam."""
    if any(each.exam is None for each in results):
        return None
    ends = [each.evaluation_count if each.solved is None else each.solved for each in results]
    return Solved(tuple(ends), tuple(each.solved is not None for each in results))


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
