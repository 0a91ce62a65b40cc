"""The responses of proximity sensors: they map seven rays to counts. A robot's file names one.

A response takes the length of each ray [mm], the cosine of its angle of incidence and the brightness of the surface
(1..255, 0 for no hit), and returns the expected counts above the baseline. The rays' origins and directions belong to
the response, too (`kiks.engine.parameters`); baseline, noise and rounding are common to all responses. The sensor's
gain is a factor on the light if the response computes it, otherwise on the counts.

* REFLECTION: the light that returns along the rays, and its share above a threshold (`kiks.model.robot.Reflection`).
* THESIS, FAST: the thesis's networks, and its table made of them (`kiks.engine.sensing.thesis_networks`).
* CURVE: measured counts over distance, times reflectance, over rays that are weighted by their angle off the axis
  (khepera-protocol.md 8.6).

A new response needs a number here, a name in `kiks.model.robot.RESPONSES`, a kernel and a branch of `respond`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.parameters import CURVE_POINT_COUNT, RAY_COUNT
from kiks.engine.sensing.thesis_networks import network_count, table_count
from kiks.engine.simd.lanes import LANES, load, narrow, store, total
from kiks.engine.simd.masks import choose
from kiks.engine.simd.stack_arrays import stack_floats, stack_narrow
from kiks.model.materials import BLACK_REFLECTANCE

REFLECTION, THESIS, FAST, CURVE = 0, 1, 2, 3
"""Responses in the order of `kiks.model.robot.RESPONSES`."""


@kernel
def darkness(brightness: Any) -> Any:
    """Return the weight of a surface's brightness: black counts half as much as white (thesis 3.4)."""
    return 0.5 + brightness * (0.5 / 255.0)


@kernel
def reflectance(brightness: Any) -> Any:
    """Return the reflectance of a surface (`kiks.model.materials`), 0 for no hit; of one or eight."""
    return choose(brightness > 0.0, BLACK_REFLECTANCE + brightness * ((1.0 - BLACK_REFLECTANCE) / 255.0), 0.0)


@kernel
def ramp(share: Any, rounding: Any) -> Any:
    """Return the positive part of a number, or of eight, with a parabola between -rounding and +rounding."""
    bent = (share + rounding) * (share + rounding) / (4.0 * rounding)
    return choose(share <= -rounding, 0.0, choose(share >= rounding, share, bent))


@inlined
def light_of(parameters: Any, sensor: Any, lengths_mm: Any, cosines: Any, brightnesses: Any) -> Any:
    """Return the light that returns to a sensor; its rays are `Lanes`."""
    near = cosines / (lengths_mm + parameters.behind_mm)
    return total(load(parameters.ray_weight[sensor]) * reflectance(brightnesses) * near * near * near)


@inlined
def reflection_count(parameters: Any, threshold: Any, gain: Any, light: Any) -> Any:
    """Return the count for the light that returns to a sensor, or to eight, from its threshold and gain."""
    share = (1.0 + threshold) * gain * light - threshold
    rounded = ramp(share, parameters.faint) - ramp(share - 1.0, parameters.bright)
    return parameters.maximum_counts * max(rounded, 0.0)


@inlined
def nearnesses(range_mm: Any, lengths_mm: Any, brightnesses: Any) -> Any:
    """Return the inputs of the thesis's networks: 1 at the sensor, 0 out of range, less for a dark surface; `Lanes`."""
    inverted = max(1.0 - lengths_mm * (1.0 / range_mm), 0.0)
    return choose(brightnesses > 0.0, inverted * darkness(brightnesses), 0.0)


@kernel
def curve_count(parameters: Any, sensor: Any, lengths: Any, shades: Any) -> Any:
    """Return the count of a measured curve, whose values up to its range are in the robot's record."""
    lengths_mm, brightnesses = stack_floats(LANES), stack_floats(LANES)
    store(lengths_mm, lengths)
    store(brightnesses, shades)
    total, points_per_mm = 0.0, (CURVE_POINT_COUNT - 1) / parameters.range_mm
    for ray in range(RAY_COUNT):
        # A little less than the last point, so that there is a next one to go to.
        place = min(max(0.0, lengths_mm[ray] * points_per_mm), CURVE_POINT_COUNT - 1.001)
        i = np.int64(place)
        low, high = parameters.curve_counts[i], parameters.curve_counts[i + 1]
        weight = parameters.ray_weight[sensor, ray] * reflectance(brightnesses[ray])
        total += weight * (low + (place - i) * (high - low))
    return total


@kernel
def respond(networks: Any, parameters: Any, sensor: Any, lengths_mm: Any, cosines: Any, brightnesses: Any) -> Any:
    """Return the expected counts of a sensor above its baseline by its robot's response; the rays are `Lanes`."""
    if parameters.response == REFLECTION:
        light = light_of(parameters, sensor, lengths_mm, cosines, brightnesses)
        return reflection_count(parameters, parameters.threshold[sensor], parameters.gain[sensor], light)
    gain = parameters.gain[sensor]
    if parameters.response == THESIS or parameters.response == FAST:
        seen = stack_narrow(LANES)
        store(seen, narrow(nearnesses(parameters.range_mm, lengths_mm, brightnesses)))
        if parameters.response == THESIS:
            return gain * network_count(networks[0], sensor, seen)
        return gain * table_count(networks[0].table, seen)
    return gain * curve_count(parameters, sensor, lengths_mm, brightnesses)


@entry
def respond_all(networks: Any, kinds: Any, lengths_mm: Any, cosines: Any, out: Any) -> Any:
    """Write the expected counts above the baseline for white surfaces.

    Args:
        networks: What the response needs of the thesis's networks (`networks_for`).
        kinds: Records of `PARAMETERS`, shape [1].
        lengths_mm: Lengths of rays [mm], shape [samples, 8, 7].
        cosines: Cosines of the angles of incidence, 0 for a ray without a hit, shape [samples, 8, 7].
        out: Output: counts, shape [samples, 8].
    """
    padded_mm, padded = stack_floats(LANES), stack_floats(LANES)
    # The lane over: any length but 0, as the light is divided by it, and no hit.
    padded_mm[RAY_COUNT], padded[RAY_COUNT] = 1.0, 0.0
    for sample in range(out.shape[0]):
        for sensor in range(out.shape[1]):
            for ray in range(RAY_COUNT):
                padded_mm[ray], padded[ray] = lengths_mm[sample, sensor, ray], cosines[sample, sensor, ray]
            shades = choose(load(padded) > 0.0, 255.0, 0.0)
            out[sample, sensor] = respond(networks, kinds[0], sensor, load(padded_mm), load(padded), shades)
