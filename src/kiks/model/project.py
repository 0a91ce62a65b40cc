"""A project: everything that a world is built from, in one file that people can read (docs/projects.md).

The file is an arena file with its raster within, the robots, and the settings of the simulation.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from kiks.errors import ArenaError, KiksError, ParameterError, nearest
from kiks.model.arena import Arena
from kiks.model.arena_file import (
    BOX_KEYS,
    ENTRY_KEYS,
    check_keys,
    entries_of,
    pair_of,
    place_lines,
    places_of,
    quoted,
    typed,
)
from kiks.model.files import check_relative, replace_file
from kiks.model.picture import read_start
from kiks.model.policy import split_thinking
from kiks.model.raster import is_number
from kiks.model.raster_text import box_keys_of, raster_of_text, raster_text
from kiks.model.robot import RESPONSES, robot_names

FILE_BYTES_MAX = 96 << 20
"""Most bytes of a project file."""

THINGS_MAX = 1000
"""Most robots, starts, lamps, balls and cylinders, of each."""

TURRETS = ("k213", "gripper", "radio", "io", "battle")
"""What a robot of a project may carry (docs/turrets.md)."""

FASTEST = "fastest"
"""What stands in a file for no speed: as fast as possible."""

_VERSION = 1
_TEXT_MAX = 1000
_ROBOT_KEYS = ("name", "kind", "turrets", "program", "arguments", "brightness")
_WALL_KEYS = ("png", "mm_per_cell", *BOX_KEYS)
_SETTINGS = ("seed", "thinking", "baud", "response", "noise", "speed")
_TOP_KEYS = ("kiks", *_SETTINGS, "name", "robot", *ENTRY_KEYS, "walls")


@dataclass(frozen=True)
class ProjectRobot:
    """A robot of a project.

    Args:
        kind: 'khepera', 'khepera_ii', or a robot file in the project's folder.
        turrets: What it carries, of `TURRETS`.
        name: What people call it; its number if empty.
        program: A Python file in the project's folder, which drives it.
        arguments: What the program finds in `sys.argv`.
        brightness: How other robots see it, 1 black to 255 white; as its file says if None.

    Raises:
        ParameterError: If a name is unknown, a path leaves the folder, or the brightness is out of range.
    """

    kind: str = "khepera"
    turrets: tuple[str, ...] = ()
    name: str = ""
    program: str | None = None
    arguments: tuple[str, ...] = ()
    brightness: int | None = None

    def __post_init__(self) -> None:
        for texts in (self.turrets, self.arguments):
            if not isinstance(texts, tuple) or len(texts) > 100:
                raise ParameterError(f"turrets and arguments must be up to 100 texts, but they were {texts!r}.")
        for text in (self.kind, self.name, *self.turrets, *self.arguments):
            if not isinstance(text, str) or len(text) > _TEXT_MAX or "\0" in text:
                raise ParameterError(
                    f"A robot's settings must be texts of up to {_TEXT_MAX} characters, but one was {text!r}."
                )
        if not self.kind.lower().endswith(".toml") and self.kind not in (known := robot_names()):
            raise ParameterError(
                f"kind must be one of {known} or a .toml file, but it was {self.kind!r}.{nearest(self.kind, known)}"
            )
        if self.kind.lower().endswith(".toml"):
            check_relative(self.kind, "kind")
        for turret in self.turrets:
            if turret not in TURRETS:
                raise ParameterError(
                    f"turrets must be of {list(TURRETS)}, but one was {turret!r}.{nearest(turret, TURRETS)}"
                )
        if len(set(self.turrets)) < len(self.turrets):
            raise ParameterError(f"turrets must differ, but they were {list(self.turrets)}. A robot has one of each.")
        if self.program is not None:
            check_relative(self.program, "program")
        if self.brightness is not None and not _is_whole(self.brightness, 1, 255):
            raise ParameterError(
                f"brightness of a robot must be a whole number from 1 to 255, but it was {self.brightness!r}."
            )


@dataclass(frozen=True, eq=False)
class Project:
    """What a world is built from; `dataclasses.replace` makes a changed copy.

    Args:
        arena: Walls, what stands in it, and where robots start, the first start for the first robot.
        robots: The robots.
        seed: Seed of all random numbers.
        thinking: What programs' computing costs: 'none', 'fixed:MS', 'live', 'live:FACTOR' (another computer's), or
            'replay:FILE' with a file in the project's folder.
        baud: Speed of the serial lines [bit/s]; that of the robots' files if None.
        response: What makes counts of proximity sensors' rays (docs/sensors.md); that of the robots' files if None.
        noise: Whether chance has a say in what sensors read.
        speed: Simulated seconds in a real one while a person watches; None for as fast as possible.

    Raises:
        ParameterError: If a value is out of range, or a path leaves the folder.

    Example:
        >>> project = Project(Arena.default(), robots=(ProjectRobot(turrets=("gripper",)),), seed=7)
        >>> Project.from_bytes(project.to_bytes()).robots[0].turrets
        ('gripper',)
    """

    arena: Arena = field(default_factory=Arena.default)
    robots: tuple[ProjectRobot, ...] = (ProjectRobot(),)
    seed: int = 0
    thinking: str = "none"
    baud: int | None = None
    response: str | None = None
    noise: bool = True
    speed: float | None = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.arena, Arena):
            raise ParameterError(f"arena must be a kiks.Arena, but it was {self.arena!r}. Read one with Arena.load.")
        if not all(isinstance(robot, ProjectRobot) for robot in self.robots):
            raise ParameterError("robots must be of ProjectRobot, but others were given.")
        for name, low in (("robots", 1), ("starts", 0), ("lamps", 0), ("balls", 0), ("cylinders", 0)):
            count = len(self.robots if name == "robots" else getattr(self.arena, name))
            if not low <= count <= THINGS_MAX:
                raise ParameterError(f"{name} must be {low} to {THINGS_MAX}, but there are {count}.")
        if not _is_whole(self.seed, 0, 2**63 - 1):
            raise ParameterError(f"seed must be a whole number from 0 to 2^63 - 1, but it was {self.seed!r}.")
        if isinstance(file := split_thinking(self.thinking)[1], str):
            check_relative(file, "thinking's replay file")
        if self.baud is not None and not _is_whole(self.baud, 75, 4_000_000):
            raise ParameterError(
                f"baud must be a whole number from 75 to 4000000, but it was {self.baud!r}. A Khepera's usual is 9600."
            )
        if self.response is not None and self.response not in RESPONSES:
            raise ParameterError(
                f"response must be one of {list(RESPONSES)}, but it was {self.response!r}."
                f"{nearest(str(self.response), RESPONSES)}"
            )
        if not isinstance(self.noise, bool):
            raise ParameterError(f"noise must be true or false, but it was {self.noise!r}.")
        if self.speed is not None and not (is_number(self.speed) and 1e-3 <= self.speed <= 1e3):
            raise ParameterError(
                f"speed must be from 0.001 to 1000, or {FASTEST!r}, but it was {self.speed!r}. 1 is real time."
            )

    @classmethod
    def load(cls, path: str | Path) -> Project:
        """Read a project, or an arena of any kind, which becomes a project with a robot for each of its starts.

        Raises:
            ArenaError: If the file is missing, damaged, or neither.
        """
        path = Path(path)
        if path.suffix.lower() != ".kiks":
            return cls.of_arena(Arena.load(path))
        what = f"Project file {str(path)!r}"
        data = read_start(path, FILE_BYTES_MAX + 1, what)
        return cls.from_bytes(data, name=path.stem, what=what)

    @classmethod
    def of_arena(cls, arena: Arena) -> Project:
        """Return a project of an arena, with a Khepera for each of its starts, at least one.

        Raises:
            ParameterError: If the arena has too much in it for a project.
        """
        return cls(arena, robots=(ProjectRobot(),) * max(len(arena.starts), 1))

    def save(self, path: str | Path) -> None:
        """Write the file, in one step.

        Raises:
            ParameterError: If its name does not end in .kiks, or it cannot be written.
        """
        path = Path(path)
        if path.suffix.lower() != ".kiks":
            raise ParameterError(f"A project's file must end in '.kiks', but it was {str(path)!r}.")
        replace_file(path, self.to_bytes(), "a project")

    @classmethod
    def from_bytes(
        cls,
        data: bytes,
        *,
        name: str = "project",
        what: str = "The project file",
        bytes_max: int = FILE_BYTES_MAX,
    ) -> Project:
        """Read what `to_bytes` returned, or a person wrote.

        Args:
            data: The bytes of the file.
            name: What the arena is called if the file does not say.
            what: What messages call the file.
            bytes_max: Most bytes that it may have.

        Raises:
            ArenaError: If it is no project, or too large.
        """
        if len(data) > bytes_max:
            raise ArenaError(f"{what} must have at most {bytes_max / 2**20:.1f} MiB, but has {len(data) / 2**20:.1f}.")
        try:
            # Undecodable bytes and endless numbers are ValueErrors too; deep nesting ends in a RecursionError.
            table = tomllib.loads(data.decode("utf-8"))
        except (ValueError, RecursionError) as error:
            raise ArenaError(f"{what} must be TOML in UTF-8, but: {error}. Correct the file at that place.") from None
        try:
            return cls(**_settings_of(table), arena=_arena_of(table, name), robots=tuple(_robots_of(table)))
        except KiksError as error:
            raise ArenaError(f"{what}: {error}") from None

    def to_bytes(self) -> bytes:
        """Return the file."""
        lines = ["# A project of KiKS: docs/projects.md says what each line means.", f"kiks = {_VERSION}"]
        for name in _SETTINGS:
            value = getattr(self, name)
            if name == "speed" and value is None:
                value = FASTEST
            if value is not None:
                lines.append(f"{name} = {_toml(value)}")
        lines.append(f"name = {quoted(self.arena.name)}")
        for robot in self.robots:
            lines += ["", "[[robot]]"]
            values = ((each.name, getattr(robot, each.name)) for each in fields(robot))
            lines += [f"{name} = {_toml(value)}" for name, value in values if value not in (None, "", ())]
        lines += place_lines(self.arena)
        lines += ["", "[walls]"]
        if (box := box_keys_of(self.arena)) is not None:
            lines += [f"{name} = {_toml(value)}" for name, value in box.items()]
        else:
            lines += [f"mm_per_cell = {self.arena.mm_per_cell!r}", f"png = '''\n{raster_text(self.arena)}'''"]
        return ("\n".join(lines) + "\n").encode("utf-8", errors="replace")


def _settings_of(table: dict[str, Any]) -> dict[str, Any]:
    check_keys(table, _TOP_KEYS, "the file")
    if table.get("kiks") != _VERSION:
        raise ArenaError(
            f"kiks must be {_VERSION}, the version of this format, but it was {table.get('kiks')!r}. Write kiks = 1, "
            "or open a newer file with a newer KiKS."
        )
    settings = {name: table[name] for name in _SETTINGS if name in table}
    if settings.get("speed") == FASTEST:
        settings["speed"] = None
    return settings


def _arena_of(table: dict[str, Any], name: str) -> Arena:
    walls = typed(table, "walls", dict, {}, "the file")
    check_keys(walls, _WALL_KEYS, "[walls]")
    if "png" in walls:
        if given := [key for key in BOX_KEYS if key in walls]:
            raise ArenaError(f"[walls] must be either a png or a box, but png came with {given[0]}. Remove one.")
        mm_per_cell = walls.get("mm_per_cell", 1.0)
        arena = raster_of_text(typed(walls, "png", str, "", "[walls]"), mm_per_cell)
    elif "mm_per_cell" in walls:
        raise ArenaError("[walls]: mm_per_cell must come with a png, but there is none. Boxes have cells of 1 mm.")
    else:
        width_mm, height_mm = pair_of(walls, "size_mm", "[walls]")
        arena = Arena.box(width_mm, height_mm, **{key: walls[key] for key in BOX_KEYS[1:] if key in walls})
    for label in ENTRY_KEYS:
        if isinstance(table.get(label), list) and len(table[label]) > THINGS_MAX:
            raise ArenaError(f"{label} must be given at most {THINGS_MAX} times, but was {len(table[label])} times.")
    return replace(arena, name=typed(table, "name", str, name, "the file"), **places_of(table))


def _robots_of(table: dict[str, Any]) -> Iterable[ProjectRobot]:
    if "robot" not in table:
        yield ProjectRobot()
    for who, entry in entries_of(table, "robot", _ROBOT_KEYS):
        for key in ("turrets", "arguments"):
            if not isinstance(entry.get(key, []), list):
                raise ArenaError(f'{who}: {key} must be a list, but it was {entry[key]!r}. Write {key} = ["..."].')
        values: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in entry.items()
        }
        try:
            yield ProjectRobot(**values)
        except ParameterError as error:
            raise ArenaError(f"{who}: {error}") from None


def _is_whole(value: object, low: int, high: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def _toml(value: Any) -> str:
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return quoted(value) if isinstance(value, str) else repr(value)
