"""The arena file: a picture or a box, and the objects in it, in a few lines of TOML (the page "Arenas")."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt
from pydantic import Field

from kiks.errors import ArenaError, KiksError, ParameterError
from kiks.model.arena import Arena
from kiks.model.arena_doubts import check_has_floor, doubt_colours
from kiks.model.arena_objects import (
    THINGS_MAX,
    Ball,
    Brightness,
    Cylinder,
    Friction,
    Lamp,
    LampSwitch,
    Pose,
    Power,
    Radius,
)
from kiks.model.atomic_files import path_of, replace_files, within
from kiks.model.box import PartMm, SideMm
from kiks.model.data_file import Coordinate, Number, Point, Rule, Switch, Text, check, parse_toml, read_file, record
from kiks.model.picture import Pixels, encode_picture, read_picture
from kiks.model.raster import MM_PER_PIXEL_MAX, MM_PER_PIXEL_MIN
from kiks.model.walls import WALLS_MAX, Wall, Zone

MIDDLE = 128
"""Grey from which on an inverted picture is floor."""

DARK_IS_WALL = "with invert = true, what is darker than a middle grey is wall."

Pitch = Annotated[
    Number, Field(ge=MM_PER_PIXEL_MIN, le=MM_PER_PIXEL_MAX, description="Most arenas are drawn with 1 mm per pixel.")
]
At = Annotated[Point, Field(description="Give at_mm = [x, y]; y counts upwards from the lower edge.")]
Size = Annotated[
    tuple[SideMm, ...],
    Field(min_length=2, max_length=2, description="Give size_mm = [width, height]."),
    Rule("two whole numbers in mm"),
]


@record
class StartEntry:
    """The start of a robot."""

    at_mm: At
    heading_deg: Annotated[Coordinate, Field(description="0 looks right, 90 up.")] = 90.0


@record
class LampEntry:
    """A lamp."""

    at_mm: At
    power_w: Power = 1.0
    is_on: Switch = True


@record
class BallEntry:
    """A ball that rolls after a kick."""

    at_mm: At
    radius_mm: Radius = 32.0
    friction_mm_s2: Friction = 20.0
    brightness: Brightness = 255


@record
class CylinderEntry:
    """A cylinder that slides while it is pushed."""

    at_mm: At
    radius_mm: Radius = 16.0
    friction_mm_s2: Friction = 160.0
    brightness: Brightness = 190


def _headed(entry: Any, label: str, most: int = THINGS_MAX) -> Any:
    return Annotated[tuple[entry, ...], Field(max_length=most, description=f"Head each with [[{label}]].")]


@record
class Places:
    """What stands in an arena, with its walls and zones that are shapes."""

    start: _headed(StartEntry, "start") = ()  # type: ignore[valid-type]
    lamp: _headed(LampEntry, "lamp") = ()  # type: ignore[valid-type]
    lamp_switch: _headed(LampSwitch, "lamp_switch") = ()  # type: ignore[valid-type]
    ball: _headed(BallEntry, "ball") = ()  # type: ignore[valid-type]
    cylinder: _headed(CylinderEntry, "cylinder") = ()  # type: ignore[valid-type]
    wall: _headed(Wall, "wall", WALLS_MAX) = ()  # type: ignore[valid-type]
    zone: _headed(Zone, "zone", WALLS_MAX) = ()  # type: ignore[valid-type]

    def placed_in(self, arena: Arena, **others: Any) -> Arena:
        """Return an arena with all of that, and with other attributes changed."""

        def at(kind: Any, entries: Iterable[Any]) -> tuple[Any, ...]:
            return tuple(kind(*each.at_mm, *(getattr(each, name) for name in kind._fields[2:])) for each in entries)

        return replace(
            arena,
            starts=tuple(Pose(each.at_mm[0], each.at_mm[1], math.radians(each.heading_deg)) for each in self.start),
            lamps=at(Lamp, self.lamp),
            lamp_switches=self.lamp_switch,
            balls=at(Ball, self.ball),
            cylinders=at(Cylinder, self.cylinder),
            walls=self.wall,
            zones=self.zone,
            **others,
        )


@record
class Walls:
    """The walls of an arena: a picture, or a box in whole millimetres."""

    size_mm: Size | None = None
    wall_mm: PartMm | None = None
    rounded_mm: PartMm | None = None
    brightness: Brightness | None = None

    def box(self) -> Arena:
        """Return the box."""
        if self.size_mm is None:
            raise ParameterError("size_mm must be given, but it is missing. Give size_mm = [width, height].")
        keys = {name: getattr(self, name) for name in ("wall_mm", "rounded_mm", "brightness")}
        return Arena.box(*self.size_mm, **{name: value for name, value in keys.items() if value is not None})

    def check_is_alone(self, rival: str) -> None:
        """Check that no key of a box came with one of a picture."""
        given = [name for name in ("size_mm", "wall_mm", "rounded_mm", "brightness") if getattr(self, name) is not None]
        if given:
            raise ParameterError(
                f"walls must be either a picture or a box, but {rival} came with {given[0]}. Remove one of them."
            )


@record
class ArenaFile(Places, Walls):
    """An arena of KiKS: walls and objects."""

    name: Text | None = None
    picture: Annotated[Text, Field(description="A picture in the file's folder or below it.")] | None = None
    mm_per_pixel: Pitch | None = None
    invert: Annotated[Switch, Field(description="true where walls are black and the floor is white.")] | None = None
    floor: Annotated[Text, Field(description="A picture of the floor, as large as the walls.")] | None = None

    def __post_init__(self) -> None:
        if self.picture is not None:
            self.check_is_alone("picture")
        elif self.mm_per_pixel is not None:
            raise ParameterError("mm_per_pixel must come with a picture, but there is none. Boxes have cells of 1 mm.")
        elif self.invert is not None:
            raise ParameterError("invert must come with a picture, but there is none. Remove it.")
        elif self.size_mm is None:
            raise ParameterError(
                "an arena must have a picture or a size, but it has neither. "
                'Give picture = "name.png" or size_mm = [width, height].'
            )


def load_arena(path: Path) -> Arena:
    """Read an arena file, whose picture lies in the same folder or below."""
    what = f"Arena file {str(path)!r}"
    arena, file = _decode(read_file(path, what, error=ArenaError), what, path.stem, path.parent)
    if file.picture is not None and file.invert is not False:
        doubt_colours(arena, path, DARK_IS_WALL if file.invert else None)
    return arena


def decode_arena(data: bytes, name: str = "arena") -> Arena:
    """Read the bytes of an arena file that has no picture; it is called `name` if it does not say."""
    return _decode(data, "The arena file", name, None)[0]


def _decode(data: bytes, what: str, name: str, folder: Path | None) -> tuple[Arena, ArenaFile]:
    file = check(ArenaFile, parse_toml(data, what, error=ArenaError), what, error=ArenaError)
    try:
        name = name if file.name is None else file.name
        arena = file.box() if file.picture is None else _picture_arena(file, folder, name)
        floor = None
        if file.floor is not None:
            mm_per_pixel = file.mm_per_pixel or 1.0
            floor = floor_of(_picture_beside(folder, file.floor, "floor", mm_per_pixel), mm_per_pixel, arena)
        return file.placed_in(arena, name=name, floor=floor), file
    except KiksError as error:
        raise ArenaError(f"{what}: {error}") from None


def _picture_beside(folder: Path | None, name: str, key: str, mm_per_pixel: float) -> Pixels:
    if folder is None:
        raise ArenaError(
            f"an arena that comes alone must have no {key} beside it, but it names one. Make a project of it, which "
            "holds its pictures."
        )
    return read_picture(within(folder, name, key), mm_per_pixel)


def floor_of(pixels: Pixels, mm_per_pixel: float, arena: Arena) -> npt.NDArray[np.uint8]:
    """Return the floor of an arena, uint8 [row, column], row 0 below, from its picture."""
    picture = pixels.on_white
    step = round(mm_per_pixel / arena.mm_per_cell)
    rows, columns = (side // step for side in arena.ground.shape)
    if picture.shape != (rows, columns):
        raise ArenaError(
            f"the picture of the floor must be as large as the arena, {columns} x {rows} pixels of {mm_per_pixel:g} "
            f"mm, but it has {picture.shape[1]} x {picture.shape[0]}. Draw it in that size."
        )
    return np.flipud(picture).repeat(step, axis=0).repeat(step, axis=1)


def _picture_arena(file: ArenaFile, folder: Path | None, name: str) -> Arena:
    mm_per_pixel = file.mm_per_pixel or 1.0
    pixels = _picture_beside(folder, file.picture or "", "picture", mm_per_pixel)
    if file.invert:
        grey = pixels.on_white
        is_wall = grey < MIDDLE  # white is often 254, and edges are smoothed
        check_has_floor(is_wall, DARK_IS_WALL)
        brightness = np.where(is_wall, 255 - grey, np.uint8(0))
    else:
        brightness = pixels.brightness
    return Arena.from_array(brightness, mm_per_pixel=mm_per_pixel, name=name)


def save_arena(arena: Arena, path: str | Path) -> None:
    """Write an arena as a TOML file and, beside it, a PNG of the same name; existing files are replaced.

    A picture of the floor has the same name with `_floor`.
    """
    path = path_of(path)
    if path.suffix.lower() != ".toml":
        raise ParameterError(f"path must end in '.toml', but it was {str(path)!r}. The picture goes beside it as .png.")
    picture = path.with_suffix(".png")
    keys = {"picture": picture.name, "mm_per_pixel": arena.mm_per_cell, "name": arena.name}
    files: dict[str | Path, bytes | str] = {picture: encode_picture(arena.ground)}
    if arena.floor is not None:
        floor = path.with_name(f"{path.stem}_floor.png")
        keys["floor"], files[floor] = floor.name, encode_picture(arena.floor)
    lines = [*(f"{name} = {toml(value)}" for name, value in keys.items()), *place_lines(arena)]
    replace_files(files | {path: "\n".join(lines) + "\n"}, "an arena")


def place_lines(arena: Arena) -> list[str]:
    """Return the lines of a file that `Places` reads."""
    lines: list[str] = []

    def entry(label: str, place: Any, **values: Any) -> None:
        lines.extend(("", f"[[{label}]]", f"at_mm = {toml(place[:2])}"))
        lines.extend(f"{name} = {toml(value)}" for name, value in values.items())

    for start in arena.starts:
        entry("start", start, heading_deg=_degrees(start.heading_rad))
    for label, places in (("lamp", arena.lamps), ("ball", arena.balls), ("cylinder", arena.cylinders)):
        for place in places:
            entry(label, place, **dict(zip(place._fields[2:], place[2:], strict=True)))
    for switch in arena.lamp_switches:
        lines += ["", "[[lamp_switch]]", *(f"{name} = {toml(value)}" for name, value in vars(switch).items())]
    for shape in (*arena.walls, *arena.zones):
        lines += ["", f"[[{shape.label}]]", *(f"{name} = {toml(value)}" for name, value in shape.table().items())]
    return lines


def _degrees(angle_rad: float) -> float:
    """Return an angle with the fewest digits that restore it."""
    angle_deg = math.degrees(angle_rad)
    short = (round(angle_deg, digits) for digits in range(13))
    return next((each for each in short if math.radians(each) == angle_rad), angle_deg)


def toml(value: Any) -> str:
    """Return a value as TOML: a text, a number, true or false, or a list or table of them.

    Example:
        >>> toml({"a b": (1.5, True), "c": "d"})
        '{ "a b" = [1.5, true], c = "d" }'
    """
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{toml_key(key)} = {toml(each)}' for key, each in value.items())} }}"
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str):
        return repr(value)
    if "\n" not in value or "'''" in f"{value}'" or not all(each.isprintable() or each in "\n\t" for each in value):
        return quoted(value)
    return f"'''\n{value}'''"  # as people read and write it


def toml_key(name: str) -> str:
    """Return a name as a key of TOML."""
    return name if name.isascii() and name.isidentifier() else quoted(name)


def quoted(text: str) -> str:
    """Return a text in TOML."""
    # TOML quotes like JSON, except for one control character that JSON does not escape.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
