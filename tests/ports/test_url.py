"""Simulated ports by name, opened by pyserial."""

from __future__ import annotations

from pathlib import Path

import pytest
import serial

import kiks

ARENAS = Path(__file__).parents[2] / "examples" / "arenas"


def test_number_alone_means_the_newest_simulation() -> None:
    older, newer = kiks.Simulation(), kiks.Simulation()
    for url, sim in (("kiks://1", newer), (older.url(1), older)):
        port = serial.serial_for_url(url, timeout=1)
        port.write(b"L,0,1\n")
        port.readline()
        port.close()
        assert sim.time_s > 0


def test_options_create_a_simulation() -> None:
    url = f"kiks://2?arena={ARENAS / 'maze.toml'}&robots=2&seed=7&thinking=fixed:1&robot=khepera_ii"
    with serial.serial_for_url(url, timeout=1) as port:
        port.write(b"B\n")
        assert port.readline() == b"b,6.01,6.01\r\n"


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("kiks://", "must be named like 'kiks://1'"),
        ("kiks://one", "must be named like 'kiks://1'"),
        ("kiks://9", "names robot 9 and the simulation has robot 1 only"),
        ("kiks://nowhere/1", "a simulation's name must be one that is alive"),
        ("kiks://1?sead=3", "Did you mean 'seed'"),
        ("kiks://1?seed=x", "must be a whole number, but it was 'x'"),
        ("kiks://1?arena=/no/where.toml", "/no/where.toml"),
        ("kiks://1?robot=kephera", "Did you mean 'khepera'"),
    ],
)
def test_errors_explain_bad_names(url: str, words: str) -> None:
    sim = kiks.Simulation()
    with pytest.raises(serial.SerialException) as caught:
        serial.serial_for_url(url)
    assert words in str(caught.value)
    assert sim.robot_count == 1
