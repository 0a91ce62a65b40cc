"""Responses: the robot in the arena answers what the networks, the table and the curve say for the same pose."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from tests.at_length import at_length
from tools.sensors import models
from tools.sensors.card import data_folder
from tools.sensors.train_networks import fan_of

import kiks
from kiks.engine.parameters import pack
from kiks.engine.sensing.responses import respond_all
from kiks.engine.sensing.thesis_networks import networks_for
from kiks.errors import ParameterError
from kiks.fit.samples import Samples, nearnesses
from kiks.model.materials import REFLECTANCES
from kiks.model.robot import RESPONSES, RobotSpec, save_robot
from kiks.model.thesis_networks import NetworkResponse

KHEPERA, KHEPERA_II = RobotSpec.load("khepera"), RobotSpec.load("khepera_ii")
BASELINE = KHEPERA.proximity.baseline_counts[0]
OF_THE_KHEPERA = [name for name in RESPONSES if name != "curve"]


def poses(radius_mm: float = math.inf) -> Samples:
    gaps_mm = np.arange(6.0, 44.0, 4.0)
    angles_deg = np.tile(np.arange(1.0, 360.0, 7.0), (len(gaps_mm), 1))
    return Samples("object", radius_mm, gaps_mm, angles_deg, np.zeros((*angles_deg.shape, 8), np.int64))


def before_wall(robot: RobotSpec, sensor: int, gap_mm: float, *, brightness: int | str = 255) -> float:
    """Return the expected count of a sensor that looks straight at a wall, a gap before the robot's rim."""
    sim = kiks.Simulation(kiks.Arena.box(800, 800, brightness=brightness), robot=robot)
    heading_rad = math.radians(-robot.proximity.direction_deg[sensor])
    sim.place(1, 790 - robot.body.radius_mm - max(gap_mm, 0.01), 400, heading_rad)
    return sim.proximity(1)[sensor]


def test_the_thesis_networks_answer_in_the_arena() -> None:
    wall = poses()
    answers, predicted = models.default(wall, "thesis"), models.thesis(wall)
    assert (predicted > 500).sum() > 100
    assert np.abs(answers - np.minimum(predicted + BASELINE, 1023)).max() < 1.0
    # A disc is a staircase in the raster, of a quarter of a millimetre.
    disc = poses(27.0)
    error = np.abs(models.default(disc, "thesis") - np.minimum(models.thesis(disc) + BASELINE, 1023))
    assert np.median(error[models.thesis(disc) > 50]) < 15
    assert error.max() < 120


def test_the_table_answers_in_the_arena() -> None:
    wall = poses()
    answers, predicted = models.default(wall, "fast"), models.fast(wall)
    # Rays whose length rounds the same way when they are half a cell longer or shorter.
    fifths = nearnesses(wall, fan_of(NetworkResponse.load())) * 5
    is_clear = (np.abs(fifths - np.floor(fifths) - 0.5) > 0.03).all(axis=-1)
    assert (is_clear & (predicted > 100)).sum() > 100
    assert answers[is_clear] == pytest.approx(np.minimum(predicted[is_clear] + BASELINE, 1023), abs=1e-3)


@pytest.mark.parametrize("response", OF_THE_KHEPERA)
def test_nothing_near_is_nothing_and_a_dark_wall_looks_farther(response: str) -> None:
    """Thesis 3.4: black reflects half of what white does."""
    for robot in (KHEPERA, KHEPERA_II) if response != "reflection" else (KHEPERA,):
        sim = kiks.Simulation(kiks.Arena.box(800, 800), robot=robot, response=response)
        assert sim.proximity(1) == list(robot.proximity.baseline_counts)
    robot = KHEPERA.with_changes(proximity__response=response)
    white, black = (before_wall(robot, 2, 20, brightness=brightness) for brightness in (255, 1))
    assert black < 0.7 * white


@pytest.mark.parametrize("response", RESPONSES)
def test_the_sensor_that_is_nearest_to_a_post_reads_most(response: str) -> None:
    kind = "khepera_ii" if response == "curve" else "khepera"
    sim = kiks.Simulation(kiks.Arena.box(600, 600), robot=RobotSpec.load(kind, response=response))
    sim.place(1, 300, 300, 0.0)
    post = sim.add_cylinder(100, 100, radius_mm=10)
    from_centre_mm = sim.spec.body.radius_mm + 16
    for sensor, angle_deg in enumerate((75, 45, 12, -12, -45, -75, -160, 160)):
        ahead, left = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
        sim.move_body(post, 300 + from_centre_mm * ahead, 300 + from_centre_mm * left)
        above = np.subtract(sim.proximity(1), sim.spec.proximity.baseline_counts)
        assert above.argmax() == sensor


def test_a_response_is_picked_in_python_or_in_a_file(tmp_path: Path) -> None:
    save_robot(KHEPERA.with_changes(proximity__response="thesis"), tmp_path / "mine.toml")
    given = [
        kiks.Simulation(response="thesis"),
        kiks.Simulation(robot=KHEPERA, response="thesis"),
        kiks.Simulation(robot=RobotSpec.load("khepera", response="thesis")),
        kiks.Simulation(robot=str(tmp_path / "mine.toml")),
    ]
    rows = []
    for sim in given:
        assert sim.spec.proximity.response == "thesis"
        sim.place(1, 60, 325, 3.0)
        rows.append(sim.proximity(1))
    assert max(rows[0]) > 100
    assert all(row == rows[0] for row in rows)


def test_an_unknown_response_is_named() -> None:
    names = "'reflection', 'thesis', 'fast' or 'curve'"
    with pytest.raises(ParameterError, match=rf"proximity.response must be {names}, but it was 'thesys'. Did you mean"):
        kiks.Simulation(response="thesys")
    with pytest.raises(ParameterError, match=r"'curve', which needs a section \[curve\]"):
        kiks.Simulation(response="curve")


def test_a_white_wall_reads_what_the_curve_says() -> None:
    """khepera-protocol.md 8.6, less what is left of it at the end of the range."""
    robot = KHEPERA_II.with_changes(
        curve__scale=1.0,
        proximity__gain=(1.0,) * 8,
        proximity__baseline_counts=(0.0,) * 8,
        proximity__mount_radius_mm=(35.0,) * 8,
    )
    # A sensor on the rim whose place and direction agree.
    robot = robot.with_changes(proximity__mount_angle_deg=robot.proximity.direction_deg)
    rest = 92 * (40 / 100) ** 2
    for distance_mm, counts in ((20, 357), (30, 167), (40, 92), (60, 92 * (40 / 60) ** 2)):
        assert before_wall(robot, 2, distance_mm) == pytest.approx(counts - rest, abs=8)
    assert before_wall(robot, 2, 12) > 700
    assert 0 < before_wall(robot, 2, 95) < 4


def test_materials_reflect_what_they_are_said_to() -> None:
    """khepera-protocol.md 8.6; black is as dark as a wall can be."""
    above = [before_wall(KHEPERA_II, 5, 20, brightness=name) - 74.0 for name in REFLECTANCES]
    shares = np.array(above) / above[0]
    assert shares == pytest.approx(list(REFLECTANCES.values()), abs=0.005)


def measured_means() -> np.ndarray:
    """Return the means of five logs of a Khepera II that backed off from a wall, shape [8, steps of 10 mm]."""
    file = data_folder() / "khepera2_distance_calibration.csv"
    sums: dict[tuple[int, int], list[int]] = {}
    with file.open(encoding="utf-8") as lines:
        for row in csv.DictReader(lines):
            sums.setdefault((int(row["sensor"]), int(row["step_index"])), []).append(int(row["reading"]))
    return np.array([[np.mean(sums[sensor, step]) for step in range(9)] for sensor in range(8)])


@at_length
def test_the_khepera_ii_reads_what_a_real_one_did() -> None:
    try:
        measured = measured_means()
    except ParameterError as error:
        pytest.skip(str(error))
    answers = np.array([[before_wall(KHEPERA_II, sensor, 10 * step) for step in range(9)] for sensor in range(8)])
    assert answers.mean(axis=0) == pytest.approx(measured.mean(axis=0), abs=8)
    # From 10 mm on each sensor by itself; at the wall the logs themselves differ by some hundreds.
    assert np.abs(answers - measured)[:, 1:].max() < 25
    assert np.abs(answers - measured)[:, 2:].max() < 10


def test_the_khepera_ii_reads_multiples_of_four_above_a_baseline() -> None:
    sim = kiks.Simulation(kiks.Arena.box(800, 800), robot="khepera_ii", seed=1)
    rows = []
    for _ in range(200):
        sim.run(0.02)
        rows.append(sim.proximity(1, noise=True))
    readings = np.array(rows)
    assert np.all(readings % 4 == 0)
    assert readings.mean(axis=0) == pytest.approx(KHEPERA_II.proximity.baseline_counts, abs=3)
    assert 40 < readings.mean(axis=0).min() < readings.mean(axis=0).max() < 156
    sim.place(1, 400, 790 - 35, math.pi / 2)
    assert max(sim.proximity(1, noise=True)) > 900


# Readings of KiKS 2.2.0 that students recorded (kiks-behaviour.md 3.1.1): a cross-check, as its robot was another.
# Seven inverted lengths [mm], the leftmost first, and the reading; several readings of one pattern are a mean.
PATTERNS = np.array(
    [
        (0, 41, 40, 0, 0, 0, 0, 454),
        (0, 0, 0, 0, 16, 0, 0, 5),
        (0, 0, 0, 0, 0, 39, 41, 324),
        (0, 0, 16, 0, 0, 0, 0, 81),
        (0, 0, 0, 48, 47, 47, 45, 836),
        (0, 0, 0, 0, 27, 0, 0, 11),
        (45, 47, 48, 0, 0, 0, 0, 801),
        (0, 0, 27, 0, 0, 0, 0, 192),
        (41, 0, 0, 0, 0, 0, 0, 51),
        (0, 0, 0, 0, 39, 34, 0, 204),
        (41, 40, 0, 0, 0, 0, 0, 282),
        (0, 34, 39, 0, 0, 0, 0, 422),
        (0, 0, 0, 39, 39, 0, 0, 459),
        (0, 0, 39, 39, 0, 0, 0, 455),
        (0, 0, 0, 0, 39, 39, 0, 211),
        (0, 0, 34, 39, 0, 0, 0, 372),
        (0, 29, 33, 0, 0, 0, 0, 307),
        (0, 0, 0, 0, 0, 39, 35, 276),
        (0, 0, 0, 0, 0, 31, 33, 161),
        (0, 33, 0, 0, 0, 0, 0, 20),
        (0, 0, 0, 0, 0, 35, 0, 10),
        (0, 0, 0, 0, 0, 0, 34, 43),
        (29, 0, 0, 0, 0, 0, 0, 6),
        (0, 0, 0, 10, 0, 0, 0, 28),
        (0, 0, 10, 0, 0, 0, 0, 63),
    ],
    np.float64,
)
INVERTED_MM = np.repeat(PATTERNS[:, None, :7], 8, axis=1)


@pytest.mark.parametrize("response", ["thesis", "reflection"])
def test_what_was_large_in_kiks_2_2_0_is_large_here(response: str) -> None:
    """Each ray is taken to meet its surface squarely, as the patterns do not tell."""
    robot, counts = RobotSpec.load("khepera", response=response), np.empty((len(PATTERNS), 8))
    cosines = np.where(INVERTED_MM > 0.0, 1.0, 0.0)
    respond_all(networks_for(response), pack(robot), 50.0 - INVERTED_MM, cosines, counts)
    means = counts.mean(axis=1)
    assert np.corrcoef(means, PATTERNS[:, 7])[0, 1] >= 0.8
    assert means[PATTERNS[:, 7] > 800].min() > 0.9 * models.MAXIMUM_COUNTS
