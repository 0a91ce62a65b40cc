"""Play soccer: find the ball with the K213 camera, get behind it, drive it into the other goal.

    python examples/soccer/player.py /dev/ttyUSB0 left

The robot needs a K213, a line of 38400 baud (mode 3) and a white ball on a dark pitch. Put it on its mark: 250 mm from
the middle, facing it. The left player attacks the goal on the right. A player knows the size of the pitch and the greys
of walls and goals. It finds its place from its wheels and the goal posts that it sees.

Places are in the player's own frame: the origin in the middle of the pitch, x to the goal that it attacks, y to the
left of that. So one program serves both sides.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import NamedTuple

from sight import BALL_MM, Eye, Sighting
from whereabouts import Whereabouts

from kiks.client.khepera import Khepera

BAUD = 38400
"""A picture takes 41 ms on this line, and 165 ms at 9600 baud: the ball would be gone."""

PAUSE_S = 0.03
"""Pause after each step [s]: the wheels need time to follow, and the camera to take its next picture."""

LENGTH_MM, WIDTH_MM = 1050.0, 680.0
"""The pitch between the goal lines, and between the side walls."""

GOAL_MM = 300.0
"""Width of a goal."""

CORNER_MM = 140.0
"""Radius of the pitch's corners."""

MARK_MM = 250.0
"""Distance of a player from the middle at kick-off."""

PULSE_MM_S = 8.0
"""Speed of a wheel at one pulse in 10 ms [mm/s]."""


class Point(NamedTuple):
    """A place or a direction on the pitch [mm]."""

    x: float
    y: float


HOME = Point(-150.0, 0.0)
"""The place from which to look for a lost ball."""


@dataclass(frozen=True)
class Style:
    """How a player plays; speeds in pulses/10 ms.

    Attributes:
        cruise: Speed without the ball.
        shot: Speed at the ball.
        zone_mm: The player ignores the ball beyond this x.
        home: Where it waits for the ball.
    """

    cruise: float = 16.0
    shot: float = 24.0
    zone_mm: float = 1000.0
    home: Point = HOME


STYLES = {"attacker": Style(), "defender": Style(zone_mm=60.0, home=Point(-380.0, 0.0))}
"""The attacker goes for every ball. The defender waits before its goal until the ball crosses the middle."""

MEMORY_S = 2.5
"""Time for which the ball is believed to be where it was seen last."""

START_MM = 140.0
"""Distance behind the ball from which a shot begins."""

PASSING_MM = 85.0
"""Distance from the centre of the ball at which a player drives round it."""

TURN_BACK_S = 0.7
"""How long to back off when something blocks the way."""


class Player:
    """A player.

    Args:
        robot: The robot, on its mark.
        side: Its own half, 'left' or 'right'.
        style: How it plays.
    """

    def __init__(self, robot: Khepera, side: str = "left", style: Style = STYLES["attacker"]) -> None:
        self.robot = robot
        self.style = style
        self.eye = Eye(robot)
        self.place = Whereabouts(robot, -MARK_MM, 0.0, 0.0)
        self.posts = {"left": ("dim", "bright"), "right": ("bright", "dim")}[side]
        self.ball: Point | None = None
        self.ball_s = -math.inf
        self.back_until_s = -math.inf
        self.blocked_s = 0.0
        self.search_s = 0.0
        self.now_s = robot.time_s
        self.turn_sign = 1
        self.is_shooting = False
        self.wanted = 0.0
        self.speeds = (0, 0)

    def step(self) -> None:
        """Look once, and set the speeds."""
        before_s, self.now_s = self.now_s, self.robot.time_s
        way_mm = self.place.read_wheels()
        view = self.eye.look()
        self.place.see_posts(view, self.posts)
        self._see_ball(view.ball)
        self._notice_block(way_mm, self.now_s - before_s)
        if self.now_s < self.back_until_s:
            self._drive(-10.0, 0.5 * self.turn_sign)
        elif self.ball is None:
            self._search(view.ball)
        else:
            self.search_s = self.now_s
            self._play(self.ball)

    # ---- the ball ----

    def _see_ball(self, sighting: Sighting | None) -> None:
        """Note where the ball is; forget it when it is not where it should be."""
        place = self.place
        if sighting is not None:
            distance, bearing = sighting.where(None if self.ball is None else self._way_to(self.ball)[0])
            if self.ball is None and not sighting.is_whole and abs(bearing) > 0.15:
                return  # the ball may be anywhere behind that edge: turn to it first
            angle = place.heading + bearing
            self.ball = Point(
                _within(place.x + distance * math.cos(angle), LENGTH_MM / 2 + BALL_MM),
                _within(place.y + distance * math.sin(angle), WIDTH_MM / 2 - BALL_MM),
            )
            self.ball_s = self.now_s
        elif self.ball is not None:
            distance, bearing = self._way_to(self.ball)
            is_missing = abs(bearing) < 0.2 and distance < 700 and self.now_s > self.ball_s + 0.3
            if is_missing or self.now_s > self.ball_s + MEMORY_S:
                self.turn_sign = 1 if bearing > 0 else -1
                self.ball = None

    def _search(self, glimpse: Sighting | None) -> None:
        """Turn to the visible part of the ball; without one turn round, then go home."""
        if glimpse is not None:
            self._drive(0.0, 3.0 * glimpse.where(None)[1])
            return
        lost_s = (self.now_s - self.search_s) % 8.0
        distance, bearing = self._way_to(self.style.home)
        if lost_s < 4.0 or distance < 60.0:
            self._drive(0.0, 2.4 * self.turn_sign)
        else:
            self._drive(self.style.cruise * max(math.cos(bearing), 0.0), 2.5 * bearing)

    # ---- the game ----

    def _play(self, ball: Point) -> None:
        """Go for the ball, or wait for it at home."""
        if ball.x > self.style.zone_mm:
            if self._way_to(self.style.home)[0] > 50.0:
                self._go(self.style.home, self.style.cruise)
            else:
                self._drive(0.0, 2.0 * self._way_to(ball)[1])
            return
        aim = self._aim(ball)
        to_x, to_y = ball.x - self.place.x, ball.y - self.place.y
        behind, beside = to_x * aim.x + to_y * aim.y, abs(to_x * aim.y - to_y * aim.x)
        start = self._inside(Point(ball.x - START_MM * aim.x, ball.y - START_MM * aim.y))
        # A shot goes on unless the ball gets away to the side.
        cone = 0.9 if self.is_shooting else 0.45
        is_behind = behind > 20.0 and beside < max(cone * (behind - BALL_MM), 12.0)
        self.is_shooting = is_behind or (self._way_to(start)[0] < 30.0 and behind > 0.0)
        if self.is_shooting:
            # Get onto the line through ball and goal, and shoot along it.
            lead = 0.4 * behind if behind > 90.0 else -60.0
            speed = self.style.shot if behind < 200.0 else self.style.cruise
            self._go(Point(ball.x - lead * aim.x, ball.y - lead * aim.y), speed)
        else:
            self._go_round(ball, start)

    @staticmethod
    def _aim(ball: Point) -> Point:
        """Return the direction in which the ball should go.

        That is into the nearest part of the goal, along a wall that it touches, or away from its own goal line.
        """
        to_x, to_y = LENGTH_MM / 2 + 80.0 - ball.x, _within(ball.y, GOAL_MM / 2 - 70.0) - ball.y
        if ball.x < 90.0 - LENGTH_MM / 2:
            to_x, to_y = 0.3, math.copysign(1.0, ball.y)
        elif abs(ball.y) > WIDTH_MM / 2 - 75.0:
            to_y = 0.0
        length = math.hypot(to_x, to_y)
        return Point(to_x / length, to_y / length)

    def _go_round(self, ball: Point, point: Point) -> None:
        """Drive to a point, round the ball."""
        _, bearing = self._way_to(point)
        distance, to_ball = self._way_to(ball)
        free = math.asin(min(PASSING_MM / max(distance, 1.0), 1.0))
        off = math.remainder(bearing - to_ball, 2 * math.pi)
        if abs(off) < free:
            bearing = to_ball + math.copysign(free, off)
        self._steer(bearing, self.style.cruise)

    @staticmethod
    def _inside(point: Point) -> Point:
        """Return the nearest point where a robot has room; the corners are round."""
        x, y = _within(point.x, LENGTH_MM / 2 - 40.0), _within(point.y, WIDTH_MM / 2 - 40.0)
        into_x, into_y = abs(x) - LENGTH_MM / 2 + CORNER_MM, abs(y) - WIDTH_MM / 2 + CORNER_MM
        too_far = math.hypot(into_x, into_y) / (CORNER_MM - 35.0)
        if into_x <= 0.0 or into_y <= 0.0 or too_far <= 1.0:
            return Point(x, y)
        shrunk_x, shrunk_y = into_x * (1.0 - 1.0 / too_far), into_y * (1.0 - 1.0 / too_far)
        return Point(x - math.copysign(shrunk_x, x), y - math.copysign(shrunk_y, y))

    # ---- driving ----

    def _way_to(self, point: Point) -> tuple[float, float]:
        """Return how far a point is [mm], and in which direction [rad]."""
        to_x, to_y = point.x - self.place.x, point.y - self.place.y
        bearing = math.remainder(math.atan2(to_y, to_x) - self.place.heading, 2 * math.pi)
        return math.hypot(to_x, to_y), bearing

    def _go(self, point: Point, speed: float) -> None:
        """Drive to a point."""
        self._steer(self._way_to(point)[1], speed)

    def _steer(self, bearing: float, speed: float) -> None:
        """Drive in a direction; turn on the spot first if it is not ahead."""
        bearing = math.remainder(bearing, 2 * math.pi)
        self._drive(speed * max(math.cos(bearing), 0.0) ** 2, 3.0 * bearing)

    def _drive(self, speed: float, turn_rad_s: float) -> None:
        """Set the speeds of the wheels: forwards [pulses/10 ms] and turning."""
        turn = _within(turn_rad_s, 3.0) * self.place.BASE_MM / 2 / PULSE_MM_S
        self.wanted = speed
        speeds = round(speed - turn), round(speed + turn)
        if speeds != self.speeds:
            self.robot.set_speed(*speeds)
            self.speeds = speeds

    def _notice_block(self, way_mm: float, passed_s: float) -> None:
        """Back off when the wheels hardly turn."""
        wanted_mm = self.wanted * PULSE_MM_S * passed_s
        is_blocked = wanted_mm > 3.0 and way_mm < 0.35 * wanted_mm
        self.blocked_s = self.blocked_s + passed_s if is_blocked else 0.0
        if self.blocked_s > 0.5:
            self.blocked_s = 0.0
            self.back_until_s = self.now_s + TURN_BACK_S
            self.turn_sign = -self.turn_sign


def _within(value: float, limit: float) -> float:
    """Return a number, cut to +-limit."""
    return max(-limit, min(limit, value))


def play(name: str = "kiks://1", side: str = "left", style: str = "attacker") -> None:
    """Play until the robot is switched off.

    Args:
        name: Name of the port.
        side: 'left' or 'right'.
        style: A key of `STYLES`.
    """
    with Khepera(name, baud=BAUD) as robot:
        player = Player(robot, side, STYLES[style])
        while True:
            player.step()
            robot.pause(PAUSE_S)


if __name__ == "__main__":
    play(*sys.argv[1:])
