"""How a Khepera looks: two round boards on two wheels, with chips, rows of pins and two LEDs."""

from __future__ import annotations

from kiks.firmware.robot_looks import Led, RobotLooks, Slab, box, disc
from kiks.model.robot import Body

_RADIUS_MM = 27.5  # to which the following belong
_BOARD, _LOWER, _UPPER = "#22643f", "#1f6b42", "#2a7f50"
_WHEEL, _PIN, _CHIP, _BASE = "#17191c", "#d7b45a", "#10231a", "#2a2e33"
_CHIPS = ((-17.0, -6.0, 11.0, 12.0), (-6.0, 12.5, 14.0, 5.0), (-6.0, -17.5, 14.0, 5.0))
_PINS = ((-11.6, -21.2, 23.2, 1.2), (-11.6, 20.0, 23.2, 1.2))

LEDS = Led("0", -4.0, 18.0, 28.5), Led("1", 15.0, 9.5, 28.5)


def looks(body: Body) -> RobotLooks:
    """Return how a Khepera with a body looks."""
    size = body.radius_mm / _RADIUS_MM
    wheel_mm = body.wheel_base_mm / 2 / size - 1.5
    boxes = [((-8.0, side * wheel_mm - 2.4, 16.0, 4.8), _WHEEL) for side in (-1, 1)]
    boxes += [(pins, _PIN) for pins in _PINS] + [(chip, _CHIP) for chip in _CHIPS]
    slabs = [
        Slab(box(-20.0, -18.0, 40.0, 36.0, _BASE), 3.0, 14.0),
        Slab(disc(body.radius_mm, _LOWER), 15.0, 16.6),
        Slab(disc(body.radius_mm, _UPPER), 26.0, 27.6),
        *(Slab(box(*chip, "#15191c"), 27.4, high_mm) for chip, high_mm in zip(_CHIPS, (29.8, 29.4, 29.4), strict=True)),
        *(Slab(box(-13.0, side * 20.6 - 1.3, 26.0, 2.6, "#caa64a"), 15.0, 26.0) for side in (-1, 1)),
    ]
    return RobotLooks(_BOARD, tuple(box(*sides, paint, size) for sides, paint in boxes), tuple(slabs), LEDS)
