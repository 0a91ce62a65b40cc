"""The proximity sensors: sampled in turn, and noisy as a real Khepera, as the thesis says, or otherwise."""

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.model.refusals import refused

import kiks
from kiks.model.robot import RobotSpec

KHEPERA = RobotSpec.load("khepera")
QUIET = KHEPERA.without_noise().with_changes(proximity__baseline_counts=(0.0,) * 8)


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
    sim = before_wall(QUIET, 20)
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


def documented(number: int) -> RobotSpec:
    """Return the Khepera with the noise that docs/explanation/sensors.md gives as an example."""
    guide = (Path(__file__).parents[3] / "docs" / "explanation" / "sensors.md").read_text(encoding="utf-8")
    values = tomllib.loads(re.findall(r"```toml\n(.*?)```", guide, re.DOTALL)[number])["proximity"]
    changes = {f"proximity__{key}": tuple(v) if isinstance(v, list) else v for key, v in values.items()}
    return KHEPERA.with_changes(**changes)


SILENT, KIKS2 = documented(0), documented(1)
"""The noise of the thesis (3.3), and that of KiKS 2.2.0 (kiks-behaviour.md 3.1, steps 7 and 8)."""


def before_wall(robot: RobotSpec, gap_mm: float | None) -> kiks.Simulation:
    """Return a robot in the open, or one that looks straight at a wall."""
    sim = kiks.Simulation(kiks.Arena.box(600, 600), robot=robot, seed=2)
    if gap_mm is not None:
        sim.place(1, 300, 590 - robot.body.radius_mm - gap_mm, math.pi / 2)
    return sim


def rounds(robot: RobotSpec, count: int, gap_mm: float | None = None) -> np.ndarray:
    """Return readings of a robot that stands still, shape [count, 8]."""
    sim, rows = before_wall(robot, gap_mm), []
    for _ in range(count):
        sim.run(0.02)
        rows.append(sim.proximity(1, noise=True))
    return np.array(rows)


def expected(robot: RobotSpec, gap_mm: float) -> np.ndarray:
    return np.array(before_wall(robot, gap_mm).proximity(1))


def test_idle_readings_are_those_of_a_real_khepera() -> None:
    """README of the Khepera samples: 48 % exact zeros, else 1..16, most often 4 to 7; mean 2.8, sd 3.3."""
    idle = rounds(KHEPERA, 3000)
    assert np.mean(idle == 0) == pytest.approx(0.48, abs=0.02)
    assert idle.mean() == pytest.approx(2.8, abs=0.1)
    assert idle.std() == pytest.approx(3.3, abs=0.15)
    assert 10 <= idle.max() <= 16
    shares = np.bincount(idle[idle > 0].astype(int), minlength=17)
    assert shares[4:8].sum() > 0.5 * shares.sum()
    assert idle.mean(axis=0) == pytest.approx([2.8] * 8, abs=0.3)


def test_noise_is_small_seldom_large_and_without_bias() -> None:
    """Thesis 3.3, "Proximity sensor noise model"."""
    relative = rounds(SILENT, 4000, 25)[:, 2:4] / expected(SILENT, 25)[2:4] - 1
    counts = expected(SILENT, 25)[2:4]
    bound = 0.25 - counts / 1000 * 0.15
    assert np.all(np.abs(relative) <= bound + 1 / counts)
    assert np.median(np.abs(relative)) < 0.2 * bound.max()
    assert np.abs(relative).max() > 0.8 * bound.min()
    assert np.abs(relative.mean()) < 0.004


@pytest.mark.slow
def test_mid_range_noise_stays_at_what_was_measured() -> None:
    """README of the Khepera samples: 26 counts within one reading are an upper bound."""
    gaps_mm = [gap for gap in range(10, 35) if 200 <= expected(KHEPERA, gap)[2] <= 800]
    squares = [rounds(KHEPERA, 400, gap)[:, 2].var() for gap in gaps_mm]
    assert 15 < math.sqrt(np.mean(squares)) <= 27
    squares = [rounds(KIKS2, 400, gap)[:, 2].var() for gap in gaps_mm]
    assert math.sqrt(np.mean(squares)) > 27


def test_the_noise_of_kiks_2_2_0_is_data() -> None:
    idle = rounds(KIKS2, 2000)
    assert (idle.min(), idle.max()) == (0, 10)
    assert idle.mean() == pytest.approx(5.1, abs=0.1)
    assert idle.std() == pytest.approx(10.2 / math.sqrt(12), abs=0.1)
    quiet = KIKS2.with_changes(proximity__jitter_counts=(0.0,))
    relative = rounds(quiet, 4000, 25)[:, 2] / expected(quiet, 25)[2] - 1
    assert -relative.min() == pytest.approx(0.9 * relative.max(), abs=0.01)
