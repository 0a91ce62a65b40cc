"""Algorithms and their options: deterministic, resumed by telling, better with time; what cannot be is refused."""

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.at_length import share
from tests.learn.small import refused, small

import kiks
from kiks.learn.algorithm import Setting
from kiks.learn.algorithm_name import AlgorithmName, parse_algorithm
from kiks.learn.algorithms import make_algorithm, whole_name
from kiks.learn.evolution import first_front

pytestmark = pytest.mark.slow

GRAPH = kiks.controllers.graph(hidden=3)
AXES = kiks.Axis("path_mm", -3, 3), kiks.Axis("straightness", -3, 3)

VARIANTS = [
    *(str(name) for name in AlgorithmName),
    "cma:separable=true,restarts=bipop",
    "cma:active=false,restarts=ipop",
    "cma:starts=3,race=2",
    "ga:mutation=0.2,rivals=5",
    "sga:bits=0,selection=roulette,crossover=0.1,mutation=0.2",
    "neat:add_neuron=0.4",
    "map-elites:cells=30",
]


def made(text: str, *, seed: int = 1, population: int = 20, count: int | None = None) -> Any:
    count = count or ((GRAPH.parameter_count or 0) if text.startswith("neat") else 6)
    return make_algorithm(text, Setting(count, population, seed, AXES, 1.0, ("path_mm", "-contacts"), GRAPH))


def told(algorithm: Any, generations: int) -> list[NDArray[np.float64]]:
    """Let candidates come near to a point in the middle of nowhere, and return them."""
    asked = []
    for _ in range(generations):
        candidates = algorithm.ask()
        asked.append(candidates)
        fitness = -((candidates - 0.5) ** 2).mean(axis=1)
        behaviours = np.column_stack([candidates[:, :2], -np.abs(candidates - 0.5).mean(axis=1), fitness])
        algorithm.tell(fitness, behaviours)
    return asked


@pytest.mark.parametrize("text", VARIANTS)
def test_the_same_seed_proposes_the_same_and_the_process_keeps_its_random_numbers(text: str) -> None:
    told(made(text), 1)  # what libraries do when they are imported
    before = random.getstate()
    first = told(made(text), 6)
    assert random.getstate() == before
    random.seed(6)
    assert all((one == other).all() for one, other in zip(first, told(made(text), 6), strict=True))
    assert any((one != other).any() for one, other in zip(first, told(made(text, seed=2), 6), strict=True))
    assert len({each.shape for each in first}) == 1


SEEKERS = [text for text in VARIANTS if parse_algorithm(text)[0] not in ("cma-me", "novelty")]


@pytest.mark.parametrize("text", SEEKERS)
def test_candidates_improve(text: str) -> None:
    best = [-((each - 0.5) ** 2).mean(axis=1).max() for each in told(made(text), 40)]
    assert max(best[2:]) > max(best[:2])
    if not text.startswith(("map-elites", "sga:bits=0")):  # which go on to try the worst cells, or nearly anything
        assert max(best[-5:]) > 0.6 * best[0]


def test_strategies_that_begin_again_fill_whole_generations() -> None:
    algorithm = made("cma:restarts=bipop", count=2, population=6)
    sizes = []
    for _ in range(400):
        candidates = algorithm.ask()
        assert candidates.shape == (6, 2)
        algorithm.tell(-((candidates - 0.5) ** 2).sum(axis=1), np.zeros((6, 0)))
        sizes.append(algorithm._strategy.popsize)
    assert {6, 12} <= set(sizes)
    assert all(size % 6 == 0 for size in sizes)


def hills(candidates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of candidates: a wide hill at -3, of height 1, and a narrow one at 3, of height 2."""
    height: NDArray[np.float64] = np.maximum(
        np.exp(-((candidates + 3.0) ** 2).sum(axis=1) / 20.0),
        2.0 * np.exp(-((candidates - 3.0) ** 2).sum(axis=1) / 8.0),
    )
    return height


def test_the_best_of_several_strategies_goes_on() -> None:
    def final(text: str, seed: int) -> float:
        algorithm = made(text, seed=seed, count=2)
        for _ in range(60):
            candidates = algorithm.ask()
            algorithm.tell(hills(candidates), np.zeros((len(candidates), 0)))
        return float(hills(algorithm.favourite()[None])[0])

    count = share(7, 20)
    alone, racing = ([final(text, seed) > 1.5 for seed in range(count)] for text in ("cma", "cma:starts=6,race=5"))
    assert 0 < sum(alone) < sum(racing)
    assert sum(racing) >= 0.9 * count


def test_strategies_of_a_race_take_turns_until_the_best_goes_on() -> None:
    algorithm = made("cma:starts=3,race=4", count=2)
    asked = []
    for generation in range(16):
        candidates = algorithm.ask()
        asked.append(id(strategy := algorithm._strategy))
        algorithm.tell(np.full(len(candidates), float(generation % 3 == 1)), np.zeros((len(candidates), 0)))
        assert np.array_equal(algorithm.favourite(), strategy.mean)  # of the one that has just learned
    assert asked[:12] == asked[:3] * 4
    assert len(set(asked)) == 3
    assert set(asked[12:]) == {asked[1]}


@pytest.mark.parametrize("bits", [1, 5, 8])
def test_parameters_in_bits_lie_on_a_scale_between_the_limits(bits: int) -> None:
    for candidates in told(made(f"sga:bits={bits},limit=4,mutation=0.2", count=3), 4):
        steps = (candidates + 4.0) / (8.0 / (2**bits - 1))
        assert np.allclose(steps, steps.round())
        assert np.abs(candidates).max() <= 4.0


def test_the_best_fifth_has_five_children_each_and_with_the_roulette_the_worst_none() -> None:
    algorithm = made("sga:crossover=0,mutation=0", count=8)
    candidates, fitness = algorithm.ask(), np.arange(20.0)
    algorithm.tell(fitness, np.zeros((20, 0)))
    children = algorithm.ask()
    best = {tuple(each) for each in candidates[-4:].tolist()}
    counts = {parent: sum(tuple(child) == parent for child in children.tolist()) for parent in best}
    assert set(counts.values()) == {5}
    algorithm = made("sga:bits=8,selection=roulette,crossover=0,mutation=0", count=8, population=4000)
    candidates, fitness = algorithm.ask(), np.repeat([0.0, 1.0], 2000)
    algorithm.tell(fitness, np.zeros((4000, 0)))
    worst = {tuple(each) for each in candidates[:2000].tolist()}
    assert not any(tuple(child) in worst for child in algorithm.ask().tolist())


def test_the_front_is_what_no_other_surpasses_and_nsga2_finds_that_of_two_parabolas() -> None:
    # Schaffer's problem: x^2 and (x - 2)^2 are both small between 0 and 2 only, where their roots add up to 2.
    algorithm = made("nsga2", count=1, population=40)
    for _ in range(40):
        x = algorithm.ask()[:, 0]
        costs = np.column_stack([x**2, (x - 2) ** 2])
        algorithm.tell(-costs[:, 0], np.column_stack([x, x, -costs]))
    front = costs[first_front(-costs)]
    assert np.allclose(np.sqrt(front).sum(axis=1), 2.0, atol=0.01)
    assert len(front) > 20
    assert front[:, 0].max() > 3.0 and front[:, 1].max() > 3.0  # noqa: PT018
    rng = np.random.default_rng(1)
    for count in (1, 7, 60):
        points = rng.integers(0, 6, (count, 3)).astype(float)
        front = first_front(points)
        slow = [
            k
            for k, one in enumerate(points)
            if not any((other >= one).all() and (other > one).any() for other in points)
            and not any((points[before] == one).all() for before in range(k))
        ]
        assert sorted(front.tolist()) == slow
        assert (np.diff(points[front, 0]) <= 0).all()


def test_the_front_of_an_evolution_is_made_of_champions_of_its_last_generation(tmp_path: Path) -> None:
    task = small(objectives=("path_mm", "-contacts"))
    evolution = kiks.Evolution(task, "nsga2", seed=1, population=8, folder=tmp_path)
    evolution.run(generations=2)
    last = evolution.generations[-1].candidates[:8].tolist()
    front = evolution.front
    assert front
    assert all(list(each.parameters) in last and each.generation == 2 for each in front)
    again = kiks.Evolution(task, "nsga2", seed=1, population=8, folder=tmp_path)
    assert [each.measures for each in again.front] == [each.measures for each in front]
    from kiks.learn.plots import figure_of_evolution, save_plot

    save_plot(figure_of_evolution(again), tmp_path / "front.png")
    assert (tmp_path / "front.png").read_bytes().startswith(b"\x89PNG")


def test_the_parameters_of_a_graph_drive_as_the_network_of_the_library_does() -> None:
    import math

    import neat

    algorithm = made("neat:add_neuron=0.5,add_connection=0.5", population=30)
    told(algorithm, 12)
    config = algorithm._population.config
    config.genome_config.add_activation("plain", lambda z: math.tanh(z))
    hidden_counts = set()
    for genome in list(algorithm._population.population.values())[:6]:
        for node in genome.nodes.values():
            node.activation = "plain"
        hidden_counts.add(len(genome.nodes) - 2)
        network = neat.nn.RecurrentNetwork.create(genome, config)
        parameters, memory = algorithm._parameters(genome), np.zeros(GRAPH.memory_count)
        rng, wheels = np.random.default_rng(1), np.zeros(2)
        for _ in range(5):
            counts = rng.integers(0, 1024, 8).astype(float)
            GRAPH(counts, memory, parameters, wheels)
            assert np.allclose(network.activate((counts / 1023).tolist()), wheels / 10, atol=1e-3)
    assert max(hidden_counts) == 3


def test_the_name_of_an_algorithm_has_the_options_that_differ_from_the_usual_ones() -> None:
    assert whole_name("cma:active=true,restarts=none") == "cma"
    assert whole_name("sga: mutation = 0.02 ,bits=8, crossover=0") == "sga:bits=8,crossover=0.0,mutation=0.02"
    assert whole_name(whole_name("sga:bits=8,crossover=0")) == "sga:bits=8,crossover=0.0"


def test_wrong_options_and_tasks_are_refused_in_one_line() -> None:
    for text, message in (
        ("cma:restart=ipop", "algorithm cma: Options must have known keys only, but it has 'restart'.*'restarts'"),
        ("cma:restarts=often", "algorithm cma: restarts must be 'none', 'ipop' or 'bipop', but it was 'often'"),
        ("cma:separable=1", "separable must be true or false"),
        ("sga:bits=40", "bits must be at most 32, but it was 40"),
        ("sga:bits", "must be like 'cma:separable=true,restarts=ipop'"),
        ("sga:", "must be like"),
        ("sga:bits=5,bits=6", "each once"),
        ("novelty:cells=9", "known keys only"),
        ("nsga2", "at least two objectives for nsga2, but it has 0"),
        ("neat", "must be a graph for neat, but it was linear"),
    ):
        refused(message, kiks.Evolution, small(), text)
    refused("an objective must name one of fitness, ", small, objectives=("path",))
    refused("must be one of cma, ga", small, algorithm="cm")
    refused("at least two objectives", lambda: kiks.Evolution(small(), "ga", population=8).front)


def test_an_evolution_with_other_options_is_another_one(tmp_path: Path) -> None:
    evolution = kiks.Evolution(small(), "sga:bits=8", seed=1, population=8, folder=tmp_path)
    evolution.run(generations=2)
    words = "same algorithm, but they have 'sga:bits=8' and 'sga'"
    refused(words, kiks.Evolution, small(), "sga", seed=1, population=8, folder=tmp_path)
    again = kiks.Evolution(small(), "sga:limit=10,bits=8", seed=1, population=8, folder=tmp_path)
    assert (again.ask() == evolution.ask()).all()
