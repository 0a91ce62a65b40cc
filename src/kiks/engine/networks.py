"""The thesis's networks and its fast table: from the nearnesses of seven rays to a count.

Source: thesis section 3.3, "7 input neurons, 13+7 neurons in 2 hidden layers, 1 linear output neuron" and "The 'Fast
sensors' setting". A nearness is 1 for a ray of no length and 0 for one that meets nothing in range. Of each row of
weights the last is the bias; their shapes stand in `kiks.model.network`. Sums run in a fixed order.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.compiling import entry, kernel
from kiks.engine.numbers import tanh
from kiks.model.network import INPUT_COUNT, LINEAR_COUNT, TANH_COUNT, NetworkResponse
from kiks.model.robot import SENSOR_COUNT

TABLE_LEVELS = 6
"""Values of each ray that the table knows: 0, 10, ..., 50 mm (thesis 3.3)."""

TABLE_SIZE = TABLE_LEVELS**7
"""Entries of the table."""

NETWORK_RESPONSES = ("thesis", "fast")
"""Responses of robots' files that need a record of `NETWORKS`."""

NETWORKS = np.dtype(
    [
        ("hidden", "f8", (SENSOR_COUNT, TANH_COUNT, INPUT_COUNT + 1)),
        ("middle", "f8", (SENSOR_COUNT, LINEAR_COUNT, TANH_COUNT + 1)),
        ("last", "f8", (SENSOR_COUNT, LINEAR_COUNT + 1)),
        ("table", "f4", (TABLE_SIZE,)),  # zeros unless it is wanted
    ],
    align=True,
)
"""Weights and table for the sensors' kernels: one record for all robots, as it has a megabyte."""

MAXIMUM = 1023.0


@kernel
def network_count(hidden: Any, middle: Any, last: Any, sensor: Any, seen: Any) -> Any:
    """Return the count for the seven nearnesses of a sensor: 0 if nothing is near, else what its network says."""
    rays = seen.shape[0]
    nearest = 0.0
    for ray in range(rays):
        nearest = max(nearest, seen[ray])
    if nearest <= 0.0:
        return 0.0
    first = np.empty(hidden.shape[1], np.float64)
    for neuron in range(first.shape[0]):
        total = hidden[sensor, neuron, rays]
        for ray in range(rays):
            total += hidden[sensor, neuron, ray] * seen[ray]
        first[neuron] = tanh(total)
    linear_count = middle.shape[1]
    count = last[sensor, linear_count]
    for neuron in range(linear_count):
        total = middle[sensor, neuron, first.shape[0]]
        for k in range(first.shape[0]):
            total += middle[sensor, neuron, k] * first[k]
        count += last[sensor, neuron] * total
    return min(max(count, 0.0), MAXIMUM)


@kernel
def table_count(table: Any, seen: Any) -> Any:
    """Return the table's count for seven nearnesses, each rounded to the nearest fifth; the first ray counts most."""
    index = 0
    for ray in range(seen.shape[0]):
        nearest: Any = np.int64(seen[ray] * (TABLE_LEVELS - 1) + 0.5)
        index = index * TABLE_LEVELS + min(max(nearest, 0), TABLE_LEVELS - 1)
    return np.float64(table[index])


@entry
def fill_table(hidden: Any, middle: Any, last: Any, table: Any) -> Any:
    """Write the mean of all sensors' networks for each pattern into `table`, float32 of the shape [6^7]."""
    rays = hidden.shape[2] - 1
    seen = np.empty(rays, np.float64)
    for index in range(table.shape[0]):
        digits = index
        for ray in range(rays - 1, -1, -1):
            seen[ray] = (digits % TABLE_LEVELS) / (TABLE_LEVELS - 1)
            digits //= TABLE_LEVELS
        total = 0.0
        for sensor in range(hidden.shape[0]):
            total += network_count(hidden, middle, last, sensor, seen)
        table[index] = total / hidden.shape[0]


@entry
def respond_networks(hidden: Any, middle: Any, last: Any, seen: Any, out: Any) -> Any:
    """Write the counts for many nearnesses, shape [samples, 8, 7], into `out`, shape [samples, 8]."""
    for sample in range(seen.shape[0]):
        for sensor in range(seen.shape[1]):
            out[sample, sensor] = network_count(hidden, middle, last, sensor, seen[sample, sensor])


@entry
def respond_table(table: Any, seen: Any, out: Any) -> Any:
    """Write the table's counts for many nearnesses, shape [samples, 8, 7], into `out`, shape [samples, 8]."""
    for sample in range(seen.shape[0]):
        for sensor in range(seen.shape[1]):
            out[sample, sensor] = table_count(table, seen[sample, sensor])


@functools.cache
def networks_for(*responses: str) -> NDArray[np.void]:
    """Return what responses of robots' files need of the networks that come with KiKS, shape [1] or [0]."""
    packed = np.zeros(0 if set(responses).isdisjoint(NETWORK_RESPONSES) else 1, NETWORKS)
    if len(packed):
        networks = NetworkResponse.load()
        packed["hidden"], packed["middle"], packed["last"] = networks.weights
        if "fast" in responses:
            fill_table(*networks.weights, packed["table"][0])
    packed.setflags(write=False)
    return packed
