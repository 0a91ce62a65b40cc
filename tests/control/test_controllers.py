"""Controllers that come with KiKS against plain NumPy, and what is promised of a user's own."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases
from tests.learn.small import ahead, refused

import kiks
from kiks.control import neural_nets
from kiks.control.controller import whole_speeds
from kiks.engine.compiling import callable_kernel

pytestmark = pytest.mark.slow

BOTH = ("proximity", "ambient")

Trace = np.ndarray[Any, np.dtype[np.float64]]


def outputs(controller: kiks.Controller, parameters: Any, sensors: Any) -> Trace:
    """Return the speeds that a controller wants for one reading after the other, [step, 2]."""
    memory, wheels = np.zeros(controller.memory_count), np.zeros((len(sensors), 2))
    for step, reading in enumerate(sensors):
        controller(reading, memory, parameters, wheels[step])
    return wheels


def readings(controller: kiks.Controller, step_count: int = 12, seed: int = 5) -> Trace:
    return np.random.default_rng(seed).integers(0, 1024, (step_count, controller.sensor_count)).astype(float)


def inputs_of(controller: kiks.Controller, sensors: Trace) -> Trace:
    """Return readings as the inputs of networks: proximity as a share of 1023, light as what is missing from 500."""
    senses = np.split(sensors, len(controller.senses), axis=1)
    shares = {"proximity": lambda counts: counts / 1023.0, "ambient": lambda counts: (500.0 - counts) / 500.0}
    return np.hstack([shares[name](counts) for name, counts in zip(controller.senses, senses, strict=True)])


def logistic(x: Any) -> Any:
    return 1.0 / (1.0 + np.exp(-x))


def taken(parameters: Trace, *shapes: tuple[int, ...]) -> list[Trace]:
    """Cut parameters into matrices, and see that none is left."""
    parts, first = [], 0
    for shape in shapes:
        size = int(np.prod(shape))
        parts.append(parameters[first : first + size].reshape(shape))
        first += size
    assert first == len(parameters)
    return parts


def feed_forward(
    hidden: tuple[int, ...], parameters: Trace, inputs: Trace, *, feedback: bool, is_cut: bool, share: float = 0.0
) -> Trace:
    last, traces = np.zeros(2 * feedback), np.zeros(inputs.shape[1] * (share > 0))
    counts = [inputs.shape[1] + len(last) + len(traces), *hidden, 2]
    layers = taken(parameters, *((1 + counts[k], counts[k + 1]) for k in range(len(counts) - 1)))
    wheels = []
    for each in inputs:
        x = np.concatenate([each, last, traces])
        for layer in layers[:-1]:
            x = np.tanh(layer[0] + x @ layer[1:])
        total = layers[-1][0] + x @ layers[-1][1:]
        wheels.append(np.clip(total, -1, 1) if is_cut else np.tanh(total))
        last, traces = wheels[-1][: len(last)], traces + share * (each[: len(traces)] - traces)
    return np.array(wheels)


def elman(parameters: Trace, inputs: Trace) -> Trace:
    to_units, to_wheels = taken(parameters, (20, 3), (4, 2))
    h, expected = np.zeros(3), []
    for x in inputs:
        h = np.tanh(to_units[0] + np.concatenate([x, h]) @ to_units[1:])
        expected.append(np.tanh(to_wheels[0] + h @ to_wheels[1:]))
    return np.array(expected)


def gru(parameters: Trace, inputs: Trace) -> Trace:
    to_gates, to_units, to_wheels = taken(parameters, (20, 6), (20, 3), (4, 2))
    h, expected = np.zeros(3), []
    for x in inputs:
        gates = logistic(to_gates[0] + np.concatenate([x, h]) @ to_gates[1:])
        z, r = gates[:3], gates[3:]
        h = z * h + (1 - z) * np.tanh(to_units[0] + np.concatenate([x, r * h]) @ to_units[1:])
        expected.append(np.tanh(to_wheels[0] + h @ to_wheels[1:]))
    return np.array(expected)


def graph(parameters: Trace, inputs: Trace) -> Trace:
    (weights,) = taken(parameters, (1 + 16 + 5, 5))
    y, expected = np.zeros(5), []
    for x in inputs:
        y = np.tanh(weights[0] + np.concatenate([x, y]) @ weights[1:])
        expected.append(y[:2])
    return np.array(expected)


def covariance(w: float, x: float, y: float) -> float:
    f = np.tanh(4 * (1 - abs(x - y)) - 2)
    return float((1 - w) * f if f > 0 else w * f)


HEBB_RULES = {
    (False, False): lambda w, x, y: (1 - w) * x * y,
    (False, True): lambda w, x, y: w * (-1 + x) * y + (1 - w) * x * y,
    (True, False): lambda w, x, y: w * x * (-1 + y) + (1 - w) * x * y,
    (True, True): covariance,
}
"""The rules of Floreano and Mondada (1996) as they wrote them, by the bits."""


def plastic(per: str, parameters: Trace, inputs: Trace) -> Trace:
    neurons, sender_count = 4, inputs.shape[1] + 5
    table = (sender_count, neurons)
    if per == "synapse":
        rates, first, second = taken(parameters, table, table, table)
        signs = np.sign(rates)
    else:
        given, *of_neurons = taken(parameters, (sender_count, 1), *[(1, neurons)] * 3)
        signs = np.sign(np.broadcast_to(given, table))
        rates, first, second = (np.broadcast_to(each, table) for each in of_neurons)
    weights, y, wheels = np.zeros(table), np.zeros(neurons), []
    for each in inputs:
        x = np.concatenate([np.clip(each, 0, 1), y, [1.0]])
        y = logistic(4 * x @ (signs * weights))
        for sender in range(sender_count):
            for k in range(neurons):
                rule = HEBB_RULES[bool(first[sender, k] > 0), bool(second[sender, k] > 0)]
                rate = abs(rates[sender, k]) / (1 + abs(rates[sender, k]))
                weights[sender, k] += rate * rule(weights[sender, k], x[sender], y[k])
        wheels.append(2 * y[:2] - 1)
    return np.array(wheels)


NETWORKS: list[tuple[str, dict[str, Any], Callable[[Trace, Trace], Trace], float]] = [
    ("linear", {"speed_limit": 7.0}, partial(feed_forward, (), feedback=False, is_cut=True), 1e-12),
    ("mlp", {"hidden": (), "feedback": True}, partial(feed_forward, (), feedback=True, is_cut=False), 1e-3),
    (
        "mlp",
        {"hidden": (5, 3), "senses": BOTH, "feedback": True, "trace_share": 0.1},
        partial(feed_forward, (5, 3), feedback=True, is_cut=False, share=0.1),
        1e-3,
    ),
    ("gru", {"units": 3, "senses": BOTH[::-1]}, gru, 1e-3),
    ("elman", {"units": 3, "senses": BOTH, "speed_limit": 8.0}, elman, 1e-3),
    ("graph", {"hidden": 3, "senses": BOTH, "speed_limit": 8.0}, graph, 1e-3),
    ("plastic", {"neurons": 4, "senses": BOTH[::-1]}, partial(plastic, "synapse"), 5e-3),
    ("plastic", {"neurons": 4, "per": "neuron"}, partial(plastic, "neuron"), 5e-3),
    ("linear", {"trace_share": 0.3}, partial(feed_forward, (), feedback=False, is_cut=True, share=0.3), 1e-12),
    ("mlp", {"hidden": (6,)}, partial(feed_forward, (6,), feedback=False, is_cut=False), 1e-3),
    ("plastic", {"neurons": 4}, partial(plastic, "synapse"), 5e-3),
    ("plastic", {"neurons": 4, "senses": BOTH[::-1], "per": "neuron"}, partial(plastic, "neuron"), 5e-3),
]


@pytest.mark.parametrize(("kind", "options", "shares", "tolerance"), cases(NETWORKS, 8))
def test_a_controller_computes_what_numpy_does(kind: str, options: Any, shares: Any, tolerance: float) -> None:
    controller = getattr(kiks.controllers, kind)(**options)
    parameters = (0.8 if kind == "linear" else 1.0) * kiks.controllers.random_parameters(controller, 1, seed=1)[0]
    sensors = readings(controller, 60 if kind == "plastic" else 12)
    expected = shares(parameters, inputs_of(controller, sensors))
    limit = options.get("speed_limit", 10.0)
    np.testing.assert_allclose(outputs(controller, parameters, sensors), limit * expected, atol=tolerance)
    if kind == "linear":
        assert abs(expected).max() == 1.0
        assert abs(expected).min() < 0.5


CTRNN = kiks.controllers.ctrnn(neurons=3, period_s=0.05, time_constant_s=0.2, senses=BOTH)


@pytest.mark.parametrize("time_constant_s", [0.01, 0.2, 2.5])
def test_ctrnn(time_constant_s: float) -> None:
    parameters = kiks.controllers.random_parameters(CTRNN, 1, seed=3)[0]
    parameters[:3] += np.log(time_constant_s / 0.2)
    logarithms, biases, to_inputs, to_neurons = taken(parameters, (3,), (3,), (16, 3), (3, 3))
    constants_s = 0.2 * np.exp(np.clip(logarithms, -4, 4))
    step_count = max(int(np.ceil(0.1 / constants_s.min())), 1)
    y, expected = np.zeros(3), []
    sensors = readings(CTRNN)
    for x in inputs_of(CTRNN, sensors):
        for _ in range(step_count):
            drive = 4 * (logistic(y + 4 * biases) @ to_neurons + x @ to_inputs)
            y = y + 0.05 / step_count / constants_s * (drive - y)
        expected.append(10.0 * (2.0 * logistic(y + 4 * biases) - 1.0)[:2])
    np.testing.assert_allclose(outputs(CTRNN, parameters, sensors), expected, atol=5e-2)


@pytest.mark.parametrize("logarithm", [-1000.0, 1000.0])
def test_ctrnn_of_any_time_constant_stays_in_its_bounds(logarithm: float) -> None:
    parameters = np.full(CTRNN.parameter_count or 0, 1.0)
    parameters[:3] = logarithm
    assert abs(outputs(CTRNN, parameters, readings(CTRNN, 200))).max() <= 10.0


def test_exponential_between() -> None:
    between = callable_kernel(neural_nets.exponential_between.py_func)
    x = np.linspace(-6, 6, 1201)
    np.testing.assert_allclose([between(each) for each in x], np.exp(np.clip(x, -4, 4)), rtol=1e-3)


def test_the_weights_of_a_plastic_network_stay_between_0_and_1() -> None:
    controller = kiks.controllers.plastic(neurons=4, senses=BOTH[::-1])
    assert controller.memory_count == 4 + (16 + 5) * 4
    for seed, scale in ((1, 1.0), (2, 30.0), (3, 1e300)):
        parameters = scale * kiks.controllers.random_parameters(controller, 1, seed=seed)[0]
        memory, wheels = np.zeros(controller.memory_count), np.zeros(2)
        for reading in readings(controller, 100, seed):
            controller(reading, memory, parameters, wheels)
            assert memory.min() >= 0.0
            assert memory.max() <= 1.0 + 1e-12
            assert abs(wheels).max() <= 10.0


def test_random_parameters() -> None:
    controller = kiks.controllers.linear()
    drawn = kiks.controllers.random_parameters(controller, 1000, seed=1)
    assert drawn.shape == (1000, 18)
    assert abs(drawn.mean()) < 0.05
    assert drawn.std() == pytest.approx(1.0, abs=0.05)
    np.testing.assert_array_equal(drawn, kiks.controllers.random_parameters(controller, 1000, seed=1))

    with pytest.raises(kiks.ParameterError, match=r"'ahead' must say how many parameters.*parameters=\.\.\."):
        kiks.controllers.random_parameters(kiks.controller(ahead.function), 3, seed=1)


def test_speeds_are_clamped_and_nan_is_zero() -> None:
    assert whole_speeds(np.array([np.nan, 1e300]), 1.0, 127) == (0, 127)
    assert whole_speeds(np.array([-np.inf, 2.5]), 1.0, 127) == (-127, 2)
    assert whole_speeds(np.array([10.0, 20.0]), 62.1, 1000) == (621, 1000)


def test_arguments_out_of_range() -> None:
    controllers = kiks.controllers
    refused(r"hidden\[0\] must be at least 1", controllers.mlp, hidden=(0,))
    refused("period_s must be at least 0.001, but it was 0", controllers.ctrnn, period_s=0)
    refused("per must be 'synapse' or 'neuron', but it was 'node'", controllers.plastic, per="node")
    refused("Did you mean 'proximity'", controllers.linear, senses=("proximty",))
    refused("senses must name each sense once", controllers.linear, senses=("ambient", "ambient"))
    refused("senses must have at least 1 item", controllers.linear, senses=())
