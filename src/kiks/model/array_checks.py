"""Checks of arrays from files and callers: type, shape, finite numbers, range, and size before memory is allocated.

No invalid number reaches the engine, and no file takes more memory than its declared arrays may. `Numbers` declares an
array, and `check_array` checks it. `read_arrays` reads an .npz: the header of each array first, and then as many bytes
as the header announces, if that is not too many.
"""

from __future__ import annotations

import math
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.lib import format as npy

from kiks.errors import KiksError, ParameterError, figure, shown
from kiks.model.data_file import one_line, read_file
from kiks.model.limits import ARRAY_FILE_NUMBERS_MAX

_EXACT_MAX = 2.0**53  # above it, floats leave whole numbers out
_HEAD_BYTES_MAX = 1 << 10


@dataclass(frozen=True)
class Numbers:
    """The rule of an array: finite numbers in a range, along axes.

    Args:
        axes: The length of each axis, None for any, or its name: arrays of a file have equal lengths along axes of the
            same name. Any shape if left out.
        low: Least number.
        high: Largest number.
        is_whole: Whether they must be whole numbers, of whatever type.
        advice: The advice in messages.

    Example:
        >>> str(Numbers(("gap", 8), 0, 1023, is_whole=True))
        'whole numbers from 0 to 1023 [gap, 8]'
    """

    axes: tuple[int | str | None, ...] | None = None
    low: float = -sys.float_info.max
    high: float = sys.float_info.max
    is_whole: bool = False
    advice: str = ""

    def __str__(self) -> str:
        kind = "whole numbers" if self.is_whole else "finite numbers"
        ends = ((word, end) for word, end in (("from", self.low), ("to", self.high)) if abs(end) < sys.float_info.max)
        span = "".join(f" {word} {figure(end)}" for word, end in ends)
        axes = (
            "" if self.axes is None else f" [{', '.join('any' if each is None else str(each) for each in self.axes)}]"
        )
        return f"{kind}{span}{axes}"


def check_numbers(name: str, numbers: Any, shape: tuple[int | None, ...] | None = None) -> npt.NDArray[np.float64]:
    """Return finite numbers as a new float64 array; a shape has None for any length along an axis."""
    return check_array(numbers, Numbers(shape), name)


def array_of(numbers: Any) -> npt.NDArray[np.float64] | None:
    """Return real numbers as a new float64 array, infinite ones and what is no number too; None if they are others."""
    try:
        given = np.asarray(numbers)
        with np.errstate(over="ignore"):
            return np.array(given, np.float64, order="C") if given.dtype.kind in "iuf" else None
    except (TypeError, ValueError, OverflowError):
        return None


def check_array(values: object, rule: Numbers, name: str, counts: dict[str, int] | None = None) -> npt.NDArray[Any]:
    """Return a new array after a check against a rule.

    Args:
        values: An array, or anything that NumPy converts to one.
        rule: The rule.
        name: Name of the array in messages.
        counts: Known lengths of named axes; the others are added.

    Returns:
        int64 for whole numbers, else float64.
    """
    try:
        given = np.asarray(values)
    except (TypeError, ValueError, OverflowError):
        given = np.array(None)
    if given.dtype.kind not in "iuf" and not isinstance(values, np.ndarray):
        raise _broken(name, rule, f"was {shown(values)}")
    _check_form(given.dtype, given.shape, rule, name, {} if counts is None else counts)
    if given.dtype.kind == "f":
        with np.errstate(over="ignore"):
            given = given.astype(np.float64, copy=False)
    is_good = (given >= rule.low) & (given <= rule.high)
    if rule.is_whole and given.dtype.kind == "f":
        is_good &= (given == np.rint(given)) & (np.abs(given) <= _EXACT_MAX)
    if rule.is_whole and given.dtype.kind == "u":
        is_good &= given <= np.iinfo(np.int64).max  # above it, a number without a sign becomes a negative one
    if not is_good.all():
        place = tuple(int(part) for part in np.unravel_index(int(np.argmin(is_good)), given.shape))
        raise _broken(name, rule, f"was {given[place].item()!r}{f' at {list(place)}' if place else ''}")
    return np.array(given, np.int64 if rule.is_whole else np.float64, order="C")


def read_arrays(
    path: Path, rules: Mapping[str, Numbers], what: str, *, numbers_max: int = ARRAY_FILE_NUMBERS_MAX
) -> dict[str, npt.NDArray[Any]]:
    """Return arrays of an .npz file, each as `check_array` does; other arrays in it are ignored."""
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
    """Return an array of the file without conversion."""
    if f"{name}.npy" not in archive.NameToInfo:
        raise _broken(name, rule, "is missing")
    if archive.getinfo(f"{name}.npy").compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError(f"{name} is compressed in another way than NumPy does")  # those unpack without a limit
    with archive.open(f"{name}.npy") as stream:
        is_first = npy.read_magic(stream) == (1, 0)
        head = (npy.read_array_header_1_0 if is_first else npy.read_array_header_2_0)(stream, _HEAD_BYTES_MAX)
        shape, is_fortran, kind = head
        _check_form(kind, shape, rule, name, counts)
        if (count := math.prod(shape)) > numbers_max:
            raise _broken(name, rule, f"would be {shown(count)} of them, more than {numbers_max}")
        # One byte more than the head announces: NumPy's own reader would ask for as much memory as that says.
        body = stream.read(count * kind.itemsize + 1)
    if len(body) != count * kind.itemsize:
        raise ValueError(f"{name} must have as many bytes as its head says, but it has {len(body)}")
    return np.frombuffer(body, kind).reshape(shape, order="F" if is_fortran else "C")


def _check_form(kind: np.dtype[Any], shape: tuple[int, ...], rule: Numbers, name: str, counts: dict[str, int]) -> None:
    """Check type and shape, and learn how long axes with names are."""
    if kind.kind not in "iuf":
        raise _broken(name, rule, f"was of type {shown(str(kind))}")
    if rule.axes is None:
        return
    fits = len(shape) == len(rule.axes) and all(
        side == counts.get(axis, max(side, 1)) if isinstance(axis, str) else axis in (None, side)
        for side, axis in zip(shape, rule.axes, strict=True)
    )
    if not fits:
        known = "".join(f", {axis} = {counts[axis]}" for axis in rule.axes if isinstance(axis, str) and axis in counts)
        raise _broken(name, rule, f"had the shape {shown(list(shape))}{known}")
    counts |= {axis: side for axis, side in zip(rule.axes, shape, strict=True) if isinstance(axis, str)}


def _broken(name: str, rule: Numbers, given: str) -> ParameterError:
    return ParameterError(f"{name} must be {rule}, but it {given}. {rule.advice}".rstrip())
