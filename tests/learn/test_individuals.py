"""Any candidate of a saved evolution drives again as in its evaluation, to the bit."""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from tests.at_length import cases
from tests.learn.small import refused, small

import kiks
from kiks.client.drive import ControllerDriver
from kiks.learn.evolution_log import TRIALS
from kiks.learn.individual import load_individual
from kiks.model.arena_file import save_arena
from kiks.model.family import family
from kiks.units import ns_from_s

pytestmark = pytest.mark.slow


KHEPERA = kiks.RobotSpec.load("khepera")
ROOMS = [kiks.Arena.box(300 + 50 * number, 400) for number in range(5)]


def evolved(task: kiks.Task, folder: Path) -> kiks.Evolution:
    evolution = kiks.Evolution(task, "ga", seed=3, population=6, folder=folder)
    evolution.run(generations=3)
    return evolution


class Watched(kiks.Batch):
    """Keeps all batches that a task makes."""

    made: ClassVar[list[kiks.Batch]] = []

    def __init__(self, *args: Any, **given: Any) -> None:
        super().__init__(*args, **given)
        self.made.append(self)


def hashes(task: kiks.Task, parameters: Any, seed: int, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the hashes of the last states of the worlds of an evaluation; those with the same timing together."""
    Watched.made = []
    with monkeypatch.context() as patch:
        patch.setattr("kiks.learn.task.Batch", Watched)
        task.evaluate(np.array([parameters]), np.array([seed]), 1)
    return [batch.state_hash(world) for batch in Watched.made for world in range(batch.world_count)]


TASKS = {
    "random starts": lambda: kiks.tasks.avoid(seconds=2.0, worlds=8),
    "with things": lambda: kiks.tasks.gather(seconds=2.0, worlds=8),
    "with a lamp": lambda: kiks.tasks.light(seconds=2.0, worlds=3),
    "many arenas": lambda: kiks.tasks.avoid(seconds=2.0, worlds=2, arenas=ROOMS),
    "starts of the arena": lambda: kiks.tasks.maze(seconds=2.0),
    "two robots": lambda: kiks.tasks.gather(seconds=2.0, worlds=8, robots=2),
    "a short period": lambda: kiks.tasks.avoid(seconds=1.23, worlds=4, timing=kiks.Timing(0.05, 38400, 0.0025)),
    "families": lambda: kiks.tasks.avoid(
        seconds=2.0, worlds=8, robot=family(KHEPERA, 4, seed=1), timing=[kiks.Timing(), kiks.Timing(0.05, 38400)]
    ),
}


@pytest.mark.parametrize("name", cases(TASKS, 2))
def test_a_demonstration_is_the_world_of_the_evaluation(name: str, tmp_path: Path, monkeypatch: Any) -> None:
    from pyarrow import parquet

    task = TASKS[name]()
    evolution = evolved(task, tmp_path)
    log = parquet.read_table(tmp_path / "log.parquet").to_pydict()
    found, candidate = load_individual(tmp_path, 2, rank=3, task=task)
    rows = [row for row, number in enumerate(log["generation"]) if number == 2]
    row = rows[candidate]
    assert found.fitness == log["fitness"][row] == sorted(evolution.generations[1].fitness)[-3]
    expected = hashes(task, found.parameters, log["seed"][row], monkeypatch)
    found_hashes = []
    for world in range(task.worlds):
        champion, _ = load_individual(tmp_path, 2, rank=3, world=world, task=task)
        sim, ports = champion.simulation()
        driver = ControllerDriver(ports, champion.controller, champion.parameters, period_s=champion.timing.period_s)
        while driver.begin_ns < ns_from_s(champion.world.seconds):
            driver.step()
        found_hashes.append(sim.state_hash())
    if len(task.timings) == 1:
        assert found_hashes == expected
    assert sorted(found_hashes) == sorted(expected)


def test_generations_need_no_rival_on_trial(tmp_path: Path) -> None:
    """All candidates fall into one cell of the map, and its elite is tried once."""
    task = small()
    evolution = kiks.Evolution(task, "map-elites", seed=3, population=6, folder=tmp_path)
    for _ in range(4):
        evolution.tell(np.zeros((len(evolution.ask()), len(task.value_names))))
    assert [len(each.candidates) - 6 for each in evolution.generations] == [0, TRIALS, 0, 0]
    for number, generation in enumerate(evolution.generations, 1):
        found, _ = load_individual(tmp_path, number, rank=2, task=task)
        assert found.parameters == tuple(generation.candidates[1])
    np.savez(tmp_path / "generations/000002.npz", candidates=np.zeros((9, 18)), values=np.zeros((9, 1)), seconds=1.0)
    refused("candidates must be 6 or 14, but their number was 9", load_individual, tmp_path, 2, task=task)


def test_the_task_is_found_again(tmp_path: Path) -> None:
    save_arena(kiks.Arena.box(400, 300), tmp_path / "room.toml")
    (tmp_path / "mine.toml").write_text('task = 1\nbase = "avoid"\nseconds = 1\nworlds = 1\narenas = ["room.toml"]\n')
    evolved(kiks.tasks.load(tmp_path / "mine.toml"), tmp_path / "out")
    assert load_individual(tmp_path / "out", 1)[0].world.seconds == 1.0
    evolved(kiks.tasks.maze(controller=kiks.controllers.gru()), tmp_path / "gru")
    assert load_individual(tmp_path / "gru", 3)[0].controller is kiks.controllers.gru()


def test_numbers_out_of_range_and_a_task_that_cannot_be_found_are_errors(tmp_path: Path) -> None:
    evolved(small(), tmp_path / "changed")
    refused("must be the one that was evolved, but it differs now", load_individual, tmp_path / "changed", 1)
    evolved(small(name="mine"), tmp_path / "own")
    refused(r"'mine' .* must be given, for it was made in Python.*--task FILE", load_individual, tmp_path / "own", 1)
    file = tmp_path / "quick.py"
    file.write_text("import kiks\ntask = kiks.tasks.avoid(seconds=1.0, worlds=4)\n")
    evolved(kiks.tasks.load(file), tmp_path / "file")
    refused(r"quick.py' is a Python file. Give it: --task FILE", load_individual, tmp_path / "file", 1)
    assert load_individual(tmp_path / "file", 1, task=kiks.tasks.load(file))[0].task == "avoid"
    (tmp_path / "nothing").mkdir()
    refused("nothing' must be the folder of an evolution", load_individual, tmp_path / "nothing", 1)
    assert not list((tmp_path / "nothing").iterdir())
    task = small()
    evolved(task, tmp_path / "range")
    for given, message in (
        ({"generation": 4}, "generation must be a whole number from 1 to 3"),
        ({"generation": 1, "rank": 7}, "rank must be a whole number from 1 to 6"),
        ({"generation": 1, "world": 4}, "world must be a whole number from 0 to 3"),
    ):
        refused(message, load_individual, tmp_path / "range", task=task, **given)
