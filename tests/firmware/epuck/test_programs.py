"""Whole programs as strangers have them for real e-pucks, under `kiks run`: they work, and the same by any way."""

import re
import sys

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

WIFI = ("wifi_unifr", "wifi_threads", "wifi_monitor")


def ran(
    robot: str, name: str, arguments: list[str], capfd: pytest.CaptureFixture[str], robots: int = 1, link: str = ""
) -> tuple[str, str]:
    """Return what a program has printed, and the hash of the world at its end."""
    sim = kiks.Simulation(ARENA, robot=robot, robots=robots, seed=3, **({"link": link} if link else {}))
    sys.modules.pop("epuck_line", None)  # a run has its own `bluetooth`
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
    assert len({state for (_, state), _ in runs.values()}) == 1


def test_what_programs_for_a_line_see_makes_sense(capfd: pytest.CaptureFixture[str]) -> None:
    out, _ = ran("epuck_wf15", "pyepuck", ["bluetooth", "6"], capfd, link="bluetooth")
    # It drives until the wall is near, which its counters, its sensors in front and its floor agree on.
    assert out.startswith("connected\nv,Version 1.5.3 November 2016 (Webots)")
    proximity, steps = numbers_after("proximity", out), numbers_after("steps", out)
    assert min(proximity[0], proximity[7]) > 600 > 100 > max(proximity[2:6])
    assert steps[0] == steps[1] > 500
    assert min(numbers_after("floor", out)) > 950
    assert "\n0 40 20 800 " in out
    assert out.endswith("b'c,3\\r\\n'\nb's\\r\\n'\n")
    out, _ = ran("epuck", "driver", ["tcp"], capfd)
    assert out.splitlines()[:3] == [
        "b''",
        r"b'v,Version 1.2.2 August 2008 GCtronic\r\nHW version: FFFF\r\n'",
        r"b'j\r\n'",
    ]
    near, *_ = out.splitlines()[-1].split()
    assert int(near) > 500
    out, _ = ran("epuck_bt11", "elib", ["serial"], capfd)
    assert "(0, 20, 20) 400\n" in out


def test_a_plain_script_reads_as_pyserial_can(capfd: pytest.CaptureFixture[str]) -> None:
    out, _ = once = ran("epuck", "plain", [], capfd)
    assert once == ran("epuck", "plain", [], capfd)
    turned = [int(line.split(",")[1]) for line in out.splitlines() if " q," in line]
    assert len(turned) == 5
    assert sorted(turned) == turned
    assert "(1, 40, 30) 2403 (30, 40, 3)" in out
    assert "b'k, Calibration finished\\r\\n'" in out


@pytest.mark.parametrize("name", WIFI)
@pytest.mark.parametrize("link", ["", "wifi"])
def test_a_program_for_the_radio_does_the_same_twice(name: str, link: str, capfd: pytest.CaptureFixture[str]) -> None:
    robots = 2 if name == "wifi_threads" else 1
    out, _ = once = ran("epuck2_wifi", name, [], capfd, robots, link)
    assert once == ran("epuck2_wifi", name, [], capfd, robots, link)
    if name == "wifi_unifr":
        zeros, driven, *_ = out.splitlines()
        assert all(10 < int(zero) < 60 for zero in re.findall(r"\d+", zeros[: zeros.index("]")]))
        nearest, left, right = map(int, re.findall(r"-?\d+", driven)[:3])
        assert nearest >= 100
        assert left > right > 1000  # it turned to the right at the wall
        assert out.splitlines()[-1].startswith("3 ") or int(out.splitlines()[-1].split()[0]) < 20
    elif name == "wifi_threads":
        assert [line.split()[:2] for line in out.splitlines()[:2]] == [[f"192.168.1.{host}", "1"] for host in (20, 21)]
        assert "unexpected" not in out
    else:
        assert out.startswith("silent before the first command")
        assert "[1, 2, 1, 2, 1, 2, 1, 2, 1]" in out
        assert "3 [3, 3, 3]" in out
        assert "2 (1000, -1000) True" in out
