"""What a robot is: every constant of its body, motors, sensors and firmware, read from a small TOML file.

The file has a section for each part: a frozen record with choices and limits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, field, fields
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from kiks.errors import ParameterError, counted, printable, shown
from kiks.meant import nearest_file
from kiks.model.arena_file import toml
from kiks.model.atomic_files import path_of, replace_file
from kiks.model.checks import ROBOTS_MAX, check_choice, check_count
from kiks.model.data_file import Number, OneOf, Switch, Text, Whole, check, parse_toml, read_file, record
from kiks.model.robot_kinds import ROBOT_FILES, ROBOT_KINDS, ROBOT_NAMES
from kiks.units import BITS_MIN, BITS_PER_CHARACTER, TICK_NS, ns_from_s

SENSOR_COUNT = 8
"""Infra-red sensors of every robot: the engine reads each in a lane of its vectors. A dead one has the gain 0."""

GROUND_COUNT = 5
"""Sensors under a robot that look at the floor, where the kind of robot has them (epuck-protocol.md 4)."""

RESPONSES = ("reflection", "thesis", "fast", "curve")
"""The responses (`kiks.engine.sensing.responses`)."""

JITTER_POINT_LIMIT = 51
"""Most points of the distribution of the jitter."""

CURVE_POINT_LIMIT = 32
"""Most points of a measured curve of counts against distance."""

AMBIENT_MODELS = ("flux", "thesis")
"""Models of several lamps: the sum of their light, or the thesis's formula for the strongest."""

ROUND_NS_MAX = 20_000_000
"""Longest round in which all sensors are sampled [ns]."""

LAMP_POINT_LIMIT = 64
"""Most points of the curve of light against distance."""

STRIPE_LIMIT = 100
"""Most stripes of either colour around a body."""

Response = Annotated[str, OneOf(RESPONSES)]
Angle = Annotated[Number, Field(ge=-360, le=360)]
Counts = Annotated[Number, Field(ge=-1023, le=65535)]
Share = Annotated[Number, Field(ge=0, le=1)]
Brightness = Annotated[Whole, Field(ge=1, le=255, description="1 is black, 255 white.")]
PulseMm = Annotated[Number, Field(ge=0.001, le=1)]
DeadBandPwm = Annotated[Number, Field(ge=0, lt=255)]
Baud = Annotated[Whole, Field(ge=75, le=4_000_000, description="A Khepera's usual is 9600.")]
Gains = Annotated[tuple[Annotated[Whole, Field(ge=0, le=32767)], ...], Field(min_length=3, max_length=3)]
_ONE_EACH = Field(min_length=SENSOR_COUNT, max_length=SENSOR_COUNT, description="One for each sensor.")
Angles = Annotated[tuple[Angle, ...], _ONE_EACH]
Radii = Annotated[tuple[Annotated[Number, Field(gt=0, le=250)], ...], _ONE_EACH]
_GROUND_ONE_EACH = Field(min_length=GROUND_COUNT, max_length=GROUND_COUNT, description="One for each ground sensor.")
Places = Annotated[tuple[Annotated[Number, Field(ge=-250, le=250)], ...], _GROUND_ONE_EACH]


@record
class Body:
    """Shape and contact. `slip_ratio_min` and `_max` bound a blocked wheel's speed, as a share of its command.

    `brightness` is its brightness for other robots' sensors: 1 black to 255 white. With a `stripe_count` above 0 that
    many black and as many white stripes stand around the body instead, the middle of a black one ahead.
    """

    diameter_mm: Annotated[Number, Field(ge=10, le=500)]
    brightness: Brightness
    wheel_base_mm: Annotated[Number, Field(gt=0, le=500)]
    pulse_mm: PulseMm
    wall_friction: Annotated[Number, Field(ge=0, le=2)]
    slip_ratio_min: Share
    slip_ratio_max: Share
    stripe_count: Annotated[Whole, Field(ge=0, le=STRIPE_LIMIT)] = 0

    def __post_init__(self) -> None:
        # Wheels may stick out a little; calibration also tries unrealistic robots.
        must(self.wheel_base_mm <= 2 * self.diameter_mm, self, "wheel_base_mm", "at most twice the diameter")
        must(self.slip_ratio_min <= self.slip_ratio_max, self, "slip_ratio_min", "at most slip_ratio_max")

    @property
    def radius_mm(self) -> float:
        """Half the diameter [mm]."""
        return self.diameter_mm / 2

    @property
    def white_stripes_rad(self) -> tuple[tuple[float, float], ...]:
        """Where each white stripe begins and ends, counter-clockwise from ahead [rad]; between them it is black."""
        half = math.pi / max(2 * self.stripe_count, 1)
        return tuple(((4 * k + 1) * half, (4 * k + 3) * half) for k in range(self.stripe_count))


@record
class Motor:
    """What turns the wheels: motors with a regulator, or steppers.

    With a regulator, wheel speed against PWM is linear beyond a dead band, with a first-order lag. With a
    `steps_per_s_max` above 0 it is a stepper, for which a pulse is a step: a timer of `timer_hz` emits one each time
    that a whole number of its periods has passed, and counters of steps have `counter_bits`. The gains tell the wheels
    apart, as none is like the other.
    """

    free_speed_pulses: Annotated[Number, Field(ge=1, le=1000)] = 127.0
    time_constant_ms: Annotated[Number, Field(ge=0.1, le=1000)] = 25.0
    dead_band_pwm: DeadBandPwm = 8.0
    left_gain: Annotated[Number, Field(ge=0.5, le=1.5)] = 1.0
    right_gain: Annotated[Number, Field(ge=0.5, le=1.5)] = 1.0
    gain_scale: Annotated[Whole, Field(ge=1, le=1 << 20)] = 1024
    steps_per_s_max: Annotated[Number, Field(ge=0, le=100_000)] = 0.0
    timer_hz: Annotated[Number, Field(ge=1, le=1e6)] = 10_000.0
    counter_bits: Annotated[Whole, Field(ge=8, le=32)] = 32

    @property
    def speed_unit(self) -> str:
        """The unit of the speeds that the robot takes and reports."""
        return "steps/s" if self.steps_per_s_max else "pulses/10 ms"

    @property
    def pulses_per_tick(self) -> float:
        """The most that a wheel turns in a tick [pulses]."""
        return self.steps_per_s_max * TICK_NS * 1e-9 if self.steps_per_s_max else self.free_speed_pulses


@record
class Reset:
    """Settings of regulators after a reset: gains (Kp, Ki, Kd) and the speed profile (khepera-protocol.md 4.1)."""

    speed_gains: Gains = (3800, 800, 100)
    position_gains: Gains = (3000, 20, 4000)
    profile_speed_pulses: Annotated[Whole, Field(ge=1, le=127)] = 20
    profile_acceleration: Annotated[Whole, Field(ge=1, le=255)] = 64


@record
class Proximity:
    """Places and directions of the eight infra-red sensors [deg, left positive], and their response [counts].

    `response` is one of `RESPONSES`. With noise a reading r becomes r (1 + e u^n) or, as often, r (1 - d e u^n), with
    e from `noise_small` at 0 to `noise_large` at 1000 counts, the exponent n, `noise_down` d and u from 0 to 1.
    `jitter_counts` are added to any reading: the distribution of a sensor's readings around its baseline with nothing
    near, from the smallest to the largest value in equally probable steps. Each sensor is sampled in its own of the
    `slots` of a round, and a slot lasts `slot_ms`; those with the same one are sampled together.
    """

    response: Response
    mount_angle_deg: Angles
    mount_radius_mm: Radii
    direction_deg: Angles
    field_of_view_deg: Annotated[Number, Field(gt=0, le=180)]
    range_mm: Annotated[Number, Field(ge=1, le=1000)]
    gain: Annotated[tuple[Annotated[Number, Field(ge=0, le=20)], ...], _ONE_EACH]
    baseline_counts: Annotated[tuple[Counts, ...], _ONE_EACH]
    maximum_counts: Annotated[Whole, Field(ge=1, le=65535)]
    step_counts: Annotated[Whole, Field(ge=1, le=65535)]
    noise_small: Annotated[Number, Field(ge=0, lt=1)]
    noise_large: Annotated[Number, Field(ge=0, lt=1)]
    noise_exponent: Annotated[Whole, Field(ge=1, le=20)]
    noise_down: Share
    jitter_counts: Annotated[tuple[Counts, ...], Field(min_length=1, max_length=JITTER_POINT_LIMIT)]
    slot_ms: Annotated[Number, Field(ge=0.1, le=20)] = 2.5
    slots: Annotated[tuple[Annotated[Whole, Field(ge=0, le=99)], ...], _ONE_EACH] = (0, 1, 2, 3, 4, 5, 6, 7)

    @property
    def slots_ns(self) -> tuple[float, ...]:
        """When in a round each sensor is sampled [ns]."""
        return tuple(float(slot * ns_from_s(self.slot_ms * 1e-3)) for slot in self.slots)

    @property
    def round_ns(self) -> float:
        """How long a round lasts [ns]."""
        return float((1 + max(self.slots)) * ns_from_s(self.slot_ms * 1e-3))

    def __post_init__(self) -> None:
        # A world remembers where everything was for 20 ms.
        must(self.round_ns <= ROUND_NS_MAX, self, "slots", "those of a round of at most 20 ms")
        is_gain = all(gain == 0 or gain >= 0.05 for gain in self.gain)
        must(is_gain, self, "gain", "between 0.05 and 20, or 0 for a dead sensor")
        must(self.step_counts <= self.maximum_counts, self, "step_counts", "at most maximum_counts")
        must(self.noise_large <= self.noise_small, self, "noise_large", "at most noise_small")
        must(rises(self.jitter_counts), self, "jitter_counts", "a list in which none is below the one before")


@record
class Curve:
    """Constants of the response 'curve': counts above the baseline of a sensor that looks straight at a white wall.

    `distance_mm` rises, `counts` fall; `ray_weight` says how much a ray counts, from the middle one to the edge.
    All counts are multiplied by `scale`.
    """

    distance_mm: Annotated[
        tuple[Annotated[Number, Field(ge=1, le=10_000)], ...], Field(min_length=2, max_length=CURVE_POINT_LIMIT)
    ]
    counts: Annotated[
        tuple[Annotated[Number, Field(gt=0, le=65535)], ...], Field(min_length=2, max_length=CURVE_POINT_LIMIT)
    ]
    ray_weight: Annotated[tuple[Share, ...], Field(min_length=4, max_length=4)]
    scale: Annotated[Number, Field(ge=0.05, le=20)]

    def __post_init__(self) -> None:
        must(all(near < far for near, far in pairwise(self.distance_mm)), self, "distance_mm", "a list that rises")
        falls = rises(self.counts[::-1]) and len(self.counts) == len(self.distance_mm)
        must(falls, self, "counts", "one for each distance, falling")
        must(self.ray_weight[0] > 0, self, "ray_weight", "a list whose first number is above 0")


@record
class Reflection:
    """Constants of the response 'reflection': from the light that a sensor gets back to its count.

    A ray of the length t that meets a surface with the reflectance b at the angle of incidence i brings the light
    b w (cos(i) / (t + behind))^3, where w falls with the angle off the sensor's axis as a Gaussian of `lobe_deg` does.
    `light` is that of the middle ray for a white surface, square to it, at 20 mm. Their sum L gives the share
    (1 + threshold) L - threshold of the largest count, which is rounded at both ends: at the lower one over
    `faint` and at the upper one over `bright`, shares too, to either side.
    """

    behind_mm: Annotated[Number, Field(ge=0.1, le=1000)]
    light: Annotated[tuple[Annotated[Number, Field(ge=1e-3, le=1e3)], ...], _ONE_EACH]
    threshold: Annotated[tuple[Annotated[Number, Field(ge=0, le=10)], ...], _ONE_EACH]
    lobe_deg: Annotated[tuple[Annotated[Number, Field(ge=1, le=180)], ...], _ONE_EACH]
    faint: Annotated[Number, Field(ge=1e-3, le=1)]
    bright: Annotated[Number, Field(ge=1e-3, le=1)]


@record
class Ambient:
    """How the sensors answer to light.

    `direction_deg` is where each receives light from, left positive: not quite where reflections come from best, which
    the sensor's own lamp has to reach as well. `lamp_counts` is what a sensor reads that looks straight at a lamp of
    1 W from 0, 1, 2, ... steps of `lamp_step_mm`; `background_counts` what it reads of the room's daylight alone, which
    in the dark is `dark_counts`. `maximum_counts` is the largest reading; 0 if it is that of the proximity sensors.
    """

    model: Annotated[str, OneOf(AMBIENT_MODELS)]
    direction_deg: Angles
    dark_counts: Annotated[Number, Field(ge=0, le=65535)]
    noise_counts: Annotated[Number, Field(ge=0, le=65535)]
    background_counts: Annotated[Number, Field(ge=0, le=65535)]
    angle_exponent: Annotated[Number, Field(gt=0, le=20)]
    lamp_step_mm: Annotated[Number, Field(ge=0.1, le=1000)]
    lamp_counts: Annotated[
        tuple[Annotated[Number, Field(ge=0, le=65535)], ...], Field(min_length=2, max_length=LAMP_POINT_LIMIT)
    ]
    maximum_counts: Annotated[Whole, Field(ge=0, le=65535)] = 0

    def __post_init__(self) -> None:
        counts = self.lamp_counts
        must(rises(counts) and counts[-1] <= self.dark_counts, self, "lamp_counts", "a list that rises to dark_counts")
        is_between = counts[0] < self.background_counts <= self.dark_counts
        must(is_between, self, "background_counts", "above lamp_counts, up to dark_counts")


@record
class Camera:
    """How the linear camera K213 takes its pictures, where a robot carries one.

    `noise_share` is the share of each pixel that is random. With `adapts_exposure` the brightest pixel becomes white;
    without, the shutter is fixed, and a dark scene gives a dark picture.
    """

    noise_share: Share = 0.1
    adapts_exposure: Switch = True


@record
class ColourCamera:
    """A colour camera that looks ahead (epuck-protocol.md 6.4), where the kind of robot has one.

    `noise_share` is the share of each pixel that is random, and `field_of_view_deg` the angle across the whole sensor.
    """

    height_mm: Annotated[Number, Field(ge=1, le=500)] = 28.0
    ahead_mm: Annotated[Number, Field(ge=-250, le=250)] = 30.0
    field_of_view_deg: Annotated[Number, Field(ge=1, le=150)] = 48.13  # 0.84 rad
    noise_share: Share = 0.03  # [I]


@record
class GroundSensors:
    """Where the floor sensors left, in the middle and right look, and then two against cliffs, left and right.

    The floor sensors are where they are in epuck-protocol.md 6.3; those against cliffs are at the rim, [I].
    """

    ahead_mm: Places = (30.0, 30.0, 30.0, 20.0, 20.0)
    left_mm: Places = (9.0, 0.0, -9.0, 28.0, -28.0)


@record
class FirmwareSpec:
    """Versions of the robot's firmware, its processing time per command, and its line.

    `bits_per_character` counts the start bit and the stop bits, too: 11 with two stop bits, 10 with one.
    """

    protocol_version: Text
    processing_ms: Annotated[Number, Field(ge=0, le=1000)]
    baud: Baud
    banner: Text = ""
    bios_version: Text = ""
    has_user_flash: Switch = False
    bits_per_character: Annotated[Whole, Field(ge=BITS_MIN, le=11)] = BITS_PER_CHARACTER


@record
class Quirks:
    """Deviations that some clients need (khepera-protocol.md 3.4 and 11.3). All off is the documented robot."""

    answer_empty_lines: Switch = False
    accept_lower_case: Switch = False
    unknown_command_with_z: Switch = False
    d_reply_trailing_comma: Switch = False


def must(holds: bool, part: object, key: str, rule: str) -> None:
    """Raise a ParameterError that names the section of a robot's file if a rule between fields is broken."""
    if not holds:
        section = type(part).__name__.removesuffix("Spec").lower()
        raise ParameterError(f"{section}.{key} must be {rule}, but it was {shown(getattr(part, key))}.")


def rises(values: tuple[float, ...]) -> bool:
    """Return whether no value is below the one before it."""
    return all(low <= high for low, high in pairwise(values))


@record
class RobotSpec:
    """The constants of a robot. `kind` names what is no number: its firmware and protocol (`ROBOT_KINDS`).

    Example:
        >>> RobotSpec.load("khepera").body.diameter_mm
        55.0
        >>> RobotSpec.load("khepera_ii").proximity.step_counts
        4
        >>> RobotSpec.load("khepera").with_changes(body__wall_friction=0.0).without_noise().is_noisy
        False
    """

    name: Annotated[Text, Field(min_length=1, description='Write: name = "My robot".')]
    body: Body
    motor: Motor
    proximity: Proximity
    ambient: Ambient
    firmware: FirmwareSpec
    reset: Reset = field(default_factory=Reset)
    camera: Camera = field(default_factory=Camera)
    quirks: Quirks = field(default_factory=Quirks)
    colour_camera: ColourCamera | None = None
    ground: GroundSensors | None = None
    curve: Curve | None = None
    reflection: Reflection | None = None
    kind: Annotated[str, OneOf(tuple(ROBOT_KINDS))] = "khepera"

    def __repr__(self) -> str:
        size = f"{self.body.diameter_mm:g} mm, response {self.proximity.response!r}"
        return f"<{type(self).__name__} {self.name!r}: {size}>"

    def __deepcopy__(self, memo: dict[int, Any]) -> RobotSpec:
        return self  # as it never changes

    @staticmethod
    def load(name_or_path: str | Path, *, response: str | None = None) -> RobotSpec:
        """Return a robot that comes with KiKS ('khepera', 'khepera_ii') or one from a file ('mine.toml').

        Args:
            name_or_path: Name of a robot of ours, or the path of a TOML file with the same keys.
            response: What makes counts of the rays of its proximity sensors, one of `RESPONSES`; what the file says
                if left out.

        Example:
            >>> import kiks
            >>> kiks.RobotSpec.load("khepera_ii").name
            'Khepera II'
        """
        path, known = path_of(name_or_path, "robot, if not a name such as 'khepera',"), robot_names()
        source = str(path)
        what = f"Robot file {source!r}"
        if source in known:
            data = read_file(ROBOT_FILES / f"{source}.toml", what)
        elif path.is_file() or len(path.parts) > 1 or (path.suffix and path.stem not in known):
            data = read_file(path, what)
        else:
            raise ParameterError(
                f"robot must be one of {known} or a TOML file, but it was {shown(source)}."
                f"{nearest_file(path, known)} Copy a robot of ours to begin with one of your own."
            )
        spec = _checked(_completed(parse_toml(data, what), what), what)
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
        if self.motor.pulses_per_tick * self.body.pulse_mm > 20:
            name = "steps_per_s_max" if self.motor.steps_per_s_max else "free_speed_pulses"
            raise ParameterError(
                f"motor.{name} must be at most 20 mm a tick (2 m/s), but it was {getattr(self.motor, name):g}."
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
        """Return a copy with some values changed, named 'section__key'."""
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
        return _checked(table, self.name)


def robot_names() -> list[str]:
    """Return the names of the robots that come with KiKS."""
    return list(ROBOT_NAMES)


def _completed(table: dict[str, Any], what: str) -> dict[str, Any]:
    """Return the table of a file; one that is `like` a robot of ours has that one's values where it names none."""
    like = table.pop("like", None)
    if like is None:
        return table
    check_choice(f"like of {what}", like, ROBOT_NAMES, f"one of {robot_names()}")
    base = _completed(parse_toml(read_file(ROBOT_FILES / f"{like}.toml", what), what), what)
    for name, value in table.items():
        base[name] = base[name] | value if isinstance(value, dict) and isinstance(base.get(name), dict) else value
    return base


def _checked(table: dict[str, Any], what: str) -> RobotSpec:
    """Return the robot of a file's table; messages name the file of ours that is most like it."""
    name = str(table.get("name")).lower().replace(" ", "_")
    like = max((known for known in ROBOT_NAMES if name.startswith(known)), key=len, default="khepera")
    return check(RobotSpec, table, what, advice=f"Compare it with '{like}.toml'.")


def specs_of(
    robot: str | RobotSpec | Sequence[str | RobotSpec], robots: int | None, response: str | None
) -> list[RobotSpec]:
    """Return what each robot of a world is.

    Args:
        robot: The kind of all, or a list with that of each: names that `RobotSpec.load` knows, files, or specs.
        robots: How many there are, 0 for none; as many as kinds are named if None.
        response: What makes counts of their proximity sensors' rays; what their files say if None.
    """
    named: list[Any] = list(robot) if isinstance(robot, list | tuple) else [robot]
    count, least = (len(named), 1) if robots is None else (robots, 0)
    count = check_count("robots", count, least, ROBOTS_MAX, "Say how many you need.")
    if len(named) not in (1, count):
        raise ParameterError(
            f"robot must name one kind for all or one for each of {counted(count, 'robot')}, but it named "
            f"{len(named)}. Leave robots out to have one of each."
        )
    specs = [each if isinstance(each, RobotSpec) else RobotSpec.load(each) for each in named]
    if response is not None:
        specs = [spec.with_changes(proximity__response=response) for spec in specs]
    return specs if len(specs) == count else specs * count


def save_robot(spec: RobotSpec, path: str | Path, *, comment: str = "") -> None:
    """Write a robot file that `RobotSpec.load` reads, in one step, with a comment of some lines above it."""
    replace_file(path, robot_toml(spec, comment), "a robot")


def robot_toml(spec: RobotSpec, comment: str = "") -> str:
    """Return the text of a robot file.

    Example:
        >>> robot_toml(RobotSpec.load("khepera"), "mine").splitlines()[:5]
        ['# mine', 'name = "Khepera"', '', '[body]', 'diameter_mm = 55.0']
    """
    # TOML allows in no comment what is not printable.
    lines = [f"# {printable(line, '?')}".rstrip() for line in comment.splitlines()]
    sections = []
    for entry in fields(spec):
        value = getattr(spec, entry.name)
        if hasattr(value, "__dataclass_fields__"):
            sections += ["", f"[{entry.name}]"]
            sections += [f"{key.name} = {toml(getattr(value, key.name))}" for key in fields(value)]
        elif value != entry.default:
            lines.append(f"{entry.name} = {toml(value)}")
    return "\n".join(lines + sections) + "\n"
