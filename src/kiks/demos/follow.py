"""Follow a wall on the left side: drive straight on until there is one, then keep its reading where it should be."""

from __future__ import annotations

import sys

from kiks.client.khepera import Khepera

CRUISE = 5
"""Speed along the wall [pulses/10 ms]."""

WANTED = 400
"""Reading of the left side at the distance to keep, about 25 mm from a white wall."""

CORNER_STEPS = 300
"""Steps without a wall after which none is round the corner: from then on the robot drives straight on."""


class Follow:
    """The behaviour. It remembers one thing: for how many steps it has seen no wall."""

    def __init__(self) -> None:
        self.lost_steps = CORNER_STEPS

    def step(self, robot: Khepera) -> None:
        """Read the sensors once and set the speeds."""
        left, front_left, front, front_right, *_ = robot.proximity()
        nearest = max(left, front_left)
        self.lost_steps = 0 if nearest > 60 else self.lost_steps + 1
        # Steer away from a wall that is too near, towards one that is too far, and hard away from one ahead.
        drift = 2.8 if self.lost_steps < CORNER_STEPS else 0.0
        side = max(-drift, min(5.0, (nearest - WANTED) / 50))
        ahead = (max(0, front_left - WANTED) + max(front, front_right)) / 5
        robot.set_speed(max(-6, min(9, CRUISE + side + ahead)), max(-6, min(9, CRUISE - side - ahead)))


if __name__ == "__main__":
    with Khepera(sys.argv[1] if len(sys.argv) > 1 else "kiks://1") as khepera:
        follow = Follow()
        while True:
            follow.step(khepera)
