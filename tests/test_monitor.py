"""Monitoring a robot: the samples, the log and the command."""

import csv
import errno
import importlib
import io
from pathlib import Path

import pytest
import typer
from click.testing import Result
from rich.console import Console
from typer.testing import CliRunner

import kiks

command = importlib.import_module("kiks.cli.monitor")  # `kiks.cli.monitor` itself is the function
app = typer.Typer()
app.command()(command.monitor)


@pytest.fixture
def robot() -> kiks.Khepera:
    sim = kiks.Simulation(kiks.Arena.box(300, 1000), seed=2)
    sim.place(1, 150.0, 960.0, 1.57)
    return kiks.Khepera(sim.port(1))


def run(*words: object) -> Result:
    return CliRunner().invoke(app, ["--port", *map(str, words)])


def test_samples_hold_everything_at_the_rate_that_was_asked_for(robot: kiks.Khepera) -> None:
    robot.set_speed(5, -5)
    taken = list(command.samples(robot, 4.0, 2.0))
    assert [sample.time_s for sample in taken] == pytest.approx([0.25 * index for index in range(8)], abs=0.01)
    last = taken[-1]
    assert max(last.proximity) > 500
    assert all(400 < light < 500 for light in last.ambient)
    assert last.encoders == pytest.approx((850, -850), abs=60)
    assert last.speed == pytest.approx((5, -5), abs=1)
    assert [motor.mode for motor in last.status] == [0, 0]


def test_wrong_numbers_and_a_robot_that_is_not_there_are_named() -> None:
    assert "rate must be from 0.01 to 100, but it was 0" in str(run("kiks://1", "--rate", "0").exception)
    assert "seconds must be from 0.001 to 1" in str(run("kiks://1", "--seconds", "-1").exception)
    assert isinstance(run("/dev/ttyNOWHERE").exception, kiks.LinkError)


def test_the_picture_shows_each_reading_at_its_place(robot: kiks.Khepera) -> None:
    sample = next(command.samples(robot, 10.0, None))
    sample = sample._replace(proximity=[11, 122, 233, 344, 455, 566, 677, 788])
    for width in (100, 60):
        file = io.StringIO()
        Console(file=file, width=width).print(command.picture(sample, 6.5, "a port", width))
        lines = file.getvalue().splitlines()

        def line_of(number: int) -> int:
            return next(index for index, line in enumerate(lines) if str(number) in line.split())  # noqa: B023

        assert line_of(233) == line_of(344) < line_of(122) == line_of(455) < line_of(566) < line_of(677) == line_of(788)
        for number in sample.ambient:
            assert str(number) in file.getvalue().split()
        assert "6.5 samples per second" in file.getvalue()
        assert "…" not in file.getvalue()


def test_the_command_prints_and_logs_rows_where_there_is_no_terminal(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    sim = kiks.Simulation(seed=1)
    result = run(sim.url(1), "--rate", 5, "--seconds", 0.6, "--csv", path)
    assert result.exit_code == 0, result.output
    assert result.stdout == path.read_text()
    assert "BIOS 5.02" in result.stderr
    assert "3 samples, 5.0 per second at the end, in " in result.stderr
    rows = list(csv.DictReader(result.stdout.splitlines()))
    assert len(rows) == 3
    assert len(rows[0]) == 27
    assert [rows[0][f"proximity_{sensor}_counts"] for sensor in range(8)] == ["8", "0", "0", "0", "5", "0", "6", "7"]
    assert 400 < int(rows[0]["ambient_7_counts"]) < 500
    assert (rows[0]["left_pulses"], rows[0]["right_mode"]) == ("0", "0")
    again = run(sim.url(1), "--csv", path)
    assert "the log must go to a file that can be written" in str(again.exception)
    assert result.stdout == path.read_text(), "a log never replaces a file"


def test_a_slow_line_gives_what_it_can_and_logs_each_sample_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, counts = tmp_path / "log.csv", []
    monkeypatch.setattr(command, "_pacer", lambda _: lambda: counts.append(len(path.read_text().splitlines())))
    sim = kiks.Simulation(seed=1)
    result = run(sim.url(1), "--rate", 100, "--seconds", 2, "--csv", path)
    assert counts == list(range(2, 2 + len(counts)))
    rate_hz = float(result.stderr.split("samples, ")[1].split()[0])
    assert 5 < rate_hz < 10
    assert rate_hz == pytest.approx(len(counts) / 2, abs=0.5)


def test_a_log_says_that_its_disk_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("builtins.open", lambda *_, **kept: io.open("/dev/full", "w", **kept))  # noqa: UP020, SIM115
    sim = kiks.Simulation()
    result = run(sim.url(1), "--csv", "log.csv")
    assert "'log.csv' cannot (No space left on device)" in str(result.exception)


def test_ctrl_c_ends_cleanly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.csv"
    sim = kiks.Simulation(seed=1)

    def wait() -> None:
        if len(path.read_text().splitlines()) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(command, "_pacer", lambda _: wait)
    result = run(sim.url(1), "--csv", path)
    assert result.exit_code == 0
    assert "2 samples" in result.output
    sim.port(1).claim("the next one")


def test_the_log_is_not_blamed_for_a_reader_that_has_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def gone() -> None:
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")

    sim = kiks.Simulation(seed=1)
    monkeypatch.setattr(command, "_pacer", lambda robot: gone)
    assert "the log" not in str(run(sim.url(1), "--csv", tmp_path / "log.csv").exception)
