"""The gate: pauses and slows simulated time while a person watches."""

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import pytest
from tests.guard import GUARD_S
from tests.ports.helpers import WallClock

import kiks
from kiks.clock.gate import LAG_NS, SLICE_NS, Gate
from kiks.clock.pace import Pace
from kiks.errors import HaltError, ParameterError
from kiks.model.arena import Pose
from kiks.sim.drag import Drags


class QuickGate(Gate):
    """A gate whose wall clock moves only when it sleeps."""

    def __init__(self, lock: threading.RLock, speed: float | None) -> None:
        self.passed_ns = 0
        super().__init__(lock, speed=speed, wall_ns=lambda: self.passed_ns)

    def _sleep(self, seconds: float) -> None:
        self.passed_ns += round(seconds * 1e9) + 1


def course(sim: kiks.Simulation) -> str:
    """Drive with a program that sleeps and reads; return the state hash."""
    with kiks.Khepera(sim.port(1)) as robot:
        robot.set_speed(6, 3)
        for _ in range(20):
            robot.proximity()
            robot.pause(0.05)
        robot.set_speed(0, 0)
    return sim.state_hash()


@contextmanager
def driving(sim: kiks.Simulation, seconds: float) -> Iterator[threading.Thread]:
    """Let a thread move a world."""
    thread = threading.Thread(target=sim.run, args=(seconds,), daemon=True)
    thread.start()
    try:
        yield thread
    finally:
        if sim.loop.gate is not None:
            sim.loop.gate.close()
        thread.join(GUARD_S)
        assert not thread.is_alive()


@pytest.mark.parametrize("speed", [None, 1000.0])
def test_gate_changes_nothing(speed: float | None) -> None:
    alone, watched = kiks.Simulation(seed=3), kiks.Simulation(seed=3)
    watched.loop.gate = QuickGate(watched.lock, speed)
    looks = 0

    def look() -> None:
        nonlocal looks
        looks += 1
        watched.poses()
        watched.proximity(1, noise=True)

    watched.loop.gate.keep(look)
    assert course(watched) == course(alone)
    assert looks > 100
    assert watched.now_ns == alone.now_ns


def test_time_keeps_the_pace() -> None:
    gate = QuickGate(threading.RLock(), 2.0)
    now_ns = 0
    while now_ns < 10**9:
        next_ns = gate.admit(now_ns, 10**9)
        assert next_ns - now_ns <= 2 * SLICE_NS
        now_ns = next_ns
    assert gate.passed_ns == pytest.approx(5e8, rel=1e-3)


def test_thinking_time_is_not_caught_up() -> None:
    gate = QuickGate(threading.RLock(), 1.0)
    now_ns = gate.admit(0, 10**12)
    gate.passed_ns += 100 * LAG_NS
    begin_ns = gate.passed_ns
    for _ in range(10):
        now_ns = gate.admit(now_ns, 10**12)
    assert now_ns == 11 * SLICE_NS
    assert gate.passed_ns - begin_ns == pytest.approx(9 * SLICE_NS, rel=1e-3)


def test_pause_step_and_go_on() -> None:
    sim = kiks.Simulation()
    gate = sim.loop.gate = Gate(sim.lock, speed=None)
    gate.pause(sim.now_ns)
    with driving(sim, 1.0) as thread:
        for count in range(1, 4):
            gate.step(0.01)
            while sim.now_ns < count * 10_000_000:
                assert thread.is_alive()
        assert gate.is_paused
        assert gate.ask(lambda: sim.now_ns).result(GUARD_S) == 30_000_000
        gate.go_on()
        thread.join(GUARD_S)
        assert sim.time_s == 1.0


def test_requests_run_at_once_or_in_the_thread_that_moves_the_world() -> None:
    sim = kiks.Simulation()
    gate = sim.loop.gate = Gate(sim.lock, speed=None)
    assert gate.ask(lambda: threading.current_thread()).result(0) is threading.current_thread()
    with pytest.raises(ParameterError, match="robot must be the number"):
        gate.ask(lambda: sim.pose(2)).result(0)
    with sim.lock:
        # Another thread cannot have the lock, so the one that has it does what was asked for.
        futures = []
        asking = threading.Thread(target=lambda: futures.append(gate.ask(lambda: threading.current_thread())))
        asking.start()
        asking.join(GUARD_S)
        assert not futures[0].done()
        sim.run(0.01)
        assert futures[0].result(0) is threading.current_thread()
    assert not gate.is_up


def test_waiting_at_the_gate_does_not_use_up_patience() -> None:
    gate = QuickGate(threading.RLock(), 0.1)
    before_ns = gate.wall_ns()
    patience = gate.patience(1.0)
    patience.left_s()
    now_ns = 0
    while now_ns < 10**8:
        now_ns = gate.admit(now_ns, 10**8)
    assert gate.passed_ns > 5 * 10**8
    assert gate.wall_ns() - before_ns < gate.passed_ns / 2
    assert patience.left_s() > 0.5


def test_pace_changes_without_a_jump() -> None:
    wall = WallClock()
    pace = Pace(2.0, wall_ns=wall)
    pace.start(0)
    wall.time_ns += 100
    pace.set_speed(0.5, pace.now_ns())
    wall.time_ns += 100
    assert pace.now_ns() == 250
    pace.hold(250)
    wall.time_ns += 1000
    assert (pace.now_ns(), pace.wall_wait_s(300)) == (250, float("inf"))
    pace.go_on()
    wall.time_ns += 100
    assert pace.now_ns() == 300
    with pytest.raises(ParameterError, match="speed must be a number from"):
        pace.set_speed(0, 0)


def world() -> kiks.Simulation:
    sim = kiks.Simulation(kiks.Arena.box(600, 400), robots=2, seed=1)
    sim.place(1, 100, 100, 0)
    sim.place(2, 300, 100, 0)
    sim.add_ball(100, 250)
    sim.add_lamp(50, 350)
    return sim


def test_dragged_things_slide_along_obstacles() -> None:
    sim = world()
    drags = Drags(sim)
    drags.grab("a", "robot", 0)
    drags.move("a", 1000, 1000)
    x_mm, y_mm, _ = sim.pose(1)
    assert x_mm == pytest.approx(600 - 10 - 27.5, abs=1.5)
    assert y_mm == pytest.approx(400 - 10 - 27.5, abs=1.5)
    drags.move("a", 300, 100)
    x_mm, y_mm, _ = sim.pose(1)
    assert ((x_mm - 300) ** 2 + (y_mm - 100) ** 2) ** 0.5 == pytest.approx(55, abs=0.6)
    drags.turn("a", 1.5)
    assert sim.pose(1)[2] == 1.5
    drags.drop("a")
    drags.move("a", 100, 100)
    assert sim.pose(1)[:2] == (x_mm, y_mm)


def test_several_drags_of_all_kinds() -> None:
    sim = world()
    drags = Drags(sim)
    drags.grab("a", "body", 0)
    drags.grab("b", "lamp", 0)
    drags.move("a", 200, 300)
    drags.move("b", 5000, -3)
    assert (sim.bodies()["x_mm"][0], sim.bodies()["y_mm"][0]) == (200, 300)
    assert sim.lamps[0, :2].tolist() == [600, 0]
    with pytest.raises(ParameterError, match="one hand must let go"):
        drags.grab("b", "body", 0)
    assert not drags.holds("lamp", 0)
    for what, index in (("robot", 2), ("robot", -1), ("floor", 0), ("lamp", True + 1)):
        with pytest.raises(ParameterError, match="a hand "):
            drags.grab("a", what, index)
    assert drags.are_empty
    drags.grab("a", "body", len(sim.bodies()) - 1)
    sim.remove_body(len(sim.bodies()))
    drags.move("a", 100, 100)
    assert drags.are_empty, "a thing that is removed is let go"


def test_dragged_robot_stays_while_its_wheels_turn() -> None:
    sim = world()
    gate = sim.loop.gate = Gate(sim.lock, speed=None)
    drags = Drags(sim)
    drags.grab("a", "robot", 0)
    gate.keep(drags.keep)
    robot = kiks.Khepera(sim.port(1))
    robot.set_speed(20, 20)
    sim.run(1.0)
    gate.ask(lambda: None).result(0)
    assert sim.pose(1) == (100, 100, 0)
    assert sim.travelled_mm(1) > 100
    sim.remove_body(1)
    gate.leave(drags.keep)
    drags.drop("a")
    sim.run(0.5)
    assert sim.pose(1)[0] > 150


def test_other_robots_may_push_a_dragged_robot() -> None:
    starts = (Pose(200, 38, 0), Pose(140, 38, 0), Pose(260, 38, math.pi), Pose(200, 100, -math.pi / 2))
    sim = kiks.Simulation(replace(kiks.Arena.box(400, 400), starts=starts), robots=4, seed=1)
    for robot in range(1, 5):
        kiks.Khepera(sim.port(robot)).set_speed(20, 20)
    gate = sim.loop.gate = Gate(sim.lock, speed=None)
    drags = Drags(sim)
    drags.grab("a", "robot", 0)
    gate.keep(drags.keep)
    for step in range(100):
        drags.move("a", 200 + step, 38)
        drags.turn("a", step / 10)
        sim.run(0.05)
    assert abs(sim.pose(1)[1] - 38) < 60


def test_halt_ends_the_wait_of_the_program_once() -> None:
    """The program waits in a world that stands still, which nothing else would end."""
    sim = kiks.Simulation()
    sim.loop.gate = gate = Gate(sim.lock)
    gate.pause(sim.now_ns)
    told: list[str] = []

    def pause() -> None:
        try:
            sim.run(10)
        except HaltError as error:
            told.append(str(error))

    thread = threading.Thread(target=pause)
    thread.start()
    gate.halt()
    thread.join(GUARD_S)
    assert told == ["Halt was pressed on the desk: the program and the robots are stopped."]
    gate.set_speed(None, sim.now_ns)
    gate.go_on()
    sim.run(1)
    assert sim.time_s == 1
