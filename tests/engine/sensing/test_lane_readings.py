"""Sensors in lanes read what one sensor and one ray at a time read, to the bit."""

from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from tests.at_length import share
from tests.engine.one_by_one import read_one_by_one

from kiks import Arena, KiksError, Simulation
from kiks.engine.parameters import pack
from kiks.engine.physics.motor import set_speed
from kiks.engine.scene import Scene
from kiks.engine.sensing.proximity import read_proximity
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.engine.state import State
from kiks.model.arena_objects import Ball
from kiks.model.robot import RESPONSES, RobotSpec

pytestmark = pytest.mark.slow  # they compile the sensors once more


def random_world(arena, kinds, networks, robots, bodies, rng):
    """Return a scene of things anywhere, also in each other and in walls, with tracks as if they had moved."""
    state = State.empty(world_count=1, robot_count=robots, body_count=bodies)
    for records, poses in ((state.robots, 3), (state.bodies, 2)):
        things = records[0]
        size = len(things)
        things["x_mm"] = rng.uniform(0.0, arena.width_mm, size)
        things["y_mm"] = rng.uniform(0.0, arena.height_mm, size)
        names = ("x_mm", "y_mm", "heading_rad")[:poses]
        if poses == 3:
            things["heading_rad"] = rng.uniform(-9.0, 9.0, size)
            things["kind"] = rng.integers(len(kinds), size=size)
        else:
            things["radius_mm"] = rng.uniform(10.0, 40.0, size)
            things["brightness"] = rng.integers(1, 256, size)
        pose = np.stack([things[name] for name in names], axis=1)
        moves = rng.normal(0.0, (3.0, 3.0, 0.2)[:poses], (size, 3, poses))
        moves[1::4] = 0.0
        things["trail"] = pose[:, None] + np.cumsum(moves, axis=1)
    return Scene(state, kinds, [arena], networks, np.zeros((1, 0, 4)), [int(rng.integers(2**40))])


def kinds_of(*responses):
    """Return kinds of robots with such responses: whole ones, and some with a dead sensor, no noise, coarse steps."""
    changes = (
        {},
        {"proximity__gain": (1.0, 1.2, 1.1, 0.9, 1.0, 1.0, 1.0, 1.0), "proximity__noise_exponent": 3},
        {"proximity__noise_small": 0.0, "proximity__noise_large": 0.0, "proximity__jitter_counts": (0.0,)},
        {"proximity__step_counts": 4, "proximity__maximum_counts": 1020, "body__diameter_mm": 72.0},
    )
    specs = []
    for response in responses:
        # The curve is the response of the Khepera II.
        robot = RobotSpec.load("khepera_ii") if response == "curve" else RobotSpec.load("khepera", response=response)
        specs += [robot.with_changes(**each) for each in changes]
    kinds = np.concatenate([pack(spec) for spec in specs])
    kinds["gain"][1 :: len(changes), 6] = 0.0
    return kinds, networks_for(*responses)


def equal_readings(record, robots, tick, time_ns):
    """Return all readings at a time in the last tick."""
    together, one_by_one = np.empty((2, robots, 8))
    for robot in range(robots):
        read_proximity(record, robot, tick, time_ns, True, together[robot])
        read_one_by_one(record, 0, robot, tick, time_ns, one_by_one[robot])
    np.testing.assert_array_equal(together, one_by_one)
    return together


def check_random_world(arena, kinds, networks, robots, bodies, rng):
    """Return the highest reading of a random world, at a random time."""
    tick = int(rng.integers(1000))
    time_ns = max(tick * 10_000_000 - int(rng.integers(10_000_000)), 0)
    scene = random_world(arena, kinds, networks, robots, bodies, rng)
    return equal_readings(scene.record, robots, tick, time_ns).max()


@pytest.mark.parametrize("response", RESPONSES)
def test_lanes_read_the_same_as_single_sensors(make_random_arena, response):
    kinds, networks = kinds_of(response)
    for robots, bodies in ((1, 0), (9, 0), (6, 12)):
        rng, highest = np.random.default_rng([RESPONSES.index(response), robots]), 0
        for number in range(share(5, 20)):
            for _ in range(1 if robots > 1 else 20):
                arena = make_random_arena(number)
                highest = max(highest, check_random_world(arena, kinds, networks, robots, bodies, rng))
        assert highest > 100


def test_all_responses_in_one_world(make_random_arena):
    check_random_world(make_random_arena(4), *kinds_of(*RESPONSES), 40, 10, np.random.default_rng(3))


def test_neighbours_are_known_while_things_move():
    """Lists of neighbours serve until things have moved too far, or somebody has moved one."""
    balls = tuple(Ball(60.0 + 75.0 * k, 240.0, 12.0) for k in range(8))
    sim = Simulation(replace(Arena.box(700, 500), balls=balls), robots=30, seed=4)
    rng, highest = np.random.default_rng(4), 0
    for number in range(share(40, 300)):
        for robot in range(30 if number % 20 == 0 else 0):
            set_speed(sim.world.state.robots, 0, robot, int(rng.integers(-30, 60)), int(rng.integers(-30, 60)))
        if number % 3 == 2:
            with suppress(KiksError):  # something may be there already
                sim.place(1 + number % 30, float(rng.uniform(40, 660)), float(rng.uniform(40, 460)), 1.0)
        else:
            sim.run(0.01 * int(rng.integers(1, 6)))
            sim.sync()
        highest = max(highest, equal_readings(sim.world.scene, 30, sim.world.state.tick_count, sim.now_ns).max())
    assert highest > 100
