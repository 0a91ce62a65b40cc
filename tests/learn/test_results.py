"""Results of several evolutions: files, curves, statistics, comparisons."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.learn.small import small

import kiks
from kiks import ParameterError
from kiks.learn.evolution_log import Folder, Identity
from kiks.learn.plots import save_results_plot
from kiks.learn.results import (
    RANDOM_COUNT,
    RESULT,
    Baselines,
    ExamScore,
    Result,
    baselines_of,
    comparable,
    curves,
    difference,
    load_result,
    load_results,
    passed_count,
    quartiles,
    result_of,
    save_summary,
    seed_folder,
)

RESULTS = [
    Result(
        result=1,
        task="avoid",
        task_digest={"fitness": "0123", "controller": "45", "exam": "67"},
        algorithm="cma",
        controller="linear",
        population=8,
        seed=seed,
        kiks="3",
        fitness=0.1 * seed,
        generation=2,
        seconds=3.0 + seed,
        generations=3,
        evaluations=(8, 24, 40),
        champion_fitness=(0.0, 0.05 * seed, 0.1 * seed),
        baselines=Baselines(0.0, 0.01),
        exam=ExamScore(17 + seed, 20, 160, 200, "Exam"),
    )
    for seed in range(4)
]


def put(result: Result, folder: Path, generations: int = 3) -> None:
    """Write a folder that looks like that of a finished evolution."""
    names = (result.task, result.algorithm, result.seed, result.population, result.controller)
    Folder(folder).check_identity(Identity(*names, result.task_digest, result.kiks, "", {"": 18}, ("contacts",), ()))
    for number in range(1, generations + 1):
        (folder / f"generations/{number:06}.npz").touch()
    result.save(folder)


# ---- statistics ----


def test_the_difference_agrees_with_counting_pairs() -> None:
    rng = np.random.default_rng(1)
    for sizes in ((1, 1), (3, 5), (10, 10)):
        first, second = (rng.integers(0, 6, size).astype(float).tolist() for size in sizes)
        found = difference(first, second)
        wins = sum((one > two) + (one == two) / 2 for one in first for two in second)
        assert (found.u, found.a) == (wins, wins / (len(first) * len(second)))
        other = difference(second, first)
        assert other.a == pytest.approx(1 - found.a)
        assert other.p == pytest.approx(found.p)


@pytest.mark.parametrize(
    ("first", "second", "a", "effect"),
    [
        ([1.0] * 5, [1.0] * 5, 0.5, "negligible"),
        ([2.0] * 5, [1.0] * 5, 1.0, "large"),
        ([0.0] * 5, [1.0] * 5, 0.0, "large"),
        ([1.0, 2.0, 2.0, 2.0, 3.0], [1.0, 2.0, 2.0, 2.0, 2.0], 0.58, "small"),
    ],
)
def test_effects_have_names(first: list[float], second: list[float], a: float, effect: str) -> None:
    found = difference(first, second)
    assert found.a == pytest.approx(a)
    assert found.effect == effect


def test_curves_go_as_far_as_all_evolutions() -> None:
    longer = replace(RESULTS[2], evaluations=(10, 30, 50), champion_fitness=(1.0, 2.0, 3.0))
    evaluations, fitness = curves([RESULTS[2], longer])
    assert evaluations.tolist() == [10, 24, 30, 40]
    assert fitness.tolist() == [[0.0, 0.1, 0.1, 0.2], [1.0, 1.0, 2.0, 2.0]]


def test_medians_and_solved_exams() -> None:
    assert quartiles(RESULTS) == pytest.approx((0.075, 0.15, 0.225))
    assert passed_count(RESULTS) == 3
    assert passed_count([replace(RESULTS[0], exam=None), RESULTS[1]]) is None


# ---- files ----


def test_results_come_back_from_their_files(tmp_path: Path) -> None:
    for result in reversed(RESULTS):
        put(result, seed_folder(tmp_path, result.seed))
    assert load_results(tmp_path) == RESULTS
    assert load_results(seed_folder(tmp_path, 3)) == RESULTS[3:]
    save_summary(RESULTS, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["exams_passed"] == 3
    assert summary["median_fitness"] == pytest.approx(0.15)
    assert [each["evaluations"] for each in summary["evolutions"]] == [40] * 4


def test_folders_without_finished_evolutions_are_errors(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="must be a folder of `kiks evolve`, but it holds no evolution"):
        load_results(tmp_path)
    with pytest.raises(ParameterError, match="must be a folder of `kiks evolve`"):
        load_results(tmp_path / "nowhere")
    put(RESULTS[0], tmp_path / "seed-0")
    put(RESULTS[1], tmp_path / "seed-1", generations=4)
    with pytest.raises(ParameterError, match=r"seed-1' must be finished, but it is not"):
        load_results(tmp_path)
    (tmp_path / "seed-1" / RESULT).unlink()
    with pytest.raises(ParameterError, match=r"seed-1' must be finished, but it is not"):
        load_results(tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        {"result": 2},
        {"fitness": "high"},
        {"fitness": float("nan")},
        {"evaluations": []},
        {"evaluations": [1, 2]},
        {"exam": {"solved": 1}},
        {"more": 1},
    ],
)
def test_broken_results_are_errors(change: dict[str, Any], tmp_path: Path) -> None:
    put(RESULTS[0], tmp_path)
    text = json.loads((tmp_path / RESULT).read_text())
    (tmp_path / RESULT).write_text(json.dumps(text | change))
    with pytest.raises(ParameterError, match=r"^The result of an evolution '.*result.json'"):
        load_results(tmp_path)


def test_what_cannot_be_compared_is_an_error(tmp_path: Path) -> None:
    digest = RESULTS[0].task_digest
    for change, message in (
        ({"task": "follow"}, "the same task, but they have 'avoid' and 'follow'"),
        ({"kiks": "4"}, "the same kiks, but they have '3' and '4'"),
        ({"task_digest": digest | {"fitness": "4567"}}, "the same task, but these differ: fitness"),
    ):
        with pytest.raises(ParameterError, match=f"evolutions that are compared must have {message}"):
            comparable(RESULTS, [replace(RESULTS[0], **change)])
    other = replace(RESULTS[0], algorithm="ga", population=9, task_digest=digest | {"controller": "0"})
    assert comparable(RESULTS, [other]) == [RESULTS, [other]]
    put(RESULTS[0], seed_folder(tmp_path, 0))
    put(replace(RESULTS[1], algorithm="ga"), seed_folder(tmp_path, 1))
    with pytest.raises(ParameterError, match="must have the same algorithm, but they have 'cma' and 'ga'"):
        load_results(tmp_path)


def test_exams_that_differ_are_left_out() -> None:
    other = replace(RESULTS[0], task_digest=RESULTS[0].task_digest | {"exam": "89"})
    for group in comparable(RESULTS, [other]):
        assert [each.exam for each in group] == [None] * len(group)


def test_evolutions_of_one_folder_have_the_same_controller_and_exam(tmp_path: Path) -> None:
    for name in ("controller", "exam"):
        put(RESULTS[0], seed_folder(tmp_path / name, 0))
        put(replace(RESULTS[1], task_digest=RESULTS[1].task_digest | {name: "0"}), seed_folder(tmp_path / name, 1))
        with pytest.raises(ParameterError, match=f"must have the same task, but these differ: {name}"):
            load_results(tmp_path / name)


@pytest.mark.slow
def test_pictures_are_png_files(tmp_path: Path) -> None:
    without = [replace(each, exam=None) for each in RESULTS]
    for number, groups in enumerate(({"a": RESULTS}, {"a": RESULTS, "b": RESULTS[:1]}, {"a": without})):
        save_results_plot(groups, tmp_path / f"{number}.png")
        assert (tmp_path / f"{number}.png").read_bytes().startswith(b"\x89PNG")
    save_results_plot({"$_$": [replace(each, task="$^$") for each in RESULTS]}, tmp_path / "dollars.png")


@pytest.mark.slow
def test_the_result_of_an_evolution(tmp_path: Path) -> None:
    evolution = kiks.Evolution(kiks.tasks.avoid(seconds=1.0, worlds=3), "ga", population=8, folder=tmp_path)
    with pytest.raises(ParameterError, match="before there is a champion"):
        result_of(evolution)
    evolution.run(generations=1)
    assert (result_of(evolution).evaluations, result_of(evolution).fitness) == ((8,), evolution.champion.fitness)
    evolution.run(generations=3)
    assert load_result(tmp_path) is None
    result = result_of(evolution)
    result.save(tmp_path)
    assert load_results(tmp_path) == [result]
    assert evolution.finals is not None
    assert (result.generations, result.evaluations) == (3, (24, 40, 40 + len(evolution.finals.values)))
    assert result.seconds == evolution.finals.seconds > evolution.generations[-1].seconds
    assert result.fitness == result.champion_fitness[-1] == evolution.champion.fitness
    assert result.exam is not None
    assert (result.exam.starts, result.exam.imperfect_starts) == (20, 200)
    evolution.run(generations=4)
    assert load_result(tmp_path) is None


# ---- baselines ----


def test_baselines_follow_from_task_and_seed_alone() -> None:
    one = baselines_of(small(), 3)
    assert one == baselines_of(small(), 3)
    assert one != baselines_of(small(), 4)


def test_a_robot_that_stands_still_does_not_move() -> None:
    def fitness(values):
        return -values["path_mm"].mean(axis=1)

    found = baselines_of(small().with_changes(fitness=fitness), 1)
    assert found.standing == 0.0
    assert found.random < -1.0


@pytest.mark.slow
def test_the_worlds_are_those_of_the_trials() -> None:
    evolution = kiks.Evolution(small(), "ga", seed=3, population=8)
    evolution.tell(np.zeros(len(evolution.ask())))
    trials = evolution.seeds[8:]
    seen = []

    class Task(kiks.Task):
        def evaluate(self, candidates, seeds, threads=None, seconds=None):
            seen.append(seeds)
            return super().evaluate(candidates, seeds, threads, seconds)

    task = small()
    baselines_of(Task(**{name: getattr(task, name) for name in task.__dataclass_fields__}), 3)
    assert seen[0].tolist() == trials.tolist()
    assert set(seen[1].tolist()) == set(trials.tolist())
    assert len(seen[1]) == RANDOM_COUNT
