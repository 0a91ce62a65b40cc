"""Which colours robots, balls, cylinders and lamps have: in all pictures of a world, and for the cameras in it."""

from __future__ import annotations

import colorsys
from typing import Any

from kiks.engine.state import BALL

Colour = tuple[int, ...]
"""Red, green, blue, and perhaps opacity, 0 to 255."""

BALL_COLOUR, CYLINDER_COLOUR, LAMPLIGHT = (245, 130, 40), (176, 122, 70), (255, 205, 40)

_FIRST_HUE_DEG, _HUE_STEP_DEG = 212.0, 222.5  # the golden ratio: hues stay apart, however many there are


def robot_colour(index: int, *, is_dark: bool = False) -> Colour:
    """Return the colour of a robot on light ground, where white text on it can be read, or on dark ground."""
    hue_deg = (_FIRST_HUE_DEG + _HUE_STEP_DEG * index) % 360
    lightness, saturation = (0.66, 0.80) if is_dark else (0.36, 0.72)
    return tuple(round(255 * part) for part in colorsys.hls_to_rgb(hue_deg / 360, lightness, saturation))


def body_colour(body: Any) -> Colour:
    """Return the colour of a ball or cylinder by its record: the less light it reflects, the darker it is."""
    full = BALL_COLOUR if body["what"] == BALL else CYLINDER_COLOUR
    share = 0.35 + 0.65 * min(int(body["brightness"]) / 190, 1.0)
    return tuple(round(part * share) for part in full)
