"""Numbers in MATLAB files of level 5: one variable by its name, and never more memory than the file may ask for.

Source: MATLAB's MAT-file format, level 5. A header of 128 bytes ends in the version and "MI" or "IM" for the order of
bytes; elements follow, each a type, a count of bytes, and data padded to 8 bytes. A matrix is an element of elements:
flags with its class, dimensions, name, real part. A compressed element unpacks to one that is not.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError

FILE_BYTES_MAX = 48 << 20
"""Most bytes of a file, and of what it unpacks to."""

_HEADER_BYTES = 128
_MATRIX, _COMPRESSED = 14, 15
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_NUMERIC_CLASSES = range(6, 16)  # double to uint64
_COMPLEX_FLAG = 0x0800
_SAVE_AGAIN = "Save it again in MATLAB with save('name.kad', 'walls', '-MAT', '-v6')."


def read_numbers(data: bytes, what: str) -> dict[str, npt.NDArray[np.float64]]:
    """Return all real numeric variables of a file, with the dimensions that they have there.

    Args:
        data: The bytes of the file.
        what: What messages call it.

    Raises:
        ArenaError: If it is no such file, damaged, or too large.
    """
    if len(data) > FILE_BYTES_MAX:
        raise ArenaError(f"{what} must have at most {FILE_BYTES_MAX >> 20} MiB, but has {len(data) >> 20}.")
    marks = {b"IM": "<", b"MI": ">"}
    order = marks.get(data[126:128])
    if order is None or struct.unpack_from(f"{order}H", data, 124)[0] != 0x0100:
        other = "one of MATLAB 7.3" if data[:10] == b"MATLAB 7.3" else "none"
        raise ArenaError(f"{what} must be a MATLAB file of level 5, but it is {other}. {_SAVE_AGAIN}")
    found: dict[str, npt.NDArray[np.float64]] = {}
    left = FILE_BYTES_MAX
    try:
        for kind, content in _elements(memoryview(data)[_HEADER_BYTES:], order):
            if kind == _COMPRESSED:
                unpacker = zlib.decompressobj()
                unpacked = unpacker.decompress(content, left)
                left -= len(unpacked)
                if unpacker.unconsumed_tail or left <= 0:
                    raise ArenaError(f"{what} must unpack to at most {FILE_BYTES_MAX >> 20} MiB, but it is larger.")
                parts = list(_elements(memoryview(unpacked), order))
            else:
                parts = [(kind, content)]
            for part_kind, part in parts:
                if part_kind == _MATRIX and (named := _matrix(part, order)) is not None:
                    found[named[0]] = named[1]
    except (ValueError, struct.error, zlib.error) as error:
        raise ArenaError(f"{what} must be complete, but it is damaged: {error}. {_SAVE_AGAIN}") from None
    return found


def _elements(data: memoryview, order: str) -> Iterator[tuple[int, memoryview]]:
    """Yield type and content of each element.

    Raises:
        ValueError: If one is longer than what is left.
    """
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


def _matrix(content: memoryview, order: str) -> tuple[str, npt.NDArray[np.float64]] | None:
    """Return name and numbers of a matrix, None if it holds no real numbers.

    Raises:
        ValueError: If its parts do not fit together.
    """
    elements = _elements(content, order)
    flags = next(elements, (0, content[:0]))[1]
    if len(flags) < 8:
        raise ValueError("a matrix has no flags")
    (flag,) = struct.unpack_from(f"{order}I", flags)
    if flag & 0xFF not in _NUMERIC_CLASSES or flag & _COMPLEX_FLAG:
        return None
    parts = [_numbers(kind, part, order) for kind, part in elements]
    if len(parts) != 3:
        raise ValueError(f"a matrix has {len(parts)} parts after its flags")
    shape, name, numbers = parts
    if not 2 <= len(shape) <= 32 or shape.min() < 0 or math.prod(map(int, shape)) != len(numbers):
        raise ValueError(f"a matrix of {shape.astype(int).tolist()[:32]} has {len(numbers)} numbers")
    text = bytes(name.astype(np.uint8)).decode("latin-1")
    return text, numbers.reshape(shape.astype(int), order="F")


def _numbers(kind: int, part: memoryview, order: str) -> npt.NDArray[np.float64]:
    if kind not in _TYPES:
        raise ValueError(f"numbers are of the unknown type {kind}")
    return np.frombuffer(part, f"{order}{_TYPES[kind]}").astype(np.float64)
