"""The square test of Borenstein and Feng (UMBmark, 1995): from where a robot ends to the track and wheels that it has.

A robot drives a square several times in each direction, and believes to be back where it began. What it is off by has
two causes. If its track is not what it believes, all turns are too far or too short by alpha. If its wheels differ, the
legs are arcs that bend by beta. Driven the other way round, one of them changes its sign.

Source: J. Borenstein and L. Feng, Measurement and correction of systematic odometry errors in mobile robots, IEEE
Transactions on Robotics and Automation 12, 1996, whose formulas are used as the notes of others print them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kiks.errors import ParameterError
from kiks.model.array_checks import check_numbers
from kiks.model.checks import check_number

ANGLE_MAX = np.pi / 4
"""Largest angle by which a turn or a leg may be off: beyond, ends are in other units than the sides."""


@dataclass(frozen=True)
class SquareTest:
    """What a square test says about a robot.

    Attributes:
        alpha_deg: By how much each turn is too short [deg].
        beta_deg: By how much each leg bends to the left [deg].
        track_mm: The track that the robot has [mm].
        ratio: The diameter of its right wheel, divided by that of its left one.
        left: What to multiply the believed diameter of the left wheel by.
        right: The same of the right wheel.
        error_mm: Distance of the farther cluster's centre from where the robot believes to be [mm], Borenstein and
            Feng's measure of a robot's odometry.
    """

    alpha_deg: float
    beta_deg: float
    track_mm: float
    ratio: float
    left: float
    right: float
    error_mm: float


def square_test(clockwise_mm: ArrayLike, counter_mm: ArrayLike, *, side_mm: float, track_mm: float) -> SquareTest:
    """Return what the ends of squares say about a robot.

    The robot begins each square at the origin, along x. An end is where it really is, less where it believes to be.

    Args:
        clockwise_mm: Ends of the squares with turns to the right, x and y, float64 [square, 2].
        counter_mm: Ends of the squares with turns to the left, float64 [square, 2].
        side_mm: Side of the square [mm].
        track_mm: The track that the robot believes to have [mm].

    Example:
        >>> test = square_test([[-10.0, -10.0]], [[-10.0, 10.0]], side_mm=500, track_mm=53)
        >>> round(test.alpha_deg, 3), round(test.track_mm, 2), test.ratio
        (0.573, 53.34, 1.0)
    """
    check_number("side_mm", side_mm, 1.0, 1e6)
    check_number("track_mm", track_mm, 1.0, 1e5)
    across = []
    errors_mm = []
    for name, given in (("clockwise_mm", clockwise_mm), ("counter_mm", counter_mm)):
        ends: NDArray[np.float64] = check_numbers(name, given, (None, 2))
        if not len(ends):
            raise ParameterError(f"{name} must have the end of one square at least, but there was none.")
        centre = ends.mean(axis=0)
        across.append(float(centre[0]))
        errors_mm.append(float(np.hypot(*centre)))
    alpha = (across[0] + across[1]) / (-4.0 * side_mm)
    beta = (across[0] - across[1]) / (-4.0 * side_mm)
    if max(abs(alpha), abs(beta)) > ANGLE_MAX:
        raise ParameterError(
            f"ends must lie nearer to the start of squares of {side_mm:g} mm, but their means across were "
            f"{across[0]:g} and {across[1]:g} mm. Give all lengths in millimetres."
        )
    radius_mm = np.inf if beta == 0.0 else 0.5 * side_mm / np.sin(0.5 * beta)
    track = track_mm * 0.5 * np.pi / (0.5 * np.pi - alpha)
    # (R + b / 2) / (R - b / 2), written so that straight legs need no case of their own
    bend = 0.5 * track / radius_mm
    ratio = float((1.0 + bend) / (1.0 - bend))
    return SquareTest(
        float(np.degrees(alpha)),
        float(np.degrees(beta)),
        float(track),
        ratio,
        2.0 / (ratio + 1.0),
        2.0 / (1.0 / ratio + 1.0),
        max(errors_mm),
    )
