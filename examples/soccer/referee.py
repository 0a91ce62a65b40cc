"""The referee of a soccer match sees everything.

It counts the goals, and after each goal drops the ball near the middle mark; it does the same when the ball has not
moved for long. It never moves a robot and tells the players nothing: a player notices that the ball is gone, as a real
one would.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from kiks import ParameterError, Simulation
from kiks.engine.scalar_math import uniform
from kiks.model import pitch

LOOK_S = 0.1
"""Simulated time between two looks of the referee [s]: a ball moves 30 mm at most."""

STILL_MM, STILL_S = 40.0, 10.0
"""The referee drops a ball that has come no farther than this distance in this time."""

DROP_MM = 40.0, 120.0
"""Largest distance from the middle mark at which the ball drops, along the pitch and across it [mm]."""

ATTEMPTS = 100
"""Places tried for a drop."""

STREAM_REFEREE = 101
"""Random stream of these places."""


def supervise(sim: Simulation) -> Iterator[float]:
    """Watch the match, print the goals, and at the end the score."""
    score, drop_count = {"left": 0, "right": 0}, 0
    show(sim, score)
    rest, rest_s = drop(sim), 0.0
    try:
        while True:
            yield LOOK_S
            ball = sim.bodies()[0]
            place = float(ball["x_mm"]), float(ball["y_mm"])
            goal = pitch.goal_at(place[0], float(ball["radius_mm"]))
            if goal:
                side = "left" if goal == 1 else "right"
                score[side] += 1
                show(sim, score)
                print(f"{sim.time_s:6.1f} s   {score['left']}:{score['right']}   {side}")
                rest, rest_s = drop(sim), sim.time_s
            elif math.dist(place, rest) > STILL_MM:
                rest, rest_s = place, sim.time_s
            elif sim.time_s - rest_s > STILL_S:
                drop_count += 1
                rest, rest_s = drop(sim), sim.time_s
    finally:
        print(f"left {score['left']}, right {score['right']}, {drop_count} dropped balls")


def show(sim: Simulation, score: dict[str, int]) -> None:
    """Show the score on the desk: robot 1 plays on the left."""
    for robot, goals in enumerate(score.values(), 1):
        sim.set_score(robot, goals)


def drop(sim: Simulation) -> tuple[float, float]:
    """Drop the ball near the middle mark, a little to one side, and not onto a robot; return its place."""
    for attempt in range(ATTEMPTS):
        x_share, y_share = (uniform(sim.seed, 0, 0, STREAM_REFEREE, sim.now_ns + attempt, axis) for axis in (0, 1))
        x_mm = pitch.MIDDLE_X_MM + DROP_MM[0] * (2.0 * x_share - 1.0)
        y_mm = pitch.MIDDLE_Y_MM + DROP_MM[1] * (2.0 * y_share - 1.0)
        try:
            sim.move_body(sim.bodies()[0]["number"], x_mm, y_mm)
        except ParameterError:
            continue  # a robot stands there
        return x_mm, y_mm
    return pitch.MIDDLE_X_MM, pitch.MIDDLE_Y_MM
