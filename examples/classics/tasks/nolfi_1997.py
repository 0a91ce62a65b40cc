"""The task to carry five cylinders out of an arena with the gripper (Nolfi 1996, 1997).

A robot that opens its jaws while the cylinder is beyond the edge of the arena has dropped it outside.

Example:
    >>> import kiks
    >>> kiks.tasks.nolfi_1997().parameter_count  # or (architecture="elman"), see kiks.controllers.collector
    128
"""

import math
from dataclasses import replace

import numpy as np

import kiks
from kiks.engine.numbers import sin_cos
from kiks.measures import count_out
from kiks.model.arena import Cylinder

CYLINDERS = 5  # of the arena
SEEN_SHARE, HELD_SHARE = 0.1, 0.4  # what facing and holding a cylinder count beside one that is outside: our own guess

# Steps before a cylinder that count fully, and where it then is: ahead from, to, and aside at most [mm].
FACED_STEPS, FACED_MM, ASIDE_MM = 20.0, (27.5, 65.0), 15.0


@kiks.measure(notes=4)
def collecting(moment, notes):
    """Cylinders outside; and since the last one, whether another was held, and for how long one was between the jaws.

    A cylinder that is picked up and put down again counts as held once.
    """
    out = count_out(moment.bodies)
    if out > notes[1]:
        notes[1], notes[2], notes[3] = out, 0.0, 0.0
    sine, cosine = sin_cos(moment.heading_rad)
    for row in range(moment.bodies.shape[0]):
        body = moment.bodies[row]
        if body.holder == moment.robot + 1:
            notes[2] = 1.0
        elif body.is_lifted == 0:
            dx, dy = body.x_mm - moment.x_mm, body.y_mm - moment.y_mm
            ahead, aside = dx * cosine + dy * sine, abs(dy * cosine - dx * sine)
            if FACED_MM[0] < ahead < FACED_MM[1] and aside < ASIDE_MM:
                notes[3] = min(notes[3] + 1.0 / FACED_STEPS, 1.0)
    notes[0] = max(notes[0], out + HELD_SHARE * notes[2] + SEEN_SHARE * max(notes[2], notes[3]))


@kiks.measure(notes=2)
def picked_up(moment, notes):
    """Number of times that the robot has gripped a cylinder."""
    is_held = 0.0
    for row in range(moment.bodies.shape[0]):
        is_held = max(is_held, 1.0 * (moment.bodies[row].holder == moment.robot + 1))
    notes[0] += max(is_held - notes[1], 0.0)
    notes[1] = is_held


def fitness(values):
    """Return the mean of the first measure over all worlds."""
    return next(iter(values.values())).mean(axis=1)


def arenas(count, seed):
    """Return arenas of 60 x 35 cm with five cylinders at random places, clear of each other and of the walls."""
    rng, made = np.random.default_rng(seed), []
    for number in range(count):
        places = []
        while len(places) < CYLINDERS:
            x_mm, y_mm = rng.uniform((62.0, 62.0), (542.0, 292.0)).tolist()
            if all(math.hypot(x_mm - x, y_mm - y) > 75.0 for x, y in places):
                places.append((x_mm, y_mm))
        cylinders = tuple(Cylinder(x, y, radius_mm=11.5) for x, y in places)
        box = kiks.Arena.box(604, 354, wall_mm=2)
        made.append(replace(box, name=f"collecting {number + 1}", cylinders=cylinders))
    return made


def nolfi_1997(architecture: str = "emergent") -> kiks.Task:
    """Return the task.

    Args:
        architecture: Of `kiks.controllers.collector`: 'feed_forward', 'hidden', 'elman', 'designed' or 'emergent'.
    """
    taken_out = kiks.measures.taken_out
    exam = kiks.Exam(
        arenas(10, seed=2), [taken_out], f"taken_out >= {CYLINDERS}", "carried all cylinders out", seconds=120.0
    )
    return kiks.Task(
        f"nolfi_1997_{architecture}",
        arenas(60, seed=1),
        kiks.controllers.collector(architecture=architecture),
        [collecting, taken_out, picked_up, kiks.measures.contacts],
        fitness=fitness,
        seconds=20.0,
        worlds=4,
        timing=kiks.Timing(period_s=0.1, baud=38_400),
        generations=60,
        population=32,
        exam=exam,
    )


task = nolfi_1997()
