"""A batch and the line: the same controller, seed and timing, the same run to the bit."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases, share
from tests.learn.small import noted, refused
from tools.campaigns.runner import rng_of
from tools.campaigns.worlds import set_up

import kiks
from kiks.client.drive import ControllerDriver
from kiks.model.arena import Ball, Lamp
from kiks.model.project import Project, ProjectRobot

pytestmark = pytest.mark.slow


@kiks.controller(parameters=1, memory=1)
def wander(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Keep off what is near, and waver a little with the time."""
    memory[0] += 1.0
    waver = 2.0 if memory[0] % 40.0 < 20.0 else -2.0
    left = sensors[0] * 4 + sensors[1] * 6 - sensors[2] * 6 - sensors[3] * 18 - sensors[4] * 6 - sensors[5] * 4
    right = -sensors[0] * 4 - sensors[1] * 6 - sensors[2] * 14 - sensors[3] * 8 + sensors[4] * 6 + sensors[5] * 4
    wheels[0] = parameters[0] * (8.0 + left / 200.0 + waver)
    wheels[1] = parameters[0] * (8.0 + right / 200.0 - waver)


def arena(*, ball: bool = False) -> kiks.Arena:
    walls = np.zeros((500, 600), np.uint8)
    walls[200:210, 150:400] = 255
    walls[300:400, 420:430] = 1
    return replace(kiks.Arena.from_array(walls), balls=(Ball(300, 100),) * ball, lamps=(Lamp(100, 400),))


@pytest.mark.parametrize("case", range(share(6, 120)))
def test_random_worlds_are_those_of_the_line(case: int) -> None:
    assert set_up(rng_of(52, "worlds", case)).differences() == []


@pytest.mark.parametrize("baud", cases([9600, 38400]))
@pytest.mark.parametrize("robots", [1, 2, 4])
def test_a_program_thinks_once_for_all_its_robots(robots: int, baud: int) -> None:
    timing = kiks.Timing(0.05, baud, think_s=0.0070000001)
    batch = kiks.Batch(arena(ball=True), 2, robots=robots, seed=11, timing=timing)
    assert kiks.verify(batch, wander, [1.0], seconds=4.0) == []
    champion = kiks.Champion(wander, [1.0], timing=timing)
    sim, ports = champion.simulation(arena(ball=True), robots=robots, seed=12)
    hashes = noted(sim, ports[0])
    champion.drive(ports, seconds=4.0)
    assert hashes[-1] == batch.state_hash(1)  # the last line that it sends stops the robot


def test_robots_of_other_sizes_and_gains_begin_as_those_of_simulations() -> None:
    plain = kiks.RobotSpec.load("khepera")
    large = plain.with_changes(body__diameter_mm=110.0, reset__speed_gains=(2000, 500, 50))
    batch = kiks.Batch(arena(), 4, robots=2, robot=[[plain, plain], [large, plain], [large, large], [plain, plain]])
    assert kiks.verify(batch, wander, [1.0], seconds=3.0) == []


@pytest.mark.parametrize("robot", ["epuck", "epuck2"])
def test_steppers_with_senses_of_their_own_are_those_of_the_line(robot: str) -> None:
    """Readings come in the order and on the scales of controllers, and from slots of their own."""
    senses = "proximity", "ambient", "positions", "ground", "microphones"
    controller = kiks.controllers.linear(senses=senses, speed_limit=30)
    parameters = np.random.default_rng(4).normal(size=controller.parameter_count)
    batch = kiks.Batch(arena(ball=True), 2, robots=2, robot=robot, seed=3, timing=kiks.Timing(think_s=0.003))
    assert kiks.verify(batch, controller, parameters, seconds=3) == []
    assert kiks.verify(batch, wander, [1.0], seconds=3) == []


def test_kiks_run_gives_a_champion_of_two_robots_the_time_of_its_batch(tmp_path: Path) -> None:
    world = Project(kiks.Arena.box(500, 500), robots=(ProjectRobot(), ProjectRobot()), seed=3)
    weights = [0.6, 0.6, 0.5, -0.5, 1, -2, 1, -2, -2, 1, -2, 1, -0.5, 0.5, 0, 0, 0, 0]
    champion = kiks.Champion(kiks.controllers.linear(), weights, timing=kiks.Timing(think_s=0.007), world=world)
    champion.save(tmp_path / "two.toml")
    batch = kiks.Batch(world.arena, 1, robots=2, seed=3, timing=champion.timing)
    batch.run(champion.controller, weights, seconds=2.95)
    words = [sys.executable, "-m", "kiks", "run", "--json", "--seconds", "3", str(tmp_path / "two.toml")]
    assert json.loads(subprocess.run(words, capture_output=True, check=True).stdout)["state"] == batch.state_hash(0)


@kiks.sense(command="E", readings=2, least=-127, most=127)
def slower(view: Any, readings: Any) -> None:
    """Read less than the command does, from tick 100 on."""
    for wheel in range(2):
        readings[wheel] = view.robots[view.robot].measured_speed[wheel] - (view.robot == 1 and view.tick_count >= 100)


def test_the_first_difference_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    batch = kiks.Batch(arena(), 3, robots=2, seed=1, starts=[[100, 100, 0], [500, 100, 0]], timing=kiks.Timing(0.1))

    @kiks.controller(senses=slower)
    def ahead(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        wheels[0], wheels[1] = 3.0, 3.0

    first, second = kiks.verify(batch, ahead, seconds=3.0, worlds=(2, 1))
    assert (first.world, first.robot, first.quantity, first.batch, first.line) == (2, 2, "slower 0", 2.0, 3.0)
    assert (first.loop, first.tick, second.world) == (11, 110, 1)
    assert str(first) == "world 2, loop 11, tick 110, robot 2: slower 0 is 2.0 in the batch, 3.0 on the line"
    # A line with other thinking, and a run that is not that of its loops.
    monkeypatch.setattr(kiks.Timing, "thinking", "fixed:5")
    (found,) = kiks.verify(batch, wander, [1.0], seconds=1.0, worlds=[0])
    assert (found.loop, found.quantity.split()[0]) == (1, "proximity")
    monkeypatch.undo()
    monkeypatch.setattr(kiks.Batch, "run", lambda *_, **__: batch.reset())
    assert [each.quantity for each in kiks.verify(batch, wander, [1.0], seconds=1.0, worlds=[0])] == ["time_s"]
    monkeypatch.undo()
    without = kiks.Batch(arena(), 1, timing=kiks.Timing(0.1, baud=None))
    refused("timing must have a baud rate, but it was None", kiks.verify, without, wander, [1.0], seconds=1.0)
    refused("world must be .* but it was 3", kiks.verify, batch, wander, [1.0], seconds=1.0, worlds=[3])


def test_step_by_step_is_the_same_as_at_once() -> None:
    timing = kiks.Timing(0.05, 38400)
    measures = [kiks.measures.path_mm, kiks.measures.avoidance]
    stepped = kiks.Batch(arena(ball=True), worlds=9, robots=2, seed=1, timing=timing, measures=measures)
    memory, wheels = np.zeros((9, 2, 1)), np.zeros((9, 2, 2))
    sensors = stepped.reset()
    while stepped.times_s.max() < 1.999:
        for world in range(9):
            for robot in range(2):
                wander(sensors[world, robot], memory[world, robot], np.ones(1), wheels[world, robot])
        before = stepped.state_hash(0)
        sensors = stepped.step(wheels)
    assert before != stepped.state_hash(0)
    alone = kiks.Batch(arena(ball=True), worlds=9, robots=2, seed=1, timing=timing)
    rollouts = alone.run(wander, [1.0], seconds=1.95 + 1e-9, measures=measures)
    np.testing.assert_array_equal(alone.times_s, stepped.times_s)
    np.testing.assert_array_equal(rollouts.values, stepped.values)


@kiks.measure(notes=2)
def bumped(moment: Any, notes: Any) -> None:
    """Seconds up to the first contact, once there was one."""
    if moment.is_touching and notes[0] == 0.0:
        notes[0] = moment.time_s
    notes[1] += 1.0


def test_a_trial_ends_with_its_robots_first_note_and_leaves_the_world_as_a_wire_does() -> None:
    timing, speeds = kiks.Timing(0.06, 19200), np.array([[3.0], [0.0], [1.5]])
    batch = kiks.Batch(arena(), 3, robots=2, seed=5, timing=timing)
    endless = batch.run(wander, speeds, seconds=8.0, measures=[bumped])
    until = batch.run(wander, speeds, seconds=8.0, measures=[kiks.measures.path_mm], until=bumped)
    assert (until.measures, until.values.shape) == (("path_mm",), (3, 2, 1))
    assert (until.step_counts < endless.step_counts).tolist() == [True, False, True]  # robots of speed 0 touch nothing
    for world, steps in enumerate(until.step_counts.tolist()):
        sim = kiks.Simulation(arena(), robots=2, seed=5 + world)
        ports = [sim.port(1), sim.port(2)]
        driver = ControllerDriver(ports, wander, speeds[world], period_s=timing.period_s, baud=19200)
        for _ in range(steps):
            driver.step()
        assert sim.state_hash() == batch.state_hash(world)
    with pytest.raises(kiks.ParameterError, match="until must be"):
        batch.run(wander, speeds, seconds=1.0, until="contact")  # type: ignore[arg-type]
