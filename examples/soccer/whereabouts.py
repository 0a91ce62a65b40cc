"""Localization of a soccer player: odometry, corrected by the goal posts that it sees.

An extended Kalman filter of three numbers: x, y and heading. The wheels move the pose and add uncertainty. The measured
direction of each post corrects it.
"""

from __future__ import annotations

import math

from sight import View

from kiks.client.khepera import Khepera

Matrix = list[list[float]]

GOAL_LINE_MM, POST_MM = 525.0, 150.0
"""Distance of the goal lines from the middle, and of the posts from the long axis."""


class Whereabouts:
    """The pose of a player on the pitch.

    Args:
        robot: The robot.
        x: Its place at the start [mm].
        y: Its place at the start [mm].
        heading: Its heading at the start [rad].
    """

    BASE_MM = 53.0
    PULSE_MM = 0.08

    WAY_SHARE = 0.01
    """Error of a distance, as a share of it."""

    TURN_SHARE = 0.01
    """Error of a turn, as a share of it."""

    SIGHT_RAD = 0.05
    """Error of a post's direction."""

    DOUBT = (2.0, 2.0, 0.0001)
    """Variance that each rejected post adds [mm^2, mm^2, rad^2]."""

    def __init__(self, robot: Khepera, x: float, y: float, heading: float) -> None:
        self.robot = robot
        self.x, self.y, self.heading = x, y, heading
        self.spread: Matrix = [[25.0, 0.0, 0.0], [0.0, 25.0, 0.0], [0.0, 0.0, 0.001]]
        self.wheels = robot.encoders()
        self.turn = 0.0

    def read_wheels(self) -> float:
        """Read the wheel counters, move the pose, return the distance driven [mm]."""
        before, self.wheels = self.wheels, self.robot.encoders()
        left, right = (self.PULSE_MM * (now - then) for now, then in zip(self.wheels, before, strict=True))
        way, turn = (left + right) / 2, (right - left) / self.BASE_MM
        self.turn = turn
        middle = self.heading + turn / 2
        step_x, step_y = way * math.cos(middle), way * math.sin(middle)
        self.x, self.y, self.heading = self.x + step_x, self.y + step_y, self.heading + turn
        # An error of the heading moves the step sideways.
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
        """Correct the pose by the posts in a view.

        Args:
            view: The view.
            goals: The look of the player's own goal and of the other.
        """
        for edge in view.edges:
            x = GOAL_LINE_MM if edge.goal == goals[1] else -GOAL_LINE_MM
            y = math.copysign(POST_MM, x) * (1.0 if edge.is_left else -1.0)
            self.see(x, y, edge.bearing_rad)

    def see(self, x: float, y: float, bearing_rad: float) -> bool:
        """Correct the pose by the direction of a post at (x, y); return False if the post is rejected."""
        to_x, to_y = x - self.x, y - self.y
        square = max(to_x**2 + to_y**2, 1.0)
        off = math.remainder(bearing_rad - math.atan2(to_y, to_x) + self.heading, 2 * math.pi)
        # How the expected direction changes with x, y and heading.
        slope = (to_y / square, -to_x / square, -1.0)
        p = self.spread
        share = [sum(p[row][k] * slope[k] for k in range(3)) for row in range(3)]
        variance = sum(slope[k] * share[k] for k in range(3)) + self.SIGHT_RAD**2 + self.turn**2
        if off * off > 9.0 * variance:
            # One such post is an outlier. If they persist, the pose is wrong, so each one adds uncertainty.
            for k, doubt in enumerate(self.DOUBT):
                p[k][k] += doubt
            return False
        gain = [value / variance for value in share]
        self.x += gain[0] * off
        self.y += gain[1] * off
        self.heading += gain[2] * off
        self.spread = [[p[row][k] - gain[row] * share[k] for k in range(3)] for row in range(3)]
        return True
