"""Free motion is the exact arc, and a moment within a tick lies on it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.engine.same_walls import wide_floor

from kiks.engine.compiling import entry
from kiks.engine.physics.contact import Ground, clearance_mm
from kiks.engine.physics.motion import move, pose_between, remember_pose
from kiks.model.arena import PAD

pytestmark = pytest.mark.slow

PULSE, BASE = 0.08, 53.0
PATHS = st.floats(-130.0, 130.0)


@entry
def _drive(robots, kinds, field, paths):
    ground, robot = Ground(field, 1.0, PAD), robots[0, 0]
    for tick in range(paths.shape[0]):
        remember_pose(robot)
        room_mm = clearance_mm(ground, robot.x_mm, robot.y_mm)
        move(ground, robot, kinds[0], paths[tick, 0], paths[tick, 1], room_mm, 0.1)


@entry
def _between(robots, ticks_ago, share):
    return pose_between(robots[0, 0], ticks_ago, share)


def drive(world, paths):
    _drive(world.state.robots, world.kinds, wide_floor(1000).clearance, np.asarray(paths, float).reshape(-1, 2))


def arc(pose, left, right):
    """Return the end of the exact arc, from its centre of turning; libm, no series, no chord."""
    x, y, heading = pose
    path, turn = (left + right) / 2 * PULSE, (right - left) * PULSE / BASE
    if abs(turn) < 1e-7:
        return x + path * math.cos(heading + turn / 2), y + path * math.sin(heading + turn / 2), heading + turn
    r = path / turn
    return (
        x + r * (math.sin(heading + turn) - math.sin(heading)),
        y - r * (math.cos(heading + turn) - math.cos(heading)),
        heading + turn,
    )


@pytest.mark.parametrize("seed", range(share(1, 4)))
def test_thousands_of_ticks_follow_the_closed_form(make_world, seed):
    """Within 1e-6 mm and 1e-9 rad."""
    rng = np.random.default_rng(seed)
    paths = np.cumsum(rng.normal(0, 3, (share(1000, 5000), 2)), axis=0)
    paths = 100 * np.sin(paths / 50)
    world = make_world(wide_floor(1000)).place(500.0, 500.0, 1.0)
    pose = world.pose
    for left, right in paths:
        ahead = arc(pose, left, right)
        if max(abs(ahead[0] - 500), abs(ahead[1] - 500)) > 400:
            pose = 500.0, 500.0, pose[2]
            world.place(*pose)
            ahead = arc(pose, left, right)
        drive(world, (left, right))
        pose = ahead
        assert world.pose[:2] == pytest.approx(pose[:2], rel=0, abs=1e-6)
        assert world.pose[2] == pytest.approx(pose[2], rel=0, abs=1e-9)
    assert world.robot["contact_count"] == 0
    assert world.robot["wheel_pulses"] == pytest.approx(paths.sum(axis=0), abs=1e-6)


def test_power_follows_the_closed_form_of_the_lag(make_world):
    """A step of power: w(t) = u (1 - exp(-t/T)), path u (t - T (1 - exp(-t/T))) (khepera-protocol.md 6.4)."""
    world = make_world(wide_floor(1000)).place(500.0, 500.0)
    world.pwm(200, 120)
    final = [127.0 * (power - 8) / 247 for power in (200, 120)]
    for tick in range(1, 150):
        world.tick()
        decay = math.exp(-tick / 2.5)
        path = [u * (tick - 2.5 * (1 - decay)) for u in final]
        assert world.robot["wheel_pulses"] == pytest.approx(path, abs=1e-9)
        assert world.pose[2] == pytest.approx((path[1] - path[0]) * PULSE / BASE, abs=1e-9)


@settings(derandomize=True, max_examples=share(50, 200))
@given(left=PATHS, right=PATHS, heading=st.floats(-50.0, 50.0), share=st.floats(0.0, 1.0))
def test_a_moment_within_a_tick_is_where_a_part_of_the_paths_leads(make_world, left, right, heading, share):
    whole = make_world(wide_floor(1000)).place(500.0, 500.0, heading)
    part = make_world(wide_floor(1000)).place(500.0, 500.0, heading)
    drive(whole, (left, right))
    drive(part, (left * share, right * share))
    assert _between(whole.state.robots, 0, share) == pytest.approx(part.pose, rel=0, abs=1e-9)


@settings(derandomize=True, max_examples=share(30, 100))
@given(paths=st.lists(st.tuples(PATHS, PATHS), min_size=3, max_size=3), ticks_ago=st.integers(0, 2))
def test_both_ends_of_a_tick_are_exact(make_world, paths, ticks_ago):
    world = make_world(wide_floor(1000)).place(500.0, 500.0, 0.4)
    ends = [world.pose]
    for path in paths:
        drive(world, path)
        ends.append(world.pose)
    for part, end in ((0.0, ends[-2 - ticks_ago]), (1.0, ends[-1 - ticks_ago])):
        assert _between(world.state.robots, ticks_ago, part) == pytest.approx(end, rel=0, abs=1e-12)


@settings(derandomize=True, max_examples=share(50, 100))
@given(left=PATHS, right=PATHS)
def test_pieces_near_a_wall_add_up_to_the_same_arc(make_world, left, right):
    """The arc is cut where a wall is near; without a contact that changes nothing."""
    world = make_world(wide_floor(1000)).place(54.0, 500.0, 0.2)
    drive(world, (left, right))
    if not world.robot["is_touching"]:
        assert world.pose == pytest.approx(arc((54.0, 500.0, 0.2), left, right), rel=0, abs=1e-9)
