"""Sensors that read tables of samples: beside one wall they read what the whole sensors read."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kiks
from kiks.learn.sampled import FIRST_MM, STEP_MM, rough_angle, sampled_proximity, sampled_table
from kiks.model.arena import Arena
from kiks.model.walls import Wall

BOX = Arena.box(620, 370)


def seen(sense: object, arena: Arena, pose: tuple[float, float, float], seed: int = 1) -> np.ndarray:
    """Return the first readings of a sense at a pose."""

    @kiks.controller(senses=(sense,), parameters=0)
    def still(sensors, memory, parameters, wheels):
        memory[:] = 0.0
        wheels[:] = 0.0

    @kiks.measure(notes=8, result=lambda notes: notes[..., 0])
    def first(moment, notes):
        for k in range(8):
            notes[k] = moment.sensors[k]

    readings = []
    for k in range(8):
        own = kiks.Measure(first.function, notes=8, result=lambda notes, k=k: notes[..., k])
        batch = kiks.Batch(arena, 1, robot=kiks.RobotSpec.load("khepera").without_noise(), seed=seed, starts=[[pose]])
        readings.append(batch.run(still, seconds=0.01, measures=[own]).values.item())
    return np.array(readings)


@pytest.mark.parametrize("angle", [0, 30, 171])
def test_beside_a_wall_it_reads_what_the_sensors_read(angle: int) -> None:
    sense = sampled_proximity(BOX, [(310.0, 185.0)], 27.0)
    heading = math.radians(-2.0 * angle)
    pose = (610.0 - 27.5 - FIRST_MM - 3 * STEP_MM, 185.0, heading)
    there = seen("proximity", BOX, pose)
    assert seen(sense, BOX, pose) == pytest.approx(there, abs=1.0)
    assert there.max() > 100


def test_beside_an_obstacle_it_reads_what_the_sensors_read() -> None:
    sense = sampled_proximity(BOX, [(310.0, 185.0)], 27.0)
    arena = replace(BOX, walls=(Wall(disc_mm=(310.0, 185.0), radius_mm=27.0),))
    pose = (310.0 - 27.0 - 27.5 - FIRST_MM - 2 * STEP_MM, 185.0, math.radians(40.0))
    assert seen(sense, arena, pose) == pytest.approx(seen("proximity", arena, pose), abs=25.0)


def test_kinds_of_noise_differ_and_repeat() -> None:
    pose = (560.0, 185.0, 0.3)
    read = {}
    for noise in ("none", "uniform", "conservative"):
        sense = sampled_proximity(BOX, [(310.0, 185.0)], 27.0, noise)
        read[noise] = seen(sense, BOX, pose)
        assert (seen(sense, BOX, pose) == read[noise]).all()
    assert (read["uniform"] != read["none"]).any()
    assert (read["conservative"] != read["none"]).any()


@pytest.mark.parametrize("noise", ["uniform", "conservative"])
def test_a_look_without_noise_is_free_of_it(noise: str) -> None:
    sense, quiet = (sampled_proximity(BOX, [(310.0, 185.0)], 27.0, kind) for kind in (noise, "none"))
    sim = kiks.Simulation(BOX, seed=1)
    looks = [
        each.look(sim.world.scene, 0, 0, time_ns, is_noisy=False) for each in (sense, quiet) for time_ns in (0, 10**9)
    ]
    assert all((look == looks[-1]).all() for look in looks)


@pytest.mark.parametrize(
    ("obstacles", "radius_mm", "noise", "message"),
    [
        ([], 27.0, "much", "noise must be"),
        ([], math.nan, "none", "radius_mm must be"),
        ([(1.0, 2.0, 3.0)], 27.0, "none", "obstacles must"),
        ("ab", 27.0, "none", "obstacles must"),
    ],
)
def test_wrong_arguments_are_errors(obstacles: Any, radius_mm: float, noise: str, message: str) -> None:
    with pytest.raises(kiks.ParameterError, match=message):
        sampled_proximity(BOX, obstacles, radius_mm, noise)


def test_in_a_file_the_sensors_of_the_robot_stand_for_the_tables(tmp_path: Path) -> None:
    sense = sampled_proximity(BOX, [], 27.0)
    linear = kiks.controllers.linear(senses=(sense,))
    kiks.Champion(linear, [0.1] * 18).save(tmp_path / "champion.toml")
    assert kiks.Champion.load(tmp_path / "champion.toml").controller is kiks.controllers.linear()


def test_nothing_near_is_nothing_read() -> None:
    assert not seen(sampled_proximity(BOX, [(100.0, 100.0)], 27.0), BOX, (310.0, 185.0, 0.0)).any()


def test_a_table_is_a_ring_of_headings() -> None:
    table = sampled_table(math.inf)
    assert table.shape == (20, 180, 8)
    assert (table[:-1].max(axis=(1, 2)) >= table[1:].max(axis=(1, 2)) - 1).all()  # nearer is no less


def test_the_rough_angle_is_near_the_true_one() -> None:
    for angle in np.linspace(-3.1, 3.1, 97):
        assert rough_angle.py_func(math.sin(angle), math.cos(angle)) == pytest.approx(angle, abs=0.005)


def test_a_population_goes_on_under_changed_physics() -> None:
    task = kiks.tasks.miglino_lund_nolfi_1995(sampled="none", seconds=1)
    evolution = kiks.Evolution(task, seed=1, population=6)
    evolution.run(generations=2)
    whole = kiks.tasks.miglino_lund_nolfi_1995(seconds=1)
    then = kiks.Evolution(whole, copy.deepcopy(evolution.algorithms[0]), seed=1)
    assert (then.ask() == evolution.ask()[:6]).all()
