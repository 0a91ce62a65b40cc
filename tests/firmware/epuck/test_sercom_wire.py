"""An e-puck's firmware in a simulation: what it sends by itself is waited for, saved and copied."""

import copy

import kiks
from kiks.model.robot import RobotSpec

STARTING = b"k, Starting calibration - Remove any object in sensors range\r\n"
FINISHED = b"k, Calibration finished\r\n"
CHARACTER_S = 10 / 115_200


def a_simulation(version: str = "AS12") -> kiks.Simulation:
    spec = RobotSpec.load("khepera").with_changes(
        firmware__protocol_version=version, firmware__baud=115_200, firmware__bits_per_character=10
    )
    return kiks.Simulation(kiks.Arena.box(500, 500), robot=RobotSpec(**(vars(spec) | {"kind": "epuck"})))


def test_a_read_waits_for_the_end_of_a_calibration() -> None:
    for timeout in (None, 3.0):
        sim = a_simulation()
        port = sim.port(1)
        port.timeout = timeout
        port.write(b"K\n")
        assert (port.readline(), port.readline()) == (STARTING, FINISHED)
        assert abs(sim.time_s - 2.001 - (2 + len(FINISHED)) * CHARACTER_S) < 1e-6
        # Meanwhile it carries out nothing else.
        port.write(b"K\nE\n")
        assert port.read(len(STARTING + FINISHED) + 7) == STARTING + FINISHED + b"e,0,0\r\n"
        assert sim.time_s > 4.0


def test_a_read_that_is_too_short_ends_in_time() -> None:
    sim = a_simulation()
    port = sim.port(1)
    port.timeout = 0.5
    port.write(b"K\n")
    assert port.readline() == STARTING
    begin_s = sim.time_s
    assert port.readline() == b""
    assert abs(sim.time_s - begin_s - 0.5) < 1e-6


def test_a_copy_goes_on_with_a_calibration_and_an_open_request() -> None:
    sim = a_simulation()
    port = sim.port(1)
    port.timeout = 3.0
    port.write(b"D,3,4\nK\n")
    assert (port.readline(), port.readline()) == (b"d\r\n", STARTING)
    sim.run(1.0)
    other = copy.deepcopy(sim)
    other_port = other.port(1)
    other_port.timeout = 3.0
    assert port.readline() == other_port.readline() == FINISHED
    assert other.state_hash() == sim.state_hash()
    port.write(b"\xbb\xbc\x05")
    sim.run(0.1)
    other = copy.deepcopy(sim)
    for each in (sim, other):
        each.port(1).write(b"\0\x06\0\xbb\0")
        assert each.port(1).read(8) == b"\x03\0\x04\0\x05\0\x06\0"


def test_a_person_stops_a_robot_in_the_middle_of_a_request() -> None:
    sim = a_simulation()
    port, (wire,) = sim.port(1), sim.wires
    for begun in (b"\xbc\x05", b"\xbb", b"D,5", b"", b"\n", b"\xbc\x05\0\x06\0"):
        port.write(b"D,7,7\n" + begun)
        assert port.readline() == b"d\r\n"
        wire.stop(sim.now_ns)
        sim.run(0.1)
        assert wire.firmware.view.speed_setpoint.tolist() == [0, 0]
        port.write(b"E\n")
        assert port.readline() == b"e,0,0\r\n"
