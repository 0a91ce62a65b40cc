"""The raster of an arena as text: a PNG in base64, or the few numbers of a box if it is no more than that."""

from __future__ import annotations

import base64
import binascii
from io import BytesIO
from typing import Any

import numpy as np

from kiks.errors import ArenaError, KiksError
from kiks.model.arena import Arena
from kiks.model.box import Box
from kiks.model.picture import decode_picture

_LINE = 116


def raster_text(arena: Arena) -> str:
    """Return the raster as lines of base64."""
    from PIL import Image

    file = BytesIO()
    Image.fromarray(np.flipud(arena.brightness)).save(file, "PNG")
    text = base64.b64encode(file.getvalue()).decode("ascii")
    return "".join(f"{text[start : start + _LINE]}\n" for start in range(0, len(text), _LINE))


def raster_of_text(text: str, mm_per_cell: Any) -> Arena:
    """Return an arena of what `raster_text` returned."""
    try:
        data = base64.b64decode("".join(text.split()).encode("ascii"), validate=True)
    except (binascii.Error, UnicodeEncodeError) as error:
        raise ArenaError(f"png must be a PNG file in base64, but: {error}. Save the project again.") from None
    brightness = decode_picture(data, mm_per_cell, "png")
    return Arena.from_array(brightness, mm_per_pixel=mm_per_cell)


def box_keys_of(arena: Arena) -> dict[str, Any] | None:
    """Return size_mm, wall_mm, rounded_mm and brightness of a box that has the very raster, None if there is none."""
    raster = arena.brightness
    height, width = raster.shape
    if arena.mm_per_cell != 1.0:
        return None
    greys = raster[raster > 0]
    grey = int(greys[0]) if len(greys) else 255
    wall = int(np.argmax(raster[:, width // 2] == 0))
    corner = int(np.argmax(raster[wall, wall:] == 0))
    for rounded in range(corner, min(width, height) // 2 - wall + 1):
        # The number of cells of the first row that are outside a circle of that radius.
        from_centre = rounded - 0.5
        outside = sum(
            1
            for column in range(min(corner + 1, rounded))
            if (rounded - column - 0.5) ** 2 + from_centre**2 > rounded**2
        )
        if outside != corner:
            continue
        try:
            if np.array_equal(Box(width, height, wall, rounded, grey).raster(), raster):
                return {"size_mm": [width, height], "wall_mm": wall, "rounded_mm": rounded, "brightness": grey}
        except KiksError:
            return None
    return None
