"""Arena files of the Matlab KiKS, `.kad`: walls as rectangles in the variable `walls` of a MATLAB file.

Source: kiks-behaviour.md, section 5. `walls` is width and height [mm], then for each piece: a count n of corners, their
n columns and n rows, counted from 1 with row 1 on top and both ends included, and a grey. The objects of an arena are
in variables that the Matlab KiKS does not read: `starts`, `lamps`, `balls` and `cylinders`, a row for each, in the
order of the fields of `kiks.model.arena_objects` and with y upwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError, KiksError, shown
from kiks.model.arena import Arena
from kiks.model.arena_objects import THINGS_MAX
from kiks.model.array_checks import Numbers, check_array
from kiks.model.atomic_files import path_of, replace_file
from kiks.model.data_file import COORDINATE_MAX, read_file
from kiks.model.limits import MAT_FILE_BYTES_MAX
from kiks.model.mat5 import read_numbers
from kiks.model.raster import cells_per_pixel

PIECES_MAX = 200_000
"""Most rectangles of a file."""

WALLS_MAX = 2 + 10 * PIECES_MAX
"""Most numbers of `walls`."""

PAINTED_MAX = 16
"""Largest painted area of all pieces of a file together, in areas of the arena."""

_THINGS: dict[str, tuple[int, type[Any]]] = {
    "starts": (3, float),
    "lamps": (4, bool),
    "balls": (5, int),
    "cylinders": (5, int),
}
"""For each variable with objects how many numbers a row has, and what the last one is."""

_CROSSINGS = 1 << 18
_CROSSING_COST = 16  # in cells that are painted
_WHOLE = Numbers(("number",), 0, 65535, is_whole=True, advice="Is it an arena of KiKS?")


def load_kad(path: str | Path) -> Arena:
    """Read a `.kad` file."""
    path = path_of(path)
    what = f"Arena file {str(path)!r}"
    return decode_kad(read_file(path, what, bytes_max=MAT_FILE_BYTES_MAX, error=ArenaError), path.stem, what)


def decode_kad(data: bytes, name: str = "arena", what: str = "The arena file") -> Arena:
    """Read the bytes of a `.kad` file."""
    found = read_numbers(data, what)
    if "walls" not in found:
        raise ArenaError(
            f"{what} must have a variable 'walls', but has {shown(sorted(found))}. Is it an arena of KiKS?"
        )
    try:
        raster = _raster(_row(found["walls"]))
        things: dict[str, Any] = {label: _entries(label, *row, found) for label, row in _THINGS.items()}
        return Arena(raster, 1.0, name, **things)
    except KiksError as error:
        raise ArenaError(f"{what}: {error}") from None


def save_kad(arena: Arena, path: str | Path) -> None:
    """Write a `.kad` file; an earlier one of that name is replaced in one step."""
    replace_file(path, encode_kad(arena), "an arena")


def encode_kad(arena: Arena) -> bytes:
    """Return the bytes of a `.kad` file."""
    from io import BytesIO

    from scipy.io import savemat

    if arena.mm_per_cell != 1.0 or max(arena.brightness.shape) > 65535:
        raise ArenaError(
            f"A .kad file has cells of 1 mm, at most 65535 side by side, but arena {shown(arena.name)} has "
            f"{arena.brightness.shape[1]} x {arena.brightness.shape[0]} of {arena.mm_per_cell:g} mm. Save it as .kiks."
        )
    variables: dict[str, npt.NDArray[Any]] = {"walls": _walls(arena.brightness)}
    for label, (count, _) in _THINGS.items():
        if entries := getattr(arena, label):
            variables[label] = np.array(entries, np.float64).reshape(-1, count)
    file = BytesIO()
    savemat(file, variables, format="5", do_compression=False)
    return file.getvalue()


def _walls(brightness: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint16]:
    """Return the numbers of `walls`: a row, in the order in which the Matlab KiKS writes them.

    The Matlab KiKS takes the first wall cell, column by column from the left and from the top, extends it down while
    the grey is equal, then right while all of that column is, removes the piece, and repeats. A piece never extends
    into removed cells while its own are there, because those were removed with all cells between. So the original
    picture gives the extent to the right, and all pieces that begin in a column are found together.
    """
    height, width = brightness.shape
    columns = np.ascontiguousarray(brightness[::-1].T)
    alike = np.ones((width, height), np.uint16)  # cells of the same grey from here to the right
    for column in range(width - 2, -1, -1):
        np.add(alike[column], alike[column + 1], out=alike[column], where=columns[column] == columns[column + 1])
    pieces: list[npt.NDArray[np.uint16]] = []
    gone_to = np.zeros(height, np.int64)  # the column up to which a row is gone
    total = 0
    for column in range(width):
        grey = np.where(gone_to > column, 0, columns[column])
        begins = np.flatnonzero(np.diff(grey, prepend=np.uint8(0)) != 0)
        begins = begins[grey[begins] > 0]
        if not len(begins):
            continue
        ends = np.append(np.flatnonzero(np.diff(grey) != 0), height - 1)
        ends = ends[grey[ends] > 0]
        across = np.array(
            [alike[column, first : last + 1].min() for first, last in zip(begins, ends, strict=True)], dtype=np.int64
        )
        for first, last, count in zip(begins, ends, across, strict=True):
            gone_to[first : last + 1] = column + count
        left, right = np.full_like(begins, column + 1), column + across
        top, bottom = begins + 1, ends + 1
        four = np.full_like(begins, 4)
        piece = (four, left, right, right, left, top, top, bottom, bottom, grey[begins].astype(np.int64))
        pieces.append(np.column_stack(piece).astype(np.uint16).ravel())
        total += len(begins)
        if total > PIECES_MAX:
            raise ArenaError(
                f"A .kad file must have at most {PIECES_MAX} rectangles, but this arena has more. Save it as .kiks."
            )
    return np.concatenate([np.array([width, height], np.uint16), *pieces])[None, :]


def _row(walls: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    if walls.ndim != 2 or min(walls.shape) != 1 or not 2 <= walls.size <= WALLS_MAX:
        raise ArenaError(
            f"walls must be a row of 2 to {WALLS_MAX} numbers, width and height first, but its shape was "
            f"{shown(walls.shape)}. {_WHOLE.advice}"
        )
    return check_array(walls.ravel(), _WHOLE, "walls")


def _raster(walls: npt.NDArray[np.int64]) -> npt.NDArray[np.uint8]:
    width, height = walls[:2].tolist()
    cells_per_pixel(height, width, 1.0)
    picture = np.zeros((height, width), np.uint8)
    budget = PAINTED_MAX * picture.size
    for number, (x, y, grey) in enumerate(_pieces(walls), start=1):
        piece = f"piece {number} of walls"
        if number > PIECES_MAX:
            raise ArenaError(f"walls must have at most {PIECES_MAX} pieces, but it has more. Draw a simpler arena.")
        left, right, top, bottom = (int(end) for end in (x.min(), x.max(), y.min(), y.max()))
        if left < 1 or right > width or top < 1 or bottom > height or grey > 255:
            raise ArenaError(
                f"{piece} must lie within {width} x {height} mm and have a grey up to 255, but its columns are {left} "
                f"to {right}, its rows {top} to {bottom}, its grey {grey}. Save the arena again."
            )
        box = picture[top - 1 : bottom, left - 1 : right]
        corners = {(column, row) for column in (left, right) for row in (top, bottom)}
        is_rectangle = set(zip(x.tolist(), y.tolist(), strict=True)) == corners
        crossings = 0 if is_rectangle else int(abs(np.roll(y, -1) - y).sum()) + len(y)
        budget -= box.size + _CROSSING_COST * crossings
        if budget < 0:
            raise ArenaError(
                f"walls must not be painted over again and again, but up to {piece} it was. Save it again."
            )
        box[...] = grey
        if not is_rectangle:
            box *= _polygon(x - left, y - top, box.shape)
    return np.ascontiguousarray(picture[::-1])


def _pieces(walls: npt.NDArray[np.int64]) -> Iterator[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], int]]:
    """Yield columns and rows of the corners of each piece, and its grey."""
    position = 2
    while position < len(walls):
        count = int(walls[position])
        last = position + 2 * count + 1
        if count < 1 or last >= len(walls):
            raise ArenaError(
                f"walls must consist of whole pieces, but at its number {position + 1} {count} corners are announced "
                f"and {len(walls) - position - 1} numbers follow. The file was cut short."
            )
        yield walls[position + 1 : position + 1 + count], walls[position + 1 + count : last], int(walls[last])
        position = last + 1


def _polygon(x: npt.NDArray[np.int64], y: npt.NDArray[np.int64], shape: tuple[int, ...]) -> npt.NDArray[np.uint8]:
    """Return 1 where whole places lie in a polygon or on its edge, else 0.

    A place lies within if an odd number of edges crosses its row on its left; sums of bytes keep what is odd.
    """
    crossed, edge = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
    x1, y1 = np.roll(x, -1), np.roll(y, -1)
    for level in np.flatnonzero(y == y1).tolist():
        edge[y[level], min(x[level], x1[level]) : max(x[level], x1[level]) + 1] = 1
    sides = np.flatnonzero(y != y1)
    heights = abs(y1 - y)[sides] + 1
    # Take few sides at a time, so their crossings with rows take little memory.
    parts = np.cumsum(heights) // _CROSSINGS
    for some in np.split(np.arange(len(sides)), np.flatnonzero(np.diff(parts)) + 1):
        side = np.repeat(sides[some], heights[some])
        below = np.arange(len(side)) - np.repeat(np.cumsum(heights[some]) - heights[some], heights[some])
        row = np.minimum(y, y1)[side] + below
        column, rest = np.divmod((row - y[side]) * (x1 - x)[side], (y1 - y)[side])
        column += x[side]
        edge[row[rest == 0], column[rest == 0]] = 1
        is_crossing = (column + 1 < shape[1]) & (row < np.maximum(y, y1)[side])
        np.add.at(crossed, (row[is_crossing], column[is_crossing] + 1), 1)
    np.add.accumulate(crossed, axis=1, dtype=np.uint8, out=crossed)
    return np.bitwise_or(np.bitwise_and(crossed, 1, out=crossed), edge, out=crossed)


def _entries(label: str, count: int, last: type[Any], found: dict[str, npt.NDArray[Any]]) -> tuple[Any, ...]:
    rows = found.get(label)
    if rows is None or not rows.size:
        return ()
    if len(rows) > THINGS_MAX:
        raise ArenaError(f"{label} must have up to {THINGS_MAX} rows, but it has {len(rows)}. Draw a simpler arena.")
    rows = check_array(rows, Numbers((label, count), -COORDINATE_MAX, COORDINATE_MAX), label)
    if last is int:
        check_array(rows[:, -1], Numbers((label,), 1, 255, is_whole=True), f"brightness of {label}")
    return tuple((*row[:-1], last(row[-1])) for row in rows.tolist())
