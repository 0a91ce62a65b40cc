"""The part of a camera's sensor that a picture shows."""

from __future__ import annotations

from typing import NamedTuple

SENSOR_WIDTH, SENSOR_HEIGHT = 640, 480
"""Pixels of the sensor of a colour camera (epuck-protocol.md 6.4)."""


class Window(NamedTuple):
    """A cut of a colour camera's sensor: column c and row r of the picture show its pixel (x + zoom c, y + zoom r).

    Beyond its edges the sensor goes on as there.

    Attributes:
        x: The leftmost column of the sensor that is shown.
        y: Its uppermost row.
        width: Columns of the picture.
        height: Its rows.
        zoom: Steps on the sensor from one pixel of the picture to the next.

    Example:
        >>> Window.centred(40, 40, 8)
        Window(x=160, y=80, width=40, height=40, zoom=8)
    """

    x: int = 0
    y: int = 0
    width: int = SENSOR_WIDTH
    height: int = SENSOR_HEIGHT
    zoom: int = 1

    @staticmethod
    def centred(width: int, height: int, zoom: int) -> Window:
        """Return the window of a size in the middle of the sensor."""
        return Window((SENSOR_WIDTH - width * zoom) // 2, (SENSOR_HEIGHT - height * zoom) // 2, width, height, zoom)
