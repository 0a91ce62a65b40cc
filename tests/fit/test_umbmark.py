"""The square test: its formulas undo what wrong wheels and a wrong track do to squares."""

import math

import numpy as np
import pytest

from kiks.errors import ParameterError
from kiks.fit.umbmark import square_test


def end_of_square(turn: int, *, side_mm: float, believed_mm: float, track_mm: float, ratio: float) -> list[float]:
    """Return where a robot ends that drives by its wheels' ways: arcs, added up in small steps."""
    factors = 2 / (ratio + 1), 2 * ratio / (ratio + 1)
    x, y, heading = 0.0, 0.0, 0.0
    corner_mm = turn * 0.25 * math.pi * believed_mm
    for left_mm, right_mm in 4 * [(side_mm, side_mm), (-corner_mm, corner_mm)]:
        for _ in range(1000):
            left, right = (way * factor / 1000 for way, factor in zip((left_mm, right_mm), factors, strict=True))
            turned = (right - left) / track_mm
            x += 0.5 * (left + right) * math.cos(heading + 0.5 * turned)
            y += 0.5 * (left + right) * math.sin(heading + 0.5 * turned)
            heading += turned
    return [x, y]


@pytest.mark.parametrize("track_mm", [52.5, 53.0, 53.6])
@pytest.mark.parametrize("ratio", [0.997, 1.0, 1.002])
def test_it_finds_track_and_ratio(track_mm: float, ratio: float) -> None:
    robot = {"side_mm": 500.0, "believed_mm": 53.0, "track_mm": track_mm, "ratio": ratio}
    test = square_test([end_of_square(-1, **robot)], [end_of_square(1, **robot)], side_mm=500.0, track_mm=53.0)
    assert test.track_mm == pytest.approx(track_mm, rel=1.5e-3)
    assert test.ratio - 1 == pytest.approx(ratio - 1, rel=0.06, abs=1e-6)
    assert test.right / test.left == pytest.approx(test.ratio)
    assert test.left + test.right == pytest.approx(2.0)


def test_it_gives_the_published_constants_of_a_larger_robot() -> None:
    # The clusters of a LabMate follow from the constants that Borenstein and Feng found, in squares of 4 m.
    test = square_test([[63.0, 63.0]], [[230.0, -209.0]], side_mm=4000.0, track_mm=340.0)
    assert test.ratio == pytest.approx(1.00084, abs=5e-5)
    assert test.track_mm == pytest.approx(336.17, rel=4e-4)
    assert test.error_mm == pytest.approx(311.0, abs=0.5)


def test_squares_must_be_there() -> None:
    with pytest.raises(ParameterError, match="clockwise_mm must have the end of one square"):
        square_test(np.empty((0, 2)), [[1.0, 1.0]], side_mm=500.0, track_mm=53.0)
    with pytest.raises(ParameterError, match="ends must lie nearer to the start of squares of 500 mm"):
        square_test([[-1e6, 0.0]], [[-1e6, 0.0]], side_mm=500.0, track_mm=53.0)
