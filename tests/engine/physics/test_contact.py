"""Laws of the contact with walls, on random arenas and on purpose-made ones. Tolerances: measured, then rounded up."""

import math
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share

from kiks.engine.physics.motion import CONTACT_TICKS
from kiks.model.arena import Arena

PULSE, HALF_BASE = 0.08, 26.5


def wander(world, rng, ticks):
    """Drive at random, with speeds up to the largest and power up to full; yield after every tick."""
    for tick in range(ticks):
        if tick % 40 == 0:
            if rng.random() < 0.3:
                world.pwm(*rng.integers(-255, 256, 2).tolist())
            else:
                world.speed(*rng.integers(-127, 128, 2).tolist())
        world.tick()
        yield


def check_laws(make_world, arena, draw, ticks, heading_rad=None):
    rng = np.random.default_rng(draw)
    world = make_world(arena, seed=draw, body__wall_friction=(0.0, 0.2, 1.0)[draw % 3])
    start = arena.find_start(world.radius)
    world.place(start.x_mm, start.y_mm, rng.uniform(-4, 4) if heading_rad is None else heading_rad)
    pose, asked = np.array(world.pose), world.asked
    for _ in wander(world, rng, ticks):
        assert np.isfinite(world.pose).all()
        assert 0 < world.pose[0] < arena.width_mm
        assert 0 < world.pose[1] < arena.height_mm
        assert world.depth_mm() <= 0.25 * arena.mm_per_cell + 1e-3
        # Energy: u^2 + v^2 + (b/2)^2 q^2 of what the wheels asked for is (l^2 + r^2)/2; pieces add up by length.
        got = math.hypot(*(np.array(world.pose) - pose) * (1, 1, HALF_BASE))
        wanted = math.hypot(*(world.asked - asked) * PULSE) / math.sqrt(2)
        assert got <= 1.001 * wanted + 1e-4
        pose, asked = np.array(world.pose), world.asked


@settings(derandomize=True, max_examples=share(25, 250))
@given(number=st.integers(0, share(10_000, 1_000_000)), draw=st.integers(0, 2**32))
def test_no_penetration_and_no_energy_from_walls(make_world, make_random_arena, number, draw):
    check_laws(make_world, make_random_arena(number), draw, share(300, 500))


def test_a_pinch_does_not_shoot_the_robot_out(make_world, make_random_arena):
    """Between a post and a wall the way out along the gradient may be long."""
    for number, ticks in ((864, 90), (133, 170)):
        check_laws(make_world, make_random_arena(number), number, ticks, heading_rad=math.pi / 2)


def test_no_motion_without_command(make_world, make_random_arena):
    for number in range(share(8, 20)):
        arena = make_random_arena(number)
        world = make_world(arena).place(*arena.find_start(27.5))
        world.speed(40, 43, ticks=200)
        world.pwm(0, 0)
        world.robot["motor_speed"] = 0.0
        pose = world.pose
        world.tick(300)
        assert world.pose == pose


def images(make_world, arena):
    """Return a robot in an arena, in its mirror image and in the arena turned by a quarter."""
    start = arena.find_start(27.5)
    mirrored = Arena(np.ascontiguousarray(arena.brightness[::-1]), arena.mm_per_cell, "mirrored")
    turned = Arena(np.ascontiguousarray(np.rot90(arena.brightness, -1)), arena.mm_per_cell, "turned")
    heading = start.heading_rad + 0.3
    return (
        make_world(arena).place(start.x_mm, start.y_mm, heading),
        make_world(mirrored).place(start.x_mm, arena.height_mm - start.y_mm, -heading),
        make_world(turned).place(arena.height_mm - start.y_mm, start.x_mm, heading + math.pi / 2),
    )


@pytest.mark.slow
def test_mirror_and_quarter_turn(make_world, make_random_arena):
    """12 s with contacts stay symmetric; a pinch may decide by a rounding error, but hardly ever does."""
    errors, contacts = [], 0
    for number in range(share(10, 60)):
        arena = make_random_arena(number)
        world, mirror, turned = images(make_world, arena)
        rng = np.random.default_rng(number)
        worst = 0.0
        for _ in range(12):
            left, right = rng.integers(-60, 61, 2).tolist()
            world.speed(left, right)
            mirror.speed(right, left)
            turned.speed(left, right)
            for each in (world, mirror, turned):
                each.tick(100)
            x, y, heading = world.pose
            height = arena.height_mm
            worst = max(worst, *np.abs(np.subtract(mirror.pose, (x, height - y, -heading))))
            worst = max(worst, *np.abs(np.subtract(turned.pose, (height - y, x, heading + math.pi / 2))))
        errors.append(worst)
        contacts += world.robot["contact_count"]
    assert contacts > share(30, 200)
    assert np.quantile(errors, 0.95) < 1e-6
    assert max(errors) < 1.0


@pytest.mark.parametrize("speed", [2, 20, 100])
def test_head_on_it_stands_and_its_wheels_slip(make_world, speed):
    arena = Arena.box(500, 400)
    for heading in (0.0, 0.3, 1.2, -2.0):
        world = make_world(arena).place(300.0, 200.0, heading)
        world.speed(speed, speed, ticks=1000 + 40_000 // speed)
        pose, before = world.pose, world.counters
        for _ in range(1000):
            world.tick()
            assert math.dist(world.pose[:2], pose[:2]) < 0.05
            assert abs(world.pose[2] - pose[2]) < 1e-3
            assert world.status[2] >= 0.8 * speed - 1  # whole pulses: at low speed some ticks count one more
        for first, last in zip(before, world.counters, strict=True):
            assert 0.10 <= (last - first) / 1000 / speed <= 0.15


@pytest.mark.parametrize("angle_deg", [5, 10, 20, 30, 40])
def test_without_friction_it_slides_by_the_cosine_and_the_larger_it_is_the_more_it_turns(make_world, angle_deg):
    arena, turned, heading = Arena.box(2000, 200), [], math.radians(angle_deg)
    for friction in (0.0, 0.05, 0.1, 0.2, 0.4):
        world = make_world(arena, body__wall_friction=friction).place(100.0, 162.4, heading)
        world.speed(20, 20, ticks=40)
        turned.append(world.pose[2] - heading)
        if friction == 0.0:
            world.tick(10)
            x, asked = world.pose[0], world.asked.mean()
            world.tick(200)
            made_good = (world.pose[0] - x) / ((world.asked.mean() - asked) * PULSE)
            assert made_good == pytest.approx(math.cos(heading), abs=1e-3)
            assert world.pose[2] == pytest.approx(heading, abs=1e-9)
    assert turned[0] == pytest.approx(0.0, abs=1e-9)
    assert all(more > less + 1e-4 for less, more in pairwise(turned))


@pytest.mark.parametrize("angle_deg", [90, 60, 30])
def test_corners_hold_without_jitter_and_let_go(make_world, angle_deg):
    rows, columns = np.mgrid[:500, :500] + 0.5
    is_floor = np.abs(rows - 250) <= (columns - 40) * math.tan(math.radians(angle_deg / 2))
    arena = Arena.from_array(np.where(is_floor, 0, 255))  # a corner with its tip at (40, 250), open to the right
    for turn, speed in product((0.0, 0.2, -0.5), (5, 127)):
        world = make_world(arena).place(300.0, 250.0, math.pi + turn)
        world.speed(speed, speed, ticks=2000 + 5000 // speed)
        poses = []
        for _ in range(1000):
            world.tick()
            poses.append(world.pose)
        assert np.ptp(poses, axis=0).max() < 0.05
        pose = world.pose
        back = make_world(arena).place(*pose)
        back.speed(-10, -10, ticks=60)
        assert math.dist(back.pose[:2], pose[:2]) > 25
        around = make_world(arena).place(*pose)
        around.speed(10, -10, ticks=200)
        assert around.pose[2] - pose[2] == pytest.approx((around.asked[1] - around.asked[0]) * PULSE / 53, abs=0.01)
        # From whatever way it faces: turn to the open side, and out.
        x, y, _ = around.pose
        out = make_world(arena).place(x, y, 0.0)
        out.speed(10, 10, ticks=60)
        assert math.dist(out.pose[:2], (x, y)) > 40


def passage(mm_per_pixel, width_mm):
    count, gap = int(400 / mm_per_pixel), round(width_mm / mm_per_pixel)
    picture = np.full((count, count), 255, np.uint8)
    picture[:, : int(170 / mm_per_pixel)] = 0
    first = (count - gap) // 2
    picture[first : first + gap] = 0
    return Arena.from_array(picture, mm_per_pixel=mm_per_pixel), 400 - (first + gap / 2) * mm_per_pixel


@pytest.mark.parametrize(("mm_per_pixel", "wide_mm", "narrow_mm"), [(0.5, 56, 54), (1.0, 56, 54), (2.5, 57.5, 52.5)])
def test_passages_a_little_wider_and_narrower(make_world, mm_per_pixel, wide_mm, narrow_mm):
    for width_mm, turn in product((wide_mm, narrow_mm), (0.0, 0.05)):
        arena, middle = passage(mm_per_pixel, width_mm)
        world = make_world(arena).place(100.0, middle, turn)
        world.speed(20, 20)
        for _ in range(400):
            world.tick()
            assert world.depth_mm() < 0.25
        assert (world.pose[0] > 300) == (width_mm == wide_mm)


@pytest.mark.parametrize("offset_mm", [2.0, 5.0, 15.0, 25.0])
def test_rolling_around_a_post_is_smooth(make_world, offset_mm):
    """Without friction the speed along the wall is v sin(angle to the normal)."""
    picture = np.zeros((300, 600), np.uint8)
    picture[150, 300] = 255
    world = make_world(Arena.from_array(picture), body__wall_friction=0.0).place(200.0, 149.5 + offset_mm, 0.0)
    world.speed(20, 20, ticks=20)
    touched = 0
    while world.pose[0] < 400:
        was_touching = world.robot["is_touching"] == CONTACT_TICKS
        before = world.pose
        world.tick()
        if was_touching and world.robot["is_touching"] == CONTACT_TICKS:
            touched += 1
            middle = np.add(before[:2], world.pose[:2]) / 2 - (300.5, 149.5)
            expected = 1.6 * middle[1] / np.hypot(*middle)
            assert math.dist(before[:2], world.pose[:2]) == pytest.approx(expected, rel=0.1)
    assert touched > 5


@pytest.mark.parametrize("angle_deg", [5, 20, 40])
def test_rolling_along_a_staircase_is_smooth(make_world, angle_deg):
    arena = Arena.from_array(np.triu(np.full((600, 600), 200, np.uint8)))
    heading = -math.pi / 4 + math.radians(angle_deg)
    world = make_world(arena, body__wall_friction=0.0).place(150.0, 400.0, heading)
    world.speed(20, 20)
    while not world.robot["is_touching"]:
        world.tick()
    world.tick(3)
    for _ in range(120):
        x, y, _ = world.pose
        world.tick()
        along = ((world.pose[0] - x) - (world.pose[1] - y)) / math.sqrt(2)
        assert along == pytest.approx(1.6 * math.cos(math.radians(angle_deg)), rel=0.15)


def test_a_move_into_a_wall_ends_and_keeps_its_error(make_world):
    world = make_world(Arena.box(500, 400)).place(400.0, 200.0, 0.0)
    world.position(3000, 3000)  # 240 mm, but there are 62 mm
    world.tick(500)
    made = (462.5 - 400) / PULSE
    on_target, mode, error = world.status[:3]
    assert (on_target, mode) == (1, 1)
    assert error == 3000 - world.counters[0]
    assert made < world.counters[0] < made + 0.15 * (3000 - made) + 3
    x = world.pose[0]
    world.tick(1000)
    assert world.pose[0] == pytest.approx(x, abs=1e-6)
    # The next move starts where the wheel is, and goes back without a leap.
    start = world.counters[0]
    world.position(start - 500, start - 500)
    fastest = 0.0
    for _ in range(300):
        before = world.pose[0]
        world.tick()
        fastest = max(fastest, abs(world.pose[0] - before))
    assert fastest < 20 * PULSE * 1.3
    assert world.counters[0] == pytest.approx(start - 500, abs=2)
    assert x - world.pose[0] == pytest.approx(500 * PULSE, abs=0.3)


def test_a_robot_put_down_a_hair_inside_a_wall_can_leave(make_world):
    """`Simulation.place` accepts a hundredth of a millimetre."""
    arena = Arena.box(500, 400)
    for heading in np.linspace(0, math.pi, 9):
        world = make_world(arena).place(462.509, 200.0, heading + math.pi / 2)
        world.speed(10, 10, ticks=60)
        assert math.dist(world.pose[:2], (462.5, 200.0)) > 10 * abs(math.sin(heading)) or heading in (0.0, math.pi)
        assert world.depth_mm() < 0.01
