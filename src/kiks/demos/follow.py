"""Follow a wall on the left side: drift to the left until there is one, then keep its reading where it should be."""

from __future__ import annotations

import sys

from kiks.client.khepera import Khepera

CRUISE = 5
"""Speed along the wall [pulses/10 ms]."""

WANTED = 200
"""Reading of the left side at the distance to keep, about 3 cm from a white wall."""


def step(robot: Khepera) -> None:
    """Read the sensors once and set the speeds."""
    left, front_left, front, front_right, *_ = robot.proximity()
    # Steer away from a wall that is too near, gently towards one that is too far, and hard away from one ahead.
    side = max(-1.5, min(5.0, (max(left, front_left) - WANTED) / 50))
    ahead = (0.1 * front_left + max(front, front_right)) / 25
    robot.set_speed(max(-6, min(9, CRUISE + side + ahead)), max(-6, min(9, CRUISE - side - ahead)))


if __name__ == "__main__":
    with Khepera(sys.argv[1] if len(sys.argv) > 1 else "kiks://1") as khepera:
        while True:
            step(khepera)
