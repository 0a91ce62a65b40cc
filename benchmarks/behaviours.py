"""The demonstrations `follow` and `avoid`, step by step on a `kiks.Khepera`."""

from __future__ import annotations

import kiks

_CORNER_STEPS = 300


class Follow:
    """Follows the wall on the left, as examples/demos/follow.py."""

    def __init__(self) -> None:
        self.lost_steps = _CORNER_STEPS

    def step(self, robot: kiks.Khepera) -> None:
        """Read the sensors once and set the speeds."""
        left, front_left, front, front_right, *_ = robot.proximity()
        nearest = max(left, front_left)
        self.lost_steps = 0 if nearest > 60 else self.lost_steps + 1
        drift = 2.8 if self.lost_steps < _CORNER_STEPS else 0.0
        turn = max(-drift, min(5.0, (nearest - 400) / 50)) + (max(0, front_left - 400) + max(front, front_right)) / 5
        robot.set_speed(max(-6, min(9, 5 + turn)), max(-6, min(9, 5 - turn)))


class Avoid:
    """Touches nothing, as examples/demos/avoid.py."""

    LEFT = (5, 9, 14, -18, -12, -7, 2, 2)
    RIGHT = (-7, -12, -18, 9, 9, 5, 2, 2)

    def step(self, robot: kiks.Khepera) -> None:
        """Read the sensors once and set the speeds."""
        readings = robot.proximity()
        left = 6 + sum(weight * reading for weight, reading in zip(self.LEFT, readings, strict=True)) / 250
        right = 6 + sum(weight * reading for weight, reading in zip(self.RIGHT, readings, strict=True)) / 250
        robot.set_speed(max(-8, min(8, left)), max(-8, min(8, right)))
