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
def cast(field: Any, surface: Any, cell: Any, pad: Any, x: Any, y: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Follow one ray.

    Args:
        field: Distance of cells to the nearest wall [mm], shape [rows, columns].
        surface: Brightness of cells, 0 for floor, shape [rows, columns].
        cell: Edge of a cell [mm].
        pad: Cells of the border around the arena.
        x: Origin [mm].
        y: Origin [mm].
        cosine: Direction.
        sine: Direction.
        reach: Longest length followed [mm].

    Returns:
        Length of the ray [mm], `reach` if it meets nothing, and the brightness of what it met, 0 for nothing.
    """
    column = x / cell + pad
    row = y / cell + pad
    reach_cells = reach / cell
    per_column = 1.0 / cosine if abs(cosine) > 1e-12 else _FAR
    per_row = 1.0 / sine if abs(sine) > 1e-12 else _FAR
    length = 0.0
    while length < reach_cells:
        px = column + length * cosine
        py = row + length * sine
        i = min(max(np.int64(px), 0), field.shape[1] - 1)
        j = min(max(np.int64(py), 0), field.shape[0] - 1)
        if surface[j, i] > 0:
            return length * cell, np.int64(surface[j, i])
        to_column = ((i + 1 if cosine > 0.0 else i) - px) * per_column if per_column < _FAR else _FAR
        to_row = ((j + 1 if sine > 0.0 else j) - py) * per_row if per_row < _FAR else _FAR
        to_edge = max(min(to_column, to_row), 0.0) + _NUDGE
        length += max(field[j, i] / cell - _DIAGONAL, to_edge)
    return reach, np.int64(0)


@entry
def cast_ray(field: Any, surface: Any, cell: Any, pad: Any, x: Any, y: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Call `cast` from Python."""
    return cast(field, surface, cell, pad, x, y, cosine, sine, reach)
