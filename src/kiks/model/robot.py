"""What a robot is: every constant of its body, motors, sensors and firmware, read from a small TOML file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, field, fields
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from kiks.errors import ParameterError, nearest, shown
from kiks.model.arena_file import toml
from kiks.model.atomic_files import path_of, replace_file
from kiks.model.checks import ROBOTS_MAX, check_count
from kiks.model.data_file import Text, check, parse_toml, read_file, record
from kiks.model.robot_parts import (
    AMBIENT_MODELS,
    CURVE_POINT_LIMIT,
    JITTER_POINT_LIMIT,
    LAMP_POINT_LIMIT,
    RESPONSES,
    SENSOR_COUNT,
    Ambient,
    Baud,
    Body,
    Brightness,
    Camera,
    Curve,
    FirmwareSpec,
    Motor,
    Proximity,
    Quirks,
    Reflection,
    Reset,
    Response,
)

__all__ = [
    "AMBIENT_MODELS",
    "CURVE_POINT_LIMIT",
    "JITTER_POINT_LIMIT",
    "LAMP_POINT_LIMIT",
    "RESPONSES",
    "SENSOR_COUNT",
    "Ambient",
    "Baud",
    "Body",
    "Brightness",
    "Camera",
    "Curve",
    "FirmwareSpec",
    "Motor",
    "Proximity",
    "Quirks",
    "Reflection",
    "Reset",
    "Response",
    "RobotSpec",
]


@record
class RobotSpec:
    """A kind of robot.

    Example:
        >>> RobotSpec.load("khepera").body.diameter_mm
        55.0
        >>> RobotSpec.load("khepera_ii").proximity.step_counts
        4
    """

    name: Annotated[Text, Field(min_length=1, description='Write: name = "My robot".')]
    body: Body
    motor: Motor
    reset: Reset
    proximity: Proximity
    ambient: Ambient
    firmware: FirmwareSpec
    camera: Camera = field(default_factory=Camera)
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
        """
        path, known = path_of(name_or_path, "robot"), robot_names()
        source = str(path)
        what = f"Robot file {source!r}"
        if source in known:
            data = read_file(_FOLDER / f"{source}.toml", what)
        elif path.suffix or len(path.parts) > 1 or path.is_file():
            data = read_file(path, what)
        else:
            raise ParameterError(
                f"robot must be one of {known} or a TOML file, but it was {shown(source)}.{nearest(source, known)} "
                "Copy a "
                "robot of ours to begin with one of your own."
            )
        spec = check(RobotSpec, parse_toml(data, what), what, advice=_ADVICE)
        return spec if response is None else spec.with_changes(proximity__response=response)

    def __post_init__(self) -> None:
        response = self.proximity.response
        if response not in self._responses():
            raise ParameterError(
                f"proximity.response must be one of this robot's, {self._responses()}, but it was {shown(response)}, "
                f"which needs a section [{response}]."
            )
        for number, radius_mm in enumerate(self.proximity.mount_radius_mm):
            if radius_mm > self.body.radius_mm:
                raise ParameterError(
                    f"proximity.mount_radius_mm[{number}] must be inside the body, but it was {radius_mm:g}."
                )
        if self.motor.free_speed_pulses * self.body.pulse_mm > 20:
            raise ParameterError(
                "motor.free_speed_pulses must be at most 20 mm a tick (2 m/s), but it was "
                f"{self.motor.free_speed_pulses:g}."
            )

    def _responses(self) -> list[str]:
        """Return the responses that the robot has: two need numbers of their own."""
        return [name for name in RESPONSES if getattr(self, name, name) is not None]

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
        """
        table = {name: values for name, values in asdict(self).items() if values is not None}
        for name, value in changes.items():
            section, _, key = name.partition("__")
            if not isinstance(table.get(section), dict):
                sections = [known for known, values in table.items() if isinstance(values, dict)]
                raise ParameterError(
                    f"a change must be named 'section__key' of a section that the robot has, but it was {shown(name)}. "
                    f"Sections: {sections}."
                )
            table[section][key] = value
        return check(RobotSpec, table, self.name, advice=_ADVICE)


_FOLDER = Path(__file__).with_name("robots")
_NAMES = sorted(path.stem for path in _FOLDER.glob("*.toml"))


def robot_names() -> list[str]:
    """Return the names of the robots that come with KiKS."""
    return list(_NAMES)


_ADVICE = "Compare it with 'khepera.toml'."


def specs_of(
    robot: str | RobotSpec | Sequence[str | RobotSpec], robots: int | None, response: str | None
) -> list[RobotSpec]:
    """Return what each robot of a world is.

    Args:
        robot: The kind of all, or a list with that of each: names that `RobotSpec.load` knows, files, or specs.
        robots: How many there are, 0 for none; as many as kinds are named if None.
        response: What makes counts of their proximity sensors' rays; what their files say if None.
    """
    named = [robot] if isinstance(robot, str | RobotSpec) else list(robot)
    count, least = (len(named), 1) if robots is None else (robots, 0)
    count = check_count("robots", count, least, ROBOTS_MAX, "Say how many you need.")
    if len(named) not in (1, count):
        raise ParameterError(
            f"robot must name one kind for all or one for each of {count} robots, but it named {len(named)}. "
            "Leave robots out to have one of each."
        )
    specs = [each if isinstance(each, RobotSpec) else RobotSpec.load(each) for each in named]
    if response is not None:
        specs = [spec.with_changes(proximity__response=response) for spec in specs]
    return specs if len(specs) == count else specs * count


def save_robot(spec: RobotSpec, path: str | Path, *, comment: str = "") -> None:
    """Write a robot file that `RobotSpec.load` reads; an earlier file of that name is replaced in one step.

    Args:
        spec: The robot.
        path: Where it goes, usually 'something.toml'.
        comment: What stands above it, line by line.
    """
    replace_file(path, robot_toml(spec, comment), "a robot")


def robot_toml(spec: RobotSpec, comment: str = "") -> str:
    """Return the text of a robot file.

    Example:
        >>> robot_toml(RobotSpec.load("khepera"), "mine").splitlines()[:5]
        ['# mine', 'name = "Khepera"', '', '[body]', 'diameter_mm = 55.0']
    """
    lines = [f"# {_printable(line)}".rstrip() for line in comment.splitlines()]
    sections = []
    for entry in fields(spec):
        value = getattr(spec, entry.name)
        if hasattr(value, "__dataclass_fields__"):
            sections += ["", f"[{entry.name}]"]
            sections += [f"{key.name} = {toml(getattr(value, key.name))}" for key in fields(value)]
        elif value is not None:
            lines.append(f"{entry.name} = {toml(value)}")
    return "\n".join(lines + sections) + "\n"


def _printable(line: str) -> str:
    """Return a line without characters that TOML allows in no comment."""
    return "".join(character if character.isprintable() else "?" for character in line)
