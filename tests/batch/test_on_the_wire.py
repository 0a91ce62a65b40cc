"""A batch and a wire: the same controller, seed and timing, the same run to the bit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import kiks
from kiks.client.drive import Driver

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


@kiks.controller(senses=("proximity", "ambient"))
def peer(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Turn to the darker side, away from what is near."""
    wheels[0] = 6.0 + (sensors[8] - sensors[13]) / 50.0 - sensors[4] / 100.0
    wheels[1] = 6.0 - (sensors[8] - sensors[13]) / 50.0 - sensors[1] / 100.0


def arena(**things: Any) -> kiks.Arena:
    from kiks.model.arena import Ball, Lamp

    walls = np.zeros((500, 600), np.uint8)
    walls[200:210, 150:400] = 255
    walls[300:400, 420:430] = 1
    drawn = kiks.Arena.from_array(walls)
    from dataclasses import replace

    return replace(drawn, balls=(Ball(300, 100),) * bool(things.get("ball")), lamps=(Lamp(100, 400),))


def drive_alone(
    where: kiks.Arena,
    seed: int,
    timing: kiks.Timing,
    controller: Any,
    parameters: Any,
    cameras: Sequence[int] = (),
    **sim_options: Any,
) -> tuple[int, str]:
    """Return the loops of a drive on the wire, and the hash when it ended, before the robot was stopped."""
    assert timing.baud is not None
    sim = kiks.Simulation(where, seed=seed, thinking=f"fixed:{timing.think_s * 1e3}", **sim_options)
    for number in cameras:
        sim.fit(number, "k213")
    ports = [sim.port(number + 1) for number in range(sim.robot_count)]
    hashes = []
    for port in ports:
        port.baudrate = timing.baud
    first: Any = ports[0]
    send = first.write

    def note_and_send(data: bytes) -> int:
        hashes.append(sim.state_hash())
        return int(send(data))

    first.write = note_and_send
    loops = kiks.drive(ports, controller, parameters, seconds=8.0, period_s=timing.period_s)
    return loops, hashes[-1]


@pytest.mark.parametrize(
    "timing",
    [kiks.Timing(0.1, 9600), kiks.Timing(0.0, 9600), kiks.Timing(0.05, 38400, 0.0031)],
    ids=["each 100 ms", "as fast as it goes", "with thinking"],
)
@pytest.mark.parametrize("controller", [wander, peer], ids=["proximity", "both senses"])
@pytest.mark.parametrize("ball", [False, True], ids=["alone", "with a ball"])
def test_batch_and_wire_agree_to_the_bit(timing: kiks.Timing, controller: kiks.Controller, ball: bool) -> None:
    where = arena(ball=ball)
    batch = kiks.Batch(where, worlds=3, seed=11, timing=timing)
    rollouts = batch.run(controller, [1.0], seconds=8.0)
    for world in range(3):
        loops, state_hash = drive_alone(where, 11 + world, timing, controller, [1.0])
        assert (loops, state_hash) == (rollouts.step_counts[world], batch.state_hash(world))


@pytest.mark.parametrize("response", ["thesis", "fast"])
def test_every_response_is_that_of_the_wire(response: str) -> None:
    timing = kiks.Timing(0.1, 9600)
    batch = kiks.Batch(arena(), worlds=2, seed=3, timing=timing, response=response)
    rollouts = batch.run(wander, [[1.0], [0.7]], seconds=8.0)
    for world, gain in enumerate((1.0, 0.7)):
        found = drive_alone(arena(), 3 + world, timing, wander, [gain], response=response)
        assert found == (rollouts.step_counts[world], batch.state_hash(world))


@pytest.mark.parametrize("kind", ["linear", "mlp", "elman", "ctrnn", "graph", "gru", "plastic"])
def test_controllers_that_come_with_kiks_agree(kind: str) -> None:
    controller, timing = getattr(kiks.controllers, kind)(), kiks.Timing(0.1, 9600)
    parameters = kiks.controllers.random_parameters(controller, 1, seed=7)[0]
    batch = kiks.Batch(arena(), worlds=1, seed=8, timing=timing)
    rollouts = batch.run(controller, parameters, seconds=8.0)
    assert drive_alone(arena(), 8, timing, controller, parameters) == (rollouts.step_counts[0], batch.state_hash(0))


def test_one_program_with_a_controller_for_each_robot() -> None:
    timing = kiks.Timing(0.1, 19200)
    batch = kiks.Batch(arena(ball=True), worlds=2, robots=3, seed=5, timing=timing)
    controllers, parameters = [wander, peer, wander], [[1.0], [], [0.5]]
    rollouts = batch.run(controllers, parameters, seconds=8.0)
    for world in range(2):
        found = drive_alone(arena(ball=True), 5 + world, timing, controllers, parameters, robots=3)
        assert found == (rollouts.step_counts[world], batch.state_hash(world))


@kiks.controller(senses=("proximity", "camera"))
def gaze(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Turn to the brighter side of the picture, away from what is near."""
    left, right = sensors[8:16].sum(), sensors[16:24].sum()
    wheels[0] = 6.0 + (right - left) / 150.0 - sensors[4] / 100.0
    wheels[1] = 6.0 + (left - right) / 150.0 - sensors[1] / 100.0


@kiks.controller(senses=("camera",))
def gaze_only(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Turn to the darker side of the picture."""
    wheels[0], wheels[1] = 4.0 + sensors[12:].sum() / 500.0, 4.0 + sensors[:4].sum() / 500.0


@pytest.mark.parametrize("timing", [kiks.Timing(0.1, 19200), kiks.Timing(0.03, 57600)], ids=["100 ms", "30 ms"])
@pytest.mark.parametrize("controllers", [[gaze, wander], [gaze_only, gaze_only]], ids=["one camera", "two"])
def test_pictures_are_those_of_the_wire(timing: kiks.Timing, controllers: list[kiks.Controller]) -> None:
    batch = kiks.Batch(arena(ball=True), worlds=11, robots=2, seed=7, timing=timing)
    rollouts = batch.run(controllers, [[1.0], [1.0]], seconds=8.0)
    for world in (0, 10):
        cameras = [number for number, each in enumerate(controllers, 1) if "camera" in each.senses]
        found = drive_alone(arena(ball=True), 7 + world, timing, controllers, [[1.0], [1.0]], cameras, robots=2)
        assert found == (rollouts.step_counts[world], batch.state_hash(world))


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
    assert until.measures == ("path_mm",)
    assert until.values.shape == (3, 2, 1)
    assert (until.step_counts < endless.step_counts).tolist() == [True, False, True]  # robots of speed 0 touch nothing
    for world, steps in enumerate(until.step_counts.tolist()):
        sim = kiks.Simulation(arena(), robots=2, seed=5 + world)
        ports = [sim.port(1), sim.port(2)]
        for port in ports:
            port.baudrate = 19200
        driver = Driver(ports, wander, speeds[world], period_s=timing.period_s)
        for _ in range(steps):
            driver.step()
        assert sim.state_hash() == batch.state_hash(world)
    with pytest.raises(kiks.ParameterError, match="until must be"):
        batch.run(wander, speeds, seconds=1.0, until="contact")  # type: ignore[arg-type]
