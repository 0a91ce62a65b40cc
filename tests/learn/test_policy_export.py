"""A policy that another library learnt drives as it does there, and what cannot be a controller is refused."""

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases
from tests.learn.small import refused

import kiks
from kiks.learn.environments import find_environment
from kiks.learn.episode_batch import Episodes

pytestmark = pytest.mark.slow

Trace = np.ndarray[Any, np.dtype[np.float64]]
Layer = tuple[Trace, Trace]

FUNCTIONS: dict[str, Any] = {"tanh": np.tanh, "relu": lambda x: np.maximum(x, 0)}
SQUASHES: dict[str, Any] = {"tanh": np.tanh, "clip": lambda x: np.clip(x, -1, 1)}


Tanh, ReLU, ELU = (type(name, (), {}) for name in ("Tanh", "ReLU", "ELU"))
"""Activations as PyTorch names them; no controller has the last one."""


def network(counts: tuple[int, ...], seed: int = 1) -> list[Layer]:
    """Return layers with weights of the size that a learner leaves."""
    rng = np.random.default_rng(seed)
    return [
        (2 * rng.standard_normal((units, inputs)) / np.sqrt(inputs), 0.5 * rng.standard_normal(units))
        for inputs, units in pairwise(counts)
    ]


def actions_of(layers: list[Layer], seen: Trace, activation: str, output: str) -> Trace:
    """Return what a network does with observations, [observation, wheel]."""
    for weights, biases in layers[:-1]:
        seen = FUNCTIONS[activation](seen @ weights.T + biases)
    result: Trace = SQUASHES[output](seen @ layers[-1][0].T + layers[-1][1])
    return result


def speeds_of(champion: kiks.Champion, sensors: Trace) -> Trace:
    """Return the speeds that a champion wants for counts, as shares of the speed limit, [reading, wheel]."""
    wheels, parameters = np.zeros((len(sensors), 2)), np.array(champion.parameters)
    for reading, speeds in zip(sensors, wheels, strict=True):
        champion.controller(reading, np.zeros(0), parameters, speeds)
    return wheels / champion.controller.recipe["speed_limit"]  # type: ignore[index]


def counts_of(spec: Any, count: int = 200) -> Trace:
    return np.random.default_rng(3).integers(0, 1024, (count, spec.controller.sensor_count)).astype(float)


def assert_equal_outputs(champion: kiks.Champion, layers: list[Layer], spec: Any, activation: str, output: str) -> None:
    sensors = counts_of(spec)
    expected = actions_of(layers, sensors / 1023, activation, output)
    np.testing.assert_allclose(speeds_of(champion, sensors), expected, atol=1e-12)
    assert expected.std() > 0.01


@pytest.mark.parametrize(
    ("name", "hidden", "activation", "output"),
    cases(
        [
            ("Avoid", (64, 64), "tanh", "clip"),
            ("Maze", (400, 300), "relu", "tanh"),
            ("Maze", (), None, "clip"),
            ("Maze", (256, 256), "relu", "tanh"),
            ("Maze", (5, 4, 3), "tanh", "tanh"),
        ],
        3,
    ),
)
def test_outputs_are_those_of_the_network(name: str, hidden: tuple[int, ...], activation: Any, output: str) -> None:
    spec = find_environment(name)
    layers = network((spec.controller.sensor_count, *hidden, 2))
    champion = kiks.champion_of_policy(layers, name, activation=activation, output=output)
    assert_equal_outputs(champion, layers, spec, activation or "tanh", output)


def test_light_before_proximity_is_the_same_network() -> None:
    backwards = kiks.controllers.linear(senses=("ambient", "proximity"), speed_limit=7.0)
    spec = find_environment("Maze").with_changes(controller=backwards)
    layers = network((16, 6, 2))
    champion = kiks.champion_of_policy(layers, spec, activation="tanh")
    assert champion.controller.senses == ("ambient", "proximity")
    assert_equal_outputs(champion, layers, spec, "tanh", "clip")


def state_dict(layers: list[Layer], names: tuple[str, ...] = ("0", "2", "4")) -> dict[str, Trace]:
    """Return layers as PyTorch names the numbers of a network."""
    return {
        f"{name}.{part}": numbers
        for name, layer in zip(names, layers, strict=True)
        for part, numbers in zip(("weight", "bias"), layer, strict=True)
    }


def algorithm(state: dict[str, Trace], activation: type, **more: Any) -> SimpleNamespace:
    """Return a model of Stable-Baselines3, as far as it is looked at."""
    usual = {"action_space": SimpleNamespace(low=-np.ones(2), high=np.ones(2)), "use_sde": False}
    parts = {"state_dict": lambda: state, "activation_fn": activation, "squash_output": True} | usual | more
    return SimpleNamespace(policy=SimpleNamespace(**parts))


LAYERS = network((8, 4, 3, 2))
CRITIC = state_dict(network((10, 4, 3, 1)), ("critic.qf0.0", "critic.qf0.2", "critic.qf0.4"))
PPO = algorithm(
    {"log_std": np.zeros(2)}
    | state_dict(LAYERS[:2], ("mlp_extractor.policy_net.0", "mlp_extractor.policy_net.2"))
    | state_dict(network((8, 4)), ("mlp_extractor.value_net.0",))
    | state_dict(LAYERS[2:], ("action_net",))
    | state_dict(network((4, 1)), ("value_net",)),
    Tanh,
    squash_output=False,
)
SAC = algorithm(
    state_dict(LAYERS, ("actor.latent_pi.0", "actor.latent_pi.2", "actor.mu"))
    | state_dict(network((3, 2)), ("actor.log_std",))
    | CRITIC,
    ReLU,
)
TD3 = algorithm(
    state_dict(LAYERS, ("actor.mu.0", "actor.mu.2", "actor.mu.4"))
    | state_dict(LAYERS, ("actor_target.mu.0", "actor_target.mu.2", "actor_target.mu.4"))
    | CRITIC,
    ReLU,
)


@pytest.mark.parametrize(
    ("policy", "activation", "output"),
    [(PPO, "tanh", "clip"), (PPO.policy, "tanh", "clip"), (SAC, "relu", "tanh"), (TD3, "relu", "tanh")],
    ids=["ppo", "policy of ppo", "sac", "td3"],
)
def test_forms_of_a_policy(policy: Any, activation: str, output: str) -> None:
    champion = kiks.champion_of_policy(policy, "Avoid")
    assert_equal_outputs(champion, LAYERS, find_environment("Avoid"), activation, output)
    again = kiks.champion_of_policy(policy, "Avoid", activation=activation, output=output)
    assert again.parameters == champion.parameters


def test_a_state_dict_is_the_same_champion() -> None:
    state = state_dict(LAYERS)
    one, other = (kiks.champion_of_policy(given, "Avoid", activation="tanh") for given in (state, LAYERS))
    assert one.parameters == other.parameters
    assert one.controller is other.controller
    without_biases = {name: value for name, value in state.items() if name.endswith("weight")}
    layers = [(weights, 0 * biases) for weights, biases in LAYERS]
    assert kiks.champion_of_policy(without_biases, "Avoid", activation="tanh").parameters == (
        kiks.champion_of_policy(layers, "Avoid", activation="tanh").parameters
    )


def test_the_champion_drives_the_episode_of_the_policy(tmp_path: Path) -> None:
    spec = find_environment("Maze").with_changes(timing=kiks.Timing(0.05, 38400), robot="khepera_ii")
    layers = network((16, 12, 2))
    path = tmp_path / "learnt.toml"
    kiks.champion_of_policy(layers, spec, activation="relu").save(path)
    champion = kiks.Champion.load(path)
    assert (champion.timing, champion.task, champion.robot) == (spec.timing, "Maze", "khepera_ii")
    by_policy, by_champion = Episodes(spec, 1, threads=1), Episodes(spec, 1, threads=1)
    for episodes in (by_policy, by_champion):
        episodes.begin([0], [1])
    seed, start = by_policy.batch.seeds, by_policy.batch.poses[0, 0].tolist()
    arena = by_policy.batch.arenas[by_policy.batch.arena_indices[0]]
    for _ in range(100):
        seen = by_policy.observations()[0, 0].astype(np.float64)
        by_policy.step(actions_of(layers, seen, "relu", "clip")[None, None])
        by_champion.step(speeds_of(champion, np.rint(1023.0 * by_champion.observations()[0].astype(np.float64)))[None])
    assert by_champion.batch.state_hash(0) == by_policy.batch.state_hash(0)
    batch = kiks.Batch(
        arena, 1, seed=seed, starts=start, senses=spec.controller.senses, timing=spec.timing, robot=spec.robot
    )
    batch.run(champion.controller, champion.parameters, seconds=by_policy.batch.times_s[0])
    # A step has sensed once more, a few milliseconds later.
    np.testing.assert_allclose(batch.poses[0, 0, :2], by_policy.batch.poses[0, 0, :2], atol=2.0)
    assert np.hypot(*(batch.poses[0, 0, :2] - start[:2])) > 10.0


def test_what_is_no_policy_or_does_not_fit_is_refused() -> None:
    for policy, message in (
        (None, "policy must be a model or a policy .* but it was None"),
        ("model.zip", "policy must be a model or a policy .* but it was 'model.zip'"),
        ([], "but it had no layer"),
        ([np.zeros((2, 8))], "a member of the list was"),
        ([(np.zeros((2, 8)), np.zeros(3))], r"the biases of layer 1 must be finite numbers \[2\]"),
        ([(np.zeros((2, 16)), np.zeros(2))], r"with 8 inputs, but it was \(2, 16\). Transpose weights"),
        ([(np.zeros((8, 2)), np.zeros(8))], "with 8 inputs"),
        ([(np.zeros((4, 8)), np.zeros(4))], "must have two outputs, .* but it had 4"),
        ([(np.full((2, 8), np.nan), np.zeros(2))], "the weights of layer 1 must be finite numbers"),
        ([("ab", np.zeros(2))], "the weights of layer 1 must be finite numbers \\[any, any\\], but it was 'ab'"),
        (LAYERS, "activation must be 'tanh' or 'relu', but it was left out"),
        (network((8, 513, 2)), "activation must be"),
        ({"scale": np.zeros(2)}, "it has 'scale'. Give the part that maps observations to actions"),
        ({"0.weight": np.zeros(2)}, "the weights of layer 1 must be finite numbers"),
        ({3: np.zeros(2)}, "policy must be a model or a policy"),
    ):
        refused(message, kiks.champion_of_policy, policy, "Avoid")
    policy = PPO.policy
    wide = SimpleNamespace(low=-3 * np.ones(2), high=3 * np.ones(2))
    normalizing = SimpleNamespace(
        policy=policy, get_vec_normalize_env=lambda: SimpleNamespace(norm_obs=True, norm_reward=True)
    )
    for changed, message in (
        (SimpleNamespace(policy=SimpleNamespace(**vars(policy) | {"use_sde": True})), "it explores by use_sde"),
        (SimpleNamespace(**vars(policy) | {"action_space": wide}), "must have actions from -1 to 1"),
        (normalizing, "a VecNormalize changes them"),
        (algorithm({}, ELU), "Tanh or ReLU, but it has 'ELU'"),
    ):
        refused(message, kiks.champion_of_policy, changed, "Avoid")
    for options, message in (
        ({"activation": "relu"}, "activation must be 'tanh', as the policy has it, but it was 'relu'"),
        ({"output": "hard"}, "output must be 'clip', as the policy has it, but it was 'hard'"),
        ({"policy": LAYERS, "activation": "relu", "output": ["clip"]}, "output must be"),
        ({"task": "Avoit"}, "Did you mean 'Avoid'"),
        ({"task": "Maze"}, "with 16 inputs"),
    ):
        refused(message, kiks.champion_of_policy, **{"policy": PPO, "task": "Avoid"} | options)


def test_networks_of_pytorch() -> None:
    torch: Any = pytest.importorskip("torch", reason="PyTorch is not installed")
    for activation, name in ((torch.nn.Tanh, "tanh"), (torch.nn.ReLU, "relu")):
        model = torch.nn.Sequential(
            torch.nn.Linear(8, 64), activation(), torch.nn.Linear(64, 64), activation(), torch.nn.Linear(64, 2)
        )
        champion = kiks.champion_of_policy(model.state_dict(), "Avoid", activation=name)
        sensors = counts_of(find_environment("Avoid"))
        with torch.no_grad():
            expected = model(torch.tensor(sensors / 1023, dtype=torch.float32)).numpy().clip(-1, 1)
        np.testing.assert_allclose(speeds_of(champion, sensors), expected, atol=1e-6)


@pytest.mark.parametrize("name", ["PPO", "A2C", "SAC", "TD3"])
def test_policies_of_stable_baselines3(name: str) -> None:
    library: Any = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3, with PyTorch, is not installed")
    from kiks.learn.gymnasium_envs import KheperaEnv

    model = getattr(library, name)("MlpPolicy", KheperaEnv("Light"), seed=1, device="cpu")
    champion = kiks.champion_of_policy(model, "Light")
    sensors = counts_of(find_environment("Light"))
    expected, _ = model.predict((sensors / 1023).astype(np.float32), deterministic=True)
    np.testing.assert_allclose(speeds_of(champion, sensors), expected, atol=1e-6)
    assert champion.algorithm == name
