"""Record8 lone robots read what each of them reads alone, to the bit."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.at_length import share
from tests.engine.by_eights import read_after

from kiks.batch.kernel_args import AMBIENT, PROXIMITY
from kiks.engine.parameters import pack
from kiks.engine.scene import make_scene
from kiks.engine.sensing.ambient import read_ambient
from kiks.engine.sensing.proximity import read_proximity
from kiks.engine.sensing.rays import sight_of
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.engine.state import State
from kiks.model.arena import PAD
from kiks.model.robot import RESPONSES, RobotSpec

pytestmark = pytest.mark.slow  # they compile the kernels for eight robots

TICKS = 1000
NO_LAMPS = np.zeros((0, 4))


class Worlds:
    """Lone robots in one arena, each in a world of its own, driving; each reads at a time of its own."""

    def __init__(self, arena, kinds, count, rng):
        self.sight = sight_of(arena)
        self.ground = arena.clearance, float(arena.mm_per_cell), PAD
        self.state = State.empty(world_count=count, robot_count=1)
        robots = self.state.robots[:, 0]
        robots["x_mm"] = rng.uniform(0.0, arena.width_mm, count)
        robots["y_mm"] = rng.uniform(0.0, arena.height_mm, count)
        robots["heading_rad"] = rng.uniform(-9.0, 9.0, count)
        pose = np.stack([robots[name] for name in ("x_mm", "y_mm", "heading_rad")], axis=1)
        moves = rng.normal(0.0, (3.0, 3.0, 0.2), (count, 3, 3))
        moves[::4, :, 2] *= 1e-6
        moves[1::4] = 0.0
        robots["trail"] = pose[:, None] + np.cumsum(moves, axis=1)
        robots["kind"] = rng.integers(len(kinds), size=count)
        self.scene = make_scene(self.state, kinds, arena.width_mm, arena.height_mm)
        self.ticks = rng.integers(0, TICKS, count)
        self.ticks[0] = 0
        self.times_ns = np.maximum(self.ticks * 10_000_000 - rng.integers(0, 10_000_000, count), 0)
        self.times_ns[-1] = self.ticks[-1] * 10_000_000
        self.seeds = rng.integers(0, 2**40, count)

    def alone(self, world):
        """Return the scene of one world."""
        robots, bodies, kinds, (begins, entries, spots, widest_mm) = self.scene
        it = slice(world, world + 1)
        return robots[it], bodies[it], kinds, (begins[it], entries[it], spots[it], widest_mm)

    def read(self, code, networks, lamps=NO_LAMPS):
        """Return what all robots read."""
        lamps = np.broadcast_to(lamps, (len(self.ticks), *lamps.shape)).copy()
        return read_after(
            self.scene, self.ground, self.sight, networks, lamps, self.seeds, self.ticks, self.times_ns, code
        )

    def moment(self, world):
        return int(self.ticks[world]), int(self.times_ns[world]), int(self.seeds[world]), 0, True


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


def assert_equal_readings(arena, kinds, networks, count, rng):
    worlds = Worlds(arena, kinds, count, rng)
    together, one_by_one = worlds.read(PROXIMITY, networks), np.empty((count, 8), np.int64)
    for world in range(count):
        read_proximity(worlds.alone(world), worlds.sight, networks, *worlds.moment(world), one_by_one[world])
    np.testing.assert_array_equal(together, one_by_one)
    return together


@pytest.mark.parametrize("response", RESPONSES)
def test_eight_lanes_read_the_same_as_single_robots(make_random_arena, response):
    kinds, networks = kinds_of(response)
    rng = np.random.default_rng(RESPONSES.index(response))
    for number in range(share(3, 12)):
        readings = assert_equal_readings(make_random_arena(number), kinds, networks, 43, rng)
        assert readings.max() > 100


@pytest.mark.parametrize("count", [1, 7, 8, 9, 16])
def test_any_number_of_worlds_with_all_responses_among_them(make_random_arena, count):
    kinds, networks = kinds_of(*RESPONSES)
    assert_equal_readings(make_random_arena(count), kinds, networks, count, np.random.default_rng(count))


def test_light_readings_of_many_worlds(make_random_arena):
    arena, rng = make_random_arena(3), np.random.default_rng(1)
    kinds = kinds_of("reflection")[0]
    worlds = Worlds(arena, kinds, 20, rng)
    lamps = np.array([[60.0, 60.0, 1.0, 1.0], [0.7 * arena.width_mm, 100.0, 2.0, 1.0]])
    together, alone = worlds.read(AMBIENT, networks_for("reflection"), lamps), np.empty(8, np.int64)
    for world in range(20):
        read_ambient(worlds.alone(world), worlds.sight, lamps, *worlds.moment(world), alone)
        assert together[world].tolist() == alone.tolist()
    assert not math.isclose(together.min(), together.max())
