"""Explanations: their parts make the count, and what rays met is there."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.at_length import share

from kiks import Arena, ParameterError, Simulation
from kiks.engine.sensing.observe import NOTHING, WALL
from kiks.model.arena_objects import Ball, Cylinder, Lamp, Pose
from kiks.model.robot import RESPONSES, RobotSpec


def random_world(seed: int, response: str | None = None) -> Simulation:
    """Return three robots close to each other, to walls, a ball and a cylinder, on their way."""
    arena = Arena.box(420, 300, rounded_mm=60)
    balls, cylinders = (Ball(210, 85),), (Cylinder(330, 170),)
    lamps = (Lamp(60, 60, 2.0), Lamp(380, 150, 1.0), Lamp(210, 290, 4.0), Lamp(200, 150, 1.0, False))
    rng = np.random.default_rng(seed)
    starts = tuple(Pose(x, y, rng.uniform(-3, 3)) for x, y in ((140, 150), (210, 170), (270, 120)))
    arena = Arena(arena.brightness, 1.0, "random", starts, lamps, balls, cylinders)
    kind = "khepera_ii" if response == "curve" else "khepera"
    sim = Simulation(arena, robots=3, seed=seed, robot=kind, response=response)
    for robot in (1, 2, 3):
        sim.port(robot).write(b"D,%d,%d\n" % (12 + robot, 20 - 3 * robot + seed % 5))
    return sim


def as_read(why, expected_counts: float) -> float:
    """Return what the converter makes of an explanation's parts."""
    steps = math.floor(expected_counts / why.step_counts + 0.5)
    return min(max(steps * why.step_counts, 0), why.maximum_counts)


@pytest.mark.slow
@pytest.mark.parametrize("response", RESPONSES)
def test_the_parts_make_the_count(response):
    met = set()
    for seed in range(share(2, 4)):
        sim = random_world(seed, response)
        for _ in range(12):
            sim.run(0.1373)
            for robot in (1, 2, 3):
                read = sim.proximity(robot, noise=True)
                for sensor in range(8):
                    why = sim.explain(robot, sensor)
                    total = why.expected_counts + why.scatter_counts + why.jitter_counts
                    assert why.count == read[sensor] == as_read(why, total)
                    assert 0.0 <= why.age_ms <= 20.0
                    assert why.response == response
                    met |= {ray.met for ray in why.rays}
                    assert f" {why.count}." in why.text()
    assert {"nothing", "wall", "robot 1", "robot 2", "robot 3", "ball 1", "cylinder 2"} <= met


def test_light_parts_make_the_count():
    states = set()
    for seed in range(4):
        sim = random_world(seed)
        for _ in range(25):
            sim.run(0.1373)
            for robot in (1, 2, 3):
                read = sim.ambient(robot, noise=True)
                for sensor in range(8):
                    why = sim.explain_light(robot, sensor)
                    assert why.count == read[sensor] == as_read(why, why.expected_counts + why.noise_counts)
                    states |= {lamp.state for lamp in why.lamps}
                    for lamp in why.lamps:
                        assert lamp.contribution_counts >= 0.0
                        assert lamp.state == "seen" or lamp.contribution_counts == 0.0
                    assert f" {why.count};" in why.text()
    assert {"seen", "off", "behind the sensor", "behind the robot itself"} <= states
    assert states & {"hidden by robot 1", "hidden by robot 2", "hidden by robot 3"}
    assert states & {"hidden by ball 1", "hidden by cylinder 2"}


@pytest.mark.parametrize("response", RESPONSES)
def test_rays_matter_before_a_wall_and_those_that_meet_nothing_do_not(response):
    sim = Simulation(Arena.box(400, 400), robot="khepera_ii" if response == "curve" else "khepera", response=response)
    checked = 0
    for x_mm in np.arange(46.0, 75.0, 0.5):
        sim.place(1, float(x_mm), 200.0, math.pi)
        why = sim.explain(1, 2)
        if 150 < why.expected_counts < 600:
            most = max(why.rays, key=lambda ray: abs(ray.contribution_counts))
            assert abs(most.contribution_counts) > 20
            assert f"without it, {why.expected_counts - most.contribution_counts:.1f} would be" in why.text()
            assert all(abs(ray.contribution_counts) < 1e-9 for ray in why.rays if ray.met == "nothing")
            checked += 1
    assert checked >= 3


def test_reflections_contributions_are_those_of_its_formula():
    """The light of all rays but one, and the rounded share of it above the threshold (docs/explanation/sensors.md)."""
    sim = Simulation(Arena.box(400, 400))
    sim.place(1, 58.0, 200.0, math.pi)
    (parameters,) = sim.world.kinds

    def expect(rays, sensor: int) -> float:
        light = 0.0
        for ray, weight in zip(rays, parameters["ray_weight"][sensor], strict=False):
            if ray.brightness:
                cosine = math.cos(math.radians(ray.incidence_deg))
                light += weight * (cosine / (ray.length_mm + parameters["behind_mm"])) ** 3
        threshold, faint, bright = parameters["threshold"][sensor], parameters["faint"], parameters["bright"]
        share = (1 + threshold) * parameters["gain"][sensor] * light - threshold

        def ramp(value: float, rounding: float) -> float:
            return max(value, 0.0) if abs(value) >= rounding else (value + rounding) ** 2 / (4 * rounding)

        return 1023 * max(ramp(share, faint) - ramp(share - 1, bright), 0.0)

    for sensor in (1, 2, 3, 4):
        why = sim.explain(1, sensor)
        assert why.response_counts == pytest.approx(expect(why.rays, sensor), abs=1e-6)
        for k, ray in enumerate(why.rays):
            without = expect((*why.rays[:k], replace(ray, brightness=0), *why.rays[k + 1 :]), sensor)
            assert why.response_counts - ray.contribution_counts == pytest.approx(without, abs=1e-6)


def test_lengths_and_angles_are_those_of_geometry():
    sim = Simulation(Arena.box(400, 400))
    sim.place(1, 60.0, 200.0, 2.9)
    seen = 0
    for sensor in range(8):
        for ray in sim.explain(1, sensor).rays:
            if ray.met == "wall":
                direction = 2.9 + math.radians(ray.angle_deg)
                assert math.degrees(math.acos(-math.cos(direction))) == pytest.approx(ray.incidence_deg, abs=1e-3)
                seen += 1
    assert seen >= 5
    assert np.isinf(sim.rays(1)).sum() + seen == 56


@pytest.mark.slow
@pytest.mark.parametrize("response", RESPONSES)
def test_views_show_exact_rays_whatever_the_response(response):
    """The table strides; a person sees where rays end. Its wall is at 10 mm from the edge."""
    kind = "khepera_ii" if response == "curve" else "khepera"
    sim = Simulation(Arena.box(400, 400), robot=kind, response=response)
    sim.place(1, 55.0, 200.0, math.pi)
    (parameters,) = sim.world.kinds
    lengths_mm, met = sim.look().lengths_mm[0], sim.look().met[0]
    assert (lengths_mm == sim.rays(1)).all()
    for sensor in (1, 2, 3, 4):
        begin_mm = 55.0 - parameters["ray_x_mm"][sensor] - 10.0
        for ray in range(7):
            cosine = parameters["ray_cos"][sensor, ray]
            expected_mm = begin_mm / cosine if cosine > 0 else math.inf
            if expected_mm < parameters["reach_mm"] - 0.5:
                assert met[sensor, ray] == WALL
                assert lengths_mm[sensor, ray] == pytest.approx(expected_mm, abs=0.03)
            elif expected_mm > parameters["reach_mm"] + 0.5:
                assert met[sensor, ray] == NOTHING
    assert (met == WALL).sum() > 4


def test_a_look_says_what_the_single_questions_say():
    for seed in range(3):
        sim = random_world(seed)
        for _ in range(10):
            sim.run(0.2371)
            look = sim.look()
            assert (look.poses == sim.poses()).all()
            assert look.places.tolist() == [list(place) for place in sim.bodies()[["x_mm", "y_mm"]].tolist()]
            for robot in (1, 2, 3):
                assert look.proximity[robot - 1].tolist() == sim.proximity(robot, noise=True)
                assert look.ambient[robot - 1].tolist() == sim.ambient(robot, noise=True)
            assert ((look.brightnesses > 0) == (look.met != NOTHING)).all()
            assert (np.isinf(look.lengths_mm) == (look.met == NOTHING)).all()


def test_light_ends_where_the_robot_says():
    spec = RobotSpec.load("khepera")
    sim = Simulation(Arena.box(300, 300), robot=replace(spec, ambient=replace(spec.ambient, maximum_counts=200)))
    why = sim.explain_light(1, 0)
    assert (why.maximum_counts, why.count, sim.explain(1, 0).maximum_counts) == (200, 200, 1023)


def test_explanations_are_in_plain_words_and_a_wall_that_hides_a_lamp_is_named():
    sim = Simulation(Arena.box(300, 300), seed=2)
    sim.place(1, 150.0, 150.0, 0.0)
    far = sim.explain(1, 0)
    assert "Sensor 0 (left 90) of robot 1 reads " in far.text()
    assert "saw nothing within 60 mm" in far.text()
    assert "There is no lamp in the arena." in sim.explain_light(1, 0).text()
    sim.place(1, 40.0, 150.0, math.pi)
    near = sim.explain(1, 2)
    assert "All of its seven rays met a wall, " in near.text()
    assert "No ray matters by itself" in near.text()
    assert "That is the most that it can read: 1023." in replace(near, count=1023).text()
    for ask in (sim.explain, sim.explain_light):
        with pytest.raises(ParameterError, match="robot must be the number of an existing robot, but it was 2"):
            ask(2, 0)
        with pytest.raises(ParameterError, match="sensor must be a whole number from 0 to 7, but it was 8"):
            ask(1, 8)
    sim.place(1, 100.0, 150.0, 0.0)
    cells = np.zeros((300, 300), np.uint8)
    cells[:, 200:210] = 255
    sim.set_arena(Arena.from_array(cells))
    sim.add_lamp(280.0, 150.0)
    for sensor, state in ((2, "hidden by wall"), (6, "behind the sensor")):
        assert sim.explain_light(1, sensor).lamps[0].state == state
