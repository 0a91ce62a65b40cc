"""Networks: exact gradients, training that trains, the same by the same seed; kernels that agree with NumPy."""

import json
import math

import numpy as np
import pytest
from tools.sensors import train_networks

from kiks import ParameterError, RobotSpec
from kiks.engine import numbers
from kiks.engine.compiling import callable_kernel
from kiks.engine.parameters import pack
from kiks.engine.sensing import thesis_networks as kernels
from kiks.engine.sensing.responses import respond_all
from kiks.fit.samples import Samples
from kiks.model.thesis_networks import THESIS, NetworkResponse

SIZES = sorted(train_networks.SIZES)
LAYERS = train_networks.SIZES[train_networks.THESIS_SIZE]


def parameters_of(layers, rng):
    return train_networks._draw(layers, 7, rng)


@pytest.mark.parametrize("size", SIZES)
def test_the_jacobian_is_exact(size):
    rng = np.random.default_rng(1)
    layers = train_networks.SIZES[size]
    parameters = parameters_of(layers, rng)
    inputs, targets = rng.random((20, 7)), rng.uniform(0.1, 0.9, 20)
    _, jacobian = train_networks.residuals_and_jacobian(parameters, layers, inputs, targets)
    for k in range(len(parameters)):
        step = np.zeros(len(parameters))
        step[k] = 1e-6
        above, _ = train_networks.residuals_and_jacobian(parameters + step, layers, inputs, targets)
        below, _ = train_networks.residuals_and_jacobian(parameters - step, layers, inputs, targets)
        np.testing.assert_allclose(jacobian[:, k], (above - below) / 2e-6, atol=1e-7)


def test_what_the_converter_cuts_off_is_no_error():
    parameters = np.array([0.0] * 7 + [1.5])
    inputs, layers = np.zeros((2, 7)), train_networks.SIZES["no hidden layer"]
    residuals, jacobian = train_networks.residuals_and_jacobian(parameters, layers, inputs, np.array([1.0, 0.5]))
    assert residuals.tolist() == [0.0, 1.0]
    assert jacobian[:, 7].tolist() == [0.0, 1.0]
    residuals, _ = train_networks.residuals_and_jacobian(-parameters, layers, inputs, np.array([0.01, 0.5]))
    assert residuals.tolist() == [0.0, -2.0]


def made_up(count=400):
    rng = np.random.default_rng(3)
    inputs = rng.random((count, 7))
    return inputs, 1023.0 / (1.0 + np.exp(-20.0 * (inputs[:, 3] * inputs[:, 2] - 0.3)))


def error_of(network, inputs, counts):
    return float(np.mean(np.abs(network(inputs) - counts)))


@pytest.fixture
def briefly(monkeypatch):
    monkeypatch.setattr(train_networks, "ITERATIONS", 3)


@pytest.mark.slow
def test_training_reduces_the_error(monkeypatch):
    monkeypatch.setattr(train_networks, "ITERATIONS", 30)
    inputs, counts = made_up()
    weights = train_networks.unpack(parameters_of(LAYERS, np.random.default_rng(0)), LAYERS, 7)
    start = train_networks.Network(weights, (True, False, False))
    linear = train_networks.train(inputs, counts, train_networks.SIZES["no hidden layer"], seed=0, starts=1)
    thesis = train_networks.train(inputs, counts, LAYERS, seed=0, starts=1)
    assert error_of(linear, inputs, counts) < 0.7 * error_of(start, inputs, counts)
    assert error_of(thesis, inputs, counts) < 0.5 * error_of(linear, inputs, counts)


@pytest.mark.usefixtures("briefly")
def test_the_same_seed_trains_the_same_network():
    inputs, counts = made_up(150)
    one, two, other = (train_networks.train(inputs, counts, LAYERS, seed=seed, starts=1) for seed in (4, 4, 5))
    for a, b, c in zip(one.weights, two.weights, other.weights, strict=True):
        np.testing.assert_array_equal(a, b)
        assert not np.array_equal(a, c)
    with pytest.raises(ParameterError, match="at least 10 samples with something near and 1 start"):
        train_networks.train(inputs[:9], counts[:9], LAYERS, seed=0)


@pytest.mark.usefixtures("briefly")
def test_sensors_are_trained_on_samples_and_saved(tmp_path):
    angles = np.tile(np.arange(0.0, 360.0, 10.0), (5, 1))
    counts = np.random.default_rng(0).integers(0, 1024, (5, 36, 8))
    samples = Samples("wall", math.inf, np.arange(5.0, 15.0, 2.0), angles, counts)
    said = []
    trained = train_networks.train_sensors([samples], LAYERS, starts=1, progress=said.append)
    assert said == [f"sensor {sensor}" for sensor in range(8)]
    answers, expected = train_networks.predictions([samples], trained)
    assert answers.shape == expected.shape
    assert train_networks.errors(answers, answers + 3.0) == pytest.approx((3.0, 3.0, 3.0))
    response = train_networks.response_of(trained)
    response.save(tmp_path / "mine.json")
    again = NetworkResponse.load(tmp_path / "mine.json")
    for here, there in zip(response.weights, again.weights, strict=True):
        np.testing.assert_allclose(here, there, rtol=1e-5)
    fan = train_networks.fan_of(again)
    np.testing.assert_allclose(np.degrees(fan.direction_rad[2]), [72, 52, 32, 12, -8, -28, -48])


def test_tanh():
    tanh = callable_kernel(numbers.tanh.py_func)
    for x in np.linspace(-20.0, 20.0, 4001):
        assert tanh(x) == pytest.approx(math.tanh(x), abs=7e-6)
        assert tanh(-x) == -tanh(x)
        assert abs(tanh(x)) <= 1.0


def respond(response, seen):
    """Return the counts for nearnesses by a response of the thesis, shape [samples, 8]."""
    kinds, out = pack(RobotSpec.load("khepera", response=response)), np.empty(seen.shape[:2])
    lengths_mm = (1.0 - seen) * kinds["range_mm"]
    respond_all(kernels.networks_for(response), kinds, lengths_mm, np.ones_like(seen), out)
    return out


def test_the_table_is_the_mean_of_the_networks():
    table = kernels.networks_for("fast")["table"][0]
    assert table.shape == (6**7,)
    assert table[0] == table.min() == 0.0
    assert table.max() <= 1023.0
    rng = np.random.default_rng(0)
    levels = rng.integers(0, 6, (50, 7))
    seen = np.repeat((levels / 5.0)[:, None], 8, axis=1)
    out = respond("thesis", seen)
    # Anything that rounds to the same level is the same entry.
    nearby = np.clip(seen + rng.uniform(-0.09, 0.09, seen.shape), 0.0, 1.0)
    means = np.repeat(out.mean(axis=1)[:, None], 8, axis=1)
    np.testing.assert_allclose(respond("fast", nearby), means, rtol=1e-5, atol=1e-3)


def test_kernels_against_numpy():
    response = NetworkResponse.load()
    seen = np.random.default_rng(1).random((200, 8, 7))
    out = respond("thesis", seen)
    for sensor in range(8):
        hidden, middle, last = (each[sensor] for each in response.weights)
        network = train_networks.Network((hidden, middle, last[None]), (True, False, False))
        np.testing.assert_allclose(out[:, sensor], np.clip(network(seen[:, sensor]), 0, 1023), atol=0.5)


def test_networks_have_their_shape(tmp_path):
    zeros = [[0.0] * 8]
    for change, words in (
        (None, r"must be a table, but it was \[\]. `python tools/accuracy.py"),
        ({"hidden": [[1.0]]}, r"hidden\[0\]\[0\] must be a list, but it was 1.0"),
        ({"hidden": []}, "hidden must have at least 8 items"),
        ({"hidden": [zeros * 13] * 7 + [zeros * 12 + [[1e7] * 8]]}, r"hidden\[7\]\[12\]\[0\] must be at most 1000000"),
        ({"field_of_view_deg": 1e9}, "field_of_view_deg must be at most 180"),
    ):
        data = [] if change is None else json.loads(THESIS.read_text()) | change
        (tmp_path / "net.json").write_text(json.dumps(data))
        with pytest.raises(ParameterError, match=words):
            NetworkResponse.load(tmp_path / "net.json")
        with pytest.raises(ParameterError, match="networks must go to a file that can be written"):
            NetworkResponse.load().save(tmp_path / "no" / "net.json")
