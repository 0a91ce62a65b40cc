"""A colour camera that looks ahead, in perspective: walls, things and lamps over the floor.

Method: a pinhole camera that looks along the robot's heading, with the focal length f [pixels]. A pixel a f to the
right of the sensor's middle and b f below it looks along a ray whose way over the floor has the direction (1, -a), and
which falls by b / sqrt(1 + a^2) for each millimetre of that way. All pixels of a column share the way. So it is
followed once on the floor, to the wall and through all discs before and behind it; then each pixel sees the nearest
of those that its height hits there, else the floor, or the room beyond the walls.

A disc of the world is an upright cylinder, a ball is a sphere. The way cuts the sphere in a circle, which a ray hits
that passes its centre within its radius. What is round is darker at its edges, where a ray grazes it: by the cosine of
the angle of incidence, sqrt(1 - (d/r)^2) at the distance d of the ray from the axis, or the centre.

Arenas tell no heights, and no manual the colours of a room: all constants are ours.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from kiks.engine.compiling import allocating, entry, inlined, kernel
from kiks.engine.numbers import at_instant, draw, sin_cos, stream_of
from kiks.engine.physics.motion import moment_of
from kiks.engine.scene import open_scene
from kiks.engine.sensing.disc_rays import PER_DISC, disc_of, meet_disc, other_tracks, see_all
from kiks.engine.sensing.proximity import on_body, pose_at
from kiks.engine.sensing.rays import ENDLESS, brightness_at, brightness_met, cast
from kiks.engine.state import BALL
from kiks.model.window import SENSOR_HEIGHT, SENSOR_WIDTH

STREAM_COLOUR = 7
"""Random stream of the noise on colours."""

WALL_MM = 100.0
"""Height of walls [mm]: robots cannot look over them."""

UPRIGHT_MM = 50.0
"""Height of robots and cylinders [mm] (epuck-protocol.md 1: 45 to 50 mm)."""

LAMP_MM, LAMP_RADIUS_MM = 60.0, 10.0
"""Height of the middle of a lamp, so that robots pass below it, and its radius [mm]; over a wall it stands on that."""

FLOOR_SHARE, WALL_SHARE = 0.92, 0.72
"""Share of 255 that white floor has in a picture, and white wall, which gets less light from above."""

SIDE_SHARE = 0.45
"""Share of its light that the edge of a round thing lacks."""

ROOM = (118.0, 134.0, 156.0)
"""Colour of the room beyond the walls."""

_FLOOR, _WALL, _ROOM = -1, -2, -3


@allocating
def things_of(scene: Any, robot: Any, tick_count: Any, time_ns: Any) -> Any:
    """Return what a robot may see besides walls and floor.

    Returns:
        Discs as `meet_disc` takes them, float64 [thing, `PER_DISC`]; for each whether it is a sphere, the height of its
        middle, or of its top if it is none [mm], and the row of its colour, float64 [thing, 3].
    """
    walls, lamps = scene.walls, scene.lamps[0]
    tracks, count, seen = other_tracks(scene, 0, robot)
    see_all(walls, tracks, count, moment_of(tick_count, 1.0 * time_ns), seen)
    discs, solids = np.empty((count + lamps.shape[0], PER_DISC)), np.empty((count + lamps.shape[0], 3))
    robot_count, per_cell = scene.robots.shape[1], 1.0 / walls.cell_mm
    for k in range(count):
        disc = disc_of(tracks, k)
        discs[k] = seen[PER_DISC * k : PER_DISC * (k + 1)]
        solids[k, 0], solids[k, 1], solids[k, 2] = 0.0, UPRIGHT_MM, disc
        if disc >= robot_count and scene.bodies[0, disc - robot_count].what == BALL:
            solids[k, 0], solids[k, 1] = 1.0, scene.bodies[0, disc - robot_count].radius_mm
    for number in range(lamps.shape[0]):
        if lamps[number, 3] > 0.0:
            discs[count, 0] = lamps[number, 0] * per_cell + walls.pad
            discs[count, 1] = lamps[number, 1] * per_cell + walls.pad
            discs[count, 2], discs[count, 3] = LAMP_RADIUS_MM * per_cell, 1.0
            is_over_wall = brightness_at(walls, discs[count, 0], discs[count, 1]) > 0
            solids[count, 0], solids[count, 1] = 1.0, WALL_MM + LAMP_RADIUS_MM if is_over_wall else LAMP_MM
            solids[count, 2] = robot_count + scene.bodies.shape[1]
            count += 1
    return discs[:count], solids[:count]


@kernel
def meet_things(discs: Any, eye: Any, ray: Any, cell_mm: Any, hits: Any) -> Any:
    """List the things that the way of a ray over the floor crosses; return their number.

    Each gets its number, the way to its nearest point and to its middle [mm], half the way through it, its radius, and
    its brightness where that is met, or 0 for its colour, float64 [hit, 6].
    """
    count = 0
    for k in range(discs.shape[0]):
        radius = discs[k, 2]
        disc = discs[k, 0], discs[k, 1], radius, discs[k, 3]
        begin, squarely, shade = meet_disc(disc, *eye, *ray, ENDLESS, 0.0, 0.0)
        if begin < ENDLESS:
            half = squarely * radius
            along = (discs[k, 0] - eye[0]) * ray[0] + (discs[k, 1] - eye[1]) * ray[1]
            hits[count, 0], hits[count, 1], hits[count, 2] = k, begin * cell_mm, along * cell_mm
            hits[count, 3], hits[count, 4] = half * cell_mm, radius * cell_mm
            hits[count, 5] = shade if discs[k, 3] < 0.0 else 0.0
            count += 1
    return count


@inlined
def nearest_on(slope: Any, height: Any, wall_mm: Any, hits: Any, count: Any, solids: Any) -> Any:
    """Return what a ray sees that falls from a height by a slope: a hit, or `_WALL`, `_FLOOR`, `_ROOM`.

    And the way to it [mm], and the cosine of the angle at which it meets a round thing.
    """
    met, way, squarely = _ROOM, ENDLESS, 1.0
    if slope > 0.0:
        met, way = _FLOOR, height / slope
    if wall_mm < way and height - slope * wall_mm <= WALL_MM:
        met, way = _WALL, wall_mm
    for k in range(count):
        begin, along, half, radius = hits[k, 1], hits[k, 2], hits[k, 3], hits[k, 4]
        if begin < way:
            its, level = np.int64(hits[k, 0]), solids[np.int64(hits[k, 0]), 1]
            if solids[its, 0] > 0.0:
                steep, past = 1.0 + slope * slope, height - slope * along - level
                square = half * half - past * past / steep
                if square >= 0.0:
                    met, way, squarely = k, begin, math.sqrt(square) / radius
            elif min(height - slope * begin, height - slope * (along + half)) <= level:
                met, way, squarely = k, begin, half / radius
    return met, way, squarely


@entry
def take_picture(
    scene: Any, robot: Any, tick_count: Any, time_ns: Any, colours: Any, left: Any, top: Any, zoom: Any, out: Any
) -> Any:
    """Write what the colour camera of a robot in the first world of a scene sees at a time.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        robot: Index of the robot.
        tick_count: Ticks done.
        time_ns: Time [ns], at most 10 ms before the end of the last tick.
        colours: Of robots, then of balls and cylinders, then of lamps, uint8 [thing, 3].
        left: Column of the sensor that the leftmost pixel shows.
        top: Row of the sensor that the uppermost pixel shows.
        zoom: Steps on the sensor between two pixels.
        out: Red, green and blue, uint8 [row, column, 3].
    """
    scene = open_scene(scene[0])
    walls, floor, state = scene.walls, scene.floor, scene.robots[0, robot]
    parameters, cell_mm = scene.kinds[state.kind], scene.walls.cell_mm
    x, y, heading = pose_at(state, tick_count, time_ns)
    sine, cosine = sin_cos(heading)
    x, y = on_body(x, y, sine, cosine, parameters.eye_ahead_mm, 0.0)
    eye, height = (x / cell_mm + walls.pad, y / cell_mm + walls.pad), parameters.eye_height_mm
    discs, solids = things_of(scene, robot, tick_count, time_ns)
    hits = np.empty((discs.shape[0], 6))
    lamp = colours.shape[0] - 1
    noise = parameters.eye_noise_share
    origin = at_instant(stream_of(scene.seeds[0], 0, robot, STREAM_COLOUR), time_ns)
    for c in range(out.shape[1]):
        u = min(max(0, left + zoom * c), SENSOR_WIDTH - 1)
        right = (u + 0.5 - SENSOR_WIDTH // 2) / parameters.eye_focal_pixels
        stretch = math.sqrt(1.0 + right * right)
        ray = (cosine + right * sine) / stretch, (sine - right * cosine) / stretch
        length, is_met = cast(walls, *eye, *ray, ENDLESS)
        wall = 1.0 * brightness_met(walls, *eye, *ray, length, is_met)
        count = meet_things(discs, eye, ray, cell_mm, hits)
        for r in range(out.shape[0]):
            v = min(max(0, top + zoom * r), SENSOR_HEIGHT - 1)
            slope = (v + 0.5 - SENSOR_HEIGHT // 2) / parameters.eye_focal_pixels / stretch
            met, way, squarely = nearest_on(slope, height, length * cell_mm, hits, count, solids)
            its = np.int64(solids[np.int64(hits[met, 0]), 2]) if met >= 0 else 0
            for part in range(3):
                if met == _ROOM:
                    light = ROOM[part]
                elif met == _WALL:
                    light = WALL_SHARE * wall
                elif met == _FLOOR:
                    j = min(max(0, np.int64(math.floor((y + way * ray[1]) / cell_mm))), floor.shape[0] - 1)
                    i = min(max(0, np.int64(math.floor((x + way * ray[0]) / cell_mm))), floor.shape[1] - 1)
                    light = FLOOR_SHARE * floor[j, i]
                elif its == lamp:
                    light = 1.0 * colours[lamp, part]
                else:
                    plain = 1.0 * colours[its, part] if hits[met, 5] == 0.0 else hits[met, 5]
                    light = plain * (1.0 - SIDE_SHARE * (1.0 - squarely))
                chance = draw(origin, 3 * (SENSOR_WIDTH * v + u) + part) if parameters.is_noisy != 0 else 0.5
                out[r, c, part] = np.uint8(math.floor((1.0 - noise) * light + noise * 255.0 * chance + 0.5))
