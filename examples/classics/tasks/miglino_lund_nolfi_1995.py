"""The task to navigate among round obstacles, with sensors from tables or whole ones (Miglino, Lund, Nolfi 1995).

A table holds the readings of a robot that is turned on the spot at several gaps from one object. A robot in a box with
round obstacles then reads the sum of what the table says of each wall and each obstacle, cut at the largest count. Here
the tables are sampled from KiKS's own sensors, in place of light along rays.

Example:
    >>> import kiks
    >>> kiks.tasks.miglino_lund_nolfi_1995(sampled="uniform").controller  # or "none", "conservative"
    <Controller 'mlp': sampled; 22 parameters>
"""

import math
from dataclasses import replace
from functools import cache
from typing import Literal

import numpy as np

import kiks
from kiks.controllers import kernel
from kiks.engine.numbers import at_instant, draw, sin_cos, stream_of
from kiks.measures import clear_share, mean, roaming_share, straight_share
from kiks.model.walls import Wall

WALL_MM, WIDTH_MM, HEIGHT_MM = 10.0, 620, 370  # the box, of 60 x 35 cm inside
DISCS_MM, RADIUS_MM = ((190.0, 130.0), (430.0, 110.0), (330.0, 250.0)), 27.0  # the places of the obstacles are our own
DISCS = np.array(DISCS_MM)
BOX = replace(
    kiks.Arena.box(WIDTH_MM, HEIGHT_MM),
    name="obstacles of 1995",
    walls=tuple(Wall(disc_mm=place, radius_mm=RADIUS_MM) for place in DISCS_MM),
)

NOISES = ("none", "uniform", "conservative")  # none; of each reading; as if each object stood a little elsewhere

# Headings, 2 degrees apart, and gaps of a table, and the first gap and the step from one to the next [mm].
ANGLES, GAPS, FIRST_MM, STEP_MM = 180, 20, 5.0, 2.0

# Most that uniform noise adds [counts], and how far conservative noise shifts gap and heading at most [steps].
UNIFORM_COUNTS, SHIFT_STEPS = 51.0, 2.0

SENSORS, FULL_COUNTS, STREAM = 8, 1023.0, 1995  # the stream is that of the random numbers of the noise
ROOM_MM = 400  # side of the room in which tables are sampled


@kiks.measure(notes=4, result=mean)
def navigation_seen(moment, notes):
    """As `navigation_gained` (1994), for controllers whose first sense stands for proximity."""
    notes[0] += roaming_share(moment, notes) * (straight_share(moment) * clear_share(moment))
    notes[1] += 1.0


def fitness(values):
    """Return the mean of the first measure over all worlds."""
    return next(iter(values.values())).mean(axis=1)


@cache
def sampled_table(radius_mm):
    """Return what a Khepera reads beside a round obstacle, or beside a straight wall if the radius is infinite.

    They are expected counts, float64 [gap, angle, sensor]; angles are the direction to the object less the robot's
    heading, counter-clockwise.
    """
    spec, edge_mm = kiks.RobotSpec.load("khepera"), ROOM_MM - WALL_MM
    arena = kiks.Arena.box(ROOM_MM, ROOM_MM)
    if math.isfinite(radius_mm):
        edge_mm = 0.5 * ROOM_MM
        arena = replace(arena, walls=(Wall(disc_mm=(edge_mm + radius_mm, 0.5 * ROOM_MM), radius_mm=radius_mm),))
    sim = kiks.Simulation(arena, robot=spec.without_noise(), seed=0)
    table = np.zeros((GAPS, ANGLES, SENSORS))
    for gap in range(GAPS):
        x_mm = edge_mm - spec.body.radius_mm - FIRST_MM - STEP_MM * gap
        for angle in range(ANGLES):
            sim.place(1, x_mm, 0.5 * ROOM_MM, -math.radians(angle * 360.0 / ANGLES))
            table[gap, angle] = sim.proximity(1, noise=False)
    return table


@kernel
def rough_angle(y, x):
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


@cache
def sampled_sense(noise):
    """Return a sense of a Khepera in the box that reads tables in place of rays, with one of `NOISES`.

    It stands for proximity in a batch. On a line the command reads the robot's own sensors, so a controller that has
    evolved with it drives there as it is; saved in a file, it has the sense 'proximity' in its place.
    """
    of_wall, of_disc, disc_count = sampled_table(math.inf), sampled_table(RADIUS_MM), len(DISCS)
    right_mm, upper_mm = WIDTH_MM - WALL_MM, HEIGHT_MM - WALL_MM
    body_mm = kiks.RobotSpec.load("khepera").body.radius_mm
    is_uniform, shift = noise == "uniform", SHIFT_STEPS if noise == "conservative" else 0.0
    angle_steps = ANGLES / (2.0 * math.pi)

    def sampled(view, readings):
        noise_share = 1.0 if view.is_noisy else 0.0
        instant = at_instant(stream_of(view.scene.seeds[view.world], 0, view.robot, STREAM), view.time_ns)
        sine, cosine = sin_cos(view.heading_rad)
        for k in range(SENSORS):
            readings[k] = 0.0
        for thing in range(4 + disc_count):
            x_mm, y_mm, inside_mm = 0.0, 0.0, 0.0  # from the robot to the nearest point, or to the middle of a disc
            if thing == 0:
                x_mm = WALL_MM - view.x_mm
            elif thing == 1:
                x_mm = right_mm - view.x_mm
            elif thing == 2:
                y_mm = WALL_MM - view.y_mm
            elif thing == 3:
                y_mm = upper_mm - view.y_mm
            else:
                x_mm, y_mm = DISCS[thing - 4, 0] - view.x_mm, DISCS[thing - 4, 1] - view.y_mm
                inside_mm = RADIUS_MM
            gap_mm = np.sqrt(x_mm * x_mm + y_mm * y_mm) - inside_mm - body_mm
            row = (gap_mm - FIRST_MM) / STEP_MM + noise_share * shift * (2.0 * draw(instant, 20 + 2 * thing) - 1.0)
            if row > GAPS - 0.5:
                continue
            turned = rough_angle(cosine * y_mm - sine * x_mm, cosine * x_mm + sine * y_mm) * angle_steps
            turned += noise_share * shift * (2.0 * draw(instant, 21 + 2 * thing) - 1.0)
            column = int(np.floor(turned + 0.5)) % ANGLES
            gap = min(max(int(np.floor(row + 0.5)), 0), GAPS - 1)
            for k in range(SENSORS):
                readings[k] += of_wall[gap, column, k] if thing < 4 else of_disc[gap, column, k]
        for k in range(SENSORS):
            count = min(readings[k], FULL_COUNTS)
            if is_uniform:
                count += noise_share * UNIFORM_COUNTS * (2.0 * draw(instant, k) - 1.0)
            readings[k] = np.floor(min(max(count, 0.0), FULL_COUNTS) + 0.5)

    made = kiks.sense(command="N", readings=SENSORS, most=FULL_COUNTS)(sampled)
    made.recipe = "proximity"  # what reads the same command stands for it in files
    return made


def miglino_lund_nolfi_1995(sampled: Literal["", "none", "uniform", "conservative"] = "") -> kiks.Task:
    """Return the task.

    Args:
        sampled: One of `NOISES`, the noise of sensors that read tables of samples; left out, the sensors of KiKS as
            they are.
    """
    seen = sampled_sense(sampled) if sampled else "proximity"
    return kiks.Task(
        "miglino_lund_nolfi_1995" + (f"_{sampled}" if sampled else ""),
        [BOX],
        kiks.controllers.mlp(hidden=(), feedback=True, senses=(seen,)),
        [navigation_seen, kiks.measures.roaming, kiks.measures.contacts, kiks.measures.path_mm],
        fitness=fitness,
        seconds=24.0,
        algorithm="sga:bits=8,limit=5,parents=0.2,crossover=0,mutation=0.01",
        generations=200,
        population=100,
    )


task = miglino_lund_nolfi_1995()
