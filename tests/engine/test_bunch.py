"""Robots in lanes move as each of them moves alone, to the bit: the same physics compiled for eight and for one."""

import numpy as np
import pytest
from tests.at_length import share
from tests.engine.one_by_one import advance_alone, advance_each

from kiks.engine import step
from kiks.engine.compiling import make_ready
from kiks.engine.meeting import MEETING
from kiks.engine.parameters import pack
from kiks.engine.physics import motor
from kiks.engine.scene import Scene
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.engine.state import State
from kiks.model.arena import PAD, Arena
from kiks.model.robot import RobotSpec

pytestmark = pytest.mark.slow  # they compile the engine once more, for one robot

KINDS = (
    {},
    {"body__wheel_base_mm": 48.0, "body__diameter_mm": 58.0, "body__wall_friction": 0.1, "motor__left_gain": 0.94},
    {"motor__dead_band_pwm": 15.0, "motor__time_constant_ms": 60.0, "body__slip_ratio_min": 0.02},
)


def assert_equal(robots, others):
    """Check all fields of robots, to the bit."""
    for name in robots.dtype.names:
        assert robots[name].tobytes() == others[name].tobytes(), name


def prepare(robots, spec):
    """Set what a reset of the firmware sets."""
    robots["speed_gains"], robots["position_gains"] = spec.reset.speed_gains, spec.reset.position_gains
    robots["profile_speed"] = spec.reset.profile_speed_pulses
    robots["profile_acceleration"] = spec.reset.profile_acceleration


class Worlds:
    """Worlds with a lone robot each, in one arena, twice: for lanes, and one by one."""

    def __init__(self, arena, count, number):
        self.rng = np.random.default_rng([77, number])
        self.arena, self.count = arena, count
        specs = [RobotSpec.load("khepera").with_changes(**changes) for changes in KINDS]
        self.kinds = np.concatenate([pack(spec) for spec in specs])
        state = State.empty(world_count=count, robot_count=1)
        self.lanes = state.robots
        self.seeds = self.rng.integers(0, 2**63, count)
        self.ticks = self.rng.integers(0, 1000, count)
        free = np.argwhere(arena.clearance[PAD:-PAD, PAD:-PAD] > 31.0)
        for robot in self.lanes[:, 0]:
            row, column = free[self.rng.integers(len(free))]
            robot["x_mm"], robot["y_mm"] = (column + 0.5) * arena.mm_per_cell, (row + 0.5) * arena.mm_per_cell
            robot["heading_rad"] = self.rng.uniform(-50.0, 50.0)
            robot["trail"][:] = robot["x_mm"], robot["y_mm"], robot["heading_rad"]
            robot["kind"] = self.rng.integers(len(KINDS))
        prepare(self.lanes, specs[0])
        other = state.snapshot()
        self.alone = other.robots
        given = self.kinds, [arena], networks_for("reflection"), np.zeros((count, 0, 4)), self.seeds
        self.scene, self.scene_alone = Scene(state, *given), Scene(other, *given)

    def command(self, name, most):
        """Give a third of the robots a new command."""
        for world in np.flatnonzero(self.rng.random(self.count) < 0.35):
            left, right = (int(value) for value in self.rng.integers(-most, most + 1, 2))
            for robots in (self.lanes, self.alone):
                getattr(motor, name)(robots, world, 0, left, right)

    def advance(self, ticks_to):
        """Let time pass in both ways, and compare."""
        before, self.ticks = self.ticks, np.maximum(ticks_to, self.ticks)
        for world in range(self.count):
            ticks = self.ticks[world] - before[world]
            advance_alone(self.scene_alone.record, world, 0, before[world], ticks)
        done = before.copy()
        advance_each(self.scene.record, done, ticks_to)
        assert done.tolist() == self.ticks.tolist()
        assert_equal(self.lanes, self.alone)


@pytest.mark.parametrize(("name", "most"), [("set_speed", 20), ("set_speed", 127), ("set_pwm", 255)])
def test_drives_are_those_of_robots_alone(make_random_arena, name, most):
    """Each world has ticks of its own; for some the time has come already."""
    for number in share((0, 2, 5), range(6)):
        worlds = Worlds(make_random_arena(number), 1 + 5 * number, number)
        for _ in range(60):
            worlds.command(name, most)
            worlds.advance(worlds.ticks + worlds.rng.integers(-2, 20, worlds.count).clip(0))
        if worlds.count > 10:
            assert (worlds.lanes["contact_count"] > 0).sum() > 2


def test_positions_are_those_of_robots_alone_and_grippers_move(make_random_arena):
    """Some in one mode, some in another, beside each other."""
    make_ready(MEETING)
    worlds = Worlds(make_random_arena(3), 21, 9)
    for robots in (worlds.lanes, worlds.alone):
        robots["has_gripper"] = (np.arange(21) % 3 == 0)[:, None]
        robots["arm"], robots["jaws"] = 127.0, 200.0
        robots["arm_target"] = np.linspace(0.0, 255.0, 21)[:, None]
        robots["is_closing"] = (np.arange(21) % 2)[:, None]
    for _ in range(40):
        worlds.command("set_position", 800)
        worlds.command("set_speed", 40)
        worlds.command("set_pwm", 120)
        worlds.command("set_counters", 2**31 - 1)
        worlds.advance(worlds.ticks + worlds.rng.integers(7, 16))
    assert len(set(worlds.lanes["arm"].ravel())) > 2


@pytest.mark.parametrize("count", [2, 7, 8, 9, 41])
def test_robots_that_never_meet_move_as_if_alone(count):
    """In one world, some along walls, some in the open; each turns on the spot or drives to and fro."""
    rng = np.random.default_rng(count)
    spec = RobotSpec.load("khepera")
    state = State.empty(world_count=1, robot_count=count)
    robots = state.robots[0]
    prepare(robots, spec)
    robots["x_mm"] = 30.0 + 100.0 * (np.arange(count) % 7)
    robots["y_mm"] = 30.0 + 100.0 * (np.arange(count) // 7)
    robots["heading_rad"] = rng.uniform(-4.0, 4.0, count)
    other = state.snapshot()
    given = pack(spec), [Arena.box(660, 560)], networks_for("reflection"), np.zeros((1, 0, 4)), [5]
    together, alone = Scene(state, *given), Scene(other, *given)
    tick = 0
    for _ in range(40):
        speed = rng.integers(-3, 4, count)
        for number in range(count):
            turn = 1 if number % 3 else -1
            for each in (state, other):
                motor.set_speed(each.robots, 0, number, int(speed[number]), int(speed[number]) * turn)
        for sign in (1, -1):
            ticks = int(rng.integers(1, 12))
            step.advance(together.record, tick, ticks)
            for number in range(count):
                advance_alone(alone.record, 0, number, tick, ticks)
            tick += ticks
            robots["speed_setpoint"] *= -sign
            other.robots["speed_setpoint"] *= -sign
        assert_equal(state.robots, other.robots)
    assert robots["contact_count"].any()
