"""The light of lamps on the floor: as much as a sensor that faces the lamp would see, with the shadows of walls.

Need: pictures, the desk and pages draw the same light, and a page has no more than a raster of the walls and lamps.
Method: the walls end rays from each lamp in many directions. A cell of the map gets light from a lamp if both rays
beside it, or in part if one of them, got that far.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np

from kiks.engine.compiling import entry, inlined, kernel
from kiks.engine.numbers import arctangent2, sin_cos
from kiks.engine.sensing.ambient import FARTHEST_MM, is_burning
from kiks.engine.sensing.rays import ENDLESS, cast, cell_at

DIRECTIONS = 720
"""Directions in which shadows are told apart."""

_TURN_RAD = 2.0 * math.pi
_NEAREST_MM = 1.0
_STEP = 0.5  # through a wall below a lamp [cells]

# All that `cast` knows of walls. Cells without a wall are said to be one cell from the next: rays go cell by cell.
_Cells: Any = namedtuple("_Cells", ("clearance", "cell_mm"))


@entry
def light_floor(
    brightness: Any, mm_per_cell: Any, lamps: Any, strengths: Any, step_mm: Any, background_flux: Any, out: Any
) -> Any:
    """Write how strong light is on the floor, from 0 to 1; its cells cover the arena, and may be of any size.

    Row 0 of both rasters is that of y = 0: for rasters with row 0 on top, y of lamps counts from there.

    Args:
        brightness: Of walls, 0 for floor, uint8 [row, column].
        mm_per_cell: Size of these cells [mm].
        lamps: x [mm], y [mm], power [W] and 1 for on or 0 for off, float64 [lamp, 4].
        strengths: How strong the light of a lamp of 1 W is 0, 1, 2, ... steps away, float64; 0 from the last one on.
        step_mm: Distance between two of them [mm].
        background_flux: Daylight [W/mm^2].
        out: float32 [row, column].
    """
    rows, columns = out.shape
    cells = np.zeros((brightness.shape[0] + 2, brightness.shape[1] + 2), np.uint8)
    for row in range(brightness.shape[0]):
        for column in range(brightness.shape[1]):
            cells[row + 1, column + 1] = 1 if brightness[row, column] == 0 else 0
    walls = _Cells(cells, 1.0)
    row_mm, column_mm = brightness.shape[0] * mm_per_cell / rows, brightness.shape[1] * mm_per_cell / columns
    light, reach = np.full((rows, columns), 1.0 * background_flux), np.empty(DIRECTIONS)
    for number in range(lamps.shape[0]):
        lamp_x, lamp_y, power_w = lamps[number, 0], lamps[number, 1], lamps[number, 2]
        if not (is_burning(lamps, number) and abs(lamp_x) < FARTHEST_MM and abs(lamp_y) < FARTHEST_MM):
            continue
        _reaches(walls, lamp_x / mm_per_cell + 1.0, lamp_y / mm_per_cell + 1.0, reach)
        for k in range(DIRECTIONS):
            # Beyond the end of the ray is the face of a wall, which is lit.
            reach[k] = (reach[k] * mm_per_cell + max(row_mm, column_mm)) ** 2
        for row in range(rows):
            dy = (row + 0.5) * row_mm - lamp_y
            for column in range(columns):
                dx = (column + 0.5) * column_mm - lamp_x
                square = dx * dx + dy * dy
                turn = (arctangent2(dy, dx) / _TURN_RAD + 1.0) * DIRECTIONS
                before = np.int64(turn)
                share = turn - before
                seen = 1.0 - share if reach[before % DIRECTIONS] >= square else 0.0
                seen += share if reach[(before + 1) % DIRECTIONS] >= square else 0.0
                light[row, column] += seen * power_w / max(square, _NEAREST_MM * _NEAREST_MM)
    for row in range(rows):
        for column in range(columns):
            light[row, column] = _strength(strengths, 1.0 / math.sqrt(light[row, column]) / step_mm)
    # Shadows have soft edges.
    for row in range(rows):
        for column in range(columns):
            total = 0.0
            for up in range(-1, 2):
                for aside in range(-1, 2):
                    total += light[min(max(0, row + up), rows - 1), min(max(0, column + aside), columns - 1)]
            out[row, column] = total / 9.0


@kernel
def _reaches(walls: Any, column: Any, row: Any, reach: Any) -> Any:
    """Write how far the light of a lamp gets in each direction [cells]; a wall that it hangs over hides nothing."""
    height, width = walls.clearance.shape
    aside, along = 0.5 * width - column, 0.5 * height - row
    begin = max(0.0, math.sqrt(aside * aside + along * along) - 0.5 * (height + width))
    end = begin + 1.5 * (height + width)
    for k in range(DIRECTIONS):
        sine, cosine = sin_cos(k * _TURN_RAD / DIRECTIONS)
        length = begin
        while length < end:
            i, j = cell_at(walls.clearance, column + length * cosine, row + length * sine)
            if walls.clearance[j, i] > 0:
                break
            length += _STEP
        origin = column + length * cosine, row + length * sine
        reach[k] = length + cast(walls, *origin, cosine, sine, ENDLESS)[0]


@inlined
def _strength(strengths: Any, place: Any) -> Any:
    """Return the strength at a place of the table."""
    if not place < strengths.shape[0] - 1:
        return 0.0
    before = np.int64(place)
    return strengths[before] + (place - before) * (strengths[before + 1] - strengths[before])
