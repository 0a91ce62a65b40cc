"""A robot's constants as one record that kernels read: derived once from the robot's data file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.engine.scalar_math import exponential, logarithm, power, sin_cos
from kiks.engine.sensing.thesis_networks import NETWORK_RESPONSES, TABLE_LEVELS
from kiks.engine.simd.lanes import LANES
from kiks.model.robot import (
    AMBIENT_MODELS,
    GROUND_COUNT,
    JITTER_POINT_LIMIT,
    LAMP_POINT_LIMIT,
    RESPONSES,
    SENSOR_COUNT,
    Ambient,
    Body,
    ColourCamera,
    Curve,
    GroundSensors,
    Proximity,
    Reflection,
    RobotSpec,
)
from kiks.model.thesis_networks import BODY_RADIUS_MM, NetworkResponse
from kiks.model.window import SENSOR_WIDTH
from kiks.units import TICK_NS

RAY_COUNT = 7
"""Rays of a proximity sensor (thesis 3.3, "Proximity sensors")."""

AHEAD = 3
"""The ray of a sensor that goes straight ahead."""

CURVE_POINT_COUNT = 129
"""Points of a measured curve, evenly spread from 0 to the end of the range."""

LIGHT_MM = 20.0
"""Length of a ray at which the light of a sensor is given [mm]."""

_NEARER_MM, _ROUNDINGS = 1.01, 1e-6

DRIVING = tuple(each.name for each in fields(Body) if each.name not in ("diameter_mm", "brightness", "stripe_count"))
"""The constants of a body by which it drives and slips: kernels read them by their names in the robot's file."""

PARAMETERS = np.dtype(
    [
        ("radius_mm", "f8"),
        ("brightness", "i8"),  # of the body, as others see it
        ("stripe_count", "i8"),  # black stripes around the body, and as many white ones; 0 for its one brightness
        *((name, "f8") for name in DRIVING),
        ("free_speed_pulses", "f8"),
        ("dead_band_pwm", "f8"),
        ("motor_gain", "f8", (2,)),
        ("lag_decay", "f8"),  # share of a speed difference that is left after a tick
        ("lag_ticks", "f8"),  # what that decay adds to the path: the integral of the difference over a tick
        ("gain_scale", "i8"),
        ("steps_per_s_max", "f8"),  # of steppers; 0 for motors with a regulator
        ("timer_hz", "f8"),
        ("counter_range", "f8"),  # how many values a counter of steps has
        ("slot_ns", "f8", (SENSOR_COUNT,)),  # when in a round each sensor is sampled
        ("round_ns", "f8"),
        ("mount_x_mm", "f8", (SENSOR_COUNT,)),
        ("mount_y_mm", "f8", (SENSOR_COUNT,)),
        ("range_mm", "f8"),  # what the response measures lengths by
        ("response", "i8"),
        ("ray_x_mm", "f8", (SENSOR_COUNT,)),  # where the response lets its rays begin
        ("ray_y_mm", "f8", (SENSOR_COUNT,)),
        ("ray_cos", "f8", (SENSOR_COUNT, LANES)),  # the lane over repeats the last ray
        ("ray_sin", "f8", (SENSOR_COUNT, LANES)),
        ("edge_cos", "f8", (2, SENSOR_COUNT)),  # the directions of the leftmost and of the rightmost rays once more
        ("edge_sin", "f8", (2, SENSOR_COUNT)),
        ("reach_mm", "f8"),  # longest length of a ray
        ("watch_x_mm", "f8", (SENSOR_COUNT,)),  # a circle around all places where a wall makes a sensor respond
        ("watch_y_mm", "f8", (SENSOR_COUNT,)),
        ("watch_mm", "f8", (SENSOR_COUNT,)),
        ("watch_reach_mm", "f8"),  # radius of a circle around the robot's centre with all those circles in it
        ("ray_reach_mm", "f8"),  # and of one that no ray leaves
        ("ray_weight", "f8", (SENSOR_COUNT, LANES)),  # 0 for the lane over
        ("curve_counts", "f4", (CURVE_POINT_COUNT,)),
        ("behind_mm", "f8"),
        ("threshold", "f8", (SENSOR_COUNT,)),
        ("faint", "f8"),
        ("bright", "f8"),
        ("gain", "f8", (SENSOR_COUNT,)),
        ("baseline_counts", "f8", (SENSOR_COUNT,)),
        ("maximum_counts", "f8"),
        ("step_counts", "f8"),
        ("noise_small", "f8"),
        ("noise_large", "f8"),
        ("noise_exponent", "i8"),
        ("noise_down", "f8"),
        ("jitter_point_count", "i8"),
        ("jitter_counts", "f8", (JITTER_POINT_LIMIT + 1,)),
        ("axis_cos", "f8", (SENSOR_COUNT,)),
        ("axis_sin", "f8", (SENSOR_COUNT,)),
        ("is_noisy", "i8"),  # whether chance has a say in readings and pictures
        ("ambient_model", "i8"),
        ("ambient_maximum_counts", "f8"),
        ("dark_counts", "f8"),
        ("dark_noise_counts", "f8"),
        ("background_counts", "f8"),
        ("background_flux", "f8"),  # of the lamp of 1 W that would read so [W/mm^2]
        ("angle_exponent", "f8"),
        ("lamp_step_mm", "f8"),
        ("lamp_point_count", "i8"),
        ("lamp_counts", "f8", (LAMP_POINT_LIMIT,)),
        ("camera_noise_share", "f8"),
        ("adapts_exposure", "i8"),
        ("eye_height_mm", "f8"),  # the colour camera
        ("eye_ahead_mm", "f8"),
        ("eye_focal_pixels", "f8"),  # distance of its sensor behind the lens
        ("eye_noise_share", "f8"),
        ("ground_x_mm", "f8", (GROUND_COUNT,)),
        ("ground_y_mm", "f8", (GROUND_COUNT,)),
    ],
    align=True,
)


def pack(spec: RobotSpec) -> NDArray[np.void]:
    """Return the robot's constants as an array of one `PARAMETERS` record, shape [1]."""
    packed = np.zeros(1, PARAMETERS)
    robot: Any = packed[0]
    body, motor, proximity = spec.body, spec.motor, spec.proximity
    robot["radius_mm"], robot["brightness"], robot["stripe_count"] = body.radius_mm, body.brightness, body.stripe_count
    robot["is_noisy"] = spec.is_noisy
    for name in DRIVING:
        robot[name] = getattr(body, name)
    robot["free_speed_pulses"] = motor.free_speed_pulses
    robot["dead_band_pwm"] = motor.dead_band_pwm
    robot["motor_gain"] = (motor.left_gain, motor.right_gain)
    # dw/dt = (u - w)/T has the solution w(t) = u + (w0 - u) exp(-t/T); its integral over a tick of length 1 is
    # u + (w0 - u) T (1 - exp(-1/T)), with T in ticks.
    lag_ticks = motor.time_constant_ms * 1e6 / TICK_NS
    robot["lag_decay"] = exponential(-1.0 / lag_ticks)
    robot["lag_ticks"] = lag_ticks * (1.0 - robot["lag_decay"])
    for name in ("gain_scale", "steps_per_s_max", "timer_hz"):
        robot[name] = getattr(motor, name)
    robot["counter_range"] = 2.0**motor.counter_bits
    robot["slot_ns"], robot["round_ns"] = proximity.slots_ns, proximity.round_ns
    for name in ("range_mm", "gain", "baseline_counts", "maximum_counts", "step_counts"):
        robot[name] = getattr(proximity, name)
    for name in ("noise_small", "noise_large", "noise_exponent", "noise_down"):
        robot[name] = getattr(proximity, name)
    robot["jitter_point_count"] = len(proximity.jitter_counts)
    robot["jitter_counts"][: len(proximity.jitter_counts)] = proximity.jitter_counts
    robot["mount_x_mm"], robot["mount_y_mm"] = _places_mm(proximity.mount_angle_deg, proximity.mount_radius_mm)
    _pack_response(robot, spec)
    _pack_ambient(robot, spec)
    robot["camera_noise_share"] = spec.camera.noise_share
    robot["adapts_exposure"] = spec.camera.adapts_exposure
    eye, ground = spec.colour_camera or ColourCamera(), spec.ground or GroundSensors()
    for name in ("height_mm", "ahead_mm", "noise_share"):
        robot[f"eye_{name}"] = getattr(eye, name)
    sine, cosine = sin_cos(math.radians(0.5 * eye.field_of_view_deg))
    robot["eye_focal_pixels"] = 0.5 * SENSOR_WIDTH * cosine / sine
    robot["ground_x_mm"], robot["ground_y_mm"] = ground.ahead_mm, ground.left_mm
    return packed


def _places_mm(angle_deg: Sequence[float], radius_mm: Sequence[float]) -> tuple[list[float], list[float]]:
    """Return x and y of polar places on the robot [mm]."""
    turns = [sin_cos(math.radians(angle)) for angle in angle_deg]
    x_mm = [radius * cosine for radius, (_, cosine) in zip(radius_mm, turns, strict=True)]
    y_mm = [radius * sine for radius, (sine, _) in zip(radius_mm, turns, strict=True)]
    return x_mm, y_mm


def ray_offsets_deg(field_of_view_deg: float) -> tuple[float, ...]:
    """Return the angles of a sensor's rays off its axis [deg], the leftmost first (thesis); left is positive."""
    return tuple(field_of_view_deg * (0.5 - ray / (RAY_COUNT - 1)) for ray in range(RAY_COUNT))


def _pack_response(robot: Any, spec: RobotSpec) -> None:
    """Write which response it is, its rays and its constants."""
    proximity = spec.proximity
    robot["response"] = RESPONSES.index(proximity.response)
    geometry: Proximity | NetworkResponse = proximity
    radius_mm: Sequence[float] = proximity.mount_radius_mm
    reach_mm = proximity.range_mm
    if proximity.response in NETWORK_RESPONSES:
        geometry = networks = NetworkResponse.load()
        robot["range_mm"] = reach_mm = networks.range_mm
        if proximity.response == "fast":
            reach_mm *= 1.0 - 0.5 / (TABLE_LEVELS - 1)  # what is farther is rounded to nothing
        # On the rim of this robot, as they were on that of the one that was measured.
        radius_mm = [radius * spec.body.radius_mm / BODY_RADIUS_MM for radius in networks.mount_radius_mm]
    robot["reach_mm"] = reach_mm
    robot["ray_x_mm"], robot["ray_y_mm"] = _places_mm(geometry.mount_angle_deg, radius_mm)
    for sensor in range(SENSOR_COUNT):
        for ray, offset_deg in enumerate(ray_offsets_deg(geometry.field_of_view_deg)):
            sine, cosine = sin_cos(math.radians(geometry.direction_deg[sensor] + offset_deg))
            robot["ray_cos"][sensor, ray:] = cosine
            robot["ray_sin"][sensor, ray:] = sine
    robot["edge_cos"], robot["edge_sin"] = (robot[name][:, [0, RAY_COUNT - 1]].T for name in ("ray_cos", "ray_sin"))
    if proximity.response == "curve" and spec.curve is not None:
        _pack_curve(robot, spec.curve, proximity)
    near_mm = [reach_mm] * SENSOR_COUNT
    if proximity.response == "reflection" and spec.reflection is not None:
        _pack_reflection(robot, spec.reflection, proximity)
        near_mm = _bright_mm(robot, spec.reflection)
    _pack_watch(robot, geometry, near_mm)


def _bright_mm(robot: Any, reflection: Reflection) -> list[float]:
    """Return how far a white wall all around a sensor's rays may be before it makes the sensor respond [mm]."""
    found = []
    for sensor in range(SENSOR_COUNT):
        threshold, light = reflection.threshold[sensor], robot["gain"][sensor] * sum(robot["ray_weight"][sensor])
        dark = threshold - reflection.faint
        far_mm = power(light * (1.0 + threshold) / dark, 1.0 / 3.0) if dark > 0.0 else math.inf
        # A smooth surface may be a cell nearer than where rays end, and a cell has at most 1 mm.
        found.append(min(float(robot["reach_mm"]), max(far_mm - reflection.behind_mm + _NEARER_MM, 0.0)))
    return found


def _pack_watch(robot: Any, geometry: Proximity | NetworkResponse, near_mm: Sequence[float]) -> None:
    """Write the least circle around the sector in which a sensor's rays are up to a length."""
    sine, cosine = sin_cos(math.radians(0.5 * geometry.field_of_view_deg))
    ahead = min(max(cosine, 0.0), 0.5 / max(cosine, 0.5))
    radius = max(ahead, 1.0 - ahead, math.sqrt((cosine - ahead) ** 2 + sine**2))
    for sensor in range(SENSOR_COUNT):
        out_mm = ahead * near_mm[sensor]
        robot["watch_x_mm"][sensor] = robot["ray_x_mm"][sensor] + out_mm * robot["ray_cos"][sensor, AHEAD]
        robot["watch_y_mm"][sensor] = robot["ray_y_mm"][sensor] + out_mm * robot["ray_sin"][sensor, AHEAD]
        robot["watch_mm"][sensor] = (radius + _ROUNDINGS) * near_mm[sensor]
        offset_mm = math.sqrt(robot["watch_x_mm"][sensor] ** 2 + robot["watch_y_mm"][sensor] ** 2)
        robot["watch_reach_mm"] = max(robot["watch_reach_mm"], offset_mm + robot["watch_mm"][sensor])
        origin_mm = math.sqrt(robot["ray_x_mm"][sensor] ** 2 + robot["ray_y_mm"][sensor] ** 2)
        robot["ray_reach_mm"] = max(robot["ray_reach_mm"], origin_mm + robot["reach_mm"])


def _pack_reflection(robot: Any, reflection: Reflection, proximity: Proximity) -> None:
    """Write what each ray of each sensor counts, its lobe being a Gaussian, and the constants that all have."""
    for name in ("behind_mm", "threshold", "faint", "bright"):
        robot[name] = getattr(reflection, name)
    scale = (LIGHT_MM + reflection.behind_mm) ** 3
    for sensor in range(SENSOR_COUNT):
        for ray, offset_deg in enumerate(ray_offsets_deg(proximity.field_of_view_deg)):
            lobe = exponential(-0.5 * (offset_deg / reflection.lobe_deg[sensor]) ** 2)
            robot["ray_weight"][sensor, ray] = reflection.light[sensor] * lobe * scale


def _pack_curve(robot: Any, curve: Curve, proximity: Proximity) -> None:
    """Write a measured curve at evenly spread distances, and how much of it each ray brings.

    Between the measured points, the logarithm of the counts is a straight line over that of the distance. This line
    continues before the first point; beyond the last, the count falls with the square of the distance. The count at the
    end of the range is subtracted, so the curve ends there without a jump. The weights are such that a white wall,
    square to the axis of a sensor, gives what the curve says: its rays at the angle a are longer by 1/cos(a), and what
    comes back along them is less by cos(a)^2.
    """
    points = list(zip(curve.distance_mm, curve.counts, strict=True))
    points.append((2.0 * points[-1][0], points[-1][1] / 4.0))

    def counts_at(distance_mm: float) -> float:
        nearer, farther = next((pair for pair in pairwise(points) if distance_mm <= pair[1][0]), points[-2:])
        slope = logarithm(nearer[1] / farther[1]) / logarithm(farther[0] / nearer[0])
        return float(nearer[1] * exponential(slope * logarithm(nearer[0] / distance_mm)))

    last = counts_at(proximity.range_mm)
    for point in range(CURVE_POINT_COUNT):
        distance_mm = max(proximity.range_mm * point / (CURVE_POINT_COUNT - 1), 1.0)
        robot["curve_counts"][point] = curve.scale * max(counts_at(distance_mm) - last, 0.0)
    step_deg = proximity.field_of_view_deg / (RAY_COUNT - 1)
    middle = RAY_COUNT // 2
    cosines = [sin_cos(math.radians(step_deg * abs(ray - middle)))[1] for ray in range(RAY_COUNT)]
    whole = sum(curve.ray_weight[abs(ray - middle)] * cosines[ray] ** 2 for ray in range(RAY_COUNT))
    robot["ray_weight"][:, :RAY_COUNT] = [curve.ray_weight[abs(ray - middle)] / whole for ray in range(RAY_COUNT)]


def _pack_ambient(robot: Any, spec: RobotSpec) -> None:
    ambient = spec.ambient
    for sensor in range(SENSOR_COUNT):
        sine, cosine = sin_cos(math.radians(ambient.direction_deg[sensor]))
        robot["axis_cos"][sensor] = cosine
        robot["axis_sin"][sensor] = sine
    robot["ambient_model"] = AMBIENT_MODELS.index(ambient.model)
    robot["ambient_maximum_counts"] = ambient.maximum_counts or spec.proximity.maximum_counts
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
