"""Constants and robot definition files of KiKS 2.2.0 change robots as they did there."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kiks.model.arena import Arena, Lamp, Pose
from kiks.model.project import Project
from kiks.model.robot import RobotSpec
from kiks.sim.from_project import simulation_of
from kiks.sim.simulation import Simulation
from kiks.toolbox.old_constants import OldConstants
from kiks.toolbox.preferences import Settings

KHEPERA = RobotSpec.load("khepera")
PLACES, DIRECTIONS = KHEPERA.proximity.mount_angle_deg, KHEPERA.proximity.direction_deg
ROOM = Arena.box(400, 400, wall_mm=10)


def figures(
    diameter_mm: float = 55.0, range_mm: float = 50.0, places: Any = PLACES, directions: Any = DIRECTIONS
) -> Any:
    return (diameter_mm, 53.0, range_mm, *places, *directions)


def world(arena: Arena = ROOM, **constants: Any) -> Simulation:
    """Return a world whose robots have these constants, through the text of its project."""
    project = Settings(turrets=("k213",), thinking="none", **constants).project_of(arena)
    return simulation_of(Project.from_bytes(project.to_bytes()))


def at(x_mm: float, y_mm: float, heading_deg: float, **parts: Any) -> Arena:
    return replace(ROOM, starts=(Pose(x_mm, y_mm, math.radians(heading_deg)),), **parts)


def replies(sim: Simulation, command: bytes, count: int, pause_s: float) -> Any:
    """Return the numbers of noisy replies, int64 [reply, number]."""
    port = sim.port(1)
    rows = []
    for _ in range(count):
        sim.run(pause_s)
        port.write(command)
        rows.append([int(word) for word in port.readline().split(b",")[1:] if word.strip().isdigit()])
    return np.array(rows)


def counts(sim: Simulation) -> Any:
    """Return noisy readings, each of another round of the sensors, int64 [reading, 8]."""
    return replies(sim, b"N\n", 200, 0.02)


def test_a_file_that_describes_the_khepera_makes_a_khepera() -> None:
    spec = world(figures=figures()).specs[0]
    assert spec == KHEPERA.with_changes(ambient__direction_deg=DIRECTIONS)


@pytest.mark.parametrize("turn_deg", [30, 180, -90])
def test_turned_sensors_read_what_sensors_of_a_turned_robot_read(turn_deg: int) -> None:
    turned = figures(places=tuple(a + turn_deg for a in PLACES), directions=tuple(a + turn_deg for a in DIRECTIONS))
    lamps = (Lamp(200.0, 200.0),)
    for heading_deg in (0, 100):
        one = world(at(45, 50, heading_deg, lamps=lamps), figures=turned)
        other = world(at(45, 50, heading_deg + turn_deg, lamps=lamps), figures=figures())
        assert max(other.proximity(1)) > 500
        assert one.proximity(1) == pytest.approx(other.proximity(1), rel=1e-6)
        assert one.ambient(1) == pytest.approx(other.ambient(1), rel=1e-6)


@pytest.mark.parametrize("gap_mm", [5.0, 12.0, 25.0])
def test_sensors_of_twice_the_range_read_the_same_at_twice_the_distance(gap_mm: float) -> None:
    ahead = (0.0,) * 8

    def read(diameter_mm: float, range_mm: float) -> Any:
        sensor_mm = diameter_mm / 2 - 1
        x_mm = 390 - gap_mm * range_mm / 50 - sensor_mm
        shape = figures(diameter_mm, range_mm, places=ahead, directions=ahead)
        return world(at(x_mm, 200, 0), figures=shape).proximity(1)

    usual = read(60, 50)
    assert min(usual) > 20
    assert read(80, 100) == pytest.approx(usual, rel=0.01)
    assert read(60, 200) == pytest.approx(usual, rel=0.01)


def test_the_values_of_the_old_simulator_change_nothing_and_other_stripes_reach_the_robots() -> None:
    for kind in ("khepera", "khepera_ii"):
        assert OldConstants().changes(RobotSpec.load(kind)) == {}
    assert world().specs[0] == KHEPERA
    assert world(stripes=16).specs[0].body.stripe_count == 16


def test_background_noise_grows_in_proportion() -> None:
    none, usual, much = (counts(world(noise_percent=percent)) for percent in (0, 1, 10))
    assert none.max() <= 4  # the mean, 2.8, and its proportional error
    assert 5 < usual.max() < 20
    assert much.max() == pytest.approx(10 * 9.7 + 2.8, rel=0.1)


def test_errors_grow_and_become_more_frequent() -> None:
    def spread(**constants: Any) -> float:
        sim = world(at(390 - 27.5 - 15, 200, 0), noise_percent=0, **constants)
        return float(counts(sim)[:, 2].std())

    none, usual, double = spread(error_small=0, error_large=0), spread(), spread(error_small=0.5, error_large=0.2)
    assert none == 0
    assert double == pytest.approx(2 * usual, rel=0.1)
    assert spread(error_exponent=10) < usual < spread(error_exponent=1)


def test_a_larger_exponent_widens_the_view_of_light_sensors() -> None:
    arena = at(200, 200, 0, lamps=(Lamp(250.0, 290.0),))
    readings = [world(arena, light_exponent=exponent).ambient(1)[2] for exponent in (1, 5, 20)]
    assert readings == sorted(readings, reverse=True)
    assert readings[0] > readings[1] + 5 > readings[2] + 10


def test_the_camera_is_as_noisy_as_its_constant_says() -> None:
    def spread(percent: float) -> float:
        pictures = replies(world(camera_noise_percent=percent), b"T,2,N\n", 30, 0.2)[:, 1:]
        return float(pictures.std(axis=0).mean())

    clean, usual, noisy = spread(0), spread(10), spread(60)
    assert clean < usual < noisy
    # A random number from 0 to 255 has the standard deviation 255 / sqrt(12).
    assert noisy == pytest.approx(0.6 * 255 / math.sqrt(12), rel=0.1)


def test_a_fixed_shutter_leaves_a_dark_scene_dark() -> None:
    dark = replace(Arena.box(400, 400, wall_mm=10, brightness=60), starts=(Pose(200.0, 200.0, 0.0),))
    adapted, fixed = (np.array(world(dark, fixed_shutter=is_fixed).image(1)) for is_fixed in (False, True))
    assert adapted[32] > fixed[32] + 100
