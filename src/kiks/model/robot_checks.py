"""What must hold of a robot, each rule in words that name the value that breaks it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING

from kiks.errors import ParameterError
from kiks.model.robot_parts import (
    AMBIENT_MODELS,
    CURVE_POINT_LIMIT,
    JITTER_POINT_LIMIT,
    LAMP_POINT_LIMIT,
    RESPONSES,
    SENSOR_COUNT,
    Ambient,
    Curve,
    Proximity,
    Reflection,
)

if TYPE_CHECKING:
    from kiks.model.robot import RobotSpec

Must = Callable[[bool, str, str], None]
"""Raises if the first is false: then the key, 'section.key', breaks the rule."""


def check(spec: RobotSpec, where: str) -> None:
    """Raise a ParameterError if a value of a robot is out of range.

    Args:
        spec: The robot.
        where: What the message says it comes from.
    """

    def must(holds: bool, key: str, rule: str) -> None:
        if not holds:
            section, name = key.split(".")
            raise ParameterError(
                f"{where}: {key} must be {rule}, but it was {getattr(getattr(spec, section), name)!r}."
            )

    _check_drive(spec, must)
    _check_proximity(spec.proximity, spec.body.radius_mm, must)
    _check_response(spec, must)
    _check_light(spec.ambient, must)
    must(0 <= spec.firmware.processing_ms <= 1000, "firmware.processing_ms", "between 0 and 1000 ms")
    must(75 <= spec.firmware.baud <= 4_000_000, "firmware.baud", "between 75 and 4000000 bit/s")


def _check_drive(spec: RobotSpec, must: Must) -> None:
    body, motor, reset = spec.body, spec.motor, spec.reset
    must(10 <= body.diameter_mm <= 500, "body.diameter_mm", "between 10 and 500 mm")
    must(1 <= body.brightness <= 255, "body.brightness", "between 1 and 255")
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


def _check_proximity(proximity: Proximity, radius_mm: float, must: Must) -> None:
    for key in ("mount_angle_deg", "mount_radius_mm", "direction_deg", "gain", "baseline_counts"):
        must(len(getattr(proximity, key)) == SENSOR_COUNT, f"proximity.{key}", f"a list of {SENSOR_COUNT}")
    must(all(0 < r <= radius_mm for r in proximity.mount_radius_mm), "proximity.mount_radius_mm", "inside the body")
    must(
        all(gain == 0 or 0.05 <= gain <= 20 for gain in proximity.gain),
        "proximity.gain",
        "between 0.05 and 20, or 0 for a dead sensor",
    )
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


def _check_response(spec: RobotSpec, must: Must) -> None:
    response, jitter, curve = spec.proximity.response, spec.proximity.jitter_counts, spec.curve
    missing = [name for name in ("curve", "reflection") if getattr(spec, name) is None]
    possible = [name for name in RESPONSES if name not in missing]
    needed = "".join(f" ({name!r} needs a section [{name}])" for name in missing if name == response)
    must(response in possible, "proximity.response", f"one of {possible}{needed}")
    rises = all(low <= high for low, high in pairwise(jitter))
    is_jitter = 1 <= len(jitter) <= JITTER_POINT_LIMIT and rises
    must(is_jitter, "proximity.jitter_counts", f"a list of 1 to {JITTER_POINT_LIMIT}, none below the one before")
    if spec.reflection is not None:
        _check_reflection(spec.reflection, must)
    if curve is not None:
        _check_curve(curve, must)


def _check_curve(curve: Curve, must: Must) -> None:
    far = curve.distance_mm
    rises = 2 <= len(far) <= CURVE_POINT_LIMIT and all(nearer < farther for nearer, farther in pairwise(far))
    must(rises and far[0] >= 1, "curve.distance_mm", f"a list of 2 to {CURVE_POINT_LIMIT}, from 1 mm, rising")
    falls = all(high >= low for high, low in pairwise(curve.counts)) and min(curve.counts, default=0) > 0
    must(falls and len(curve.counts) == len(far), "curve.counts", "one for each distance, above 0, falling")
    must(0.05 <= curve.scale <= 20, "curve.scale", "between 0.05 and 20")
    weighs = len(curve.ray_weight) == 4 and all(0 <= weight <= 1 for weight in curve.ray_weight)
    must(weighs and curve.ray_weight[0] > 0, "curve.ray_weight", "4 numbers from 0 to 1, the first above 0")


def _check_reflection(reflection: Reflection, must: Must) -> None:
    must(0.1 <= reflection.behind_mm <= 1000, "reflection.behind_mm", "between 0.1 and 1000 mm")
    for key, low, high in (("light", 1e-3, 1e3), ("threshold", 0.0, 10.0), ("lobe_deg", 1.0, 180.0)):
        values = getattr(reflection, key)
        within = len(values) == SENSOR_COUNT and all(low <= value <= high for value in values)
        must(within, f"reflection.{key}", f"a list of {SENSOR_COUNT}, from {low:g} to {high:g}")
    for key in ("faint", "bright"):
        must(1e-3 <= getattr(reflection, key) <= 0.5, f"reflection.{key}", "between 0.001 and 0.5")


def _check_light(ambient: Ambient, must: Must) -> None:
    counts, dark = ambient.lamp_counts, ambient.dark_counts
    must(len(ambient.direction_deg) == SENSOR_COUNT, "ambient.direction_deg", f"a list of {SENSOR_COUNT}")
    must(0 <= dark <= 1023, "ambient.dark_counts", "between 0 and 1023 counts")
    must(ambient.noise_counts >= 0, "ambient.noise_counts", "at least 0")
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
