"""Checks of arrays from files and callers: type, shape, finite numbers, range, and size before memory is allocated.

No invalid number reaches the engine, and no file takes more memory than its declared arrays may. `Numbers` declares an
array, and `check_array` checks it. `read_arrays` reads an .npz: the header of each array first, and then as many bytes
as the header announces, if that is not too many. Source: NumPy's NEP 1 for the head: a mark, the version, a length, and
a dict in ASCII, here as NumPy itself writes it.
"""

from __future__ import annotations

import math
import re
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from kiks.errors import KiksError, ParameterError, figure, shown
from kiks.model.data_file import one_line, read_file

NUMBERS_MAX = 1 << 24
"""Default limit of numbers in all arrays of a file."""

_EXACT_MAX = 2.0**53  # above it, floats leave whole numbers out
_HEAD_BYTES_MAX = 1 << 10
_HEAD = re.compile(
    r"\{'descr': '([<>|=]?[a-zA-Z]\d*)', 'fortran_order': (True|False), 'shape': \(((?:\d+, ?)*\d*)\),? ?\}\s*"
)


@dataclass(frozen=True)
class Numbers:
    """The rule of an array: finite numbers in a range, along axes.

    Args:
        axes: The length of each axis, or its name: arrays of a file have equal lengths along axes of the same name.
        low: Least number.
        high: Largest number.
        is_whole: Whether they must be whole numbers, of whatever type.
        advice: The advice in messages.

    Example:
        >>> str(Numbers(("gap", 8), 0, 1023, is_whole=True))
        'whole numbers from 0 to 1023 [gap, 8]'
    """

    axes: tuple[int | str, ...]
    low: float = -sys.float_info.max
    high: float = sys.float_info.max
    is_whole: bool = False
    advice: str = ""

    def __str__(self) -> str:
        kind = "whole numbers" if self.is_whole else "finite numbers"
        ends = ((word, end) for word, end in (("from", self.low), ("to", self.high)) if abs(end) < sys.float_info.max)
        span = "".join(f" {word} {figure(end)}" for word, end in ends)
        return f"{kind}{span} [{', '.join(map(str, self.axes))}]"


def check_numbers(name: str, numbers: Any, shape: tuple[int | None, ...] | None = None) -> npt.NDArray[np.float64]:
    """Return finite numbers as a float64 array.

    Args:
        name: What they are called in the message.
        numbers: An array, or a list of numbers.
        shape: The shape that it must have, None for any length along an axis; any shape if left out.
    """
    values = array_of(numbers)
    if values is None or not np.isfinite(values).all():
        raise ParameterError(f"{name} must be finite numbers, but they were {shown(numbers)}.")
    if shape is not None and not _fits(values.shape, shape):
        wanted = "[" + ", ".join("any" if length is None else str(length) for length in shape) + "]"
        raise ParameterError(f"{name} must be numbers of the shape {wanted}, but their shape was {values.shape}.")
    return values


def array_of(numbers: Any) -> npt.NDArray[np.float64] | None:
    """Return real numbers as a new float64 array, infinite ones and what is no number too; None if they are others."""
    try:
        given = np.asarray(numbers)
        with np.errstate(over="ignore"):
            return np.array(given, np.float64, order="C") if given.dtype.kind in "iuf" else None
    except (TypeError, ValueError, OverflowError):
        return None


def _fits(given: tuple[int, ...], wanted: tuple[int | None, ...]) -> bool:
    pairs = zip(given, wanted, strict=False)
    return len(given) == len(wanted) and all(length in (None, there) for there, length in pairs)


def check_array(values: object, rule: Numbers, name: str, counts: dict[str, int] | None = None) -> npt.NDArray[Any]:
    """Return an array after a check against a rule.

    Args:
        values: An array, or anything that NumPy converts to one.
        rule: The rule.
        name: Name of the array in messages.
        counts: Known lengths of named axes; the others are added.

    Returns:
        int64 for whole numbers, else float64; the array itself if it is of that type.
    """
    try:
        given = np.asarray(values)
    except (TypeError, ValueError, OverflowError):
        raise _broken(name, rule, f"was {shown(values)}") from None
    _check_form(given.dtype, given.shape, rule, name, {} if counts is None else counts)
    is_float = given.dtype.kind == "f"
    if is_float:
        with np.errstate(over="ignore"):
            given = given.astype(np.float64, copy=False)
    is_good = (given >= rule.low) & (given <= rule.high)
    if rule.is_whole and is_float:
        is_good &= (given == np.rint(given)) & (np.abs(given) <= _EXACT_MAX)
    if not is_good.all():
        place = tuple(int(part) for part in np.unravel_index(int(np.argmin(is_good)), given.shape))
        raise _broken(name, rule, f"was {given[place].item()!r}{f' at {list(place)}' if place else ''}")
    return given.astype(np.int64 if rule.is_whole else np.float64, copy=False)


def read_arrays(
    path: Path, rules: Mapping[str, Numbers], what: str, *, numbers_max: int = NUMBERS_MAX
) -> dict[str, npt.NDArray[Any]]:
    """Return arrays of an .npz file; other arrays in it are ignored.

    Args:
        path: The file.
        rules: The rule of each array.
        what: Name of the file in messages.
        numbers_max: Most numbers in all of them.

    Returns:
        What `check_array` returns of each.
    """
    data = read_file(path, what, bytes_max=8 * numbers_max + (1 << 16))
    found: dict[str, npt.NDArray[Any]] = {}
    counts: dict[str, int] = {}
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            for name, rule in rules.items():
                array = _array(archive, name, rule, counts, numbers_max)
                numbers_max -= array.size
                found[name] = check_array(array, rule, name, counts)
    except KiksError as broken:
        raise ParameterError(f"{what}: {broken}") from None
    except Exception as failure:  # zipfile and zlib raise whatever they stumble over in a damaged file.
        raise ParameterError(
            f"{what} must be a whole .npz file of NumPy, but: {one_line(failure)}. Save it again with numpy.savez."
        ) from None
    return found


def _array(
    archive: zipfile.ZipFile, name: str, rule: Numbers, counts: dict[str, int], numbers_max: int
) -> npt.NDArray[Any]:
    """Return an array of the file without conversion.

    Raises:
        ValueError: If its head is none, or something else follows than it announces.
    """
    if f"{name}.npy" not in archive.NameToInfo:
        raise _broken(name, rule, "is missing")
    if archive.getinfo(f"{name}.npy").compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"{name} is compressed in another way than NumPy does")  # those unpack without a limit
    with archive.open(f"{name}.npy") as stream:
        start = stream.read(8)
        length = int.from_bytes(stream.read(2 if start[6:7] == b"\1" else 4), "little")
        head = _HEAD.fullmatch(stream.read(min(length, _HEAD_BYTES_MAX)).decode("latin-1"))
        if start[:6] != b"\x93NUMPY" or head is None:
            raise ValueError(f"{name} has no head, or one that tells of other things than numbers")
        kind, order, sides = np.dtype(head[1]), "F" if head[2] == "True" else "C", head[3]
        shape = tuple(int(side) for side in sides.split(",") if side.strip())
        _check_form(kind, shape, rule, name, counts)
        if math.prod(shape) > numbers_max:
            raise _broken(name, rule, f"would be {shown(math.prod(shape))} of them, more than {numbers_max}")
        size = math.prod(shape) * kind.itemsize
        body = stream.read(size + 1)
    if len(body) != size:
        raise ValueError(f"{name} must have {size} bytes, but has {'more' if len(body) > size else 'fewer'}")
    return np.frombuffer(body, kind).reshape(shape, order=order)  # type: ignore[call-overload, no-any-return]


def _check_form(kind: np.dtype[Any], shape: tuple[int, ...], rule: Numbers, name: str, counts: dict[str, int]) -> None:
    """Check type and shape, and learn how long axes with names are."""
    if kind.kind not in "biuf":
        raise _broken(name, rule, f"was of type {shown(str(kind))}")
    known = [counts.get(axis) if isinstance(axis, str) else axis for axis in rule.axes]
    if len(shape) != len(known) or any(
        side != count if count is not None else side < 1 for side, count in zip(shape, known, strict=True)
    ):
        told = "".join(f", {axis} = {counts[axis]}" for axis in rule.axes if isinstance(axis, str) and axis in counts)
        raise _broken(name, rule, f"had the shape {shown(list(shape))}{told}")
    counts |= {axis: side for axis, side in zip(rule.axes, shape, strict=True) if isinstance(axis, str)}


def _broken(name: str, rule: Numbers, given: str) -> ParameterError:
    return ParameterError(f"{name} must be {rule}, but it {given}. {rule.advice}".rstrip())
