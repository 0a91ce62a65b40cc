"""Noise on proximity readings: with nothing near as a real Khepera has it, else as the thesis says, or otherwise."""

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import kiks
from kiks.model.robot import RobotSpec

KHEPERA = RobotSpec.load("khepera")


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
