"""An e-puck's firmware in a simulation: what it sends by itself is waited for, saved and copied."""

import copy

import pytest
from tests.firmware.epuck.sercom_grammar import first_violation
from tests.firmware.epuck.sercom_line import SercomSession, sessions, unescaped

import kiks
from kiks.errors import LinkError
from kiks.model.robot import RobotSpec
from kiks.sim.console import type_lines
from kiks.units import character_ns, ns_from_s

STARTING = b"k, Starting calibration - Remove any object in sensors range\r\n"
FINISHED = b"k, Calibration finished\r\n"
ROBOTS = {"BT11": "epuck_bt11", "BT20": "epuck_bt20", "AS12": "epuck", "AS20": "epuck2", "WF15": "epuck_wf15"}
ARENA = kiks.Arena.box(500, 500)


@pytest.mark.parametrize("version", ROBOTS)
def test_a_robots_file_has_the_version(version: str) -> None:
    assert RobotSpec.load(ROBOTS[version]).firmware.protocol_version == version


@pytest.mark.slow
@pytest.mark.parametrize("session", sessions(), ids=lambda session: session.name)
def test_a_session_in_a_simulation(session: SercomSession) -> None:
    sent = b"".join(unescaped(text) for _, mark, text in session.steps if mark == ">")
    for version in session.versions[-1:]:
        port = kiks.Simulation(ARENA, robot=ROBOTS[version]).port(1)
        port.timeout = 20.0
        port.write(sent)
        assert first_violation(version, sent, port.read(100_000)) is None


def test_a_read_waits_for_the_end_of_a_calibration() -> None:
    for timeout in (None, 3.0):
        sim = kiks.Simulation(ARENA, robot="epuck")
        port = sim.port(1)
        port.timeout = timeout
        port.write(b"K\n")
        assert (port.readline(), port.readline()) == (STARTING, FINISHED)
        firmware = RobotSpec.load("epuck").firmware
        characters_ns = (len(b"K\n") + len(FINISHED)) * character_ns(firmware.baud, firmware.bits_per_character)
        assert sim.now_ns == 2_000_000_000 + ns_from_s(firmware.processing_ms * 1e-3) + characters_ns
        # Meanwhile it carries out nothing else.
        port.write(b"K\nE\n")
        assert port.read(len(STARTING + FINISHED) + 7) == STARTING + FINISHED + b"e,0,0\r\n"
        assert sim.time_s > 4.0


def test_a_read_that_is_too_short_ends_in_time() -> None:
    sim = kiks.Simulation(ARENA, robot="epuck")
    port = sim.port(1)
    port.timeout = 0.5
    port.write(b"K\n")
    assert port.readline() == STARTING
    begin_s = sim.time_s
    assert port.readline() == b""
    assert abs(sim.time_s - begin_s - 0.5) < 1e-6


def test_a_copy_goes_on_with_a_calibration_and_an_open_request() -> None:
    sim = kiks.Simulation(ARENA, robot="epuck")
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


def test_a_person_types_between_commands_only() -> None:
    sim = kiks.Simulation(ARENA, robot="epuck")
    port = sim.port(1)
    for sent in (b"", b"E\r\n", b"\xbb\0", b"\r", b"V\n\0"):
        port.write(sent)
        (typed,) = type_lines(sim, 1, "C")
        sim.run(0.1)
        assert typed.reply == "c,3"
    for sent in (b"D,5", b"\xbb", b"\xbc\x05"):
        port.write(sent)
        with pytest.raises(LinkError, match="has sent"):
            type_lines(sim, 1, "C")
        port.write(b"\n\0\0\0\0")


def test_messages_know_how_a_request_ends(caplog: pytest.LogCaptureFixture) -> None:
    sim = kiks.Simulation(ARENA, robot="epuck")
    port = sim.port(1)
    port.write(b"\xb2")
    with pytest.raises(LinkError, match=r"but b'.xb2' has no 0 at its end, .* a command that ends in a 0, or set"):
        port.read(1)
    sim.run(1.0)
    assert port.in_waiting == 0
    assert "A command ends in a 0, the one character '\\0'." in caplog.text
    port.write(b"\0E")
    port.read(16)
    with pytest.raises(LinkError, match=r"but 'E' has no end of line, .* a command that ends in a line feed, or set"):
        port.read(1)
    port.write(b"\r\n")
    assert port.readline() == b"e,0,0\r\n"
    with pytest.raises(LinkError, match="but no command is on the line"):
        port.read(1)


def test_a_person_stops_a_robot_in_the_middle_of_a_request() -> None:
    sim = kiks.Simulation(ARENA, robot="epuck")
    port, (wire,) = sim.port(1), sim.wires
    for begun in (b"\xbc\x05", b"\xbb", b"D,5", b"", b"\n", b"\xbc\x05\0\x06\0"):
        port.write(b"D,7,7\n" + begun)
        assert port.readline() == b"d\r\n"
        wire.stop(sim.now_ns)
        sim.run(0.1)
        assert wire.firmware.view.speed_setpoint.tolist() == [0, 0]
        port.write(b"E\n")
        assert port.readline() == b"e,0,0\r\n"
