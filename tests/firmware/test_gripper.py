"""The gripper: what it grips, how it carries and puts down, and that what it holds stays outside of everything else."""

import math
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share

import kiks
from kiks.engine.physics import contact

RIM_MM, CYLINDER_MM = 27.5, 16.0
TOUCHING_MM = RIM_MM + CYLINDER_MM


def ask(sim: kiks.Simulation, order: str, robot: int = 1) -> list[int]:
    return kiks.Khepera(sim.port(robot)).turret(1, order)


def act(sim: kiks.Simulation, order: str, seconds: float, robot: int = 1) -> None:
    """Give an order and let time pass."""
    ask(sim, order, robot)
    sim.run(seconds)


def drive(sim: kiks.Simulation, left: int, right: int, seconds: float = 0.0, robot: int = 1) -> None:
    """Set the speeds of the wheels and let time pass."""
    kiks.Khepera(sim.port(robot)).set_speed(left, right)
    sim.run(seconds)


def closed(sim: kiks.Simulation, robot: int = 1) -> None:
    """Lower the arm, jaws open, and close them."""
    for order, seconds in (("D,0", 0.0), ("E,255", 1.0), ("D,1", 0.6)):
        act(sim, order, seconds, robot)


def a_simulation(ahead_mm: float = TOUCHING_MM + 1, aside_mm: float = 0.0, *, robots: int = 1) -> kiks.Simulation:
    """A robot at (300, 300) mm that looks to the right at a cylinder; others wait far off."""
    sim = kiks.Simulation(kiks.Arena.box(900, 600), seed=1, robots=robots)
    for robot in range(2, robots + 1):
        sim.place(robot, 60.0, 60.0 * robot, 0.0)
    sim.place(1, 300, 300, 0.0)
    sim.add_cylinder(300 + ahead_mm, 300 + aside_mm)
    for robot in range(1, robots + 1):
        sim.fit(robot, "gripper")
    return sim


def holding(*, robots: int = 1) -> kiks.Simulation:
    sim = a_simulation(robots=robots)
    closed(sim)
    assert held_by(sim) == 1
    return sim


def held_by(sim: kiks.Simulation) -> int:
    return int(sim.bodies()["holder"][0])


def place_of(sim: kiks.Simulation) -> tuple[float, float]:
    return tuple(sim.bodies()[["x_mm", "y_mm"]][0].tolist())


def records(sim: kiks.Simulation) -> tuple[Any, Any]:
    """Robots and bodies at one instant, the end of the tick: `pose` and `bodies` may be of two."""
    sim.sync()
    return sim.world.state.robots[0], sim.world.state.bodies[0]


def seen_from(sim: kiks.Simulation) -> tuple[float, float]:
    """Where the body is, ahead and to the left of robot 1."""
    robots, bodies = records(sim)
    x, y, heading = robots[["x_mm", "y_mm", "heading_rad"]][0].tolist()
    dx, dy = bodies["x_mm"][0] - x, bodies["y_mm"][0] - y
    c, s = math.cos(heading), math.sin(heading)
    return dx * c + dy * s, dy * c - dx * s


def deepest_overlap_mm(sim: kiks.Simulation) -> float:
    """An oracle that looks at every wall and pair of what stands on the floor."""
    (robots, bodies), deepest = records(sim), 0.0
    discs = [(r["x_mm"], r["y_mm"], spec.body.radius_mm) for r, spec in zip(robots, sim.specs, strict=True)]
    discs += [(b["x_mm"], b["y_mm"], b["radius_mm"]) for b in bodies[bodies["is_lifted"] == 0]]
    for k, (x, y, radius) in enumerate(discs):
        deepest = max(deepest, -contact.clearance_of_disc(*sim.world.free_space.ground, x, y, radius))
        for other_x, other_y, other_radius in discs[:k]:
            deepest = max(deepest, radius + other_radius - math.hypot(x - other_x, y - other_y))
    return deepest


def test_it_grips_carries_and_puts_down() -> None:
    sim = a_simulation()
    assert ask(sim, "G") == [0]  # the arm is up
    act(sim, "E,255", 0.6)
    assert (ask(sim, "G"), ask(sim, "F")) == ([255], [int(sim.bodies()["brightness"][0])])
    act(sim, "D,1", 0.6)
    assert held_by(sim) == 1
    assert ask(sim, "H,0") == [115]  # 200 (16 - 0.5)/27
    act(sim, "E,150", 0.6)
    assert sim.bodies()["is_lifted"][0] == 1
    assert ask(sim, "G") == [255]
    drive(sim, 10, 10, 2.0)
    drive(sim, 0, 0, 0.2)
    assert sim.pose(1)[0] > 440
    assert seen_from(sim) == pytest.approx((TOUCHING_MM + 1, 0.0), abs=1e-9)
    act(sim, "E,255", 0.6)
    assert held_by(sim) == 1
    assert sim.bodies()["is_lifted"][0] == 0
    act(sim, "D,0", 0.6)
    assert held_by(sim) == 0
    where = place_of(sim)
    drive(sim, -10, -10, 1.0)
    assert place_of(sim) == where
    assert sim.bodies()[["velocity_x", "velocity_y"]].tolist() == [(0.0, 0.0)]
    assert ask(sim, "G") == [0]


def test_what_stands_between_the_jaws_is_gripped_unless_it_is_too_wide_or_far_below() -> None:
    for ahead_mm, aside_mm, is_gripped in (
        (TOUCHING_MM + 0.1, 0.0, True),
        (RIM_MM + 36.5, 0.0, True),
        (RIM_MM + 37.5, 0.0, False),
        (TOUCHING_MM + 5, 11.0, True),
        (TOUCHING_MM + 5, -11.0, True),
        (TOUCHING_MM + 5, 12.5, False),  # one jaw would come down on it
        (-TOUCHING_MM - 1, 0.0, False),
        (0.0, TOUCHING_MM + 1, False),
    ):
        sim = a_simulation(ahead_mm, aside_mm)
        closed(sim)
        assert held_by(sim) == is_gripped, (ahead_mm, aside_mm)
        assert ask(sim, "H,0") == [115 if is_gripped else 0]
        if is_gripped:
            ahead, aside = seen_from(sim)
            assert aside == pytest.approx(0.0, abs=0.02)
            assert ahead >= TOUCHING_MM
        assert deepest_overlap_mm(sim) < 0.02
    sim = a_simulation()
    act(sim, "E,200", 0.5)
    act(sim, "D,1", 0.6)
    assert held_by(sim) == 0
    act(sim, "E,255", 0.6)  # closed jaws grip nothing
    assert held_by(sim) == 0
    sim.remove_body(1)
    sim.add_ball(300 + RIM_MM + 32.5, 300)
    closed(sim)
    assert held_by(sim) == 0


def test_two_grippers_at_one_cylinder() -> None:
    sim = a_simulation(robots=2)
    sim.place(2, place_of(sim)[0] + TOUCHING_MM + 1, 300, math.pi)
    for robot in (1, 2):
        act(sim, "E,255", 0.6, robot)
    for robot in (1, 2):
        kiks.Khepera(sim.port(robot)).send("T,1,D,1")
    sim.run(0.7)
    assert held_by(sim) == 1
    assert ask(sim, "H,0", 2) == [0]
    ask(sim, "D,0", 1)
    closed(sim, 2)
    assert held_by(sim) == 2


def test_it_drags_what_it_holds_as_fast_as_it_drives() -> None:
    ways = []
    for sim in (a_simulation(200.0), holding()):
        begin = sim.pose(1)[0]
        drive(sim, 10, 10, 1.0)
        ways.append(sim.pose(1)[0] - begin)
    assert ways[1] == pytest.approx(ways[0], rel=0.01)
    drive(sim, -5, 8, 3.0)
    assert seen_from(sim) == pytest.approx((TOUCHING_MM + 1, 0.0), abs=0.01)


def test_a_wall_stops_both_and_one_beside_the_load_the_turn() -> None:
    sim = holding()
    drive(sim, 20, 20, 8.0)
    x, y = place_of(sim)
    assert (x, y) == pytest.approx((890 - CYLINDER_MM, 300), abs=0.05)
    assert sim.pose(1)[0] == pytest.approx(x - TOUCHING_MM - 1, abs=0.05)
    assert sim.contacts(1) == 1
    assert max(kiks.Khepera(sim.port(1)).speed()) <= 5  # wheels slip, as a robot's at a wall
    assert deepest_overlap_mm(sim) < 0.02
    sim = holding()
    act(sim, "E,150", 0.6)
    sim.place(1, 861, 300, math.pi / 2)  # almost at the wall at its right, which the load meets after 0.3 rad
    act(sim, "E,255", 0.6)
    assert sim.bodies()["is_lifted"][0] == 0
    before = sim.world.state.robots["wheel_pulses"][0, 0].copy()
    drive(sim, 5, -5, 0.8)
    free_turn = 2 * 5 * 0.08 * 80 / 53
    assert math.pi / 2 - 0.7 * free_turn < sim.pose(1)[2] < math.pi / 2 - 0.29
    assert sim.pose(1)[0] < 860.0  # it levers itself off
    assert np.abs(sim.world.state.robots["wheel_pulses"][0, 0] - before).max() < 0.8 * 5 * 80
    assert deepest_overlap_mm(sim) < 0.02
    assert held_by(sim) == 1


def test_another_robot_pushes_both_and_turns_a_robot_whose_load_it_pushes_aside() -> None:
    sim = holding(robots=2)
    begin_x, begin_y = place_of(sim)
    sim.place(2, 300 - 2 * RIM_MM - 2, 300, 0.0)
    drive(sim, 10, 10, 2.0, robot=2)
    x, y = place_of(sim)
    assert x > begin_x + 20
    assert y == pytest.approx(begin_y, abs=0.1)
    assert seen_from(sim) == pytest.approx((TOUCHING_MM + 1, 0.0), abs=0.02)
    assert deepest_overlap_mm(sim) < 0.02
    sim = holding(robots=2)
    x, y = place_of(sim)
    sim.place(2, x, y + TOUCHING_MM + 1, -math.pi / 2)
    drive(sim, 10, 10, 1.0, robot=2)
    assert sim.pose(1)[2] < -0.3
    assert sim.pose(1)[1] < 299
    assert held_by(sim) == 1
    assert seen_from(sim) == pytest.approx((TOUCHING_MM + 1, 0.0), abs=0.02)


def test_it_puts_down_only_where_there_is_room() -> None:
    sim = holding(robots=2)
    act(sim, "E,100", 0.7)
    sim.place(2, 300 + TOUCHING_MM + 25, 300, 0.0)
    act(sim, "E,255", 1.0)
    assert sim.bodies()["is_lifted"][0] == 1
    assert 205 <= ask(sim, "H,1")[0] < 215  # it rests on the robot
    act(sim, "D,0", 1.0)
    assert held_by(sim) == 1
    assert deepest_overlap_mm(sim) == 0.0
    sim.place(2, 60, 120, 0.0)
    sim.run(1.0)
    assert held_by(sim) == 0
    assert sim.bodies()["is_lifted"][0] == 0
    assert (ask(sim, "H,0"), ask(sim, "H,1")) == ([200], [255])


def test_what_fell_beyond_the_edge_is_neither_seen_nor_gripped_again() -> None:
    sim = kiks.Simulation(kiks.Arena.box(604, 354, wall_mm=2), seed=1)
    sim.add_cylinder(550, 177)
    sim.place(1, 550 - TOUCHING_MM - 1, 177, 0.0)
    sim.fit(1, "gripper")
    closed(sim)
    act(sim, "E,150", 0.6)
    sim.place(1, 604 - RIM_MM - 3, 177, 0.0)
    act(sim, "D,0", 0.6)
    where = place_of(sim)
    assert where[0] > 604.0
    closed(sim)
    assert ask(sim, "G") == [0]
    assert held_by(sim) == 0
    assert ask(sim, "H,0") == [0]
    assert place_of(sim) == where


def test_the_load_stays_where_it_is_dropped_or_put_by_hand_or_left_by_a_robot_that_is_lifted() -> None:
    sim = holding()
    act(sim, "E,100", 0.7)
    act(sim, "D,0", 0.1)
    assert held_by(sim) == 0
    assert place_of(sim) == pytest.approx((300 + TOUCHING_MM + 1, 300), abs=0.01)
    sim = holding()
    where = place_of(sim)
    sim.place(1, 500, 500, 1.0)
    sim.run(0.1)
    assert held_by(sim) == 0
    assert place_of(sim) == where
    sim = holding()
    sim.move_body(1, 600, 400)
    sim.run(0.6)
    assert held_by(sim) == 0
    assert place_of(sim) == (600, 400)
    assert ask(sim, "H,0") == [0]
    sim = holding()
    sim.remove_body(1)
    sim.run(0.6)
    assert ask(sim, "H,0") == ask(sim, "G") == [0]


def test_a_reset_takes_the_grip_back_or_lets_go() -> None:
    sim = a_simulation()
    before = sim.checkpoint()
    closed(sim)
    act(sim, "E,100", 0.7)
    lifted = sim.checkpoint()
    for is_open in (False, True):
        drive(sim, -10, -10)
        if is_open:
            act(sim, "D,0", 1.0)
        sim.reset(lifted)
        drive(sim, 0, 0, 0.5)
        assert held_by(sim) == (0 if is_open else 1)
        assert seen_from(sim)[0] == pytest.approx(TOUCHING_MM + 1, abs=12)
        assert deepest_overlap_mm(sim) < 0.02
    sim.reset(before)
    closed(sim)
    act(sim, "E,100", 0.7)
    sim.reset(before)
    assert held_by(sim) == 0
    sim.run(0.6)
    assert held_by(sim) == 0
    assert ask(sim, "H,0") == [0]


@pytest.mark.slow
@settings(max_examples=share(5, 12))
@given(seed=st.integers(0, 10_000))
def test_nothing_overlaps_and_nothing_is_lost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = [int(mm) for mm in rng.integers(280, 500, 2)]
    robots = ["khepera", "khepera_ii", "khepera"]
    sim = kiks.Simulation(kiks.Arena.box(*size, rounded_mm=60), seed=seed, robot=robots)
    for robot in (1, 2, 3):
        sim.fit(robot, "gripper")
    for k in range(40):
        with suppress(kiks.ParameterError):
            add = sim.add_ball if k % 3 == 0 else sim.add_cylinder
            add(*rng.uniform(0, size), radius_mm=float(rng.uniform(4, 26)))
    count = len(sim.bodies())
    for _ in range(60):
        for robot in (1, 2, 3):
            approach(sim, robot, rng)
            left, right = rng.integers(-40, 60, 2)
            line = (f"D,{left},{right}", "D,15,15", "T,1,D,1", "T,1,D,0", "T,1,E,255", "T,1,E,100")[rng.integers(0, 6)]
            kiks.Khepera(sim.port(robot)).send(line)
        sim.run(float(rng.uniform(0.05, 0.5)))
        bodies = sim.bodies()
        on_floor = bodies[bodies["is_lifted"] == 0]
        assert len(bodies) == count
        # A lifted body without a holder was dropped beyond the edge.
        out = bodies[(bodies["is_lifted"] != 0) & (bodies["holder"] == 0)]
        across, up = (np.abs(out[name] - mm / 2) - mm / 2 for name, mm in zip(("x_mm", "y_mm"), size, strict=True))
        assert (np.maximum(across, up) >= 0).all()
        assert ((on_floor["x_mm"] > 0) & (on_floor["x_mm"] < size[0])).all()
        assert ((on_floor["y_mm"] > 0) & (on_floor["y_mm"] < size[1])).all()
        assert deepest_overlap_mm(sim) < 0.3


def approach(sim: kiks.Simulation, robot: int, rng: np.random.Generator) -> None:
    """Put a robot in front of some body, now and then, and grip it."""
    bodies = sim.bodies()
    if rng.random() > 0.15 or not len(bodies) or (bodies["holder"] == robot).any():
        return
    body, angle = bodies[rng.integers(0, len(bodies))], rng.uniform(0, 2 * math.pi)
    way = sim.specs[robot - 1].body.radius_mm + body["radius_mm"] + rng.uniform(0.1, 3)
    with suppress(kiks.ParameterError):
        sim.place(robot, body["x_mm"] - way * math.cos(angle), body["y_mm"] - way * math.sin(angle), angle)
        drive(sim, 0, 0, robot=robot)
        closed(sim, robot)
