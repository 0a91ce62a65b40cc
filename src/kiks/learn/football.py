"""Football of two sides on the pitch of `kiks demo soccer`: kick-offs, and what counts.

The first half of the robots of a world attacks the goal on the right, the others that on the left. A game ends with the
first goal: what comes after it does not count.
"""

from __future__ import annotations

from typing import Any

from kiks.control.measure import measure
from kiks.control.measures import mean
from kiks.engine.compiling import kernel
from kiks.model import pitch
from kiks.model.arena import Arena, Ball

HALF_MM = (pitch.RIGHT_LINE_MM - pitch.LEFT_LINE_MM) / 2
"""Distance of a goal line from the middle [mm]."""

KICK_OFF_MM = 120.0
"""How far to a side the ball may lie at the kick-off [mm]; the referee of the demonstration drops it within that."""

GOAL_REWARD = 10.0
"""Reward of a goal: twice that of bringing the ball from the middle to the goal line."""

goal_at = kernel(pitch.goal_at)


def kick_offs() -> tuple[Arena, ...]:
    """Return the pitch with the players on their marks and the ball in the middle, to its right, and to its left."""
    return tuple(
        pitch.arena(
            balls=(
                Ball(
                    pitch.MIDDLE_X_MM,
                    pitch.MIDDLE_Y_MM + aside_mm,
                    friction_mm_s2=pitch.FRICTION_MM_S2,
                    brightness=pitch.BALL,
                ),
            )
        )
        for aside_mm in (0.0, -KICK_OFF_MM, KICK_OFF_MM)
    )


@kernel
def attack(moment: Any) -> Any:
    """Return the direction in which a robot's side attacks along x: 1 or -1."""
    return 1.0 if 2 * moment.robot < moment.poses.shape[0] else -1.0


@kernel
def ball_x_mm(moment: Any) -> Any:
    """Return where the ball is along the pitch; the middle if there is none."""
    return moment.bodies[0].x_mm if moment.bodies.shape[0] > 0 else pitch.MIDDLE_X_MM


@kernel
def goal_of(moment: Any) -> Any:
    """Return 1 if the ball lies in the goal on the right, -1 if it lies in that on the left, else 0."""
    radius_mm = moment.bodies[0].radius_mm if moment.bodies.shape[0] > 0 else 0.0
    return float(goal_at(ball_x_mm(moment), radius_mm))


@measure(notes=2)
def goals(moment: Any, notes: Any) -> None:
    """1 if its side has scored, -1 if the other has, 0 without a goal."""
    if notes[1] == 0.0:
        notes[1] = goal_of(moment)
    notes[0] = notes[1] * attack(moment)


@measure(notes=3, result=mean)
def ball_ahead(moment: Any, notes: Any) -> None:
    """Mean of the ball's place along the pitch: 1 at the goal line of the other side, -1 at its own.

    After a goal the ball stays where it went.
    """
    if notes[2] == 0.0:
        notes[2] = goal_of(moment)
    ahead = min(max((ball_x_mm(moment) - pitch.MIDDLE_X_MM) / HALF_MM, -1.0), 1.0)
    notes[0] += attack(moment) * (ahead if notes[2] == 0.0 else notes[2])
    notes[1] += 1.0


@measure(notes=3)
def ball_gain(moment: Any, notes: Any) -> None:
    """Distance by which the ball came nearer to the goal of the other side since its first step [0.1 m]; 10 for a goal.

    It depends on where the ball is, not on how it came there: nothing is gained by moving it to and fro.
    """
    x_mm = ball_x_mm(moment)
    if notes[1] == 0.0:
        notes[1], notes[2] = 1.0, x_mm
    notes[0] = attack(moment) * ((x_mm - notes[2]) / 100.0 + GOAL_REWARD * goal_of(moment))


@measure
def is_goal(moment: Any, notes: Any) -> None:
    """1 while the ball lies in a goal, else 0."""
    notes[0] = abs(goal_of(moment))
