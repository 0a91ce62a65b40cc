"""A ray from the middle of a robot: how far it goes and what it meets, for turrets that range, aim or shoot."""

from __future__ import annotations

from typing import Any

import numpy as np

from kiks.engine.compiling import entry
from kiks.engine.numbers import sin_cos, uniform
from kiks.engine.scene import moment_of
from kiks.engine.sensing.disc_rays import ALL_AROUND, PER_DISC, disc_of, everybody_else, meet_disc, see
from kiks.engine.sensing.proximity import pose_at
from kiks.engine.sensing.rays import cast, scale

_ANYWHERE_MM = 1e6

WALL = -1
"""What a ray met that met no disc."""


@entry
def probe(scene: Any, sight: Any, tick_count: Any, time_ns: Any, robot: Any, angle: Any) -> Any:
    """Follow a ray from the centre of a robot.

    Args:
        scene: What there is (`kiks.engine.scene`).
        sight: What rays meet of the arena (`kiks.engine.sensing.rays`).
        tick_count: Ticks done.
        time_ns: When, at most 10 ms before the end of the last tick.
        robot: Index of the robot.
        angle: Direction, counter-clockwise from where the robot looks [rad].

    Returns:
        Length of the ray [mm]; the disc that it met, `WALL` for none; the brightness of what it met.
    """
    x, y, heading = pose_at(scene[0][0, robot], tick_count, time_ns)
    sine, cosine = sin_cos(heading + angle)
    cell, pad = scale(sight)
    column, row = x / cell + pad, y / cell + pad
    length, brightness = cast(sight, column, row, cosine, sine, _ANYWHERE_MM / cell)
    met = WALL
    tracks, count, seen = everybody_else(scene, 0, robot)
    see(tracks, count, moment_of(tick_count, time_ns), (cell, pad), ALL_AROUND, seen)
    for k in range(count):
        way, _, shade = meet_disc(seen[PER_DISC * k :], 1, column, row, cosine, sine, length)
        if shade > 0.0:
            length, brightness, met = way, np.int64(shade), disc_of(tracks, k)
    return length * cell, met, brightness


@entry
def turn_to(angle: Any) -> Any:
    """Return sine and cosine of an angle [rad], the same bits on every machine, for Python."""
    return sin_cos(angle)


@entry
def chance(seed: Any, robot: Any, stream: Any, time_ns: Any, index: Any) -> Any:
    """Return a random number in [0, 1) of a robot, a stream and a time, for Python."""
    return uniform(seed, 0, robot, stream, time_ns, index)
