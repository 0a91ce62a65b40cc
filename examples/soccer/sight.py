"""Find the ball and the goal posts in the pictures of a K213 camera.

A picture holds relative greys only: the camera's exposure shifts all greys until the brightest is white. Order L tells
how bright the scene was before, which undoes the shift (khepera-protocol.md 10.3). Then each grey has a meaning: walls
and players are dark, one goal is a little brighter, the other brighter still, and the ball is white.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from kiks.client.khepera import Khepera

COUNT = 32
"""Order S returns every second pixel: half the time on the line, and still one for each 1.1 degrees."""

EDGE_RAD, PITCH_RAD = math.radians(18.0), math.radians(36.0 / 63 * 2)
"""Direction of the leftmost pixel, and the angle between two pixels."""

WALL, DIM, BRIGHT, BALL = 80.0, 122.0, 165.0, 245.0
"""Greys of walls, goals and ball, without the shift."""

BALL_LIMIT = 185.0
"""Brighter pixels show the ball. Blur darkens it beyond 0.6 m, to 200 at 0.9 m."""

BALL_MM = 32.0
"""Radius of the ball."""

TOUCHING_MM = 62.0
"""Distance of the centre of a ball that touches the robot, with a small margin."""

UNKNOWN_MM = 150.0
"""Assumed distance of a ball when only one of its edges is visible."""

FLAT = 50.0
"""Largest difference of greys in a picture that the ball fills."""

BLUR_RAD = 0.05
"""Largest angle by which motion widens the ball."""

LENS_MARGIN = 15.0
"""A grey this close to the brightest that the lens passes may in truth be brighter."""


@dataclass(frozen=True)
class Sighting:
    """The edges of the ball in a picture.

    Attributes:
        left_rad: Direction of its left edge, positive to the left; None if that is out of the picture.
        right_rad: Direction of its right edge.
    """

    left_rad: float | None
    right_rad: float | None

    @property
    def is_whole(self) -> bool:
        """Whether its distance is known: both edges are visible, or none because it is so near."""
        return (self.left_rad is None) == (self.right_rad is None)

    def where(self, distance_mm: float | None) -> tuple[float, float]:
        """Return the distance [mm] and the direction [rad] of its centre.

        Args:
            distance_mm: Expected distance, used if an edge is out of the picture; None if unknown.
        """
        left, right = self.left_rad, self.right_rad
        if left is not None and right is not None:
            return self._distance_mm(left - right), (left + right) / 2
        if left is None and right is None:
            return TOUCHING_MM, 0.0
        shown = (EDGE_RAD if left is None else left) - (-EDGE_RAD if right is None else right)
        nearer_mm = max(TOUCHING_MM, min(distance_mm or UNKNOWN_MM, self._distance_mm(shown - BLUR_RAD)))
        half = math.asin(BALL_MM / nearer_mm)
        return nearer_mm, left - half if left is not None else (right or 0.0) + half

    @staticmethod
    def _distance_mm(width_rad: float) -> float:
        return BALL_MM / math.sin(max(width_rad / 2, 0.02))


@dataclass(frozen=True)
class Edge:
    """A post: the edge between wall and goal.

    Attributes:
        bearing_rad: Its direction, positive to the left.
        goal: 'dim' or 'bright'.
        is_left: Whether it is the left post in the picture.
    """

    bearing_rad: float
    goal: str
    is_left: bool


@dataclass(frozen=True)
class View:
    """Ball and posts in a picture."""

    ball: Sighting | None
    edges: tuple[Edge, ...]


def bearing(index: float) -> float:
    """Return the direction of a pixel of order S [rad]."""
    return EDGE_RAD - index * PITCH_RAD


def ceiling(index: int) -> float:
    """Return the brightest grey that the lens passes to a pixel of order S; it darkens towards the edges."""
    share = abs(bearing(index)) / EDGE_RAD
    return 240.0 - 108.0 * share * share * math.sqrt(share)


_OUTWARDS = [(i + 1, i, ceiling(i) - LENS_MARGIN) for i in range(COUNT // 2 - 2, -1, -1)] + [
    (i - 1, i, ceiling(i) - LENS_MARGIN) for i in range(COUNT // 2 + 1, COUNT)
]
"""Pixels from the middle to either edge, each with the pixel before it and its largest reliable grey."""


def exposure(greys: Sequence[float], light: int) -> float:
    """Return by how many greys the exposure has brightened a picture.

    The light level is 7 (255 - brightest) + 200 + (brightest - mean), give or take 25, of the greys before that.
    """
    brightest, mean = max(greys), sum(greys) / len(greys)
    return brightest - (255.0 - (light - 200.0 - (brightest - mean)) / 7.0)


def smooth(greys: Sequence[int]) -> list[float]:
    """Return a picture with less noise: a tenth of each grey is noise, whose mean is subtracted."""
    around = [greys[0], *greys, greys[-1]]
    return [
        (left + 2 * here + right) / 3.6 - 12.75 / 0.9
        for left, here, right in zip(around[:-2], around[1:-1], around[2:], strict=True)
    ]


def undarken(greys: list[float]) -> None:
    """Give pixels at the limit of the lens the grey of their neighbour towards the middle."""
    for inner, outer, limit in _OUTWARDS:
        if greys[outer] > limit:
            greys[outer] = max(greys[outer], greys[inner])


def crossing(greys: Sequence[float], start: int, step: int, level: float) -> float | None:
    """Return the index at which a picture falls to a level, from a pixel to one side; None if it does not."""
    i = start
    while 0 <= i + step < len(greys):
        if greys[i] > level >= greys[i + step]:
            return i + step * (greys[i] - level) / (greys[i] - greys[i + step])
        i += step
    return None


def find_ball(greys: Sequence[float]) -> Sighting | None:
    """Return the ball in a picture of true greys; None without one."""
    peak = max(greys)
    if peak < BALL_LIMIT:
        return None
    top = greys.index(peak)
    ends: list[float | None] = []
    for step in (-1, 1):
        i = top
        while 0 <= i < len(greys) and greys[i] > BALL_LIMIT - 15.0:
            i += step
        # Wall or goal lies beside the ball; the edge is halfway between the greys.
        beside = greys[max(i - 4, 0) : i + 1] if step < 0 else greys[i : i + 5]
        ends.append(crossing(greys, top, step, (peak + min(beside)) / 2) if beside else None)
    left, right = (None if end is None else bearing(end) for end in ends)
    if left is None and right is None and min(greys) < peak - FLAT:
        return None  # the light level was that of another picture
    return Sighting(left, right)


def find_edges(greys: Sequence[float], shift: float) -> tuple[Edge, ...]:
    """Return the posts in a picture of true greys."""
    edges = []
    i = 0
    while i < COUNT:
        first = i
        while i < COUNT and greys[i] > (WALL + DIM) / 2:
            i += 1
        run = greys[first:i]
        if len(run) >= 5 and max(run) < BALL_LIMIT:
            level = sorted(run)[len(run) // 2]
            goal, grey = ("bright", BRIGHT) if level > (DIM + BRIGHT) / 2 else ("dim", DIM)
            middle = (first + i - 1) // 2
            for step in (-1, 1):
                at = crossing(greys, middle, step, (WALL + grey) / 2)
                # Greys that the lens darkens are not reliable.
                if at is not None and (WALL + grey) / 2 + shift < ceiling(round(at + step)) - LENS_MARGIN:
                    edges.append(Edge(bearing(at), goal, step < 0))
        i = max(i, first + 1)
    return tuple(edges)


class Eye:
    """The camera.

    Args:
        robot: The robot that carries it.
    """

    def __init__(self, robot: Khepera) -> None:
        self.robot = robot
        robot.turret(2, "U,1")  # a picture each 50 ms

    def look(self) -> View:
        """Take a picture; return ball and posts in it."""
        # Light level first: the picture follows so soon that both nearly always belong together.
        high, low = self.robot.turret(2, "L")
        greys = smooth(self.robot.turret(2, "S"))
        undarken(greys)
        shift = exposure(greys, 256 * high + low)
        true = [grey - shift for grey in greys]
        return View(find_ball(true), find_edges(true, shift))
