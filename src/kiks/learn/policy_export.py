"""A policy that another library learnt becomes a champion: its network is a compiled controller from then on.

Nothing here imports PyTorch or that library: names and shapes in a `state_dict` show the layers, and a policy of
Stable-Baselines3 says which functions are between them.

An environment shows a policy counts as shares of 1023. Controllers take proximity so too, but light as
(500 - counts) / 500 (`kiks.controllers`). Both are linear in the counts, so the first layer absorbs the difference.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control import controllers
from kiks.control.senses import AnySense, reading_count, sense_of
from kiks.errors import ParameterError, shown
from kiks.learn.champion import Champion
from kiks.learn.environments import find_environment
from kiks.learn.task import Task
from kiks.model.array_checks import check_numbers

Floats = NDArray[np.float64]
Layer = tuple[Floats, Floats]

FUNCTIONS = {"Tanh": "tanh", "ReLU": "relu"}
"""Classes of PyTorch whose functions a controller has, by name."""

NOT_ACTING = re.compile(r"((mlp_extractor\.)?value_net|(actor\.)?log_std|actor_target|critic|critic_target)\b")
"""What a policy of Stable-Baselines3 has beside the way from observations to actions."""

ACCEPTED = (
    "a model or a policy of Stable-Baselines3, a state_dict, or a list of pairs of arrays, (weights [unit, input], "
    "biases [unit])"
)


def champion_of_policy(
    policy: Any,
    task: str | Task,
    *,
    activation: str | None = None,
    output: str | None = None,
    robot: str | None = None,
) -> Champion:
    """Return a champion that drives as a policy does in its environment.

    Its outputs are those of the policy without exploration, within 1e-6 of the speed limit. The network of the policy
    consists of linear layers with tanh or ReLU between them. It gets the observations of the environment as they are,
    and its two outputs are the actions. `Champion.save` keeps it, and `kiks run`
    take the file.

    Args:
        policy: A model or a policy of Stable-Baselines3 (PPO, A2C, SAC, TD3, DDPG); the `state_dict` of linear layers
            in PyTorch; or a list of pairs of arrays, weights [unit, input] and biases [unit]. The first layer comes
            first.
        task: The environment in which it learnt: a task with a reward, or the name of one, such as 'Avoid'.
        activation: The function of hidden units, 'tanh' or 'relu'; a policy of Stable-Baselines3 says it itself.
        output: What keeps the actions within +-1, 'clip' or 'tanh'; a policy of Stable-Baselines3 says it itself, for
            others it is 'clip' if left out.
        robot: The kind of robot that it drove; that of the environment if left out.

    Example:
        >>> import numpy as np
        >>> import kiks
        >>> shy = np.array([[0, 0, 0, -1, -1, -1, 0, 0], [-1, -1, -1, 0, 0, 0, 0, 0]])
        >>> champion = kiks.champion_of_policy([(shy, [0.5, 0.5])], "Avoid")
        >>> champion.controller.name, champion.parameters[:2]
        ('policy', (0.5, 0.5))
    """
    task = find_environment(task)
    pairs, own_activation, own_output = _network_of(policy)
    layers = _checked(pairs, task)
    activation = _chosen("activation", activation, own_activation)
    if activation is None and len(layers) > 1:
        raise ParameterError(
            "activation must be 'tanh' or 'relu', but it was left out and the policy does not say which. "
            "Give the function of its hidden units."
        )
    controller = controllers.policy(
        hidden=[len(biases) for _, biases in layers[:-1]],
        activation=activation or "tanh",
        output=_chosen("output", output, own_output) or "clip",
        senses=task.controller.senses,
        speed_limit=task.speed_limit,
    )
    layers[0] = _with_inputs_of_controllers(layers[0], task.controller.senses)
    parts = [part.ravel() for weights, biases in layers for part in (biases, weights.T)]
    return Champion(
        controller,
        np.concatenate(parts).tolist(),
        task=task.name,
        robot=robot or (task.robot[0] if isinstance(task.robot, tuple) else task.robot),
        timing=task.timings[0],
        algorithm=type(policy).__name__ if hasattr(policy, "policy") else "",
    )


# ---- what a policy consists of ----


def _network_of(policy: Any) -> tuple[list[tuple[Any, Any]], str | None, str | None]:
    """Return the layers of a policy; the functions of hidden units and of outputs, None if it does not say which."""
    if isinstance(policy, list | tuple):
        return [_pair(each) for each in policy], None, None
    if isinstance(policy, Mapping):
        return _layers_in(policy), None, None
    module = getattr(policy, "policy", policy)  # the policy of a learning algorithm
    if not all(hasattr(module, name) for name in ("state_dict", "activation_fn", "squash_output")):
        raise ParameterError(f"policy must be {ACCEPTED}, but it was {shown(policy)}.")
    _check_is_unchanged(policy, module)
    name = module.activation_fn.__name__
    if name not in FUNCTIONS:
        raise ParameterError(f"policy must have hidden units of Tanh or ReLU, but it has {shown(name)}.")
    return _layers_in(module.state_dict()), FUNCTIONS[name], "tanh" if module.squash_output else "clip"


def _check_is_unchanged(policy: Any, module: Any) -> None:
    """Refuse a model of Stable-Baselines3 that sees or does something else than what the environment has."""
    normalizing = getattr(policy, "get_vec_normalize_env", lambda: None)()
    if normalizing is not None and normalizing.norm_obs:
        raise ParameterError(
            "policy must see the observations of the environment, but a VecNormalize changes them. Learn without it, "
            "or with norm_obs=False: observations are from 0 to 1 as they are."
        )
    if getattr(module, "use_sde", False):
        raise ParameterError(
            "policy must have actions that depend on the observation alone, but it explores by use_sde. "
            "Learn without it."
        )
    space = getattr(module, "action_space", None)
    if space is not None and not (np.all(space.low == -1) and np.all(space.high == 1)):
        raise ParameterError(
            f"policy must have actions from -1 to 1, as the environment has, but it has {shown(space)}. "
            "Learn without a wrapper of actions."
        )


def _layers_in(state: Mapping[str, Any]) -> list[tuple[Any, Any]]:
    """Return weights and biases of the layers in a state_dict, which lead from observations to actions."""
    if not all(isinstance(name, str) for name in state):
        raise ParameterError(f"policy must be {ACCEPTED}, but it was {shown(state)}.")
    acting = {name: numbers for name, numbers in state.items() if not NOT_ACTING.match(name)}
    layers = [name.removesuffix("weight") for name in acting if name.endswith("weight")]
    known = {layer + part for layer in layers for part in ("weight", "bias")}
    other = next((name for name in acting if name not in known), None)
    if other is not None:
        raise ParameterError(
            f"policy must have a state_dict of weights and biases of linear layers alone, but it has {shown(other)}. "
            "Give the part that maps observations to actions."
        )
    return [(acting[layer + "weight"], acting.get(layer + "bias")) for layer in layers]


def _pair(given: Any) -> tuple[Any, Any]:
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise ParameterError(f"policy must be {ACCEPTED}, but a member of the list was {shown(given)}.")
    return given[0], given[1]


# ---- its numbers ----


def _checked(layers: Sequence[tuple[Any, Any]], task: Task) -> list[Layer]:
    """Return layers as arrays: each takes what the one before it gives, the first the observation of an environment."""
    if not layers:
        raise ParameterError(f"policy must be {ACCEPTED}, but it had no layer.")
    checked: list[Layer] = []
    for number, (weights, biases) in enumerate(layers):
        matrix = check_numbers(f"the weights of layer {number + 1}", _as_array(weights), (None, None))
        given = np.zeros(len(matrix)) if biases is None else _as_array(biases)
        checked.append((matrix, check_numbers(f"the biases of layer {number + 1}", given, (len(matrix),))))
    wanted = [task.controller.sensor_count, *(len(matrix) for matrix, _ in checked[:-1])]
    for number, ((matrix, _), count) in enumerate(zip(checked, wanted, strict=True)):
        if matrix.shape[1] != count:
            raise ParameterError(
                f"the weights of layer {number + 1} must have the shape [unit, input] with {count} inputs, but it was "
                f"{matrix.shape}. Transpose weights that are [input, unit]."
            )
    if len(checked[-1][0]) != 2:
        raise ParameterError(
            f"policy must have two outputs, the speeds of the wheels, but it had {len(checked[-1][0])}."
        )
    return checked


def _as_array(numbers: Any) -> Any:
    """Return an array of NumPy if it is a tensor of PyTorch, which may belong to a graph or another device."""
    for step in ("detach", "cpu"):
        numbers = getattr(numbers, step, lambda same=numbers: same)()
    return numbers


def _chosen(name: str, given: str | None, found: str | None) -> str | None:
    """Return what the caller says, else what the policy says."""
    if given is not None and found is not None and given != found:
        raise ParameterError(
            f"{name} must be {found!r}, as the policy has it, but it was {shown(given)}. Leave it out."
        )
    return found if given is None else given


def _with_inputs_of_controllers(layer: Layer, senses: tuple[AnySense, ...]) -> Layer:
    """Return the first layer for the inputs of controllers, in place of counts as shares of the largest one."""
    weights, biases = layer[0].copy(), layer[1].copy()
    for place, sense in enumerate(map(sense_of, senses)):
        first = reading_count(senses[:place])
        its = weights[:, first : first + sense.size]
        # An input u is (reading - zero) / (full - zero), so the share of the most is (zero + u (full - zero)) / most.
        if (sense.zero, sense.full) != (0, sense.most):
            biases += its.sum(axis=1) * (sense.zero / sense.most)
            its *= (sense.full - sense.zero) / sense.most
    return weights, biases
