"""The way back and forth of a sketch: what each step replaced, packed, and no more of it than fits.

A patch holds what was there. Swapping it with what is there takes a step back, and swapping again does it anew.
"""

from __future__ import annotations

import zlib
from collections.abc import MutableMapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

BYTES_MAX = 64 << 20
"""Memory that packed steps may take; the last step is kept whatever it takes."""

STEPS_MAX = 1000
"""Most steps that are kept."""

_THING_BYTES = 200

Things = MutableMapping[int, Any]


@dataclass
class Canvas:
    """The rasters that a brush paints on.

    Attributes:
        brightness: uint8 [row, column], row 0 at the bottom.
        mm_per_cell: Edge of a cell [mm].
        name: What people call it.
        number: Another one for each canvas of a sketch.
    """

    brightness: npt.NDArray[np.uint8]
    mm_per_cell: float
    name: str
    number: int = 0


class Patch(Protocol):
    """The content of a rectangle before a step."""

    @property
    def size(self) -> int:
        """Memory that it takes, about [bytes]."""

    def swap(self, canvas: Canvas, things: Things) -> Patch:
        """Put it back; return what it replaced."""


class BoxPatch:
    """Part of the raster."""

    def __init__(self, box: tuple[slice, slice], before: npt.NDArray[np.uint8]) -> None:
        self.box = box
        self._packed = _packed(before)
        self.size = len(self._packed)

    def swap(self, canvas: Canvas, things: Things) -> BoxPatch:
        """Put it back; return what it replaced."""
        there = canvas.brightness[self.box]
        other = BoxPatch(self.box, there)
        there[...] = _unpacked(self._packed, there.shape)
        return other


class WholePatch:
    """All of the raster and all things."""

    def __init__(self, canvas: Canvas, things: Things) -> None:
        self._things = dict(things)
        self._shape = canvas.brightness.shape
        self._mm_per_cell, self._name, self._number = canvas.mm_per_cell, canvas.name, canvas.number
        self._packed = _packed(canvas.brightness)
        self.size = len(self._packed) + _THING_BYTES * len(things)

    def swap(self, canvas: Canvas, things: Things) -> WholePatch:
        """Put it back; return what it replaced."""
        other = WholePatch(canvas, things)
        canvas.brightness = _unpacked(self._packed, self._shape)
        canvas.mm_per_cell, canvas.name, canvas.number = self._mm_per_cell, self._name, self._number
        things.clear()
        things.update(self._things)
        return other


class ThingPatch:
    """One thing, or that there was none of its number."""

    size = _THING_BYTES

    def __init__(self, number: int, before: Any) -> None:
        self.number = number
        self._before = before

    def swap(self, canvas: Canvas, things: Things) -> ThingPatch:
        """Put it back; return what it replaced."""
        other = ThingPatch(self.number, things.pop(self.number, None))
        if self._before is not None:
            things[self.number] = self._before
        return other


class History:
    """Steps that can be taken back, and those that were."""

    def __init__(self) -> None:
        self.undoable: list[Patch] = []
        self.redoable: list[Patch] = []

    @property
    def size(self) -> int:
        """Memory that the steps take, about [bytes]."""
        return sum(patch.size for patch in (*self.undoable, *self.redoable))

    def push(self, patch: Patch) -> None:
        """Record a step by the content that it replaced, and clear the redo list."""
        self.redoable.clear()
        self.undoable.append(patch)
        while len(self.undoable) > 1 and (len(self.undoable) > STEPS_MAX or self.size > BYTES_MAX):
            del self.undoable[0]


def _packed(raster: npt.NDArray[np.uint8]) -> bytes:
    return zlib.compress(np.ascontiguousarray(raster).data, 1)


def _unpacked(packed: bytes, shape: tuple[int, ...]) -> npt.NDArray[np.uint8]:
    return np.frombuffer(bytearray(zlib.decompress(packed)), np.uint8).reshape(shape)
