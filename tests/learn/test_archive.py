"""Archives: the best candidate of each cell, kept in a file; algorithms that look for many behaviours."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases
from tests.learn.small import refused, small
from typer.testing import CliRunner

import kiks
from kiks import ParameterError
from kiks.cli import app
from kiks.learn.algorithm_name import AlgorithmName
from kiks.learn.algorithms import ALGORITHMS
from kiks.learn.diversity import Diverse

pytestmark = pytest.mark.slow


DIVERSE = [str(name) for name, kind in ALGORITHMS.items() if isinstance(kind, type) and issubclass(kind, Diverse)]


def run(algorithm: str, folder: Path | None = None, **changes: Any) -> kiks.Evolution:
    evolution = kiks.Evolution(small(**changes), algorithm, population=8, seed=3, folder=folder)
    evolution.run(generations=4)
    return evolution


def told(evolution: kiks.Evolution, seed: int, generations: int = 6) -> kiks.Evolution:
    """Tell an evolution random values, a few of them equal."""
    rng = np.random.default_rng(seed)
    for _ in range(generations):
        shape = len(evolution.ask()), len(evolution.task.value_names)
        values = rng.uniform(-0.2, 1.2, shape)
        values[:, :2] = values[:, :2].round(1)
        evolution.tell(values)
    return evolution


def test_each_algorithm_has_a_name_and_those_for_many_behaviours_need_axes_and_measures() -> None:
    assert list(ALGORITHMS) == list(AlgorithmName)
    for algorithm in DIVERSE:
        refused("must have axes", kiks.Evolution, small(axes=()), algorithm)
        evolution = kiks.Evolution(small(), algorithm, population=8)
        refused("must be given fitness and measures", evolution.tell, np.zeros(len(evolution.ask())))


@pytest.mark.parametrize("algorithm", cases(DIVERSE))
def test_they_find_many_behaviours_where_one_gets_better(algorithm: str) -> None:
    # The behaviour is two of the parameters; a step towards larger ones is all that fitness rewards.
    evolution = kiks.Evolution(small(axes=(kiks.Axis("path_mm", -3, 3), kiks.Axis("straightness", -3, 3))), algorithm)
    names = evolution.task.value_names
    for _ in range(40):
        candidates = evolution.ask()
        values = np.zeros((len(candidates), len(names)))
        values[:, 0] = candidates[:, 0]
        values[:, names.index("path_mm")], values[:, names.index("straightness")] = candidates[:, 0], candidates[:, 1]
        evolution.tell(values)
    assert evolution.archive.coverage > 0.3


@pytest.mark.parametrize("algorithm", cases(DIVERSE))
def test_the_champion_is_the_elite_that_does_best_on_trial(algorithm: str) -> None:
    evolution = kiks.Evolution(small(), algorithm, seed=1, population=20)
    names = evolution.task.value_names
    fitness_of: dict[bytes, float] = {}
    rng = np.random.default_rng(3)
    for _ in range(8):
        candidates = evolution.ask()
        values = rng.uniform(0, 1, (len(candidates), len(names)))
        for row, candidate in zip(values, candidates, strict=True):
            row[0] = fitness_of.setdefault(candidate.tobytes(), row[0])
        evolution.tell(values)
    tried = [each.candidates[-1] for each in evolution.generations[1:]]
    assert len({each.tobytes() for each in tried}) == len(tried)
    assert evolution.champion.fitness == pytest.approx(max(fitness_of[each.tobytes()] for each in tried))


def test_each_cell_holds_the_first_of_the_best_that_fell_into_it() -> None:
    evolution = told(kiks.Evolution(small(), "ga", seed=1, population=60), 1)
    archive, names = evolution.archive, evolution.task.value_names
    best: dict[tuple[int, ...], tuple[float, list[float]]] = {}
    for generation in evolution.generations:
        for candidate, values in zip(generation.candidates[:60], generation.values[:60], strict=True):
            cell = []
            for axis in archive.axes:
                edges = np.linspace(axis.low, axis.high, axis.cells + 1)
                cell.append(int(np.clip(np.searchsorted(edges, values[names.index(axis.measure)], "right") - 1, 0, 19)))
            key, quality = tuple(cell), float(values[0])
            if key not in best or quality > best[key][0]:
                best[key] = quality, candidate.tolist()
    assert {elite.cell: (elite.fitness, list(elite.parameters)) for elite in archive.elites} == best
    assert archive.coverage == len(best) / 400
    assert archive.qd_score == pytest.approx(sum(quality for quality, _ in best.values()))
    heat = archive.heat_map()
    assert np.isfinite(heat).sum() == len(best)
    assert all(heat[cell] == quality for cell, (quality, _) in best.items())


def test_the_elite_of_a_place_is_that_of_the_nearest_filled_cell() -> None:
    archive = told(kiks.Evolution(small(), "ga", seed=2, population=8), 1, generations=2).archive
    for elite in archive.elites:
        pairs = zip(archive.axes, elite.cell, strict=True)
        place = [axis.low + (k + 0.5) * (axis.high - axis.low) / axis.cells for axis, k in pairs]
        assert archive.elite_at(*place) is elite
        champion = archive.champion_at(*place)
        assert (champion.parameters, champion.fitness) == (elite.parameters, elite.fitness)
        assert set(champion.measures) == set(archive.value_names) - {"fitness"}
    corner = archive.elite_at(-1e6, -1e6)
    assert sum(k**2 for k in corner.cell) == min(sum(k**2 for k in elite.cell) for elite in archive.elites)


def test_wrong_places_and_too_many_cells_are_errors() -> None:
    evolution = kiks.Evolution(small(), "ga", population=8)
    refused("must hold an elite, but it is empty", evolution.archive.elite_at, 1, 1)
    archive = told(evolution, 1).archive
    refused(r"must be 2 numbers \(path_mm, straightness\), but it was", archive.elite_at, 1)
    refused("straightness must be a finite number", archive.champion_at, 1, float("nan"))
    axes = tuple(kiks.Axis(name, 0, 1, 10_000) for name in ("path_mm", "straightness", "avoidance", "roaming"))
    refused("at most 2\\^53 cells", kiks.Evolution, small(axes=axes), "ga")


def test_an_archive_equals_the_one_loaded_from_its_folder(tmp_path: Path) -> None:
    evolution = run("map-elites", folder=tmp_path)
    archive, again = evolution.archive, kiks.Archive.load(tmp_path)
    assert again.elites == archive.elites
    assert (again.axes, again.value_names, again.qd_score) == (archive.axes, archive.value_names, archive.qd_score)
    champion = again.champion_at(300, 0.5)
    assert champion.controller is evolution.task.controller
    assert champion.parameters == archive.champion_at(300, 0.5).parameters
    assert (champion.algorithm, champion.seed, champion.timing) == ("map-elites", 3, evolution.task.timing)


def test_folders_without_an_archive_are_errors(tmp_path: Path) -> None:
    refused("must be the folder of an evolution", kiks.Archive.load, tmp_path)
    run("cma", folder=tmp_path, axes=())
    refused("for an archive, but it has 0 axes", kiks.Archive.load, tmp_path)


def test_generations_with_fitness_alone_are_not_in_the_archive(tmp_path: Path) -> None:
    evolution = kiks.Evolution(small(), "cma", population=8, folder=tmp_path)
    evolution.tell(np.zeros(len(evolution.ask())))
    told(evolution, 1, generations=2)
    evolution.save_log()
    assert kiks.Archive.load(tmp_path).elites == evolution.archive.elites != ()


def test_an_elite_becomes_a_champion(tmp_path: Path) -> None:
    archive = run("map-elites", folder=tmp_path / "out").archive
    elite = archive.elites[-1]
    words = ["champion", str(tmp_path / "out"), str(tmp_path / "elite.toml"), "--at"]
    said = CliRunner().invoke(app, [*words, ",".join(str(elite.values[axis.measure]) for axis in archive.axes)])
    assert said.exit_code == 0, said.output
    assert f"of generation {elite.generation}." in said.output.replace("\n", " ")
    assert kiks.Champion.load(tmp_path / "elite.toml").parameters == tuple(elite.parameters)
    failed = CliRunner().invoke(app, [*words, "1,x", "--force"])
    assert isinstance(failed.exception, ParameterError)
    assert "must be numbers" in str(failed.exception)


def test_the_picture_shows_the_archive_of_every_algorithm(tmp_path: Path) -> None:
    from kiks.learn.plots import figure_of_evolution, save_plot

    one = (kiks.Axis("path_mm", 0, 1500),)
    for changes in ({}, {"axes": one}, {"axes": (*small().axes, kiks.Axis("contacts", 0, 5))}, {"axes": ()}):
        save_plot(figure_of_evolution(run("cma", name="a$_$", **changes)), tmp_path / "fitness.png")
        assert (tmp_path / "fitness.png").read_bytes().startswith(b"\x89PNG")
