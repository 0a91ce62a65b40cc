"""A picture of a run: the arena from above, the robot's path and the robot at its end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from kiks.errors import ParameterError
from kiks.model.arena import PAD, Arena

if TYPE_CHECKING:
    from PIL.Image import Image

_FLOOR = (246, 243, 236)
_BODY = (38, 84, 60)
_PATH_BEGIN = (66, 135, 245)
_PATH_END = (220, 60, 60)
_LONGEST_SIDE = 1200
_FINER = 2  # drawn that much larger and shrunk, which smooths the lines


def draw_run(arena: Arena, path: Sequence[tuple[float, float, float]], *, diameter_mm: float) -> Image:
    """Return a picture of a run.

    Args:
        arena: Where it took place.
        path: Poses x_mm, y_mm, heading_rad in their order; the robot is drawn at the last one.
        diameter_mm: The robot's.
    """
    from PIL import Image, ImageDraw

    scale = _FINER * min(_LONGEST_SIDE / max(arena.width_mm, arena.height_mm), 2.0)
    size = (max(round(arena.width_mm * scale), 1), max(round(arena.height_mm * scale), 1))
    cells = np.flipud(arena.surface[PAD:-PAD, PAD:-PAD])
    # Walls are shown darker than they are: on paper a white wall would be taken for floor.
    shade = (40 + cells.astype(np.uint16) * 150 // 255).astype(np.uint8)
    colours = np.where((cells == 0)[..., None], np.array(_FLOOR, np.uint8), shade[..., None])
    image = Image.fromarray(colours.astype(np.uint8), "RGB").resize(size, Image.Resampling.LANCZOS)
    draw = ImageDraw.Draw(image)

    def point(x_mm: float, y_mm: float) -> tuple[float, float]:
        return x_mm * scale, (arena.height_mm - y_mm) * scale

    steps = max(len(path) - 1, 1)
    for k in range(len(path) - 1):
        share = k / steps
        colour = tuple(round(a + (b - a) * share) for a, b in zip(_PATH_BEGIN, _PATH_END, strict=True))
        draw.line(
            [point(*path[k][:2]), point(*path[k + 1][:2])], fill=colour, width=max(round(scale), 2), joint="curve"
        )
    if path:
        x_mm, y_mm, heading = path[-1]
        radius = diameter_mm / 2
        (left, top), (right, bottom) = point(x_mm - radius, y_mm + radius), point(x_mm + radius, y_mm - radius)
        draw.ellipse((left, top, right, bottom), fill=_BODY)
        nose = point(x_mm + radius * math.cos(heading), y_mm + radius * math.sin(heading))
        draw.line([point(x_mm, y_mm), nose], fill=(255, 255, 255), width=max(round(scale * 3), 1))
    return image.resize((size[0] // _FINER, size[1] // _FINER), Image.Resampling.LANCZOS)


def save_picture(image: Image, path: str | Path) -> None:
    """Write a picture; the type follows from the ending.

    Raises:
        ParameterError: If the place cannot be written or the ending names no type of picture.
    """
    try:
        image.save(path)
    except (OSError, ValueError) as error:
        raise ParameterError(
            f"a picture must go to a writable file like 'run.png', but {str(path)!r} failed: {error}."
        ) from None
