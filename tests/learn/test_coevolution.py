"""Contests and co-evolution: values of pairs depend on the pair and its seed alone, evolutions resume to the bit."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import parquet
from tests.at_length import at_length

import kiks
from kiks import ParameterError
from kiks.client.drive import Driver
from kiks.learn.candidate_worlds import spread_starts
from kiks.learn.coevolution import _SQUARE_SEED, TOURNAMENT_SEED, Tournament, latin_square
from kiks.learn.fingerprint import differing
from kiks.learn.generation_loop import seed_for
from kiks.learn.ready_contests import CAUGHT_MM, PREY_SPEED
from kiks.model.arena import Pose

pytestmark = pytest.mark.slow


def small(**changes: Any) -> kiks.Contest:
    """Return a contest that takes some milliseconds."""
    return kiks.tasks.pursuit(**{"seconds": 2.0} | changes)


def run(folder: Path | None = None, executor: Any = None, **given: Any) -> kiks.Coevolution:
    coevolution = kiks.Coevolution(small(), folder=folder, **{"seed": 3, "population": 6, "opponents": 3} | given)
    coevolution.run(generations=4, executor=executor)
    return coevolution


def bytes_of(coevolution: kiks.Coevolution) -> bytes:
    return b"".join(each.candidates.tobytes() + each.values.tobytes() for each in coevolution.generations)


def pairs_of(contest: kiks.Contest, count: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    size = sum(side.parameter_count for side in contest.sides)
    return 3.0 * np.random.default_rng(1).standard_normal((count, size))


# ---- contests ----


def test_values_of_pairs_depend_on_the_pair_and_its_seed_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    contest = small(worlds=2)
    pairs, seeds = pairs_of(contest, 12), np.arange(12) // 3
    whole = contest.evaluate(pairs, seeds, 1)
    assert len(np.unique(whole[:, 3])) > 6
    np.testing.assert_array_equal(contest.evaluate(pairs, seeds, 3), whole)
    np.testing.assert_array_equal(contest.evaluate(pairs[::-1].copy(), seeds[::-1].copy(), 1)[::-1], whole)
    alone = [contest.evaluate(pairs[k : k + 1], seeds[k : k + 1], 1)[0] for k in range(12)]
    np.testing.assert_array_equal(alone, whole)
    monkeypatch.setattr("kiks.learn.candidate_worlds.BATCH_WORLDS_MAX", 7)
    np.testing.assert_array_equal(contest.evaluate(pairs, seeds, 1), whole)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(contest)).evaluate(pairs, seeds, 1), whole)


def test_the_scores_of_pursuit_share_the_time() -> None:
    contest = small(seconds=20.0)
    values = contest.evaluate(pairs_of(contest, 60), np.zeros(60, np.int64), 1)
    named = dict(zip(contest.value_names, values.T, strict=True))
    np.testing.assert_allclose(named["predator"] + named["prey"], 1.0)
    np.testing.assert_array_equal(named["predator_escaped_share"], named["prey_escaped_share"])
    assert (named["prey"] == 1.0).any()
    assert ((named["prey"] > 0.0) & (named["prey"] < 0.9)).any()


def test_the_scores_of_pursuit_do_not_depend_on_how_its_time_is_set() -> None:
    short, changed = small(seconds=3.0), kiks.tasks.pursuit().with_changes(seconds=3.0)
    pairs, seeds = pairs_of(short, 8), np.arange(8)
    np.testing.assert_array_equal(short.evaluate(pairs, seeds, 1), changed.evaluate(pairs, seeds, 1))
    np.testing.assert_array_equal(
        short.evaluate(pairs, seeds, 1), kiks.tasks.pursuit().evaluate(pairs, seeds, 1, seconds=3.0)
    )


def test_later_motion_does_not_count() -> None:
    """Two robots that drive at each other score the same as two that part after their contact."""
    room = replace(kiks.Arena.box(470, 470), starts=(Pose(135, 235, 0.0), Pose(335, 235, np.pi)))

    @kiks.controller(parameters=1, memory=1)
    def ahead_then(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        memory[0] += 1.0
        wheels[:] = 10.0 if memory[0] < 20.0 else parameters[0]

    sides = tuple(replace(side, controller=ahead_then) for side in small(seconds=6.0).sides)
    contest = small(sides=sides, arenas=[room], starts="arena", seconds=6.0)
    pairs = np.array([[10.0, 10.0], [-10.0, -3.0], [0.0, 0.0]])
    values = contest.evaluate(pairs, np.zeros(3, np.int64), 1)
    assert len(set(values[:, 0].tolist())) == 1
    # They close in at 160 mm/s, after the time of the first readings.
    assert values[0, 1] == pytest.approx((200 - CAUGHT_MM) / 160 / 6.0, abs=0.03)


def test_starts_are_apart_and_the_same_for_the_same_seed() -> None:
    contest = small(worlds=2, apart_mm=100.0)
    poses = contest.start_poses(np.array([5, 6, 5]))
    assert poses is not None
    assert poses.shape == (6, 2, 3)
    np.testing.assert_array_equal(poses[:2], poses[4:])
    assert (poses[:2] != poses[2:4]).any()
    assert (np.hypot(*(poses[:, 0, :2] - poses[:, 1, :2]).T) > 55 + 100).all()


def test_a_contest_on_the_wire_equals_that_of_the_batch() -> None:
    contest, seed = small(seconds=5.0), 7
    pair = pairs_of(contest, 1)
    starts = spread_starts(contest.arenas, 1, seed=seed, radius_mm=27.5, robots=2, apart_mm=contest.apart_mm)
    batch = kiks.Batch(contest.arenas[0], 1, robots=2, seed=seed, starts=starts, timing=contest.timing)
    batch.run(contest.controllers, contest.parameters_of(pair), seconds=5.0)
    room = replace(contest.arenas[0], starts=tuple(Pose(*pose) for pose in starts[0].tolist()))
    sim = kiks.Simulation(room, robots=2, seed=seed)
    sim.fit(1, "k213")
    ports = [sim.port(1), sim.port(2)]
    for port in ports:
        port.baudrate = contest.timing.baud or 0
    driver = Driver(ports, contest.controllers, [each[0] for each in contest.parameters_of(pair)])
    while driver.begin_ns < 5e9:
        driver.step()
    assert sim.state_hash() == batch.state_hash(0)


def test_sides_may_have_several_robots_of_different_kinds() -> None:
    predator, prey = small().sides
    contest = small(sides=(replace(predator, robots=2, robot="khepera_ii"), prey), apart_mm=20.0)
    values = contest.evaluate(pairs_of(contest, 3), np.arange(3), 1)
    assert values.shape == (3, len(contest.value_names))
    first, second = (values[:, contest.value_names.index(f"{name}_path_mm")] for name in contest.side_names)
    assert (first != second).all()
    assert differing(contest.digest(), small().digest()) == "sides, apart_mm"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sides": ()}, "sides"),
        ({"seconds": 0.0}, "seconds must be"),
        ({"worlds": 3, "arenas": [kiks.Arena.box(500, 500)] * 2}, "worlds must be a multiple of the number of arenas"),
        ({"measures": [kiks.measures.path_mm] * 2}, "must have different names"),
        ({"apart_mm": -1.0}, "apart_mm must be"),
    ],
)
def test_wrong_contests_are_errors(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        small(**changes)


def test_wrong_sides_and_pairs_are_errors() -> None:
    predator, prey = small().sides
    with pytest.raises(ParameterError, match="sides must have different names"):
        small(sides=(predator, replace(prey, name="predator")))
    with pytest.raises(ParameterError, match="name must be"):
        kiks.Side("../prey", prey.controller)

    @kiks.controller
    def any_number(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        wheels[:] = 0.0

    with pytest.raises(ParameterError, match="must state the number of its parameters"):
        kiks.Side("prey", any_number)
    contest = small()
    with pytest.raises(ParameterError, match=r"a pair must have 76 parameters \(54 of the predator and 22 of the prey"):
        contest.evaluate(np.zeros((1, 43)), np.zeros(1, np.int64), 1)
    broken = small(sides=(replace(predator, fitness=lambda values: values["path_mm"]), prey))
    with pytest.raises(ParameterError, match="fitness must return a finite number for each of 2 candidates"):
        broken.evaluate(np.zeros((2, 76)), np.zeros(2, np.int64), 1)
    with pytest.raises(ParameterError, match="must have room for 2 robots"):
        small(apart_mm=600.0).evaluate(np.zeros((1, 76)), np.zeros(1, np.int64), 1)


# ---- co-evolution ----


def test_the_same_seed_gives_the_same_coevolution() -> None:
    one, two, other = run(), run(executor=ThreadPoolExecutor(2)), run(seed=4)
    assert bytes_of(one) == bytes_of(two) != bytes_of(other)


def test_candidates_meet_the_champions_of_the_last_generations() -> None:
    coevolution = run()
    pairs, size = coevolution.ask(), coevolution.contest.sides[0].parameter_count
    latest = [coevolution.champion("prey", 4 - k).parameters for k in range(3)]
    np.testing.assert_array_equal(pairs[:3, size:], latest)
    assert (pairs[:3, :size] == pairs[0, :size]).all()
    np.testing.assert_array_equal(pairs[18:21, :size], [coevolution.champion(0, 4 - k).parameters for k in range(3)])
    assert (coevolution.seeds.reshape(-1, 3) == coevolution.seeds[:3]).all()
    assert len(set(coevolution.seeds.tolist())) == 3


def test_fitness_is_the_mean_over_the_contests_of_a_candidate() -> None:
    coevolution = kiks.Coevolution(small(), seed=1, population=4, opponents=2)
    names = coevolution.contest.value_names
    values = np.random.default_rng(1).uniform(0, 1, (2 * 4 * 2, len(names)))
    coevolution.tell(values)
    told = coevolution.generations[0].values
    for candidate in range(4):
        first = values[2 * candidate : 2 * candidate + 2].mean(axis=0)
        second = values[8 + 2 * candidate : 10 + 2 * candidate].mean(axis=0)
        for number, name in enumerate(names):
            assert told[candidate, number] == (second if name.startswith("prey") else first)[number]
    best = int(told[:, 1].argmax())
    assert coevolution.champion("prey").fitness == told[best, 1]
    assert coevolution.champion("prey").parameters == tuple(coevolution.generations[0].candidates[best, 54:])


def test_a_resumed_coevolution_equals_one_that_never_stopped(tmp_path: Path) -> None:
    whole = run(tmp_path / "whole")
    part = kiks.Coevolution(small(), seed=3, population=6, opponents=3, folder=tmp_path / "part")
    part.run(generations=2)
    assert bytes_of(run(tmp_path / "part")) == bytes_of(whole)
    for name in ("predator.toml", "prey.toml"):
        assert (tmp_path / "part" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    log = parquet.read_table(tmp_path / "whole/log.parquet").to_pydict()
    assert log["generation"] == [number for number in range(1, 5) for _ in range(6)]
    assert log["prey"] == [value for each in whole.generations for value in each.values[:, 1].tolist()]
    assert log["contests"][-1] == 4 * 2 * 6 * 3


KILLED = """
import sys, kiks
def report(coevolution):
    print(len(coevolution.generations), flush=True)
contest = kiks.tasks.pursuit(seconds=2.0)
coevolution = kiks.Coevolution(contest, population=6, opponents=3, seed=3, folder=sys.argv[1])
coevolution.run(generations=10**6, each=report)
"""


@at_length
def test_a_killed_coevolution_loses_at_most_the_current_generation(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        reported_count = [int(process.stdout.readline()) for _ in range(3)][-1]
        os.kill(process.pid, signal.SIGKILL)
    again = kiks.Coevolution(small(), population=6, opponents=3, seed=3, folder=tmp_path)
    count = len(again.generations)
    assert count >= reported_count
    again.run(generations=count + 1)
    whole = kiks.Coevolution(small(), population=6, opponents=3, seed=3)
    whole.run(generations=count + 1)
    assert bytes_of(again) == bytes_of(whole)


def test_a_folder_of_another_coevolution_is_an_error(tmp_path: Path) -> None:
    run(tmp_path)
    for given, message in (
        ({"seed": 4}, "the same seed, but they have 3 and 4"),
        ({"opponents": 4}, "they have 'ga, 3 opponents' and 'ga, 4 opponents'"),
        ({"contest": small(seconds=3.0)}, "but these differ: seconds"),
    ):
        options: dict[str, Any] = {"contest": small(), "seed": 3, "population": 6, "opponents": 3} | given
        with pytest.raises(ParameterError, match=message):
            kiks.Coevolution(**options, folder=tmp_path)
    file = tmp_path / "generations/000002.npz"
    with np.load(file) as saved:
        good = dict(saved)
    np.savez(file, **good | {"candidates": good["candidates"] + 1.0})
    with pytest.raises(ParameterError, match="must continue to the bit"):
        kiks.Coevolution(small(), seed=3, population=6, opponents=3, folder=tmp_path)
    file.write_bytes(b"nothing")
    with pytest.raises(ParameterError, match=r"000002.npz' must be a whole .npz file"):
        kiks.Coevolution(small(), seed=3, population=6, opponents=3, folder=tmp_path)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"contest": "pursuit"}, "contest must be"),
        ({"algorithm": "cna"}, "Did you mean 'cma'"),
        ({"algorithm": "map-elites"}, "must have axes"),
        ({"population": 3}, "population must be a whole number from 4"),
        ({"opponents": 0}, "opponents must be a whole number from 1"),
    ],
)
def test_wrong_arguments_are_errors(given: dict[str, Any], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        kiks.Coevolution(**{"contest": small()} | given)


def test_wrong_calls_are_errors() -> None:
    coevolution = kiks.Coevolution(small(), population=4, opponents=2)
    with pytest.raises(ParameterError, match="before there is a champion"):
        coevolution.champion("prey")
    with pytest.raises(ParameterError, match="before a tournament"):
        coevolution.master_tournament()
    with pytest.raises(ParameterError, match="neither was"):
        coevolution.run()
    with pytest.raises(ParameterError, match=r"values must be numbers of the shape \[16, 8\]"):
        coevolution.tell(np.zeros(16))
    coevolution.tell(np.zeros((16, 8)))
    with pytest.raises(ParameterError, match="side must be 0, 1 or one of predator, prey"):
        coevolution.champion("pray")
    with pytest.raises(ParameterError, match="generation must be a whole number from 1 to 1"):
        coevolution.champion("prey", 2)


# ---- tournament ----


def test_the_tournament_equals_a_loop_over_all_pairs() -> None:
    coevolution = run()
    tournament = coevolution.master_tournament(trials=2)
    square = latin_square(4, seed_for(3, _SQUARE_SEED))
    for first in range(4):
        for second in range(4):
            pair = [
                *coevolution.champion("predator", first + 1).parameters,
                *coevolution.champion("prey", second + 1).parameters,
            ]
            numbers = [4 * trial + square[first, second] for trial in range(2)]
            seeds = np.array([seed_for(3, TOURNAMENT_SEED, number) for number in numbers])
            values = coevolution.contest.evaluate(np.array([pair, pair]), seeds, 1)
            np.testing.assert_array_equal(tournament.scores[:, first, second], (values[0, :2] + values[1, :2]) / 2)
    np.testing.assert_array_equal(tournament.generations, [1, 2, 3, 4])
    some = coevolution.master_tournament(trials=2, every=2)
    np.testing.assert_array_equal(some.generations, [2, 4])
    assert some.scores.shape == (2, 2, 2)


def test_each_row_and_column_of_a_latin_square_holds_each_number_once() -> None:
    square = latin_square(7, 1)
    np.testing.assert_array_equal(np.sort(square, axis=0), np.tile(np.arange(7)[:, None], 7))
    np.testing.assert_array_equal(np.sort(square, axis=1), np.tile(np.arange(7), (7, 1)))


def test_a_tournament_knows_the_best_and_who_won(tmp_path: Path) -> None:
    from kiks.cli.coevolve import winners_of
    from kiks.learn.coevolution_plot import save_tournament_plot

    scores = np.array([[0.9, 0.2], [0.8, 0.3]])
    tournament = Tournament(("cat", "mouse"), np.array([1, 2]), np.stack([scores, 1 - scores]))
    np.testing.assert_allclose(tournament.means, [[0.55, 0.55], [0.15, 0.75]])
    assert tournament.best[1] == 2
    assert list(winners_of(tournament)) == [
        "Generation 1: cat 0.90   mouse 0.10   the cat won",
        "Generation 2: cat 0.30   mouse 0.70   the mouse won",
    ]
    save_tournament_plot(tournament, tmp_path / "tournament.png")
    assert (tmp_path / "tournament.png").read_bytes().startswith(b"\x89PNG")
    tournament.save(tmp_path / "tournament.parquet")
    table = parquet.read_table(tmp_path / "tournament.parquet").to_pydict()
    assert table["cat_generation"] == [1, 1, 2, 2]
    assert table["mouse_generation"] == [1, 2, 1, 2]
    assert table["cat"] == [0.9, 0.2, 0.8, 0.3]


def test_the_prey_is_twice_as_fast() -> None:
    predator, prey = kiks.tasks.pursuit().sides
    assert prey.controller.recipe is not None
    assert predator.controller.recipe is not None
    assert prey.controller.recipe["speed_limit"] == PREY_SPEED == 2 * predator.controller.recipe["speed_limit"]
