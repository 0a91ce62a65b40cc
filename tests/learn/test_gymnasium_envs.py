"""Environments pass the checks of Gymnasium, and have the same episodes with the same seeds."""

import copy
import importlib
import pickle
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import forked
from tests.at_length import cases
from tests.learn.small import refused

import kiks
from kiks.learn.environments import ENVIRONMENTS, LIT_ROOMS, without_contacts

pytestmark = pytest.mark.slow


@kiks.measure
def arrived(moment: Any, notes: Any) -> None:
    notes[0] = 1.0 if moment.path_mm > 40.0 else 0.0


def small_task() -> kiks.Task:
    """Return a small environment that ends when the robot has driven 40 mm."""
    path_mm, room = kiks.measures.path_mm, kiks.Arena.box(400, 300)
    return kiks.Task("go", (room,), kiks.controllers.linear(), (path_mm,), reward=path_mm, until=arrived)


def single(task: Any = "Avoid", **options: Any) -> Any:
    from kiks.learn.gymnasium_envs import KheperaEnv

    return KheperaEnv(task, **options)


def vector(count: int = 3, task: Any = "Avoid", **options: Any) -> Any:
    from kiks.learn.gymnasium_envs import KheperaVectorEnv

    return KheperaVectorEnv(count, task, **options)


def team(task: Any = "Avoid", **options: Any) -> Any:
    from kiks.learn.pettingzoo_env import KheperaTeam

    return KheperaTeam(task, **options)


def registered(name: str, **options: Any) -> Any:
    import gymnasium

    importlib.import_module("kiks.learn.gymnasium_envs")
    return (gymnasium.make_vec if "num_envs" in options else gymnasium.make)(name, **options)


def begun(env: Any, seed: int = 1) -> Any:
    env.reset(seed=seed)
    return env


def random_actions(*shape: int) -> Any:
    return np.random.default_rng(5).uniform(-1, 1, (*shape, 2)).astype(np.float32)


@pytest.mark.parametrize("name", ENVIRONMENTS)
@pytest.mark.filterwarnings("error")
def test_environments_pass_the_checks_of_gymnasium(name: str) -> None:
    from gymnasium.utils.env_checker import check_env

    env = registered(f"kiks/{name}-v0", render_mode="rgb_array")
    timing = env.unwrapped.episodes.task.timings[0]
    assert env.spec.max_episode_steps * timing.period_s == pytest.approx(60.0)
    assert env.get_wrapper_attr("metadata")["render_fps"] == 1.0 / timing.period_s
    check_env(env.unwrapped)


def test_a_module_in_the_name_registers_the_environments_and_kiks_alone_imports_no_gymnasium() -> None:
    code = "import gymnasium; print(gymnasium.make('kiks.learn.gymnasium_envs:kiks/Avoid-v0').unwrapped)"
    found = forked.run(code=code)
    assert "KheperaEnv" in found.stdout, found.stderr
    code = "import sys, kiks; assert not {'gymnasium', 'pettingzoo', 'numba'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(("missing", "module"), [("gymnasium", "gymnasium_envs"), ("pettingzoo", "pettingzoo_env")])
def test_the_error_names_a_missing_package(missing: str, module: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    monkeypatch.delitem(sys.modules, f"kiks.learn.{module}", raising=False)
    with pytest.raises(Exception, match=r"pip install 'kiks\[learn\]'"):
        importlib.import_module(f"kiks.learn.{module}")


@pytest.mark.parametrize("name", cases(["Avoid", "Maze", "Follow", "Light", "Gather", "Football"], 2))
def test_single_and_vector_environments_have_the_same_episodes(name: str) -> None:
    many = registered(f"kiks/{name}-v0", num_envs=9, max_episode_steps=7, threads=2)
    assert type(many).__name__ == "KheperaVectorEnv"
    one, world = registered(f"kiks/{name}-v0", max_episode_steps=7), 4
    seen, _ = many.reset(seed=10)
    for other in range(9):
        np.testing.assert_array_equal(one.reset(seed=10 + other)[0], seen[other])
    expected, _ = one.reset(seed=10 + world)
    is_done = False
    for action in random_actions(24, 9):
        np.testing.assert_array_equal(seen[world], expected)
        seen, rewards, terminations, truncations, infos = many.step(action)
        if is_done:  # the step in which the vector environment resets this world
            expected, _ = one.reset()
            is_done = False
            assert rewards[world] == 0.0
            continue
        expected, reward, terminated, truncated, info = one.step(action[world])
        assert (reward, terminated, truncated) == (rewards[world], terminations[world], truncations[world])
        assert info == {key: infos[key][world] for key in info}
        assert all(infos[f"_{key}"].all() for key in info)
        is_done = truncated
    hashes = [env.unwrapped.episodes.batch.state_hash(k) for env, k in ((many, world), (one, 0))]
    assert hashes[0] == hashes[1]


def test_reset_with_a_seed_repeats_an_episode_and_worlds_have_different_ones_or_those_of_a_list() -> None:
    env = single()

    def episode(seed: int | None) -> list[float]:
        seen, _ = env.reset(seed=seed)
        return [*seen.tolist(), *env.step(np.ones(2, np.float32))[0].tolist(), *env.episodes.batch.poses[0, 0]]

    first, second = episode(7), episode(None)
    assert first != second
    assert [episode(7), episode(None)] == [first, second]
    assert episode(8) != first
    envs = vector()
    envs.reset(seed=[4, 9, 4])
    one, two, three = (envs.episodes.batch.poses[k].tolist() for k in range(3))
    assert one == three != two
    envs.reset(seed=3)
    assert envs.episodes.batch.poses[1].tolist() == one


def test_a_world_that_has_ended_resets_in_the_next_step() -> None:
    envs = begun(vector(2, small_task()))
    assert envs.metadata["autoreset_mode"].name == "NEXT_STEP"
    actions = np.array([[1, 1], [0, 0]], np.float32)
    for _ in range(20):
        _, rewards, terminations, truncations, infos = envs.step(actions)
        if terminations.any():
            break
    assert terminations.tolist() == [True, False]
    assert not truncations.any()
    assert rewards[0] > 0.0
    assert infos["path_mm"][0] > 40.0
    seen, rewards, terminations, _, infos = envs.step(actions)
    assert rewards[0] == 0.0
    assert not terminations.any()
    assert infos["path_mm"][0] == infos["time_s"][0] == 0.0
    assert infos["time_s"][1] > 0.0
    assert seen in envs.observation_space


def test_each_episode_draws_one_of_the_arenas_with_its_lamps() -> None:
    dark = kiks.Arena.box(400, 300)
    lit, bright = (replace(dark, lamps=((200, 150, 9.0), (150, 150, 9.0))[:count]) for count in (1, 2))
    arenas = dark, lit, bright
    for each in (begun(single(arenas=arenas)), begun(vector(30, arenas=arenas))):
        met = set()
        for _ in range(30):
            batch = each.episodes.batch
            for world, arena in enumerate(batch.arena_indices.tolist()):
                assert np.count_nonzero(batch.lamps[world, :, 2]) == arena
                met.add(arena)
            each.reset()
        assert met == {0, 1, 2}


def test_the_action_of_a_world_that_resets_is_ignored() -> None:
    one, other = (begun(vector(2, max_episode_steps=1)) for _ in range(2))
    for envs in (one, other):
        envs.step(np.zeros((2, 2), np.float32))
    seen = [one.step(np.zeros((2, 2), np.float32)), other.step(np.array([[1.5, np.nan], [np.inf, 0]], np.float32))]
    np.testing.assert_array_equal(seen[0][0], seen[1][0])
    assert one.episodes.batch.state_hash(1) == other.episodes.batch.state_hash(1)
    refused(r"from -1 to 1, but among them was 1\.5", one.step, np.full((2, 2), 1.5, np.float32))


def test_wrappers_of_gymnasium_accept_the_vector_environment() -> None:
    from gymnasium.wrappers.vector import RecordEpisodeStatistics

    envs = begun(RecordEpisodeStatistics(registered("kiks/Avoid-v0", num_envs=2, max_episode_steps=3)))
    for _ in range(3):
        *_, infos = envs.step(envs.action_space.sample())
    assert infos["episode"]["l"].tolist() == [3, 3]


def test_the_sum_of_rewards_is_the_measure_and_a_contact_lowers_it() -> None:
    envs = begun(vector(4, threads=1), 2)
    total = sum(envs.step(action)[1] for action in random_actions(12, 4))
    np.testing.assert_allclose(total / 12, envs.episodes.batch.values[:, 0, 0])
    free, costly = (single(reward=without_contacts(kiks.measures.path_mm, cost)) for cost in (0.0, 7.0))
    totals = []
    for env in (begun(free), begun(costly)):
        steps = [env.step(np.ones(2, np.float32)) for _ in range(60)]
        totals.append(sum(reward for _, reward, *_ in steps))
    contacts = steps[-1][4]["contacts"]
    assert contacts > 0.0
    assert totals[0] - totals[1] == pytest.approx(7.0 * contacts)
    assert without_contacts(kiks.measures.path_mm, 7.0) is costly.episodes.task.reward


def test_the_page_says_what_environments_are() -> None:
    page = (Path(__file__).parents[2] / "docs" / "howto" / "learning.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1:-1] for line in page.splitlines() if line.startswith("| `kiks/")]
    assert [row[0].strip() for row in rows] == [f"`kiks/{name}-v0`" for name in ENVIRONMENTS]
    others = []
    for usual in (r"0\.1 s", "10 pulses"):  # with those that differ behind a semicolon
        (words,) = re.findall(rf"\({usual}[^;)]*; ([^)]*)\)", page)
        others.append({name: float(number) for number, name in re.findall(r"([\d.]+)(?: s)? in\s+`(\w+)`", words)})
    for (name, make), row in zip(ENVIRONMENTS.items(), rows, strict=True):
        task = make()
        assert row[3].strip() == ", ".join(map(str, task.controller.senses))
        assert bool(row[4].strip()) == (task.until is not None)
        assert others[0].get(name, 0.1) == task.timings[0].period_s
        assert others[1].get(name, 10.0) == task.speed_limit
    assert (LIT_ROOMS, "eighteen random rooms" in page) == (18, True)


def test_arguments_change_timing_and_response() -> None:
    env = begun(single(timing=kiks.Timing(0.05, None), response="fast"))
    assert env.step(np.zeros(2, np.float32))[4]["time_s"] == 0.05
    slow = begun(single(timing=kiks.Timing(0.0, 9600)))
    assert 0.03 < slow.step(np.zeros(2, np.float32))[4]["time_s"] < 0.09


def test_wrong_arguments_are_errors() -> None:
    refused("in all worlds, but it was given a reset_mask", vector().reset, options={"reset_mask": np.array([True])})
    gripping, path_mm, still = kiks.tasks.nolfi_1997(), kiks.measures.path_mm, np.zeros(2, np.float32)
    refused("Did you mean 'Avoid'", single, "Avoit")
    refused("Did you mean 'arenas'", single, arena=1)
    refused("rgb_array", single, render_mode="human")
    refused("must be a task of one side with a reward, but 'avoid' is not", single, kiks.tasks.avoid())
    words = "must command wheels alone, but that of 'nolfi_1997.*' commands arm and jaws"
    refused(words, single, gripping.with_changes(reward=gripping.measures[0]))
    refused("starts must be", single, starts="here")
    refused("must be a kiks.Measure", single, reward=3)
    refused("cost must be at least 0, but it was -1", without_contacts, path_mm, -1)
    refused("reward must be a kiks.Measure", without_contacts, print)
    refused("reset", single().step, still)
    refused("from -1 to 1, but among them was 1.5", begun(single()).step, np.array([0.0, 1.5]))
    refused("from -1 to 1, but among them was nan", begun(single()).step, np.array([0.0, np.nan]))
    for action in (np.zeros(3), np.zeros((1, 2)), "ahead", [None, 1.0], [[0.0], [1.0, 2.0]]):
        refused(r"the action must be numbers of the shape \(2,\), .* was given", begun(single()).step, action)
    refused(r"the actions must be numbers of the shape \(3, 2\)", begun(vector()).step, np.zeros((2, 2)))
    both = {"robot_1": still, "robot_2": np.zeros(1)}
    refused(r"action of robot_2 must be numbers of the shape \(2,\)", begun(team(robots=2)).step, both)
    for name, value in (("seconds", 9), ("fitness", None), ("measures", [path_mm]), ("robots", 2), ("worlds", 4)):
        refused(f"must be some of arenas, .*, but {name} was among them", single, **{name: value})
    pair = small_task().with_changes(robots=2)
    refused("must have one robot, but has 2. KheperaTeam", single, pair)
    assert (len(team(pair).possible_agents), len(team().possible_agents)) == (2, 3)
    timings = [kiks.Timing(), kiks.Timing(0.05)]
    more: Any
    for more in ({"timing": timings}, {"robot": ["khepera", "khepera_ii"]}):
        refused("must have one timing and one kind of robot, but 'go' has more", single, small_task(), **more)
    refused("reset", vector().step, np.zeros((3, 2), np.float32))
    refused("room for 40 robots", team(robots=40, arenas=kiks.Arena.box(500, 500)).reset, seed=1)
    refused("one for each of 3 worlds", vector().reset, seed=[1])


def test_pictures_show_the_robot() -> None:
    env = begun(single(render_mode="rgb_array"))
    before = env.render()
    for _ in range(5):
        env.step(np.ones(2, np.float32))
    assert before.shape == (480, 480, 3)
    assert (env.render() != before).any()
    pictures = begun(vector(2, render_mode="rgb_array")).render()
    np.testing.assert_array_equal(pictures[0], before)


def test_a_team_of_one_has_the_episodes_of_the_single_environment_and_those_of_all_robots_end_at_once() -> None:
    alone, env = team(robots=1), single()
    seen, _ = alone.reset(seed=3)
    expected, _ = env.reset(seed=3)
    for action in random_actions(5, 1)[:, 0]:
        np.testing.assert_array_equal(seen["robot_1"], expected)
        seen, rewards, *_, infos = alone.step({"robot_1": action})
        expected, reward, *_, info = env.step(action)
        assert (rewards["robot_1"], infos["robot_1"]) == (reward, info)
    pair = begun(team(small_task(), robots=2))
    actions = {"robot_1": np.ones(2, np.float32), "robot_2": np.zeros(2, np.float32)}
    for _ in range(20):
        _, rewards, terminations, truncations, _ = pair.step(actions)
        if not pair.agents:
            break
    assert terminations == {"robot_1": True, "robot_2": True}
    assert truncations == {"robot_1": False, "robot_2": False}
    assert rewards["robot_1"] > rewards["robot_2"]
    refused("the episode is over", pair.step, actions)


@pytest.mark.parametrize(
    "made",
    [
        lambda: registered("kiks/Follow-v0"),
        lambda: registered("kiks/Avoid-v0", num_envs=5),
        lambda: team("Gather", robots=2),
        lambda: single(small_task()),
    ],
    ids=["single", "vector", "team", "measures of a user"],
)
def test_a_copy_of_an_environment_goes_on_as_it_does(made: Any) -> None:
    def steps(env: Any, count: int) -> list[Any]:
        seen = []
        for number in range(count):
            if hasattr(env, "agents"):
                actions: Any = {name: np.full(2, 0.1 * number, np.float32) for name in env.agents}
            else:
                actions = np.full(env.action_space.shape, 0.1 * number, np.float32)
            seen.append(env.step(actions))
        return [*seen, env.reset()]

    env = begun(made(), 3)
    steps(env, 3)
    twins = copy.deepcopy(env), pickle.loads(pickle.dumps(env))
    expected = steps(env, 5)
    for twin in twins:
        for one, other in zip(expected, steps(twin, 5), strict=True):
            np.testing.assert_equal(other, one)
