"""What commands do to the e-puck, beyond their replies: wheels, LEDs, sounds, zeros and pictures, and its memory."""

import math
import re
import struct

import numpy as np
import pytest
from tests.firmware.epuck.sercom_line import READINGS, VERSIONS, SercomLine

from kiks.engine.state import ROBOT, State
from kiks.errors import ParameterError
from kiks.firmware.epuck.commands import COMMANDS
from kiks.firmware.epuck.firmware import EPuckFirmware
from kiks.firmware.epuck.kind import EPUCK
from kiks.firmware.epuck.personality import PERSONALITIES
from kiks.firmware.epuck.requests import encoded
from kiks.firmware.epuck.robot import CALIBRATION_NS, LOUDNESS_COUNTS, MEMORY, RESET_NS, SOUND_NS
from kiks.model.robot import RobotSpec


def leds(line: SercomLine) -> tuple[list[int], int, int]:
    memory = line.robot.memory
    return memory.ring.tolist(), int(memory.body[0]), int(memory.front[0])


@pytest.mark.parametrize(("version", "count"), [("BT11", 23), ("BT20", 23), ("AS12", 28), ("AS20", 28), ("WF15", 22)])
def test_help_has_the_lines_that_clients_count(version: str, count: int) -> None:
    text = SercomLine(version).send(b"H\n")
    assert text.count(b"\n") == count
    first, *lines, rest = text.decode().split("\n")
    assert (first, rest) == ("", "")
    column = 12 if version.startswith("BT") else 18
    for line in lines:
        assert re.fullmatch(r'"[A-Zbgt](,#)*"[ \t]+\S[ -~]*\r', line)
        # A tabulator goes on to the next place of eight.
        assert re.match(r'"\S+"\s+', line.expandtabs(7 if column == 12 else 8)).end() == column
    assert version not in ("BT11", "BT20") or b'"H"\t     ' in text
    letters = "".join(line[1] for line in lines)
    assert (
        letters
        == {
            "BT11": "ABCDEFGHIJKLMNOPQRSTUV",
            "BT20": "ABCDEFGHIJKLMNOPQRSTUV",
            "AS12": "ABbCDEFGgHIJKLMNOPQRSTtUVWY",
            "AS20": "ABbCDEFGgHIJKLMNOPQRSTtUVWY",
            "WF15": "ABCDEFGHIJKLMNOPQRSUV",
        }[version]
    )


@pytest.mark.parametrize("version", VERSIONS)
def test_speeds_go_to_the_motors_as_they_are(version: str) -> None:
    line = SercomLine(version)
    for data, speeds in (
        (b"D,600,-2000\n", [600, -2000]),
        (b"S\n", [0, 0]),
        (b"\xbc\x2c\x01\xd4\xfe", [300, -300]),
        (b"\0P,5,5\n", [300, -300]),
        (b"D,7\n", [7, -300]),
    ):
        line.send(data)
        assert line.robot.view.speed_setpoint.tolist() == speeds


@pytest.mark.parametrize("version", VERSIONS)
def test_leds(version: str) -> None:
    line = SercomLine(version)
    for data, ring, body, front in (
        (b"L,0,1\nL,7,2\n", [1, 0, 0, 0, 0, 0, 0, 1], 0, 0),
        (b"L,7,-1\nL,0,3\nL,0,9\n", [1, 0, 0, 0, 0, 0, 0, 0], 0, 0),
        (b"L,8,3\n", [1] * 8, 0, 0),
        (b"L,9,2\n", [0] * 8, 0, 0),
        (b"L,-1,1\nB,1\nF,5\n", [1] * 8, 1, 1),
        (b"L,3,0\nB,0\nF,0\n", [1, 1, 1, 0, 1, 1, 1, 1], 0, 0),
        (b"B,2\nB,2\nB,2\n", [1, 1, 1, 0, 1, 1, 1, 1], 1, 0),
        (b"\xb4\x03\x01\xb4\x02\x80\0", [1, 1, 0, 1, 1, 1, 1, 1], 1, 0),
        (b"\xb4\xff\0\0", [0] * 8, 1, 0),
    ):
        assert b"z" not in line.send(data)
        assert leds(line) == (ring, body, front)
    line.send(b"\xb4\x08\x00\xb4\x09\x01\0")
    # The first version has no names for these two.
    assert leds(line) == (([1] * 8, 1, 0) if version == "BT11" else ([0] * 8, 0, 1))
    line.send(b"L,2,1\nB,1\nF,1\nS\n")
    assert leds(line) == (([0] * 8, 0, 0) if version == "WF15" else ([0] * 8, 1, 1))


def test_sounds_last_until_a_time_or_another_number() -> None:
    line = SercomLine()
    view = line.robot.view
    line.wait(5_000)
    for sound in (b"1", b"5", b"3"):
        line.send(b"T," + sound + b"\n")
        assert (view.loudness[0], view.sound_ends_ns[0]) == (LOUDNESS_COUNTS, 5_000 + SOUND_NS)
        line.send(b"T,%d\n" % (6 if sound == b"1" else 0 if sound == b"5" else -1))
        assert (view.loudness[0], view.sound_ends_ns[0]) == (0.0, 0)
    line = SercomLine("AS20")
    for bits, is_on in ((0x01, True), (0, True), (0x10, True), (0x20, False), (0x04, True), (0x24, False)):
        line.send(b"\xf7" + bytes(18) + bytes((bits,)))
        assert (line.robot.view.loudness[0] > 0) == is_on


@pytest.mark.parametrize("version", VERSIONS)
def test_a_calibration_takes_the_mean_of_its_time(version: str) -> None:
    line = SercomLine(version)
    robot, shows = line.robot, version != "BT20"
    assert robot.busy_ns(b"K") == robot.busy_ns(b"kxyz") == CALIBRATION_NS
    assert robot.execute(b"K", 0) == b"k, Starting calibration - Remove any object in sensors range\r\n"
    assert leds(line)[0] == [int(shows)] * 8
    wakes = []
    while (wakes_ns := robot.wakes_ns) is not None:
        wakes.append(wakes_ns)
        line.readings["proximity"] = tuple(100 * each + len(wakes) for each in range(8))
        answer = robot.wake(wakes_ns)
        assert answer == (b"k, Calibration finished\r\n" if wakes_ns == CALIBRATION_NS else b"")
    assert wakes == list(range(CALIBRATION_NS // 100, CALIBRATION_NS + 1, CALIBRATION_NS // 100))
    # The mean of 1 to 100 is 50.5; a division of C drops what is behind the point.
    assert robot.memory.zero.tolist() == [100 * each + 50 for each in range(8)]
    assert leds(line)[0] == [0] * 8


@pytest.mark.parametrize("version", VERSIONS)
def test_a_reset_clears_all_but_the_selector(version: str) -> None:
    line = SercomLine(version)
    robot = line.robot
    assert robot.selector == 3
    robot.selector = 9
    before = line.state.hash()
    line.readings["positions"] = (70, -70)
    line.send(b"D,5,6\nB,1\nF,1\nL,2,1\nT,1\nP,3,4\nJ,0,8,8,8\nK\nX,2\nW,1,2,3\n")
    changed = line.state.hash()
    assert changed != before
    if version == "AS20":
        assert robot.busy_ns(b"R") == 0
        assert line.send(b"R\n") == b""
        assert line.state.hash() == changed
        return
    assert robot.busy_ns(b"R") == RESET_NS
    text = line.send(b"R\n")
    assert (b"\rSelector pos 9\r\n" in text) == (version == "AS12")
    assert line.send(b"Q\nC\nE\nI\n") == b"q,0,0\r\nc,9\r\ne,0,0\r\ni,1,40,40,8,3200\r\n"
    line.readings["positions"] = (0, 0)
    line.send(b"P,0,0\n")
    assert line.state.hash() == before


def test_the_start_text_comes_half_a_second_after_the_reply() -> None:
    robot = SercomLine("BT11").robot
    assert robot.execute(b"r", 7) == b"r\r"
    assert robot.wakes_ns == 7 + RESET_NS
    assert robot.wake(7 + RESET_NS).endswith(b'the EPFL education robot type "H" for help\r\n')
    assert robot.wakes_ns is None
    assert robot.wake(8 + RESET_NS) == b""


def test_the_acceleration_as_magnitude_and_angles() -> None:
    line = SercomLine()
    for reading, expected in (
        ((0, 0, 768), (768, 0, 0)),
        ((0, 60, 768), (math.hypot(60, 768), 0, 4.4672)),  # below 5 degrees
        ((768, 0, 0), (768, 270, 90)),
        ((0, 768, 0), (768, 180, 90)),
        ((0, -768, 768), (math.hypot(768, 768), 360, 45)),
        ((0, 0, -768), (768, 0, 180)),
        ((0, 0, 0), (0, 0, 0)),
    ):
        line.readings["accelerometer"] = reading
        assert struct.unpack("<fff", line.send(b"\xbf\0")) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("version", ["BT11", "BT20", "AS12", "WF15"])
def test_samples_of_sound_come_before_what_was_asked_earlier(version: str) -> None:
    line = SercomLine(version)
    answer = line.send(b"\xaf\xab\xbb\0")
    assert len(answer) == 600 + 4 + 1 + 4
    assert answer[600:] == bytes(4) + bytes((99,)) + bytes(4)
    samples = np.frombuffer(answer[:600], "<i2").reshape(3, 100)
    assert np.ptp(samples, axis=1).tolist() == list(READINGS["microphones"])


def test_pictures_are_cut_out_of_the_sensor() -> None:
    windows = []

    def picture(window: tuple[int, ...]) -> np.ndarray:
        windows.append(tuple(window))
        return np.zeros((window[3], window[2], 3), np.uint8)

    for version in VERSIONS:
        line = SercomLine(version)
        line.robot.picture = picture
        windows.clear()
        line.send(b"\xb7\0")
        for numbers in (b"0,8,4,8", b"0,8,4,8,10,20", b"0,8,4,8,-10,20", b"0,8,4,1,700,470", b"1,8,4,2,7"):
            assert line.send(b"J," + numbers + b"\n\xb7\0").startswith(b"j\r\n")
        start, first, *placed = windows
        assert start == (160, 80, 40, 40, 8)
        assert first == (288, 224, 8, 4, 8)
        if version in ("BT11", "BT20"):
            assert placed == [first, first, (316, 238, 8, 4, 1), (312, 236, 8, 4, 2)]
        else:
            assert placed == [(10, 20, 8, 4, 8), (0, 20, 8, 4, 8), (632, 470, 8, 4, 1), (7, 236, 8, 4, 2)]


@pytest.mark.parametrize("version", VERSIONS)
def test_no_picture_is_larger_than_the_sensor_or_the_buffer(version: str) -> None:
    line = SercomLine(version)
    limit = PERSONALITIES[version].picture_bytes
    width, height = PERSONALITIES[version].picture_size
    for numbers in (
        *(b"0,81,10,8", b"0,10,61,8", b"0,0,10,1", b"0,10,-1,1", b"0,10,10,0", b"0,-10,-10,1", b"0,10,10,-8"),
        *(b"0,640,480,1", b"1,300,200,2", b"2,32767,32767,1", b"0,-32768,-32768,-1", b"0,1,1,32767"),
    ):
        assert line.send(b"J," + numbers + b"\n") == b"j\r\n"
        mode, *size, zoom, length = map(int, line.send(b"I\n").split(b",")[1:])
        assert (mode, size, zoom) == (1, [width, height], zoom if zoom in (1, 2) else 8)
        assert len(line.send(b"\xb7\0")) == 3 + length
    # The largest of one row or column.
    for numbers in (b"0,640,3,1", b"0,2,480,1", b"1,320,3,2", b"2,4,120,4"):
        line.send(b"J," + numbers + b"\n")
        size = int(line.send(b"I\n").split(b",")[5])
        assert size == np.prod([int(each) for each in numbers.split(b",")[1:3]]) * (1 if numbers[:1] == b"0" else 2)
        assert size <= limit
    # A block of many pictures ends; what sets something behind it acts.
    line.send(b"J,1,52,39,8\n")
    answer = line.send(b"\xb7" * 200 + b"\xbc\1\0\2\0\0")
    assert len(answer) <= 65_536 + 3 + max(limit, 2 * width * height)
    assert line.send(b"E\n") == b"e,1,2\r\n"


def test_pixels() -> None:
    pixels = np.array([[[255, 255, 255], [0, 0, 0]], [[255, 0, 0], [0, 0, 255]]], np.uint8)
    assert list(encoded(pixels, 0)) == [255, 0, 76, 28]
    assert encoded(pixels, 1) == b"\xff\xff\0\0\xf8\0\0\x1f"
    assert encoded(pixels, 7) == encoded(pixels, 1)
    assert list(encoded(pixels, 2)) == [255, 128, 0, 128, 76, 85, 28, 107]
    green = np.array([[[0, 255, 0]], [[0, 4, 0]]], np.uint8)
    assert encoded(green, 1) == b"\x07\xe0\x00\x20"
    # Every picture comes out in the colours that went in, but for the bits that are dropped.
    random = np.random.default_rng(1).integers(0, 256, (5, 7, 3)).astype(np.uint8)
    words = np.frombuffer(encoded(random, 1), ">u2").reshape(5, 7)
    bits = np.stack((words >> 11, words >> 5 & 63, words & 31), axis=2)
    assert (bits == random >> (3, 2, 3)).all()


def test_colours_of_the_second_e_puck() -> None:
    line = SercomLine("AS20")
    line.send(b"\xf7\0\0\0\0\0\x35" + bytes((1, 2, 3, 0, 0, 0, 100, 0, 0, 0, 0, 0)) + b"\0")
    assert leds(line) == ([1, 1, 0, 0, 1, 1, 0, 0], 1, 1)
    line.send(b"\xf6" + bytes((101, 255, 4, 0, 0, 0, 0, 0, 0, 0, 0, 50)))
    assert line.robot.memory.colours.tolist() == [1, 2, 4, 0, 0, 0, 0, 0, 0, 0, 0, 50]
    assert leds(line)[0] == [1, 1, 0, 0, 1, 0, 0, 1]


def test_the_memory_is_in_the_record() -> None:
    assert MEMORY.itemsize == ROBOT["registers"].itemsize
    line = SercomLine()
    line.send(b"D,5,6\nK\nL,3,1\nJ,1,20,20,8\n")
    snapshot, output = line.state.snapshot(), line.send(b"E\nN\nI\n")
    line.send(b"D,7,8\nR\n")
    line.state.restore(snapshot)
    assert line.send(b"E\nN\nI\n") == output
    other = State.empty(world_count=1, robot_count=1)
    line.robot.take(other)
    assert line.send(b"E\n") == b"e,0,0\r\n"


def test_each_robot_of_a_world_has_its_own_memory() -> None:
    state = State.empty(world_count=1, robot_count=3)
    spec = RobotSpec.load("khepera").with_changes(firmware__protocol_version="AS12")
    robots = [EPuckFirmware(spec, state, number, lambda name: list(READINGS[name])) for number in range(3)]
    for number, robot in enumerate(robots):
        robot.execute(b"D,%d,9" % number, 0)
    assert [robot.execute(b"E", 0) for robot in robots] == [b"e,%d,9\r\n" % number for number in range(3)]
    assert state.robots["registers"].view(MEMORY)[0]["D"][:, 0].tolist() == [[0, 9], [1, 9], [2, 9]]


def test_a_version_that_is_unknown_is_refused() -> None:
    spec = RobotSpec.load("khepera").with_changes(firmware__protocol_version="AS13")
    with pytest.raises(ParameterError, match=r"protocol_version must be one of .*'AS12'.*, but it was 'AS13'"):
        EPuckFirmware(spec, State.empty(world_count=1, robot_count=1), 0, lambda name: [])


def test_the_kind_and_its_table() -> None:
    line = SercomLine()
    assert line.send(EPUCK.set_speeds(5, -5)) == EPUCK.speeds_reply
    assert line.send(EPUCK.stop + b"E\n") == EPUCK.speeds_reply + b"e,0,0\r\n"
    for row in COMMANDS:
        assert row.name
        assert re.match(r"[A-Zbgt](,|:)", row.help)
    assert EPUCK.sensor_names[:5] == ("right 17", "right 50", "right 90", "right 150", "left 150")
    for sense, letter in EPUCK.senses.items():
        # Every other personality has the same letter for a sense.
        for version in VERSIONS:
            reply = SercomLine(version).send(letter.encode() + b"\n")
            assert reply.count(b",") in (len(READINGS[sense]), 3)
