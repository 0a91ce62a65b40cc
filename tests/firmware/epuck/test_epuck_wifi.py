"""The second e-puck over Wi-Fi: bytes and their times (epuck2-wifi.md), as programs for the real robot send them."""

import copy
import random
import struct
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from tests.ports.helpers import connect
from tests.recording.test_recording import check_again
from tests.served import served

import kiks
from kiks.engine.state import REGISTER_BYTES
from kiks.errors import ParameterError
from kiks.firmware.epuck.robot import CALIBRATION_NS
from kiks.firmware.epuck.wifi import EPUCK_WIFI, WIFI_MEMORY, EPuckWifiFirmware, WifiReceiver
from kiks.firmware.robot_kind import robot_kind
from kiks.model.window import Window
from kiks.ports.tcp import TcpEndpoint
from kiks.recording.recording import Recording
from kiks.sim.console import type_lines
from kiks.sim.simulation import SimPort, Simulation
from kiks.sim.wire import SavedWire

MS = 1_000_000
BYTE_NS = 2_500
COMMAND_NS = 21 * BYTE_NS
SENSORS, IMAGE, EMPTY = 2, 1, 3
"""Ids of packets."""

SIZES = {EMPTY: 1, SENSORS: 105, IMAGE: 38_401}


def picture(window: Window) -> NDArray[np.uint8]:
    """Return a picture whose pixels tell their places."""
    rows, columns = np.mgrid[: window.height, : window.width]
    return np.stack([rows, columns, rows + columns], axis=-1).astype(np.uint8)


def simulation(seed: int = 1) -> Simulation:
    return Simulation(kiks.Arena.box(500, 500), robot="epuck2_wifi", seed=seed)


def firmware_of(sim: Simulation) -> EPuckWifiFirmware:
    firmware = sim.wires[0].firmware
    assert isinstance(firmware, EPuckWifiFirmware)
    return firmware


def port_of(sim: Simulation, timeout_s: float | None = 1.0) -> SimPort:
    port = sim.port(1)
    port.timeout = timeout_s
    return port


def command(
    request: int = 2,
    settings: int = 0,
    left: int = 0,
    right: int = 0,
    leds: int = 0,
    colours: bytes = bytes(12),
    sound: int = 0,
) -> bytes:
    """Return a command as section 2 has it, written apart from the source."""
    return struct.pack("<BBBhhB", 0x80, request, settings, left, right, leds) + colours + bytes((sound,))


def read_packet(port: SimPort) -> tuple[int, bytes, int]:
    """Return the id and the content of the next packet, and when it is complete [ns]; id 0 if none comes."""
    head = port.read(1)
    if not head:
        return 0, b"", port.sim.now_ns
    return head[0], port.read(SIZES[head[0]] - 1), port.sim.now_ns


def split(stream: bytes) -> Iterator[int]:
    """Yield the ids of the packets of a stream, all of them whole."""
    place = 0
    while place < len(stream):
        yield stream[place]
        place += SIZES[stream[place]]
    assert place == len(stream)


def fields(content: bytes) -> dict[str, Any]:
    """Return the fields of a sensor packet that tests ask for, by the offsets of section 4."""
    assert len(content) == 104
    return {
        "acceleration": struct.unpack_from("<3h", content, 0),
        "spherical": struct.unpack_from("<3f", content, 6),
        "proximity": struct.unpack_from("<8H", content, 37),
        "ambient": struct.unpack_from("<8H", content, 53),
        "distance_mm": struct.unpack_from("<H", content, 69)[0],
        "microphones": struct.unpack_from("<4H", content, 71),
        "steps": struct.unpack_from("<2h", content, 79),
        "battery": struct.unpack_from("<H", content, 83)[0],
        "selector": content[89],
        "ground": struct.unpack_from("<3H", content, 90),
        "rest": content[102:],
    }


# ---- the stream ----


def test_the_robot_is_silent_until_the_first_command_and_then_streams() -> None:
    port = port_of(simulation())
    assert port.read(1) == b""
    port.write(command(2)[:20])
    assert port.read(1) == b""
    begin_ns = port.sim.now_ns + BYTE_NS
    port.write(command(2)[20:])
    for number in range(5):
        kind, content, end_ns = read_packet(port)
        assert (kind, len(content)) == (SENSORS, 104)
        assert end_ns == begin_ns + 20 * MS * number + 105 * BYTE_NS


def test_a_sensor_packet_has_its_fields_where_clients_expect_them() -> None:
    sim = simulation()
    firmware, known = firmware_of(sim), {"ground": [1000, 500, 0, 0, 0], "accelerometer": [0, 0, 768]}
    known["microphones"] = [10, 20, 30]
    sense = firmware.sense
    firmware.sense = lambda name: known.get(name) or sense(name)
    port = port_of(sim)
    port.write(command(2))
    read = fields(read_packet(port)[1])
    assert read["acceleration"] == (0, 0, 768)
    assert read["spherical"] == (768.0, 0.0, 0.0)
    assert 2700 < read["battery"] < 3500
    assert (read["distance_mm"], read["selector"], read["rest"]) == (2000, 15, b"\0\0")
    assert read["microphones"] == (10, 20, 30, 15)
    assert read["ground"] == (1000, 500, 0)
    assert max(read["proximity"]) < 100 < min(read["ambient"])


def test_an_image_has_two_bytes_a_pixel_the_high_one_first() -> None:
    sim = simulation()
    firmware_of(sim).picture = picture
    port = port_of(sim)
    port.write(command(1))
    _, content, end_ns = read_packet(port)
    assert end_ns == COMMAND_NS + 38_401 * BYTE_NS
    first, second = np.frombuffer(content, np.uint8).reshape(120, 160, 2).transpose(2, 0, 1).astype(int)
    rows, columns = np.mgrid[:120, :160]
    # As section 5 has it that clients take the colours out.
    assert np.array_equal(first & 0xF8, rows & 0xF8)
    assert np.array_equal((first & 7) << 5 | (second & 0xE0) >> 3, columns & 0xFC)
    assert np.array_equal((second & 0x1F) << 3, (rows + columns) & 0xF8)


def test_images_and_sensors_take_turns_ten_times_a_second() -> None:
    port = port_of(simulation())
    port.write(command(3))
    packets = [read_packet(port) for _ in range(20)]
    assert [kind for kind, _, _ in packets] == [IMAGE, SENSORS] * 10
    images_ns = [end_ns for kind, _, end_ns in packets if kind == IMAGE]
    assert {later - earlier for earlier, later in pairwise(images_ns)} == {100 * MS}


@pytest.mark.parametrize(
    ("request_byte", "kinds"), [(0, [EMPTY] * 5), (2, [SENSORS] * 5), (1, [IMAGE]), (3, [IMAGE, SENSORS]), (4, [])]
)
def test_a_request_chooses_the_packets(request_byte: int, kinds: list[int]) -> None:
    sim = simulation()
    port = port_of(sim)
    port.write(command(request_byte, left=100, right=100))
    sim.run(0.1)
    assert list(split(port.read(len(sim.wires[0].line.waiting)))) == kinds
    assert firmware_of(sim).view.speed_setpoint.tolist() == [100, 100]


# ---- commands ----


def test_sensors_are_sampled_before_the_command_acts() -> None:
    port = port_of(simulation())
    port.write(command(2, settings=4, left=-5, right=70))
    assert fields(read_packet(port)[1])["steps"] == (0, 0)
    assert fields(read_packet(port)[1])["steps"] == (-5, 70)
    port.write(command(2, left=1000, right=-500))
    assert fields(read_packet(port)[1])["steps"] == (-5, 70)
    port.sim.run(1.0 - port.sim.now_ns % (20 * MS) / 1e9)
    while (now := fields(read_packet(port)[1])["steps"])[0] < 900:
        pass
    assert abs(now[0] + 5 + 2 * (now[1] - 70)) <= 3


def test_counters_are_set_anew_in_each_round_until_a_command_without_it() -> None:
    port = port_of(simulation())
    port.write(command(2, left=1000, right=1000))
    port.sim.run(0.05)
    port.write(command(2, settings=4, left=7, right=8))
    steps = [fields(read_packet(port)[1])["steps"] for _ in range(10)]
    assert all(left - 7 == right - 8 == 20 for left, right in steps[5:])


def test_leds_and_colours_are_set_and_shares_above_100_leave_what_is() -> None:
    sim = simulation()
    port, memory = port_of(sim), firmware_of(sim).memory
    port.write(command(2, leds=0b110101, colours=bytes((9, 9, 9, 1, 2, 3, 4, 5, 6, 100, 101, 255))))
    sim.run(0.01)
    assert memory.ring[::2].tolist() == [1, 0, 1, 0]
    assert (memory.body.tolist(), memory.front.tolist()) == ([1], [1])
    assert memory.colours.tolist() == [0, 0, 0, 1, 2, 3, 4, 5, 6, 100, 0, 0]
    port.write(command(2, colours=bytes((9, 9, 9, 200, 8, 200, 0, 0, 0, 0, 0, 0))))
    sim.run(0.02)
    assert memory.ring[::2].tolist() == [0, 0, 0, 0]
    assert memory.colours.tolist() == [0, 0, 0, 1, 8, 3] + [0] * 6


def test_a_sound_begins_anew_in_each_round_until_a_command_without_it() -> None:
    sim = simulation()
    port, view = port_of(sim), firmware_of(sim).view
    port.write(command(2, sound=1))
    ends_ns = []
    for _ in range(3):
        sim.run(0.02)
        ends_ns.append(int(view.sound_ends_ns[0]))
    assert [later - earlier for earlier, later in pairwise(ends_ns)] == [20 * MS] * 2
    port.write(command(2))
    sim.run(0.02)
    assert view.sound_ends_ns[0] - sim.now_ns > 900 * MS
    port.write(command(2, sound=0x20))
    sim.run(0.02)
    assert (view.loudness[0], view.sound_ends_ns[0]) == (0, 0)


def test_a_calibration_takes_the_baseline_off_and_stops_the_stream_meanwhile() -> None:
    sim = simulation()
    port = port_of(sim, 5.0)
    port.write(command(2, settings=1))
    before = read_packet(port)
    port.write(command(2))
    after = read_packet(port)
    assert after[2] - before[2] == CALIBRATION_NS
    assert firmware_of(sim).memory.zero.max() > 0
    assert np.mean(fields(after[1])["proximity"]) < np.mean(fields(before[1])["proximity"])
    assert read_packet(port)[2] - after[2] == 20 * MS


def test_one_command_is_read_in_a_round_and_of_five_the_newest() -> None:
    for count, expected in ((4, [1, 2, 3, 4, 4, 4]), (5, [5] * 6), (8, [8] * 6)):
        sim = simulation()
        firmware = firmware_of(sim)
        port = port_of(sim)
        port.write(command(2))
        sim.run(0.01)
        port.write(b"".join(command(2, left=number) for number in range(1, count + 1)))
        speeds = []
        for _ in range(6):
            sim.run(0.02)
            speeds.append(int(firmware.view.speed_setpoint[0]))
        assert speeds == expected


def test_only_the_first_command_needs_the_right_id() -> None:
    sim = simulation()
    port = port_of(sim, 0.1)
    strange = b"\1" + command(2, left=300)[1:]
    port.write(strange)
    assert port.read(1) == b""
    assert firmware_of(sim).view.speed_setpoint[0] == 0
    port.write(command(0))
    assert read_packet(port)[0] == EMPTY
    port.write(strange)
    sim.run(0.03)
    assert firmware_of(sim).view.speed_setpoint[0] == 300


def test_there_is_no_watchdog_and_the_next_program_hears_nothing_at_first() -> None:
    sim = simulation()
    port = port_of(sim)
    port.write(command(2, left=500, right=500))
    read_packet(port)
    port.close()
    sim.run(0.5)
    before_mm = sim.travelled_mm(1)
    sim.run(0.1)
    assert sim.travelled_mm(1) > before_mm
    assert not sim.wires[0].line.waiting
    port = port_of(sim, 0.2)
    assert port.read(1) == b""
    port.write(command(0))
    assert read_packet(port)[0] == EMPTY


def test_commands_sent_before_a_program_goes_still_act_without_packets() -> None:
    sim = simulation()
    port = port_of(sim)
    for left in (1, 2, 3):
        port.write(command(2, left=left))
    port.close()
    sim.run(0.1)
    assert firmware_of(sim).view.speed_setpoint[0] == 3
    assert not sim.wires[0].line.waiting
    assert firmware_of(sim).wakes_ns is None


@pytest.mark.parametrize("sent", [b"", command(2, left=500)[:9], command(2, left=500), command(3, left=9) * 4])
def test_a_person_stops_the_wheels_whatever_was_sent(sent: bytes) -> None:
    sim = simulation()
    port = port_of(sim)
    port.write(command(2, left=700))
    sim.run(0.03)
    port.write(sent)
    sim.wires[0].stop(sim.now_ns)
    sim.run(0.6)
    assert firmware_of(sim).view.speed_setpoint.tolist() == [0, 0]
    port.write(command(2, left=5))
    sim.run(0.02)
    assert firmware_of(sim).view.speed_setpoint[0] == 5
    sim.wires[0].halt(sim.now_ns)
    sim.run(0.1)
    assert firmware_of(sim).view.speed_setpoint.tolist() == [0, 0]
    assert not sim.wires[0].line.waiting


# ---- how programs speak (section 7) ----


def test_a_program_that_sends_a_command_for_each_packet_goes_at_the_robots_pace() -> None:
    """As UF and MULTI do; a closing program sends 50 commands for empty packets."""
    port = port_of(simulation())
    ends_ns = []
    for _ in range(20):
        port.write(command(2))
        kind, _, end_ns = read_packet(port)
        assert kind == SENSORS
        ends_ns.append(end_ns)
    assert {later - earlier for earlier, later in pairwise(ends_ns)} == {20 * MS}
    for number in range(50):
        port.write(command(0))
        assert read_packet(port)[0] == (EMPTY if number else SENSORS) or number < 2


def test_a_program_with_a_camera_reads_two_packets_for_a_command() -> None:
    """As RC2 does, which asks for a calibration once."""
    port = port_of(simulation(), 10.0)
    port.write(command(3, settings=1))
    assert [read_packet(port)[0] for _ in range(2)] == [IMAGE, SENSORS]
    for number in range(5):
        port.write(command(3, left=number))
        assert [read_packet(port)[0] for _ in range(2)] == [IMAGE, SENSORS]
        assert firmware_of(port.sim).view.speed_setpoint[0] == number


def test_a_program_that_wants_one_of_each_ends_with_an_empty_packet() -> None:
    """As Webots does: an unknown id ends it, and it repeats its last command until the stream is empty."""
    port = port_of(simulation())
    for _ in range(5):
        port.write(command(3, left=100, right=-100))
        found = set[int]()
        while found != {IMAGE, SENSORS}:
            found.add(read_packet(port)[0])
            assert found <= {IMAGE, SENSORS}
    for _ in range(10):
        port.write(command(0, sound=0x20))
        if read_packet(port)[0] == EMPTY:
            return
    raise AssertionError


def test_a_program_that_changes_its_request_skips_packets_that_are_late() -> None:
    """As the test program of Webots does, with the requests 3, 0, 1, 2 and 3."""
    port = port_of(simulation())
    for request, wanted in ((3, {IMAGE, SENSORS}), (0, {EMPTY}), (1, {IMAGE}), (2, {SENSORS}), (3, {IMAGE, SENSORS})):
        found = list[int]()
        for _ in range(10):
            port.write(command(request, left=100, right=100))
            found.append(read_packet(port)[0])
            assert found[-1] in SIZES
        assert set(found[6:]) == wanted


def test_a_program_that_sends_on_changes_alone_reads_on_and_on() -> None:
    """As the monitor does (once, then after a finished packet), and YM, which drains what has arrived."""
    sim = simulation()
    port = port_of(sim)
    port.write(command(2))
    for number in range(100):
        assert read_packet(port)[0] == SENSORS
        if number == 50:
            port.write(command(2, left=30))
    drained = b""
    for _ in range(20):
        sim.run(0.033)
        drained += port.read(port.in_waiting)
    assert set(drained[::105]) == {SENSORS}
    assert len(drained) % 105 == 0
    assert len(drained) // 105 == 33


# ---- laws ----


@settings(max_examples=50)
@given(st.binary(max_size=200), st.lists(st.integers(0, 200), max_size=10))
def test_cuts_make_no_difference_to_the_receiver(data: bytes, cuts: list[int]) -> None:
    whole, pieces = WifiReceiver(), WifiReceiver()
    places = sorted({min(cut, len(data)) for cut in cuts} | {0, len(data)})
    expected, found = whole.feed(data), []
    for begin, end in pairwise(places):
        found += [(begin + index, each) for index, each in pieces.feed(data[begin:end])]
        copied = WifiReceiver()
        copied.partial = pieces.partial
        pieces = copied
    assert found == expected
    assert [index % 21 for index, _ in expected] == [20] * (len(data) // 21)
    assert pieces.partial == whole.partial == data[len(data) // 21 * 21 :]
    assert WifiReceiver.complete_length(data) == (21 if len(data) >= 21 else 0)
    assert (len(data) + len(whole.closing())) % 21 == 0


def run(seed: int, cuts: list[int]) -> bytes:
    """Return what a robot sends for half a second, if commands come in pieces at the same time."""
    port = port_of(simulation(seed), 0.05)
    received = b""
    for number in range(10):
        data = command(2 + number % 2, left=30 * number, right=100, leds=number)
        places = sorted({cut % 22 for cut in cuts} | {0, 21})
        for begin, end in pairwise(places):
            port.write(data[begin:end])
        received += port.read(1 << 16)
    return received


def test_the_same_seed_gives_the_same_bytes_in_any_pieces() -> None:
    once = run(1, [])
    assert once == run(1, []) == run(1, [1, 7, 20]) == run(1, list(range(21)))
    assert once != run(2, [])
    assert len(once) > 10_000


def test_random_bytes_bring_whole_packets_of_the_three_kinds_alone() -> None:
    chance = random.Random(5)
    sim = simulation()
    port = port_of(sim, 0.0)
    port.write(command(2))
    sent_count, received = 21, bytearray()
    while sent_count < 200_000:
        data = bytearray(chance.randbytes(chance.choice((1, 20, 21, 42, 300, 2000))))
        if chance.random() < 0.8:
            for place in range(len(data)):  # for more requests that are answered, and fewer calibrations
                data[place] &= {1: 3, 2: 6}.get((sent_count + place) % 21, 255)
        port.write(bytes(data))
        sent_count += len(data)
        sim.run(chance.choice((0.0, 0.001, 0.03, 0.2)))
        received += port.read(1 << 20)
    port.write(bytes(21 - sent_count % 21) + command(4) * 2)
    sim.run(5.0)
    received += port.read(1 << 20)
    counts = {kind: list(split(bytes(received))).count(kind) for kind in SIZES}
    assert min(counts.values()) > 5
    assert abs(firmware_of(sim).view.speed_setpoint).max() <= 1 << 15


@pytest.mark.parametrize("request_byte", range(4))
def test_without_a_reader_little_is_kept_and_commands_still_act(request_byte: int) -> None:
    sim = simulation()
    port, line = port_of(sim), sim.wires[0].line
    port.write(command(request_byte))
    sim.run(60.0)
    kept = len(line.waiting)
    assert kept <= 6_000 + 2 * sum(SIZES.values())
    assert not line.lost_count
    port.write(command(request_byte, left=40))
    sim.run(0.2)
    assert firmware_of(sim).view.speed_setpoint[0] == 40
    assert len(line.waiting) - kept <= 10
    # What was kept is whole; then the stream goes on.
    first = list(split(port.read(kept)))
    assert read_packet(port)[0] == first[0]


@pytest.mark.parametrize("request_byte", [2, 3])
def test_what_is_read_changes_nothing_in_the_robot(request_byte: int) -> None:
    """So recordings, which have no reads, can be replayed."""
    hashes = []
    for reads in (True, False):
        sim = simulation()
        port = port_of(sim, 0.0)
        for number in range(40):
            port.write(command(request_byte, left=20 * number, right=-30, leds=number) * (number % 7))
            sim.run(0.07)
            if reads:
                port.read(1 << 20)
        hashes.append(sim.state_hash())
    assert hashes[0] == hashes[1]


def test_a_read_of_more_than_the_robot_keeps_ends_with_an_error() -> None:
    port = port_of(simulation(), None)
    port.write(command(2))
    with pytest.raises(kiks.LinkError, match=r"it sends no more of them, so the read would never end"):
        port.read(100_000)


def test_a_copy_goes_on_with_the_same_bytes() -> None:
    sim = simulation()
    port = port_of(sim)
    port.write(command(2, left=300, right=-200, leds=5) + command(2, left=1) * 3 + command(3)[:13])
    read_packet(port)
    other = copy.deepcopy(sim)
    assert other.wires[0].firmware.receiver.partial == command(2, left=1) * 3 + command(3)[:13]
    ports = port, port_of(other)
    results = []
    for each in ports:
        received = b"".join(read_packet(each)[1] for _ in range(5))
        each.write(command(3)[13:])
        received += b"".join(read_packet(each)[1] for _ in range(6))
        results.append((received, each.sim.now_ns, each.sim.state_hash()))
    assert results[0] == results[1]


def test_a_saved_wire_holds_all_commands_that_wait() -> None:
    sim = simulation()
    port_of(sim).write(command(2) * 3)
    sim.run(0.001)
    port_of(sim).write(command(2) * 9 + bytes(20))
    sim.run(0.001)
    saved = sim.wires[0].save()
    assert len(SavedWire(**saved).partial) == 5 * 21 + 20


def test_a_recording_makes_the_same_run_again(tmp_path: Path) -> None:
    sim, received = simulation(3), list[bytes]()
    with sim.record(tmp_path / "run.mcap"):
        for _ in range(2):
            port = port_of(sim, 0.2)
            for number in range(60):
                port.write(command(2 + (number % 9 == 0), left=20 * number, right=300, leds=number))
                if number % 3:
                    kind, content, _ = read_packet(port)
                    received.append(bytes((kind,)) + content)
                if number % 7 == 0:
                    sim.run(0.1)
            port.write(command(2, left=1) * 3)
            port.close()
            sim.run(0.7)
    recording = Recording(tmp_path / "run.mcap")
    check_again(recording, sim.state_hash())
    # The table has them all, but for the zeros at an end, as what robots send is made again.
    wire = recording.table("wire")
    sent = wire["data"][~wire["is_sent"]].tolist()
    assert all(any(packet.rstrip(b"\0") in data for data in sent) for packet in received)


def test_a_served_robot_sends_a_packet_for_each_command_as_in_memory() -> None:
    port = port_of(simulation(7))
    sent = [command(2 + number % 2, left=10 * number, leds=number) for number in range(12)]
    expected = list[tuple[int, bytes]]()
    for data in sent:
        port.write(data)
        expected.append(read_packet(port)[:2])
    endpoint = TcpEndpoint(0)
    with served([endpoint], sim=simulation(7)), connect(endpoint) as client, client.makefile("rb") as stream:
        for data, (kind, content) in zip(sent, expected, strict=True):
            client.sendall(data)
            assert stream.read(1)[0] == kind
            assert stream.read(len(content)) == content


# ---- a kind without lines ----


def test_its_speeds_are_bytes_and_what_needs_lines_says_so() -> None:
    assert EPUCK_WIFI is robot_kind("epuck_wifi")
    assert WIFI_MEMORY.itemsize == REGISTER_BYTES
    assert EPUCK_WIFI.set_speeds(300, -2) == command(4, left=300, right=-2, colours=b"\xff" * 12)
    with pytest.raises(ParameterError, match=r"a batch with a line must have robots that take lines of text"):
        kiks.Batch(kiks.Arena.box(500, 500), 2, robot="epuck2_wifi")
    with pytest.raises(ParameterError, match="the console must have robots that take lines"):
        type_lines(simulation(), 1, "D,5,5")
    with pytest.raises(ParameterError, match="a drive by a controller must have robots that take lines"):
        kiks.drive(simulation().port(1), kiks.controllers.linear(), [0.0] * 18, seconds=1, kind="epuck_wifi")


def test_a_batch_without_a_line_drives_it() -> None:
    @kiks.controller
    def ahead(sensors: Any, memory: Any, parameters: Any, wheels: Any) -> None:
        wheels[:] = 100.0

    timing = kiks.Timing(baud=None)
    batch = kiks.Batch(kiks.Arena.box(500, 500), 2, robot="epuck2_wifi", timing=timing, starts=(250, 250, 0))
    rollouts = batch.run(ahead, seconds=1, measures=[kiks.measures.path_mm])
    assert rollouts.values.min() > 5.0
