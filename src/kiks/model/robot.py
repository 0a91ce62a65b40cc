"""What a robot is: every constant of its body, motors, sensors and firmware, read from a small TOML file."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from importlib import resources
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, nearest
from kiks.model.robot_checks import check
from kiks.model.robot_parts import (
    AMBIENT_MODELS,
    CURVE_POINT_LIMIT,
    JITTER_POINT_LIMIT,
    LAMP_POINT_LIMIT,
    RESPONSES,
    SENSOR_COUNT,
    Ambient,
    Body,
    Curve,
    FirmwareSpec,
    Motor,
    Proximity,
    Quirks,
    Reflection,
    Reset,
)

__all__ = [
    "AMBIENT_MODELS",
    "CURVE_POINT_LIMIT",
    "JITTER_POINT_LIMIT",
    "LAMP_POINT_LIMIT",
    "RESPONSES",
    "SENSOR_COUNT",
    "Ambient",
    "Body",
    "Curve",
    "FirmwareSpec",
    "Motor",
    "Proximity",
    "Quirks",
    "Reflection",
    "Reset",
    "RobotSpec",
]


@dataclass(frozen=True)
class RobotSpec:
    """A kind of robot.

    Example:
        >>> RobotSpec.load("khepera").body.diameter_mm
        55.0
        >>> RobotSpec.load("khepera_ii").proximity.step_counts
        4
    """

    name: str
    body: Body
    motor: Motor
    reset: Reset
    proximity: Proximity
    ambient: Ambient
    firmware: FirmwareSpec
    quirks: Quirks = field(default_factory=Quirks)
    curve: Curve | None = None
    reflection: Reflection | None = None

    @staticmethod
    def load(name_or_path: str | Path, *, response: str | None = None) -> RobotSpec:
        """Return a robot that comes with KiKS ('khepera', 'khepera_ii') or one from a file ('mine.toml').

        Args:
            name_or_path: Name of a robot of ours, or the path of a TOML file with the same keys.
            response: What makes counts of the rays of its proximity sensors, one of `RESPONSES`; what the file says
                if left out.

        Raises:
            ParameterError: If there is no such robot, the file is no TOML, or a key is missing, unknown or wrong.
        """
        known = robot_names()
        if str(name_or_path) in known:
            source = str(name_or_path)
            text = (_FOLDER / f"{source}.toml").read_text(encoding="utf-8")
        else:
            source = str(name_or_path)
            try:
                text = Path(name_or_path).read_text(encoding="utf-8")
            except (OSError, UnicodeDecodeError) as error:
                raise ParameterError(
                    f"robot must be one of {known} or a readable TOML file, but it was {source!r} ({error})."
                    f"{nearest(source, known)} Copy a robot of ours to begin with one of your own."
                ) from None
        try:
            table = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise ParameterError(
                f"robot file {source!r} must be TOML, but {error}. Compare it with 'khepera.toml'."
            ) from None
        spec = _robot_from_table(table, source)
        return spec if response is None else spec.with_changes(proximity__response=response)

    @property
    def is_noisy(self) -> bool:
        """Whether chance has a say in what its sensors and its camera read."""
        chance = self.proximity
        return any((chance.noise_small, chance.noise_large, self.ambient.noise_counts, *chance.jitter_counts))

    def without_noise(self) -> RobotSpec:
        """Return a copy whose sensors and camera read the same again as long as nothing moves."""
        return self.with_changes(
            proximity__noise_small=0.0,
            proximity__noise_large=0.0,
            proximity__jitter_counts=(0.0,),
            ambient__noise_counts=0.0,
        )

    def with_changes(self, **changes: Any) -> RobotSpec:
        """Return a copy with some values changed, named 'section__key'.

        Example:
            >>> RobotSpec.load("khepera").with_changes(body__wall_friction=0.0).body.wall_friction
            0.0

        Raises:
            ParameterError: If there is no such section or key, or a value is out of range.
        """
        table: dict[str, dict[str, Any]] = {}
        for name, value in changes.items():
            section, _, key = name.partition("__")
            table.setdefault(section, {})[key] = value
        spec = self
        for section, values in table.items():
            part = getattr(spec, section, None)
            if part is None or isinstance(part, str):
                raise ParameterError(
                    f"a change must be named 'section__key' of a section that the robot has, but it was {section!r}. "
                    f"Sections: {list(_SECTIONS)}."
                )
            for key in values:
                _check_key(key, [f.name for f in fields(part)], f"section '{section}'")
            spec = replace(spec, **{section: replace(part, **values)})
        check(spec, spec.name)
        return spec


_FOLDER = resources.files("kiks.model") / "robots"


def robot_names() -> list[str]:
    """Return the names of the robots that come with KiKS."""
    return sorted(entry.name[:-5] for entry in _FOLDER.iterdir() if entry.name.endswith(".toml"))


_SECTIONS: dict[str, type[Any]] = {
    "body": Body,
    "motor": Motor,
    "reset": Reset,
    "proximity": Proximity,
    "ambient": Ambient,
    "firmware": FirmwareSpec,
    "quirks": Quirks,
    "curve": Curve,
    "reflection": Reflection,
}

_ABSENT: dict[str, Any] = {"quirks": Quirks(), "curve": None, "reflection": None}
"""Sections that a file may leave out, and what that means."""


def _check_key(key: str, known: list[str], where: str) -> None:
    if key not in known:
        raise ParameterError(f"{where} must hold only {known}, but it has {key!r}.{nearest(key, known)}")


def _robot_from_table(table: dict[str, Any], source: str) -> RobotSpec:
    where = f"robot file {source!r}"
    for key in table:
        _check_key(key, ["name", *_SECTIONS], where)
    parts: dict[str, Any] = {}
    for section, kind in _SECTIONS.items():
        if section in _ABSENT and section not in table:
            parts[section] = _ABSENT[section]
            continue
        values = table.get(section)
        if not isinstance(values, dict):
            raise ParameterError(
                f"{where} must have a section [{section}], but it has none. Copy it from 'khepera.toml'."
            )
        types = {f.name: str(f.type) for f in fields(kind)}
        for key in values:
            _check_key(key, list(types), f"{where}, section [{section}]")
        missing = [] if kind is Quirks else [key for key in types if key not in values]
        if missing:
            raise ParameterError(
                f"{where}, section [{section}] must give {missing}, but does not. Copy them from 'khepera.toml'."
            )
        parts[section] = kind(**{key: _typed(values[key], types[key], f"{where}, {section}.{key}") for key in values})
    name = table.get("name")
    if not isinstance(name, str) or not name:
        raise ParameterError(f'{where} must give the robot a name, but it was {name!r}. Write: name = "My robot".')
    spec = RobotSpec(name=name, **parts)
    check(spec, where)
    return spec


def _typed(value: Any, annotation: str, where: str) -> Any:
    """Return a TOML value as the annotated type; an int may stand for a float, and nothing else for anything else."""
    if annotation.startswith("tuple["):
        item = "int" if "int" in annotation else "float"
        if not isinstance(value, list):
            raise ParameterError(f"{where} must be a list of {item}s, but it was {value!r}.")
        return tuple(_typed(entry, item, where) for entry in value)
    wanted: dict[str, tuple[type, ...]] = {"int": (int,), "float": (int, float), "str": (str,), "bool": (bool,)}
    if not isinstance(value, wanted[annotation]) or (annotation != "bool" and isinstance(value, bool)):
        raise ParameterError(f"{where} must be of type {annotation}, but it was {value!r}.")
    if annotation == "float":
        number = float(str(value))
        if not math.isfinite(number):
            raise ParameterError(f"{where} must be finite, but it was {value!r}.")
        return number
    return value


def specs_of(
    robot: str | RobotSpec | Sequence[str | RobotSpec], robots: int | None, response: str | None
) -> list[RobotSpec]:
    """Return what each robot of a world is.

    Args:
        robot: The kind of all, or a list with that of each: names that `RobotSpec.load` knows, files, or specs.
        robots: How many there are; as many as kinds are named if None.
        response: What makes counts of their proximity sensors' rays; what their files say if None.

    Raises:
        ParameterError: If the numbers do not fit each other, or a name is unknown.
    """
    named = [robot] if isinstance(robot, str | RobotSpec) else list(robot)
    count = len(named) if robots is None else robots
    if not isinstance(count, int) or not 1 <= count <= 1000:
        raise ParameterError(
            f"robots must be a whole number from 1 to 1000, but it was {count!r}. Say how many you need."
        )
    if len(named) not in (1, count):
        raise ParameterError(
            f"robot must name one kind for all or one for each of {count} robots, but it named {len(named)}. "
            "Leave robots out to have one of each."
        )
    specs = [each if isinstance(each, RobotSpec) else RobotSpec.load(each) for each in named]
    if response is not None:
        specs = [spec.with_changes(proximity__response=response) for spec in specs]
    return specs if len(specs) == count else specs * count
