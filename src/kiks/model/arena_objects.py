"""The objects of an arena: starts, lamps, balls and cylinders, and the check of their places."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
from pydantic import AfterValidator, BeforeValidator, Field

from kiks.errors import ArenaError, ParameterError, shown
from kiks.model.checks import check_heading
from kiks.model.data_file import Coordinate, Number, Switch, Whole, check, record
from kiks.model.materials import brightness_of
from kiks.units import TICK_NS, ns_from_s

THINGS_MAX = 1000
"""Most starts, lamps, balls and cylinders of a file, each."""

Brightness = Annotated[
    Whole,
    BeforeValidator(brightness_of, json_schema_input_type=int | str),
    Field(ge=1, le=255, description="1 is black, 255 white; or the name of a material, such as 'wood'."),
]
Radius = Annotated[Number, Field(ge=10, le=100, description="Leave it out for the usual one.")]
Friction = Annotated[Number, Field(ge=0, le=1e5, description="Leave it out for the usual one.")]
Power = Annotated[
    Number, Field(gt=0, le=1e9, description="A Khepera lamp has 1 W. Switch a lamp off with is_on instead.")
]
Heading = Annotated[Coordinate, AfterValidator(partial(check_heading, "heading_rad"))]


class Pose(NamedTuple):
    """The pose of a robot: position [mm], heading [rad] counter-clockwise from +x."""

    x_mm: Coordinate
    y_mm: Coordinate
    heading_rad: Heading


class Lamp(NamedTuple):
    """A point of light: position [mm], electric power [W]."""

    x_mm: Coordinate
    y_mm: Coordinate
    power_w: Power = 1.0
    is_on: Switch = True


@record
class LampSwitch:
    """A lamp that is switched in the course of a run.

    Args:
        time_s: When, from the beginning of the run on, in whole ticks of 10 ms, rounded up [s].
        lamp: The row of the lamp, counted from 1.
        is_on: Whether it is on from then on.

    Example:
        >>> LampSwitch(30, lamp=1, is_on=False)
        LampSwitch(time_s=30.0, lamp=1, is_on=False)
    """

    time_s: Annotated[Number, Field(ge=0, le=1e6)]
    lamp: Annotated[Whole, Field(ge=1, le=THINGS_MAX, description="1 is the first [[lamp]].")]
    is_on: Switch

    @property
    def tick(self) -> int:
        """The number of ticks after which it acts."""
        return -(-ns_from_s(self.time_s) // TICK_NS)


class Ball(NamedTuple):
    """A ball that rolls when it is kicked: its centre [mm], radius [mm], what friction takes off its speed [mm/s^2].

    Size and friction are those of KiKS (kiks-behaviour.md 3.6). Its grey of 25 sends back so little light that a
    Khepera would run into it unseen: this one is white, as those are that people play with.
    """

    x_mm: Coordinate
    y_mm: Coordinate
    radius_mm: Radius = 32.0
    friction_mm_s2: Friction = 20.0
    brightness: Brightness = 255


class Cylinder(NamedTuple):
    """A cylinder that slides while it is pushed: its centre [mm], radius [mm], friction [mm/s^2] when a ball hits it.

    Size and friction are those of KiKS (kiks-behaviour.md 3.6), where its grey was 70; this one is of wood.
    """

    x_mm: Coordinate
    y_mm: Coordinate
    radius_mm: Radius = 16.0
    friction_mm_s2: Friction = 160.0
    brightness: Brightness = 190


_Place = TypeVar("_Place", bound=tuple[Any, ...])


def checked_places(
    label: str,
    kind: Callable[..., _Place],
    entries: Iterable[Iterable[Any]],
    brightness: npt.NDArray[np.uint8],
    mm_per_cell: float,
) -> tuple[_Place, ...]:
    """Return the entries as a tuple of `kind`. All stand on floor; what messages call "lamp" may hang over a wall."""
    places: list[_Place] = []
    model: Any = kind
    try:
        given = [tuple(entry) for entry in entries]
    except TypeError:
        raise ParameterError(
            f"{label}s must be a list, and each of them a list of its values, but they were {shown(entries)}."
        ) from None
    for number, entry in enumerate(given, start=1):
        entry_label = f"{label} {number}"
        values = [value.item() if isinstance(value, np.generic) else value for value in entry]
        place = check(model, dict(zip(model._fields, values, strict=False)), entry_label)
        _check_position(entry_label, place[0], place[1], brightness, mm_per_cell)
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
