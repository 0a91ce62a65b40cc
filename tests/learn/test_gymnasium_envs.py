"""Environments pass the checks of Gymnasium, and have the same episodes with the same seeds."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from dataclasses import replace
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import kiks
import kiks.learn.gymnasium_envs
from kiks.errors import ParameterError
from kiks.learn.environments import ENVIRONMENTS, without_contacts
from kiks.learn.gymnasium_envs import KheperaEnv, KheperaVectorEnv
from kiks.learn.pettingzoo_env import KheperaTeam

pytestmark = pytest.mark.slow

IDS = [f"kiks/{name}-v0" for name in ENVIRONMENTS]


def small_task(**changes: Any) -> kiks.Task:
    """Return a small environment that ends when the robot has driven 40 mm."""

    @kiks.measure
    def arrived(moment: Any, notes: Any) -> None:
        notes[0] = 1.0 if moment.path_mm > 40.0 else 0.0

    path_mm = kiks.measures.path_mm
    given = {"reward": path_mm, "until": arrived} | changes
    return kiks.Task("go", (kiks.Arena.box(400, 300),), kiks.controllers.linear(), (path_mm,), **given)


def vector(count: int = 3, **options: Any) -> KheperaVectorEnv:
    return KheperaVectorEnv(count, "Avoid", **options)


def begun(env: Any) -> Any:
    env.reset(seed=0)
    return env


def random_actions(*shape: int) -> Any:
    return np.random.default_rng(5).uniform(-1, 1, (*shape, 2)).astype(np.float32)


@pytest.mark.parametrize("name", IDS)
@pytest.mark.filterwarnings("error")
def test_environments_pass_the_checks_of_gymnasium(name: str) -> None:
    env = gymnasium.make(name, render_mode="rgb_array")
    assert env.spec is not None
    assert env.spec.max_episode_steps == 600
    check_env(env.unwrapped)


def test_a_module_in_the_name_registers_the_environments() -> None:
    code = "import gymnasium; print(gymnasium.make('kiks.learn.gymnasium_envs:kiks/Avoid-v0').unwrapped)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "KheperaEnv" in found.stdout, found.stderr


def test_import_kiks_does_not_import_gymnasium() -> None:
    code = "import sys, kiks; assert not {'gymnasium', 'pettingzoo', 'numba'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("missing", "module"), [("gymnasium", "kiks.learn.gymnasium_envs"), ("pettingzoo", "kiks.learn.pettingzoo_env")]
)
def test_the_error_names_a_missing_package(missing: str, module: str) -> None:
    code = f"import sys; sys.modules['{missing}'] = None; import {module}"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "pip install 'kiks[learn]'" in found.stderr


@pytest.mark.parametrize("name", IDS)
def test_single_and_vector_environments_have_the_same_episodes(name: str) -> None:
    many = gymnasium.make_vec(name, num_envs=9, max_episode_steps=7, threads=2)
    assert isinstance(many, KheperaVectorEnv)
    actions = random_actions(24, 9)
    single = gymnasium.make(name, max_episode_steps=7)
    world = 4
    seen, _ = many.reset(seed=10)
    for other in range(9):
        np.testing.assert_array_equal(single.reset(seed=10 + other)[0], seen[other])
    expected, _ = single.reset(seed=10 + world)
    is_done = False
    for action in actions:
        np.testing.assert_array_equal(seen[world], expected)
        seen, rewards, terminations, truncations, infos = many.step(action)
        if is_done:  # the step in which the vector environment resets this world
            expected, _ = single.reset()
            is_done = False
            assert rewards[world] == 0.0
            continue
        expected, reward, terminated, truncated, info = single.step(action[world])
        assert (reward, terminated, truncated) == (rewards[world], terminations[world], truncations[world])
        assert info == {key: infos[key][world] for key in info}
        assert all(infos[f"_{key}"].all() for key in info)
        is_done = truncated
    hashes = [env.unwrapped.episodes.batch.state_hash(k) for env, k in ((many, world), (single, 0))]
    assert hashes[0] == hashes[1]


def test_reset_with_a_seed_repeats_an_episode_and_without_one_continues() -> None:
    env = KheperaEnv("Avoid")

    def episode(seed: int | None) -> list[float]:
        seen, _ = env.reset(seed=seed)
        return [*seen.tolist(), *env.step(np.ones(2, np.float32))[0].tolist(), *env.episodes.batch.poses[0, 0]]

    first, second = episode(7), episode(None)
    assert first != second
    assert [episode(7), episode(None)] == [first, second]
    assert episode(8) != first


def test_worlds_have_different_seeds_or_those_of_a_list() -> None:
    envs = vector()
    envs.reset(seed=[4, 9, 4])
    one, two, three = (envs.episodes.batch.poses[k].tolist() for k in range(3))
    assert one == three != two
    envs.reset(seed=3)
    assert envs.episodes.batch.poses[1].tolist() == one


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_autoreset_modes(mode: AutoresetMode) -> None:
    envs = KheperaVectorEnv(2, small_task(), autoreset_mode=mode)
    assert envs.metadata["autoreset_mode"] is mode
    envs.reset(seed=1)
    actions = np.array([[1, 1], [0, 0]], np.float32)
    for _ in range(20):
        seen, rewards, terminations, truncations, infos = envs.step(actions)
        if terminations.any():
            break
    assert terminations.tolist() == [True, False]
    assert not truncations.any()
    assert rewards[0] > 0.0
    if mode is AutoresetMode.SAME_STEP:
        assert infos["final_obs"][0] in envs.single_observation_space
        assert infos["_final_obs"].tolist() == [True, False]
        assert infos["final_info"]["path_mm"][0] > 40.0
    else:
        assert infos["path_mm"][0] > 40.0
        if mode is AutoresetMode.DISABLED:
            with pytest.raises(ParameterError, match="reset_mask"):
                envs.step(actions)
            seen, infos = envs.reset(options={"reset_mask": np.array([True, False])})
        else:
            seen, rewards, terminations, _, infos = envs.step(actions)
            assert rewards[0] == 0.0
            assert not terminations.any()
    assert infos["path_mm"][0] == 0.0
    assert infos["time_s"][0] == 0.0
    assert infos["time_s"][1] > 0.0
    assert seen in envs.observation_space


def test_each_episode_draws_one_of_the_arenas_with_its_lamps() -> None:
    dark = kiks.Arena.box(400, 300)
    lit, bright = (replace(dark, lamps=((200, 150, 9.0), (150, 150, 9.0))[:count]) for count in (1, 2))
    env, many = (make(arenas=(dark, lit, bright)) for make in (partial(KheperaEnv, "Avoid"), partial(vector, 30)))
    env.reset(seed=1)
    many.reset(seed=1)
    for each in (env, many):
        met = set()
        for _ in range(30):
            batch = each.episodes.batch
            for world, arena in enumerate(batch.arena_indices.tolist()):
                assert np.count_nonzero(batch.lamps[world, :, 2]) == arena
                met.add(arena)
            each.reset()
        assert met == {0, 1, 2}


def test_the_action_of_a_world_that_resets_is_ignored() -> None:
    one, other = (vector(2, max_episode_steps=1) for _ in range(2))
    for envs in (one, other):
        envs.reset(seed=1)
        envs.step(np.zeros((2, 2), np.float32))
    seen = [one.step(np.zeros((2, 2), np.float32)), other.step(np.array([[1.5, np.nan], [np.inf, 0]], np.float32))]
    np.testing.assert_array_equal(seen[0][0], seen[1][0])
    assert one.episodes.batch.state_hash(1) == other.episodes.batch.state_hash(1)
    with pytest.raises(ParameterError, match=r"from -1 to 1, but among them was 1\.5"):
        one.step(np.full((2, 2), 1.5, np.float32))


def test_wrappers_of_gymnasium_accept_the_vector_environment() -> None:
    envs = gymnasium.wrappers.vector.RecordEpisodeStatistics(
        gymnasium.make_vec("kiks/Avoid-v0", num_envs=2, max_episode_steps=3)
    )
    envs.reset(seed=0)
    for _ in range(3):
        *_, infos = envs.step(envs.action_space.sample())
    assert infos["episode"]["l"].tolist() == [3, 3]


def test_the_sum_of_rewards_is_the_measure() -> None:
    envs = vector(4, threads=1)
    envs.reset(seed=2)
    total = sum(envs.step(action)[1] for action in random_actions(12, 4))
    np.testing.assert_allclose(total / 12, envs.episodes.batch.values[:, 0, 0])


def test_a_contact_lowers_the_reward() -> None:
    free = KheperaEnv("Avoid", reward=without_contacts(kiks.measures.path_mm, 0.0))
    costly = KheperaEnv("Avoid", reward=without_contacts(kiks.measures.path_mm, 7.0))
    totals = []
    for env in (free, costly):
        env.reset(seed=1)
        steps = [env.step(np.ones(2, np.float32)) for _ in range(60)]
        totals.append(sum(reward for _, reward, *_ in steps))
    contacts = steps[-1][4]["contacts"]
    assert contacts > 0.0
    assert totals[0] - totals[1] == pytest.approx(7.0 * contacts)
    assert without_contacts(kiks.measures.path_mm, 7.0) is costly.episodes.task.reward


def test_arguments_change_timing_and_response() -> None:
    env = KheperaEnv("Avoid", timing=kiks.Timing(0.05, None), response="fast")
    env.reset(seed=1)
    assert env.step(np.zeros(2, np.float32))[4]["time_s"] == 0.05
    slow = KheperaEnv("Avoid", timing=kiks.Timing(0.0, 9600))
    slow.reset(seed=1)
    assert 0.03 < slow.step(np.zeros(2, np.float32))[4]["time_s"] < 0.09


def gripping() -> kiks.Task:
    task = kiks.tasks.nolfi_1997()
    return task.with_changes(reward=task.measures[0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: KheperaEnv("Avoit"), "Did you mean 'Avoid'"),
        (lambda: KheperaEnv("Avoid", arena=1), "Did you mean 'arenas'"),
        (lambda: KheperaEnv("Avoid", render_mode="human"), "rgb_array"),
        (lambda: KheperaEnv(kiks.tasks.avoid()), "must be a task of one side with a reward, but 'avoid' is not"),
        (lambda: KheperaEnv(gripping()), "must command wheels alone, but that of 'nolfi_1997.*' commands arm and jaws"),
        (lambda: KheperaEnv("Avoid", starts="here"), "starts must be"),
        (lambda: KheperaEnv("Avoid", reward=3), "must be a kiks.Measure"),
        (lambda: without_contacts(kiks.measures.path_mm, -1), "cost must be at least 0, but it was -1"),
        (lambda: without_contacts(print), "reward must be a kiks.Measure"),  # type: ignore[arg-type]
        (lambda: KheperaEnv("Avoid").step(np.zeros(2, np.float32)), "reset"),
        (lambda: begun(KheperaEnv("Avoid")).step(np.array([0.0, 1.5])), "from -1 to 1, but among them was 1.5"),
        (lambda: begun(KheperaEnv("Avoid")).step(np.array([0.0, np.nan])), "from -1 to 1, but among them was nan"),
        (lambda: begun(KheperaEnv("Avoid")).step(np.zeros(3)), "two for each robot"),
        (lambda: begun(KheperaEnv("Avoid")).step("ahead"), "two for each robot"),
        (lambda: vector().step(np.zeros((3, 2), np.float32)), "reset"),
        (lambda: KheperaTeam(robots=40, arenas=kiks.Arena.box(500, 500)).reset(seed=1), "room for 40 robots"),
        (lambda: vector().reset(seed=[1]), "one for each of 3 worlds"),
        (lambda: vector().reset(options={"reset_mask": [1, 0]}), "reset_mask must be bool"),
    ],
)
def test_wrong_arguments_are_errors(make: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        make()


def test_pictures_show_the_robot() -> None:
    env = KheperaEnv("Avoid", render_mode="rgb_array")
    env.reset(seed=1)
    before = env.render()
    for _ in range(5):
        env.step(np.ones(2, np.float32))
    assert before.shape == (480, 480, 3)
    assert (env.render() != before).any()
    envs = vector(2, render_mode="rgb_array")
    envs.reset(seed=1)
    pictures = envs.render()
    assert pictures is not None
    np.testing.assert_array_equal(pictures[0], before)


def test_a_team_of_one_has_the_episodes_of_the_single_environment() -> None:
    team, env = KheperaTeam("Avoid", robots=1), KheperaEnv("Avoid")
    seen, _ = team.reset(seed=3)
    expected, _ = env.reset(seed=3)
    for action in random_actions(5, 1)[:, 0]:
        np.testing.assert_array_equal(seen["robot_1"], expected)
        seen, rewards, *_, infos = team.step({"robot_1": action})
        expected, reward, *_, info = env.step(action)
        assert (rewards["robot_1"], infos["robot_1"]) == (reward, info)


def test_an_episode_of_a_team_ends_for_all_robots_at_once() -> None:
    team = KheperaTeam(small_task(), robots=2)
    team.reset(seed=1)
    actions = {"robot_1": np.ones(2, np.float32), "robot_2": np.zeros(2, np.float32)}
    for _ in range(20):
        _, rewards, terminations, truncations, _ = team.step(actions)
        if not team.agents:
            break
    assert terminations == {"robot_1": True, "robot_2": True}
    assert truncations == {"robot_1": False, "robot_2": False}
    assert rewards["robot_1"] > rewards["robot_2"]
    with pytest.raises(ParameterError, match="the episode is over"):
        team.step(actions)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize(
    "made",
    [
        lambda: gymnasium.make("kiks/Follow-v0"),
        lambda: gymnasium.make_vec("kiks/Light-v0", num_envs=5),
        lambda: KheperaTeam("Gather", robots=2),
        lambda: KheperaEnv(small_task()),
    ],
    ids=["single", "vector", "team", "measures of a user"],
)
def test_a_copy_of_an_environment_goes_on_as_it_does(made: Any, copied: Any) -> None:
    env = made()
    env.reset(seed=3)

    def steps(env: Any, count: int) -> list[Any]:
        seen = []
        for number in range(count):
            if isinstance(env, KheperaTeam):
                actions: Any = {name: np.full(2, 0.1 * number, np.float32) for name in env.agents}
            else:
                actions = np.full(env.action_space.shape, 0.1 * number, np.float32)
            seen.append(env.step(actions))
        return [*seen, env.reset()]

    steps(env, 3)
    twin = copied(env)
    expected = steps(env, 5)
    for one, other in zip(expected, steps(twin, 5), strict=True):
        np.testing.assert_equal(other, one)
