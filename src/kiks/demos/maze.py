"""Find the way out of a maze, to the lamp in its exit: follow the wall, and once the lamp is near, go for its light."""

from __future__ import annotations

import sys

from kiks.client.khepera import Khepera
from kiks.demos.follow import Follow

BRIGHT = 330
"""Light reading below which the lamp is in sight and near: 120 mm, if it has 1 W."""

ARRIVED = 58
"""Light reading that there is only within a few millimetres of the lamp."""

CREEP = 3
"""Speed towards the lamp [pulses/10 ms]."""

# How much to turn right for the light that the brightest sensor sees, clockwise from the left.
TURN = (-3, -2, -1, 1, 2, 3, 4, -4)


class Maze:
    """The behaviour. It remembers whether it has arrived, and what following a wall remembers."""

    def __init__(self) -> None:
        self.follow = Follow()
        self.has_arrived = False

    def step(self, robot: Khepera) -> None:
        """Read the light, and follow it or the wall."""
        light = robot.ambient()
        brightest = min(light)  # light makes readings small
        self.has_arrived = self.has_arrived or brightest < ARRIVED
        if self.has_arrived:
            robot.stop()
        elif brightest < BRIGHT:
            turn = TURN[light.index(brightest)]
            robot.set_speed(CREEP + turn, CREEP - turn)
        else:
            self.follow.step(robot)


if __name__ == "__main__":
    with Khepera(sys.argv[1] if len(sys.argv) > 1 else "kiks://1") as khepera:
        maze = Maze()
        while not maze.has_arrived:
            maze.step(khepera)
