"""What an arena holds besides walls: where robots start, lamps, balls and cylinders, and whether they may be there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError, ParameterError
from kiks.model.materials import brightness_of
from kiks.model.raster import is_number

RADIUS_MIN_MM, RADIUS_MAX_MM = 10.0, 100.0
"""Radii that balls and cylinders may have [mm]."""


class Pose(NamedTuple):
    """Where a robot stands and looks: position [mm], heading [rad] counter-clockwise from +x."""

    x_mm: float
    y_mm: float
    heading_rad: float


class Lamp(NamedTuple):
    """A point of light: position [mm], electric power [W]."""

    x_mm: float
    y_mm: float
    power_w: float = 1.0
    is_on: bool = True


class Ball(NamedTuple):
    """A ball that rolls when it is kicked: its centre [mm], radius [mm], what friction takes off its speed [mm/s^2].

    Size and friction are those of KiKS (kiks-behaviour.md 3.6). Its grey of 25 sends back so little light that a
    Khepera would run into it unseen: this one is white, as those are that people play with.
    """

    x_mm: float
    y_mm: float
    radius_mm: float = 32.0
    friction_mm_s2: float = 20.0
    brightness: int = 255


class Cylinder(NamedTuple):
    """A cylinder that slides while it is pushed: its centre [mm], radius [mm], friction [mm/s^2] when a ball hits it.

    Size and friction are those of KiKS (kiks-behaviour.md 3.6), where its grey was 70; this one is of wood.
    """

    x_mm: float
    y_mm: float
    radius_mm: float = 16.0
    friction_mm_s2: float = 160.0
    brightness: int = 190


_Place = TypeVar("_Place", bound=tuple[Any, ...])


def checked_places(
    label: str,
    kind: Callable[..., _Place],
    entries: Iterable[Iterable[Any]],
    brightness: npt.NDArray[np.uint8],
    mm_per_cell: float,
) -> tuple[_Place, ...]:
    """Return the entries as a tuple of `kind`, once each of them may be where it is.

    Args:
        label: What messages call an entry; "lamp" may hang over a wall, everything else stands on floor.
        kind: `Pose`, `Lamp`, `Ball` or `Cylinder`.
        entries: The entries, or plain tuples of the same numbers.
        brightness: The arena's raster, uint8 [row, column], row 0 at the bottom.
        mm_per_cell: Edge of a cell [mm].

    Raises:
        ParameterError: If an entry holds something else than finite numbers.
        ArenaError: If an entry lies outside the arena or in a wall, or a lamp's power is not positive.
    """
    places = []
    for number, entry in enumerate(entries, start=1):
        who, values = f"{label} {number}", list(entry)
        # Beyond the numbers come the switch of a lamp, and the brightness of a body.
        count = 3 if kind is Pose or kind is Lamp else 4
        if not all(is_number(value) for value in values[:count]):
            raise ParameterError(
                f"{who} must be made of finite numbers, but it was {values!r}. Give places in mm and headings in rad."
            )
        last = map(bool, values[count:]) if kind is Lamp else map(brightness_of, values[count:])
        place = kind(*(float(value) for value in values[:count]), *last)
        _check_position(who, place[0], place[1], brightness, mm_per_cell)
        if isinstance(place, Lamp) and place.power_w <= 0:
            raise ArenaError(
                f"{who}: power_w must be positive, but it was {place.power_w:g}. Switch a lamp off with is_on instead."
            )
        if isinstance(place, Ball | Cylinder):
            _check_body(who, place)
        places.append(place)
    return tuple(places)


def _check_position(who: str, x_mm: float, y_mm: float, brightness: npt.NDArray[np.uint8], mm_per_cell: float) -> None:
    row_count, column_count = brightness.shape
    where = f"({x_mm:g}, {y_mm:g}) mm"
    row, column = math.floor(y_mm / mm_per_cell), math.floor(x_mm / mm_per_cell)
    if not (0 <= row < row_count and 0 <= column < column_count):
        raise ArenaError(
            f"{who} must lie inside the arena, but it is at {where}. The arena is "
            f"{column_count * mm_per_cell:g} x {row_count * mm_per_cell:g} mm and (0, 0) is its lower left corner."
        )
    if not who.startswith("lamp") and brightness[row, column]:
        raise ArenaError(
            f"{who} must stand on floor, but at {where} is a wall. Move it; y counts upwards from the lower edge."
        )


def _check_body(who: str, body: Ball | Cylinder) -> None:
    for name, value, low, high in (
        ("radius_mm", body.radius_mm, RADIUS_MIN_MM, RADIUS_MAX_MM),
        ("friction_mm_s2", body.friction_mm_s2, 0, 1e5),
        ("brightness", body.brightness, 1, 255),
    ):
        if not (is_number(value) and low <= value <= high and (name != "brightness" or isinstance(value, int))):
            raise ArenaError(
                f"{who}: {name} must be a {'whole ' if name == 'brightness' else ''}number from {low} to {high:g}, "
                f"but it was {value!r}. Leave it out for the usual one."
            )
