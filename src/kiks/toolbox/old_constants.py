"""What the constants and the robot definition files of KiKS 2.2.0 change of a robot.

They belong to models of sensors that this KiKS does not have. So they change what was measured on real robots as much
as they changed those models (kiks-behaviour.md 2.2 and 3). With the values of KiKS 2.2.0, nothing changes.
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from kiks.engine.parameters import LIGHT_MM
from kiks.model.data_file import Number, Rule, Switch, Whole, record
from kiks.model.robot import SENSOR_COUNT, STRIPE_LIMIT, DeadBandPwm, PulseMm, RobotSpec

RANGE_MM = 50.0
"""Range of the Khepera's proximity sensors [mm]."""

NOISE_PERCENT, ERROR_SMALL, ERROR_LARGE, ERROR_EXPONENT = 1.0, 0.25, 0.10, 3.0
LIGHT_EXPONENT, CAMERA_NOISE_PERCENT = 5.0, 10.0

_NOISE_MAX, _ERROR_EXPONENT_MAX, _LIGHT_EXPONENT_MAX = 0.99, 20, 20.0


def _number(given: object) -> object:
    """Convert a text to an int or float; return anything else unchanged."""
    try:
        number = float(given) if isinstance(given, str) else given
    except ValueError:
        return given
    return int(number) if isinstance(number, float) and number.is_integer() else number


def _numbers(given: object) -> object:
    return tuple(map(_number, given.split())) if isinstance(given, str) else given


def _switch(given: object) -> object:
    return {"0": False, "1": True}.get(given, given) if isinstance(given, str) else given


NUMBER, SWITCH = BeforeValidator(_number), BeforeValidator(_switch)
"""They let texts stand for numbers, and for truth values."""

Percent = Annotated[Number, Field(ge=0, le=100), NUMBER]
Exponent = Annotated[Number, Field(gt=0, le=1e6), NUMBER]
Figures = Annotated[tuple[Number, ...], Field(min_length=3 + 2 * SENSOR_COUNT, max_length=3 + 2 * SENSOR_COUNT)]


@record
class OldConstants:
    """Constants of KiKS 2.2.0 that change robots.

    Attributes:
        figures: What a robot definition file says: diameter of the body, distance between the wheels, range of the
            proximity sensors [mm]; places of the eight sensors on the rim and their directions [deg, left positive].
            None for a robot without such a file.
        pulse_mm: Way of a wheel for a pulse of its encoder [mm]; None for that of the robot's file.
        dead_band_pwm: Power below which motors do not turn, 255 is full; None for that of the robot's file.
        stripes: Number of black and of white stripes around each robot; 0 for none.
        noise_percent: Random share of each proximity reading [%].
        error_small: Largest share by which a small reading errs.
        error_large: Largest share by which a reading of 1000 errs.
        error_exponent: The larger, the less frequent large errors are; with 1, all are equally frequent.
        light_exponent: The larger, the wider is the field of view of the light sensors.
        camera_noise_percent: Random share of each pixel of the K213 [%].
        fixed_shutter: Whether the K213 does not adapt its exposure.
    """

    figures: Annotated[Figures, BeforeValidator(_numbers)] | None = None
    pulse_mm: Annotated[PulseMm, NUMBER] | None = None
    dead_band_pwm: Annotated[DeadBandPwm, NUMBER] | None = None
    stripes: Annotated[Whole, Field(ge=0, le=STRIPE_LIMIT), NUMBER] = 0
    noise_percent: Percent = NOISE_PERCENT
    error_small: Annotated[Number, Field(ge=0, le=1), NUMBER] = ERROR_SMALL
    error_large: Annotated[Number, Field(ge=0, le=1), NUMBER] = ERROR_LARGE
    error_exponent: Exponent = ERROR_EXPONENT
    light_exponent: Exponent = LIGHT_EXPONENT
    camera_noise_percent: Percent = CAMERA_NOISE_PERCENT
    fixed_shutter: Annotated[Switch, SWITCH, Rule("0 or 1")] = False

    def changes(self, spec: RobotSpec) -> dict[str, dict[str, Any]]:
        """Return what they change of a robot: keys of the sections of its file, and their values.

        Example:
            >>> khepera = RobotSpec.load("khepera")
            >>> OldConstants().changes(khepera)
            {}
            >>> OldConstants(error_exponent=4, error_small=0.5).changes(khepera)
            {'proximity': {'noise_small': 0.5, 'noise_exponent': 7}}
        """
        changes: dict[str, dict[str, Any]] = defaultdict(dict)
        if self.figures is not None:
            changes |= _shape(self.figures, spec)
        if self.pulse_mm is not None:
            changes["body"]["pulse_mm"] = self.pulse_mm
        if self.dead_band_pwm is not None:
            changes["motor"]["dead_band_pwm"] = self.dead_band_pwm
        if self.stripes:
            changes["body"]["stripe_count"] = self.stripes
        chance = spec.proximity
        if self.noise_percent != NOISE_PERCENT:
            scale = self.noise_percent / NOISE_PERCENT
            jitter = tuple(round(scale * each, 6) + 0.0 for each in chance.jitter_counts)
            changes["proximity"]["jitter_counts"] = jitter
        small = chance.noise_small
        if self.error_small != ERROR_SMALL:
            small = min(round(small * self.error_small / ERROR_SMALL, 6), _NOISE_MAX)
            changes["proximity"]["noise_small"] = small
        # The largest error of all is that of small readings.
        large = min(round(chance.noise_large * self.error_large / ERROR_LARGE, 6), small)
        if large != chance.noise_large:
            changes["proximity"]["noise_large"] = large
        if self.error_exponent != ERROR_EXPONENT:
            changes["proximity"]["noise_exponent"] = _error_exponent(self.error_exponent, chance.noise_exponent)
        if self.light_exponent != LIGHT_EXPONENT:
            changes["ambient"]["angle_exponent"] = _angle_exponent(self.light_exponent, spec.ambient.angle_exponent)
        if self.camera_noise_percent != CAMERA_NOISE_PERCENT:
            scale = self.camera_noise_percent / CAMERA_NOISE_PERCENT
            changes["camera"]["noise_share"] = min(round(scale * spec.camera.noise_share, 6), 1.0)
        if self.fixed_shutter:
            changes["camera"]["adapts_exposure"] = False
        return dict(changes)


def _shape(figures: tuple[float, ...], spec: RobotSpec) -> dict[str, dict[str, Any]]:
    """Return what the figures of a robot definition file change of a robot, by sections of its file.

    Sensors are as far within the rim as on the robot that was measured. They see at s times the distance what its
    sensors see, where s is the ratio of the ranges: in the light (cos(i) / (t + behind))^3 of a ray, t and `behind`
    grow by s, and with them the light that is given for one length, `LIGHT_MM`.
    """
    diameter_mm, wheel_base_mm, range_mm = figures[:3]
    places, directions = figures[3 : 3 + SENSOR_COUNT], figures[3 + SENSOR_COUNT :]
    inset_mm = spec.body.radius_mm - max(spec.proximity.mount_radius_mm)
    scale = range_mm / RANGE_MM
    changes: dict[str, dict[str, Any]] = {
        "body": {"diameter_mm": diameter_mm, "wheel_base_mm": wheel_base_mm},
        "proximity": {
            "mount_angle_deg": places,
            "mount_radius_mm": (diameter_mm / 2 - inset_mm,) * SENSOR_COUNT,
            "direction_deg": directions,
            "range_mm": spec.proximity.range_mm * scale,
        },
        "ambient": {"direction_deg": directions},
    }
    if spec.reflection is not None and scale != 1.0:
        behind_mm = spec.reflection.behind_mm
        brighter = (scale * (LIGHT_MM + behind_mm) / (LIGHT_MM + scale * behind_mm)) ** 3
        changes["reflection"] = {
            "behind_mm": scale * behind_mm,
            "light": tuple(round(brighter * each, 9) for each in spec.reflection.light),
        }
    return changes


def _error_exponent(old: float, measured: int) -> int:
    """Return the exponent of the noise. Errors are evenly spread with an exponent of 1 there and here."""
    return min(max(round(1.0 + (old - 1.0) * (measured - 1) / (ERROR_EXPONENT - 1.0)), 1), _ERROR_EXPONENT_MAX)


def _angle_exponent(old: float, measured: float) -> float:
    """Return the exponent of the light's fall with the angle off a sensor's axis.

    KiKS 2.2.0 weakened a lamp by the share (1 - cos a)^n, so half of it was left at the angle acos(1 - 0.5^(1/n)). Here
    the light falls with cos(a)^m, and half of it is left at acos(0.5^(1/m)). Both angles change in the same proportion.
    """

    def old_half(exponent: float) -> float:
        return math.acos(1.0 - 0.5 ** (1.0 / exponent))

    half_rad = math.acos(0.5 ** (1.0 / measured)) * old_half(old) / old_half(LIGHT_EXPONENT)
    cosine = math.cos(half_rad)
    exponent = math.log(0.5) / math.log(cosine) if cosine < 1.0 else _LIGHT_EXPONENT_MAX
    return round(min(exponent, _LIGHT_EXPONENT_MAX), 4)
