"""The eight ambient light sensors: the light of lamps on each, obstacles before lamps, and the resulting count.

Source: khepera-protocol.md 9.1 (reading at distances from a lamp of 1 W) and 9.2 (at angles), thesis 3.3 ("Ambient
light sensors"). The sensors are sampled in turn, at the same instants as their reflected light (8.1).

Derivation: a lamp of power P at the distance d and the angle a off a sensor's axis gives the flux P cos(a)^n / d^2
[W/mm^2], and none from behind. The fluxes of several lamps and of daylight add up to E. The published curve R0(d) was
measured with 1 W on the axis, where E = 1/d^2. So any flux gives the reading of that lamp at the equivalent distance
d = 1/sqrt(E): R = R0(1/sqrt(E)). For one lamp on the axis the equivalent distance is d/sqrt(P). Beyond its last point
the curve approaches the dark value in proportion to the flux.

Angle: n = 2.5 was fitted to the two published curves of 9.2 (mean error 21 counts; the best n, 2.7, has 20, the
thesis's 1 - cos a has 52). The body hides a lamp behind the body's tangent at the sensor.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from kiks.engine.compiling import allocating, entry, inlined, kernel, linked
from kiks.engine.grid import count_discs, disc_at, is_on_floor
from kiks.engine.numbers import power, sin_cos, uniform
from kiks.engine.physics.motion import moment_of
from kiks.engine.scene import OPEN_SCENE, open_scene
from kiks.engine.sensing.disc_rays import moved_at, moved_of, note_tracks, see_all
from kiks.engine.sensing.proximity import on_body, quantize, sampled_pose
from kiks.engine.sensing.rays import is_lit
from kiks.model.robot import SENSOR_COUNT

STREAM_AMBIENT = 3
"""Random stream of the noise on light readings."""

MODEL_FLUX, MODEL_THESIS = 0, 1
"""The sum of all lamps, or the thesis's formula for the strongest lamp."""

FACING, BEHIND, BEHIND_BODY = 0, 1, 2
"""Place of a lamp: before a sensor, behind it (or nowhere), or behind the edge of the robot's own body."""

THESIS_DARK = 500.0
"""Reading without light in the thesis's formula [counts]."""

FARTHEST_MM = 1e9
"""A lamp farther away, or at NaN, is nowhere."""

_NEAREST_MM = 1e-3  # a lamp on the sensor itself


@kernel
def curve(parameters: Any, distance_mm: Any) -> Any:
    """Return the reading of a sensor that faces a lamp of 1 W [counts]."""
    last = parameters.lamp_point_count - 1
    place = max(0.0, distance_mm / parameters.lamp_step_mm)
    if place >= last:
        rest = parameters.dark_counts - parameters.lamp_counts[last]
        return parameters.dark_counts - rest * (last / place) * (last / place)
    i = np.int64(place)
    return parameters.lamp_counts[i] + (place - i) * (parameters.lamp_counts[i + 1] - parameters.lamp_counts[i])


@kernel
def expected_ambient(
    walls: Any, lamps: Any, parameters: Any, seen: Any, seen_count: Any, x: Any, y: Any, heading: Any, sensor: Any
) -> Any:
    """Return the mean count of a sensor of a robot at a pose.

    Args:
        walls: The walls as rays see them.
        lamps: x [mm], y [mm], power [W] and 1 for on or 0 for off, shape [lamp, 4].
        parameters: Record of the robot's constants.
        seen: Discs that may hide a lamp (`kiks.engine.sensing.disc_rays`).
        seen_count: Number of discs.
        x: Where the robot is [mm].
        y: Where the robot is [mm].
        heading: Where it looks [rad].
        sensor: Index of the sensor.
    """
    mount = mount_of(parameters, x, y, heading, sensor)
    flux = parameters.background_flux
    lowest = parameters.background_counts if flux > 0.0 else THESIS_DARK
    for number in range(lamps.shape[0]):
        watts = lamps[number, 2]
        is_facing, distance, cos_angle = face(mount, lamps, number)
        if is_facing != FACING or not is_burning(lamps, number):
            continue
        if not is_lit(walls, seen, seen_count, mount[0], mount[1], lamps[number, 0], lamps[number, 1]):
            continue
        # The thesis knows no sum: the lamp that is seen best decides.
        if parameters.ambient_model == MODEL_THESIS:
            on_axis = curve(parameters, distance / math.sqrt(watts))
            lowest = min(lowest, on_axis + (1.0 - cos_angle) * (THESIS_DARK - on_axis))
        else:
            flux += watts * power(cos_angle, parameters.angle_exponent) / (distance * distance)
    # Readings fall with light, so the lowest is that of the strongest lamp.
    if parameters.ambient_model == MODEL_THESIS:
        return lowest
    return curve(parameters, 1.0 / math.sqrt(flux)) if flux > 0.0 else parameters.dark_counts


@inlined
def mount_of(parameters: Any, x: Any, y: Any, heading: Any, sensor: Any) -> Any:
    """Return the place of a sensor [mm], the same relative to the robot's centre [mm], and its axis."""
    sine, cosine = sin_cos(heading)
    out_x, out_y = on_body(0.0, 0.0, sine, cosine, parameters.mount_x_mm[sensor], parameters.mount_y_mm[sensor])
    axis_x, axis_y = on_body(0.0, 0.0, sine, cosine, parameters.axis_cos[sensor], parameters.axis_sin[sensor])
    return x + out_x, y + out_y, out_x, out_y, axis_x, axis_y


@inlined
def face(mount: Any, lamps: Any, number: Any) -> Any:
    """Return the place of a lamp (`FACING`, ...), its distance [mm] and the cosine of its angle off the axis."""
    x, y, out_x, out_y, axis_x, axis_y = mount
    dx, dy = lamps[number, 0] - x, lamps[number, 1] - y
    distance = math.sqrt(dx * dx + dy * dy)
    along = dx * axis_x + dy * axis_y
    how = FACING
    if not (along > 0.0 and distance < FARTHEST_MM):
        how = BEHIND
    elif not dx * out_x + dy * out_y > 0.0:
        how = BEHIND_BODY
    distance = max(distance, _NEAREST_MM)
    return how, distance, min(along / distance, 1.0)


@inlined
def is_burning(lamps: Any, number: Any) -> Any:
    """Return whether a lamp is on and has power."""
    return lamps[number, 3] > 0.0 and lamps[number, 2] > 0.0


@allocating
def hiding_tracks(scene: Any, world: Any, robot: Any) -> Any:
    """Return the tracks of discs that may hide a lamp from a robot, their number, and memory for the visible discs."""
    state, lamps = scene.robots[world, robot], scene.lamps[world]
    parameters = scene.kinds[state.kind]
    # Light ends at a sensor, where that was at a moment of the trail.
    mount_mm = 0.0
    for sensor in range(SENSOR_COUNT):
        mount_mm = max(mount_mm, abs(parameters.mount_x_mm[sensor]) + abs(parameters.mount_y_mm[sensor]))
    margin_mm = mount_mm + moved_of(state)
    found, count = np.empty(count_discs(scene)[1], np.int64), 0
    for disc in range(found.shape[0]):
        if disc != robot and is_on_floor(scene, world, disc):
            x, y, radius = disc_at(scene, world, disc)
            far_mm = radius + margin_mm + moved_at(scene, world, disc)
            for number in range(lamps.shape[0]):
                if is_burning(lamps, number) and distance_from_way(state, lamps[number], x, y) < far_mm:
                    found[count] = disc
                    count += 1
                    break
    return note_tracks(scene, world, found, count)


@inlined
def distance_from_way(robot: Any, lamp: Any, x: Any, y: Any) -> Any:
    """Return the distance of a place from the way between a robot and a lamp [mm]."""
    way_x, way_y, dx, dy = lamp[0] - robot.x_mm, lamp[1] - robot.y_mm, x - robot.x_mm, y - robot.y_mm
    square = way_x * way_x + way_y * way_y
    along = min(max((dx * way_x + dy * way_y) / square, 0.0), 1.0) if square > 0.0 else 0.0
    aside_x, aside_y = dx - along * way_x, dy - along * way_y
    return math.sqrt(aside_x * aside_x + aside_y * aside_y)


@linked(types.void(OPEN_SCENE, *(types.int64,) * 4, types.boolean, types.float64[::1]), _nrt=True)
def sense_ambient(scene: Any, world: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, out: Any) -> Any:
    """Write the eight counts that command O returns at a time into `out`, each sampled at its own instant.

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        world: Index of the world.
        robot: Index of the robot.
        tick_count: Ticks done.
        time_ns: Time of the reading [ns].
        is_noisy: False for the expected counts at the present pose, without rounding.
        out: float64, shape [8].
    """
    state, lamps = scene.robots[world, robot], scene.lamps[world]
    parameters = scene.kinds[state.kind]
    tracks, count, seen = hiding_tracks(scene, world, robot)
    for sensor in range(out.shape[0]):
        slot = parameters.slot_ns[sensor], parameters.round_ns
        turn, instant_ns, x, y, heading = sampled_pose(state, tick_count, 1.0 * time_ns, *slot, is_noisy)
        see_all(scene.walls, tracks, count, moment_of(tick_count, instant_ns), seen)
        counts = expected_ambient(scene.walls, lamps, parameters, seen, count, x, y, heading, sensor)
        if is_noisy:
            jitter = uniform(scene.seeds[world], 0, robot, STREAM_AMBIENT, turn, sensor)
            counts += parameters.dark_noise_counts * (2.0 * jitter - 1.0)
            counts = quantize(parameters, counts, parameters.ambient_maximum_counts)
        out[sensor] = counts


@entry
def read_ambient(scene: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, out: Any) -> Any:
    """Call `sense_ambient` for the first world of a scene."""
    sense_ambient(open_scene(scene[0]), 0, robot, tick_count, time_ns, is_noisy, out)
