"""Evolution: reproducible by its seed, resumable when killed; champions drive on a serial line as in the batch."""

import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import forked
from tests.at_length import share
from tests.learn.small import candidates_of, refused, small

import kiks
from kiks.learn.task import LOGGED

pytestmark = pytest.mark.slow


def evolution_of(folder: Path | None = None, algorithm: Any = "cma", **changes: Any) -> kiks.Evolution:
    return kiks.Evolution(small(**changes), algorithm, population=8, seed=3, folder=folder)


def run(folder: Path | None = None, algorithm: Any = "cma") -> kiks.Evolution:
    evolution = evolution_of(folder, algorithm)
    evolution.run(generations=4)
    return evolution


def test_worlds_differ_between_generations_but_trial_worlds_do_not() -> None:
    evolution = run(algorithm="ga")
    before = evolution.seeds
    evolution.tell(np.zeros(len(evolution.ask())))
    assert len(set(before[:8])) == 1
    assert before[0] != evolution.seeds[0]
    assert (before[8:] == evolution.seeds[8:]).all()
    assert len(before) > 8


KILLED = """
import os, signal, threading, kiks
def kill(evolution):
    if len(evolution.generations) == 3:
        threading.Thread(target=os.kill, args=(os.getpid(), signal.SIGKILL)).start()
task = kiks.tasks.avoid(seconds=1.0, worlds=4)
evolution = kiks.Evolution(task, "cma", population=8, seed=3, folder="out")
evolution.run(generations=10**6, each=kill)
"""


def test_a_killed_evolution_loses_at_most_the_current_generation(tmp_path: Path) -> None:
    assert forked.run(code=KILLED, cwd=tmp_path).returncode == -signal.SIGKILL
    again, whole = evolution_of(tmp_path / "out"), evolution_of()
    count = len(again.generations)
    assert count >= 3
    for each in (again, whole):
        each.run(generations=count + 1)
    assert candidates_of(again) == candidates_of(whole)
    assert again.champion.parameters == whole.champion.parameters


def test_the_log_has_a_row_for_each_evaluation(tmp_path: Path) -> None:
    from pyarrow import parquet

    evolution = run(tmp_path)
    log = parquet.read_table(tmp_path / "log.parquet").to_pydict()
    assert set(log) == {*LOGGED, *evolution.task.measure_names}
    counts = [8, 16, 16, 16]
    assert log["generation"] == [number for number, count in enumerate(counts, start=1) for _ in range(count)]
    assert log["candidate"] == [number for count in counts for number in range(count)]
    assert log["is_trial"] == [number >= 8 for number in log["candidate"]]
    assert log["fitness"] == [value for each in evolution.generations for value in each.values[:, 0].tolist()]
    assert log["evaluations"] == [sum(counts[:number]) for number in log["generation"]]
    candidates = np.concatenate([each.candidates for each in evolution.generations])
    again = small().evaluate(candidates, np.array(log["seed"]), 1)
    assert again[:, 0].tolist() == log["fitness"]


def test_the_folder_of_another_evolution_or_of_none_is_an_error(tmp_path: Path) -> None:
    run(tmp_path)
    words = "must have the same seed, but they have 3 and 4"
    refused(words, kiks.Evolution, small(), "cma", population=8, seed=4, folder=tmp_path)
    refused("but these differ: seconds", evolution_of, tmp_path, seconds=2.0)
    alone = tmp_path / "alone"
    alone.mkdir()
    (alone / "champion.toml").write_text("the best of all")
    refused(r"must hold an evolution or no champion\.toml", evolution_of, alone)
    assert [path.name for path in alone.iterdir()] == ["champion.toml"]


def test_the_error_names_a_broken_generation_file(tmp_path: Path) -> None:
    run(tmp_path)
    file = tmp_path / "generations/000002.npz"
    with np.load(file) as saved:
        good = dict(saved)
    values, candidates = good["values"], good["candidates"]
    many = np.zeros((len(values), 10**6), np.int8)
    wrong = [{"seconds": each} for each in (values, np.nan)]
    wrong += [{"values": each} for each in (np.full_like(values, np.inf), values[:, 0], many, values[:-1])]
    wrong += [{"candidates": candidates.astype(kind)} for kind in (complex, object)]
    for change in (*wrong, {"candidates": candidates[:-1], "values": values[:-1]}):
        np.savez_compressed(file, **good | change)
        refused(rf"000002.npz': {next(iter(change))} |000002.npz' must be a whole", evolution_of, tmp_path)
    for data in (b"nothing", b"", (tmp_path / "generations/000001.npz").read_bytes()[:-30]):
        file.write_bytes(data)
        refused(r"000002.npz' must be a whole .npz file", evolution_of, tmp_path)
    np.savez(file, **good)
    assert len(evolution_of(tmp_path).generations) == 4


def test_an_evolution_maximises_fitness() -> None:
    evolution = kiks.Evolution(small(), "cma", seed=1, population=20)
    for _ in range(40):
        evolution.tell(-((evolution.ask() - 0.5) ** 2).sum(axis=1))
    assert evolution.champion.fitness > -3.0
    assert evolution.generations[0].fitness.max() < -5


class Own:
    """Proposes normal candidates around the best so far, and keeps everything that it is told."""

    def __init__(self, count: int = 8, **given: Any) -> None:
        self.rng, self.count, self.given = np.random.default_rng(1), count, given
        self.mean, self.told = np.zeros(18), list[Any]()

    def ask(self) -> Any:
        self.candidates = self.mean + self.rng.standard_normal((self.count, 18))
        return self.given.get("asked", self.candidates)

    def tell(self, fitness: Any, behaviours: Any) -> None:
        self.told.append((fitness.tolist(), behaviours.shape))
        self.mean = self.candidates[fitness.argmax()].copy()
        fitness[:] = 0
        self.candidates[:] = 0


class OwnWithFavourite(Own):
    def favourite(self) -> Any:
        return self.given.get("best", np.full(18, 0.5))


def test_an_object_with_ask_and_tell_is_an_algorithm_whose_favourite_is_tried(tmp_path: Path) -> None:
    own = Own()
    evolution = kiks.Evolution(small(), own, folder=tmp_path)
    evolution.run(generations=3)
    assert evolution.algorithms == [own]
    assert (evolution.population, evolution.champion.algorithm) == (8, "Own")
    for (fitness, shape), generation in zip(own.told, evolution.generations, strict=True):
        assert (fitness, shape) == (generation.fitness.tolist(), (8, 2))
        assert generation.candidates[:8].all()
    best = evolution.generations[0].candidates[evolution.generations[0].fitness.argmax()]
    assert (evolution.generations[1].candidates[8:] == best).all()
    assert candidates_of(kiks.Evolution(small(), Own(), folder=tmp_path)) == candidates_of(evolution)
    words = "algorithm, but they have 'Own' and 'OwnWithFavourite'"
    refused(words, kiks.Evolution, small(), OwnWithFavourite(), folder=tmp_path)
    edited = type("Own", (Own,), {"tell": lambda self, fitness, behaviours: None})
    refused("but these differ: algorithm", kiks.Evolution, small(), edited(), folder=tmp_path)
    different = Own()
    different.rng = np.random.default_rng(2)
    refused("would have other candidates here", kiks.Evolution, small(), different, folder=tmp_path)
    evolution = kiks.Evolution(small(), OwnWithFavourite(), population=8)
    evolution.tell(np.zeros(len(evolution.ask())))
    assert (evolution.ask()[8:] == 0.5).all()


def test_wrong_arguments_answers_of_an_algorithm_and_orders_of_calls_are_errors() -> None:
    for message, given in (
        ("Did you mean 'cma'", {"algorithm": "cna"}),
        ("population must be a whole number from 4", {"population": 3}),
        ("seed must be a whole number from 0", {"seed": -1}),
        (r"candidates of ask\(\) must be finite numbers \[any, 18\]", {"algorithm": Own(asked=np.zeros((8, 17)))}),
        (r"candidates of ask\(\) must be finite numbers", {"algorithm": Own(asked=np.zeros(18))}),
        (r"candidates of ask\(\) must be finite", {"algorithm": Own(asked=np.full((8, 18), np.nan))}),
        (r"candidates of ask\(\) must be finite", {"algorithm": Own(asked=None)}),
        (r"candidates of ask\(\) must be at least one", {"algorithm": Own(count=0)}),
        ("algorithm must be", {"algorithm": Own}),
        ("algorithm must be", {"algorithm": 3}),
    ):
        refused(message, kiks.Evolution, small(), **given)
    refused(r"finite numbers \[4, 18\], but it had the shape \[8, 18\]", kiks.Evolution, small(), Own(), population=4)
    own = Own()
    evolution = kiks.Evolution(small(), own)
    evolution.tell(np.zeros(8))
    own.count = 9
    refused(r"finite numbers \[8, 18\], but it had the shape \[9, 18\]", evolution.ask)
    for best in (np.zeros(17), np.full(18, np.nan)):
        evolution = kiks.Evolution(small(), OwnWithFavourite(best=best))
        refused(r"parameters of favourite\(\) must be", evolution.tell, np.zeros(8))
    evolution = kiks.Evolution(small(), "ga", population=8)
    refused("before there is a champion", lambda: evolution.champion)
    refused("ask\\(\\) must come before", evolution.tell, np.zeros(8))
    assert (evolution.ask() == evolution.ask()).all()
    refused("values must be finite numbers", evolution.tell, np.full(8, np.nan))
    refused("generations or seconds must be given", evolution.run)


OWN = """
import kiks

@kiks.controller(parameters=2)
def ahead(sensors, memory, parameters, wheels):
    wheels[:] = parameters

@kiks.measure
def farthest_mm(moment, notes):
    notes[0] = max(notes[0], moment.path_mm)

task = kiks.Task("far", [kiks.Arena.box(500, 500)], ahead, [farthest_mm], seconds=1, worlds=2,
                 fitness=lambda values: values["farthest_mm"].mean(axis=1))
"""


def test_a_champion_does_not_need_the_python_file_of_its_task(tmp_path: Path) -> None:
    (tmp_path / "far.py").write_text(OWN)
    task = kiks.tasks.load(str(tmp_path / "far.py"))
    evolution = kiks.Evolution(task, "ga", population=8, folder=tmp_path / "out")
    champion = evolution.run(generations=3)
    (tmp_path / "far.py").unlink()
    again = kiks.Champion.load(tmp_path / "out/champion.toml")
    assert again.parameters == champion.parameters
    sim, ports = again.simulation(kiks.Arena.box(500, 500))
    assert again.drive(ports, seconds=1.0) == 10
    assert sim.travelled_mm(1) > 0


def test_wrong_tasks_and_files_without_one_are_errors(tmp_path: Path) -> None:
    (tmp_path / "none.py").write_text("task = 1\n")
    refused("must hold a `task", kiks.tasks.load, str(tmp_path / "none.py"))
    (tmp_path / "bad.py").write_text("1 / 0\n")
    refused("ZeroDivisionError", kiks.tasks.load, str(tmp_path / "bad.py"))
    refused("Did you mean 'avoid'", kiks.tasks.load, "avoyd")
    refused("worlds must be a multiple of the number of arenas, 16", small, worlds=30)
    refused("an axis must name one of", small, axes=(kiks.Axis("nothing", 0, 1),))
    task = small(fitness=lambda values: values["contacts"])
    words = "fitness must return a finite number for each of 1"
    refused(words, task.evaluate, np.zeros((1, task.parameter_count)), np.zeros(1, np.int64))


def test_obstacle_avoidance_evolves_and_works_on_a_serial_line() -> None:
    task = kiks.tasks.avoid()
    evolution = kiks.Evolution(task, "cma", seed=1)
    champion = evolution.run(generations=share(12, 25))
    medians = [float(np.median(each.fitness)) for each in evolution.generations]
    assert medians[-1] > 5 * max(medians[0], 0.001)
    sim, ports = champion.simulation(task.exam.arenas[0], seed=1)
    champion.drive(ports, seconds=60.0)
    assert sim.contacts(1) <= 3
    assert sim.travelled_mm(1) > 1000
