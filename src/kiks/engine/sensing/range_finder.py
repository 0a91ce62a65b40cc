"""A ray from the centre of a robot: its length and its hit, for turrets that measure distance, aim or shoot."""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry
from kiks.engine.numbers import sin_cos
from kiks.engine.physics.motion import moment_of
from kiks.engine.scene import open_scene
from kiks.engine.sensing.disc_rays import PER_DISC, disc_of, meet_discs, other_tracks, see_all
from kiks.engine.sensing.observe import WALL
from kiks.engine.sensing.proximity import pose_at
from kiks.engine.sensing.rays import brightness_met, cast

_ANYWHERE_MM = 1e6


@entry
def probe(scene: Any, robot: Any, tick_count: Any, time_ns: Any, angle: Any) -> Any:
    """Follow a ray from the centre of a robot.

    Args:
        scene: The scene (`kiks.engine.scene.Scene.record`).
        robot: Index of the robot.
        tick_count: Ticks done.
        time_ns: Time [ns], at most 10 ms before the end of the last tick.
        angle: Direction, counter-clockwise from the heading [rad].

    Returns:
        Length of the ray [mm]; the disc that it hit, `WALL` for none; the brightness there.
    """
    scene = open_scene(scene[0])
    walls = scene.walls
    x, y, heading = pose_at(scene.robots[0, robot], tick_count, time_ns)
    sine, cosine = sin_cos(heading + angle)
    cell, pad = walls.cell_mm, walls.pad
    column, row = x / cell + pad, y / cell + pad
    length, is_met = cast(walls, column, row, cosine, sine, _ANYWHERE_MM / cell)
    brightness = brightness_met(walls, column, row, cosine, sine, length, is_met)
    met = WALL
    tracks, count, seen = other_tracks(scene, 0, robot)
    see_all(walls, tracks, count, moment_of(tick_count, 1.0 * time_ns), seen)
    for k in range(count):
        # One by one, for the result names the disc.
        way, _, shade = meet_discs(seen[PER_DISC * k :], 1, column, row, cosine, sine, length, 1.0, 0.0)
        if shade > 0.0:
            length, brightness, met = way, np.int64(shade), disc_of(tracks, k)
    return length * cell, met, brightness
