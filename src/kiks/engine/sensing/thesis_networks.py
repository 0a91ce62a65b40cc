"""The thesis's networks and its fast table: from the nearnesses of seven rays to a count.

Source: thesis section 3.3, "7 input neurons, 13+7 neurons in 2 hidden layers, 1 linear output neuron" and "The 'Fast
sensors' setting". A nearness is 1 for a ray of no length and 0 for one that meets nothing in range. Of each row of
weights in a file the last is the bias; their shapes stand in `kiks.model.thesis_networks`.

Method: the neurons of a sensor are computed eight at a time in float32 (`kiks.engine.simd.lanes`). The second layer and
the output are linear, so they are merged into one when the networks are packed. Sums run in a fixed order.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.numbers import TANH_IS_1, tanh_fraction
from kiks.engine.simd.lanes import LANES, floor, load, total
from kiks.engine.simd.stack_arrays import stack_narrow
from kiks.model.robot import SENSOR_COUNT
from kiks.model.thesis_networks import INPUT_COUNT, TANH_COUNT, NetworkResponse

TABLE_LEVELS = 6
"""Values of each ray that the table knows: 0, 10, ..., 50 mm (thesis 3.3)."""

TABLE_SIZE = TABLE_LEVELS**INPUT_COUNT
"""Entries of the table."""

NETWORK_RESPONSES = ("thesis", "fast")
"""Responses of robots' files that need a record of `NETWORKS`."""

NEURON_COUNT = 2 * LANES
"""Neurons of the first layer that are calculated: the thesis's, and some without weights to fill the lanes."""

NETWORKS = np.dtype(
    [
        # Of each sensor: a row for each ray, then the biases; what each neuron counts, and the bias of that.
        ("hidden", "f4", (SENSOR_COUNT, INPUT_COUNT + 1, NEURON_COUNT)),
        ("output", "f4", (SENSOR_COUNT, NEURON_COUNT)),
        ("bias", "f4", (SENSOR_COUNT,)),
        ("table", "f4", (TABLE_SIZE,)),  # zeros unless it is wanted
    ],
    align=True,
)
"""Weights and table for the sensors' kernels: one record for all robots, as it has a megabyte."""

MAXIMUM = 1023.0

_PLACE_VALUES = np.array([TABLE_LEVELS**k for k in range(INPUT_COUNT - 1, -1, -1)] + [0], np.float32)


@inlined
def tanh(x: Any) -> Any:
    """Return hyperbolic tangents in lanes."""
    return max(-1.0, min(1.0, tanh_fraction(max(-TANH_IS_1, min(TANH_IS_1, x)))))


@kernel
def network_count(networks: Any, sensor: Any, seen: Any) -> Any:
    """Return the count for nearnesses, float32 [8]: 0 if nothing is near, else what the network of the sensor says."""
    nearest = np.float32(0.0)
    for ray in range(INPUT_COUNT):
        nearest = max(nearest, seen[ray])
    if nearest <= 0.0:
        return 0.0
    weights = networks.hidden[sensor]
    first, second = load(weights[INPUT_COUNT]), load(weights[INPUT_COUNT], LANES)
    for ray in range(INPUT_COUNT):
        first = first + load(weights[ray]) * seen[ray]
        second = second + load(weights[ray], LANES) * seen[ray]
    output = networks.output[sensor]
    sums = tanh(first) * load(output) + tanh(second) * load(output, LANES)
    return min(max(np.float64(networks.bias[sensor] + total(sums)), 0.0), MAXIMUM)


@kernel
def table_count(table: Any, seen: Any) -> Any:
    """Return the table's count for nearnesses, float32 [8], each rounded to a fifth; the first ray counts most."""
    levels = floor(load(seen) * (TABLE_LEVELS - 1.0) + 0.5)
    index = total(max(0.0, min(TABLE_LEVELS - 1.0, levels)) * load(_PLACE_VALUES))
    return np.float64(table[np.int64(index)])


@entry
def fill_table(networks: Any, table: Any) -> Any:
    """Write the mean of all sensors' networks, a record of `NETWORKS` [1], for each pattern into `table`, f4 [6^7]."""
    seen = stack_narrow(LANES)
    for index in range(table.shape[0]):
        digits = index
        for ray in range(INPUT_COUNT - 1, -1, -1):
            seen[ray] = (digits % TABLE_LEVELS) / (TABLE_LEVELS - 1)
            digits //= TABLE_LEVELS
        mean = 0.0
        for sensor in range(SENSOR_COUNT):
            mean += network_count(networks[0], sensor, seen)
        table[index] = mean / SENSOR_COUNT


def pack_networks(response: NetworkResponse) -> NDArray[np.void]:
    """Return the weights of networks for the kernels, without a table, shape [1]."""
    packed = np.zeros(1, NETWORKS)
    hidden, middle, last = response.weights
    packed["hidden"][0, :, :, :TANH_COUNT] = hidden.transpose(0, 2, 1)
    last, bias = last[:, :-1], last[:, -1]
    packed["output"][0, :, :TANH_COUNT] = np.einsum("sl,slt->st", last, middle[:, :, :-1])
    packed["bias"][0] = bias + (last * middle[:, :, -1]).sum(axis=1)
    return packed


@functools.cache
def networks_for(*responses: str) -> NDArray[np.void]:
    """Return what responses of robots' files need of the networks that come with KiKS, shape [1] or [0]; read-only."""
    packed = np.zeros(0, NETWORKS)
    if not set(responses).isdisjoint(NETWORK_RESPONSES):
        packed = pack_networks(NetworkResponse.load())
        if "fast" in responses:
            fill_table(packed, packed["table"][0])
    # Both shapes are read-only: a kernel that takes arrays of two types is compiled twice.
    packed.setflags(write=False)
    return packed
