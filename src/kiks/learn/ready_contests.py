"""The contests that come with KiKS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kiks.batch.loop_timing import Timing
from kiks.control import controllers, measures
from kiks.learn import football as game
from kiks.learn.contest import Contest, Side
from kiks.model.arena import Arena

Floats = NDArray[np.float64]
Values = Mapping[str, Floats]

PURSUIT_MM = 470
"""Side of the arena of `pursuit` [mm] (Floreano and Nolfi 1997)."""

PREDATOR_SPEED, PREY_SPEED = 10.0, 20.0
"""Highest speeds [pulses/10 ms], 80 and 160 mm/s: the prey is twice as fast (Floreano and Nolfi 1997)."""

CAMERA_BAUD = 38400
"""Speed of the lines [bit/s]: at 9600 a loop with a picture of the camera would take longer than 0.1 s."""

PLAYER_SPEED = 20.0
"""Highest speed of a football player [pulses/10 ms], 160 mm/s."""

CAUGHT_MM = 57.0
"""Distance of the middles at which the prey is caught [mm]: two Kheperas of 55 mm, and 2 mm between them."""

PURSUIT_APART_MM = 100.0
"""Least gap between predator and prey at the start [mm], beyond the range of the proximity sensors."""


def predator_fitness(values: Values) -> Floats:
    """Return the share of the time that is left after the prey was caught."""
    return 1.0 - prey_fitness(values)


def prey_fitness(values: Values) -> Floats:
    """Return the share of the time for which the prey was not caught."""
    escaped: Floats = values["escaped_share"].mean(axis=1)
    return escaped


def pursuit(**changes: Any) -> Contest:
    """Return the contest of a predator and a prey that is twice as fast (Floreano and Nolfi 1997).

    Both have proximity sensors, the predator has the camera K213, too. The prey's fitness is the share of the time for
    which it was not caught, the predator's is the rest. What the robots do after the first contact does not count.

    Args:
        changes: Other arguments of `kiks.Contest`.
    """
    predator = controllers.mlp(hidden=(), senses=("proximity", "camera"), feedback=True, speed_limit=PREDATOR_SPEED)
    prey = controllers.mlp(hidden=(), feedback=True, speed_limit=PREY_SPEED)
    contest = Contest(
        "pursuit",
        (Side("predator", predator, predator_fitness), Side("prey", prey, prey_fitness)),
        (Arena.box(PURSUIT_MM, PURSUIT_MM),),
        (measures.escaped_share(radius_mm=CAUGHT_MM), measures.path_mm, measures.contacts),
        seconds=25.0,
        apart_mm=PURSUIT_APART_MM,
        timing=Timing(baud=CAMERA_BAUD),
        about="predator and prey, which evolve against each other",
    )
    return contest.with_changes(**changes)


def football_fitness(values: Values) -> Floats:
    """Return the mean of goals and of the ball's place, from -1 to 1; 0 if no robot touches the ball."""
    scores: Floats = (values["goals"] + values["ball_ahead"]).mean(axis=1) / 2.0
    return scores


def football(**changes: Any) -> Contest:
    """Return the contest of two football players on the pitch of `kiks demo soccer`.

    Both have proximity sensors and the camera K213. Half of the fitness are goals, 1 for one of its own and -1 for one
    of the other side; half is the mean place of the ball, from 1 at the goal line of the other side to -1 at its own.
    What one side gains, the other loses. A game ends with the first goal.

    Args:
        changes: Other arguments of `kiks.Contest`.
    """
    player = controllers.mlp(hidden=(), senses=("proximity", "camera"), feedback=True, speed_limit=PLAYER_SPEED)
    arenas = game.kick_offs()
    contest = Contest(
        "football",
        (Side("left", player, football_fitness), Side("right", player, football_fitness)),
        arenas,
        (game.goals, game.ball_ahead, measures.path_mm),
        seconds=15.0,
        worlds=len(arenas),
        timing=Timing(baud=CAMERA_BAUD),
        starts="arena",
        population=50,
        about="two football players, which evolve against each other",
    )
    return contest.with_changes(**changes)


CONTESTS: dict[str, Callable[..., Contest]] = {"pursuit": pursuit, "football": football}
"""The contests that come with KiKS."""
