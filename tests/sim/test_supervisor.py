"""The world from outside: what stands in it is placed, moved, taken away, looked at and put back."""

import copy
import math
from dataclasses import replace

import numpy as np
import pytest

from kiks import Arena, ArenaError, Khepera, ParameterError, RobotSpec, Simulation
from kiks.model.arena import Ball, Cylinder, Lamp, Pose


@pytest.fixture
def sim() -> Simulation:
    return Simulation(Arena.box(1000, 600), robots=2, seed=3)


def test_what_an_arena_holds_is_there():
    balls = Ball(100, 100), Ball(400, 100, radius_mm=20, brightness="grey")
    cylinders, lamps = (Cylinder(100, 400),), (Lamp(10, 20, 2.0, False),)
    sim = Simulation(replace(Arena.box(500, 500), balls=balls, cylinders=cylinders, lamps=lamps))
    seen = sim.bodies()[["number", "what", "radius_mm", "friction_mm_s2", "brightness"]].tolist()
    assert seen == [(1, 3, 32, 20, 255), (2, 3, 20, 20, 21), (3, 4, 16, 160, 190)]
    assert sim.lamps.tolist() == [[10, 20, 2, 0]]


def test_nothing_may_stand_in_something_else():
    for changes, words in (
        ({"balls": (Ball(30, 250),)}, "a wall is 12.0 mm inside it"),
        ({"balls": (Ball(100, 100), Ball(150, 100))}, "ball 1 is 14.0 mm inside it"),
        ({"starts": (Pose(100, 100, 0),), "cylinders": (Cylinder(100, 130),)}, "robot 1 is 13.5 mm inside it"),
        ({"starts": (Pose(100, 100, 0), Pose(100, 140, 0))}, "start 2 at .* robot 1 is 15.0 mm inside it"),
    ):
        with pytest.raises(ArenaError, match=words):
            Simulation(replace(Arena.box(500, 500), **changes), robots=2 if "starts" in changes else 1)


def test_robots_start_apart_from_each_other_and_from_balls():
    middle = Arena.box(700, 700).find_start(27.5)
    arena = replace(Arena.box(700, 700), balls=(Ball(middle.x_mm, middle.y_mm), Ball(90, 90), Ball(310, 90)))
    places = Simulation(arena, robots=30, seed=5).poses() @ [1, 1j, 0]
    balls = np.array([ball.x_mm + 1j * ball.y_mm for ball in arena.balls])
    assert np.abs(places[:, None] - balls).min() >= 27.5 + 32 - 0.01
    assert (np.abs(places[:, None] - places) + 1000 * np.eye(30)).min() >= 55 - 0.01


def test_a_thing_comes_and_goes_keeps_its_number_and_changes_its_looks(sim):
    first, second = sim.add_ball(100, 100), sim.add_cylinder(100, 300, brightness="white", radius_mm=12)
    assert (first, second) == (1, 2)
    sim.remove_body(first)
    assert (sim.bodies()["number"].tolist(), sim.add_ball(100, 100)) == ([2], 3)
    sim.move_body(second, 200, 300)
    assert sim.bodies()[["number", "x_mm"]].tolist() == [(2, 200.0), (3, 100.0)]
    sim.change_body(3, radius_mm=40, brightness="wood")
    for changes in ({"x_mm": 120}, {"radius_mm": math.nan}, {"radius_mm": 90}):
        with pytest.raises(ParameterError, match=f"{next(iter(changes))}|the place of body 3 must be free"):
            sim.change_body(3, **changes)
    assert sim.bodies()[["x_mm", "radius_mm", "brightness"]].tolist()[1] == (100.0, 40.0, 190)


def test_a_mistake_is_explained_and_changes_nothing(sim):
    sim.add_ball(100, 500)
    before = sim.state_hash()
    for act, words in (
        (lambda _: Simulation(robots=3, robot=["khepera", "khepera_ii"]), "one for each of 3 robots, but it named 2"),
        (lambda _: Simulation(robot=[]), "robots must be a whole number from 1 to 1000, but it was 0"),
        (lambda sim: Simulation().reset(sim.checkpoint()), "checkpoint must be of 1 robot, but it was of 2"),
        (lambda sim: sim.add_robot("kheperra"), "robot must be one of"),
        (lambda sim: sim.add_ball(20, 300), "ball must be free, but at .* a wall is 22.0 mm inside it"),
        (lambda sim: sim.add_cylinder(500, 300), "robot 1 is 4[23].. mm inside it"),
        (lambda sim: sim.add_ball(-5, 300), "must lie inside the arena"),
        (lambda sim: sim.add_ball(math.nan, 300), "x_mm must be at most 1000000000, but it was nan"),
        (lambda sim: sim.add_ball("x", 300), "x_mm must be a number, but it was 'x'"),
        (lambda sim: sim.add_ball(100, 100, colour=1), r"radius_mm, friction_mm_s2, brightness, .* \['colour'\]"),
        (lambda sim: sim.add_ball(100, 100, radius_mm=5), "radius_mm must be at least 10"),
        (lambda sim: sim.add_ball(100, 100, brightness=0), "brightness must be at least 1"),
        (lambda sim: sim.add_ball(100, 100, brightness="gold"), "one of .*'white'"),
        (lambda sim: sim.add_ball(100, 100, friction_mm_s2=-1), "friction_mm_s2 must be"),
        (lambda _: Simulation().move_body(1, 9, 9), "body must be .* an existing body, but it was 1. There is none"),
        (lambda sim: sim.move_body(2, 100, 100), r"but it was 2. The numbers are \[1\]"),
        (lambda sim: sim.move_body(1, 100, 100, speed_mm_s=1500), "speed_mm_s must be from 0 to 1000"),
        (lambda sim: sim.remove_body("ball"), "body must be the number"),
        (lambda sim: sim.add_lamp(2000, 3), "lamp 1 must lie inside"),
        (lambda sim: sim.add_lamp(20, 3, 0), "power_w must be greater than 0"),
        (lambda sim: sim.remove_lamp(1), "lamp must be the row of a lamp, but it was 1. There is none"),
        (lambda sim: sim.place(1, *sim.poses()[1]), "the place of robot 1 must be free, .* robot 2 is 55.0 mm inside"),
        (lambda sim: sim.record_paths(0.015), "every_s must be a multiple of 0.01 s"),
        (lambda sim: sim.paths(), "paths must be recorded"),
    ):
        with pytest.raises(ParameterError, match=words):
            act(sim)
        assert (sim.state_hash(), len(sim.lamps), sim.robot_count) == (before, 0, 2)


def test_brightness_shows_in_proximity_and_camera(sim):
    sim.place(1, 300, 300, 0)
    sim.fit(1, "k213")
    alone = sim.proximity(1)
    counts, greys = [], []
    for brightness in (255, 120, 40):
        body = sim.add_cylinder(300 + 27.5 + 16 + 15, 300, brightness=brightness)
        counts.append(max(sim.proximity(1)))
        greys.append(sim.image(1)[32])
        sim.remove_body(body)
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[2] + 200
    assert greys == sorted(greys, reverse=True)
    assert sim.proximity(1) == alone


def test_poses_paths_and_distances_are_arrays(sim):
    sim.place(1, 200, 300, 0)
    sim.record_paths(0.1)
    sim.port(1).write(b"D,10,10\n")
    sim.run(2.0)
    sim.port(1).write(b"D,-10,-10\n")
    sim.run(0.5)
    paths = sim.paths()
    assert paths.shape == (2, 26, 4)
    assert paths[0, :, 0] == pytest.approx(np.arange(26) * 0.1)
    # A point holds the pose of its tick, and the present pose lies within the tick after the last one.
    assert paths[0, -1, 1] == pytest.approx(sim.pose(1)[0], abs=0.8)
    assert (paths[1] == paths[1, 0] + (paths[1] - paths[1, 0]) * [1, 0, 0, 0]).all()
    forwards, backwards, straight = sim.distances_mm()[0]
    assert forwards > 130
    assert 20 < backwards < 45
    assert straight == pytest.approx(forwards - backwards)
    assert sim.travelled_mm(1) == pytest.approx(forwards + backwards)
    assert (sim.poses().shape, sim.poses()[0].tolist()) == ((2, 3), list(sim.pose(1)))


def test_a_checkpoint_brings_back_every_place(sim):
    ball, cylinder = sim.add_ball(100, 100), sim.add_cylinder(100, 300)
    sim.add_lamp(500, 500)
    sim.move_body(ball, 100, 100, speed_mm_s=100)
    saved = sim.checkpoint()
    poses, bodies = sim.poses(), sim.bodies()
    sim.port(1).write(b"D,20,15\n")
    sim.run(3)
    sim.remove_body(cylinder)
    sim.add_ball(900, 500)
    sim.lamps[0, 0] = 3
    sim.remove_lamp(1)
    sim.reset(saved)
    assert (sim.poses() == poses).all()
    assert (sim.bodies() == bodies).all()
    assert sim.lamps.tolist() == [[500, 500, 1, 1]]
    assert sim.time_s == pytest.approx(3)
    assert sim.add_cylinder(900, 500) == 4


def test_robots_of_mixed_kinds():
    large = RobotSpec.load("khepera").with_changes(body__diameter_mm=70.0)
    sim = Simulation(Arena.box(600, 600), robot=["khepera", "khepera_ii", large], seed=1)
    assert [spec.name for spec in sim.specs] == ["Khepera", "Khepera II", "Khepera"]
    # The large one is stopped farther from a wall.
    for robot, y_mm in ((1, 100), (3, 300)):
        sim.place(robot, 500, y_mm, 0)
        sim.port(robot).write(b"D,10,10\n")
        assert sim.port(robot).readline() == b"d\r\n"
    sim.run(3)
    assert sim.pose(1)[0] == pytest.approx(590 - 27.5, abs=0.01)
    assert sim.pose(3)[0] == pytest.approx(590 - 35, abs=0.01)
    # Each answers with its own firmware and its own sensors.
    robots = [Khepera(sim.port(number)) for number in (1, 2, 3)]
    versions = [robot.version() for robot in robots]
    assert versions[0] != versions[1]
    assert all(len(robot.proximity()) == 8 for robot in robots)


def test_a_robot_that_comes_changes_nothing_for_those_that_are_there():
    """As if it had always been there, far away: readings, pictures and ways are the same to the bit."""
    runs = []
    for comes in (False, True):
        sim = Simulation(replace(Arena.box(1500, 600), starts=(Pose(100, 300, 0.3), Pose(1400, 300, 0.0))), seed=4)
        sim.fit(1, "k213")
        sim.add_ball(300, 300)
        robot, told = Khepera(sim.port(1)), []
        for loop in range(120):
            if comes and loop == 40:
                assert sim.add_robot() == 2
            told.append((robot.proximity(), robot.encoders(), robot.image()))
            robot.set_speed(5 + loop % 5, 7 - loop % 3)
        runs.append((told, sim.pose(1), sim.bodies().tobytes()))
    assert runs[0] == runs[1]


def test_a_robot_that_comes_starts_where_the_arena_says_else_where_there_is_room(sim):
    arena = replace(Arena.box(600, 600), starts=(Pose(100, 100, 0), Pose(300, 300, 1.0), Pose(500, 500, 2.0)))
    sim = Simulation(arena)
    sim.record_paths(0.1)
    sim.run(1.0)
    sim.place(1, 500, 500, 0)
    assert (sim.add_robot("khepera_ii"), sim.pose(2)) == (2, (300, 300, 1.0))
    assert sim.add_robot() == 3, "its start is taken"
    assert math.hypot(sim.pose(3)[0] - 500, sim.pose(3)[1] - 500) > 55
    for robot, pulses in ((2, 35), (3, 27.5)):
        assert sim.specs[robot - 1].body.radius_mm == pulses
        port = sim.port(robot)
        port.write(b"D,5,5\n")
        assert port.readline() == b"d\r\n"
    before = sim.pose(3)
    sim.run(1.0)
    assert math.hypot(sim.pose(3)[0] - before[0], sim.pose(3)[1] - before[1]) > 20
    paths = sim.paths()
    assert np.isnan(paths[2, 0, 1])
    assert not np.isnan(paths[2, -1, 1])
    assert not np.isnan(paths[0]).any()


def test_no_robot_comes_where_there_is_no_room():
    sim = Simulation(Arena.box(120, 120))
    with pytest.raises(ArenaError, match="must have room for 2 robots"):
        sim.add_robot()
    assert sim.robot_count == 1
    with pytest.raises(ArenaError, match=r"must have room for 9 robots, but .* for robot \d were all taken"):
        Simulation(Arena.box(180, 180), robots=9)


def test_balls_roll_without_a_robot_as_with_a_robot_far_away():
    lonely, with_robot = Simulation(Arena.box(500, 500), robots=0), Simulation(Arena.box(500, 500))
    with_robot.place(1, 450, 450, 0)
    for sim in (lonely, with_robot):
        first, second = sim.add_ball(100, 100), sim.add_ball(250, 110)
        sim.run(0.1)
        sim.move_body(first, 100, 100, speed_mm_s=300.0)
        sim.run(1.5)
    assert lonely.bodies().tobytes() == with_robot.bodies().tobytes()
    assert lonely.bodies()["x_mm"][1] > 251, "one ball pushes the other"
    lonely.remove_body(second)
    lonely.move_body(first, 100, 100, speed_mm_s=200.0)
    lonely.run(0.5)
    assert round(float(lonely.bodies()["x_mm"][0]), 1) == 197.5, "a ball rolls alone, too"


def test_bodies_are_where_they_are_at_the_instant_as_robots_are():
    sim = Simulation(Arena.box(900, 300))
    sim.place(1, 100, 100, 0.0)
    sim.add_cylinder(100 + 27.5 + 16, 100)
    sim.port(1).write(b"D,60,60\n")
    sim.run(1.0)
    for _ in range(20):
        sim.run(0.0037)
        assert sim.bodies()["x_mm"][0] - sim.pose(1)[0] == pytest.approx(27.5 + 16, abs=0.05)


def test_a_world_without_a_robot_gets_one():
    sim = Simulation(Arena.box(500, 500), robots=0)
    assert sim.poses().shape == sim.distances_mm().shape == (0, 3)
    assert sim.next_event_ns() is None
    sim.record_paths()
    saved = sim.checkpoint()
    sim.add_cylinder(100, 100)
    sim.run(1.0)
    sim.reset(saved)
    assert len(sim.bodies()) == 0
    for ask in (lambda: sim.spec, lambda: sim.port(1), lambda: sim.place(1, 100, 100, 0)):
        with pytest.raises(ParameterError, match="This simulation has no robot"):
            ask()
    assert sim.add_robot() == 1
    sim.place(1, 250, 250, 0)
    sim.port(1).write(b"D,10,10\n")
    sim.run(1.0)
    assert sim.pose(1)[0] > 300
    assert sim.paths().shape[0] == 1


def test_a_score_is_set_read_copied_and_checked(sim: Simulation) -> None:
    sim.set_score(2, np.int64(3))
    sim.set_score("best lap", "12.4 s")
    sim.set_score("laps", 2.5)
    assert dict(sim.score) == {2: 3, "best lap": "12.4 s", "laps": 2.5}
    assert copy.deepcopy(sim).score == sim.score
    for what, value, rule in (
        (3, 1, "number of an existing robot"),
        ("", 1, "what of a score must be a line of 1 to 40 characters"),
        ("laps", "a\nb", "value of a score must be a line"),
        (1, math.nan, "value must be from -1e9 to 1e9"),
    ):
        with pytest.raises(ParameterError, match=rule):
            sim.set_score(what, value)
    for number in range(13):
        sim.set_score(f"more {number}", number)
    with pytest.raises(ParameterError, match="at most 16 entries, but 'one' would be one more"):
        sim.set_score("one", 1)
