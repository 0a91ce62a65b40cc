"""The light of lamps on the floor, for each picture of it: as much as a sensor that faces the lamp would see.

Need: where the floor is yellow, a program can find the lamp. A sensor reads fewer counts the more light falls on it,
and its readings are noisy.
Method: the strength is the logarithm of the signal, which is how many times the noise a reading differs from the one
without lamps: 0 where both are equal, 1 on a lamp. Desk and page get it as a table of distances, and call the same
kernel (`desk/web/light_map.js`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import count
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec

LONGEST_SIDE = 240
"""Cells of the longer side of a map."""


class LightScale(NamedTuple):
    """How strong light is.

    Attributes:
        step_mm: Distance between two strengths of the table [mm].
        strengths: Where a lamp of 1 W is 0, 1, 2, ... steps away: 1 at a lamp, to 0.
        background_flux: Daylight [W/mm^2].
    """

    step_mm: float
    strengths: tuple[float, ...]
    background_flux: float


@lru_cache(16)
def light_scale(spec: RobotSpec | None) -> LightScale:
    """Return how strong light is for the sensors of a kind of robot; those of a Khepera if None.

    Example:
        >>> scale = light_scale(RobotSpec.load("khepera"))
        >>> scale.step_mm * len(scale.strengths)  # a sensor reads 440 there, and 450 +-10 in the dark
        250.0
    """
    from kiks.engine.parameters import pack
    from kiks.engine.sensing.ambient import curve

    parameters = pack(spec or RobotSpec.load("khepera")).view(np.recarray)[0]
    # Readings are whole numbers: without noise, the signal is at least one count.
    noise = max(float(parameters.dark_noise_counts), 1.0)

    def signal(step: int) -> float:
        reading = float(curve.py_func(parameters, step * parameters.lamp_step_mm))
        return (float(parameters.background_counts) - reading) / noise

    most, strengths = math.log(max(signal(0), math.e)), []
    for step in count():
        if (found := signal(step)) <= 1.0:
            break
        strengths.append(round(math.log(found) / most, 4))
    return LightScale(float(parameters.lamp_step_mm), (*strengths, 0.0), float(parameters.background_flux))


def light_map(arena: Arena, lamps: NDArray[np.float64], specs: Sequence[RobotSpec]) -> NDArray[np.float32] | None:
    """Return how strong the light of lamps is on the floor; None if no lamp is on.

    Args:
        arena: The arena, whose walls cast shadows.
        lamps: x_mm, y_mm, power_w, and 1 for on or 0 for off, float64 [lamp, 4].
        specs: The robots; the sensors of the first see it, or those of a Khepera.

    Returns:
        0 to 1, float32 [row, column], row 0 on top; cells of some millimetres.
    """
    from kiks.engine.sensing.lamplight import light_floor

    if not ((lamps[:, 3] > 0) & (lamps[:, 2] > 0)).any():
        return None
    scale, cell_mm = light_scale(next(iter(specs), None)), max(arena.width_mm, arena.height_mm) / LONGEST_SIDE
    columns, rows = (max(round(side / cell_mm), 1) for side in (arena.width_mm, arena.height_mm))
    found = np.empty((rows, columns), np.float32)
    strengths = np.array(scale.strengths)
    places = arena.brightness, float(arena.mm_per_cell), np.ascontiguousarray(lamps)
    light_floor(*places, strengths, scale.step_mm, scale.background_flux, found)
    return np.flipud(found)
