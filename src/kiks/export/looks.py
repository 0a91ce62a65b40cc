"""How robots, balls and cylinders look from above, in each picture: on the desk and the page, in films and photos.

Browsers get colours and shapes with the message about the scene, so JavaScript has no table of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.firmware.robot_kind import robot_kind
from kiks.firmware.robot_looks import RobotLooks, disc
from kiks.firmware.turret import Shape
from kiks.model.robot import RobotSpec
from kiks.sim.colours import Colour, robot_colour

STRIPES_MM, RIM_MM = 3.0, 2.2
"""Width of the stripes around a robot, and of the ring in its colour [mm]."""

ROUND_RAD = 0.05
"""Largest angle between two corners of an arc [rad]."""

LED_MM, HALO_MM = 1.9, 2.4 * 1.9
"""Radius of an LED, and of the light around it [mm]."""

LED_COLOURS = {
    "red": {"lit": "#ff3a28", "halo": "#ff463259", "dark": "#5b1512", "solid_lit": "#ff4030", "solid_dark": "#4a1210"},
    "green": {
        "lit": "#39e04a",
        "halo": "#46f05859",
        "dark": "#12481b",
        "solid_lit": "#40e850",
        "solid_dark": "#103c16",
    },
}
"""How an LED looks by the colour of its light, from above and, in the 3-D view, in space."""

_BLACK, _WHITE = "#000000", "#ffffff"
_NOSE_RADIUS_MM, _NOSE = 27.5, ((24.0, 0.0), (16.5, 5.5), (18.5, 0.0), (16.5, -5.5))


def robot_colours(index: int) -> dict[str, str]:
    """Return the colour of a robot on light and on dark ground, for browsers."""
    return {name: css(robot_colour(index, is_dark=name == "dark")) for name in ("light", "dark")}


def css(colour: Colour) -> str:
    """Return a colour as HTML has it."""
    return f"#{bytes(colour[:3]).hex()}"


def robot_looks(spec: RobotSpec) -> RobotLooks:
    """Return how a robot of a kind looks, with its body."""
    return robot_kind(spec.kind).looks(spec.body)


def robot_shapes(spec: RobotSpec) -> list[Shape]:
    """Return the shapes of a robot without turrets, from the lowest to the nose; x is ahead, the ring has no colour."""
    body, looks, size = spec.body, robot_looks(spec), spec.body.radius_mm / _NOSE_RADIUS_MM
    rim_mm = body.radius_mm - (STRIPES_MM if body.stripe_count else 0.0)
    shapes = []
    if body.stripe_count:
        shapes.append(disc(body.radius_mm, _BLACK))
        for begin, end in body.white_stripes_rad:
            angles_rad = np.linspace(begin, end, 2 + int((end - begin) / ROUND_RAD))
            rim = body.radius_mm * np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
            shapes.append(Shape(((0.0, 0.0), *map(tuple, rim.round(3).tolist())), _WHITE))
    shapes += [disc(rim_mm, ""), disc(rim_mm - RIM_MM, looks.board), *looks.shapes]
    return [*shapes, Shape(tuple((size * x_mm, size * y_mm) for x_mm, y_mm in _NOSE), _WHITE)]


def lit_leds(specs: Sequence[RobotSpec], records: Any) -> NDArray[np.uint32]:
    """Return which LEDs of robots are lit, by their records: of a number for each robot, bit 0 for the first one."""
    kinds = np.array([spec.kind for spec in specs[: len(records)]])
    bits = np.zeros(len(kinds), np.uint32)
    for kind in {spec.kind for spec in specs}:
        lit = robot_kind(kind).lit(records[: len(kinds)]) != 0
        bits |= (kinds == kind) * (lit @ (1 << np.arange(lit.shape[1], dtype=np.uint32)))
    return bits
