"""What a proximity sensor makes of its seven rays: the responses that a robot's file can name.

A response takes the length of each ray [mm] and the brightness 1..255 of what it met, 0 for nothing, and says how many
counts above its baseline the sensor expects. Where the rays begin and go is the response's own, too
(`kiks.engine.parameters`); gain, baseline, noise and rounding are common to all and no part of it.

* STANDIN: a formula in place of the lost table of KiKS 2.2.0 (kiks-behaviour.md 3.1.1).
* THESIS, FAST: the thesis's networks, and its table made of them (`kiks.engine.networks`).
* CURVE: counts against distance as measured, times reflectance, over rays that count less off the axis
  (khepera-protocol.md 8.6).

A further one is a number here, a name in `kiks.model.robot.RESPONSES`, its kernel and a branch of `respond`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import kernel
from kiks.engine.lanes import stack_floats
from kiks.engine.networks import network_count, table_count
from kiks.engine.numbers import exponential, power
from kiks.engine.parameters import CURVE_POINT_COUNT, RAY_COUNT, STANDIN_REACH
from kiks.model.materials import BLACK_REFLECTANCE

STANDIN, THESIS, FAST, CURVE = 0, 1, 2, 3
"""Responses in the order of `kiks.model.robot.RESPONSES`."""

_WEIGHTS = (0.35, 0.33, 0.69, 0.43, 0.69, 0.33, 0.35)  # kiks-behaviour.md 3.1.1


@kernel
def darkness(brightness: Any) -> Any:
    """Return by how much a dark surface looks farther: black counts half of white (thesis 3.4)."""
    return 0.5 + brightness * (0.5 / 255.0)


@kernel
def reflectance(brightness: Any) -> Any:
    """Return the share of light that a surface sends back (`kiks.model.materials`), 0 for nothing."""
    return BLACK_REFLECTANCE + brightness * ((1.0 - BLACK_REFLECTANCE) / 255.0) if brightness > 0.0 else 0.0


@kernel
def standin_count(range_mm: Any, lengths_mm: Any, brightnesses: Any) -> Any:
    """Return the count of the stand-in; lengths are shares of the robot's own range."""
    total, per_range = 0.0, 1.0 / range_mm
    for ray in range(RAY_COUNT):
        if brightnesses[ray] > 0.0:
            inverted = min(max(STANDIN_REACH - lengths_mm[ray] * per_range, 0.0), 0.98)
            near = inverted * darkness(brightnesses[ray])
            root = math.sqrt(near)
            total += _WEIGHTS[ray] * near * root * math.sqrt(root)  # to the power of 1.75
    if total == 0.0:
        return 0.0
    return 1023.0 * (1.0 - exponential(-power(total, 1.61)))


@kernel
def inverted_lengths(range_mm: Any, lengths_mm: Any, brightnesses: Any, seen: Any) -> Any:
    """Write the inputs of the thesis's networks: 1 at the sensor, 0 out of range, less for a dark surface."""
    per_range = 1.0 / range_mm
    for ray in range(RAY_COUNT):
        inverted = max(1.0 - lengths_mm[ray] * per_range, 0.0)
        seen[ray] = inverted * darkness(brightnesses[ray]) if brightnesses[ray] > 0.0 else 0.0


@kernel
def curve_count(parameters: Any, lengths_mm: Any, brightnesses: Any) -> Any:
    """Return the count of a measured curve, whose values up to its range stand in the robot's record."""
    total, points_per_mm = 0.0, (CURVE_POINT_COUNT - 1) / parameters.range_mm
    for ray in range(RAY_COUNT):
        place = min(max(lengths_mm[ray] * points_per_mm, 0.0), CURVE_POINT_COUNT - 1.001)
        i = np.int64(place)
        low, high = parameters.curve_counts[i], parameters.curve_counts[i + 1]
        total += parameters.ray_weight[ray] * reflectance(brightnesses[ray]) * (low + (place - i) * (high - low))
    return total


@kernel
def respond(networks: Any, parameters: Any, sensor: Any, lengths_mm: Any, brightnesses: Any) -> Any:
    """Return the counts above its baseline that a sensor expects, by the response of the robot's file."""
    if parameters.response == STANDIN:
        return standin_count(parameters.range_mm, lengths_mm, brightnesses)
    if parameters.response == CURVE:
        return curve_count(parameters, lengths_mm, brightnesses)
    seen = stack_floats(RAY_COUNT)
    inverted_lengths(parameters.range_mm, lengths_mm, brightnesses, seen)
    if parameters.response == FAST:
        return table_count(networks[0].table, seen)
    return network_count(networks[0].hidden, networks[0].middle, networks[0].last, sensor, seen)
