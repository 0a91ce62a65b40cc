"""Reads numeric variables of MATLAB files of level 5, with a limit on memory.

Not with SciPy's reader: it unpacks without a limit, and a damaged file can crash it, with all of Python.

Source: MATLAB's MAT-file format, level 5. A header of 128 bytes ends in the version and "MI" or "IM" for the order of
bytes; elements follow, each a type, a count of bytes, and data padded to 8 bytes. A matrix is an element of elements:
flags with its class, dimensions, name, real part. A compressed element unpacks to one that is not.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError, shown
from kiks.model.data_file import check_size, one_line
from kiks.model.limits import MAT_FILE_BYTES_MAX

_HEADER_BYTES = 128
_MATRIX, _COMPRESSED = 14, 15
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_NUMERIC_CLASSES = range(6, 16)  # double to uint64
_COMPLEX_FLAG = 0x0800
_SAVE_AGAIN = "Save it again in MATLAB with save('name.kad', 'walls', '-MAT', '-v6')."


def read_numbers(data: bytes, what: str) -> dict[str, npt.NDArray[Any]]:
    """Return all real numeric variables of a file, as they stand there: of any type and shape."""
    check_size(data, what, bytes_max=MAT_FILE_BYTES_MAX, error=ArenaError)
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None or struct.unpack_from(f"{order}H", data, 124)[0] != 0x0100:
        other = "one of MATLAB 7.3" if data[:10] == b"MATLAB 7.3" else "none"
        raise ArenaError(f"{what} must be a MATLAB file of level 5, but it is {other}. {_SAVE_AGAIN}")
    try:
        matrices = _matrices(memoryview(data)[_HEADER_BYTES:], order)
        return dict(named for named in (_matrix(content, order) for content in matrices) if named is not None)
    except (ValueError, struct.error, zlib.error) as error:
        raise ArenaError(f"{what} must be whole, but it is damaged: {one_line(error)}. {_SAVE_AGAIN}") from None


def _matrices(data: memoryview, order: str) -> Iterator[memoryview]:
    """Yield the content of each matrix, unpacked."""
    left = MAT_FILE_BYTES_MAX
    for kind, content in _elements(data, order):
        parts = [(kind, content)]
        if kind == _COMPRESSED:
            unpacker = zlib.decompressobj()
            unpacked = unpacker.decompress(content, left)
            left -= len(unpacked)
            if unpacker.unconsumed_tail or left <= 0:
                raise ValueError(f"it unpacks to more than {MAT_FILE_BYTES_MAX >> 20} MiB")
            parts = list(_elements(memoryview(unpacked), order))
        yield from (part for part_kind, part in parts if part_kind == _MATRIX)


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield type and content of each element."""
    position = 0
    while position < len(data):
        if len(data) - position < 8:
            raise ValueError("it ends within the head of an element")
        kind, count = struct.unpack_from(f"{order}II", data, position)
        if kind >> 16:
            # A small element: the count in the upper half, the data where the count would be.
            kind, count, start, step = kind & 0xFFFF, kind >> 16, position + 4, 8
            if count > 4:
                raise ValueError(f"a small element has {count} bytes")
        else:
            start = position + 8
            step = 8 + (count if kind == _COMPRESSED else -(-count // 8) * 8)
        if start + count > len(data):
            raise ValueError(f"an element of {count} bytes has {len(data) - start} only")
        yield kind, data[start : start + count]
        position += step


def _matrix(content: memoryview, order: str) -> tuple[str, npt.NDArray[Any]] | None:
    """Return name and numbers of a matrix, None if it holds no real numbers."""
    elements = _elements(content, order)
    flags = next(elements, (0, content[:0]))[1]
    if len(flags) < 8:
        raise ValueError("a matrix has no flags")
    (flag,) = struct.unpack_from(f"{order}I", flags)
    if flag & 0xFF not in _NUMERIC_CLASSES or flag & _COMPLEX_FLAG:
        return None
    parts = [_numbers(kind, part, order) for kind, part in islice(elements, 4)]
    if len(parts) != 3:
        raise ValueError("a matrix must have dimensions, name and numbers after its flags")
    sides, name, numbers = parts
    if sides.dtype.kind not in "iu" or name.dtype.itemsize != 1 or not 2 <= len(sides) <= 32:
        raise ValueError("dimensions or name of a matrix are none")
    shape = sides.tolist()
    if min(shape) < 0 or math.prod(shape) != len(numbers):
        raise ValueError(f"a matrix of {shown(shape)} has {len(numbers)} numbers")
    return name.tobytes().decode("latin-1"), numbers.reshape(shape, order="F")


def _numbers(kind: int, part: memoryview, order: str) -> npt.NDArray[Any]:
    if kind not in _TYPES:
        raise ValueError(f"numbers are of the unknown type {kind}")
    return np.frombuffer(part, f"{order}{_TYPES[kind]}")
