"""The task to avoid obstacles with sensors of more or less noise (Jakobi, Husbands and Harvey 1995).

Example:
    >>> import kiks
    >>> task = kiks.tasks.jakobi_husbands_harvey_1995(noise=2.0)  # or (robot="khepera_ii")
    >>> task.worlds, task.robot.proximity.noise_large
    (2, 0.2)
"""

from dataclasses import replace

import numpy as np

import kiks
from kiks.measures import roaming_share, share_of_full
from kiks.model.walls import Wall

PILLARS_MM, RADIUS_MM = ((150, 160), (360, 140), (140, 360), (370, 370)), 40  # where the pillars stand is our own
PILLARS = tuple(Wall(disc_mm=place, radius_mm=RADIUS_MM) for place in PILLARS_MM)
ROOM = replace(kiks.Arena.box(520, 520), name="pillars of 1995", walls=PILLARS)


def progress_straight(notes):
    """Return V (1 - sqrt(D)) of the notes of `exploration`."""
    steps = np.maximum(notes[..., 1], 1.0)
    return notes[..., 0] / steps * (1.0 - np.sqrt(np.abs(notes[..., 4]) / steps))


@kiks.measure(notes=5, result=progress_straight)
def exploration(moment, notes):
    """V (1 - sqrt(D)): how fast it gets about, and does not turn to one side.

    V is how fast it gets away from where it was two seconds ago, as in `roaming`; D half of how much the speeds of the
    wheels differ, with its sign, on average over the trial.
    """
    notes[0] += roaming_share(moment, notes)
    notes[1] += 1.0
    notes[4] += 0.5 * (share_of_full(moment.wheels[0]) - share_of_full(moment.wheels[1]))


def with_noise(spec, factor):
    """Return a robot whose proximity sensors have so many times their noise, up to 99 %."""
    noise = spec.proximity
    return spec.with_changes(
        proximity__noise_small=min(factor * noise.noise_small, 0.99),
        proximity__noise_large=min(factor * noise.noise_large, 0.99),
        proximity__jitter_counts=tuple(factor * each for each in noise.jitter_counts),
    )


def fitness(values):
    """Return the mean of the first measure over all worlds."""
    return next(iter(values.values())).mean(axis=1)


def jakobi_husbands_harvey_1995(noise: float = 1.0, robot: str | kiks.RobotSpec = "khepera") -> kiks.Task:
    """Return the task, in a room of 50 cm with four pillars.

    Args:
        noise: What the noise of the proximity sensors is multiplied by.
        robot: Kind of robot, whose noise is multiplied.
    """
    if not 0 <= noise <= 100:
        raise kiks.ParameterError(f"noise must be from 0 to 100, but it was {noise:g}.")
    spec = kiks.RobotSpec.load(robot) if isinstance(robot, str) else robot
    return kiks.Task(
        f"jakobi_husbands_harvey_1995_{noise:g}",
        [ROOM],
        kiks.controllers.ctrnn(neurons=6),
        [exploration, kiks.measures.roaming, kiks.measures.contacts, kiks.measures.path_mm],
        fitness=fitness,
        robot=with_noise(spec, noise),
        seconds=20.0,
        worlds=2,
        algorithm="ga",
        generations=16,
        population=64,
        spread=1.0,
    )


task = jakobi_husbands_harvey_1995()
