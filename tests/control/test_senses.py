"""Senses: what a batch reads is what a command reads on the wire, to the bit and in time."""

import itertools
import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.at_length import cases
from tests.learn.small import refused

import kiks
from kiks.batch.loop_timing import answer_length
from kiks.control.senses import SENSES, AnySense, check_senses, recipes_for, sense_of
from kiks.engine.compiling import callable_kernel
from kiks.firmware.khepera.firmware import KheperaFirmware
from kiks.firmware.khepera.kind import KHEPERA
from kiks.firmware.turret import Turret
from kiks.model.arena import Cylinder, Lamp, Zone
from kiks.model.robot_kinds import ROBOT_KINDS


class Compass(Turret):
    """A turret of a user's own, whose sense is that of its order."""

    number, name, memory_count = 24, "Compass", 1

    @kiks.sense(command="T,24,C", least=-360, most=360)
    def heading(view: Any, readings: Any) -> None:  # noqa: N805
        readings[0] = np.floor(math.degrees(view.heading_rad) - view.memory[0]) % 361.0 - 180.0

    def fit(self, site: Any) -> None:
        super().fit(site)
        site.memory[0] = 37.5

    def read(self) -> tuple[int, ...]:
        """C: the heading."""
        return (int(np.floor(math.degrees(self.site.pose()[2]) - self.site.memory[0]) % 361.0 - 180.0),)

    orders = {"C": (0, read)}  # noqa: RUF012


def arena() -> kiks.Arena:
    walls = np.zeros((400, 500), np.uint8)
    walls[150:160, 150:400] = 255
    things = {"cylinders": (Cylinder(300, 300),), "lamps": (Lamp(100, 300),)}
    zones = tuple(Zone(disc_mm=(60 * k, 320), radius_mm=25, brightness=30 * k) for k in range(9))
    return replace(kiks.Arena.from_array(walls), zones=zones, **things)


def wander(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    """Use all readings, as far as they fit into small speeds."""
    memory[0] += 1.0
    left = right = 0.0
    for k in range(sensors.shape[0]):
        left += parameters[k] * (sensors[k] % 32.0)
        right -= parameters[-1 - k] * (sensors[k] % 17.0)
    wheels[0], wheels[1] = 12.0 + left, 12.0 + right if memory[0] % 20.0 < 12.0 else -8.0 + right


TOGETHER: list[tuple[AnySense, ...]] = [
    ("proximity", "positions", Compass.heading, "camera", "floor"),
    ("speeds", "barrier", "ambient", "proximity", "positions"),
]


class FeelingFirmware(KheperaFirmware):
    """A Khepera that also answers the commands of a body's senses."""

    def execute(self, line: bytes, now_ns: int) -> bytes:
        self.now_ns = now_ns
        if (name := {"M": "ground", "A": "accelerometer", "U": "microphones"}.get(line.decode("latin-1"))) is None:
            return super().execute(line, now_ns)
        return b"%s,%s\r\n" % (line.lower(), ",".join(map(str, self.sense(name))).encode())


FEELING = replace(
    KHEPERA,
    firmware=FeelingFirmware,
    senses={**KHEPERA.senses, "ground": "M", "accelerometer": "A", "microphones": "U"},
)


@pytest.fixture
def feeling(monkeypatch: pytest.MonkeyPatch) -> kiks.RobotSpec:
    """Return a robot that has them."""
    monkeypatch.setitem(ROBOT_KINDS, "feeling", f"{__name__}:FEELING")
    spec = kiks.RobotSpec.load("khepera").with_changes(body__slip_ratio_max=0.14)  # another object than other Kheperas
    object.__setattr__(spec, "kind", "feeling")
    return spec


ALONE: list[tuple[AnySense, ...]] = [(Compass.heading,), ("positions",), ("speeds",), ("barrier",), ("floor",)]


@pytest.mark.parametrize("senses", cases(((each,) for each in [*TOGETHER, *ALONE]), 3))
def test_a_batch_reads_what_the_wire_reads(senses: tuple[AnySense, ...]) -> None:
    controller = kiks.controller(senses=senses, memory=1)(wander)
    parameters = np.random.default_rng(3).normal(0.0, 0.1, (2, controller.sensor_count))
    for period_s in (0.0, 0.13):
        batch = kiks.Batch(arena(), worlds=2, seed=4, timing=kiks.Timing(period_s, 9600))
        assert kiks.verify(batch, controller, parameters, seconds=4.0) == []


@pytest.mark.parametrize("senses", [("ground", "accelerometer", "microphones"), ("microphones", "proximity", "ground")])
def test_a_batch_feels_what_the_wire_feels(feeling: kiks.RobotSpec, senses: tuple[str, ...]) -> None:
    controller = kiks.controller(senses=senses, memory=1)(wander)
    parameters = np.random.default_rng(3).normal(0.0, 0.1, (2, controller.sensor_count))
    for period_s in (0.0, 0.13):
        given: dict[str, Any] = {"robot": feeling, "robots": 2, "timing": kiks.Timing(period_s, 38400)}
        batch = kiks.Batch(arena(), worlds=2, seed=4, **given)
        assert kiks.verify(batch, controller, np.stack([parameters] * 2, axis=1), seconds=3.0) == []
    batch = kiks.Batch(arena(), 5, robot=feeling, senses=senses, seed=2)
    found = np.array([batch.reset(), *(batch.step(np.full((5, 1, 2), 20.0 - 9.0 * (k % 5))) for k in range(30))])
    first = 0
    for each in map(sense_of, senses):
        part = found[..., first : first + each.size]
        assert part.min() >= each.least
        assert part.max() <= each.most
        assert len(np.unique(part)) > 3
        first += each.size


def test_a_sense_that_a_kind_of_robot_lacks_is_refused() -> None:
    rule = (
        r"senses must be some of those of this kind of robot \(proximity, ambient, camera, positions, speeds, barrier, "
        r"floor\), but 'ground' was among them. Leave it out, or take a robot that has it."
    )
    controller = kiks.controller(senses=("proximity", "ground"))(lambda sensors, memory, parameters, wheels: None)
    sim = kiks.Simulation(arena(), seed=1)
    batch = kiks.Batch(arena(), 1)
    refused(rule, SENSES["ground"].command_for, KHEPERA)
    refused(rule, kiks.Batch, arena(), 1, senses=("proximity", "ground"))
    refused(rule, batch.run, controller, seconds=1)
    refused(rule, kiks.drive, sim.port(1), controller, seconds=1)
    refused(rule, kiks.verify, batch, controller, seconds=1)
    assert sim.time_s == 0.0


def test_packets_are_the_function_of_the_sense() -> None:
    alone: Any = kiks.Sense.__new__(kiks.Sense)
    vars(alone).update(vars(SENSES["proximity"]))
    hashes = []
    for each in ("proximity", alone):
        batch = kiks.Batch(arena(), worlds=11, seed=4)
        batch.run(kiks.controller(senses=each, memory=1)(wander), [0.05] * 8, seconds=3.0)
        hashes.append([batch.state_hash(world) for world in range(11)])
    assert hashes[0] == hashes[1]


def test_every_digit_and_sign_takes_time() -> None:
    length_of = callable_kernel(answer_length.py_func)
    ends = [sign * (10**power + less) for power in range(1, 10) for less in (-1, 0) for sign in (1, -1)]
    for count in (1, 2):
        for numbers in itertools.islice(itertools.permutations([0, *ends], count), 200):
            expected = 3 + sum(1 + len(str(number)) for number in numbers)
            assert length_of(3, np.array(numbers, np.float64)) == expected


@pytest.mark.parametrize("name", KHEPERA.senses)
def test_readings_lie_within_the_limits_of_the_table(name: str) -> None:
    batch = kiks.Batch(arena(), worlds=5, senses=name, seed=1)
    sense, readings = sense_of(name), [batch.reset()]
    for _ in range(5):
        readings.append(batch.step(np.full((5, 1, 2), -20.0)))
    found = np.array(readings)
    assert found.shape[-1] == sense.size
    assert found.min() >= sense.least
    assert found.max() <= sense.most
    np.testing.assert_array_equal(found, np.rint(found))


def test_a_barrier_notices_what_is_between_the_jaws() -> None:
    batch = kiks.Batch(arena(), worlds=2, senses="barrier", starts=[[[245, 300, 0.0]], [[60, 300, 0.0]]])
    batch.reset()
    for _ in range(2):
        readings = batch.step(np.zeros((2, 1, 2)))
    assert (readings == 0).all()  # the arm is up
    batch.state.robots["arm_target"] = 255.0
    for _ in range(8):
        readings = batch.step(np.zeros((2, 1, 2)))
    assert readings[:, 0, 0].tolist() == [255, 0]


def test_senses_survive_pickles_and_recipes() -> None:
    found = pickle.loads(pickle.dumps(Compass.heading))
    assert (found.command, found.turret, found.size) == ("T,24,C", Compass, 1)
    assert check_senses(recipes_for(("speeds", Compass.heading))) == ("speeds", Compass.heading)
    controller = kiks.controllers.mlp(senses=("proximity", Compass.heading))
    assert kiks.controllers.from_recipe(controller.recipe) is controller
    batch = pickle.loads(pickle.dumps(kiks.Batch(arena(), 1, senses=("speeds", Compass.heading))))
    assert batch.reset().shape == (1, 1, 3)


@kiks.sense(command="E", most=1)
def leave(view: Any, readings: Any) -> None:
    """Write beyond the readings."""
    readings[1] = 0.0


def test_mistakes_are_refused() -> None:
    def made(**options: Any) -> kiks.Sense:
        return kiks.sense(**{"command": "E", "most": 1} | options)(leave.function)

    refused("command must be a line such as 'E'", made, command="E\n")
    refused("readings must be", made, readings=0)
    refused("full must differ from zero, but both were 0", made, most=0)
    refused("One of your own is made by @kiks.sense", kiks.controller(senses=("smell",)), wander)
    batch = kiks.Batch(arena(), 1, senses=[leave])
    refused(r"'leave' must stay within its arrays, but line \d+", batch.reset)
