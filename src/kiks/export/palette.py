"""The 256 colours of a GIF."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from kiks.export.stage import Pixels

EXACT = 128
"""Number of frequent colours kept exactly."""

_CODE = np.array([1 << 16, 1 << 8, 1])
"""What red, green and blue count in the number of a colour."""

_COARSE = 8
"""Step between two colours of which every picture may have those between them."""


class Palette:
    """Chooses 256 colours for pictures, and paints pictures in them.

    Args:
        samples: Some of the pictures.

    Attributes:
        colours: Red, green and blue, uint8 [256, 3].
    """

    def __init__(self, samples: Iterable[Pixels]) -> None:
        from PIL import Image

        counted = [np.unique(_codes(sample), return_counts=True) for sample in samples]
        codes, places = np.unique(np.concatenate([code for code, _ in counted]), return_inverse=True)
        counts = np.bincount(places, np.concatenate([count for _, count in counted]))
        known = (codes[:, None] // _CODE % 256).astype(np.uint8)
        order = np.argsort(-counts, kind="stable")
        frequent, rest = known[order[:EXACT]], known[order[EXACT:]]
        if len(rest):
            near = Image.fromarray(rest[None]).quantize(256 - EXACT).getpalette() or []
            frequent = np.concatenate([frequent, np.array(near, np.uint8).reshape(-1, 3)])
        self.colours = np.repeat(frequent[:1], 256, axis=0)
        self.colours[: len(frequent)] = frequent
        # Of colours that no sample has, the nearest ones to a coarse grid do.
        steps = np.arange(_COARSE // 2, 256, _COARSE)
        grid = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
        indices = self._nearest(grid).reshape((len(steps),) * 3)
        for axis in range(3):
            indices = indices.repeat(_COARSE, axis)
        self._index_of_code: NDArray[np.uint8] = indices.ravel()
        self._index_of_code[codes] = self._nearest(known)

    def indices(self, picture: Pixels) -> NDArray[np.uint8]:
        """Return the index of the colour of each pixel."""
        indices: NDArray[np.uint8] = self._index_of_code[_codes(picture)]
        return indices

    def _nearest(self, colours: NDArray[np.integer]) -> NDArray[np.uint8]:
        """Return the index of the nearest colour of the palette for each of other colours [colour, 3]."""
        own = self.colours.astype(np.float32)
        # Of the squared distance, what depends on the palette's colour.
        distances = (own**2).sum(axis=1) - 2 * colours.astype(np.float32) @ own.T
        indices: NDArray[np.uint8] = distances.argmin(axis=1).astype(np.uint8)
        return indices


def _codes(picture: Pixels) -> NDArray[np.int32]:
    """Return the number of each pixel's colour."""
    red, green, blue = (picture[..., part].astype(np.int32) for part in range(3))
    return red << 16 | green << 8 | blue
