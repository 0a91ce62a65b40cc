"""Race round a track with a white wall on the right, as near to it as the sensors see and never at it.

The robot steers by one number, how near the wall is on the right and ahead of it there, and by how fast that changes.
"""

from __future__ import annotations

import sys

from kiks.client.khepera import Khepera

BAUD = 38400
"""Speed of the line: at 9600 baud readings come a third as often, and half of the speed is enough."""

CRUISE = 80
"""Mean speed of the wheels [pulses/10 ms]: 640 mm/s."""

WANTED = 350
"""Reading at the distance to keep, some 25 mm."""

SHARPEST = 0.6
"""Most that a wheel is faster or slower than the mean, as a share of it."""


class Race:
    """The behaviour. It remembers how near the wall was at its last step.

    Args:
        cruise: Mean speed of the wheels [pulses/10 ms].
    """

    def __init__(self, cruise: float = CRUISE) -> None:
        self.cruise = cruise
        self.last_near = float(WANTED)

    def step(self, robot: Khepera) -> None:
        """Read the sensors once and set the speeds."""
        _, _, front_left, front_right, diagonal, right, *_ = robot.proximity()
        near = max(right, 0.7 * diagonal)
        change, self.last_near = near - self.last_near, near
        left_turn = 0.0004 * (near - WANTED) + 0.0024 * change + 0.0005 * (front_left + front_right)
        left_turn = max(-SHARPEST, min(SHARPEST, left_turn))
        robot.set_speed(self.cruise * (1 - left_turn), self.cruise * (1 + left_turn))


if __name__ == "__main__":
    with Khepera(sys.argv[1] if len(sys.argv) > 1 else "kiks://1", baud=BAUD) as khepera:
        race = Race()
        while True:
            race.step(khepera)
