"""The port in memory, and simulated ports by name: the bytes and times that a program sees."""

import threading
from pathlib import Path

import pytest
import serial
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.at_length import share

import kiks
from kiks.clock.serial_timing import OUTPUT_LIMIT
from kiks.units import character_ns


def test_exchange_takes_the_time_of_its_characters_plus_one_millisecond() -> None:
    sim = kiks.Simulation()
    port = sim.port(1)
    for baud in (9600, 38400, 115200):
        port.baudrate = baud
        start_ns = sim.now_ns
        port.write(b"H\n")
        reply = port.readline()
        assert sim.now_ns - start_ns == (2 + len(reply)) * character_ns(baud) + 1_000_000


def test_read_without_end_raises() -> None:
    port = kiks.Simulation().port(1)
    with pytest.raises(kiks.LinkError, match=r"robot 1 must have been asked.*would never end.*set a timeout"):
        port.read(1)


def test_polling_lets_time_pass() -> None:
    sim = kiks.Simulation()
    port = sim.port(1)
    port.timeout = 0
    for question in (lambda: port.in_waiting, lambda: port.read(1), lambda: port.time_s):
        before_ns = sim.now_ns
        for _ in range(30):
            question()
        assert sim.now_ns > before_ns + 10_000_000


def test_robot_has_one_client() -> None:
    sim = kiks.Simulation()
    first = kiks.Khepera(sim.url(1))
    with pytest.raises(kiks.LinkError, match=r"must be free to be opened, but robot 1 is in use by the program that"):
        kiks.Khepera(sim.url(1))
    sim.port(1).close()  # this port does not hold the line
    with pytest.raises(kiks.LinkError, match="must be free"):
        kiks.kopen([-1, 9600, 1])
    first.close()
    kiks.Khepera(sim.url(1)).stop()


def test_a_closed_port_says_so() -> None:
    sim = kiks.Simulation()
    port = sim.port(1)
    assert sim.port(1) is port
    port.close()
    port.close()
    for use in (
        lambda: port.write(b"N\n"),
        port.readline,
        lambda: port.in_waiting,
        port.reset_input_buffer,
        lambda: port.baudrate,
        lambda: port.time_s,
        lambda: port.sleep(1.0),
    ):
        with pytest.raises(kiks.LinkError, match=r"a port must be open to be used, but this one is closed"):
            use()
    assert (sim.time_s, sim.port(1).write(b"N\n")) == (0.0, 2)


def test_close_drops_unread_replies_and_the_robot_drives_on() -> None:
    sim = kiks.Simulation(kiks.Arena.box(1000, 1000))
    port = sim.port(1)
    port.write(b"D,5,5\nN\nH")
    sim.run(0.5)
    port.close()
    begin = sim.pose(1)
    sim.run(1.0)
    assert sim.pose(1)[1] - begin[1] == pytest.approx(40, abs=2)
    port = sim.port(1)
    port.timeout = 1.0
    port.write(b"\nE\n")
    assert (port.readline(), port.read(1)) == (b"e,5,5\r\n", b"")


def test_unread_output_is_limited() -> None:
    sim = kiks.Simulation()
    port = sim.port(1)
    port.baudrate = 4_000_000
    for _ in range(20):
        port.write(b"list\n" * 500)
        sim.run(10.0)
    line = sim.wires[0].line
    assert len(line.waiting) <= OUTPUT_LIMIT
    assert line.lost_count > 0


@pytest.mark.slow
@settings(max_examples=share(10, 30))
@given(st.lists(st.integers(1, 7), min_size=1, max_size=20), st.integers(1, 5))
def test_reading_in_any_pieces_gives_the_same_bytes_at_the_same_time(pieces: list[int], commands: int) -> None:
    whole, parts = kiks.Simulation().port(1), kiks.Simulation().port(1)
    for port in (whole, parts):
        port.timeout = 1.0
        port.write(b"H\n" * commands)
    expected = b"".join(whole.readline() for _ in range(commands))
    got = b""
    while len(got) < len(expected):
        got += parts.read(min(pieces[len(got) % len(pieces)], len(expected) - len(got)))
    assert got == expected
    assert parts.sim.now_ns == whole.sim.now_ns


def test_two_threads_may_drive_at_the_same_time() -> None:
    sim = kiks.Simulation(robots=2)

    def drive(number: int) -> None:
        robot = kiks.Khepera(sim.port(number))
        for _ in range(200):
            robot.set_speed(number, number)
            assert len(robot.proximity()) == 8

    threads = [threading.Thread(target=drive, args=(number,)) for number in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sim.time_s > 1


def test_number_alone_means_the_newest_simulation() -> None:
    older, newer = kiks.Simulation(), kiks.Simulation()
    for url, sim in (("kiks://1", newer), (older.url(1), older)):
        port = serial.serial_for_url(url, timeout=1)
        port.write(b"L,0,1\n")
        port.readline()
        port.close()
        assert sim.time_s > 0


def test_options_create_a_simulation() -> None:
    maze = Path(__file__).parents[2] / "examples" / "arenas" / "maze.toml"
    url = f"kiks://2?arena={maze}&robots=2&seed=7&thinking=fixed:1&robot=khepera_ii"
    with serial.serial_for_url(url, timeout=1) as port:
        port.write(b"B\n")
        assert port.readline() == b"b,6.01,6.01\r\n"


def test_errors_explain_bad_names() -> None:
    for url, words in (
        ("kiks://", "must be named like 'kiks://1'"),
        ("kiks://one", "must be named like 'kiks://1'"),
        ("kiks://9", "names robot 9 and the simulation has robot 1 only"),
        ("kiks://nowhere/1", "a simulation's name must be one that is alive"),
        ("kiks://1?seed=x", "must be a whole number, but it was 'x'"),
        ("kiks://1?arena=/no/where.toml", "/no/where.toml"),
        ("kiks://1?robot=kephera", "Did you mean 'khepera'"),
    ):
        sim = kiks.Simulation()
        with pytest.raises(serial.SerialException) as caught:
            serial.serial_for_url(url)
        assert words in str(caught.value)
        assert sim.robot_count == 1
