"""Laws of robots, balls and cylinders that push and hit each other. Tolerances: measured, then rounded up."""

import math
from itertools import product

import numpy as np
import pytest
from tests.at_length import cases, share
from tests.engine.same_walls import wide_floor, with_things
from tests.piles import DEEPEST_MM, SHOVED_MM, Pile, calm, rush

from kiks import Arena, Simulation
from kiks.engine.physics import motor
from kiks.model.arena_objects import Ball, Cylinder, Pose

PULSE_MM = 0.08
ROBOT_MM, BALL_MM, CYLINDER_MM = 27.5, 32.0, 16.0

STEADY_S = 0.5
"""After this long, a motor turns at the speed it was told."""


class Company:
    """Robots at their poses, balls and cylinders (places, and what else they take), on a wide floor by default."""

    def __init__(self, robots=((1900.0, 1900.0, 0.0),), balls=(), cylinders=(), arena=None, **changes):
        self.sim = Simulation(
            with_things(
                arena or wide_floor(2000),
                starts=tuple(Pose(*robot) for robot in robots),
                balls=tuple(Ball(*ball) for ball in balls),
                cylinders=tuple(Cylinder(*cylinder) for cylinder in cylinders),
            ),
            robots=len(robots),
            **changes,
        )

    def speed(self, robot, left, right=None):
        self.sim.sync()
        motor.set_speed(self.sim.world.state.robots, 0, robot - 1, left, left if right is None else right)

    def drive(self, robot, speed, seconds):
        self.speed(robot, speed)
        self.run(seconds)

    def roll(self, body, velocity_x, velocity_y=0.0):
        self.bodies["velocity_x"][body - 1], self.bodies["velocity_y"][body - 1] = velocity_x, velocity_y

    def run(self, seconds):
        self.sim.run(seconds)
        self.sim.sync()

    def tick(self, count=1):
        for _ in range(count):
            self.run(0.01)
            yield

    @property
    def bodies(self):
        return self.sim.world.state.bodies[0]

    @property
    def places(self):
        return np.column_stack([self.bodies["x_mm"], self.bodies["y_mm"]])

    @property
    def velocities(self):
        return np.column_stack([self.bodies["velocity_x"], self.bodies["velocity_y"]])

    @property
    def speeds(self):
        return np.hypot(*self.velocities.T)

    def wheels(self, robot):
        return self.sim.world.state.robots["wheel_pulses"][0, robot - 1].copy()


@pytest.mark.slow
@pytest.mark.parametrize("number", cases([95, 97, 2, 0, 1, 3, 4, 5, 6, 7], 3))
def test_things_in_a_pile_up_do_not_overlap(number):
    """In 95 and 97 a robot once pushed a ball 4 mm deep into a post. All 1000: benchmarks/pileups.py."""
    pile = Pile.make(number)
    assert max(rush(pile, 5000)) <= DEEPEST_MM
    overlap, depth, moved = calm(pile, 1000)
    assert max(overlap, depth) <= DEEPEST_MM
    assert moved <= SHOVED_MM


@pytest.mark.slow
def test_bodies_at_rest_stay_at_rest():
    pile = Pile.make(5)
    rush(pile, 1000)
    calm(pile, 100)
    pile.sim.run(60.0)
    pile.sim.sync()
    assert pile.energy() == 0.0
    before = pile.discs()
    pile.sim.run(5.0)
    pile.sim.sync()
    assert (pile.discs() == before).all()


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "friction"), [("balls", 20.0), ("cylinders", 160.0)])
def test_a_body_rolls_as_far_as_its_friction_lets_it(kind, friction):
    arena = Arena.box(4600, 300)
    for speed in (10.0, 37.0, 170.0, 400.0):
        company = Company(robots=[(60.0, 150.0, 0.0)], arena=arena, **{kind: [(300.0, 150.0)]})
        company.roll(1, speed)
        company.run(speed / friction - 0.02)
        assert company.speeds[0] == pytest.approx(0.02 * friction, abs=0.011 * friction)
        company.run(1.0)
        assert company.speeds[0] == 0.0
        assert company.places[0, 0] - 300.0 == pytest.approx(speed**2 / (2 * friction), rel=1e-9, abs=1e-9)
        assert company.places[0, 1] == 150.0


@pytest.mark.parametrize("speed", [30.0, 1000.0])
def test_off_a_wall_a_quarter_of_the_speed_across_comes_back_and_off_a_robot_that_stands(speed):
    for angle_deg in (0, 20, 45, 70, 85):
        cosine, sine = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
        company = Company(balls=[(1957.0, 1000.0, BALL_MM, 0.0)])
        company.roll(1, speed * cosine, speed * sine)
        for _ in company.tick(100):
            if company.velocities[0, 0] < 0.0:
                break
        assert company.velocities[0] == pytest.approx((-0.25 * speed * cosine, speed * sine), rel=1e-6)
    company = Company(robots=[(1000.0, 1000.0, 0.7)], balls=[(900.0, 1000.0, BALL_MM, 0.0)])
    company.roll(1, 200.0)
    company.run(0.5)
    assert company.velocities[0] == pytest.approx((-50.0, 0.0), abs=1e-9)
    assert company.sim.pose(1) == (1000.0, 1000.0, 0.7)


@pytest.mark.parametrize("angle_deg", [0, 30, 80])
def test_a_ball_does_not_get_through_a_wall_of_one_cell(angle_deg):
    picture = np.zeros((800, 1200), np.uint8)
    picture[:, 600] = 255  # upright, as long as the floor
    arena = Arena.from_array(picture, mm_per_pixel=0.5)
    for offset in np.linspace(0.0, 20.0, 9).tolist():
        company = Company(robots=[(500.0, 100.0, 0.0)], balls=[(200.0 + offset, 70.0, 10.0, 0.0)], arena=arena)
        company.roll(1, 1000.0 * math.cos(math.radians(angle_deg)), 1000.0 * math.sin(math.radians(angle_deg)))
        for _ in company.tick(100):
            assert company.places[0, 0] <= 290.0 + DEEPEST_MM


@pytest.mark.parametrize(("what", "radius"), [("robot", ROBOT_MM), ("ball", BALL_MM), ("cylinder", CYLINDER_MM)])
def test_a_fast_ball_hits_an_obstacle_in_its_way(what, radius):
    """Dead on and grazing: the ball hits the obstacle and never overlaps it."""
    here = (1000.0, 1000.0)
    for offset, start in product(np.linspace(-1.0, 1.0, share(5, 11)).tolist(), (0.0, 3.3, 7.7)):
        ball = (800.0 + start, 1000.0 + offset * (radius + BALL_MM - 2.0), BALL_MM, 0.0)
        company = Company(
            robots=[(*here, 0.3)] if what == "robot" else [(1900.0, 1900.0, 0.0)],
            balls=[ball] if what != "ball" else [ball, here],
            cylinders=[here] if what == "cylinder" else [],
        )
        company.roll(1, 1000.0)
        for _ in company.tick(40):
            target = company.sim.pose(1)[:2] if what == "robot" else company.places[1]
            assert math.dist(company.places[0], target) >= radius + BALL_MM - DEEPEST_MM
        assert abs(company.velocities[0, 1]) > 1.0 or offset == 0.0
        assert company.velocities[0, 0] < 1000.0


def test_small_bodies_at_full_speed_meet():
    company = Company(balls=[(500.0, 1000.0, 10.0, 0.0), (700.0, 1000.0, 10.0, 0.0)])
    company.roll(1, 1000.0)
    company.roll(2, -1000.0)
    for _ in company.tick(50):
        assert company.places[1, 0] - company.places[0, 0] >= 20.0 - DEEPEST_MM


@pytest.mark.parametrize("kinds", [("balls", "balls"), ("balls", "cylinders"), ("cylinders", "cylinders")])
def test_hits_keep_momentum_and_give_back_95_percent(kinds):
    for speed, aside in product((50.0, 300.0, 1000.0), (0.0, 10.0, 25.0)):
        places = {"balls": [], "cylinders": []}
        for number, kind in enumerate(kinds):
            radius = BALL_MM if kind == "balls" else CYLINDER_MM
            places[kind].append((800.0 + 80.0 * number, 1000.0 + aside * number, radius, 0.0))
        company = Company(**places)
        company.roll(1, speed)
        company.roll(2, -0.3 * speed, 0.1 * speed)
        before = company.velocities.copy()
        for _ in company.tick(300):
            if (company.velocities != before).any():
                break
        after = company.velocities
        assert after.sum(axis=0) == pytest.approx(before.sum(axis=0), rel=1e-12, abs=1e-9)
        normal = after[1] - before[1]
        normal /= np.hypot(*normal)
        relative = (before[0] - before[1]) @ normal
        assert (after[1] - after[0]) @ normal == pytest.approx(0.95 * relative, rel=1e-9)
        along = np.array([-normal[1], normal[0]])
        assert after @ along == pytest.approx(before @ along, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("speed", [10, 50, 127])
def test_a_robot_kicks_a_ball_at_nearly_its_own_speed(speed):
    company = Company(robots=[(300.0, 1000.0, 0.0)], balls=[(900.0, 1000.0, BALL_MM, 0.0)])
    company.speed(1, speed)
    for _ in company.tick(6000 // speed * 100):
        if company.speeds[0] > 0.0:
            break
    robot = company.sim.world.state.robots[0, 0]
    true_speed = (robot["x_mm"] - robot["trail"][0, 0]) / 0.01
    assert company.velocities[0] == pytest.approx((0.975 * true_speed, 0.0), abs=0.2)  # it may have rolled for a tick


def test_a_row_of_balls_passes_a_hit_on():
    """Newton's cradle: the last leaves with what four hits leave, 0.975^4; whatever numbers the balls have."""
    places = [(600.0, 1000.0), *((700.0 + 64.0 * k, 1000.0) for k in range(4))]
    for order in ((0, 1, 2, 3, 4), (4, 3, 2, 1, 0), (2, 0, 4, 1, 3)):
        company = Company(balls=[(*places[k], BALL_MM, 0.0) for k in order])
        first, last = order.index(0), order.index(4)
        company.roll(first + 1, 300.0)
        company.run(0.4)
        assert company.velocities[last] == pytest.approx((0.975**4 * 300.0, 0.0), rel=1e-6)
        assert company.velocities.sum(axis=0) == pytest.approx((300.0, 0.0), rel=1e-9)
        assert company.speeds[first] < 0.03 * 300.0


def test_a_cylinder_keeps_no_speed_from_a_push_and_a_ball_pushed_along_is_one_contact():
    company = Company(robots=[(300.0, 1000.0, 0.0)], cylinders=[(400.0, 1000.0)])
    company.drive(1, 60, 1.0)
    assert company.places[0, 0] > 450.0
    assert company.speeds[0] == 0.0
    company.drive(1, 0, STEADY_S)
    stands = company.places.copy()
    company.run(1.0)
    assert company.places == pytest.approx(stands, abs=0.01)  # the motor creeps
    company = Company(robots=[(300.0, 1000.0, 0.0)], balls=[(362.0, 1000.0)])
    company.drive(1, 20, 2.0)  # at first it runs ahead of a robot that was faster for a moment
    contacts = company.sim.contacts(1)
    company.run(7.0)
    assert company.sim.contacts(1) == contacts <= 3


@pytest.mark.parametrize("speed", [1, 5, 40, 127])
def test_a_movable_thing_does_not_slow_a_robot(speed):
    """Pushing a cylinder, it comes exactly as far as alone, its wheels turn as fast, and it is one contact."""
    alone, pushing = (Company(robots=[(555.0, 1000.0, 0.0)], cylinders=each) for each in ([], [(600.0, 1000.0)]))
    for company in (alone, pushing):
        company.drive(1, speed, 40.0 / speed + 1.0)
    assert pushing.sim.pose(1) == pytest.approx(alone.sim.pose(1), abs=1e-9)
    assert pushing.wheels(1) == pytest.approx(alone.wheels(1), abs=1e-9)
    assert (alone.sim.contacts(1), pushing.sim.contacts(1)) == (0, 1)


def slips(company, robot, speed, before):
    """Tell whether the wheels of a robot that does not get on have turned at 10 to 15 % of its speed for 10 s."""
    part = (company.wheels(robot) - before) / 1000 / speed
    return 0.10 <= part.min() <= part.max() <= 0.15


@pytest.mark.parametrize(("body", "radius"), [("balls", BALL_MM), ("cylinders", CYLINDER_MM)])
def test_a_blocked_thing_stops_a_robot(body, radius):
    """Against a wall: it stands, its wheels slip, and it drives out backwards unhindered."""
    for speed in (5, 20, 100):
        x = 1990.0 - radius
        company = Company(robots=[(x - radius - ROBOT_MM - 20.0, 1000.0, 0.0)], **{body: [(x, 1000.0)]})
        company.drive(1, speed, 40.0 / speed + 2.0)
        pose, before, contacts = company.sim.pose(1), company.wheels(1), company.sim.contacts(1)
        company.run(10.0)
        assert math.dist(company.sim.pose(1)[:2], pose[:2]) < 0.05
        assert slips(company, 1, speed, before)
        assert company.sim.contacts(1) == contacts
        company.drive(1, -speed, STEADY_S)
        x_mm = company.sim.pose(1)[0]
        company.run(1.0)
        assert x_mm - company.sim.pose(1)[0] == pytest.approx(speed * PULSE_MM * 100, rel=0.02, abs=0.5)
        assert pose[0] - company.sim.pose(1)[0] > 0.5 * speed * PULSE_MM * 100


def test_two_robots_head_on_stand_still():
    company = Company(robots=[(900.0, 1000.0, 0.0), (1000.0, 1000.0, math.pi)])
    company.speed(1, 30)
    company.drive(2, 30, 2.0)
    poses, before = company.sim.poses(), [company.wheels(1), company.wheels(2)]
    company.run(10.0)
    assert company.sim.poses() == pytest.approx(poses, abs=0.05)
    for robot in (1, 2):
        assert slips(company, robot, 30, before[robot - 1])
        assert company.sim.contacts(robot) == 1


def test_a_robot_shoves_another_at_half_its_speed():
    company = Company(robots=[(900.0, 1000.0, 0.0), (960.0, 1000.0, 1.0)])
    company.drive(1, 40, 1.0)
    before = company.sim.poses()
    company.run(2.0)
    moved = company.sim.poses() - before
    assert moved[:, 0] == pytest.approx([40 * PULSE_MM * 100] * 2, rel=0.01)
    assert moved[1, 2] == 0.0
    assert (company.wheels(2) == 0.0).all()


@pytest.mark.parametrize("aside", [30.0, 45.0, 54.0])
def test_robots_that_graze_slide_past_each_other(aside):
    company = Company(robots=[(800.0, 1000.0, 0.0), (1000.0, 1000.0 + aside, math.pi)])
    company.speed(1, 30)
    company.drive(2, 30, 2.0)
    (first_x, first_y, _), (second_x, second_y, _) = company.sim.poses()
    assert first_x > second_x
    assert second_y - first_y >= 2 * ROBOT_MM - DEEPEST_MM
    assert company.sim.contacts(1) == company.sim.contacts(2) == 1


def test_how_time_is_cut_does_not_matter():
    hashes, arena = set(), Arena.box(500, 500, rounded_mm=60)
    for cuts in (1, 10, 100, 1000):
        rng = np.random.default_rng(7)
        places = list(product(np.arange(60, 460, 80), repeat=2))
        rng.shuffle(places)
        robots = [(*places.pop(), rng.uniform(-3, 3)) for _ in range(5)]
        balls, cylinders = ([places.pop() for _ in range(8)] for _ in range(2))
        company = Company(robots, balls, cylinders, arena, seed=3)
        for robot in range(1, 6):
            company.speed(robot, *rng.integers(-20, 128, 2).tolist())
        for _ in range(cuts):
            company.sim.run(10.0 / cuts)
        hashes.add(company.sim.state_hash())
    assert len(hashes) == 1
