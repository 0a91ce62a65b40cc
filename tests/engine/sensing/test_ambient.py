"""Ambient light: the published curves, what hides a lamp, how lamps add up, and the shape of measured light."""

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.engine.same_walls import wide_floor
from tests.symmetry import mirrored, symmetric

import kiks
from kiks.model.arena import Lamp
from kiks.model.robot import RobotSpec

SPEC = RobotSpec.load("khepera")
SHARED = Path(os.environ.get("KIKS_SHARED") or Path(__file__).parents[4] / "shared")

# khepera-protocol.md 9.1: readings of a lamp of 1 W from 10, 20, ... 220 mm.
PUBLISHED = (61, 66, 75, 72, 75, 87, 162, 179, 272, 280, 321, 329, 347, 370, 382, 396, 399, 419, 419, 425, 434, 439)

# khepera-protocol.md 9.2: angle of the lamp, left positive here, and the reading; it is 497 in the dark.
LEFT_85 = {180: 493, 160: 484, 150: 459, 140: 417, 130: 380, 120: 336, 110: 274, 100: 249, 90: 240, 80: 189, 70: 201}
LEFT_85 |= {60: 211, 50: 289, 40: 392, 30: 470, 20: 490, 0: 496}
RIGHT_10 = {80: 496, 60: 476, 50: 444, 40: 404, 30: 342, 20: 283, 10: 262, 0: 225, -10: 185, -20: 170, -30: 243}
RIGHT_10 |= {-40: 345, -50: 407, -60: 453, -70: 487, -80: 497}


def dark_room(*lamps: tuple[Any, ...], robot: RobotSpec = SPEC, seed: int = 0) -> kiks.Simulation:
    """A robot in the middle of a large box that looks to the right."""
    sim = kiks.Simulation(wide_floor(1400), robot=robot, seed=seed)
    for lamp in lamps:
        x_mm, y_mm, power_w, is_on = (*lamp, 1.0, True)[:4] if len(lamp) == 2 else (*lamp, True)[:4]
        sim.add_lamp(x_mm, y_mm, power_w, is_on=is_on)
    sim.place(1, 700, 700, 0.0)
    return sim


def beside(sensor: int, distance_mm: float, off_axis_deg: float = 0.0, power_w: float = 1.0) -> tuple[float, ...]:
    """A lamp at a distance from a sensor of that robot, at an angle off its axis (left positive)."""
    mount = math.radians(SPEC.proximity.mount_angle_deg[sensor])
    radius = SPEC.proximity.mount_radius_mm[sensor]
    axis = math.radians(SPEC.ambient.direction_deg[sensor] + off_axis_deg)
    x = 700 + radius * math.cos(mount) + distance_mm * math.cos(axis)
    return (x, 700 + radius * math.sin(mount) + distance_mm * math.sin(axis), power_w)


def readings(sensor: int, *lamps: tuple[float, ...], robot: RobotSpec = SPEC) -> np.ndarray:
    """Return what a sensor reads of a lamp that is at one place after the other, each of `beside`'s arguments."""
    sim, found = dark_room((0.0, 0.0), robot=robot), []
    for lamp in lamps:
        sim.lamps[0, :3] = beside(sensor, *lamp)
        found.append(sim.ambient(1)[sensor])
    return np.array(found)


def test_the_published_curve_is_reproduced() -> None:
    for sensor in (0, 3, 6):
        found = readings(sensor, *((10.0 * (i + 1),) for i in range(len(PUBLISHED))))
        # 75 and 72 are averaged: more light never reads darker.
        assert found == pytest.approx(PUBLISHED, abs=1.5 + 1e-6)


def test_nearer_and_stronger_is_brighter() -> None:
    nearer = readings(2, *((distance,) for distance in np.linspace(0.01, 600, 121)))
    assert np.all(np.diff(nearer) >= 0)
    assert nearer[0] == pytest.approx(50, abs=0.1)
    assert 445 < nearer[-1] < 450
    stronger = readings(2, *((150, 0.0, power) for power in np.geomspace(0.01, 1000, 60)))
    assert np.all(np.diff(stronger) <= 0)
    assert stronger[-1] < 60
    # Four times the power at twice the distance is the same light.
    assert readings(2, (200, 0.0, 4.0))[0] == pytest.approx(PUBLISHED[9])


def test_the_angle_curves_are_those_of_the_manual() -> None:
    """khepera-protocol.md 9.2; the lamp's distance is not told, 79 mm fits; the dark value was 497, not 450."""
    dark = SPEC.with_changes(
        ambient__lamp_counts=tuple(50 + (count - 50) * 447 / 400 for count in SPEC.ambient.lamp_counts),
        ambient__dark_counts=497.0,
        ambient__background_counts=497.0,
    )
    errors = {}
    for model in ("flux", "thesis"):
        robot, found = dark.with_changes(ambient__model=model), []
        for sensor, curve, peak in ((0, LEFT_85, 82.5), (3, RIGHT_10, -8.3)):
            lamps = ((79, angle - peak) for angle in curve)
            found.append(readings(sensor, *lamps, robot=robot) - list(curve.values()))
        errors[model] = np.abs(np.concatenate(found))
    assert errors["flux"].mean() < 22
    assert errors["flux"].max() < 60
    assert errors["thesis"].mean() > 45


def test_half_of_the_light_comes_from_within_50_degrees() -> None:
    """khepera-protocol.md 9.2: the half width is about 50 degrees; from 90 on there is nothing."""
    angles = np.arange(-120, 121, 5)
    for sensor in range(8):
        light = 450 - readings(sensor, *((90, float(angle)) for angle in angles))
        bright = angles[light > light.max() / 2]
        assert [bright.min(), bright.max()] == pytest.approx([-45, 45], abs=10)
        assert np.all(light[np.abs(angles) >= 90] == 0)


def lit_by(ground: Any, lamp_mm: float, y_mm: float, at_mm: tuple[float, float]) -> kiks.Simulation:
    """A robot that looks to the right, in an arena with a lamp."""
    sim = kiks.Simulation(replace(kiks.Arena.from_array(ground), lamps=(Lamp(lamp_mm, y_mm),)))
    sim.place(1, *at_mm, 0.0)
    return sim


def test_a_wall_hides_a_lamp() -> None:
    lit = dark_room((850, 700)).ambient(1)
    assert lit[2] < 410
    ground = np.zeros((1400, 1400), np.uint8)
    ground[690:710, 780:785] = 100  # a thin screen before the robot
    sim = lit_by(ground, 850, 700, (700, 700))
    assert sim.ambient(1) == [450.0] * 8
    sim.place(1, 700, 750, 0.0)  # now it looks past it
    assert sim.ambient(1)[3] < 440


def test_a_lamp_may_hang_over_a_wall() -> None:
    ground = np.zeros((400, 400), np.uint8)
    ground[:, 300:] = 255
    for x_mm in (300.5, 310.0, 399.0):
        assert lit_by(ground, x_mm, 200, (200, 200)).ambient(1)[2] < 450
    ground[:, 320:330] = 0  # between two walls
    assert lit_by(ground, 350, 200, (200, 200)).ambient(1)[2] == 450


def test_the_own_body_hides_a_lamp() -> None:
    """A sensor at the back right looks straight back; a lamp at the left is before its axis, but behind the body."""
    axis_deg = 100.0  # from ahead: 80 off the axis of sensor 6, 103 off the way out of the body
    assert dark_room(beside(6, 60, axis_deg - 180)).ambient(1)[6] == 450
    assert dark_room(beside(7, 60, axis_deg - 180)).ambient(1)[7] < 450


def test_two_lamps_are_brighter_than_one() -> None:
    one = dark_room(beside(2, 100)).ambient(1)
    two = dark_room(beside(2, 100), beside(2, 100, 1.0)).ambient(1)
    assert two[2] < one[2] - 20
    assert all(more <= less for more, less in zip(two, one, strict=True))
    # Two at the same place are one of twice the power.
    same, twice = dark_room(beside(2, 100), beside(2, 100)), dark_room(beside(2, 100, 0.0, 2.0))
    assert same.ambient(1) == pytest.approx(twice.ambient(1))


def test_lamps_are_switched_moved_and_removed() -> None:
    sim = dark_room((*beside(2, 60), False), beside(0, 60))
    assert sim.ambient(1)[2] == 450
    assert sim.ambient(1)[0] < 100
    sim.lamps[0, 3], sim.lamps[1, 3] = 1, 0
    assert sim.ambient(1)[2] < 100
    assert sim.ambient(1)[0] == 450
    sim.lamps[0, :2] = 100, 100
    assert sim.ambient(1)[2] == 450
    sim.lamps[1, 3] = 1
    assert sim.ambient(1)[0] < 100
    sim.remove_lamp(2)
    assert sim.ambient(1)[0] == 450
    for nonsense in (math.nan, math.inf, -1e300, 1e12):
        sim.lamps[0] = nonsense
        assert all(50 <= reading <= 450 for reading in sim.ambient(1))
    sim.lamps[0] = (700, 700, 1e300, 1)  # inside the robot
    assert all(50 <= reading <= 450 for reading in sim.ambient(1))


def test_left_and_right_are_mirror_images() -> None:
    rng, sim = np.random.default_rng(5), dark_room((0.0, 0.0), robot=symmetric(SPEC))
    for _ in range(40):
        x, y = rng.uniform(560, 840), rng.uniform(560, 840)
        sim.lamps[0, :2] = x, y
        left = sim.ambient(1)
        sim.lamps[0, :2] = x, 1400 - y
        assert left == pytest.approx(mirrored(sim.ambient(1)), abs=1e-6)


def test_daylight_adds_to_the_lamps() -> None:
    for counts in (300.0, 445.0):
        room = SPEC.with_changes(ambient__background_counts=counts)
        assert dark_room(robot=room).ambient(1) == pytest.approx([counts] * 8)
        assert dark_room(beside(2, 100), robot=room).ambient(1)[2] < 280


def test_the_formula_of_the_thesis() -> None:
    """Section 3.3: R = R0 + (1 - cos a)(500 - R0) and the lowest lamp wins."""
    thesis = SPEC.with_changes(ambient__model="thesis")
    for angle in (-80.0, -30.0, 0.0, 17.0, 60.0):
        on_axis = PUBLISHED[9]
        expected = on_axis + (1 - math.cos(math.radians(angle))) * (500 - on_axis)
        lamps = (beside(2, 100, angle), beside(2, 200, angle), beside(2, 200, angle, 4.0))
        assert dark_room(*lamps, robot=thesis).ambient(1)[2] == pytest.approx(expected, abs=1e-6)
    assert dark_room(beside(2, 100, 95), robot=thesis).ambient(1)[2] == 500
    assert dark_room(robot=thesis).ambient(1) == [500.0] * 8


def test_noise_is_that_of_the_dark_value_and_comes_with_the_round() -> None:
    sim = dark_room(beside(2, 100), seed=4)
    expected = np.array(sim.ambient(1))
    rows = []
    for _ in range(2000):
        rows.append(sim.ambient(1, noise=True))
        sim.run(0.02)
    noise = np.array(rows) - expected
    assert np.abs(noise).max() <= SPEC.ambient.noise_counts + 0.5
    assert np.all(np.abs(noise.mean(axis=0)) < 0.6)
    assert noise.std(axis=0) == pytest.approx([SPEC.ambient.noise_counts / math.sqrt(3)] * 8, rel=0.1)


def test_the_robot_reports_what_its_sensors_see() -> None:
    sim = kiks.Simulation(replace(kiks.Arena.box(500, 500), lamps=(Lamp(300, 250, 2.0),)), robot="khepera_ii", seed=3)
    sim.place(1, 200, 250, 0.0)
    readings = kiks.Khepera(sim.port(1)).ambient()
    assert all(reading % 4 == 0 for reading in readings)
    assert readings == pytest.approx(sim.ambient(1), abs=12)
    assert max(readings[2:4]) < 250
    assert min(readings[6:]) > 480


@pytest.mark.skipif(not (SHARED / "data/khepera-samples/light.npz").exists(), reason="needs the shared sensor data")
def test_the_shape_of_measured_light() -> None:
    """light.npz is brightness of unknown scale from a bulb of unknown power: its shape counts, not its level.

    So brightness = a + b (dark - reading), with a, b, the power and the rig's turn fitted. The thesis's angle law and
    rule, fitted as freely, errs more. Sensors are where infra-red says, a millimetre farther out than in the manual:
    with the manual's places the error would be 29.6, with the directions that infra-red says, too, 31.8.
    """
    data = np.load(SHARED / "data/khepera-samples/light.npz")
    rows, columns = range(0, 26, 2), range(0, 180, 6)
    measured = data["values"][np.ix_(rows, columns)].astype(float)

    def error(robot: RobotSpec, power_w: float, turn_deg: float) -> float:
        sim = dark_room((0.0, 0.0, power_w), robot=robot)
        light = np.empty(measured.shape)
        for i, row in enumerate(rows):
            for j, column in enumerate(columns):
                angle = math.radians(-float(data["object_angle_deg_cw"][column]) - turn_deg)
                away = 27.5 + float(data["gap_mm"][row])
                sim.lamps[0, :2] = 700 + away * math.cos(angle), 700 + away * math.sin(angle)
                light[i, j] = sim.ambient(1)
        slope, level = np.polyfit(light.ravel(), measured.ravel(), 1)
        assert slope < 0
        return float(np.mean(np.abs(slope * light + level - measured)))

    ours = min(error(SPEC, power, 4.0) for power in (2.7, 3.5, 4.5))
    thesis = min(error(SPEC.with_changes(ambient__model="thesis"), power, 4.0) for power in (1.0, 1.4, 2.0))
    assert ours < 31  # of about 870 between dark and bright
    assert ours < 0.9 * thesis
