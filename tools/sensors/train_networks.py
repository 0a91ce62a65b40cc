"""Train the thesis's networks: one for each sensor, from the nearnesses of its seven rays to its reading.

Method (thesis 3.3, "Training the neural networks"): Levenberg's and Marquardt's algorithm minimises the sum of squared
errors on most of the samples; the rest, the validation set, says when to stop; of several starts the network with the
least error there is kept. The loop is our own: before version 1.16 SciPy's `least_squares` lacks the callback with
which a second set could stop it, and its L-BFGS ended at a median error of 48 counts where this one ends at 42.

The converter cuts counts to 0 .. 1023, so what a network puts beyond an end that was measured is no error. Samples for
which no ray meets anything are left out, as in the thesis: the answer is 0 then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.engine.parameters import ray_offsets_deg
from kiks.errors import ParameterError
from kiks.fit.samples import MAXIMUM_COUNTS, Fan, Floats, Samples, is_active, nearnesses
from kiks.model.robot import SENSOR_COUNT
from kiks.model.thesis_networks import INPUT_COUNT, LINEAR_COUNT, TANH_COUNT, NetworkResponse

Layers = tuple[tuple[int, bool], ...]

SIZES: dict[str, Layers] = {
    "no hidden layer": ((1, False),),
    "7 linear": ((LINEAR_COUNT, False), (1, False)),
    "13 tanh + 7 linear": ((TANH_COUNT, True), (LINEAR_COUNT, False), (1, False)),
}
"""The thesis's three networks; for each layer how many neurons it has and whether they are tanh or linear."""

THESIS_SIZE = "13 tanh + 7 linear"

VALIDATION_SHARE = 0.2
"""Share of the training samples that only says when to stop."""

PATIENCE = 20
"""Steps without a better validation error after which training stops."""

ITERATIONS = 150
"""Most steps of a start."""

_SILENT = 16 / MAXIMUM_COUNTS  # the largest reading with nothing near (README of the samples)


class Places(NamedTuple):
    """Where sensors sit and look, left positive."""

    mount_angle_deg: tuple[float, ...]
    mount_radius_mm: tuple[float, ...]
    direction_deg: tuple[float, ...]


_BEST_DEG = (72.0, 43.0, 12.0, -12.0, -43.0, -72.0, -168.0, 168.0)

PLACES = {
    "protocol": Places(
        (68.0, 44.0, 14.0, -14.0, -44.0, -68.0, -157.0, 157.0),
        (25.5, 25.2, 24.8, 24.8, 25.2, 25.5, 25.2, 25.2),
        (90.0, 45.0, 10.0, -10.0, -45.0, -90.0, 180.0, 180.0),
    ),
    "rim": Places(_BEST_DEG, (27.5,) * 8, _BEST_DEG),
}
"""Rays to train on: those of khepera-protocol.md 7.4, or from the rim at the angles where sensors answer most."""

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Network:
    """A trained network: for each layer its weights (the last column is the bias), and whether it is tanh.

    Example:
        >>> Network((np.array([[2.0, 0.5]]),), (False,))(np.array([[1.0], [3.0]]))
        array([2.5, 6.5])
    """

    weights: tuple[Floats, ...]
    is_tanh: tuple[bool, ...]

    def __call__(self, inputs: Floats) -> Floats:
        """Return the output for each row of inputs, shape [samples]."""
        return _forward(self.weights, self.is_tanh, inputs)[-1][:, 0]


def _forward(weights: Sequence[Floats], is_tanh: Sequence[bool], inputs: Floats) -> list[Floats]:
    """Return the inputs and what each layer makes of them, each of the shape [samples, neurons]."""
    values = [inputs]
    for weight, bent in zip(weights, is_tanh, strict=True):
        total = values[-1] @ weight[:, :-1].T + weight[:, -1]
        values.append(np.tanh(total) if bent else total)
    return values


def residuals_and_jacobian(
    parameters: Floats, layers: Layers, inputs: Floats, targets: Floats
) -> tuple[Floats, Floats]:
    """Return how much a network's output is above each target, and how that grows with each parameter.

    Args:
        parameters: All weights in one row; see `unpack`.
        layers: The network's size, such as `SIZES["7 linear"]`.
        inputs: Shape [samples, inputs].
        targets: Shares of the largest count, shape [samples].

    Returns:
        Residuals, shape [samples], and their derivatives, shape [samples, parameters].
    """
    weights = unpack(parameters, layers, inputs.shape[1])
    values = _forward(weights, [bent for _, bent in layers], inputs)
    output = values[-1][:, 0]
    floor = np.where(targets <= _SILENT, 0.0, targets)
    forgiven = ((output > 1.0) & (targets >= 1.0)) | ((output < 0.0) & (floor == 0.0))
    # Back from the output: d is the derivative of the residual by a layer's sums.
    d = np.where(forgiven, 0.0, 1.0)[:, None]
    parts = []
    for layer in reversed(range(len(layers))):
        if layers[layer][1]:
            d = d * (1.0 - values[layer + 1] ** 2)
        before = np.concatenate([values[layer], np.ones((len(targets), 1))], axis=1)
        parts.append((d[:, :, None] * before[:, None, :]).reshape(len(targets), -1))
        d = d @ weights[layer][:, :-1]
    return np.where(forgiven, 0.0, output - floor), np.concatenate(parts[::-1], axis=1)


def unpack(parameters: Floats, layers: Layers, input_count: int) -> tuple[Floats, ...]:
    """Return the weights of each layer, shape [neurons, inputs + 1], as views of one row of parameters."""
    weights, start = [], 0
    for neurons, _ in layers:
        stop = start + neurons * (input_count + 1)
        weights.append(parameters[start:stop].reshape(neurons, input_count + 1))
        start, input_count = stop, neurons
    return tuple(weights)


def _draw(layers: Layers, input_count: int, rng: np.random.Generator) -> Floats:
    """Return random parameters: a neuron's sum has about the size of one of its inputs."""
    parts = []
    for neurons, bent in layers:
        scale = (2.0 if bent else 1.0) / np.sqrt(input_count)
        parts.append(rng.normal(0.0, scale, neurons * (input_count + 1)))
        input_count = neurons
    return np.concatenate(parts)


def train(inputs: Floats, counts: Floats, layers: Layers, *, seed: int, starts: int = 5) -> Network:
    """Train one network.

    Args:
        inputs: Nearnesses, shape [samples, inputs].
        counts: Readings, shape [samples].
        layers: The network's size.
        seed: The same seed, the same network.
        starts: Number of random starts; the best is kept.

    Raises:
        ParameterError: If there are fewer than ten samples or no starts.
    """
    if len(inputs) < 10 or starts < 1:
        raise ParameterError(
            f"Training must have at least 10 samples with something near and 1 start, but there were {len(inputs)} "
            f"and {starts}. Measure more, or raise --starts."
        )
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(inputs))
    split = max(int(len(inputs) * VALIDATION_SHARE), 1)
    targets = counts / MAXIMUM_COUNTS
    check, learn = ((inputs[part], targets[part]) for part in (order[:split], order[split:]))
    candidates = [_descend(_draw(layers, inputs.shape[1], rng), layers, learn, check) for _ in range(starts)]
    _, best = min(candidates, key=lambda candidate: candidate[0])
    weights = [weight.copy() for weight in unpack(best, layers, inputs.shape[1])]
    weights[-1] *= MAXIMUM_COUNTS
    return Network(tuple(weights), tuple(bent for _, bent in layers))


def _descend(
    parameters: Floats, layers: Layers, learn: tuple[Floats, Floats], check: tuple[Floats, Floats]
) -> tuple[float, Floats]:
    """Go downhill from one start; return the least mean squared error on the validation set, and the weights there.

    A step s solves (J'J + m I) s = -J'r: Newton's for a small m, a short one straight downhill for a large one.
    """

    def checked(parameters: Floats) -> float:
        return float(np.mean(residuals_and_jacobian(parameters, layers, *check)[0] ** 2))

    residuals, jacobian = residuals_and_jacobian(parameters, layers, *learn)
    best_error, best, since, damping = checked(parameters), parameters, 0, 1e-2
    for _ in range(ITERATIONS):
        normal, slope = jacobian.T @ jacobian, jacobian.T @ residuals
        while True:
            step = np.linalg.solve(normal + damping * np.eye(len(slope)), slope)
            trial, trial_jacobian = residuals_and_jacobian(parameters - step, layers, *learn)
            if trial @ trial < residuals @ residuals:
                break
            damping *= 10.0
            if damping > 1e8:
                return best_error, best
        parameters, residuals, jacobian = parameters - step, trial, trial_jacobian
        damping = max(damping / 10.0, 1e-12)
        error, since = checked(parameters), since + 1
        if error < best_error:
            best_error, best, since = error, parameters, 0
        if since > PATIENCE:
            break
    return best_error, best


def pairs(tables: Sequence[Samples], fan: Fan, sensor: int) -> tuple[Floats, Floats]:
    """Return the nearnesses of a sensor's rays, shape [samples, rays], and its readings, where anything is near."""
    inputs = np.concatenate([nearnesses(table, fan)[:, :, sensor].reshape(-1, INPUT_COUNT) for table in tables])
    counts = np.concatenate([table.counts[:, :, sensor].ravel() for table in tables]).astype(np.float64)
    near = inputs.max(axis=1) > 0.0
    return inputs[near], counts[near]


def train_sensors(
    tables: Sequence[Samples],
    layers: Layers,
    *,
    seed: int = 0,
    starts: int = 5,
    progress: Progress = lambda text: None,
) -> list[Network]:
    """Train a network for each of the eight sensors; `progress` is told which one is at work.

    Raises:
        ParameterError: If a sensor has too few samples.
    """
    fan = Fan.spread(*PLACES["rim"])
    networks = []
    for sensor in range(SENSOR_COUNT):
        progress(f"sensor {sensor}")
        inputs, counts = pairs(tables, fan, sensor)
        networks.append(train(inputs, counts, layers, seed=seed + sensor, starts=starts))
    return networks


def predictions(tables: Sequence[Samples], networks: Sequence[Network]) -> tuple[Floats, Floats]:
    """Return what networks answer to the active samples and what was measured [counts], both of the shape [samples]."""
    fan = Fan.spread(*PLACES["rim"])
    answers, readings = [], []
    for sensor, network in enumerate(networks):
        inputs, counts = pairs(tables, fan, sensor)
        active = is_active(counts)
        answers.append(np.clip(network(inputs[active]), 0.0, MAXIMUM_COUNTS))
        readings.append(counts[active])
    return np.concatenate(answers), np.concatenate(readings)


def response_of(networks: Sequence[Network]) -> NetworkResponse:
    """Return eight networks of the thesis's size as the response that a robot's file can name."""
    hidden, middle, last = ([network.weights[layer].tolist() for network in networks] for layer in range(3))
    weights: Any = {"hidden": hidden, "middle": middle, "last": [row for (row,) in last]}
    return NetworkResponse(*PLACES["rim"], field_of_view_deg=120.0, range_mm=50.0, **weights)


def fan_of(response: NetworkResponse) -> Fan:
    """Return the rays of a response."""
    return Fan.spread(
        response.mount_angle_deg,
        response.mount_radius_mm,
        response.direction_deg,
        range_mm=response.range_mm,
        offsets_deg=ray_offsets_deg(response.field_of_view_deg),
    )


def errors(counts: NDArray[Any], expected: NDArray[Any]) -> tuple[float, float, float]:
    """Return the maximum, mean and median absolute error, as the thesis prints them [counts]."""
    error = np.abs(np.asarray(counts, np.float64) - expected)
    return float(error.max()), float(error.mean()), float(np.median(error))
