"""Walls and zones of the floor that are drawn as shapes: lines, boxes and discs in mm, over a picture or a box."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from typing import Annotated, Any, ClassVar, TypeVar
from weakref import ref

import numpy as np
import numpy.typing as npt
from pydantic import BeforeValidator, Field

from kiks.errors import ArenaError, ParameterError
from kiks.model.cells import EXAMINED_MAX, Area, paint, rectangle_cells, stroke_cells
from kiks.model.checks import check_count
from kiks.model.data_file import Number, Point, Rule, Whole, record
from kiks.model.materials import brightness_of

WALLS_MAX = 1000
"""Most walls of an arena that are shapes, and most zones of its floor."""

WIDTH_MAX_MM = 1000.0
"""Widest line [mm]."""

_POINTS_MAX = 100
_TWO_POINTS = "Give box_mm = [[x, y], [x, y]], two opposite corners."
_Line = Annotated[
    tuple[Point, ...],
    Field(min_length=2, max_length=_POINTS_MAX, description="Give line_mm = [[x, y], [x, y]], or more points."),
    Rule(f"a list of 2 to {_POINTS_MAX} points, each of two numbers in mm"),
]
_Box = Annotated[
    tuple[Point, ...],
    Field(min_length=2, max_length=2, description=_TWO_POINTS),
    Rule("a list of two points, each of two numbers in mm"),
]
_Paint = Annotated[
    Whole,
    BeforeValidator(brightness_of, json_schema_input_type=int | str),
    Field(ge=0, le=255, description="1 is black, 255 white, 0 floor; or the name of a material, such as 'wood'."),
]


@record
class PaintedShape:
    """What is painted on a raster: a line, a box or a disc; later ones cover earlier ones."""

    label: ClassVar[str]
    """What it is, in files and messages."""

    line_mm: _Line | None = None
    box_mm: _Box | None = None
    disc_mm: Annotated[Point, Field(description="Give disc_mm = [x, y], its centre.")] | None = None
    width_mm: Annotated[Number, Field(gt=0, le=WIDTH_MAX_MM, description="Leave it out for 10 mm.")] | None = None
    radius_mm: Annotated[Number, Field(gt=0, le=1e4)] | None = None

    def __post_init__(self) -> None:
        shapes = [name for name in ("line_mm", "box_mm", "disc_mm") if getattr(self, name) is not None]
        if len(shapes) != 1:
            raise ParameterError(
                f"a {self.label} must have one of line_mm, box_mm and disc_mm, but it has "
                f"{' and '.join(shapes) or 'none'}. Give each shape a [[{self.label}]] of its own."
            )
        for name, shape in (("width_mm", "line_mm"), ("radius_mm", "disc_mm")):
            if getattr(self, name) is not None and shapes != [shape]:
                raise ParameterError(f"{name} must come with {shape}, but it came with {shapes[0]}. Remove it.")
        if self.disc_mm is not None and self.radius_mm is None:
            raise ParameterError("radius_mm must come with disc_mm, but it is missing. Give radius_mm = 20.")

    def table(self) -> dict[str, Any]:
        """Return its keys and values in a file."""
        values = ((each.name, getattr(self, each.name)) for each in fields(self))
        return {name: value for name, value in values if value is not None}

    @property
    def thick_mm(self) -> float:
        """How thick a line is [mm]."""
        return 10.0 if self.width_mm is None else self.width_mm

    def cells(self, shape: tuple[int, int], mm_per_cell: float) -> Iterable[Area]:
        """Return the cells of a raster that it covers; `shape` has its rows and columns."""

        def in_cells(points_mm: Iterable[Sequence[float]]) -> list[tuple[float, float]]:
            return [(x_mm / mm_per_cell, y_mm / mm_per_cell) for x_mm, y_mm in points_mm]

        if self.box_mm is not None:
            corner, opposite = in_cells(self.box_mm)
            return rectangle_cells(shape, corner, opposite)
        points_mm, width_mm = self.line_mm, self.thick_mm
        if self.disc_mm is not None and self.radius_mm is not None:
            points_mm, width_mm = (self.disc_mm,), 2 * self.radius_mm
        return stroke_cells(shape, in_cells(points_mm or ()), width_mm / mm_per_cell)


@record
class Wall(PaintedShape):
    """A wall with a shape, of which it has one; later walls cover earlier ones.

    Args:
        line_mm: Points that a line goes through [mm].
        box_mm: Two opposite corners of a box [mm].
        disc_mm: The centre of a disc [mm].
        width_mm: How thick a line is [mm]; its ends are round.
        radius_mm: Radius of a disc [mm].
        brightness: 1 black to 255 white, or a material; 0 makes floor of what is there, such as a door.

    Example:
        >>> from kiks import Arena
        >>> from dataclasses import replace
        >>> arena = replace(Arena.box(400, 300), walls=(Wall(line_mm=((200, 10), (200, 200)), brightness="wood"),))
        >>> int(arena.brightness[100, 200])
        190
    """

    label = "wall"

    brightness: _Paint = 255


@record
class Zone(PaintedShape):
    """A zone of the floor with a shape, of which it has one; later zones cover earlier ones.

    Args:
        line_mm: Points that a line goes through [mm].
        box_mm: Two opposite corners of a box [mm].
        disc_mm: The centre of a disc [mm].
        width_mm: How thick a line is [mm]; its ends are round.
        radius_mm: Radius of a disc [mm].
        brightness: 0 black to 255 white, as the floor is without zones.

    Example:
        >>> from kiks import Arena
        >>> from dataclasses import replace
        >>> arena = replace(Arena.box(400, 300), zones=(Zone(disc_mm=(400, 300), radius_mm=80),))
        >>> int(arena.shades[270, 370]), int(arena.shades[20, 20])
        (0, 255)
    """

    label = "zone"

    brightness: Annotated[Whole, Field(ge=0, le=255, description="0 is black, 255 white.")] = 0


AnyShape = TypeVar("AnyShape", Wall, Zone)

_Raster = npt.NDArray[np.uint8]

_newest: dict[str, tuple[Callable[[], Any], Any, Callable[[], _Raster | None]]] = {}
"""For each label the ground of the newest raster, cells and shapes, and the raster, as long as an arena has it."""


def painted(ground: _Raster, mm_per_cell: float, shapes: Sequence[AnyShape]) -> _Raster:
    """Return a raster with walls or zones over the ground, the ground itself if there are none.

    Args:
        ground: uint8 [row, column], row 0 at the bottom.
        mm_per_cell: Edge of a cell [mm].
        shapes: The walls or zones.

    Raises:
        ArenaError: If one covers nothing, or all together too much.
    """
    if not shapes:
        return ground
    label = shapes[0].label
    # Whatever changes in an arena makes another one, mostly with the same walls.
    of_ground, made_of, of_raster = _newest.get(label, (lambda: None, None, lambda: None))
    if of_ground() is ground and made_of == (mm_per_cell, shapes) and (known := of_raster()) is not None:
        return known
    check_count(f"the number of {label}s", len(shapes), 0, WALLS_MAX, "Draw a picture instead.")
    raster, left = ground.copy(), EXAMINED_MAX
    for number, shape in enumerate(shapes, start=1):
        examined = paint(raster, shape.cells(raster.shape, mm_per_cell), shape.brightness, left)
        left -= examined
        if not examined:
            raise ArenaError(
                f"{label} {number} must cover a part of the arena, but it covers no cell of it. The arena is "
                f"{raster.shape[1] * mm_per_cell:g} x {raster.shape[0] * mm_per_cell:g} mm, with cells of "
                f"{mm_per_cell:g} mm."
            )
    raster.setflags(write=False)
    _newest[label] = ref(ground), (mm_per_cell, shapes), ref(raster)
    return raster
