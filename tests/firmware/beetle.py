"""What a robot must do that was added as the page "Another kind of robot" says; `test_another_robot.py` runs these.

They run in a process whose KiKS has that robot, the beetle, so nothing here imports it outside of a test.
"""

import copy
import os
import random
import shlex
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.recording.test_recording import check_again

import kiks
from kiks.errors import ParameterError
from kiks.export.frames import describe_scene, pack_frame
from kiks.export.looks import lit_leds
from kiks.export.pictures import Picture
from kiks.firmware.robot_kind import robot_kind
from kiks.recording.recording import Recording
from kiks.sim.console import type_lines
from kiks.sim.simulation import SimPort, Simulation

MS = 1_000_000
BYTE_NS = 10 * 1_000_000_000 // 38_400
PROCESSING_NS = 200_000


@kiks.controller
def ahead(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
    wheels[:] = 3.0


def speeds(left: int, right: int) -> bytes:
    return struct.pack("cbb", b"s", left, right)


def simulation(robot: str | list[str] = "beetle", seed: int = 1) -> Simulation:
    return Simulation(kiks.Arena.box(500, 500), robot=robot, seed=seed)


def port_of(sim: Simulation, robot: int = 1) -> SimPort:
    port = sim.port(robot)
    port.timeout = 1.0
    return port


# ---- the wire ----


def test_it_answers_bytes_at_the_pace_of_its_line() -> None:
    sim = simulation()
    sim.place(1, 250, 455, np.pi / 2)
    port = port_of(sim)
    port.write(b"r")
    left, front_left, front, front_right, right = port.read(5)
    assert sim.now_ns == pytest.approx(6 * BYTE_NS + PROCESSING_NS, abs=6)
    assert front > 200 > front_left > left
    assert front_right > right
    assert sim.proximity(1)[5:] == [0, 0, 0]
    # Commands come in pieces; what is none does nothing.
    port.write(b"\xffs")
    port.write(b"\x9c")
    assert port.read(1) == b""
    port.write(b"\x9cr")
    assert len(port.read(5)) == 5
    y_mm = sim.pose(1)[1]
    sim.run(1.0)
    assert sim.pose(1)[1] == pytest.approx(y_mm - 100, abs=1.0)


def test_no_bytes_raise_or_are_answered_that_ask_nothing() -> None:
    sim, chance = simulation(), random.Random(1)
    port = port_of(sim)
    for _ in range(50):
        data = bytes(chance.choice(b"slxyz\0\xff") for _ in range(chance.randrange(200)))
        port.write(data)
        sim.run(0.2)
    assert port.in_waiting == 0
    firmware = sim.wires[0].firmware
    for _ in range(2000):
        assert len(firmware.execute(chance.randbytes(chance.randrange(5)), sim.now_ns)) in (0, 5)


def test_it_sends_by_itself_until_its_program_goes() -> None:
    sim = simulation()
    port = port_of(sim)
    port.write(b"w\5")
    times = []
    for _ in range(4):
        assert len(port.read(5)) == 5
        times.append(sim.now_ns)
    assert np.diff(times).tolist() == [50 * MS] * 3
    # What is not read stops the readings, and not the robot.
    port.write(speeds(50, 50))
    sim.run(2.0)
    assert port.in_waiting <= 64 + 5
    assert sim.travelled_mm(1) == pytest.approx(100, abs=2)
    port.close()
    sim.run(0.1)
    assert port_of(sim).read(1) == b""


def test_a_person_stops_it_between_the_bytes_of_a_command() -> None:
    sim = simulation()
    port = port_of(sim)
    port.write(speeds(50, 50) + b"s\x32")
    sim.run(0.1)
    with sim.lock:
        sim.wires[0].stop(sim.now_ns)
    sim.run(0.1)
    before = sim.poses()
    sim.run(1.0)
    assert np.array_equal(before, sim.poses())
    port.write(b"r")
    assert len(port.read(5)) == 5


def test_a_copy_goes_on_with_the_same_bytes() -> None:
    sim = simulation()
    port_of(sim).write(speeds(40, -40) + b"w\3l")
    sim.run(0.01)
    other = copy.deepcopy(sim)
    results = []
    for each in (sim, other):
        port = port_of(each)
        port.write(b"\1")
        results.append((port.read(50), each.now_ns, lit_leds(each.specs, each.world.state.robots[0]).tolist()))
    assert results[0] == results[1]
    assert results[0][2] == [1]
    assert sim.state_hash() == other.state_hash()


# ---- what people see ----


def test_the_desk_shows_it_with_its_sensors_and_its_led() -> None:
    sim = simulation(["beetle", "khepera"])
    port_of(sim).write(b"l\1")
    sim.run(0.1)
    scene = describe_scene(sim, 1)
    beetle = scene["robots"][0]
    assert (beetle["kind"], beetle["counts_max"]) == ("Beetle", 255)
    assert [each["name"] for each in beetle["sensors"]][:3] == ["left", "front left", "ahead"]
    look = scene["looks"][beetle["look"]]
    assert look["radius_mm"] == 20.0
    assert [led["name"] for led in look["leds"]] == ["back"]
    assert lit_leds(sim.specs, sim.world.state.robots[0]).tolist() == [1, 0]
    assert len(pack_frame(sim, scene=1)) > 500
    assert sim.explain(1, 2).name == "ahead"


def test_a_picture_has_its_colours() -> None:
    sim = simulation()
    x_mm, y_mm, _ = sim.pose(1)
    image = np.asarray(Picture.of_simulation(sim).image())
    scale = image.shape[1] / 500
    column, row = round(x_mm * scale), round((500 - y_mm) * scale)
    around = image[row - 30 : row + 30, column - 30 : column + 30].reshape(-1, 3)
    assert (np.abs(around.astype(int) - (0x7A, 0x2F, 0x2A)).max(axis=1) < 8).any()


# ---- recordings, other robots, batches ----


def test_a_recording_makes_the_same_run_again(tmp_path: Path) -> None:
    sim = simulation(seed=3)
    with sim.record(tmp_path / "run.mcap"):
        for _ in range(2):
            port = port_of(sim)
            port.write(b"w\2")
            for number in range(30):
                port.write(speeds(3 * number, 60) + b"l" + bytes((number % 2,)) + b"r" * (number % 3))
                port.read(7)
                sim.run(0.04)
            port.close()
            sim.run(0.7)
    recording = Recording(tmp_path / "run.mcap")
    check_again(recording, sim.state_hash())
    assert recording.table("wheels")["driven_mm"].max() > 50
    assert not len(recording.table("readings"))


def test_it_lives_beside_others_and_is_seen_by_them() -> None:
    sim = Simulation(kiks.Arena.box(500, 500), robots=0, seed=1)
    for robot, x_mm in (("khepera", 100), ("epuck", 250), ("beetle", 400)):
        sim.add_robot(robot, pose=(x_mm, 250, 0.0))
    port = port_of(sim, 3)
    port.write(b"r")
    assert port.read(5) == bytes(5)
    sim.place(3, 315, 250, np.pi)
    port.write(b"r")
    readings = port.read(5)
    assert readings[2] == max(readings) > 100
    assert sim.proximity(2)[7] > 150
    port.write(speeds(100, 100))
    sim.run(2.0)
    assert sim.contacts(3) == 1
    assert np.hypot(*(sim.poses()[2] - sim.poses()[1])[:2]) >= 37 + 20 - 0.5
    khepera, epuck = kiks.Khepera(sim.port(1)), kiks.EPuck(sim.port(2))
    assert len(khepera.proximity()) == len(epuck.proximity()) == 8


def test_a_batch_without_a_line_drives_it_as_its_program_does() -> None:
    batch = kiks.Batch(
        kiks.Arena.box(500, 500), 3, robot="beetle", timing=kiks.Timing(baud=None), starts=(100, 250, 0), seed=1
    )
    rollouts = batch.run(ahead, seconds=5, measures=[kiks.measures.path_mm])
    # Three times 8 mm/s.
    assert rollouts.values.tolist() == [[[pytest.approx(120, abs=3)]]] * 3


def test_controllers_see_its_sensors_as_they_see_those_of_others() -> None:
    for heading_rad, near in ((np.pi / 2, [2, 3]), (0.0, [0])):
        timing, start = kiks.Timing(baud=None), (250, 455, heading_rad)
        batch = kiks.Batch(kiks.Arena.box(500, 500), 1, robot="beetle", timing=timing, starts=start, seed=1)
        sensors = batch.reset()[0, 0]
        # The sensor ahead stands for both; what it counts is as large as a Khepera's counts.
        assert sensors[near].tolist() == [sensors.max()] * len(near)
        assert sensors.max() > 800
        assert sensors[5:].tolist() == [0.0] * 3


def test_what_needs_lines_refuses_it_in_one_line() -> None:
    with pytest.raises(ParameterError, match=r"^a batch with a line must have robots that take lines of text.*$"):
        kiks.Batch(kiks.Arena.box(500, 500), 2, robot="beetle")
    with pytest.raises(ParameterError, match=r"^a drive by a controller must have robots that take lines of text.*$"):
        kiks.drive(simulation().port(1), ahead, seconds=1, kind="beetle")
    with pytest.raises(ParameterError, match=r"^the console must have robots that take lines of text.*$"):
        type_lines(simulation(), 1, "r")
    light, timing = kiks.controllers.linear(senses="ambient"), kiks.Timing(baud=None)
    batch = kiks.Batch(kiks.Arena.box(500, 500), 2, robot="beetle", timing=timing)
    with pytest.raises(ParameterError, match=r"^senses must be some of those of this kind of robot \(proximity\), .*$"):
        batch.run(light, [0.0] * 18, seconds=1)


# ---- the program of the page ----


def test_its_program_runs_unchanged() -> None:
    folder, command = Path(os.environ["BEETLE_FOLDER"]), shlex.split(os.environ["BEETLE_COMMAND"])
    assert command[0] == "kiks"
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=folder, capture_output=True, text=True, check=False, timeout=200
    )
    assert done.returncode == 0, done.stderr
    assert (folder / "around.png").exists()
    recording = Recording(folder / "around.mcap")
    wire = recording.table("wire")
    # The table leaves out zeros at the end.
    assert set(map(len, wire["data"][~wire["is_sent"]])) <= set(range(6))
    assert recording.table("wheels")["driven_mm"].max() > 20
    robots = recording.world_at(recording.log.end_ns / 1e9).world.state.robots
    assert robot_kind("beetle").lit(robots[0]).tolist() == [[1]]
