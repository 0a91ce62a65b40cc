"""What sensors see of robots, balls and cylinders: discs by geometry, each where it was when the sensor looked."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share
from tests.engine.same_walls import with_things
from tests.engine.sensing.followed_rays import meet_discs_alone, meet_discs_of

from kiks import Arena, RobotSpec, Simulation
from kiks.engine.simd.lanes import LANES
from kiks.firmware.turret import Turret
from kiks.model.arena_objects import Ball, Lamp, Pose
from kiks.units import TICK_NS

ROBOT_MM = 27.5
HALF_MM_FLOOR = Arena.from_array(np.zeros((1000, 1000), np.uint8), mm_per_pixel=0.5)
EXACT = RobotSpec.load("khepera").without_noise()
"""A Khepera without noise."""


class Aim(Turret):
    """Tells what is in a direction."""

    number, name = 24, "Aim"

    def met(self, angle_rad: float = 0.0):
        met = self.site.ray(angle_rad)
        return met.distance_mm, met.brightness, met.robot


def drawn(arena: Arena, discs) -> Arena:
    """Return an arena with discs, x, y, radius and brightness, drawn into it as walls."""
    picture = arena.brightness.copy()
    cell = arena.mm_per_cell
    rows, columns = (np.mgrid[: picture.shape[0], : picture.shape[1]] + 0.5) * cell
    for x, y, radius, brightness in discs:
        picture[np.hypot(columns - x, rows - y) <= radius] = brightness
    return Arena(picture, cell, "drawn")


def meet_by_quadratic(discs, x, y, angle, reach):
    """Return the length of a ray to the first disc and which one that is, None if it meets none."""
    first = reach, None
    for k, (disc_x, disc_y, radius) in enumerate(discs):
        # |origin + t direction - centre|^2 = radius^2
        half_b = (x - disc_x) * math.cos(angle) + (y - disc_y) * math.sin(angle)
        c = (x - disc_x) ** 2 + (y - disc_y) ** 2 - radius**2
        if half_b**2 > c:
            roots = -half_b - math.sqrt(half_b**2 - c), -half_b + math.sqrt(half_b**2 - c)
            if roots[1] > 0.0 and max(roots[0], 0.0) < first[0]:
                first = max(roots[0], 0.0), k
    return first


@settings(derandomize=True, max_examples=share(100, 300))
@given(draw=st.integers(0, 2**32), count=st.integers(0, 20))
def test_rays_meet_the_first_disc(draw, count):
    """Also from within a disc, in lanes as one by one."""
    rng = np.random.default_rng(draw)
    discs = np.column_stack([rng.uniform(-80, 80, (count, 2)), rng.uniform(0.5, 60, count)])
    seen = np.column_stack([discs, np.arange(1, count + 1)]).ravel()
    angles = rng.uniform(-math.pi, math.pi, LANES)
    reach = rng.uniform(0, 100)
    lengths, squarely, shades = met = np.array([np.full(LANES, reach), np.ones(LANES), np.zeros(LANES)])
    meet_discs_of(seen, count, np.cos(angles), np.sin(angles), met)
    for lane, angle in enumerate(angles):
        expected, which = meet_by_quadratic(discs, 0.0, 0.0, angle, reach)
        assert lengths[lane] == pytest.approx(expected, abs=1e-6)
        assert shades[lane] == (0 if which is None else which + 1)
        alone = meet_discs_alone(seen, count, math.cos(angle), math.sin(angle), reach)
        assert alone == (lengths[lane], squarely[lane], shades[lane])
        if which is not None and lengths[lane] > 0.0:
            hit = lengths[lane] * np.array([math.cos(angle), math.sin(angle)])
            inward = (discs[which, :2] - hit) / discs[which, 2]
            assert squarely[lane] == pytest.approx(inward @ (math.cos(angle), math.sin(angle)), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("radius_mm", [10.0, 16.0, 32.0, 100.0])
def test_a_disc_reads_like_the_same_disc_drawn_as_a_wall(radius_mm):
    """Counts within 5 % and 15: what drawing in cells of half a millimetre costs, a thin disc most."""
    start = (Pose(250.0, 250.0, 0.4),)
    for gap_mm, angle in product((2.0, 8.0, 20.0), np.linspace(-3, 3, share(1, 9))):
        far = ROBOT_MM + gap_mm + radius_mm
        x, y = 250.0 + far * math.cos(angle), 250.0 + far * math.sin(angle)
        with_ball = Simulation(with_things(HALF_MM_FLOOR, starts=start, balls=(Ball(x, y, radius_mm),)))
        with_wall = Simulation(replace(drawn(HALF_MM_FLOOR, [(x, y, radius_mm, 255)]), starts=start))
        assert with_ball.proximity(1) == pytest.approx(with_wall.proximity(1), rel=0.05, abs=15)


@pytest.mark.slow
@settings(derandomize=True, max_examples=share(8, 20))
@given(draw=st.integers(0, 2**32))
def test_a_camera_sees_discs_as_it_sees_walls(draw):
    rng = np.random.default_rng(draw)
    floor = Arena.from_array(np.zeros((600, 600), np.uint8), mm_per_pixel=1.0)
    discs = []
    while len(discs) < 4:
        x, y, radius = rng.uniform(120, 480), rng.uniform(120, 480), rng.uniform(10, 60)
        clear = all(math.hypot(x - u, y - v) > radius + r + 1 for u, v, r, _ in discs)
        if clear and math.hypot(x - 300, y - 300) > radius + 60:
            discs.append((x, y, radius, int(rng.integers(1, 256))))
    start = (Pose(300.0, 300.0, rng.uniform(-3, 3)),)
    balls = tuple(Ball(x, y, radius, brightness=shade) for x, y, radius, shade in discs)
    with_balls = Simulation(replace(floor, starts=start, balls=balls))
    with_walls = Simulation(replace(drawn(floor, discs), starts=start))
    for sim in (with_balls, with_walls):
        sim.fit(1, "k213")
    difference = np.abs(np.subtract(with_balls.image(1), with_walls.image(1)))
    assert np.median(difference) < 1.0
    assert (difference > 20.0).sum() <= 8  # two pixels at the edges of each


def test_a_sensor_sees_a_ball_where_it_was_when_it_looked():
    """A ball passes at 1 m/s: within the 20 ms of a round it moves by 20 mm."""
    starts, balls = (Pose(400.0, 400.0, math.pi / 2),), (Ball(300.0, 480.0, 32.0, 0.0),)
    floor = replace(Arena.box(800, 800), starts=starts, balls=balls)
    sim, still = (Simulation(floor, robot=EXACT) for _ in range(2))
    sim.world.state.bodies["velocity_x"] = 1000.0
    different = 0
    for _ in range(20):
        sim.run(0.01)
        sim.sync()
        read, now = sim.proximity(1, noise=True), sim.proximity(1)
        for sensor in range(8):
            slot_ns, turn_ns = sensor * 2_500_000, 20_000_000  # khepera-protocol.md 8.1
            if sim.now_ns < slot_ns:
                continue
            instant_ns = (sim.now_ns - slot_ns) // turn_ns * turn_ns + slot_ns
            still.move_body(1, 300.0 + 1000.0 * instant_ns * 1e-9, 480.0)
            then = still.proximity(1)
            assert read[sensor] == pytest.approx(then[sensor], abs=0.51)
            different += abs(then[sensor] - now[sensor]) > 20
    assert sim.now_ns % TICK_NS == 0
    assert different >= 5


def test_a_robot_sees_others_and_never_itself():
    floor = Arena.box(800, 800)
    baseline = Simulation(floor, robot=EXACT).proximity(1)
    for heading in np.linspace(0, 6, 7):
        starts = (Pose(200.0, 400.0, heading), Pose(600.0, 400.0, heading))
        sim = Simulation(with_things(floor, starts=starts), robots=2, robot=EXACT)
        assert sim.proximity(1) == sim.proximity(2) == baseline
        sim.place(2, 200.0 + 62.0 * math.cos(heading), 400.0 + 62.0 * math.sin(heading), heading + math.pi)
        assert min(max(sim.proximity(1)), max(sim.proximity(2))) > max(baseline) + 20


def test_a_lifted_thing_is_neither_seen_nor_hit():
    floor = replace(Arena.box(800, 800), starts=(Pose(400.0, 400.0, 0.0),), lamps=(Lamp(700.0, 400.0, 5.0),))
    alone, lifted = Simulation(floor), Simulation(replace(floor, balls=(Ball(480.0, 400.0),)))
    for sim in (alone, lifted):
        sim.fit(1, "k213")
    assert lifted.proximity(1) != alone.proximity(1)
    assert lifted.ambient(1) != alone.ambient(1)
    lifted.world.state.bodies["is_lifted"] = 1
    lifted.world.rebuild_scene()
    for sense in ("proximity", "ambient", "image"):
        assert getattr(lifted, sense)(1) == getattr(alone, sense)(1)
    for sim in (alone, lifted):
        sim.port(1).write(b"D,30,30\n")
        sim.run(1.0)
    assert lifted.pose(1) == pytest.approx(alone.pose(1), abs=1e-9)
    assert lifted.pose(1)[0] > 520.0
    assert lifted.contacts(1) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("what", "radius"), [("robot", ROBOT_MM), ("ball", 32.0), ("cylinder", 16.0)])
def test_robots_balls_and_cylinders_hide_lamps(what, radius):
    """A lamp is hidden from a sensor if the straight line to it leads through a disc, and only then."""
    rng = np.random.default_rng(4)
    start, met = Pose(500.0, 500.0, 0.7), {True: 0, False: 0}
    floor = replace(Arena.box(1000, 1000), lamps=(Lamp(900.0, 900.0, 3.0),), starts=(start,))
    alone, sim = Simulation(floor), Simulation(floor)
    if what == "robot":
        sim.add_robot(pose=(100.0, 100.0, 0.0))
    else:
        (sim.add_ball if what == "ball" else sim.add_cylinder)(100.0, 100.0)
    alone.lamps[0, 3] = 0.0
    dark = alone.ambient(1)
    alone.lamps[0, 3] = 1.0
    parameters = alone.world.kinds[0]
    cosine, sine = math.cos(start.heading_rad), math.sin(start.heading_rad)
    for _ in range(150):
        lamp = rng.uniform(100, 900, 2)
        x, y = (rng.uniform(0.2, 0.8) * (lamp - 500) + 500 + rng.uniform(-40, 40, 2)).tolist()
        over = math.hypot(lamp[0] - x, lamp[1] - y) <= radius + 1
        if over or math.hypot(x - 500, y - 500) < radius + ROBOT_MM + 1:
            continue
        sim.lamps[0, :2] = alone.lamps[0, :2] = lamp
        if what == "robot":
            sim.place(2, x, y, 0.0)
        else:
            sim.move_body(1, x, y)
        lit = alone.ambient(1)
        for sensor, count in enumerate(sim.ambient(1)):
            out_x, out_y = parameters["mount_x_mm"][sensor], parameters["mount_y_mm"][sensor]
            eye = np.array([500 + out_x * cosine - out_y * sine, 500 + out_x * sine + out_y * cosine])
            line = eye + np.linspace(0, 1, 4001)[:, None] * (lamp - eye)
            nearest = np.hypot(line[:, 0] - x, line[:, 1] - y).min()
            if abs(nearest - radius) < 0.1 or lit[sensor] == dark[sensor]:
                continue
            assert count == (dark if nearest < radius else lit)[sensor]
            met[nearest < radius] += 1
    assert min(met.values()) >= 20


def striped_world(turn_rad: float, **body) -> Simulation:
    """A robot with a camera, and another one before it, whose body has these constants."""
    kinds = [EXACT, EXACT.with_changes(**{f"body__{key}": value for key, value in body.items()})]
    sim = Simulation(Arena.box(600, 400), robot=kinds)
    sim.place(2, 500, 300, 0.0)
    sim.place(1, 200, 200, 0.0)
    sim.place(2, 265, 200, math.pi + turn_rad)
    sim.fit(1, "k213")
    return sim


@pytest.mark.parametrize(("turn_rad", "brightness"), [(0.0, 1), (math.pi, 255), (7 * math.pi, 255), (-8 * math.pi, 1)])
def test_a_robot_of_one_black_and_one_white_half_looks_like_the_half_that_is_seen(turn_rad, brightness):
    striped, plain = striped_world(turn_rad, stripe_count=1), striped_world(turn_rad, brightness=brightness)
    assert (striped.proximity(1), striped.image(1)) == (plain.proximity(1), plain.image(1))
    assert striped.fit(1, Aim()).met() == plain.fit(1, Aim()).met()


def test_stripes_are_where_the_angle_on_the_rim_says():
    """Rays from all around, one by one."""
    turn_rad = 0.3
    for count in (3, 8, 25):
        sim = striped_world(turn_rad, stripe_count=count)
        aim, stripes_rad = sim.fit(1, Aim()), sim.specs[1].body.white_stripes_rad
        for x_mm, angle in product((200.0, 190.0), np.linspace(-0.35, 0.35, 71).tolist()):
            sim.place(1, x_mm, 200, 0.0)
            distance_mm, brightness, robot = aim.met(angle)
            hit = x_mm + distance_mm * math.cos(angle) - 265, distance_mm * math.sin(angle)
            rim_rad = math.atan2(hit[1], hit[0]) - math.pi - turn_rad
            if robot == 2 and abs(math.cos(count * rim_rad)) > 1e-6:
                assert brightness == (1 if math.cos(count * rim_rad) > 0 else 255)
                is_white = any(begin < rim_rad % (2 * math.pi) < end for begin, end in stripes_rad)
                assert is_white == (brightness == 255), "pictures have the stripes that sensors see"
