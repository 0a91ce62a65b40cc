"""What rays meet of an arena: how far one goes to a wall, exact to a hundredth of a millimetre, and how bright that is.

Method: the clearance of a cell (distance from its centre to the nearest wall cell's centre), less the diagonal of a
cell, is a distance that any point of the cell may go freely in any direction: empty space is crossed in a few leaps.
Next to a wall the ray goes to the edge of its cell instead, so no corner is missed.

All that rays meet of an arena is one argument, `sight`, which sensors only pass on: a plain tuple, because with a named
one each call from Python would cost half a microsecond more. It holds

* field: distance of cells to the nearest wall [mm], 0 in a wall, float32 [rows, columns];
* surface: brightness of cells, 0 for floor, uint8 [rows, columns];
* faces: the smooth surface of the wall beside free cells that touch one (`kiks.model.arena.Arena.faces`), float32
  [rows, columns, 3];
* cell: edge of a cell [mm];
* pad: cells of the border around the arena.

Places and lengths of the kernels are in cells of the raster with its border.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import entry, kernel
from kiks.engine.discs import hides
from kiks.engine.lanes import element, pointer_to, stack_floats

_DIAGONAL = 1.4142135623730951
_WALK = 2.5  # up to this clearance a ray goes from cell to cell [cells]
_STRIDE = 1.0  # shortest leap of a ray that need not be exact [cells]
_NUDGE = 1e-3  # over the edge of a cell [cells]
_BACK = 2e-3  # from there back over it [cells]
_GRAZING = 0.1  # cosine of an incidence below which a surface is not worth finding
_FAR = 1e30


@kernel
def scale(sight: Any) -> Any:
    """Return the edge of a cell [mm] and the cells of the border around the arena."""
    _, _, _, cell, pad = sight
    return cell, pad


@kernel
def cell_at(raster: Any, column: Any, row: Any) -> Any:
    """Return the column and row of the cell that a place is in; outside the raster, of the nearest one."""
    return min(max(np.int64(column), 0), raster.shape[1] - 1), min(max(np.int64(row), 0), raster.shape[0] - 1)


@kernel
def free_cells(sight: Any, column: Any, row: Any) -> Any:
    """Return how far a point may go in any direction without meeting a wall [cells]; at most 0 next to one."""
    field, _, _, cell, _ = sight
    i, j = cell_at(field, column, row)
    return field[j, i] * (1.0 / cell) - _DIAGONAL


@kernel
def cast(sight: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any, begin: Any = 0.0) -> Any:
    """Follow one ray.

    Args:
        sight: What rays meet.
        column: Origin [cells].
        row: Origin [cells].
        cosine: Direction.
        sine: Direction.
        reach: Longest length followed [cells].
        begin: Length that is known to be free [cells].

    Returns:
        Length of the ray [cells], `reach` if it meets nothing, and the brightness of what it met, 0 for nothing.
    """
    field, surface, _, cell, _ = sight
    per_cell = 1.0 / cell
    per_column = 1.0 / cosine if abs(cosine) > 1e-12 else _FAR
    per_row = 1.0 / sine if abs(sine) > 1e-12 else _FAR
    right = 1 if cosine > 0.0 else 0
    up = 1 if sine > 0.0 else 0
    length = begin
    while length < reach:
        px = column + length * cosine
        py = row + length * sine
        i, j = cell_at(field, px, py)
        clearance = field[j, i] * per_cell
        if clearance == 0.0:
            return length, np.int64(surface[j, i])
        if clearance > _WALK:
            length += clearance - _DIAGONAL
        else:
            to_column = (i + right - px) * per_column if per_column < _FAR else _FAR
            to_row = (j + up - py) * per_row if per_row < _FAR else _FAR
            length += max(min(to_column, to_row), 0.0) + _NUDGE
    return reach, np.int64(0)


@kernel
def meet_face(sight: Any, column: Any, row: Any, cosine: Any, sine: Any, length: Any) -> Any:
    """Return where a ray that `cast` followed meets its wall's surface, taken to be smooth, and how squarely.

    Returns:
        Length of the ray [cells], at most a cell from that of `cast`, and the cosine of the angle of incidence.
    """
    faces = sight[2]
    before = length - _BACK
    px, py = column + before * cosine, row + before * sine
    i, j = cell_at(faces, px, py)
    x, y = faces[j, i, 0], faces[j, i, 1]
    squarely = x * cosine + y * sine
    if x == 0.0 and y == 0.0:  # it begins in a wall, or meets the tip of a corner between cells
        return length, 1.0
    if squarely < _GRAZING:
        return length, max(squarely, 0.0)
    left = faces[j, i, 2] - (px - i - 0.5) * x - (py - j - 0.5) * y
    return max(before + min(max(left / squarely, -1.0), 1.0), 0.0), squarely


@kernel
def stride(sight: Any, column: Any, row: Any, cosine: Any, sine: Any, reach: Any, begin: Any) -> Any:
    """Follow one ray in fewer and longer leaps than `cast`, to within a cell or so of what that says.

    A leap takes the ray to begin in the middle of its cell and may end inside a wall, a cell deep at most. Tips of
    corners that a ray meets for less than a cell it may miss, straight walls of one cell it does not. It takes and
    returns what `cast` does.
    """
    field, surface, _, cell, _ = sight
    per_cell = 1.0 / cell
    length = begin
    while length < reach:
        i, j = cell_at(field, column + length * cosine, row + length * sine)
        clearance = field[j, i] * per_cell
        if clearance == 0.0:
            return max(length - 0.5 * _STRIDE, 0.0), np.int64(surface[j, i])
        length += max(clearance, _STRIDE)
    return reach, np.int64(0)


def _in_lanes(lane_count: int) -> Any:
    """Return a kernel that follows many rays, so and so many of them at once."""

    @kernel
    def cast_lanes(
        sight: Any, columns: Any, rows: Any, cosines: Any, sines: Any, reach: Any, lengths: Any, brightnesses: Any
    ) -> Any:
        """Follow many rays, each to the first wall: what `cast` returns to the bit, in less time.

        Neighbours step together, one lane each, until the last of them has met its wall; a lane that has stays where it
        is.

        Args:
            sight: What rays meet.
            columns: Origins [cells], shape [rays].
            rows: Origins [cells], shape [rays].
            cosines: Directions, shape [rays].
            sines: Directions, shape [rays].
            reach: Longest length followed [cells]: any number that is larger than the arena follows all to a wall.
            lengths: Lengths that are known to be free [cells], and then the lengths of the rays, shape [rays].
            brightnesses: Where the brightnesses of the walls go, shape [rays].
        """
        field, surface, _, cell, _ = sight
        per_cell = 1.0 / cell
        clearances, width = pointer_to(field), np.int32(field.shape[1])
        last_column, last_row = np.int32(field.shape[1] - 1), np.int32(field.shape[0] - 1)
        nought = np.int32(0)
        column, row = stack_floats(lane_count), stack_floats(lane_count)
        cosine, sine = stack_floats(lane_count), stack_floats(lane_count)
        per_column, per_row = stack_floats(lane_count), stack_floats(lane_count)
        right, up = stack_floats(lane_count), stack_floats(lane_count)
        length = stack_floats(lane_count)
        for first in range(0, lengths.shape[0], lane_count):
            for lane in range(lane_count):
                ray = min(first + lane, lengths.shape[0] - 1)
                column[lane], row[lane], cosine[lane], sine[lane] = columns[ray], rows[ray], cosines[ray], sines[ray]
                length[lane] = lengths[ray]
            for lane in range(lane_count):
                per_column[lane] = 1.0 / cosine[lane] if abs(cosine[lane]) > 1e-12 else _FAR
                per_row[lane] = 1.0 / sine[lane] if abs(sine[lane]) > 1e-12 else _FAR
                right[lane] = 1.0 if cosine[lane] > 0.0 else 0.0
                up[lane] = 1.0 if sine[lane] > 0.0 else 0.0
            under_way = np.int32(1)
            while under_way != 0:
                under_way = nought
                for lane in range(lane_count):
                    px = column[lane] + length[lane] * cosine[lane]
                    py = row[lane] + length[lane] * sine[lane]
                    i = min(max(np.int32(px), nought), last_column)
                    j = min(max(np.int32(py), nought), last_row)
                    clearance = element(clearances, np.int32(j * width + i)) * per_cell
                    to_column = (i + right[lane] - px) * per_column[lane] if per_column[lane] < _FAR else _FAR
                    to_row = (j + up[lane] - py) * per_row[lane] if per_row[lane] < _FAR else _FAR
                    walk = max(min(to_column, to_row), 0.0) + _NUDGE
                    step = clearance - _DIAGONAL if clearance > _WALK else walk
                    goes_on = (clearance > 0.0) & (length[lane] < reach)
                    length[lane] += step if goes_on else 0.0
                    under_way |= np.int32(goes_on)
            for lane in range(min(lane_count, lengths.shape[0] - first)):
                ray = first + lane
                i = min(max(np.int32(column[lane] + length[lane] * cosine[lane]), nought), last_column)
                j = min(max(np.int32(row[lane] + length[lane] * sine[lane]), nought), last_row)
                is_met = length[lane] < reach
                lengths[ray], brightnesses[ray] = (length[lane], surface[j, i]) if is_met else (reach, 0.0)

    return cast_lanes


cast_many = _in_lanes(32)
"""For whole pictures."""

cast_fan = _in_lanes(8)
"""For the seven rays of a proximity sensor, and one over."""


@kernel
def is_lit(sight: Any, seen: Any, seen_count: Any, x: Any, y: Any, lamp_x: Any, lamp_y: Any) -> Any:
    """Say whether nothing stands between a place and a lamp [mm].

    A lamp may hang over a wall or a thing, which hides nothing then.

    Args:
        sight: What rays meet of the arena.
        seen: Discs that may stand between (`kiks.engine.discs`).
        seen_count: How many they are.
        x: The place [mm].
        y: The place [mm].
        lamp_x: The lamp [mm].
        lamp_y: The lamp [mm].
    """
    field, _, _, cell, pad = sight
    per_cell = 1.0 / cell
    column, row = x * per_cell + pad, y * per_cell + pad
    dx, dy = (lamp_x - x) * per_cell, (lamp_y - y) * per_cell
    reach = math.sqrt(dx * dx + dy * dy)
    if reach == 0.0:
        return True
    for k in range(seen_count):
        if hides(seen, k, column, row, dx / reach, dy / reach, reach):
            return False
    length, brightness = cast(sight, column, row, dx / reach, dy / reach, reach)
    if brightness == 0:
        return True
    while length < reach:
        i, j = cell_at(field, column + dx * length / reach, row + dy * length / reach)
        if field[j, i] > 0.0:
            return False
        length += 0.5
    return True


@entry
def cast_ray(sight: Any, x: Any, y: Any, cosine: Any, sine: Any, reach: Any) -> Any:
    """Follow one ray from Python; lengths and places in mm of the arena."""
    cell, pad = scale(sight)
    per_cell = 1.0 / cell
    length, brightness = cast(sight, x * per_cell + pad, y * per_cell + pad, cosine, sine, reach * per_cell)
    return (length * cell if brightness > 0 else reach), brightness


@entry
def cast_rays(sight: Any, columns: Any, rows: Any, cosines: Any, sines: Any, lengths: Any, brightnesses: Any) -> Any:
    """Follow many rays from Python, each to the first wall; lengths and places in cells."""
    lengths[:] = 0.0
    cast_many(sight, columns, rows, cosines, sines, _FAR, lengths, brightnesses)
