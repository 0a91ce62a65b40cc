"""Clean a room: find the cylinders that stand about and push them to the walls.

A cylinder fits between the two diagonal sensors, a wall does not. So the robot turns towards whatever it sees, and
pushes what is in front of it, until that is a wall or moves no more. Then it backs off and looks elsewhere.
"""

from __future__ import annotations

import sys

from kiks.client.khepera import Khepera

CRUISE = 30
"""Speed ahead, with a cylinder or without [pulses/10 ms]."""

WALL = 700
"""Reading that both diagonal sensors have in front of a wall, and never before a cylinder."""

BLOCKED_STEPS = 8
"""Steps, of 50 ms at 9600 baud, with wheels slower than half of what was asked, after which nothing moves any more."""

BACK = 1000
"""How far to back off [pulses]: 80 mm, so that turning does not touch what was brought."""

TURN_LEAST, TURN_RANGE = 625, 830
"""How far each wheel goes in a turn [pulses]: 108 degrees at least, 252 at most."""

GOLDEN = 0.618
"""Share of the range by which each turn differs from the one before: thus no direction is left out for long."""


class Clean:
    """The behaviour. It remembers the moves that are still to be made, how long it was slow, and its turns."""

    def __init__(self) -> None:
        self.moves: list[tuple[int, int]] = []
        self.slow_steps = 0
        self.turns = 0

    def step(self, robot: Khepera) -> None:
        """Read the sensors once and set the speeds, or go on with leaving a wall."""
        if self.moves:
            if all(motor.on_target for motor in robot.status()):
                self.moves.pop(0)
                self.start_move(robot)
            return
        left, diagonal_left, front_left, front_right, diagonal_right, right, *_ = robot.proximity()
        is_slow = sum(robot.speed()) < CRUISE
        self.slow_steps = self.slow_steps + 1 if is_slow else 0
        if min(diagonal_left, diagonal_right) > WALL or self.slow_steps > BLOCKED_STEPS:
            self.leave(robot)
            return
        turn = (right + diagonal_right + front_right - left - diagonal_left - front_left) / 100
        turn = max(-CRUISE, min(CRUISE, turn))
        robot.set_speed(CRUISE + turn, CRUISE - turn)

    def leave(self, robot: Khepera) -> None:
        """Back off, then turn round, each time by another angle."""
        self.turns += 1
        self.slow_steps = 0
        turn = TURN_LEAST + round(TURN_RANGE * (self.turns * GOLDEN % 1))
        self.moves = [(-BACK, -BACK), (turn, -turn)]
        # A move begins with the speed that there is, so stop first.
        robot.stop()
        robot.pause(0.1)
        robot.set_profile(speed=40, acceleration=128)
        self.start_move(robot)

    def start_move(self, robot: Khepera) -> None:
        """Begin the next move, if there is one."""
        if self.moves:
            robot.set_encoders()
            robot.move_to(*self.moves[0])


if __name__ == "__main__":
    with Khepera(sys.argv[1] if len(sys.argv) > 1 else "kiks://1") as khepera:
        clean = Clean()
        while True:
            clean.step(khepera)
