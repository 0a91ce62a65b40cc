"""The task to navigate in a looping corridor (Floreano and Mondada 1994).

Example:
    >>> import kiks
    >>> task = kiks.tasks.floreano_mondada_1994()  # or (shuttling=True), see there
    >>> task.parameter_count, task.timings[0].period_s, task.seconds
    (22, 0.3, 24.0)
"""

import math

import kiks
from kiks.measures import clear_share, mean, roaming_share, straight_share, wheels_share

HALF_UNIT_SPREAD = 0.5 / math.sqrt(3.0)  # the deviation of genes that are spread evenly over +-0.5


@kiks.measure(notes=2, result=mean, senses=("proximity",))
def navigation(moment, notes):
    """Mean of V (1 - sqrt(dv)) (1 - i): fast, straight, and far from everything, whichever side leads.

    V is the mean of both wheels' speeds without their signs, dv half of how much they differ with their signs, i the
    highest proximity: each from 0 to 1. The measure `avoidance` differs: there driving back earns nothing.
    """
    notes[0] += wheels_share(moment) * (straight_share(moment) * clear_share(moment))
    notes[1] += 1.0


@kiks.measure(notes=4, result=mean, senses=("proximity",))
def navigation_gained(moment, notes):
    """The same with another V: the speed at which it gets away from where it was two seconds ago, as in `roaming`."""
    notes[0] += roaming_share(moment, notes) * (straight_share(moment) * clear_share(moment))
    notes[1] += 1.0


def fitness(values):
    """Return the mean of the first measure over all worlds."""
    return next(iter(values.values())).mean(axis=1)


def floreano_mondada_1994(shuttling: bool = False) -> kiks.Task:
    """Return the task.

    Args:
        shuttling: Whether V counts the speeds of the wheels without their signs, as the paper has it. A robot that
            shuttles on the spot then earns the most. Left out, V is how fast it gets away from where it was two seconds
            ago.
    """
    counted = navigation if shuttling else navigation_gained
    return kiks.Task(
        "floreano_mondada_1994" + ("_shuttling" if shuttling else ""),
        [kiks.Arena.load("classics/floreano_mondada_1994")],
        kiks.controllers.mlp(hidden=(), feedback=True),
        [
            counted,
            kiks.measures.speed_pulses,
            kiks.measures.roaming,
            kiks.measures.contacts,
            kiks.measures.path_mm,
        ],
        fitness=fitness,
        seconds=24.0,
        timing=kiks.Timing(period_s=0.3),
        spread=HALF_UNIT_SPREAD,
        algorithm="sga:bits=0,selection=roulette,crossover=0.1,mutation=0.2",
        generations=100,
        population=80,
    )


task = floreano_mondada_1994()
