"""How robots, balls and cylinders look from above, in each picture: on the desk and the page, in films and photos.

Browsers get colours and shapes with the message about the scene, so JavaScript has no table of its own.
"""

from __future__ import annotations

import numpy as np

from kiks.firmware.turret import Shape
from kiks.model.robot import Body
from kiks.sim.colours import Colour, robot_colour

STRIPES_MM, RIM_MM = 3.0, 2.2
"""Width of the stripes around a robot, and of the ring in its colour [mm]."""

ROUND_RAD = 0.05
"""Largest angle between two corners of an arc [rad]."""

_BOARD, _WHEEL, _PIN, _CHIP, _BLACK, _WHITE = "#22643f", "#17191c", "#d7b45a", "#10231a", "#000000", "#ffffff"
_RADIUS_MM = 27.5  # of a Khepera, to which the following belong
_CHIPS = ((-17.0, -6.0, 11.0, 12.0), (-6.0, 12.5, 14.0, 5.0), (-6.0, -17.5, 14.0, 5.0))
_NOSE = ((24.0, 0.0), (16.5, 5.5), (18.5, 0.0), (16.5, -5.5))
_PINS = ((-11.6, -21.2, 23.2, 1.2), (-11.6, 20.0, 23.2, 1.2))


def robot_colours(index: int) -> dict[str, str]:
    """Return the colour of a robot on light and on dark ground, for browsers."""
    return {name: css(robot_colour(index, is_dark=name == "dark")) for name in ("light", "dark")}


def css(colour: Colour) -> str:
    """Return a colour as HTML has it."""
    return f"#{bytes(colour[:3]).hex()}"


def robot_shapes(body: Body) -> list[Shape]:
    """Return the shapes of a robot without turrets, from the lowest to the nose; x is ahead, the ring has no colour."""
    radius_mm, size = body.radius_mm, body.radius_mm / _RADIUS_MM
    wheel_mm = body.wheel_base_mm / 2 / size - 1.5
    rim_mm = radius_mm - (STRIPES_MM if body.stripe_count else 0.0)
    shapes = []
    if body.stripe_count:
        shapes.append(_disc(radius_mm, _BLACK))
        for begin, end in body.white_stripes_rad:
            angles_rad = np.linspace(begin, end, 2 + int((end - begin) / ROUND_RAD))
            rim = radius_mm * np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
            shapes.append(Shape(((0.0, 0.0), *map(tuple, rim.round(3).tolist())), _WHITE))
    shapes += [_disc(rim_mm, ""), _disc(rim_mm - RIM_MM, _BOARD)]
    boxes = [((-8.0, side * wheel_mm - 2.4, 16.0, 4.8), _WHEEL) for side in (-1, 1)]
    boxes += [(pins, _PIN) for pins in _PINS] + [(chip, _CHIP) for chip in _CHIPS]
    for (x_mm, y_mm, length_mm, width_mm), paint in boxes:
        corners = (0.0, 0.0), (length_mm, 0.0), (length_mm, width_mm), (0.0, width_mm)
        shapes.append(Shape(tuple((size * (x_mm + x), size * (y_mm + y)) for x, y in corners), paint))
    return [*shapes, Shape(tuple((size * x_mm, size * y_mm) for x_mm, y_mm in _NOSE), _WHITE)]


def _disc(radius_mm: float, colour: str) -> Shape:
    return Shape(((0.0, 0.0),), colour, radius_mm)
