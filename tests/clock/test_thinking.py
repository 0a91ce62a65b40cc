"""Thinking time: the cost of the program's own computing."""

from collections.abc import Callable
from pathlib import Path

import pytest

import kiks
from kiks.clock.thinking import ThinkingLive, parse_thinking, save_thinking


def course(sim: kiks.Simulation, loops: int = 40) -> str:
    robot = kiks.Khepera(sim.port(1))
    for _ in range(loops):
        readings = robot.proximity()
        robot.set_speed(8 - readings[3] / 60, 8 - readings[2] / 60)
    robot.close()
    return sim.state_hash()


def test_fixed_thinking_is_added_before_each_command() -> None:
    times = []
    for thinking in ("none", "fixed:0", "fixed:2.5"):
        sim = kiks.Simulation(thinking=thinking)
        robot = kiks.Khepera(sim.port(1))
        for _ in range(10):
            robot.stop()
        times.append(sim.time_s)
    assert times[0] == times[1]
    assert times[2] - times[0] == pytest.approx(10 * 0.0025, abs=1e-12)


def test_burst_of_commands_costs_one_thinking_time() -> None:
    sim = kiks.Simulation(thinking="fixed:5")
    port = sim.port(1)
    for piece in (b"N\n", b"H", b"\n"):
        port.write(piece)
    port.readline()
    port.readline()
    quick = kiks.Simulation()
    same = quick.port(1)
    same.write(b"N\nH\n")
    same.readline()
    same.readline()
    assert sim.time_s - quick.time_s == pytest.approx(0.005, abs=1e-12)


def thinking_s(course: Callable[[list[kiks.Khepera]], None]) -> float:
    """Return how long a program of three robots has thought in all [s]."""
    times = []
    for thinking in ("fixed:5", "none"):
        sim = kiks.Simulation(robots=3, thinking=thinking)
        course([kiks.Khepera(sim.port(number)) for number in (1, 2, 3)])
        times.append(sim.time_s)
    return times[0] - times[1]


def test_commands_to_several_robots_follow_from_one_thought() -> None:
    def all_at_once(robots: list[kiks.Khepera]) -> None:
        for robot in robots:
            robot.port.write(b"D,3,3\n")
        for robot in robots:
            robot.read_confirmation(b"D")

    def leader_first(robots: list[kiks.Khepera]) -> None:
        robots[0].speed()
        all_at_once(robots)

    def one_by_one(robots: list[kiks.Khepera]) -> None:
        for robot in robots:
            robot.set_speed(3, 3)

    for course, thoughts in ((all_at_once, 1), (leader_first, 2), (one_by_one, 3)):
        assert thinking_s(course) == pytest.approx(thoughts * 0.005, abs=1e-12)


def test_live_thinking_charges_measured_time_and_replay_repeats_it(tmp_path: Path) -> None:
    live = kiks.Simulation(thinking="live:3", seed=5)
    state = course(live)
    measured = live.program.measured_ns
    assert len(measured) > 40
    assert sum(measured) > 0
    save_thinking(measured, tmp_path / "times.txt")
    replay = kiks.Simulation(thinking=f"replay:{tmp_path / 'times.txt'}", seed=5)
    assert (course(replay), replay.now_ns) == (state, live.now_ns)


def test_factor_zero_costs_nothing() -> None:
    policy = ThinkingLive(0.0)
    policy.leave()
    assert policy.enter(is_command=True) == 0


def test_errors_name_the_rule_and_the_value() -> None:
    for text, words in (
        ("fixed", "milliseconds from 0"),
        ("fixed:-1", "'fixed:-1'"),
        ("live:nan", "a factor from 0"),
        ("replay:", "must be 'none'"),
        ("replay:/no/such/file", "must exist, but there is no such file"),
    ):
        with pytest.raises(kiks.ParameterError, match="must") as caught:
            parse_thinking(text)
        assert words in str(caught.value)


def test_error_gives_the_number_of_a_bad_replay_line_but_not_its_text(tmp_path: Path) -> None:
    for line in ("hunter2", "-1", "1.5", "1" * 19, "1" * 5000, "\u0663", "\u00b2", "", "1 2", "\0", "nan"):
        path = tmp_path / "times.txt"
        path.write_text(f"100\n{line}\n7\n", encoding="utf-8")
        with pytest.raises(kiks.ParameterError, match=r"line 2, must be a whole number of ns") as caught:
            parse_thinking(f"replay:{path}")
        assert str(caught.value).replace(str(path), "") == (
            "replay file '', line 2, must be a whole number of ns of at most 13 digits, but it is something else. "
            "Record a run again with thinking 'live'."
        )
