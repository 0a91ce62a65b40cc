"""A robot's constants as one record that kernels read: derived once from the robot's data file."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.numbers import exponential, sin_cos
from kiks.model.robot import AMBIENT_MODELS, LAMP_POINT_LIMIT, SENSOR_COUNT, Ambient, RobotSpec
from kiks.units import TICK_NS

RAY_COUNT = 7
"""Rays of a proximity sensor (thesis 3.3, "Proximity sensors")."""

PARAMETERS = np.dtype(
    [
        ("radius_mm", "f8"),
        ("wheel_base_mm", "f8"),
        ("pulse_mm", "f8"),
        ("wall_friction", "f8"),
        ("slip_ratio_min", "f8"),
        ("slip_ratio_max", "f8"),
        ("free_speed_pulses", "f8"),
        ("dead_band_pwm", "f8"),
        ("motor_gain", "f8", (2,)),
        ("lag_decay", "f8"),  # share of a speed difference that is left after a tick
        ("lag_ticks", "f8"),  # what that decay adds to the path: the integral of the difference over a tick
        ("gain_scale", "i8"),
        ("mount_x_mm", "f8", (SENSOR_COUNT,)),
        ("mount_y_mm", "f8", (SENSOR_COUNT,)),
        ("ray_cos", "f8", (SENSOR_COUNT, RAY_COUNT)),
        ("ray_sin", "f8", (SENSOR_COUNT, RAY_COUNT)),
        ("range_mm", "f8"),
        ("gain", "f8", (SENSOR_COUNT,)),
        ("baseline_counts", "f8", (SENSOR_COUNT,)),
        ("maximum_counts", "f8"),
        ("step_counts", "f8"),
        ("noise_small", "f8"),
        ("noise_large", "f8"),
        ("noise_exponent", "i8"),
        ("noise_counts", "f8"),
        ("axis_cos", "f8", (SENSOR_COUNT,)),
        ("axis_sin", "f8", (SENSOR_COUNT,)),
        ("ambient_model", "i8"),
        ("dark_counts", "f8"),
        ("dark_noise_counts", "f8"),
        ("background_counts", "f8"),
        ("background_flux", "f8"),  # of the lamp of 1 W that would read so [W/mm^2]
        ("angle_exponent", "f8"),
        ("lamp_step_mm", "f8"),
        ("lamp_point_count", "i8"),
        ("lamp_counts", "f8", (LAMP_POINT_LIMIT,)),
    ],
    align=True,
)


def pack(spec: RobotSpec) -> NDArray[np.void]:
    """Return the robot's constants as an array of one `PARAMETERS` record, shape [1]."""
    packed = np.zeros(1, PARAMETERS)
    robot: Any = packed[0]
    body, motor, proximity = spec.body, spec.motor, spec.proximity
    robot["radius_mm"] = body.radius_mm
    for name in ("wheel_base_mm", "pulse_mm", "wall_friction", "slip_ratio_min", "slip_ratio_max"):
        robot[name] = getattr(body, name)
    robot["free_speed_pulses"] = motor.free_speed_pulses
    robot["dead_band_pwm"] = motor.dead_band_pwm
    robot["motor_gain"] = (motor.left_gain, motor.right_gain)
    # dw/dt = (u - w)/T has the solution w(t) = u + (w0 - u) exp(-t/T); its integral over a tick of length 1 is
    # u + (w0 - u) T (1 - exp(-1/T)), with T in ticks.
    lag_ticks = motor.time_constant_ms * 1e6 / TICK_NS
    robot["lag_decay"] = exponential(-1.0 / lag_ticks)
    robot["lag_ticks"] = lag_ticks * (1.0 - robot["lag_decay"])
    robot["gain_scale"] = motor.gain_scale
    for sensor in range(SENSOR_COUNT):
        sine, cosine = sin_cos(math.radians(proximity.mount_angle_deg[sensor]))
        robot["mount_x_mm"][sensor] = proximity.mount_radius_mm[sensor] * cosine
        robot["mount_y_mm"][sensor] = proximity.mount_radius_mm[sensor] * sine
        for ray in range(RAY_COUNT):
            # The leftmost ray comes first, as in the thesis.
            offset_deg = proximity.field_of_view_deg * (0.5 - ray / (RAY_COUNT - 1))
            sine, cosine = sin_cos(math.radians(proximity.direction_deg[sensor] + offset_deg))
            robot["ray_cos"][sensor, ray] = cosine
            robot["ray_sin"][sensor, ray] = sine
    for name in ("range_mm", "gain", "baseline_counts", "maximum_counts", "step_counts"):
        robot[name] = getattr(proximity, name)
    for name in ("noise_small", "noise_large", "noise_exponent", "noise_counts"):
        robot[name] = getattr(proximity, name)
    _pack_ambient(robot, spec)
    return packed


def _pack_ambient(robot: Any, spec: RobotSpec) -> None:
    ambient = spec.ambient
    for sensor in range(SENSOR_COUNT):
        sine, cosine = sin_cos(math.radians(spec.proximity.direction_deg[sensor]))
        robot["axis_cos"][sensor] = cosine
        robot["axis_sin"][sensor] = sine
    robot["ambient_model"] = AMBIENT_MODELS.index(ambient.model)
    robot["dark_noise_counts"] = ambient.noise_counts
    for name in ("dark_counts", "background_counts", "angle_exponent", "lamp_step_mm"):
        robot[name] = getattr(ambient, name)
    robot["lamp_point_count"] = len(ambient.lamp_counts)
    robot["lamp_counts"][: len(ambient.lamp_counts)] = ambient.lamp_counts
    robot["background_flux"] = 1.0 / _lamp_distance_mm(ambient) ** 2


def _lamp_distance_mm(ambient: Ambient) -> float:
    """Return how far a lamp of 1 W is that reads as much as the background [mm], infinity in the dark."""
    wanted, counts = ambient.background_counts, ambient.lamp_counts
    rest = ambient.dark_counts - wanted
    if rest <= 0:
        return math.inf
    for i in range(len(counts) - 1):
        if wanted <= counts[i + 1]:
            return ambient.lamp_step_mm * (i + (wanted - counts[i]) / (counts[i + 1] - counts[i]))
    return ambient.lamp_step_mm * (len(counts) - 1) * math.sqrt((ambient.dark_counts - counts[-1]) / rest)
