"""How an e-puck looks: a light grey body between two large wheels, a transparent ring with eight LEDs, a dark board."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.firmware.epuck.robot import MEMORY
from kiks.firmware.robot_looks import Led, RobotLooks, Slab, box, disc
from kiks.firmware.turret import Shape
from kiks.model.robot import Body

_WHEEL_MM = 41.0  # epuck-protocol.md 1
_HEIGHT_MM, _LOW_MM = 45.0, 36.0  # 1; its sensors are 33 mm high (6.1)
_RING_MM, _RING_HEIGHT_MM = 33.0, 43.4  # the LEDs stand that far from the middle
_BOARD_SHARE = 30.0 / 37.0
_RING, _GREY, _BOARD, _CIRCUIT, _TYRE = "#c4cad0", "#b7bec5", "#3d454d", "#3c4a2e", "#17191c"
_CHIP, _CAMERA, _LENS = "#0f1214", "#4a5058", "#0a0b0c"


def _ring_led(number: int) -> Led:
    """Return an LED of the ring: 0 is ahead, the others follow clockwise (epuck-protocol.md 6.3)."""
    angle_rad = -number * math.pi / 4
    return Led(str(number), _RING_MM * math.cos(angle_rad), _RING_MM * math.sin(angle_rad), _HEIGHT_MM)


# The body LED shines within the body, and the front LED from below. Both are drawn where a robot's number leaves room.
LEDS = (
    *map(_ring_led, range(8)),
    Led("body", -19.5, 0.0, _HEIGHT_MM + 2.0, "green"),
    Led("front", 19.5, 0.0, _HEIGHT_MM + 2.0),
)


def looks(body: Body) -> RobotLooks:
    """Return how an e-puck with a body looks."""
    aside_mm, radius_mm = body.wheel_base_mm / 2 - 1.5, body.radius_mm
    board = disc(_BOARD_SHARE * radius_mm, _BOARD)
    wheels = (box(-_WHEEL_MM / 2, side * aside_mm - 2.4, _WHEEL_MM, 4.8, _TYRE) for side in (-1, 1))
    chips = box(-8.0, -19.5, 10.0, 9.0, _CHIP), box(-8.0, 16.5, 12.0, 4.0, _CHIP)
    angles_rad = [math.radians(turn + side) for turn in (0, 180) for side in (-40, -20, 0, 20, 40)]
    base = Shape(tuple((_RING_MM * math.cos(each), _RING_MM * math.sin(each)) for each in angles_rad), _GREY)
    slabs = (
        Slab(base, 5.0, _LOW_MM),
        Slab(box(30.0, -4.0, 3.0, 8.0, _CAMERA), 24.0, 32.0),
        Slab(box(33.0, -2.0, 1.0, 4.0, _LENS), 26.0, 30.0),
        Slab(disc(radius_mm, _CIRCUIT), _LOW_MM, _LOW_MM + 1.0),
        Slab(disc(radius_mm, _RING), _LOW_MM + 1.0, _RING_HEIGHT_MM),
        Slab(board, _RING_HEIGHT_MM, _HEIGHT_MM),
        *(Slab(chip, _HEIGHT_MM, _HEIGHT_MM + 1.5) for chip in chips),
    )
    return RobotLooks(_RING, (board, *chips, *wheels), slabs, LEDS, _WHEEL_MM, _HEIGHT_MM, _LOW_MM, _HEIGHT_MM)


def lit(records: Any) -> Any:
    """Return which LEDs are lit, by records of `kiks.engine.state.ROBOT`: 0 for a dark one, [robot, LED]."""
    memory = records["registers"].view(MEMORY)[:, 0]
    return np.concatenate([memory["ring"], memory["body"], memory["front"]], axis=1)
