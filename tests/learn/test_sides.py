"""Tasks of two sides: values of pairs depend on the pair and its seed alone, evolutions resume to the bit."""

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.learn.small import candidates_of, refused

import kiks
from kiks import ParameterError
from kiks.cli.evolve import winners_of
from kiks.learn.cross_tournament import MEETINGS, hold_cross_tournament, mean_over_groups
from kiks.learn.finals import MasterTournament, latin_square
from kiks.learn.fingerprint import differing
from kiks.learn.plots import figure_of_tournament, save_plot
from kiks.learn.ready_tasks import CAUGHT_MM, PREY_SPEED, TASKS
from kiks.learn.results import examined, load_results
from kiks.learn.seeds import SQUARE, TOURNAMENT, seed_for
from kiks.model.arena import Pose

pytestmark = pytest.mark.slow


def small(**changes: Any) -> kiks.Task:
    """Return a task that takes some milliseconds."""
    return kiks.tasks.pursuit(**{"seconds": 2.0} | changes)


def evolution_of(folder: Path | None = None, task: kiks.Task | None = None, **given: Any) -> kiks.Evolution:
    return kiks.Evolution(task or small(), folder=folder, **{"seed": 3, "population": 6, "opponents": 3} | given)


def run(folder: Path | None = None, executor: Any = None, generations: int = 4, **given: Any) -> kiks.Evolution:
    evolution = evolution_of(folder, **given)
    evolution.run(generations=generations, executor=executor)
    return evolution


def pairs_of(task: kiks.Task, count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    return 3.0 * np.random.default_rng(1).standard_normal((count, task.parameter_count))


@kiks.controller(parameters=1, memory=1)
def ahead_then(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    memory[0] += 1.0
    wheels[:] = 10.0 if memory[0] < 20.0 else parameters[0]


def test_values_of_pairs_depend_on_the_pair_and_its_seed_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    task = small(worlds=2)
    pairs, seeds = pairs_of(task, 12), np.arange(12) // 3
    whole = task.evaluate(pairs, seeds, 1)
    assert len(np.unique(whole[:, 2])) > 6
    np.testing.assert_array_equal(task.evaluate(pairs, seeds, 3), whole)
    np.testing.assert_array_equal(task.evaluate(pairs[::-1].copy(), seeds[::-1].copy(), 1)[::-1], whole)
    alone = [task.evaluate(pairs[k : k + 1], seeds[k : k + 1], 1)[0] for k in range(12)]
    np.testing.assert_array_equal(alone, whole)
    monkeypatch.setattr("kiks.learn.task.BATCH_WORLDS_MAX", 7)
    np.testing.assert_array_equal(task.evaluate(pairs, seeds, 1), whole)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(task)).evaluate(pairs, seeds, 1), whole)


def test_the_fitness_of_pursuit_is_the_share_of_the_time() -> None:
    task = small(seconds=20.0)
    values = task.evaluate(pairs_of(task, 60), np.zeros(60, np.int64), 1)
    named = dict(zip(task.value_names, values.T, strict=True))
    np.testing.assert_allclose(named["predator_fitness"] + named["prey_fitness"], 1.0)
    np.testing.assert_array_equal(named["predator_escaped_share"], named["prey_escaped_share"])
    assert (named["prey_fitness"] == 1.0).any()
    assert ((named["prey_fitness"] > 0.0) & (named["prey_fitness"] < 0.9)).any()
    assert task.sides[1].controller.recipe["speed_limit"] == PREY_SPEED == 2 * 10.0  # type: ignore[index]


def test_later_motion_does_not_count() -> None:
    """Two robots that drive at each other score the same as two that part after their contact."""
    room = replace(kiks.Arena.box(470, 470), starts=(Pose(135, 235, 0.0), Pose(335, 235, np.pi)))

    prey = replace(small().sides[1], controller=ahead_then)
    task = small(controller=ahead_then, against=prey, arenas=[room], starts="arena", seconds=6.0)
    pairs = np.array([[10.0, 10.0], [-10.0, -3.0], [0.0, 0.0]])
    values = task.evaluate(pairs, np.zeros(3, np.int64), 1)
    assert len(set(values[:, 0].tolist())) == 1
    # They close in at 160 mm/s, after the time of the first readings.
    assert values[0, 4] == pytest.approx((200 - CAUGHT_MM) / 160 / 6.0, abs=0.03)


def test_starts_are_apart_and_repeat_and_sides_may_have_several_robots_of_different_kinds() -> None:
    poses = small(worlds=2, apart_mm=100.0).start_poses(np.array([5, 6, 5]))
    assert poses.shape == (6, 2, 3)
    np.testing.assert_array_equal(poses[:2], poses[4:])
    assert (poses[:2] != poses[2:4]).any()
    assert (np.hypot(*(poses[:, 0, :2] - poses[:, 1, :2]).T) > 55 + 100).all()
    task = small(robots=2, robot="khepera_ii", apart_mm=20.0)
    values = task.evaluate(pairs_of(task, 3), np.arange(3), 1)
    assert values.shape == (3, len(task.value_names))
    first, second = (values[:, task.value_names.index(f"{side.name}_path_mm")] for side in task.sides)
    assert (first != second).all()
    assert differing(task.digest(), small().digest()) == "robot, robots, apart_mm"


def test_wrong_tasks_and_calls_are_errors() -> None:
    prey = small().sides[1]
    for changes, message in (
        ({"worlds": 3, "arenas": [kiks.Arena.box(500, 500)] * 2}, "worlds must be a multiple of the number of arenas"),
        ({"measures": [kiks.measures.path_mm] * 2}, "must have different names"),
        ({"apart_mm": -1.0}, "apart_mm must be"),
        ({"side": "prey"}, "sides must have different names"),
        ({"side": ""}, "sides must have different names"),
    ):
        refused(message, small, **changes)
    refused("name must be", kiks.Side, "../prey", prey.controller)
    refused("must state the number of its parameters", kiks.Side, "prey", kiks.controller(ahead_then.function))
    for changes, shape, message in (
        ({}, (1, 43), r"must have 76 parameters \(54 of the predator and 22 of the prey\), but"),
        ({"fitness": lambda values: values["path_mm"]}, (2, 76), "fitness must return a finite number for each of 2"),
        ({"apart_mm": 600.0}, (1, 76), "must have room for 2 robots"),
    ):
        refused(message, small(**changes).evaluate, np.zeros(shape), np.zeros(shape[0], np.int64), 1)
    refused("opponents must be a whole number from 1", evolution_of, opponents=0)
    refused("opponents must be left out .* it was 3", kiks.Evolution, kiks.tasks.avoid(), opponents=3)
    evolution = evolution_of(population=4, opponents=2)
    refused("before there is a champion", evolution.champion_of, "prey")
    refused("before a tournament", evolution.master_tournament)
    evolution.ask()
    refused(r"here \(16,\) or \(16, 8\), but their shape was \(16, 1\)", evolution.tell, np.zeros(16))
    evolution.tell(np.zeros((16, 8)))
    refused("side must be 0, 1 or one of predator, prey", evolution.champion_of, "pray")
    refused("generation must be a whole number from 1 to 1", evolution.champion_of, "prey", 2)
    with pytest.raises(ParameterError, match="a tournament must have two sides, but the task 'avoid' has one"):
        kiks.Evolution(kiks.tasks.avoid()).master_tournament()


def test_candidates_meet_the_champions_of_the_last_generations() -> None:
    evolution = run()
    pairs, size = evolution.ask(), evolution.task.sides[0].parameter_count
    latest = [evolution.champion_of("prey", 4 - k).parameters for k in range(3)]
    np.testing.assert_array_equal(pairs[:3, size:], latest)
    assert (pairs[:3, :size] == pairs[0, :size]).all()
    np.testing.assert_array_equal(pairs[18:21, :size], [evolution.champion_of(0, 4 - k).parameters for k in range(3)])
    assert (evolution.seeds.reshape(-1, 3) == evolution.seeds[:3]).all()
    assert len(set(evolution.seeds.tolist())) == 3


def test_fitness_is_the_mean_over_the_opponents_of_a_candidate() -> None:
    evolution = evolution_of(seed=1, population=4, opponents=2)
    names = evolution.task.value_names
    values = np.random.default_rng(1).uniform(0, 1, (len(evolution.ask()), len(names)))
    evolution.tell(values)
    told = evolution.generations[0].values
    for candidate in range(4):
        first = values[2 * candidate : 2 * candidate + 2].mean(axis=0)
        second = values[8 + 2 * candidate : 10 + 2 * candidate].mean(axis=0)
        for number, name in enumerate(names):
            assert told[candidate, number] == (second if name.startswith("prey") else first)[number]
    best = int(told[:, 4].argmax())
    prey = evolution.champion_of("prey")
    assert (prey.fitness, prey.measures["path_mm"]) == (told[best, 4], told[best, 6])
    assert prey.parameters == tuple(evolution.generations[0].candidates[best, 54:])


def test_a_resumed_evolution_equals_one_that_never_stopped(tmp_path: Path) -> None:
    from pyarrow import parquet

    whole = run(tmp_path / "whole")
    run(tmp_path / "part", generations=2)
    assert candidates_of(run(tmp_path / "part")) == candidates_of(whole)
    for name in ("predator.toml", "prey.toml", "tournament.parquet"):
        assert (tmp_path / "part" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    log = parquet.read_table(tmp_path / "whole/log.parquet").to_pydict()
    assert log["generation"] == [number for number in range(1, 5) for _ in range(6)]
    assert log["prey_fitness"] == [value for each in whole.generations for value in each.fitness_of(1).tolist()]
    assert log["evaluations"][-1] == 4 * 2 * 6 * 3
    examined(whole).save(tmp_path / "whole")
    (result,) = load_results(tmp_path / "whole")
    assert (result.fitness, result.baselines) == (whole.tournament.means[0].max(), None)
    assert result.evaluations == (36, 72, 108, 144)
    refused("they have 'ga, 3 opponents' and 'ga, 4 opponents'", evolution_of, tmp_path / "whole", opponents=4)


def test_each_side_has_an_archive_along_the_axes(tmp_path: Path) -> None:
    evolution = run(tmp_path, task=small(axes=(kiks.Axis("path_mm", 0, 100),)), algorithm="map-elites")
    for archive, side in zip(evolution.archives, evolution.task.sides, strict=True):
        assert 0 < len(archive.elites) == len(kiks.Archive.load(tmp_path, side.name).elites)
        assert len(archive.elites[0].parameters) == side.parameter_count


def test_the_tournament_equals_a_loop_over_all_pairs_in_a_latin_square_of_seeds() -> None:
    evolution = run()
    tournament = evolution.tournament
    assert [each.generation for each in evolution.champions] == [*tournament.best]
    square = latin_square(4, seed_for(3, SQUARE))
    for first in range(4):
        for second in range(4):
            pair = [
                *evolution.champion_of("predator", first + 1).parameters,
                *evolution.champion_of("prey", second + 1).parameters,
            ]
            numbers = [4 * trial + square[first, second] for trial in range(2)]
            seeds = np.array([seed_for(3, TOURNAMENT, number) for number in numbers])
            values = evolution.task.evaluate(np.array([pair, pair]), seeds, 1)[:, [0, 4]]
            np.testing.assert_array_equal(tournament.scores[:, first, second], (values[0] + values[1]) / 2)
    np.testing.assert_array_equal(tournament.generations, [1, 2, 3, 4])
    some = evolution.master_tournament(trials=2, every=2)
    np.testing.assert_array_equal(some.generations, [2, 4])
    assert some.scores.shape == (2, 2, 2)
    square = latin_square(7, 1)
    np.testing.assert_array_equal(np.sort(square, axis=0), np.tile(np.arange(7)[:, None], 7))
    np.testing.assert_array_equal(np.sort(square, axis=1), np.tile(np.arange(7), (7, 1)))


def test_a_tournament_knows_the_best_and_the_winner(tmp_path: Path) -> None:
    scores = np.array([[0.9, 0.2], [0.8, 0.3]])
    tournament = MasterTournament(("cat", "mouse"), np.array([1, 2]), np.stack([scores, 1 - scores]))
    np.testing.assert_allclose(tournament.means, [[0.55, 0.55], [0.15, 0.75]])
    assert tournament.best[1] == 2
    assert list(winners_of(tournament)) == [
        "Generation 1: cat 0.90   mouse 0.10   the cat won",
        "Generation 2: cat 0.30   mouse 0.70   the mouse won",
    ]
    save_plot(figure_of_tournament(tournament), tmp_path / "tournament.png")
    assert (tmp_path / "tournament.png").read_bytes().startswith(b"\x89PNG")


def test_strangers_meet_from_the_same_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(TASKS, "pursuit", lambda _: small())
    homes = [tmp_path / name for name in "abc"]
    for seed, home in enumerate(homes):
        run(home, generations=2, seed=seed, population=4)
    met = hold_cross_tournament({"one": homes[:2], "other": homes[2:]})
    task, starts = small(), [seed_for(0, TOURNAMENT, number) for number in range(MEETINGS)]
    champions = [
        [kiks.Champion.load(home / f"{side}.toml").parameters for side in ("predator", "prey")] for home in homes
    ]
    oracle = np.full((2, 3, 3), np.nan)
    for row, column in ((0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)):
        pair = np.tile([*champions[row][0], *champions[column][1]], (MEETINGS, 1))
        oracle[:, row, column] = task.evaluate(pair, np.array(starts), 1)[:, [0, 4]].mean(axis=0)
    predators, prey = np.nanmean(oracle[0], axis=1), np.nanmean(oracle[1], axis=0)
    np.testing.assert_allclose([*met["predator"]["one"], *met["predator"]["other"]], predators)
    np.testing.assert_allclose([*met["prey"]["one"], *met["prey"]["other"]], prey)
    refused("two evolutions or more, but it has one", hold_cross_tournament, {"one": homes[:1]})


def test_equal_predators_are_equal_although_the_preys_of_one_group_are_slower() -> None:
    of_group, preys = np.array(["a", "a", "a", "b", "b"]), np.array([0.2, 0.3, 0.4, 0.8, 0.9])
    scores = np.where(np.eye(5), np.nan, preys)
    expected = [(a + 0.85) / 2 for a in (0.35, 0.3, 0.25)] + [(0.3 + b) / 2 for b in (0.9, 0.8)]
    np.testing.assert_allclose(mean_over_groups(scores, of_group), expected)
    assert np.mean(expected[:3]) == pytest.approx(np.mean(expected[3:]))
    lone = mean_over_groups(scores[2:, 2:][:2, :2], of_group[2:4])  # each has no stranger but the other
    np.testing.assert_allclose(lone, [0.8, 0.4])
