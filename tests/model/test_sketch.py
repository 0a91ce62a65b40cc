"""Arenas that are drawn: every stroke against a slow oracle, its mirror image, and the way back."""

import io
import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from tests.at_length import at_length

from kiks.errors import ArenaError, ParameterError
from kiks.model.arena import Arena, Ball, Cylinder, Lamp, Pose
from kiks.model.free_disc import room_mm
from kiks.model.sketch import POINTS_MAX, Sketch
from kiks.model.sketch_history import BYTES_MAX, STEPS_MAX
from kiks.model.sketch_things import SketchRobot

WIDTH, HEIGHT = 120, 100

on_grid = st.integers(-64 * 20, 64 * 140).map(lambda units: units / 64)
points = st.tuples(on_grid, on_grid)
widths = st.integers(1, 64 * 40).map(lambda units: units / 64)


def floor(width: int = WIDTH, height: int = HEIGHT, **places: object) -> Arena:
    return replace(Arena.from_array(np.zeros((height, width), np.uint8), name="floor"), **places)


def blank() -> Sketch:
    """Return a sketch of floor alone, without the robot that would be in the way."""
    return Sketch(floor(), kinds=())


def is_near(x: Fraction, y: Fraction, a: tuple[float, float], b: tuple[float, float], width: float) -> bool:
    """Tell whether a place is at most half a width from a segment, in fractions."""
    ax, ay, bx, by = map(Fraction, (*a, *b))
    length_2 = (bx - ax) ** 2 + (by - ay) ** 2
    share = Fraction(0) if not length_2 else ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length_2
    share = min(max(share, Fraction(0)), Fraction(1))
    distance_2 = (x - ax - share * (bx - ax)) ** 2 + (y - ay - share * (by - ay)) ** 2
    return distance_2 <= (Fraction(width) / 2) ** 2


def painted_or_unchanged(draw) -> np.ndarray:
    """Return what a sketch shows after a drawing, nothing at all where that would have left no floor."""
    sketch = blank()
    try:
        draw(sketch)
    except ArenaError:
        return np.full((HEIGHT, WIDTH), 255)
    return sketch.brightness


@pytest.mark.slow
@settings(max_examples=25)
@given(points, points, widths)
def test_a_line_covers_what_is_near_it(a, b, width):
    shown = painted_or_unchanged(lambda sketch: sketch.line([a, b], width_mm=width))
    for row in range(0, HEIGHT, 7):
        for column in range(0, WIDTH, 3):
            x, y = Fraction(2 * column + 1, 2), Fraction(2 * row + 1, 2)
            assert (shown[row, column] == 255) == is_near(x, y, a, b, width)


@settings(max_examples=25)
@given(points, points, widths)
def test_lines_close_by_the_oracle_all_around(a, b, width):
    shown = painted_or_unchanged(lambda sketch: sketch.line([a, b], width_mm=width))
    edge = np.argwhere(shown ^ np.roll(shown, 1, axis=1))[:60]
    for row, column in edge:
        x, y = Fraction(2 * int(column) + 1, 2), Fraction(2 * int(row) + 1, 2)
        assert (shown[row, column] == 255) == is_near(x, y, a, b, width)


@settings(max_examples=40)
@given(points, points)
def test_a_rectangle_covers_centres_in_it(a, b):
    shown = painted_or_unchanged(lambda sketch: sketch.rectangle(*a, *b, 77))
    x, y = np.arange(WIDTH) + 0.5, np.arange(HEIGHT)[:, None] + 0.5
    inside = (min(a[0], b[0]) <= x) & (x <= max(a[0], b[0])) & (min(a[1], b[1]) <= y) & (y <= max(a[1], b[1]))
    assert inside.all() or np.array_equal(shown == 77, inside)


@settings(max_examples=40)
@given(st.lists(points, min_size=1, max_size=6), widths)
def test_mirrored_strokes_are_mirror_images(stroke, width):
    mirrored = [(WIDTH - x, y) for x, y in stroke]
    turned = [(WIDTH - x, HEIGHT - y) for x, y in stroke]
    shown = painted_or_unchanged(lambda sketch: sketch.line(stroke, width_mm=width))
    assert np.array_equal(shown[:, ::-1], painted_or_unchanged(lambda s: s.line(mirrored, width_mm=width)))
    assert np.array_equal(shown[::-1, ::-1], painted_or_unchanged(lambda s: s.line(turned[::-1], width_mm=width)))


@settings(max_examples=20)
@given(st.lists(points, min_size=2, max_size=5), widths)
def test_a_stroke_is_its_segments_together(stroke, width):
    whole = painted_or_unchanged(lambda sketch: sketch.line(stroke, width_mm=width))
    parts = [
        painted_or_unchanged(lambda sketch, k=k: sketch.line(stroke[k : k + 2], width_mm=width))
        for k in range(len(stroke) - 1)
    ]
    assert np.array_equal(whole > 0, np.any([part > 0 for part in parts], axis=0)) or (whole > 0).all()


def test_a_wide_arena_is_drawn_in_pieces():
    sketch = Sketch(floor(20_000, 150), kinds=())
    sketch.line([(10, 20), (19_990, 130)], width_mm=20)
    x, y = np.arange(20_000) + 0.5, np.arange(150)[:, None] + 0.5
    aside = np.abs((x - 10) * 110 - (y - 20) * 19_980) / math.hypot(110, 19_980)
    clear = (np.abs(aside - 10) > 1e-6) & (x > 30) & (x < 19_970)
    assert np.array_equal((sketch.brightness > 0)[clear], (aside < 10)[clear])


def test_brightness_is_kept_and_nought_erases():
    sketch = blank()
    sketch.rectangle(10, 10, 60, 40, "wood")
    assert sketch.brightness[10:40, 10:60].min() == sketch.brightness.max() == 190
    assert np.count_nonzero(sketch.brightness) == 50 * 30
    sketch.line([(0, 25), (WIDTH, 25)], width_mm=4, brightness=0)
    assert np.count_nonzero(sketch.brightness) == 50 * 26
    sketch.clear()
    assert not sketch.brightness.any()


def test_the_way_back_and_forth_is_exact():
    sketch = Sketch(Arena.box(300, 250))
    states = [(sketch.brightness.copy(), dict(sketch.things))]
    (robot,) = sketch.of(SketchRobot)
    for act in [
        lambda: sketch.rectangle(20, 20, 60, 60, 90),
        lambda: sketch.line([(20, 200), (200, 200)], width_mm=5.5),
        lambda: sketch.add(Ball(60, 160)),
        lambda: sketch.change(robot, SketchRobot(230, 60, 1.0)),
        lambda: sketch.add(Lamp(20, 20)),
        lambda: sketch.begin(Arena.maze(columns=3, rows=3, seed=4)),
        lambda: sketch.line([(440, 200)], width_mm=30, brightness=0),
        lambda: sketch.begin(Arena.box(400, 400, rounded_mm=50)),
        lambda: sketch.remove(max(sketch.add(SketchRobot(100, 100)), 0)),
    ]:
        act()
        states.append((sketch.brightness.copy(), dict(sketch.things)))
    for brightness, things in states[-3::-1]:
        if things == states[-1][1]:
            continue
        while not (np.array_equal(sketch.brightness, brightness) and sketch.things == things):
            assert sketch.undo()
    assert not sketch.can_undo
    assert not sketch.undo()
    while sketch.redo():
        pass
    assert np.array_equal(sketch.brightness, states[-1][0])
    assert sketch.things == states[-1][1]
    assert not sketch.can_redo


def test_a_new_step_forgets_what_was_taken_back():
    sketch = blank()
    sketch.rectangle(0, 0, 10, 10)
    assert sketch.undo()
    sketch.rectangle(50, 50, 60, 60)
    assert not sketch.redo()
    assert sketch.brightness[5, 5] == 0


def test_what_changes_nothing_is_no_step():
    sketch = blank()
    sketch.rectangle(3.6, 3.6, 4.4, 4.4)
    sketch.rectangle(-50, -50, -10, -10)
    sketch.rectangle(10, 10, 20, 20, 0)
    assert not sketch.can_undo


@at_length
def test_two_hundred_steps_in_a_large_arena_fit_in_memory():
    rng = np.random.default_rng(1)
    noise = rng.integers(0, 2, (1000, 1000)).astype(np.uint8)
    sketch = Sketch(Arena.from_array(noise * np.uint8(255)), kinds=())
    for step in range(200):
        x, y = rng.uniform(0, 1000, 2)
        sketch.line([(0, 0), (x, y), (1000, 1000)], width_mm=8, brightness=1 + step)
    assert sketch._history.size <= BYTES_MAX
    count = 0
    while sketch.undo():
        count += 1
    assert count == 200
    assert np.array_equal(sketch.brightness[::-1] > 0, noise > 0)


def test_steps_beyond_the_limit_are_forgotten(monkeypatch):
    from kiks.model import sketch_history

    monkeypatch.setattr(sketch_history, "BYTES_MAX", 1000)
    sketch = blank()
    for column in range(100):
        sketch.rectangle(column, 0, column + 1, 50, 1 + column)
    assert sketch._history.size <= 1000
    assert 0 < len(sketch._history.undoable) < 100 < STEPS_MAX


def test_a_wall_never_comes_over_what_stands_there():
    sketch = Sketch(floor(300, 300, starts=(Pose(100, 100, 0),), balls=(Ball(200, 200),), lamps=(Lamp(30, 250),)))
    before = sketch.brightness.copy()
    for draw, name in [
        (lambda: sketch.line([(100, 0), (100, 74)], width_mm=4), "robot 1 at"),
        (lambda: sketch.rectangle(50, 95, 300, 105), "robot 1 at"),
        (lambda: sketch.line([(0, 180), (300, 180)], width_mm=2), "ball 1 at"),
        (lambda: sketch.rectangle(0, 0, 300, 300), "floor"),
    ]:
        with pytest.raises(ArenaError, match=name):
            draw()
        assert np.array_equal(sketch.brightness, before)
        assert not sketch.can_undo
    sketch.rectangle(0, 0, 72, 300)
    sketch.rectangle(100, 100, 120, 110, 0)
    assert sketch.arena().lamps == (Lamp(30.0, 250.0),)


def test_the_room_is_that_of_the_arena():
    rng = np.random.default_rng(3)
    raster = Arena.box(300, 300, rounded_mm=90).brightness.copy()
    raster[rng.integers(100, 200, 40), rng.integers(100, 200, 40)] = 255
    arena = Arena(raster, 0.5, "a")
    for x, y in rng.uniform(-20, 170, (300, 2)):
        room, expected = room_mm(raster, 0.5, x, y, 30.0), arena.clearance_at_mm(x, y)
        if expected < 30 and 0 <= x < 150 and 0 <= y < 150:
            assert room == pytest.approx(expected, abs=1e-5)
        else:
            assert room >= 30 or expected < 0


@pytest.mark.parametrize(
    ("act", "error", "words"),
    [
        (lambda s: s.add(Ball(100, 100)), ArenaError, "robot 1 is"),
        (lambda s: s.add(SketchRobot(10, 200)), ArenaError, "a wall is"),
        (lambda s: s.add(SketchRobot(5, 200)), ArenaError, "floor"),
        (lambda s: s.add(SketchRobot(200, 200, 0.0, "kheperra")), ParameterError, "Did you mean"),
        (lambda s: s.add(Cylinder(200, 200, 5)), ParameterError, "radius_mm"),
        (lambda s: s.add(Ball(math.nan, 200)), ParameterError, "x_mm must be a number from -1e9"),
        (lambda s: s.add(Lamp(500, 10)), ArenaError, "inside the arena"),
        (lambda s: s.change(1, SketchRobot(5, 5)), ArenaError, "wall"),
        (lambda s: s.change(9, SketchRobot(5, 5)), ParameterError, "There are"),
        (lambda s: s.line([], width_mm=3), ParameterError, "points_mm"),
        (lambda s: s.line([(0, 0)] * (POINTS_MAX + 1), width_mm=3), ParameterError, "points_mm"),
        (lambda s: s.line([(0, math.inf)], width_mm=3), ParameterError, "A point"),
        (lambda s: s.line([(0, 1)], width_mm=0), ParameterError, "width_mm"),
        (lambda s: s.rectangle(0, 0, 5, 5, 256), ParameterError, "brightness"),
        (lambda s: s.rectangle(0, 0, 5, 5, "wod"), ParameterError, "wood"),
        (lambda s: s.picture(b"no picture"), ArenaError, "must be a picture"),
        (lambda s: s.begin(Arena.box(100, 100, wall_mm=30)), ArenaError, "room for robot 1"),
    ],
)
def test_what_cannot_be_changes_nothing(act, error, words):
    sketch = Sketch(Arena.box(300, 300))
    (robot,) = sketch.of(SketchRobot)
    sketch.note(robot, SketchRobot(100, 100))
    before, things = sketch.brightness.copy(), dict(sketch.things)
    with pytest.raises(error, match=words):
        act(sketch)
    assert np.array_equal(sketch.brightness, before)
    assert sketch.things == things
    assert not sketch.can_undo


def test_steps_back_wait_until_there_is_room():
    sketch = Sketch(floor(300, 300, starts=(Pose(60, 60, 0),)))
    sketch.rectangle(200, 200, 210, 300)
    sketch.rectangle(200, 200, 210, 300, 0)
    sketch.note(1, SketchRobot(205, 250))
    with pytest.raises(ArenaError, match="robot 1"):
        sketch.undo()
    assert not sketch.brightness.any()
    sketch.note(1, SketchRobot(60, 60))
    assert sketch.undo()
    assert sketch.brightness.any()


def test_a_picture_becomes_the_arena():
    picture = np.zeros((150, 200), np.uint8)
    picture[:10] = 200
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "PNG")
    sketch = Sketch(Arena.default(), kinds=("khepera", "khepera_ii"))
    sketch.picture(file.getvalue(), mm_per_pixel=2.0, name="mine")
    arena = sketch.arena()
    assert (arena.width_mm, arena.height_mm, arena.name) == (400, 300, "mine")
    assert (arena.brightness[-20:] == 200).all()
    assert len(arena.starts) == 2
    assert all(arena.free_for(start.x_mm, start.y_mm, 27.5) for start in arena.starts)
    assert math.dist(arena.starts[0][:2], arena.starts[1][:2]) >= 55


def test_a_maze_takes_the_first_robot_to_its_entrance():
    sketch = Sketch(Arena.default(), kinds=("khepera",) * 3)
    sketch.begin(Arena.maze(columns=3, rows=3))
    arena = sketch.arena()
    assert arena.starts[0] == Arena.maze(columns=3, rows=3).starts[0]
    assert arena.lamps == Arena.maze(columns=3, rows=3).lamps
    assert sketch.kinds == ("khepera",) * 3
