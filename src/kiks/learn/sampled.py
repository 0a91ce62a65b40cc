"""Sensors that read tables of samples, as Miglino, Lund and Nolfi (1995) simulated them, in place of light along rays.

A table holds the readings of a robot that is turned on the spot at several gaps from one object. A robot in a box with
round obstacles then reads the sum of what the table says of each wall and each obstacle, cut at the largest count. Here
the tables are sampled from KiKS's own sensors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.control.senses import Sense, sense
from kiks.engine.compiling import kernel
from kiks.engine.numbers import at_instant, draw, sin_cos, stream_of
from kiks.model.arena import Arena
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_choice, check_number
from kiks.model.robot import SENSOR_COUNT, RobotSpec
from kiks.model.walls import Wall
from kiks.sim.simulation import Simulation

NOISES = ("none", "uniform", "conservative")
"""Kinds of noise: none; of each reading; as if each object stood a little elsewhere."""

ANGLES, GAPS, FIRST_MM, STEP_MM = 180, 20, 5.0, 2.0
"""Headings, 2 degrees apart, and gaps of a table, and the first gap and the step from one to the next [mm]."""

UNIFORM_COUNTS, SHIFT_STEPS = 51.0, 2.0
"""Most that uniform noise adds [counts], and how far conservative noise shifts gap and heading at most [steps]."""

FULL_COUNTS, STREAM_SAMPLED = 1023.0, 1995
"""The largest count, and the random stream of the noise."""

_ROOM_MM = 400.0


@cache
def sampled_table(radius_mm: float) -> NDArray[np.float64]:
    """Return what a Khepera reads beside a round obstacle, or beside a straight wall if the radius is infinite.

    Returns:
        Expected counts, float64 [gap, angle, sensor]; angles are the direction to the object less the robot's heading,
        counter-clockwise.

    Example:
        >>> sampled_table(math.inf).shape
        (20, 180, 8)
    """
    spec = RobotSpec.load("khepera")
    edge_mm = _ROOM_MM - 10.0
    arena = Arena.box(int(_ROOM_MM), int(_ROOM_MM))
    if math.isfinite(radius_mm):
        edge_mm = 0.5 * _ROOM_MM
        disc = Wall(disc_mm=(edge_mm + radius_mm, 0.5 * _ROOM_MM), radius_mm=radius_mm)
        arena = replace(arena, walls=(disc,))
    sim = Simulation(arena, robot=spec.without_noise(), seed=0)
    table = np.zeros((GAPS, ANGLES, SENSOR_COUNT))
    for gap in range(GAPS):
        x_mm = edge_mm - spec.body.radius_mm - FIRST_MM - STEP_MM * gap
        for angle in range(ANGLES):
            sim.place(1, x_mm, 0.5 * _ROOM_MM, -math.radians(angle * 360.0 / ANGLES))
            table[gap, angle] = sim.proximity(1, noise=False)
    table.setflags(write=False)
    return table


@kernel
def rough_angle(y: Any, x: Any) -> Any:
    """Return the angle of a direction within +-pi, within 0.004 [rad]: by additions and multiplications alone."""
    across, up = abs(x), abs(y)
    most = max(across, up)
    if most == 0.0:
        return 0.0
    share = min(across, up) / most
    angle = share * (0.7853981633974483 + 0.273 * (1.0 - share))
    angle = angle if up <= across else 1.5707963267948966 - angle
    angle = angle if x >= 0.0 else 3.141592653589793 - angle
    return angle if y >= 0.0 else -angle


def sampled_proximity(
    arena: Arena, obstacles: Sequence[tuple[float, float]], radius_mm: float, noise: str = "none", wall_mm: float = 10.0
) -> Sense:
    """Return a sense of a Khepera that reads tables in place of rays, in a box with round obstacles of one size.

    It stands for proximity in a batch. On a line the command reads the robot's own sensors, so that a controller that
    has evolved with it drives there as it is; saved in a file, it has the sense 'proximity' in its place.

    Args:
        arena: The box.
        obstacles: Places of the obstacles [mm].
        radius_mm: Their radius [mm].
        noise: One of `NOISES`.
        wall_mm: Thickness of the wall around the box [mm].

    Example:
        >>> sampled_proximity(Arena.box(600, 350), [(300.0, 175.0)], 27.0)
        <Sense 'sampled': N>
    """
    check_choice("noise", noise, NOISES, f"one of {', '.join(NOISES)}")
    radius_mm = check_number("radius_mm", radius_mm, 1, 0.25 * _ROOM_MM)
    discs = check_numbers("obstacles", obstacles, (None, 2)) if len(obstacles) else np.zeros((0, 2))
    of_wall, of_disc = sampled_table(math.inf), sampled_table(radius_mm)
    disc_count = len(discs)
    right_mm, upper_mm = arena.width_mm - wall_mm, arena.height_mm - wall_mm
    body_mm = RobotSpec.load("khepera").body.radius_mm
    is_uniform, shift = noise == "uniform", SHIFT_STEPS if noise == "conservative" else 0.0
    angle_steps = ANGLES / (2.0 * math.pi)

    def sampled(view: Any, readings: Any) -> None:
        noise_share = 1.0 if view.is_noisy else 0.0
        instant = at_instant(stream_of(view.scene.seeds[view.world], 0, view.robot, STREAM_SAMPLED), view.time_ns)
        sine, cosine = sin_cos(view.heading_rad)
        for k in range(SENSOR_COUNT):
            readings[k] = 0.0
        for thing in range(4 + disc_count):
            x_mm, y_mm, inside_mm = 0.0, 0.0, 0.0  # from the robot to the nearest point, or to the middle of a disc
            if thing == 0:
                x_mm = wall_mm - view.x_mm
            elif thing == 1:
                x_mm = right_mm - view.x_mm
            elif thing == 2:
                y_mm = wall_mm - view.y_mm
            elif thing == 3:
                y_mm = upper_mm - view.y_mm
            else:
                x_mm, y_mm = discs[thing - 4, 0] - view.x_mm, discs[thing - 4, 1] - view.y_mm
                inside_mm = radius_mm
            gap_mm = np.sqrt(x_mm * x_mm + y_mm * y_mm) - inside_mm - body_mm
            row = (gap_mm - FIRST_MM) / STEP_MM + noise_share * shift * (2.0 * draw(instant, 20 + 2 * thing) - 1.0)
            if row > GAPS - 0.5:
                continue
            turned = rough_angle(cosine * y_mm - sine * x_mm, cosine * x_mm + sine * y_mm) * angle_steps
            turned += noise_share * shift * (2.0 * draw(instant, 21 + 2 * thing) - 1.0)
            column = int(np.floor(turned + 0.5)) % ANGLES
            gap = min(max(int(np.floor(row + 0.5)), 0), GAPS - 1)
            for k in range(SENSOR_COUNT):
                readings[k] += of_wall[gap, column, k] if thing < 4 else of_disc[gap, column, k]
        for k in range(SENSOR_COUNT):
            count = min(readings[k], FULL_COUNTS)
            if is_uniform:
                count += noise_share * UNIFORM_COUNTS * (2.0 * draw(instant, k) - 1.0)
            readings[k] = np.floor(min(max(count, 0.0), FULL_COUNTS) + 0.5)

    made: Sense = sense(command="N", readings=SENSOR_COUNT, most=FULL_COUNTS)(sampled)
    made.recipe = "proximity"  # what reads the same command stands for it in files
    return made
