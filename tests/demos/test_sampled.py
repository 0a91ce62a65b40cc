"""Sensors that read tables of samples: beside one wall they read what the whole sensors read."""

import copy
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.learn.small import refused

import kiks
from kiks.control.recipes import module_in
from kiks.model.arena import Arena
from kiks.model.package import shipped

PAPER = module_in(shipped("examples/classics/tasks/miglino_lund_nolfi_1995.py"))
FIRST_MM, STEP_MM, NOISES = PAPER.FIRST_MM, PAPER.STEP_MM, PAPER.NOISES
sampled_sense = PAPER.sampled_sense
EMPTY = Arena.box(620, 370)


def seen(sense: Any, pose: tuple[float, float, float], arena: Arena = EMPTY) -> np.ndarray:
    """Return the first readings of a sense at a pose."""
    robot = kiks.RobotSpec.load("khepera").without_noise()
    return kiks.Batch(arena, 1, robot=robot, seed=1, starts=[[pose]], senses=[sense]).reset()[0, 0]


def test_beside_a_wall_or_an_obstacle_it_reads_what_the_sensors_read() -> None:
    for angle in (0, 30, 171):
        pose = (610.0 - 27.5 - FIRST_MM - 3 * STEP_MM, 185.0, math.radians(-2.0 * angle))
        there = seen("proximity", pose)
        assert seen(sampled_sense("none"), pose) == pytest.approx(there, abs=1.0)
        assert there.max() > 100
    pose = (330.0 - 27.0 - 27.5 - FIRST_MM - 2 * STEP_MM, 250.0, math.radians(40.0))
    there = seen("proximity", pose, PAPER.BOX)
    assert seen(sampled_sense("none"), pose, PAPER.BOX) == pytest.approx(there, abs=25.0)
    assert there.max() > 100


def test_kinds_of_noise_differ_and_repeat_and_a_look_without_noise_is_free_of_it() -> None:
    pose = (560.0, 185.0, 0.3)
    quiet, uniform, conservative = (seen(sampled_sense(noise), pose) for noise in NOISES)
    assert (seen(sampled_sense("uniform"), pose) == uniform).all()
    assert (seen(sampled_sense("conservative"), pose) == conservative).all()
    assert (uniform != quiet).any()
    assert (conservative != quiet).any()
    sim = kiks.Simulation(EMPTY, seed=1)
    sim.place(1, 560.0, 185.0, 0.3)
    looks = [
        sampled_sense(noise).look(sim.world.scene, 0, 0, time_ns, is_noisy=False)
        for noise in NOISES
        for time_ns in (0, 10**9)
    ]
    assert all((look == looks[0]).all() for look in looks)


def test_an_unknown_noise_is_refused() -> None:
    refused("sampled must be", kiks.tasks.miglino_lund_nolfi_1995, sampled="much")


def test_in_a_file_the_sensors_of_the_robot_stand_for_the_sampled_sense(tmp_path: Path) -> None:
    linear = kiks.controllers.linear(senses=(sampled_sense("none"),))
    kiks.Champion(linear, [0.1] * 18).save(tmp_path / "champion.toml")
    assert kiks.Champion.load(tmp_path / "champion.toml").controller is kiks.controllers.linear()


def test_nothing_near_is_nothing_read() -> None:
    assert not seen(sampled_sense("none"), (100.0, 250.0, 0.0)).any()


def test_a_table_is_a_ring_of_headings_and_the_rough_angle_is_near_the_true_one() -> None:
    table = PAPER.sampled_table(math.inf)
    assert table.shape == (20, 180, 8)
    assert (table[:-1].max(axis=(1, 2)) >= table[1:].max(axis=(1, 2)) - 1).all()  # nearer is no less
    for angle in np.linspace(-3.1, 3.1, 97):
        assert PAPER.rough_angle.py_func(math.sin(angle), math.cos(angle)) == pytest.approx(angle, abs=0.005)


def test_a_population_goes_on_under_changed_physics() -> None:
    task = kiks.tasks.miglino_lund_nolfi_1995(sampled="none", seconds=1)
    evolution = kiks.Evolution(task, seed=1, population=6)
    evolution.run(generations=1)
    whole = kiks.tasks.miglino_lund_nolfi_1995(seconds=1)
    then = kiks.Evolution(whole, copy.deepcopy(evolution.algorithms[0]), seed=1)
    assert (then.ask() == evolution.ask()[:6]).all()
