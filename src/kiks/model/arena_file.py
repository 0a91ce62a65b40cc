"""The arena file: a picture or a box, and what stands in it, in a few lines of TOML (docs/arenas.md)."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from kiks.errors import ArenaError, KiksError, ParameterError, nearest
from kiks.model.arena import Arena
from kiks.model.picture import check_is_file, read_picture
from kiks.model.places import Ball, Cylinder, Lamp, Pose
from kiks.model.raster import is_number

_PICTURE_KEYS = ("picture", "mm_per_pixel")
BOX_KEYS = ("size_mm", "wall_mm", "rounded_mm", "brightness")
ENTRY_KEYS = {
    "start": ("at_mm", "heading_deg"),
    "lamp": ("at_mm", "power_w", "is_on"),
    "ball": ("at_mm", "radius_mm", "friction_mm_s2", "brightness"),
    "cylinder": ("at_mm", "radius_mm", "friction_mm_s2", "brightness"),
}
_Body = TypeVar("_Body", Ball, Cylinder)
_TOP_KEYS = (*_PICTURE_KEYS, *BOX_KEYS, "name", *ENTRY_KEYS)


def load_arena(path: Path) -> Arena:
    """Read an arena file.

    Args:
        path: The TOML file; its picture lies in the same folder or below.

    Raises:
        ArenaError: If the file or its picture is missing, damaged, or no arena. The message names file and entry.
    """
    what = f"Arena file {str(path)!r}"
    check_is_file(path, what)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ArenaError(f"{what} must be readable, but: {error}. Check its rights.") from None
    return _decode(data, what, path.stem, path.parent)


def decode_arena(data: bytes, name: str = "arena", what: str = "The arena file") -> Arena:
    """Read the bytes of an arena file that has no picture.

    Args:
        data: The bytes.
        name: What people call the arena if the file does not say.
        what: What messages call the file.

    Raises:
        ArenaError: If it is damaged, no arena, or has a picture.
    """
    return _decode(data, what, name, None)


def _decode(data: bytes, what: str, name: str, folder: Path | None) -> Arena:
    try:
        # Undecodable bytes and endless numbers are ValueErrors too; deep nesting ends in a RecursionError.
        table = tomllib.loads(data.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise ArenaError(f"{what} must be TOML in UTF-8, but: {error}. Correct the file at that place.") from None
    try:
        return _arena_of(table, name, folder)
    except KiksError as error:
        raise ArenaError(f"{what}: {error}") from None


def save_arena(arena: Arena, path: str | Path) -> None:
    """Write an arena as a TOML file and, beside it, a PNG of the same name; existing files are replaced.

    Args:
        arena: The arena.
        path: The TOML file.

    Raises:
        ParameterError: If the name does not end in .toml.
        ArenaError: If the files cannot be written.
    """
    from PIL import Image

    path = Path(path)
    if path.suffix.lower() != ".toml":
        raise ParameterError(f"path must end in '.toml', but it was {str(path)!r}. The picture goes beside it as .png.")
    picture = path.with_suffix(".png")
    try:
        Image.fromarray(np.flipud(arena.brightness)).save(picture)
        path.write_text(_toml_of(arena, picture.name), encoding="utf-8")
    except OSError as error:
        raise ArenaError(
            f"Arena {arena.name!r} must be written to {str(path)!r}, but: {error}. Check the folder."
        ) from None


def _arena_of(table: dict[str, Any], name: str, folder: Path | None) -> Arena:
    check_keys(table, _TOP_KEYS, "the file")
    for keys, rival in ((_PICTURE_KEYS, "size_mm"), (BOX_KEYS, "picture")):
        if rival in table and (given := [key for key in keys if key in table]):
            raise ArenaError(
                f"an arena must be either a picture or a box, but {rival} came with {given[0]}. Remove one of them."
            )
    if "picture" in table:
        if folder is None:
            raise ArenaError(
                "an arena that comes alone must have no picture beside it, but it names one. Open that picture instead."
            )
        arena = _picture_arena(table, folder)
    elif "size_mm" in table:
        width_mm, height_mm = pair_of(table, "size_mm", "the box")
        box_keys = {key: table[key] for key in BOX_KEYS[1:] if key in table}
        arena = Arena.box(width_mm, height_mm, **box_keys)
    else:
        raise ArenaError(
            "an arena must have a picture or a size, but it has neither. "
            'Give picture = "name.png" or size_mm = [width, height].'
        )
    return replace(arena, name=typed(table, "name", str, name, "the file"), **places_of(table))


def places_of(table: dict[str, Any]) -> dict[str, Any]:
    """Return what the entries of a file say of starts, lamps, balls and cylinders, for `dataclasses.replace`.

    Raises:
        ArenaError: If an entry has unknown keys or values of another type.
    """
    return {
        "starts": tuple(_starts(table)),
        "lamps": tuple(_lamps(table)),
        "balls": tuple(_body(Ball, who, entry) for who, entry in entries_of(table, "ball", ENTRY_KEYS["ball"])),
        "cylinders": tuple(
            _body(Cylinder, who, entry) for who, entry in entries_of(table, "cylinder", ENTRY_KEYS["cylinder"])
        ),
    }


def _picture_arena(table: dict[str, Any], folder: Path) -> Arena:
    given = typed(table, "picture", str, "", "the file")
    home = folder.resolve()
    try:
        picture = (home / given).resolve()
    except (ValueError, OSError, RuntimeError):
        # A NUL character, or links that lead in a circle.
        picture = home.parent
    if not picture.is_relative_to(home) or Path(given).is_absolute():
        raise ArenaError(
            f"picture must lie in the arena file's folder or below it, but it was {given!r}. "
            "Copy the picture beside the file and give its name."
        )
    mm_per_pixel = table.get("mm_per_pixel", 1.0)
    return Arena.from_array(read_picture(folder / given, mm_per_pixel), mm_per_pixel=mm_per_pixel)


def _starts(table: dict[str, Any]) -> Iterable[Pose]:
    for who, entry in entries_of(table, "start", ENTRY_KEYS["start"]):
        heading_deg = entry.get("heading_deg", 90)
        if not is_number(heading_deg):
            raise ArenaError(f"{who}: heading_deg must be a number, but it was {heading_deg!r}. 0 looks right, 90 up.")
        x_mm, y_mm = pair_of(entry, "at_mm", who)
        yield Pose(x_mm, y_mm, math.radians(heading_deg))


def _lamps(table: dict[str, Any]) -> Iterable[Lamp]:
    for who, entry in entries_of(table, "lamp", ENTRY_KEYS["lamp"]):
        power_w = entry.get("power_w", 1.0)
        if not is_number(power_w):
            raise ArenaError(f"{who}: power_w must be a number, but it was {power_w!r}. A Khepera lamp has 1 W.")
        x_mm, y_mm = pair_of(entry, "at_mm", who)
        yield Lamp(x_mm, y_mm, power_w, typed(entry, "is_on", bool, True, who))


def _body(kind: type[_Body], who: str, entry: dict[str, Any]) -> _Body:
    x_mm, y_mm = pair_of(entry, "at_mm", who)
    return kind(x_mm, y_mm, **{key: value for key, value in entry.items() if key != "at_mm"})


def entries_of(table: dict[str, Any], label: str, keys: tuple[str, ...]) -> Iterable[tuple[str, dict[str, Any]]]:
    """Yield each entry of a list of tables, with what messages call it.

    Raises:
        ArenaError: If it is no such list, or an entry has other keys.
    """
    entries = table.get(label, [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise ArenaError(f"{label} must be a list of tables, but it was {entries!r}. Head each with [[{label}]].")
    for number, entry in enumerate(entries, start=1):
        who = f"{label} {number}"
        check_keys(entry, keys, who)
        yield who, entry


def check_keys(table: dict[str, Any], known: tuple[str, ...], who: str) -> None:
    """Check that a table has known keys only.

    Raises:
        ArenaError: If it has another one; the message has the nearest.
    """
    for key in table:
        if key not in known:
            raise ArenaError(
                f"{who} must have known keys only, but has {key!r}.{nearest(key, known)} Known are {', '.join(known)}."
            )


def pair_of(table: dict[str, Any], key: str, who: str) -> Any:
    """Return the two numbers of a key, unconverted: whole numbers stay whole.

    Raises:
        ArenaError: If there are none.
    """
    if key not in table:
        raise ArenaError(f"{who} must have {key}, but has none. Give {key} = [x, y].")
    pair = table[key]
    if not isinstance(pair, list) or len(pair) != 2 or not all(is_number(value) for value in pair):
        raise ArenaError(f"{who}: {key} must be two numbers in mm, but it was {pair!r}. Give {key} = [x, y].")
    return pair


def typed(table: dict[str, Any], key: str, kind: type, default: Any, who: str) -> Any:
    """Return the value of a key.

    Raises:
        ArenaError: If it is of another type.
    """
    value = table.get(key, default)
    if not isinstance(value, kind):
        form = "true or false" if kind is bool else 'a text in "quotes"'
        raise ArenaError(f"{who}: {key} must be {form}, but it was {value!r}. Write it that way.")
    return value


def _toml_of(arena: Arena, picture: str) -> str:
    lines = [
        f"picture = {quoted(picture)}",
        f"mm_per_pixel = {arena.mm_per_cell!r}",
        f"name = {quoted(arena.name)}",
        *place_lines(arena),
    ]
    return "\n".join(lines) + "\n"


def place_lines(arena: Arena) -> list[str]:
    """Return the lines of a file that `places_of` reads."""
    lines = []
    for start in arena.starts:
        lines += ["", "[[start]]", _at(start), f"heading_deg = {_degrees(start.heading_rad)!r}"]
    for lamp in arena.lamps:
        lines += ["", "[[lamp]]", _at(lamp), f"power_w = {lamp.power_w!r}", f"is_on = {str(lamp.is_on).lower()}"]
    for label, bodies in (("ball", arena.balls), ("cylinder", arena.cylinders)):
        for body in bodies:
            lines += ["", f"[[{label}]]", _at(body), f"radius_mm = {body.radius_mm!r}"]
            lines += [f"friction_mm_s2 = {body.friction_mm_s2!r}", f"brightness = {body.brightness!r}"]
    return lines


def _degrees(angle_rad: float) -> float:
    """Return an angle in the fewest digits that give it back."""
    angle_deg = math.degrees(angle_rad)
    short = (round(angle_deg, digits) for digits in range(13))
    return next((each for each in short if math.radians(each) == angle_rad), angle_deg)


def _at(place: Pose | Lamp | Ball | Cylinder) -> str:
    return f"at_mm = [{place.x_mm!r}, {place.y_mm!r}]"


def quoted(text: str) -> str:
    """Return a text as TOML has it."""
    # TOML quotes as JSON does, save for one control character that JSON leaves bare.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
