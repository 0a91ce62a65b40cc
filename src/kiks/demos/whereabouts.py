"""Where a soccer player is: its wheels tell, and the posts of the goals put right what they get wrong.

Method: a Kalman filter of three numbers, x, y and heading. Wheels move the place and make it less sure; each post that
is seen says how far its direction is off, and the place gives way along what is least sure.
"""

from __future__ import annotations

import math

from kiks.client.khepera import Khepera
from kiks.demos.sight import View

Matrix = list[list[float]]

GOAL_LINE_MM, POST_MM = 525.0, 150.0
"""Where the posts are: so far before and behind, and so far to the left and right of the middle."""


class Whereabouts:
    """A place on the pitch.

    Args:
        robot: Whose wheels.
        x: Where it stands now [mm].
        y: Where it stands now [mm].
        heading: Where it looks [rad].
    """

    BASE_MM = 53.0
    PULSE_MM = 0.08

    WAY_SHARE = 0.01
    """Error of a way, as a share of it."""

    TURN_SHARE = 0.01
    """Error of a turn, as a share of it, or of a way over the wheel base."""

    SIGHT_RAD = 0.05
    """Error of a post's direction."""

    DOUBT = (2.0, 2.0, 0.0001)
    """What each post that cannot be it adds to the spread [mm^2, mm^2, rad^2]."""

    def __init__(self, robot: Khepera, x: float, y: float, heading: float) -> None:
        self.robot = robot
        self.x, self.y, self.heading = x, y, heading
        self.spread: Matrix = [[25.0, 0.0, 0.0], [0.0, 25.0, 0.0], [0.0, 0.0, 0.001]]
        self.wheels = robot.encoders()
        self.turn = 0.0

    def read_wheels(self) -> float:
        """Ask how far the wheels have turned, and follow; return the way [mm]."""
        before, self.wheels = self.wheels, self.robot.encoders()
        left, right = (self.PULSE_MM * (now - then) for now, then in zip(self.wheels, before, strict=True))
        way, turn = (left + right) / 2, (right - left) / self.BASE_MM
        self.turn = turn
        middle = self.heading + turn / 2
        step_x, step_y = way * math.cos(middle), way * math.sin(middle)
        self.x, self.y, self.heading = self.x + step_x, self.y + step_y, self.heading + turn
        # What the heading is off, the step is off sideways.
        p = self.spread
        for row in range(3):
            p[row][0] -= step_y * p[row][2]
            p[row][1] += step_x * p[row][2]
        for column in range(3):
            p[0][column] -= step_y * p[2][column]
            p[1][column] += step_x * p[2][column]
        way_error = (self.WAY_SHARE * (abs(left) + abs(right)) / 2) ** 2
        p[0][0] += way_error
        p[1][1] += way_error
        p[2][2] += (self.TURN_SHARE * turn) ** 2 + 0.1 * way_error / self.BASE_MM**2
        return way

    def see_posts(self, view: View, goals: tuple[str, str]) -> None:
        """Take the posts in a view for what they are.

        Args:
            view: What was seen.
            goals: The looks of the own goal and of the other.
        """
        for edge in view.edges:
            x = GOAL_LINE_MM if edge.goal == goals[1] else -GOAL_LINE_MM
            y = math.copysign(POST_MM, x) * (1.0 if edge.is_left else -1.0)
            self.see(x, y, edge.bearing_rad)

    def see(self, x: float, y: float, bearing_rad: float) -> bool:
        """Learn from the direction in which a post is seen; return False if that cannot be it."""
        to_x, to_y = x - self.x, y - self.y
        square = max(to_x**2 + to_y**2, 1.0)
        off = math.remainder(bearing_rad - math.atan2(to_y, to_x) + self.heading, 2 * math.pi)
        # How the expected direction changes with x, y and heading.
        slope = (to_y / square, -to_x / square, -1.0)
        p = self.spread
        share = [sum(p[row][k] * slope[k] for k in range(3)) for row in range(3)]
        variance = sum(slope[k] * share[k] for k in range(3)) + self.SIGHT_RAD**2 + self.turn**2
        if off * off > 9.0 * variance:
            # One such post is a mistake. If it goes on, the mistake is ours, and sooner or later they are believed.
            for k, doubt in enumerate(self.DOUBT):
                p[k][k] += doubt
            return False
        gain = [value / variance for value in share]
        self.x += gain[0] * off
        self.y += gain[1] * off
        self.heading += gain[2] * off
        self.spread = [[p[row][k] - gain[row] * share[k] for k in range(3)] for row in range(3)]
        return True
