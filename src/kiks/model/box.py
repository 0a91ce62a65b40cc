"""An empty box: the arena that a few numbers say, in Python, in arena files and in projects."""

from __future__ import annotations

from contextlib import suppress
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import BeforeValidator, Field

from kiks.errors import KiksError, ParameterError
from kiks.model.arena_objects import Brightness
from kiks.model.data_file import Whole, record
from kiks.model.raster import SIZE_MIN_MM, cells_per_pixel


def _whole(value: Any) -> Any:
    """Return a number without a fraction as an int; anything else as it is."""
    if isinstance(value, np.generic):
        value = value.item()
    return int(value) if isinstance(value, float) and value.is_integer() else value


_WHOLE = BeforeValidator(_whole, json_schema_input_type=int)
_ADVICE = "Boxes are drawn in whole millimetres."
SideMm = Annotated[Whole, _WHOLE, Field(ge=SIZE_MIN_MM, le=1_000_000_000, description=f"{_ADVICE} A robot needs room.")]
PartMm = Annotated[Whole, _WHOLE, Field(ge=0, le=1_000_000_000, description=_ADVICE)]


@record
class Box:
    """An empty box with a wall around it, in whole millimetres; see `Arena.box`."""

    width_mm: SideMm
    height_mm: SideMm
    wall_mm: PartMm = 10
    rounded_mm: PartMm = 0
    brightness: Annotated[Brightness, BeforeValidator(_whole)] = 255

    def __post_init__(self) -> None:
        side_mm = min(self.width_mm, self.height_mm)
        for name, most, advice in (
            ("wall_mm", (side_mm - 1) // 2, "Floor must remain between the walls."),
            ("rounded_mm", side_mm // 2 - self.wall_mm, "A corner ends where the next begins."),
        ):
            if (value := getattr(self, name)) > most:
                raise ParameterError(f"{name} must be a whole number from 0 to {most}, but it was {value}. {advice}")

    def raster(self) -> npt.NDArray[np.uint8]:
        """Draw it at 1 mm per cell: uint8 [row, column]."""
        cells_per_pixel(self.height_mm, self.width_mm, 1.0)
        raster = np.full((self.height_mm, self.width_mm), self.brightness, np.uint8)
        wall, radius = self.wall_mm, self.rounded_mm
        floor = raster[wall : self.height_mm - wall, wall : self.width_mm - wall]
        floor[...] = 0
        from_centre_mm = radius - np.arange(radius) - 0.5
        outside_circle = from_centre_mm[:, None] ** 2 + from_centre_mm**2 > radius**2
        for corner in (floor, floor[::-1], floor[:, ::-1], floor[::-1, ::-1]):
            corner[:radius, :radius][outside_circle] = self.brightness
        return raster

    @classmethod
    def of_raster(cls, raster: npt.NDArray[np.uint8]) -> Box | None:
        """Return the box that has the very raster at 1 mm per cell, None if there is none."""
        height, width = raster.shape
        greys = raster[raster > 0]
        grey = int(greys[0]) if len(greys) else 255
        wall = int(np.argmax(raster[:, width // 2] == 0))
        corner = int(np.argmax(raster[wall, wall:] == 0))
        for rounded in range(corner, min(width, height) // 2 - wall + 1):
            # The number of cells of the first row that are outside a circle of that radius.
            from_centre = rounded - np.arange(min(corner + 1, rounded)) - 0.5
            if np.count_nonzero(from_centre**2 + (rounded - 0.5) ** 2 > rounded**2) == corner:
                with suppress(KiksError):
                    box = cls(width, height, wall, rounded, grey)
                    if np.array_equal(box.raster(), raster):
                        return box
        return None
