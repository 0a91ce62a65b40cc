"""Nolfi's task: a gripper carries cylinders out of an arena, in batches as on the wire."""

from dataclasses import replace

import numpy as np
import pytest
from tests.at_length import cases
from tests.learn.small import refused

import kiks
from kiks.control.controllers import PICK_UP, RELEASE, steps_of
from kiks.model.arena import Cylinder

ARCHITECTURES = ("designed", "emergent", "elman", "feed_forward", "hidden")


def arena() -> kiks.Arena:
    return replace(kiks.Arena.box(604, 354, wall_mm=2), cylinders=(Cylinder(150, 175, radius_mm=11.5),))


def reflex() -> np.ndarray:
    """Return parameters of `designed` that drive ahead, pick up what is ahead, and release at the wall."""
    parameters = np.zeros((2, 8, 4))
    parameters[:, 0] = 1.0, 1.0, -1.0, -1.0
    parameters[0, 3:5, 2] = 4.0  # of the two sensors in front: picking up
    parameters[1, 0, 3], parameters[1, 3:5, 3] = -6.0, 4.0
    return parameters.ravel()


def test_a_cylinder_is_carried_out_and_counted() -> None:
    designed = kiks.controllers.collector(architecture="designed")
    batch = kiks.Batch(arena(), 2, starts=[[[90, 175, 0.0]], [[500, 175, 3.14]]], timing=kiks.Timing(0.1, 38_400))
    found = batch.run(designed, reflex(), seconds=20.0, measures=[kiks.measures.taken_out]).values[:, 0, 0]
    assert found.tolist() == [1.0, 1.0]
    bodies = batch.state.bodies[:, 0]
    assert ((bodies["is_lifted"] == 1) & (bodies["holder"] == 0)).all()
    assert bodies["x_mm"][0] > 604.0
    assert bodies["x_mm"][1] < 0.0


@pytest.mark.parametrize("architecture", cases(ARCHITECTURES, 3))
def test_a_collector_is_the_same_on_the_wire(architecture: str) -> None:
    task = kiks.tasks.nolfi_1997(architecture=architecture)
    parameters = 3.0 * kiks.controllers.random_parameters(task.controller, 1, seed=2)[0]
    parameters = reflex() if architecture == "designed" else parameters
    batch = kiks.Batch(task.arenas[0], 1, seed=5, timing=task.timings[0])
    assert kiks.verify(batch, task.controller, parameters, seconds=8.0) == []


def test_a_macro_blocks_the_network_for_its_steps() -> None:
    designed = kiks.controllers.collector(architecture="designed")
    memory, outputs, sensors = np.zeros(designed.memory_count), np.zeros(4), np.zeros(9)
    sensors[2:4] = 1000.0
    for full, phases in ((0.0, PICK_UP), (255.0, RELEASE)):
        sensors[8] = full
        seen = []
        for _ in range(steps_of.py_func(phases)):
            designed(sensors, memory, reflex(), outputs)
            seen.append(tuple(outputs[1:]))
        assert seen == [tuple(each) for count, *each in phases for _ in range(count)]
        sensors[2:4] = 0.0
        designed(sensors, memory, reflex(), outputs)
        assert outputs[0] > 0.0
        sensors[2:4] = 1000.0


def test_what_is_outside_is_out_of_the_way() -> None:
    sim = kiks.Simulation(arena(), seed=1)
    sim.fit(1, "gripper")
    sim.place(1, 30, 175, 3.14159)
    record = sim.world.state.bodies[0]
    record["holder"], record["is_lifted"], record["hold_ahead_mm"] = 1, 1, 45.0
    sim.world.state.robots[0, 0]["jaws"] = 90.0
    sim.world.state.robots[0, 0]["is_closing"] = 1
    sim.run(0.1)
    robot = kiks.Khepera(sim.port(1))
    robot.turret(1, "D,0")
    sim.run(0.5)
    (body,) = sim.bodies()
    assert (body["holder"], body["is_lifted"]) == (0, 1)
    assert body["x_mm"] < 0.0
    robot.turret(1, "D,1")
    robot.set_speed(-10, -10)
    sim.run(1.0)
    assert sim.bodies()[0]["x_mm"] == body["x_mm"]
    sim.move_body(1, 300, 175)
    assert sim.bodies()[0]["is_lifted"] == 0


def test_an_unknown_architecture_is_refused() -> None:
    refused("architecture", kiks.tasks.nolfi_1997, architecture="emergnt")
