"""Painted walls: every stroke against a slow oracle, and its mirror image."""

import math
from fractions import Fraction
from functools import partial
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.model.refusals import refused

from kiks.errors import ArenaError
from kiks.model import brush
from kiks.model.arena import Arena
from kiks.model.brush import POINTS_MAX

WIDTH, HEIGHT = 120, 100

on_grid = st.integers(-64 * 20, 64 * 140).map(lambda units: units / 64)
points = st.tuples(on_grid, on_grid)
widths = st.integers(1, 64 * 40).map(lambda units: units / 64)


FLOOR = Arena.from_array(np.zeros((HEIGHT, WIDTH), np.uint8), name="floor")


def is_near(x: Fraction, y: Fraction, a: tuple[float, float], b: tuple[float, float], width: float) -> bool:
    """Tell whether a place is at most half a width from a segment, in fractions."""
    ax, ay, bx, by = map(Fraction, (*a, *b))
    length_2 = (bx - ax) ** 2 + (by - ay) ** 2
    share = Fraction(0) if not length_2 else ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length_2
    share = min(max(share, Fraction(0)), Fraction(1))
    distance_2 = (x - ax - share * (bx - ax)) ** 2 + (y - ay - share * (by - ay)) ** 2
    return distance_2 <= (Fraction(width) / 2) ** 2


def painted(draw) -> np.ndarray:
    """Return the raster after a drawing on bare floor, all wall where that would have left no floor."""
    try:
        return draw(FLOOR).brightness
    except ArenaError:
        return np.full((HEIGHT, WIDTH), 255)


@pytest.mark.slow
@settings(max_examples=share(10, 25))
@given(points, points, widths)
def test_a_line_covers_what_is_near_it(a, b, width):
    shown = painted(lambda arena: brush.line(arena, [a, b], width_mm=width))
    edge = np.argwhere(shown ^ np.roll(shown, 1, axis=1))[:60].tolist()
    for row, column in [*product(range(0, HEIGHT, 7), range(0, WIDTH, 3)), *edge]:
        x, y = Fraction(2 * column + 1, 2), Fraction(2 * row + 1, 2)
        assert (shown[row, column] == 255) == is_near(x, y, a, b, width)


@settings(max_examples=share(20, 40))
@given(points, points)
def test_a_rectangle_covers_centres_in_it(a, b):
    shown = painted(lambda arena: brush.rectangle(arena, *a, *b, 77))
    x, y = np.arange(WIDTH) + 0.5, np.arange(HEIGHT)[:, None] + 0.5
    inside = (min(a[0], b[0]) <= x) & (x <= max(a[0], b[0])) & (min(a[1], b[1]) <= y) & (y <= max(a[1], b[1]))
    assert inside.all() or np.array_equal(shown == 77, inside)


@settings(max_examples=share(10, 20))
@given(st.lists(points, min_size=2, max_size=5), widths)
def test_a_stroke_is_its_segments_together(stroke, width):
    whole = painted(lambda arena: brush.line(arena, stroke, width_mm=width))
    parts = [
        painted(lambda arena, k=k: brush.line(arena, stroke[k : k + 2], width_mm=width)) for k in range(len(stroke) - 1)
    ]
    assert np.array_equal(whole > 0, np.any([part > 0 for part in parts], axis=0)) or (whole > 0).all()


def test_a_freehand_stroke_lies_on_top_of_all_that_it_crosses():
    walls = brush.disc(brush.rectangle(FLOOR, 10, 10, 50, 90, "wood"), (80, 50), 25, 120)
    stroke = [(0, 20), (70, 60), (110, 30)]
    covered = brush.line(FLOOR, stroke, width_mm=6).brightness > 0
    assert len({*walls.brightness[covered].tolist()}) == 3, "it crosses floor and both walls"
    shown = brush.line(walls, stroke, width_mm=6, brightness=200).brightness
    assert np.array_equal(shown, np.where(covered, 200, walls.brightness))


def test_a_wide_arena_is_drawn_in_pieces():
    wide = Arena.from_array(np.zeros((150, 20_000), np.uint8))
    shown = brush.line(wide, [(10, 20), (19_990, 130)], width_mm=20).brightness
    x, y = np.arange(20_000) + 0.5, np.arange(150)[:, None] + 0.5
    aside = np.abs((x - 10) * 110 - (y - 20) * 19_980) / math.hypot(110, 19_980)
    clear = (np.abs(aside - 10) > 1e-6) & (x > 30) & (x < 19_970)
    assert np.array_equal((shown > 0)[clear], (aside < 10)[clear])


def test_brightness_is_kept_and_nought_erases():
    arena = brush.rectangle(FLOOR, 10, 10, 60, 40, "wood")
    assert arena.brightness[10:40, 10:60].min() == arena.brightness.max() == 190
    assert np.count_nonzero(arena.brightness) == 50 * 30
    arena = brush.line(arena, [(0, 25), (WIDTH, 25)], width_mm=4, brightness=0)
    assert np.count_nonzero(arena.brightness) == 50 * 26
    assert not FLOOR.brightness.any()
    for corners in ((3.6, 3.6, 4.4, 4.4), (-50, -50, -10, -10), (10, 10, 20, 20, 0)):
        assert brush.rectangle(FLOOR, *corners) is FLOOR, "what changes nothing is the same arena"


def test_what_cannot_be_painted():
    for stroke, width, words in (
        ([], 3, "the number of points"),
        ([(0, 0)] * (POINTS_MAX + 1), 3, "the number of points"),
        ([(0, math.inf)], 3, "y_mm must be"),
        ([(0, 1)], 0, "width_mm"),
    ):
        refused(words, partial(brush.line, FLOOR, stroke, width_mm=width))
    refused("brightness", brush.rectangle, FLOOR, 0, 0, 5, 5, 256)
    refused("wood", brush.rectangle, FLOOR, 0, 0, 5, 5, "wod")
    refused("floor", brush.rectangle, FLOOR, 0, 0, WIDTH, HEIGHT, error=ArenaError)
