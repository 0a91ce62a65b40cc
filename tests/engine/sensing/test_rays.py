"""A ray ends where the first wall square begins, whatever the arena."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.engine.sensing.followed_rays import cast_eight, cast_ray, cast_rays

from kiks.engine.sensing.rays import walls_of
from kiks.model.arena import PAD, Arena

pytestmark = pytest.mark.slow

TOLERANCE_MM = 0.02
CLIPPED_MM = 0.003  # a ray that cuts less than this off a corner may pass it by


def cast(arena, x, y, angle, reach=200.0):
    """Follow one ray, check where it ends, and return its length and the brightness it meets."""
    length, brightness = cast_ray(walls_of(arena), x, y, math.cos(angle), math.sin(angle), reach)
    check_ray(arena, x, y, angle, reach, length, brightness)
    return length, brightness


def check_ray(arena, x, y, angle, reach, length, brightness):
    surely, _ = crossings(arena, x, y, angle, shrink_mm=CLIPPED_MM)
    perhaps, shades = crossings(arena, x, y, angle, shrink_mm=-1e-6)
    latest = min(surely[0] if len(surely) else reach, reach)
    earliest = min(perhaps[0] if len(perhaps) else reach, reach)
    assert earliest - 1e-5 <= length <= latest + TOLERANCE_MM
    if length < reach:
        assert brightness in shades[np.abs(perhaps - length) <= 2 * TOLERANCE_MM]
    else:
        assert brightness == 0


@settings(derandomize=True, max_examples=share(10, 60))
@given(number=st.integers(0, 300), draw=st.integers(0, 2**32))
def test_rays_one_by_one_and_those_of_a_sensor_end_where_the_first_wall_begins(make_random_arena, number, draw):
    """From floor, from walls, and from corners of cells along edges and diagonals, where a rounding error decides."""
    arena = make_random_arena(number)
    rng = np.random.default_rng(draw)
    cell, walls = arena.mm_per_cell, walls_of(arena)
    for where in range(6):
        x, y = rng.uniform(1, arena.width_mm - 1), rng.uniform(1, arena.height_mm - 1)
        angle = rng.uniform(-7, 7, 8)
        if where % 2 == 1:
            x, y = (rng.integers(2, count - 2) * cell for count in arena.brightness.shape[::-1])
            angle = np.arange(8) * math.pi / 4 + (where == 3) * rng.uniform(-1e-3, 1e-3, 8)
        cast(arena, x, y, rng.choice(angle))
        reach, out = float(rng.uniform(0.0, 200.0)), np.empty((2, 8))
        directions = np.array([np.cos(angle), np.sin(angle)])
        cast_eight(walls, x * (1.0 / cell) + PAD, y * (1.0 / cell) + PAD, directions, reach / cell, out)
        for ray in range(8):
            length = out[0, ray] * cell if out[1, ray] > 0.0 else reach
            check_ray(arena, x, y, angle[ray], reach, length, out[1, ray])


@settings(derandomize=True, max_examples=share(10, 30))
@given(number=st.integers(0, 300), draw=st.integers(0, 2**32), count=st.sampled_from((8, 64, 96)))
def test_rays_in_lanes_are_rays_one_by_one(make_random_arena, number, draw, count):
    """To the bit, from floor, from walls and from outside, along the axes too."""
    arena = make_random_arena(number)
    rng = np.random.default_rng(draw)
    x, y = rng.uniform(-60, arena.width_mm + 60, count), rng.uniform(-60, arena.height_mm + 60, count)
    angle = rng.uniform(-math.pi, math.pi, count)
    cosine, sine = np.cos(angle), np.sin(angle)
    cosine[::5], sine[::5] = rng.choice([-1.0, 0.0, 1.0], 2)
    straight = (cosine == 0.0) == (sine == 0.0)
    cosine[straight], sine[straight] = 0.0, -1.0
    per_cell, walls, lengths = 1.0 / arena.mm_per_cell, walls_of(arena), np.empty(count)
    cast_rays(walls, x * per_cell + PAD, y * per_cell + PAD, cosine, sine, lengths)
    alone = [cast_ray(walls, *ray, 1e6)[0] for ray in zip(x, y, cosine, sine, strict=True)]
    assert (lengths * arena.mm_per_cell).tolist() == alone


@pytest.mark.parametrize("mm_per_pixel", [0.5, 1.0, 2.5])
def test_a_diagonal_of_pixels_is_tight(mm_per_pixel):
    """Pixels that touch at corners alone let no ray through but the one that aims at the corner itself."""
    count = int(200 / mm_per_pixel)
    arena = Arena.from_array(np.eye(count, dtype=np.uint8) * 200, mm_per_pixel=mm_per_pixel)
    for x in np.arange(60.013, 140.0, 0.37 * share(3, 1)):
        length, brightness = cast(arena, x, 20.0, math.pi / 4, 150.0)  # across: the diagonal falls to the right
        assert brightness == 200
        assert length < 100


def test_inside_a_wall_and_out_of_reach():
    arena = Arena.box(300, 300, brightness=77)
    assert cast(arena, 5.0, 150.0, 1.0) == (0.0, 77)
    for reach, end in ((100.0, (100.0, 0)), (139.9, (139.9, 0)), (150.0, (pytest.approx(140.0, abs=TOLERANCE_MM), 77))):
        assert cast(arena, 150.0, 150.0, 0.0, reach) == end
    assert cast(arena, 150.0, 150.0, math.pi / 2, 0.0) == (0.0, 0)
    walls, out = walls_of(arena), np.empty((2, 8))
    directions = np.array([np.cos(np.arange(8)), np.sin(np.arange(8))])
    for x, y, brightness in ((5.0, 150.0, 77.0), (-50.0, 150.0, 255.0), (150.0, 900.0, 255.0)):
        cast_eight(walls, x + PAD, y + PAD, directions, 60.0, out)
        assert out.tolist() == [[0.0] * 8, [brightness] * 8]


def crossings(arena, x, y, angle, *, shrink_mm=0.0):
    """Return where the ray enters every wall square that it meets, and the brightness of each, nearest first."""
    rows, columns = np.nonzero(arena.surface)
    cell = arena.mm_per_cell
    near, far = np.full(len(rows), -np.inf), np.full(len(rows), np.inf)
    for origin, direction, index in ((x, math.cos(angle), columns), (y, math.sin(angle), rows)):
        low, high = (index - PAD) * cell + shrink_mm - origin, (index - PAD + 1) * cell - shrink_mm - origin
        if direction == 0.0:
            outside = (low > 0) | (high < 0)
            near[outside], far[outside] = np.inf, -np.inf
            continue
        near = np.maximum(near, np.minimum(low / direction, high / direction))
        far = np.minimum(far, np.maximum(low / direction, high / direction))
    met = (far >= near) & (far >= 0)
    order = np.argsort(near[met], kind="stable")
    return np.maximum(near[met][order], 0.0), arena.surface[rows[met], columns[met]][order]
