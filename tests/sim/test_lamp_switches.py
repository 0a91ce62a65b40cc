"""Lamps that an arena switches in the course of a run: on a line, in a batch, after a jump and in files."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kiks
from kiks.errors import KiksError
from kiks.model.arena import Lamp, LampSwitch, Pose
from kiks.model.arena_file import save_arena
from kiks.model.project import Project

SWITCHES = (LampSwitch(1.005, 1, False), LampSwitch(0, 2, True), LampSwitch(2, 1, True), LampSwitch(2, 2, False))
LAMPS = Lamp(300, 200), Lamp(200, 250, 1.0, False)
ROOM = replace(kiks.Arena.box(500, 400), starts=(Pose(250, 200, 0.3),), lamps=LAMPS, lamp_switches=SWITCHES)


@kiks.controller(senses=("ambient",))
def to_the_light(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[0] = 2.0 + (sensors[0] + sensors[1] - sensors[4] - sensors[5]) / 200.0
    wheels[1] = 2.0 - (sensors[0] + sensors[1] - sensors[4] - sensors[5]) / 200.0


def lit(sim: kiks.Simulation) -> list[float]:
    return sim.lamps[:, 3].tolist()


def test_a_lamp_is_switched_with_the_tick_that_ends_at_its_time_or_after_it() -> None:
    sim = kiks.Simulation(ROOM, seed=1)
    assert lit(sim) == [1, 1]
    for until_s, expected in ((1.0, [1, 1]), (1.01, [0, 1]), (1.99, [0, 1]), (2.0, [1, 0]), (9.0, [1, 0])):
        sim.run(until_s - sim.time_s)
        assert lit(sim) == expected


def test_a_batch_reads_the_light_that_a_line_reads() -> None:
    batch = kiks.Batch([ROOM, replace(ROOM, lamp_switches=())], worlds=2, seed=[3, 3])
    for _ in range(2):  # a reset begins with the lamps of the beginning
        rollouts = batch.run(to_the_light, seconds=3.0)
    for world, room in enumerate(batch.arenas):
        sim = kiks.Simulation(room, seed=3)
        assert kiks.drive(sim.port(1), to_the_light, seconds=3.0) == rollouts.step_counts[world]
        assert np.abs(sim.poses() - batch.poses[world]).max() < 1.0  # the last command stops the robot
    assert batch.lamps[:, :2, 3].tolist() == [[1, 0], [1, 0]]
    assert batch.state_hash(0) != batch.state_hash(1)
    readings = kiks.Batch(ROOM, 1, senses=("ambient",), seed=3, starts=(250, 200, 0.3))
    robot = kiks.Khepera(kiks.Simulation(ROOM, seed=3).port(1))
    seen = readings.reset()
    for step in range(25):
        assert robot.ambient() == seen[0, 0].astype(int).tolist()
        robot.set_speed(0, 0)
        robot.pause((step + 1) * 0.1 - robot.time_s)
        seen = readings.step(np.zeros((1, 1, 2)))


def test_a_jump_back_has_the_lamps_of_that_time(tmp_path: Path) -> None:
    sim = kiks.Simulation(ROOM, seed=1)
    with sim.record(tmp_path / "run.mcap"):
        kiks.drive(sim.port(1), to_the_light, seconds=3.0)
    recording = kiks.Recording(tmp_path / "run.mcap")
    assert [lit(recording.world_at(time_s)) for time_s in (2.5, 0.5, 1.5)] == [[1, 0], [1, 1], [0, 1]]
    there = recording.world_at(0.5)
    there.run(1.0)
    assert lit(there) == [0, 1]


def test_files_keep_the_switches(tmp_path: Path) -> None:
    save_arena(ROOM, tmp_path / "room.toml")
    read = kiks.Arena.load(tmp_path / "room.toml")
    assert read.lamp_switches == ROOM.lamp_switches == tuple(sorted(SWITCHES, key=lambda each: each.time_s))
    project = Project.of_arena(read)
    project.save(tmp_path / "room.kiks")
    assert Project.load(tmp_path / "room.kiks").arena.lamp_switches == read.lamp_switches


def test_switches_without_a_lamp_are_refused() -> None:
    sim, batch = kiks.Simulation(ROOM), kiks.Batch(ROOM, 1)
    for act, words in (
        (lambda: kiks.Simulation(replace(ROOM, lamps=())), "must name lamps from 1 to 0, but one names lamp 2"),
        (lambda: sim.remove_lamp(1), "must come after all that the arena switches"),
        (lambda: setattr(sim, "lamps", sim.lamps[:1]), "must name lamps from 1 to 1"),
        (lambda: setattr(batch, "lamps", batch.lamps[:, :1]), "at least 2 in each world"),
        (lambda: LampSwitch(-1, 1, True), "time_s must be at least 0|greater than or equal"),
    ):
        with pytest.raises(KiksError, match=words):
            act()
    assert sim.add_lamp(100, 100) == 3
    sim.remove_lamp(3)
