"""Finals: the best of the finalists wins, however it is evaluated, and a resumed evolution has the same champion."""

from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.at_length import cases
from tests.learn.small import refused, small

import kiks
from kiks.learn.algorithm_name import AlgorithmName
from kiks.learn.finals import FINALISTS, SHARE, Contender, halving_rounds, hold_finals
from kiks.learn.results import examined
from kiks.learn.seeds import FINALS, seed_for

pytestmark = pytest.mark.slow


def contenders(count: int) -> list[Contender]:
    return [Contender((float(number), 1.0), number + 1) for number in range(count)]


NEEDED: dict[str, Any] = {
    "nsga2": {"objectives": ("path_mm", "-contacts")},
    "neat": {"controller": kiks.controllers.graph(hidden=3)},
}
"""What a task must have for an algorithm."""


def evolution_of(algorithm: str = "cma", folder: Path | None = None, **given: Any) -> kiks.Evolution:
    task = small(exam=None, **NEEDED.get(algorithm, {}))
    return kiks.Evolution(task, algorithm, population=8, folder=folder, **{"seed": 3} | given)


def run(algorithm: str = "cma", folder: Path | None = None, generations: int = 6, **given: Any) -> kiks.Evolution:
    evolution = evolution_of(algorithm, folder)
    evolution.run(generations=generations, **given)
    return evolution


@cache
def whole() -> kiks.Evolution:
    """Return an evolution that never stopped."""
    return run()


def outcome(evolution: kiks.Evolution) -> tuple[Any, ...]:
    """Return all that finals decide, to the bit."""
    champion, finals = evolution.champion, evolution.finals
    told = finals.numbers.tobytes(), finals.seeds.tobytes(), finals.values.tobytes()
    return finals.finalists, told, champion.parameters, champion.fitness, champion.measures, champion.generation


def noisy(candidates: Any, seeds: Any, noise: float = 1.0) -> Any:
    """Return values: the first parameter with noise, which follows from it and the seed, and the parameter."""
    number = np.asarray(candidates)[:, 0]
    drawn = (np.asarray(seeds) % 1009 * (number + 1)) % 1009 / 504.5 - 1.0
    return np.column_stack([number + 2.0 * noise * drawn, number])


def slow_winner(count: int, evaluations: int, seed: int, noise: float) -> tuple[int, list[float]]:
    """Return the winner and its mean values: each finalist by itself, each world by itself, plain lists."""
    sizes = [count]
    while sizes[-1] > 2:
        sizes.append(-(-sizes[-1] // 2))
    each = 1
    while sum(size * (each + 1) * 2**turn for turn, size in enumerate(sizes)) <= int(SHARE * evaluations):
        each += 1
    left, seen, begin = list(range(count)), {number: [] for number in range(count)}, 0
    for turn in range(len(sizes)):
        for number in left:
            for world in range(begin, begin + each * 2**turn):
                world_seed = seed_for(seed, FINALS, world)
                seen[number].append(noisy(np.array([[float(number), 1.0]]), [world_seed], noise)[0])
        begin += each * 2**turn
        ranked = sorted(left, key=lambda number: (-np.mean([values[0] for values in seen[number]]), number))
        left = ranked[: -(-len(left) // 2)]
    (winner,) = left
    return winner, np.mean(seen[winner], axis=0).tolist()


@given(st.integers(2, 40), st.integers(0, 2000), st.integers(0, 99), st.sampled_from([0.0, 1.0, 10.0]))
def test_the_winner_is_that_of_a_slow_count(count: int, evaluations: int, seed: int, noise: float) -> None:
    finals = hold_finals(contenders(count), seed, evaluations, partial(noisy, noise=noise))
    winner, means = slow_winner(count, evaluations, seed, noise)
    assert finals.winner == winner
    assert finals.means(winner).tolist() == pytest.approx(means)
    sizes, worlds = halving_rounds(count, evaluations)
    driven = sum(size * each for size, each in zip(sizes, worlds, strict=True))
    assert driven == len(finals.values) <= max(SHARE * evaluations, sum(sizes) * 2 ** len(sizes))


def test_each_finalist_is_there_once_and_the_first_of_equal_ones_wins() -> None:
    assert halving_rounds(16, 2880) == ([16, 8, 4, 2], [4, 8, 16, 32])
    assert hold_finals(contenders(7), 1, 0, lambda asked, _: np.zeros((len(asked), 1))).winner == 0
    evolution = evolution_of()
    evolution._trials.fitness = {Contender((float(number // 2),), number): -number for number in range(60)}
    assert [each.generation for each in evolution._finalists()] == [*range(0, 2 * FINALISTS, 2)]


class Scripted(Executor):
    """Evaluates by a function of candidates and seeds."""

    def __init__(self, function: Any) -> None:
        self.function = function

    def submit(self, evaluate: Any, task: Any, identity: Any, candidates: Any, seeds: Any) -> Any:
        future: Future[Any] = Future()
        future.set_result(self.function(candidates, seeds))
        return future


def never(*_: Any) -> Any:
    raise AssertionError("nothing is to be evaluated")


class Numbered:
    """Proposes candidates whose parameters are all the number of their generation."""

    generation = 0

    def ask(self) -> Any:
        return np.full((4, 18), float(self.generation))

    def tell(self, fitness: Any, behaviours: Any) -> None:
        self.generation += 1


def test_a_rival_that_was_lucky_in_its_trials_loses() -> None:
    evolution = kiks.Evolution(small(), Numbered(), seed=1)
    trials, best, lucky = set(evolution._trials.seeds), 17, 4
    width = len(evolution.task.value_names)

    def values(candidates: Any, seeds: Any) -> Any:
        number, is_trial = candidates[:, 0], np.isin(seeds, list(trials))
        noise = np.array([np.random.default_rng(int(seed)).standard_normal() for seed in seeds])
        luck = 100.0 * (is_trial & (number == lucky))
        return np.tile((luck + noise - np.abs(number - best))[:, None], width)

    before = []
    with Scripted(values) as executor:
        evolution.run(generations=30, executor=executor, each=lambda each: before.append(each.champion))
    assert before[-1].parameters[0] == lucky
    assert evolution.champion.parameters[0] == best
    assert evolution.champion.generation == best + 1
    assert before[-1].fitness > 50 > evolution.champion.fitness
    finals = evolution.finals
    numbers, seeds, told = finals.numbers, finals.seeds, finals.values
    assert evolution.champion.fitness == told[numbers == finals.winner, 0].mean()
    assert not trials & set(seeds.tolist())
    assert not {seed for each in evolution.generations for seed in each.seeds.tolist()} & set(seeds.tolist())


def test_chunks_and_batches_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    other = evolution_of(seed=4)
    other.run(generations=6)
    assert outcome(other) != outcome(whole())
    assert outcome(run(executor=ThreadPoolExecutor(2))) == outcome(whole())
    monkeypatch.setattr("kiks.learn.task.BATCH_WORLDS_MAX", 6)
    assert outcome(run()) == outcome(whole())


@pytest.mark.parametrize("algorithm", cases(AlgorithmName))
def test_a_continued_evolution_holds_finals_at_its_new_end(algorithm: str, tmp_path: Path) -> None:
    np.random.seed(1)
    whole = run(algorithm, tmp_path / "whole")
    np.random.seed(2)
    early = run(algorithm, tmp_path / "part", 4)
    assert early.finals.finalists != whole.finals.finalists
    assert len(early.finals.finalists) <= len(whole.finals.finalists)
    rest = run(algorithm, tmp_path / "part")
    early.run(generations=6)
    assert outcome(rest) == outcome(early) == outcome(whole)
    for one, two in zip(whole.generations, rest.generations, strict=True):
        np.testing.assert_array_equal(one.candidates, two.candidates)
        np.testing.assert_array_equal(one.values, two.values)
    for name in ("champion.toml", "archive.parquet"):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "part" / name).read_bytes()
    assert kiks.Champion.load(tmp_path / "part/champion.toml").fitness == whole.champion.fitness


def test_the_finals_of_a_complete_folder_are_not_held_again(tmp_path: Path) -> None:
    whole = run("map-elites", tmp_path)
    again = evolution_of("map-elites", tmp_path)
    assert outcome(again) == outcome(whole)
    with Scripted(never) as executor:
        again.run(generations=6, executor=executor, each_round=never)
    assert outcome(again) == outcome(whole)
    assert examined(again).seconds == whole.finals.seconds


@pytest.mark.parametrize("when", cases(["each", "each_round"]))
def test_an_interrupted_evolution_holds_no_finals(when: str, tmp_path: Path) -> None:
    def interrupt(state: Any, *_: Any) -> None:
        if when == "each_round" or len(state.generations) == 5:
            raise KeyboardInterrupt

    evolution = evolution_of(folder=tmp_path)
    with pytest.raises(KeyboardInterrupt):
        evolution.run(generations=6, **{when: interrupt})
    assert evolution.finals is None
    assert not list(tmp_path.glob("generations/*finals*"))
    best = evolution.generations[-1].champion_fitness
    assert evolution.champion.fitness == kiks.Champion.load(tmp_path / "champion.toml").fitness == best
    assert outcome(run(folder=tmp_path)) == outcome(whole())


def test_elites_take_part_where_an_algorithm_prefers_none() -> None:
    evolution = evolution_of("map-elites", seed=2)
    rng = np.random.default_rng(1)
    for _ in range(5):
        evolution.tell(rng.uniform(0, 1, (len(evolution.ask()), len(evolution.task.value_names))))
    elites = evolution.archive.best_first()
    tried = {tuple(each.candidates[-1].tolist()) for each in evolution.generations[1:]}
    chosen = next(elite for elite in elites if elite.parameters not in tried)
    width = len(evolution.task.value_names)
    with Scripted(lambda found, _: np.tile((found == chosen.parameters).all(axis=1)[:, None], width) * 1.0) as executor:
        champion = evolution.hold_finals(executor)
    assert (champion.parameters, champion.fitness, champion.generation) == (chosen.parameters, 1.0, chosen.generation)
    finalists = {each.parameters for each in evolution.finals.finalists}
    assert finalists == tried | {elite.parameters for elite in elites[:FINALISTS]}
    others = {each.parameters for each in whole().finals.finalists}
    assert not others & {each.parameters for each in whole().archive.elites}


def test_finals_after_ask_and_tell_and_none_for_one_rival_alone() -> None:
    evolution = evolution_of()
    refused("before there is a champion", evolution.hold_finals)
    for _ in range(6):
        evolution.tell(evolution.task.evaluate(evolution.ask(), evolution.seeds))
    rounds: list[int] = []
    champion = evolution.hold_finals(each_round=lambda number, sizes: rounds.append(sizes[number]))
    assert rounds == halving_rounds(len(evolution.finals.finalists), 0)[0]
    assert champion.parameters == evolution.champion.parameters == whole().champion.parameters
    evolution.tell(np.zeros(len(evolution.ask())))
    assert evolution.finals is None
    assert evolution.champion.fitness == evolution.generations[-1].champion_fitness
    evolution = run(generations=2, each_round=never)
    assert evolution.finals is None
    assert evolution.champion.fitness == evolution.generations[-1].champion_fitness


def test_the_error_names_a_broken_file_of_finals(tmp_path: Path) -> None:
    run(folder=tmp_path)
    file = tmp_path / "generations/000006_finals.npz"
    with np.load(file) as saved:
        good = dict(saved)
    assert good["seed"].tolist() == whole().finals.seeds.tolist()
    again = small().evaluate(good["finalists"][good["finalist"]], good["seed"], 1)
    assert again.tolist() == good["values"].tolist()
    wrong = [{name: good[name][:-1]} for name in ("values", "finalists")]
    wrong += [{"values": good["values"] * np.nan}, {"seconds": -1.0}, {"finalist": good["finalist"] + 1}]
    for change in wrong:
        np.savez(file, **good | change)
        refused(rf"000006_finals.npz': {next(iter(change))} .* are held again", evolution_of, folder=tmp_path)
    np.savez(file, **good | {"finalists": good["finalists"] + 1})
    refused("must have the finalists of this evolution, but has others", evolution_of, folder=tmp_path)
    for data in (b"", b"nothing", file.read_bytes()[:-30]):
        file.write_bytes(data)
        refused(r"Finals '.*000006_finals.npz' must be a whole .npz file", evolution_of, folder=tmp_path)
    file.unlink()
    assert outcome(run(folder=tmp_path)) == outcome(whole())
