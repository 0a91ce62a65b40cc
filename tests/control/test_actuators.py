"""Actuators: what a batch does is what commands do on the wire, to the bit and in time."""

import pickle
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases
from tests.learn.small import refused

import kiks
from kiks.control.actuators import ACTUATORS, check_actuators, value_of
from kiks.firmware.turret import Turret
from kiks.model.arena import Cylinder


class Horn(Turret):
    """A turret of a user's own that takes a signed number, and tells it."""

    number, name, memory_count = 25, "Horn", 2

    @kiks.actuator(command="T,25,S", least=-2000, most=20_000)
    def pitch(view: Any, value: Any) -> None:  # noqa: N805
        view.memory[1] = value + view.robot

    @kiks.sense(command="T,25,G", least=-2000, most=30_000)
    def heard(view: Any, readings: Any) -> None:  # noqa: N805
        readings[0] = view.memory[1]

    def set(self, value: int) -> tuple[int, ...]:
        """S: the pitch."""
        self.site.memory[1] = value + self.site.robot - 1
        return ()

    def get(self) -> tuple[int, ...]:
        """G: the pitch."""
        return (int(self.site.memory[1]),)

    orders = {"S": (1, set), "G": (0, get)}  # noqa: RUF012


def arena() -> kiks.Arena:
    places = ((150, 150), (250, 250), (350, 150), (150, 300), (420, 260))
    return replace(kiks.Arena.box(500, 400), cylinders=tuple(Cylinder(x, y, radius_mm=11.5) for x, y in places))


@kiks.controller(senses=("proximity", "barrier"), actuators=("wheels", "gripper"), parameters=2, memory=1)
def clutch(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Wander, and let arm and jaws follow what is seen and the time."""
    memory[0] += 1.0
    near = sensors[:6].sum()
    wheels[0] = 6.0 + parameters[0] * (sensors[1] - sensors[4]) / 100.0
    wheels[1] = 6.0 - parameters[0] * (sensors[1] - sensors[4]) / 100.0
    phase = (memory[0] + parameters[1]) % 40.0
    wheels[2] = 250.0 + near if phase < 20.0 else 60.0 + 3.0 * phase
    wheels[3] = 0.7 if phase > 10.0 and (sensors[8] > 100.0 or phase > 14.0) else 0.2


@kiks.controller(senses=(Horn.heard,), actuators=("wheels", Horn.pitch), memory=1)
def honk(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Answer what was heard."""
    memory[0] += 1.0
    wheels[0] = wheels[1] = sensors[0] % 9.0 - 4.0
    wheels[2] = -(sensors[0] + 7.0) * 3.0 if memory[0] % 3.0 > 0.0 else np.nan


@pytest.mark.parametrize(
    ("controllers", "period_s"),
    cases(product([[clutch, clutch], [honk, honk, honk], [clutch], [honk]], [0.0, 0.11]), 4),
)
def test_a_batch_does_what_the_wire_does(controllers: list[kiks.Controller], period_s: float) -> None:
    count = len(controllers)
    parameters = [[2.0, 13.0 * k] if each is clutch else [] for k, each in enumerate(controllers)]
    batch = kiks.Batch(arena(), worlds=3, seed=8, robots=count, timing=kiks.Timing(period_s, 9600))
    assert kiks.verify(batch, controllers, parameters, seconds=6.0, worlds=(0, 2)) == []


def test_a_gripper_takes_a_cylinder_away() -> None:
    batch = kiks.Batch(arena(), worlds=2, starts=(108, 150, 0.0), actuators=("wheels", "gripper"), senses="barrier")
    batch.reset()
    for outputs in ([0, 0, 255, 0], [0, 0, 1e9, 1], [0, 0, 127, 1]):
        for _ in range(8):
            batch.step(np.full((2, 1, 4), outputs))
    assert batch.state.bodies["holder"][:, 0].tolist() == [1, 1]
    assert batch.state.bodies["is_lifted"].sum() == 2


def test_step_by_step_is_the_same_as_at_once() -> None:
    stepped = kiks.Batch(arena(), 2, seed=3, senses=clutch.senses, actuators=clutch.actuators)
    outputs, memory, sensors = np.zeros((2, 1, 4)), np.zeros((2, 1)), stepped.reset()
    while stepped.times_s.max() < 2.95:
        for world in range(2):
            clutch(sensors[world, 0], memory[world], np.array([2.0, 0.0]), outputs[world, 0])
        before = [stepped.state_hash(world) for world in range(2)]
        sensors = stepped.step(outputs)
    alone = kiks.Batch(arena(), 2, seed=3)
    alone.run(clutch, [2.0, 0.0], seconds=2.95)
    assert before != [stepped.state_hash(world) for world in range(2)]
    np.testing.assert_array_equal(alone.times_s, stepped.times_s)


def test_outputs_are_rounded_and_cut_at_the_limits_of_the_table() -> None:
    for wanted, sent, expected in ((3.4, 0.0, 3.0), (-7.0, 0.0, 0.0), (300.0, 0.0, 255.0), (np.nan, 12.0, 12.0)):
        assert value_of(wanted, 0.0, 255.0, sent) == expected
    assert [(each.least, each.most) for each in ACTUATORS["gripper"]] == [(0, 255), (0, 1)]


def test_actuators_survive_pickles() -> None:
    found = pickle.loads(pickle.dumps(Horn.pitch))
    assert (found.command, found.turret, found.most) == ("T,25,S", Horn, 20_000)
    batch = pickle.loads(pickle.dumps(kiks.Batch(arena(), 1, actuators=clutch.actuators)))
    batch.reset()
    assert batch.step([[[0, 0, 200, 1]]]).shape == (1, 1, 8)
    assert batch.state.robots["arm_target"] == 200.0


def test_an_order_is_sent_when_its_number_changes() -> None:
    @kiks.controller(actuators=("wheels", "gripper"), memory=1)
    def twice(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        memory[0] += 1.0
        wheels[2], wheels[3] = 200.0 if memory[0] < 3.0 else 210.0, np.nan

    sim = kiks.Simulation(arena(), seed=1)
    sim.fit(1, "gripper")
    port: Any = sim.port(1)
    send, said = port.write, list[bytes]()

    def note_and_send(data: bytes) -> int:
        said.append(bytes(data))
        return int(send(data))

    port.write = note_and_send
    kiks.drive(port, twice, seconds=0.5)
    assert [each for each in said if each.startswith(b"T")] == [b"T,1,E,200\n", b"T,1,E,210\n"]


def test_mistakes_are_refused() -> None:
    refused("Did you mean 'gripper'", kiks.controller(actuators=("wheels", "griper")), clutch.function)
    for wrong in (("gripper",), 5):
        words = "actuators must name each once, the wheels first"
        refused(words, kiks.controller(actuators=wrong), clutch.function)
    refused("the wheels first", check_actuators, ("wheels", "wheels"))
    refused("command must be a line", kiks.actuator(command="", most=1), Horn.pitch.function)
    refused("least must", kiks.actuator(command="T,25,S", most=1, least=2), Horn.pitch.function)
    refused("takes 1 arguments", kiks.actuator(command="T,25,S", most=1), lambda value: None)
    pair = kiks.Batch(arena(), 1, robots=2)
    refused("must come first among", pair.run, [clutch, honk], [[0, 0], []], seconds=1)
    with pytest.raises(kiks.KiksError, match=r"T,1,G.*not supported") as caught:
        kiks.drive(kiks.Simulation(arena()).port(1), clutch, [0, 0], seconds=1)
    assert "\n" not in str(caught.value)
