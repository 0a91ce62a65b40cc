"""The proximity sensors: sampled in turn, symmetric, nearer is more, darker is less."""

import math

import numpy as np
import pytest
from tests.model.refusals import refused

import kiks
from kiks.model.robot import RobotSpec

QUIET = RobotSpec.load("khepera").with_changes(
    proximity__noise_small=0.0,
    proximity__noise_large=0.0,
    proximity__baseline_counts=(0.0,) * 8,
    proximity__jitter_counts=(0.0,),
    ambient__noise_counts=0.0,
)


@pytest.mark.parametrize("sense", ["proximity", "ambient"])
def test_each_sensor_is_sampled_every_20_ms_in_turn(sense: str) -> None:
    """A robot that turns: sensor i changes at 20 k + 2.5 i ms and at no other time."""
    sim = kiks.Simulation(kiks.Arena.box(150, 150, rounded_mm=45), robot=QUIET)
    read = getattr(sim, sense)
    sim.add_lamp(140, 75)
    sim.place(1, 60, 75, 0.0)
    kiks.Khepera(sim.port(1)).set_speed(20, -20)
    sim.run(1.0 - sim.time_s)
    before = read(1, noise=True)
    changed_ms: dict[int, list[float]] = {}
    for k in range(1, 400):
        sim.run(1.0 + k * 0.0005 - sim.time_s)
        now = read(1, noise=True)
        for sensor in range(8):
            if now[sensor] != before[sensor]:
                changed_ms.setdefault(sensor, []).append(k * 0.5)
        before = now
    assert len(changed_ms) >= 4
    for sensor, times in changed_ms.items():
        assert all(time % 20 == pytest.approx(2.5 * sensor) for time in times)


def test_readings_are_latched_while_they_travel() -> None:
    """The reply to N tells of the instant at which the command acted, not of the one at which it is read."""
    sim = kiks.Simulation(kiks.Arena.box(600, 600), robot=QUIET)
    sim.place(1, 300, 590 - QUIET.body.radius_mm - 20, math.pi / 2)
    port = sim.port(1)
    port.write(b"N\n")
    sim.run(0.005)
    sim.place(1, 300, 300, 0.0)
    readings = [int(word) for word in port.readline().split(b",")[1:]]
    assert max(readings) > 0


@pytest.mark.slow
@pytest.mark.parametrize("response", ["reflection", "fast"])
def test_readings_from_many_poses_are_those_of_a_robot_that_is_put_there(response: str) -> None:
    sim = kiks.Simulation(kiks.Arena.box(400, 400, wall_mm=0), robots=3, seed=3, response=response)
    sim.place(1, 340.0, 60.0, 0.0)
    sim.place(2, 200.0, 200.0, 0.0)
    sim.place(3, 60.0, 340.0, 1.0)
    sim.port(2).write(b"D,9,9\n")
    sim.run(0.5)
    turns = [*np.linspace(-9.0, 9.0, 13).tolist(), 1e20]
    poses = [[x, y, turn] for x, y in ((28.5, 100.0), (174.0, 203.0), (100.0, 100.0), (60.0, 275.0)) for turn in turns]
    before = sim.state_hash()
    readings = sim.proximity_at(1, np.array(poses))
    assert sim.state_hash() == before
    for pose, expected in zip(poses, readings.tolist(), strict=True):
        sim.place(1, *pose)
        assert sim.proximity(1) == expected
    assert [(reading > 100).any() for reading in np.split(readings, 4)] == [True, True, False, True]


def test_poses_that_cannot_be_are_refused() -> None:
    sim = kiks.Simulation(kiks.Arena.box(600, 600))
    for pose, words in (
        ([1.0, 2.0], "poses must be finite numbers"),
        ([math.nan, 2.0, 0.0], "poses must be finite numbers"),
        ([1e9, 2.0, 0.0], "poses must be in the arena, 600 x 600 mm"),
    ):
        refused(words, sim.proximity_at, 1, np.array([pose]))
