"""How far a ray goes before it meets a wall, exact to a hundredth of a millimetre, and how bright the wall is.

Method: the clearance of a cell (distance from its centre to the nearest wall cell's centre), less the diagonal of a
cell, is a distance that any point of the cell may go freely in any direction: empty space is crossed in a few leaps.
Next to a wall the ray goes to the edge of its cell instead, so no corner is missed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel

_DIAGONAL = 1.4142135623730951
_NUDGE = 1e-3  # over the edge of a cell [cells]
_FAR = 1e30


@kernel
def free_cells(field: Any, per_cell: Any, column: Any, row: Any) -> Any:
    """Return how far a point may go in any direction without meeting a wall [cells]; at most 0 next to one."""
    i = min(max(np.int64(column), 0), field.shape[1] - 1)
    j = min(max(np.int64(row), 0), field.shape[0] - 1)
    return field[j, i] * per_cell - _DIAGONAL


@kernel
def cast(field: Any, surface: Any, per_cell: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Follow one ray; lengths and places in cells of the raster with its border.

    Args:
        field: Distance of cells to the nearest wall [mm], 0 in a wall, shape [rows, columns].
        surface: Brightness of cells, 0 for floor, shape [rows, columns].
        per_cell: Cells in a millimetre.
        column: Origin.
        row: Origin.
        cosine: Direction.
        sine: Direction.
        reach: Longest length followed.

    Returns:
        Length of the ray, `reach` if it meets nothing, and the brightness of what it met, 0 for nothing.
    """
    per_column = 1.0 / cosine if abs(cosine) > 1e-12 else _FAR
    per_row = 1.0 / sine if abs(sine) > 1e-12 else _FAR
    right = 1 if cosine > 0.0 else 0
    up = 1 if sine > 0.0 else 0
    length = 0.0
    while length < reach:
        px = column + length * cosine
        py = row + length * sine
        i = min(max(np.int64(px), 0), field.shape[1] - 1)
        j = min(max(np.int64(py), 0), field.shape[0] - 1)
        clearance = field[j, i] * per_cell
        if clearance == 0.0:
            return length, np.int64(surface[j, i])
        if clearance > 2.5:
            length += clearance - _DIAGONAL
        else:
            to_column = (i + right - px) * per_column if per_column < _FAR else _FAR
            to_row = (j + up - py) * per_row if per_row < _FAR else _FAR
            length += max(min(to_column, to_row), 0.0) + _NUDGE
    return reach, np.int64(0)


@entry
def cast_ray(field: Any, surface: Any, cell: Any, pad: Any, x: Any, y: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Follow one ray from Python; lengths and places in mm of the arena."""
    per_cell = 1.0 / cell
    origin = x * per_cell + pad, y * per_cell + pad
    length, brightness = cast(field, surface, per_cell, origin[0], origin[1], cosine, sine, reach * per_cell)
    return (length * cell if brightness > 0 else reach), brightness
