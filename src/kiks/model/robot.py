"""What a robot is: every constant of its body, motors, sensors and firmware, read from a small TOML file."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

from kiks.errors import ParameterError, nearest

SENSOR_COUNT = 8
"""Infra-red sensors of a Khepera, clockwise from the left side (khepera-protocol.md 4.14)."""

RESPONSES = ("standin", "thesis", "fast", "curve")
"""What makes counts of a sensor's rays (`kiks.engine.responses`)."""

JITTER_POINT_LIMIT = 51
"""Most points of the distribution of the jitter."""

CURVE_POINT_LIMIT = 32
"""Most points of a measured curve of counts against distance."""

AMBIENT_MODELS = ("flux", "thesis")
"""How several lamps make one reading: their light adds up, or the thesis's formula for the strongest."""

LAMP_POINT_LIMIT = 64
"""Most points of the curve of light against distance."""


@dataclass(frozen=True)
class Body:
    """Shape and contact. `slip_ratio_min` and `_max` bound a blocked wheel's speed, as a share of its command."""

    diameter_mm: float
    wheel_base_mm: float
    pulse_mm: float
    wall_friction: float
    slip_ratio_min: float
    slip_ratio_max: float

    @property
    def radius_mm(self) -> float:
        """Half the diameter [mm]."""
        return self.diameter_mm / 2


@dataclass(frozen=True)
class Motor:
    """Wheel speed against PWM: linear beyond a dead band, with a first-order lag."""

    free_speed_pulses: float
    time_constant_ms: float
    dead_band_pwm: float
    left_gain: float
    right_gain: float
    gain_scale: int


@dataclass(frozen=True)
class Reset:
    """What the controllers hold after a reset: gains (Kp, Ki, Kd) and the speed profile."""

    speed_gains: tuple[int, int, int]
    position_gains: tuple[int, int, int]
    profile_speed_pulses: int
    profile_acceleration: int


@dataclass(frozen=True)
class Proximity:
    """Where the eight infra-red sensors sit and look [deg, left positive], and how they answer [counts].

    `response` is one of `RESPONSES`. With noise a reading r becomes r (1 + e u^n) or, as often, r (1 - d e u^n), with
    e from `noise_small` at 0 to `noise_large` at 1000 counts, the exponent n, `noise_down` d and u from 0 to 1.
    `jitter_counts` come on top, whatever the reading: the distribution of what a sensor reads above and below its
    baseline with nothing near, from its least to its largest value in equally probable steps.
    """

    response: str
    mount_angle_deg: tuple[float, ...]
    mount_radius_mm: tuple[float, ...]
    direction_deg: tuple[float, ...]
    field_of_view_deg: float
    range_mm: float
    gain: tuple[float, ...]
    baseline_counts: tuple[float, ...]
    maximum_counts: int
    step_counts: int
    noise_small: float
    noise_large: float
    noise_exponent: int
    noise_down: float
    jitter_counts: tuple[float, ...]


@dataclass(frozen=True)
class Curve:
    """What the response 'curve' knows: counts above the baseline of a sensor that looks straight at a white wall.

    `distance_mm` rises, `counts` fall; `ray_weight` says how much a ray counts, from the middle one to the edge.
    All counts are multiplied by `scale`.
    """

    distance_mm: tuple[float, ...]
    counts: tuple[float, ...]
    ray_weight: tuple[float, ...]
    scale: float


@dataclass(frozen=True)
class Ambient:
    """How the sensors answer to light.

    `lamp_counts` is what a sensor reads that looks straight at a lamp of 1 W from 0, 1, 2, ... steps of `lamp_step_mm`;
    `background_counts` what it reads of the room's daylight alone, which in the dark is `dark_counts`.
    """

    model: str
    dark_counts: float
    noise_counts: float
    background_counts: float
    angle_exponent: float
    lamp_step_mm: float
    lamp_counts: tuple[float, ...]


@dataclass(frozen=True)
class FirmwareSpec:
    """What the robot's program says of itself, and how long it thinks about a command."""

    banner: str
    bios_version: str
    protocol_version: str
    processing_ms: float
    baud: int
    has_user_flash: bool


@dataclass(frozen=True)
class Quirks:
    """Deviations that single clients need (khepera-protocol.md 3.4 and 11.3). All off is the documented robot."""

    answer_empty_lines: bool = False
    accept_lower_case: bool = False
    unknown_command_with_z: bool = False
    d_reply_trailing_comma: bool = False


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
        folder = resources.files("kiks.model") / "robots"
        known = sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml"))
        if str(name_or_path) in known:
            source = str(name_or_path)
            text = (folder / f"{source}.toml").read_text(encoding="utf-8")
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
        _check(spec, spec.name)
        return spec


_SECTIONS: dict[str, type[Any]] = {
    "body": Body,
    "motor": Motor,
    "reset": Reset,
    "proximity": Proximity,
    "ambient": Ambient,
    "firmware": FirmwareSpec,
    "quirks": Quirks,
    "curve": Curve,
}

_ABSENT: dict[str, Any] = {"quirks": Quirks(), "curve": None}
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
    _check(spec, where)
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


def _check(spec: RobotSpec, where: str) -> None:
    def must(holds: bool, key: str, rule: str) -> None:
        if not holds:
            section, name = key.split(".")
            raise ParameterError(
                f"{where}: {key} must be {rule}, but it was {getattr(getattr(spec, section), name)!r}."
            )

    body, motor, reset, proximity = spec.body, spec.motor, spec.reset, spec.proximity
    must(10 <= body.diameter_mm <= 500, "body.diameter_mm", "between 10 and 500 mm")
    must(0 < body.wheel_base_mm <= body.diameter_mm, "body.wheel_base_mm", "positive and no more than the diameter")
    must(0.001 <= body.pulse_mm <= 1, "body.pulse_mm", "between 0.001 and 1 mm")
    must(0 <= body.wall_friction <= 2, "body.wall_friction", "between 0 and 2")
    must(0 <= body.slip_ratio_min <= body.slip_ratio_max, "body.slip_ratio_min", "between 0 and slip_ratio_max")
    must(body.slip_ratio_max <= 1, "body.slip_ratio_max", "at most 1")
    must(1 <= motor.free_speed_pulses <= 1000, "motor.free_speed_pulses", "between 1 and 1000 pulses/10 ms")
    must(motor.free_speed_pulses * body.pulse_mm <= 20, "motor.free_speed_pulses", "at most 20 mm a tick (2 m/s)")
    must(0.1 <= motor.time_constant_ms <= 1000, "motor.time_constant_ms", "between 0.1 and 1000 ms")
    must(0 <= motor.dead_band_pwm < 255, "motor.dead_band_pwm", "at least 0 and below 255")
    for key in ("left_gain", "right_gain"):
        must(0.5 <= getattr(motor, key) <= 1.5, f"motor.{key}", "between 0.5 and 1.5")
    must(motor.gain_scale >= 1, "motor.gain_scale", "at least 1")
    for key in ("speed_gains", "position_gains"):
        gains = getattr(reset, key)
        must(len(gains) == 3 and all(0 <= g <= 32767 for g in gains), f"reset.{key}", "three numbers from 0 to 32767")
    must(1 <= reset.profile_speed_pulses <= 127, "reset.profile_speed_pulses", "between 1 and 127")
    must(1 <= reset.profile_acceleration <= 255, "reset.profile_acceleration", "between 1 and 255")
    for key in ("mount_angle_deg", "mount_radius_mm", "direction_deg", "gain", "baseline_counts"):
        must(len(getattr(proximity, key)) == SENSOR_COUNT, f"proximity.{key}", f"a list of {SENSOR_COUNT}")
    must(
        all(0 < r <= body.radius_mm for r in proximity.mount_radius_mm), "proximity.mount_radius_mm", "inside the body"
    )
    must(all(0.05 <= gain <= 20 for gain in proximity.gain), "proximity.gain", "between 0.05 and 20")
    must(0 < proximity.field_of_view_deg <= 180, "proximity.field_of_view_deg", "between 0 and 180 degrees")
    must(1 <= proximity.range_mm <= 1000, "proximity.range_mm", "between 1 and 1000 mm")
    must(
        1 <= proximity.step_counts <= proximity.maximum_counts <= 65535, "proximity.maximum_counts", "1 to 65535 counts"
    )
    must(
        0 <= proximity.noise_large <= proximity.noise_small < 1, "proximity.noise_small", "from noise_large to below 1"
    )
    must(1 <= proximity.noise_exponent <= 20, "proximity.noise_exponent", "a whole number from 1 to 20")
    must(0 <= proximity.noise_down <= 1, "proximity.noise_down", "between 0 and 1")
    _check_response(spec, must)
    must(0 <= spec.ambient.dark_counts <= 1023, "ambient.dark_counts", "between 0 and 1023 counts")
    must(spec.ambient.noise_counts >= 0, "ambient.noise_counts", "at least 0")
    _check_light(spec.ambient, must)
    must(0 <= spec.firmware.processing_ms <= 1000, "firmware.processing_ms", "between 0 and 1000 ms")
    must(75 <= spec.firmware.baud <= 4_000_000, "firmware.baud", "between 75 and 4000000 bit/s")


def _check_response(spec: RobotSpec, must: Callable[[bool, str, str], None]) -> None:
    response, jitter, curve = spec.proximity.response, spec.proximity.jitter_counts, spec.curve
    possible = [name for name in RESPONSES if name != "curve" or curve is not None]
    needed = "" if "curve" in possible else " ('curve' needs a section [curve], as in 'khepera_ii.toml')"
    must(response in possible, "proximity.response", f"one of {possible}{needed}")
    rises = all(low <= high for low, high in pairwise(jitter))
    is_jitter = 1 <= len(jitter) <= JITTER_POINT_LIMIT and rises
    must(is_jitter, "proximity.jitter_counts", f"a list of 1 to {JITTER_POINT_LIMIT}, none below the one before")
    if curve is not None:
        far = curve.distance_mm
        rises = 2 <= len(far) <= CURVE_POINT_LIMIT and all(nearer < farther for nearer, farther in pairwise(far))
        must(rises and far[0] >= 1, "curve.distance_mm", f"a list of 2 to {CURVE_POINT_LIMIT}, from 1 mm, rising")
        falls = all(high >= low for high, low in pairwise(curve.counts)) and min(curve.counts, default=0) > 0
        must(falls and len(curve.counts) == len(far), "curve.counts", "one for each distance, above 0, falling")
        must(0.05 <= curve.scale <= 20, "curve.scale", "between 0.05 and 20")
        weighs = len(curve.ray_weight) == 4 and all(0 <= weight <= 1 for weight in curve.ray_weight)
        must(weighs and curve.ray_weight[0] > 0, "curve.ray_weight", "4 numbers from 0 to 1, the first above 0")


def _check_light(ambient: Ambient, must: Callable[[bool, str, str], None]) -> None:
    counts, dark = ambient.lamp_counts, ambient.dark_counts
    must(ambient.model in AMBIENT_MODELS, "ambient.model", f"one of {list(AMBIENT_MODELS)}")
    must(2 <= len(counts) <= LAMP_POINT_LIMIT, "ambient.lamp_counts", f"a list of 2 to {LAMP_POINT_LIMIT}")
    rises = all(nearer <= farther for nearer, farther in pairwise(counts))
    must(rises and counts[0] >= 0 and counts[-1] <= dark, "ambient.lamp_counts", "0 or more, rising, up to dark_counts")
    must(
        counts[0] < ambient.background_counts <= dark,
        "ambient.background_counts",
        "above lamp_counts, up to dark_counts",
    )
    must(0.1 <= ambient.lamp_step_mm <= 1000, "ambient.lamp_step_mm", "between 0.1 and 1000 mm")
    must(0 < ambient.angle_exponent <= 20, "ambient.angle_exponent", "above 0 and up to 20")
