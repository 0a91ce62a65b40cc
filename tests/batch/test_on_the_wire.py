"""A batch and a wire: the same controller, seed and timing, the same run to the bit."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases, share
from tests.learn.small import noted

import kiks
from kiks.client.drive import Driver
from kiks.model.arena import Ball, Lamp

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


def arena(*, ball: bool = False) -> kiks.Arena:
    walls = np.zeros((500, 600), np.uint8)
    walls[200:210, 150:400] = 255
    walls[300:400, 420:430] = 1
    return replace(kiks.Arena.from_array(walls), balls=(Ball(300, 100),) * ball, lamps=(Lamp(100, 400),))


def check_worlds(
    worlds: Sequence[int], timing: kiks.Timing, controller: Any, parameters: Any, *, ball: bool = False, **options: Any
) -> None:
    """Check that worlds of a batch take as many loops as drives on the wire, and end in the same states."""
    batch = kiks.Batch(arena(ball=ball), worlds[-1] + 1, seed=11, timing=timing, **options)
    rollouts = batch.run(controller, parameters, seconds=8.0)
    for world in worlds:
        thinking = f"fixed:{timing.think_s * 1e3}"
        sim = kiks.Simulation(arena(ball=ball), seed=11 + world, thinking=thinking, **options)
        ports = [sim.port(number) for number in range(1, sim.robot_count + 1)]
        for number, each in enumerate(controller if isinstance(controller, list) else [], 1):
            if "camera" in each.senses:
                sim.fit(number, "k213")
        hashes = noted(sim, ports[0])
        loops = kiks.drive(ports, controller, parameters, seconds=8.0, period_s=timing.period_s, baud=timing.baud)
        # The last line that it sends stops the robot.
        assert (loops, hashes[-1]) == (rollouts.step_counts[world], batch.state_hash(world))


@pytest.mark.parametrize(
    "timing",
    [kiks.Timing(0.1, 9600), kiks.Timing(0.0, 9600), kiks.Timing(0.05, 38400, 0.0031)],
    ids=["each 100 ms", "as fast as it goes", "with thinking"],
)
@pytest.mark.parametrize(
    ("controller", "parameters", "ball"),
    cases([(wander, [1.0], False), (peer, [], True), (wander, [1.0], True), (peer, [], False)], 2),
)
def test_batch_and_wire_agree_to_the_bit(timing: kiks.Timing, controller: Any, parameters: Any, ball: bool) -> None:
    check_worlds(share((0, 2), (0, 1, 2)), timing, controller, parameters, ball=ball)


@pytest.mark.parametrize("response", ["thesis", "fast"])
def test_every_response_is_that_of_the_wire(response: str) -> None:
    check_worlds((0, 1), kiks.Timing(0.1, 9600), wander, [0.7], response=response)


@pytest.mark.parametrize("kind", cases(["plastic", "elman", "linear", "mlp", "ctrnn", "graph", "gru"], 2))
def test_controllers_that_come_with_kiks_agree(kind: str) -> None:
    controller = getattr(kiks.controllers, kind)()
    check_worlds((0,), kiks.Timing(0.1, 9600), controller, kiks.controllers.random_parameters(controller, 1, seed=7)[0])


def test_one_program_with_a_controller_for_each_robot() -> None:
    given = [wander, peer, wander], [[1.0], [], [0.5]]
    check_worlds((0, 1), kiks.Timing(0.1, 19200), *given, ball=True, robots=3)


@pytest.mark.parametrize(
    ("timing", "controllers", "parameters"),
    cases(
        [
            (kiks.Timing(0.1, 19200), [gaze, wander], [[], [1.0]]),
            (kiks.Timing(0.03, 57600), [gaze_only, gaze_only], [[], []]),
            (kiks.Timing(0.03, 57600), [gaze, wander], [[], [1.0]]),
            (kiks.Timing(0.1, 19200), [gaze_only, gaze_only], [[], []]),
        ],
        2,
    ),
)
def test_pictures_are_those_of_the_wire(timing: kiks.Timing, controllers: Any, parameters: Any) -> None:
    check_worlds((0, 10), timing, controllers, parameters, ball=True, robots=2)


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
        driver = Driver(ports, wander, speeds[world], period_s=timing.period_s, baud=19200)
        for _ in range(steps):
            driver.step()
        assert sim.state_hash() == batch.state_hash(world)
    with pytest.raises(kiks.ParameterError, match="until must be"):
        batch.run(wander, speeds, seconds=1.0, until="contact")  # type: ignore[arg-type]
