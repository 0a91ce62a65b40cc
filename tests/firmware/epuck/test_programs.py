"""Whole programs as strangers have them for real e-pucks, under `kiks run`: they work, and the same by any way."""

import re
from pathlib import Path

import pytest
from tests.served import PROGRAMS

import kiks
from kiks.script.runner import run_here

ARENA = kiks.Arena.box(600, 400)
"""The robot begins 300 mm from the wall ahead of it."""

WAYS = ("serial", "bluetooth", "tcp")

CLIENTS = {
    "pyepuck of Webots' program": ("epuck_wf15", "pyepuck", ["6"]),
    "pyepuck of GCtronic": ("epuck", "pyepuck", ["10"]),
    "epuck_driver_cpp": ("epuck", "driver", []),
    "ePic2": ("epuck_bt20", "epic2", []),
    "Webots": ("epuck_wf15", "webots", []),
    "Elib": ("epuck_bt11", "elib", []),
}
"""Robot, program and its arguments after the way, by the client (epuck-protocol.md 7)."""

WIFI = ("unifr", "threads", "monitor")


def ran(
    robot: str, name: str, arguments: list[str], capfd: pytest.CaptureFixture[str], robots: int = 1, link: str = ""
) -> tuple[str, str]:
    """Return what a program has printed, and the hash of the world at its end."""
    sim = kiks.Simulation(ARENA, robot=robot, robots=robots, seed=3, **({"link": link} if link else {}))
    code = run_here(sim, PROGRAMS / f"epuck_{name}.py", arguments, {})
    out, err = capfd.readouterr()
    assert code == 0, err
    return out, sim.state_hash()


def numbers_after(word: str, out: str) -> list[int]:
    found = re.search(rf"^{word} (.*)$", out, re.MULTILINE)
    assert found is not None, out
    return [int(number) for number in found[1].split()]


@pytest.mark.parametrize("client", CLIENTS)
def test_a_program_for_a_line_does_the_same_twice_and_by_any_way(
    client: str, capfd: pytest.CaptureFixture[str]
) -> None:
    robot, name, arguments = CLIENTS[client]
    runs = {way: [ran(robot, name, [way, *arguments], capfd) for _ in range(2)] for way in WAYS}
    for once, again in runs.values():
        assert once == again
    # A socket gets replies whole and a serial port by character: a microsecond less, and other microphone noise.
    assert runs["bluetooth"] == runs["tcp"]
    assert len({hash for (_, hash), _ in runs.values()}) == 1
