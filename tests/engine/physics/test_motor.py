"""The motors keep the promises of khepera-protocol.md section 6, and nothing makes them run away."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.engine.same_walls import wide_floor

SPEEDS = st.integers(-127, 127)


@pytest.fixture
def world(make_world):
    """A robot on an open floor."""
    return make_world(wide_floor(1500)).place(750.0, 750.0, 0.3)


def spin(world, ticks):
    """Let ticks pass without ever reaching a wall: the robot is carried back to the middle."""
    for _ in range(ticks):
        world.tick()
        if max(abs(world.robot["x_mm"] - 750), abs(world.robot["y_mm"] - 750)) > 600:
            world.place(750.0, 750.0, world.pose[2])


@settings(derandomize=True, max_examples=share(20, 40))
@given(left=st.integers(-115, 115), right=st.integers(-115, 115))
def test_speed_reaches_its_command_in_about_five_ticks_and_on_average_exactly(make_world, left, right):
    """Near full power there is nothing left to control with."""
    world = make_world(wide_floor(1500)).place(750.0, 750.0)
    world.speed(left, right)
    for ticks, least, part in ((5, 2.0, 0.3), (55, 1.0, 0.03)):
        spin(world, ticks)
        for reached, command in zip(world.robot["motor_speed"], (left, right), strict=True):
            assert reached == pytest.approx(command, abs=max(least, part * abs(command)))
    spin(world, 140)
    start = world.counters
    spin(world, 400)
    for before, after, command in zip(start, world.counters, (left, right), strict=True):
        assert (after - before) / 400 == pytest.approx(command, abs=0.02)


@settings(derandomize=True, max_examples=share(15, 30))
@given(left=SPEEDS, right=SPEEDS, mode=st.sampled_from(["speed", "pwm", "position"]))
def test_mirror_symmetry_to_the_bit_and_power_drives_backwards_as_forwards(make_world, left, right, mode):
    one, other, back = (make_world(wide_floor(1500)).place(750.0, 750.0) for _ in range(3))
    left, right = (round(speed * {"speed": 1, "pwm": 255 / 127, "position": 5}[mode]) for speed in (left, right))
    getattr(one, mode)(left, right)
    getattr(other, mode)(right, left)
    getattr(back, mode)(-left, -right)
    for _ in range(60):
        for each in (one, other, back):
            each.tick()
        assert one.robot["wheel_pulses"].tolist() == other.robot["wheel_pulses"][::-1].tolist()
        assert one.pose[2] == -other.pose[2]
        if mode == "pwm":
            assert one.robot["wheel_pulses"].tolist() == (-back.robot["wheel_pulses"]).tolist()


@pytest.mark.parametrize("sign", [1, -1])
def test_trapezoid_takes_as_long_as_the_table_says(world, sign):
    """khepera-protocol.md 6.2: within 5 ticks; at rest within 2 pulses of the target half a second later."""
    for pulses, duration_ticks in ((10, 13), (100, 40), (1000, 126), (1600, 160), (2000, 180), (10000, 580)):
        world.set_counters(0, 0)
        world.position(sign * pulses, -sign * pulses)
        ticks = 0
        while not (world.status[0] and world.status[3]):
            world.tick()
            ticks += 1
            assert ticks < 1000
        assert abs(ticks - duration_ticks) <= 5
        world.tick(50)
        assert world.counters == pytest.approx((sign * pulses, -sign * pulses), abs=2)
        assert world.status[1] == world.status[4] == 1
        assert abs(world.status[2]) <= 2
        held = world.counters
        world.tick(500)
        assert world.counters == pytest.approx(held, abs=2)


def test_status_tells_mode_and_arrival(world):
    assert world.status == (0, 0, 0, 0, 0, 0)
    world.speed(10, -10)
    assert world.status == (0, 0, 10, 0, 0, -10)
    world.tick(30)
    assert world.status[:2] == (0, 0)
    world.position(*world.counters)
    assert world.status[:2] == (0, 1)
    world.tick(200)
    assert (world.status[0], world.status[3]) == (1, 1)
    world.pwm(50, 50)
    assert world.status == (0, 2, 0, 0, 2, 0)


@settings(derandomize=True, max_examples=share(15, 45))
@given(
    mode=st.sampled_from([("speed", 1), ("pwm", 2), ("position", 50)]),
    first=st.integers(-60, 60),
    target=st.integers(-3000, 3000),
    ticks=st.integers(0, 80),
)
def test_a_move_arrives_whatever_ran_before(make_world, mode, first, target, ticks):
    world = make_world(wide_floor(1500)).place(750.0, 750.0)
    name, scale = mode
    getattr(world, name)(first * scale, -first * scale)
    world.tick(ticks)
    world.position(target, -target, ticks=1500)
    assert (world.status[0], world.status[3]) == (1, 1)
    assert world.counters == pytest.approx((target, -target), abs=2)


def test_a_move_to_the_same_place_stirs_nothing_and_a_new_profile_holds_for_the_move_in_progress(world):
    world.position(500, -500, ticks=300)
    before = world.counters
    world.position(500, -500)
    assert world.status[0] == 0
    world.tick(100)
    assert world.status[0] == 1
    assert world.counters == pytest.approx(before, abs=1)
    for speed, acceleration in ((1, 1), (5, 255), (127, 255), (60, 30)):
        world.set_counters(0, 0)
        world.robot["profile_speed"][:], world.robot["profile_acceleration"][:] = 20, 64
        world.position(3000, -3000, ticks=60)
        world.robot["profile_speed"][:], world.robot["profile_acceleration"][:] = speed, acceleration
        world.tick(90)
        assert abs(world.robot["trajectory_speed"][0]) <= max(speed, 15)
        world.tick(6000)
        assert world.counters == pytest.approx((3000, -3000), abs=3)


def test_setting_the_counters_moves_nothing_while_holding_and_shifts_a_move(make_world):
    for target, ticks, counters in (((300, 300), 300, (0, -12345)), ((1500, 900), 40, (7000, -9))):
        one, other = (make_world(wide_floor(1500)).place(750.0, 750.0) for _ in range(2))
        for world in (one, other):
            world.position(*target, ticks=ticks)
        shift = [new - old for new, old in zip(counters, one.counters, strict=True)]
        one.set_counters(*counters)
        assert one.counters == counters
        for _ in range(300):
            one.tick()
            other.tick()
            assert one.pose == other.pose
            assert one.robot["wheel_pulses"].tolist() == other.robot["wheel_pulses"].tolist()
            assert target == (1500, 900) or (one.status[0], one.status[3]) == (1, 1)
        assert [a - b for a, b in zip(one.counters, other.counters, strict=True)] == shift


def test_full_power_is_the_free_speed_and_little_power_none(world):
    world.pwm(255, 8, ticks=100)
    assert world.robot["motor_speed"].tolist() == pytest.approx([127.0, 0.0], abs=1e-9)
    world.pwm(9, -9, ticks=100)
    assert world.robot["motor_speed"].tolist() == pytest.approx([127 / 247, -127 / 247], abs=1e-6)


@pytest.mark.parametrize("edge", [2**31 - 1, -(2**31)])
def test_holding_at_the_overflow_of_the_counters_stays_put(world, edge):
    """The error is counted over the edge: a wheel that goes one pulse over it does not run off to bring back 2^32."""
    world.set_counters(2**31 - 1, -(2**31))
    world.speed(10, -10, ticks=100)
    moved = world.robot["pulse_count"]
    assert world.counters == (-(2**31) + moved[0] - 1, 2**31 + moved[1])
    world.set_counters(0, 0)
    world.position(200, 200, ticks=200)
    world.set_counters(edge, edge)
    before = world.robot["wheel_pulses"].copy()
    world.robot["wheel_pulses"] += 3.0 * math.copysign(1.0, edge)  # an outside push turns the wheels
    world.tick(300)
    assert np.abs(world.robot["wheel_pulses"] - before).max() <= 4.0
    world.robot["trajectory_pulses"] += 5.0 * math.copysign(1.0, edge)
    world.tick(300)
    assert abs(world.status[2]) <= 3
    world.set_counters(0, 0)
    world.position(100, 100, ticks=300)
    assert world.counters == pytest.approx((100, 100), abs=2)


@pytest.mark.parametrize("gains", [(0, 0, 0), (32767, 32767, 32767), (32767, 0, 0), (0, 32767, 0), (0, 0, 32767)])
@pytest.mark.parametrize("mode", ["speed", "position"])
def test_no_gains_blow_up(world, gains, mode):
    world.robot["speed_gains"] = world.robot["position_gains"] = gains
    getattr(world, mode)(100, -100)
    world.tick(50_000)
    world.set_counters(2**31 - 1, -(2**31))
    getattr(world, mode)(-(2**23), 2**23)
    world.tick(50_000)
    for name in ("wheel_pulses", "motor_speed", "trajectory_pulses", "x_mm", "heading_rad"):
        assert np.isfinite(world.robot[name]).all()
    assert np.abs(world.robot["motor_speed"]).max() <= 127.0
    assert np.abs(world.robot["pwm"]).max() <= 255
    assert np.abs(world.robot["error_sum"]).max() < 2**45


def test_an_integrator_that_is_too_full_empties_again(world):
    """Without gains it fills up unseen. With gains again the wheels must not run at full power for ever."""
    gains = world.robot["speed_gains"].copy()
    world.robot["speed_gains"] = (0, 0, 0)
    world.speed(20, -20, ticks=1000)
    world.robot["speed_gains"] = gains
    world.tick(1000)
    start = world.counters
    world.tick(100)
    assert (world.counters[0] - start[0]) / 100 == pytest.approx(20, abs=0.5)


def test_slow_speeds_are_smooth(world):
    for speed in (1, 2, 3):
        world.speed(speed, speed, ticks=300)
        for _ in range(300):
            world.tick()
            assert 0.5 * speed < world.robot["motor_speed"][0] < 1.6 * speed
            assert abs(world.robot["measured_speed"][0] - speed) <= 1
