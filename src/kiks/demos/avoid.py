"""Wander about without touching anything: a Braitenberg vehicle that reads its sensors and sets its speeds, no more."""

from __future__ import annotations

import sys

from kiks.client.khepera import Khepera

CRUISE = 6
"""Speed with nothing in sight [pulses/10 ms]."""

# Speed that a full reading of each sensor, clockwise from the left, adds to the left and to the right wheel.
LEFT = (5, 9, 14, -18, -12, -7, 2, 2)
RIGHT = (-7, -12, -18, 9, 9, 5, 2, 2)


class Avoid:
    """The behaviour. It remembers nothing."""

    def step(self, robot: Khepera) -> None:
        """Read the sensors once and set the speeds."""
        readings = robot.proximity()
        left = CRUISE + sum(weight * reading for weight, reading in zip(LEFT, readings, strict=True)) / 250
        right = CRUISE + sum(weight * reading for weight, reading in zip(RIGHT, readings, strict=True)) / 250
        robot.set_speed(max(-8, min(8, left)), max(-8, min(8, right)))


if __name__ == "__main__":
    with Khepera(sys.argv[1] if len(sys.argv) > 1 else "kiks://1") as khepera:
        avoid = Avoid()
        while True:
            avoid.step(khepera)
