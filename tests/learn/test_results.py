"""Results of several evolutions: files, curves, statistics, comparisons."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.learn.small import refused, small

import kiks
from kiks import ParameterError
from kiks.learn import results
from kiks.learn.evolution_log import EvolutionFolder, Identity
from kiks.learn.plots import figure_of_results, save_plot
from kiks.learn.statistics import compare, compare_solved

RESULTS = [
    results.Result(
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
        baselines=results.Baselines(0.0, 0.01),
        finals=12,
        exam=results.ExamScore(17 + seed, 20, 160, 200, "Exam"),
        solved=24 if seed else None,
    )
    for seed in range(4)
]


def put(result: results.Result, folder: Path, generations: int = 3) -> None:
    """Write a folder that looks like that of a finished evolution."""
    names = (result.task, result.algorithm, result.seed, result.population, result.controller)
    EvolutionFolder(folder).check_identity(
        Identity(*names, result.task_digest, result.kiks, "", {"": 18}, ("contacts",), ())
    )
    for number in range(1, generations + 1):
        (folder / f"generations/{number:06}.npz").touch()
    result.save(folder)


def test_curves_go_as_far_as_all_evolutions_and_medians_and_solved_exams_are_of_all() -> None:
    longer = replace(RESULTS[2], evaluations=(10, 30, 50), champion_fitness=(1.0, 2.0, 3.0))
    evaluations, fitness = results.curves([RESULTS[2], longer])
    assert evaluations.tolist() == [10, 24, 30, 40]
    assert fitness.tolist() == [[0.0, 0.1, 0.1, 0.2], [1.0, 1.0, 2.0, 2.0]]
    assert results.quartiles(RESULTS) == pytest.approx((0.075, 0.15, 0.225))
    assert results.passed_count(RESULTS) == 3
    assert results.passed_count([replace(RESULTS[0], exam=None), RESULTS[1]]) is None


def test_results_come_back_from_their_files(tmp_path: Path) -> None:
    for result in reversed(RESULTS):
        put(result, results.seed_folder(tmp_path, result.seed))
    assert results.load_results(tmp_path) == RESULTS
    assert results.load_results(results.seed_folder(tmp_path, 3)) == RESULTS[3:]
    results.save_summary(RESULTS, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["exams_passed"], summary["median_fitness"]) == (3, pytest.approx(0.15))
    assert [each["evaluations"] for each in summary["evolutions"]] == [52] * 4
    assert summary["exams_passed_interval"] == pytest.approx((0.301, 0.954), abs=1e-3)


def test_folders_without_finished_evolutions_are_errors(tmp_path: Path) -> None:
    refused("must be a folder of `kiks evolve`, but it holds no evolution", results.load_results, tmp_path)
    refused("must be a folder of `kiks evolve`", results.load_results, tmp_path / "nowhere")
    put(RESULTS[0], tmp_path / "seed-0")
    assert results.evolutions_in(tmp_path) == [tmp_path / "seed-0"]
    put(RESULTS[1], tmp_path / "seed-1", generations=4)
    refused(r"seed-1' must be finished, but it is not", results.load_results, tmp_path)
    (tmp_path / "seed-1" / results.RESULT).unlink()
    refused(r"seed-1' must be finished, but it is not", results.load_results, tmp_path)


def test_broken_results_are_errors(tmp_path: Path) -> None:
    put(RESULTS[0], tmp_path)
    text = json.loads((tmp_path / results.RESULT).read_text())
    for change in (
        *({"result": 2}, {"fitness": "high"}, {"fitness": float("nan")}, {"more": 1}),
        *({"evaluations": []}, {"evaluations": [1, 2]}, {"exam": {"solved": 1}}),
    ):
        (tmp_path / results.RESULT).write_text(json.dumps(text | change))
        refused(r"^The result of an evolution '.*result.json'", results.load_results, tmp_path)


def test_what_cannot_be_compared_is_an_error(tmp_path: Path) -> None:
    digest = RESULTS[0].task_digest
    for change, message in (
        ({"task": "follow"}, "the same task, but they have 'avoid' and 'follow'"),
        ({"kiks": "4"}, "the same kiks, but they have '3' and '4'"),
        ({"task_digest": digest | {"fitness": "4567"}}, "the same task, but these differ: fitness"),
    ):
        with pytest.raises(ParameterError, match=f"evolutions that are compared must have {message}"):
            results.comparable({"a": RESULTS, "b": RESULTS, "c": [replace(RESULTS[0], **change)]})
    other = replace(RESULTS[0], algorithm="ga", population=9, task_digest=digest | {"controller": "0"})
    assert results.comparable({"a": RESULTS, "b": [other]}) == {"a": RESULTS, "b": [other]}
    put(RESULTS[0], results.seed_folder(tmp_path, 0))
    put(replace(RESULTS[1], algorithm="ga"), results.seed_folder(tmp_path, 1))
    refused("must have the same algorithm, but they have 'cma' and 'ga'", results.load_results, tmp_path)


def test_exams_that_differ_are_left_out() -> None:
    other = replace(RESULTS[0], task_digest=RESULTS[0].task_digest | {"exam": "89"})
    for group in results.comparable({"a": RESULTS, "b": RESULTS, "c": [other]}).values():
        assert [(each.exam, each.solved) for each in group] == [(None, None)] * len(group)
        assert results.solved_of(group) is None
    # Those that did not solve the task count until their end.
    assert results.solved_of(RESULTS) == ((52, 24, 24, 24), (False, True, True, True))


def test_of_two_sides_each_has_its_results() -> None:
    second = results.SideScore("prey", 0.7, 3, (0.5, 0.6, 0.7))
    groups = {"a": [replace(RESULTS[1], exam=None, side="predator", against=second)]}
    named = results.of_sides(groups)
    assert named["predator"] == groups
    (prey,) = named["prey"]["a"]
    assert (prey.fitness, prey.generation, prey.champion_fitness) == (0.7, 3, (0.5, 0.6, 0.7))
    assert results.of_sides({"a": RESULTS}) == {"": {"a": RESULTS}}


def test_evolutions_of_one_folder_have_the_same_controller_and_exam(tmp_path: Path) -> None:
    for name in ("controller", "exam"):
        put(RESULTS[0], results.seed_folder(tmp_path / name, 0))
        other = replace(RESULTS[1], task_digest=RESULTS[1].task_digest | {name: "0"})
        put(other, results.seed_folder(tmp_path / name, 1))
        refused(f"must have the same task, but these differ: {name}", results.load_results, tmp_path / name)


GROUPS = {f"runs/{name}": RESULTS for name in "abcde"}


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 3, 5])
def test_figures_of_groups_say_their_methods_beside_the_axes(count: int) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.text import Text

    groups = dict(list(GROUPS.items())[:count])
    tested = {}
    if count > 1:
        tested["fitness"] = compare({name: [each.fitness for each in group] for name, group in groups.items()})
        tested["solved"] = compare_solved({name: results.solved_of(group) for name, group in groups.items()})  # type: ignore[misc]
    figure = figure_of_results(groups, tested)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    caption = figure.get_supxlabel().replace("\n", " ")
    assert ("Kruskal-Wallis (chi-squared approximation): p = 1." in caption) == (count > 1)
    assert ("corrected by Holm's method" in caption) == (count > 1)
    assert ("a - b p = 1, A = 0.50" in caption) == (count == 3)
    assert ("10 pairs, p = 1 to p = 1" in caption) == (count == 5)
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [f"{name} (4 runs)" for name in "abcde"[:count]]
    # Nothing is drawn over the data, and the caption and the legend are inside the figure and apart from the axes.
    renderer = canvas.get_renderer()
    boxes = [legend.get_window_extent(renderer), figure._supxlabel.get_window_extent(renderer)]
    boxes += [axes.get_legend().get_window_extent(renderer) for axes in figure.axes if axes.get_legend()]
    for box in boxes:
        assert (figure.bbox.min <= box.min).all()
        assert (box.max <= figure.bbox.max).all()
        assert not any(box.overlaps(axes.bbox) for axes in figure.axes)
    sizes = [text.get_fontsize() for text in figure.findobj(Text) if text.get_text()]
    assert (min(sizes), max(sizes)) == (7.0, 8.0)
    assert figure.get_figwidth() == pytest.approx(170 / 25.4)


@pytest.mark.slow
def test_pictures_are_of_the_kind_that_their_name_says(tmp_path: Path) -> None:
    without = [replace(each, exam=None, task="$^$") for each in RESULTS]
    for ending, begin in (("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")):
        save_plot(figure_of_results({"$_$": without, "b": without[:1]}), tmp_path / f"picture.{ending}")
        assert (tmp_path / f"picture.{ending}").read_bytes().startswith(begin)
    refused(
        r"must end in \.png, \.svg or \.pdf", save_plot, figure_of_results({"a": without}), tmp_path / "picture.bmp"
    )


@pytest.mark.slow
def test_the_result_of_an_evolution(tmp_path: Path) -> None:
    short = kiks.Evolution(small(exam=None), "ga", population=8)
    refused("before there is a champion", results.examined, short)
    short.run(generations=1)
    result = results.examined(short)
    assert (result.evaluations, result.fitness, result.exam) == ((8,), short.champion.fitness, None)
    evolution = kiks.Evolution(small(), "ga", population=8, folder=tmp_path)
    evolution.run(generations=3)
    assert results.load_result(tmp_path) is None
    result = results.examined(evolution)
    result.save(tmp_path)
    assert results.load_results(tmp_path) == [result]
    assert (result.generations, result.evaluations, result.finals) == (3, (24, 40), len(evolution.finals.values))
    assert result.evaluation_count == 40 + result.finals
    assert result.seconds == evolution.finals.seconds > evolution.generations[-1].seconds
    assert result.fitness == evolution.champion.fitness
    assert result.champion_fitness == tuple(each.champion_fitness for each in evolution.generations[1:])
    assert result.solved is None  # no robot gets around in a second
    assert (result.exam.starts, result.exam.imperfect_starts) == (20, 200)
    evolution.run(generations=4)
    assert results.load_result(tmp_path) is None


@pytest.mark.slow
def test_baselines_follow_from_task_and_seed_alone_in_the_worlds_of_the_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    evolution = kiks.Evolution(small(), "ga", seed=3, population=8)
    evolution.tell(np.zeros(len(evolution.ask())))
    trials = evolution.seeds[8:]
    seen: list[Any] = []
    evaluate = kiks.Task.evaluate
    monkeypatch.setattr(kiks.Task, "evaluate", lambda *given: seen.append(given[2]) or evaluate(*given))
    one = results.measured_baselines(small(), 3)
    assert seen[0].tolist() == trials.tolist()
    assert set(seen[1].tolist()) == set(trials.tolist())
    assert len(seen[1]) == results.RANDOM_COUNT
    assert one == results.measured_baselines(small(), 3)
    assert one != results.measured_baselines(small(), 4)


def test_a_robot_that_stands_still_does_not_move() -> None:
    found = results.measured_baselines(small(fitness=lambda values: -values["path_mm"].mean(axis=1)), 1)
    assert found.standing == 0.0
    assert found.random < -1.0
