"""The light of lamps on the floor, for each picture of it: as much as a sensor that faces the lamp would see.

Need: where the floor is yellow, a program can find the lamp. A sensor reads fewer counts the more light falls on it,
and its readings are noisy.
Method: the strength is the logarithm of the signal, which is how many times the noise a reading differs from the one
without lamps: 0 where both are equal, 1 on a lamp. Desk and page get it as a table of distances and do the same as
`light_map` in `web/light_map.js`: in each direction, rays find how far the light gets before a wall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import count, product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec

LONGEST_SIDE, DIRECTIONS = 240, 720
"""Cells of the longer side of a map, and directions in which shadows are told apart."""

_NEAREST_MM = 1.0


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
    lit = [lamp for lamp in lamps.tolist() if lamp[3] > 0 and lamp[2] > 0]
    if not lit:
        return None
    scale, cell_mm = light_scale(next(iter(specs), None)), max(arena.width_mm, arena.height_mm) / LONGEST_SIDE
    columns, rows = (max(round(side / cell_mm), 1) for side in (arena.width_mm, arena.height_mm))
    x_mm, y_mm = (np.arange(columns) + 0.5) * cell_mm, arena.height_mm - (np.arange(rows)[:, None] + 0.5) * cell_mm
    flux = np.full((rows, columns), scale.background_flux)
    for lamp_x, lamp_y, power_w, _ in lit:
        dx, dy = x_mm - lamp_x, y_mm - lamp_y
        square = np.maximum(dx * dx + dy * dy, _NEAREST_MM**2)
        turn = (np.arctan2(dy, dx) / (2 * math.pi) + 1) * DIRECTIONS
        before = turn.astype(np.int64)
        reach = _reach_mm(arena, lamp_x, lamp_y, cell_mm) ** 2
        share = turn - before
        seen = (reach[before % DIRECTIONS] >= square) * (1 - share) + (
            reach[(before + 1) % DIRECTIONS] >= square
        ) * share
        flux += seen * power_w / square
    with np.errstate(divide="ignore"):
        steps = 1 / np.sqrt(flux) / scale.step_mm
    strength = np.interp(steps, np.arange(len(scale.strengths)), scale.strengths)
    # Shadows have soft edges.
    around = np.pad(strength, 1, mode="edge")
    soft = np.zeros_like(strength)
    for row, column in product(range(3), range(3)):
        soft += around[row : row + rows, column : column + columns] / 9
    found: NDArray[np.float32] = soft.astype(np.float32)
    return found


def _reach_mm(arena: Arena, x_mm: float, y_mm: float, cell_mm: float) -> NDArray[np.float64]:
    """Return how far light gets from a place in each direction [mm], and a cell more: faces of walls are lit."""
    angles = 2 * math.pi * np.arange(DIRECTIONS) / DIRECTIONS
    stride_mm = max(arena.mm_per_cell, cell_mm / 2)
    distances_mm = np.arange(0.0, math.hypot(arena.width_mm, arena.height_mm) + stride_mm, stride_mm)
    columns = np.floor((x_mm + np.outer(np.cos(angles), distances_mm)) / arena.mm_per_cell).astype(np.int64)
    rows = np.floor((y_mm + np.outer(np.sin(angles), distances_mm)) / arena.mm_per_cell).astype(np.int64)
    height, width = arena.brightness.shape
    is_outside = (columns < 0) | (rows < 0) | (columns >= width) | (rows >= height)
    is_wall = arena.brightness[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)] > 0
    reach: NDArray[np.float64] = distances_mm[np.argmax(is_outside | is_wall, axis=1)] + cell_mm
    return reach
