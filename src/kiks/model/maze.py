"""Random mazes of the sizes of the Matlab KiKS.

Every place of a maze can be reached, and the same seed gives the same maze on every computer. The method is Wilson's
algorithm: a random walk starts at each cell outside the maze and ends when it hits the maze; its path without loops
becomes passages. So each maze without loops is equally likely. kiks_generate_maze uses random walks, too, but its mazes
may have loops (kiks-behaviour.md, section 1.9). Here exactly one path connects any two places, and a robot that follows
either wall reaches the exit.
"""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import blake2b
from itertools import count, product

import numpy as np
import numpy.typing as npt

from kiks.model.arena_objects import Lamp, Pose
from kiks.model.checks import check_count
from kiks.model.raster import cells_per_pixel

SIDE_MAX = 100
"""Most cells of a maze along one side: random walks take long to cross more."""

_WALL_MAX_MM, _PATH_MAX_MM = 1000, 10_000  # what is larger is more likely a slip than a wish
_FRAME_FIRST_MM, _FRAME_LAST_MM = 10, 11  # wall over the left and upper, right and lower edge (kiks-behaviour.md, 1.9)
_ROBOT_MM = 55  # body diameter (khepera-protocol.md, section 1)

_Cell = tuple[int, int]  # column, row; (0, 0) is the upper left one behind the entrance


def draw_maze(
    columns: int, rows: int, path_mm: int, wall_mm: int, seed: int
) -> tuple[npt.NDArray[np.uint8], Pose, Lamp]:
    """Draw a maze at 1 mm per pixel, with the sizes and places of kiks-behaviour.md, section 1.9. See `Arena.maze`.

    Returns:
        The picture, uint8 [row, column] with row 0 on top; the start pose in the entrance; the lamp in the exit.
    """
    columns = check_count("columns", columns, 1, SIDE_MAX, "It counts the cells side by side.")
    rows = check_count("rows", rows, 1, SIDE_MAX, "It counts the cells one above the other.")
    wall_mm = check_count("wall_mm", wall_mm, 1, _WALL_MAX_MM, "Mazes are drawn in whole millimetres.")
    # The lamp hangs in the middle of the exit as it was before a wall's thickness was cut off its right side.
    narrowest_mm = 2 * (wall_mm + _FRAME_LAST_MM) + _ROBOT_MM
    room = f"A Khepera is {_ROBOT_MM} mm across and has to fit under the lamp, beside the outer wall."
    path_mm = check_count("path_mm", path_mm, narrowest_mm, _PATH_MAX_MM, room)
    seed = check_count("seed", seed, 0, 2**63 - 1, "Any small number will do.")
    step_mm = path_mm + wall_mm
    width_mm, height_mm = (columns + 2) * path_mm + (columns - 1) * wall_mm, rows * step_mm - wall_mm
    cells_per_pixel(height_mm, width_mm, 1.0)

    picture = np.full((height_mm, width_mm), 255, np.uint8)
    last_column, last_row = columns - 1, rows - 1
    doors = [((-1, 0), (0, 0)), ((last_column, last_row), (columns, last_row))]
    for one, other in [*doors, *_passages(columns, rows, seed)]:
        left, right = (path_mm + column * step_mm for column in sorted((one[0], other[0])))
        top, bottom = (row * step_mm for row in sorted((one[1], other[1])))
        picture[top : bottom + path_mm, max(left, 0) : right + path_mm] = 0
    for edge in (picture, picture.T):
        edge[:_FRAME_FIRST_MM] = 255
        edge[-_FRAME_LAST_MM:] = 255
    start = Pose((path_mm - wall_mm) / 2, height_mm - path_mm / 2, 0.0)
    return picture, start, Lamp(width_mm - path_mm / 2 + wall_mm, path_mm / 2)


def _passages(columns: int, rows: int, seed: int) -> Iterable[tuple[_Cell, _Cell]]:
    """Return which neighbouring cells are joined: a spanning tree, each as likely as any other."""
    draws = count()
    joined = {(columns - 1, rows - 1)}
    for first in product(range(columns), range(rows)):
        # A walk stores its last exit from each cell: the path along these has no loops.
        onward: dict[_Cell, _Cell] = {}
        cell = first
        while cell not in joined:
            column, row = cell
            around = ((column + 1, row), (column, row + 1), (column - 1, row), (column, row - 1))
            inside = [(c, r) for c, r in around if 0 <= c < columns and 0 <= r < rows]
            onward[cell] = inside[random_bits(seed, next(draws)) % len(inside)]
            cell = onward[cell]
        cell = first
        while cell not in joined:
            joined.add(cell)
            yield cell, onward[cell]
            cell = onward[cell]


def random_bits(seed: int, number: int) -> int:
    """Return 64 random bits that depend on seed and number alone."""
    return int.from_bytes(blake2b(f"{seed} {number}".encode(), digest_size=8).digest(), "big")
