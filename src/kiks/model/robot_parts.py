"""What a robot is made of: a frozen record for each section of its file, and the choices and limits these have."""

from __future__ import annotations

from dataclasses import dataclass

SENSOR_COUNT = 8
"""Infra-red sensors of a Khepera, clockwise from the left side (khepera-protocol.md 4.14)."""

RESPONSES = ("reflection", "thesis", "fast", "standin", "curve")
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
    """Shape and contact. `slip_ratio_min` and `_max` bound a blocked wheel's speed, as a share of its command.

    `brightness` is how other robots see it: 1 black to 255 white.
    """

    diameter_mm: float
    brightness: int
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
class Reflection:
    """What the response 'reflection' knows: how much light a sensor gets back, and what it makes of that.

    A ray of the length t that meets a surface with the reflectance b at the angle of incidence i brings the light
    b w (cos(i) / (t + behind))^3, where w falls with the angle off the sensor's axis as a Gaussian of `lobe_deg` does.
    `light` is the middle ray's for a white surface, square to it, at 20 mm. Their sum L gives the share
    (1 + threshold) L - threshold of the largest count, which is rounded off at both ends: at the lower one over
    `faint` and at the upper one over `bright`, shares too, to either side.
    """

    behind_mm: float
    light: tuple[float, ...]
    threshold: tuple[float, ...]
    lobe_deg: tuple[float, ...]
    faint: float
    bright: float


@dataclass(frozen=True)
class Ambient:
    """How the sensors answer to light.

    `direction_deg` is where each receives light from, left positive: not quite where reflections come from best, which
    the sensor's own lamp has to reach as well. `lamp_counts` is what a sensor reads that looks straight at a lamp of
    1 W from 0, 1, 2, ... steps of `lamp_step_mm`; `background_counts` what it reads of the room's daylight alone, which
    in the dark is `dark_counts`.
    """

    model: str
    direction_deg: tuple[float, ...]
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
