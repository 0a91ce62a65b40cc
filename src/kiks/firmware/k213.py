"""The K213 linear camera, turret 2: its answers to orders (khepera-protocol.md 10.3).

It takes pictures at times of its own, one in each reading period, and answers with the last one, however often it is
asked: two answers between two instants are equal to the bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from kiks.engine.state import PIXEL_COUNT
from kiks.firmware.turret import Orders, Shape, Site, Turret
from kiks.units import s_from_ns

NUMBER = 2
"""Its turret number (khepera-protocol.md 10.1)."""

PERIODS_NS = tuple(ms * 1_000_000 for ms in (200, 50, 100, 150, 250, 500, 1000, 5000))
"""Reading periods by the code of order U [ns]; code 0 is also that of the power-on."""

Picture = tuple[Sequence[int] | NDArray[np.uint8], int]
"""64 greys 0..255, the leftmost first, and the light level, which is more for a darker scene."""


def _read_light(camera: K213) -> tuple[int, ...]:
    """L: the light level, high byte and low byte."""
    return divmod(camera.light, 256)


def _read_packed(camera: K213) -> tuple[int, ...]:
    """M: two neighbours in a byte, the upper four bits of each, the left one on top."""
    pixels = camera.pixels
    return tuple(left & 0xF0 | right >> 4 for left, right in zip(pixels[::2], pixels[1::2], strict=True))


def _read_all(camera: K213) -> tuple[int, ...]:
    """N: all pixels."""
    return tuple(camera.pixels)


def _find_brightest(camera: K213) -> tuple[int, ...]:
    """O: the index of the brightest pixel, the leftmost of equals."""
    pixels = camera.pixels
    return (pixels.index(max(pixels)),)


def _find_darkest(camera: K213) -> tuple[int, ...]:
    """P: the index of the darkest pixel, the leftmost of equals."""
    pixels = camera.pixels
    return (pixels.index(min(pixels)),)


def _read_block(camera: K213, start: int, count: int) -> tuple[int, ...]:
    """Return pixels from one on; a block that would leave the row is moved back into it."""
    start = min(max(start, 0), PIXEL_COUNT - count)
    return tuple(camera.pixels[start : start + count])


def _read_8(camera: K213, start: int) -> tuple[int, ...]:
    """Q: 8 pixels."""
    return _read_block(camera, start, 8)


def _read_16(camera: K213, start: int) -> tuple[int, ...]:
    """R: 16 pixels."""
    return _read_block(camera, start, 16)


def _read_every_second(camera: K213) -> tuple[int, ...]:
    """S: every second pixel."""
    return tuple(camera.pixels[::2])


def _read_every_fourth(camera: K213) -> tuple[int, ...]:
    """T: every fourth pixel."""
    return tuple(camera.pixels[::4])


def _set_period(camera: K213, code: int) -> tuple[int, ...] | None:
    """U: set the reading period; the present picture stays until the next instant."""
    if not 0 <= code < len(PERIODS_NS):
        return None
    camera.set_period(code)
    return ()


_ORDERS: Orders = {
    "L": (0, _read_light),
    "M": (0, _read_packed),
    "N": (0, _read_all),
    "O": (0, _find_brightest),
    "P": (0, _find_darkest),
    "Q": (1, _read_8),
    "R": (1, _read_16),
    "S": (0, _read_every_second),
    "T": (0, _read_every_fourth),
    "U": (1, _set_period),
}
"""For each order how many numbers it takes, and what it does. B is the firmware's: `revision`."""


class K213(Turret):
    """A camera on a robot.

    What it remembers (reading period, last picture) stands in the robot's record, so that it is part of every snapshot
    and hash of the state. A reset of the robot sets the period to that of the power-on; the picture stays.

    Attributes:
        take: Takes a picture of what the robot sees now; it gets the time [ns]. The world of the camera sets it.

    Example:
        >>> from kiks import Simulation
        >>> camera = Simulation().fit(1, "k213")
        >>> camera.take = lambda time_ns: (list(range(64)), 300)
        >>> camera.look(0)
        >>> camera.order("Q", (60,)), camera.order("L", ()), camera.order("X", ())
        ((56, 57, 58, 59, 60, 61, 62, 63), (1, 44), None)
    """

    number = NUMBER
    name = "K213 linear vision"
    orders = _ORDERS

    take: Callable[[int], Picture]

    def fit(self, site: Site) -> None:
        """Fit the camera to a robot; it has taken no picture yet."""
        super().fit(site)
        site.record["camera_period"], site.record["camera_taken_ns"] = 0, -1

    def due_ns(self, now_ns: int) -> int:
        """Return when its last picture up to a time [ns] is due; -1 if it has taken that."""
        record = self.site.record
        instant_ns = now_ns - now_ns % PERIODS_NS[record["camera_period"]]
        return instant_ns if instant_ns > record["camera_taken_ns"] else -1

    @property
    def period_ns(self) -> int:
        """Pictures are taken when the time is a multiple of this [ns]."""
        return PERIODS_NS[int(self.site.record["camera_period"])]

    @property
    def taken_ns(self) -> int:
        """Time of the last picture [ns]."""
        return int(self.site.record["camera_taken_ns"])

    @property
    def pixels(self) -> list[int]:
        """The last picture's greys, the leftmost first."""
        greys: list[int] = self.site.record["camera_pixels"].tolist()
        return greys

    @property
    def light(self) -> int:
        """The last picture's light level."""
        return int(self.site.record["camera_light"])

    def reset(self) -> None:
        """Set the reading period to that of the power-on."""
        self.set_period(0)

    def look(self, instant_ns: int) -> None:
        """Take a picture."""
        record = self.site.record
        record["camera_pixels"], record["camera_light"] = self.take(instant_ns)
        record["camera_taken_ns"] = instant_ns

    def set_period(self, code: int) -> None:
        """Set the reading period to that of a code of order U."""
        self.site.record["camera_period"] = code

    def status(self) -> str:
        """Return its reading period and what it took last."""
        return (
            f"a picture every {1000 * s_from_ns(self.period_ns):g} ms, the last one at "
            f"{s_from_ns(self.taken_ns):.3f} s, light level {self.light}"
        )

    def shapes(self) -> Sequence[Shape]:
        """Return a box with a lens that looks ahead."""
        box = ((-10.0, -12.0), (14.0, -12.0), (14.0, 12.0), (-10.0, 12.0))
        return (Shape(box, "#303030"), Shape(((16.0, 0.0),), "#5080c0", radius_mm=5.0))
