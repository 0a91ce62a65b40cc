"""Monitoring a robot: the samples, the log and the command."""

from __future__ import annotations

import csv
import importlib
import io
from pathlib import Path

import pytest
import typer
from rich.console import Console
from typer.testing import CliRunner

import kiks
from kiks.client.monitor import COLUMNS, CsvLog, RateMeter, Sample, logged, samples

app = typer.Typer()
command = importlib.import_module("kiks.cli.monitor")  # `kiks.cli.monitor` itself is the function
app.command()(command.monitor)


@pytest.fixture
def robot() -> kiks.Khepera:
    sim = kiks.Simulation(kiks.Arena.box(300, 1000), seed=2)
    sim.place(1, 150.0, 960.0, 1.57)
    return kiks.Khepera(sim.port(1))


def test_samples_hold_everything_at_the_rate_that_was_asked_for(robot: kiks.Khepera) -> None:
    robot.set_speed(5, -5)
    taken = list(samples(robot, rate_hz=4, seconds=2.0))
    assert [sample.time_s for sample in taken] == pytest.approx([0.25 * index for index in range(8)], abs=0.01)
    last = taken[-1]
    assert max(last.proximity) > 500
    assert all(400 < light < 500 for light in last.ambient)
    assert last.encoders == pytest.approx((850, -850), abs=60)
    assert last.speed == pytest.approx((5, -5), abs=1)
    assert [motor.mode for motor in last.status] == [0, 0]


def test_a_slow_line_gives_what_it_can(robot: kiks.Khepera) -> None:
    taken = list(samples(robot, rate_hz=100, seconds=2.0))
    meter = RateMeter()
    rates = [meter.note(sample.time_s) for sample in taken]
    assert rates[0] == 0.0
    assert 5 < rates[-1] < 10
    assert rates[-1] == pytest.approx(len(taken) / 2, abs=0.5)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"rate_hz": 0}, "rate_hz must be from 0.01 to 100, but it was 0"),
        ({"seconds": -1.0}, "seconds must be from 0.001 to 1"),
    ],
)
def test_wrong_numbers_are_named(robot: kiks.Khepera, settings: dict[str, float], words: str) -> None:
    with pytest.raises(kiks.ParameterError, match=words):
        samples(robot, **settings)  # type: ignore[arg-type]


def test_the_log_is_on_the_disk_after_each_sample(robot: kiks.Khepera, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    log = CsvLog(path)
    stream = logged(samples(robot, rate_hz=5), log)
    for count in (1, 2, 3):
        sample = next(stream)
        rows = list(csv.DictReader(path.read_text().splitlines()))
        assert len(rows) == count
        assert float(rows[-1]["time_s"]) == pytest.approx(sample.time_s, abs=0.001)
        assert int(rows[-1]["proximity_3_counts"]) == sample.proximity[3]
        assert int(rows[-1]["ambient_0_counts"]) == sample.ambient[0]
        assert int(rows[-1]["right_error_pulses"]) == sample.status[1].error
    log.close()
    assert path.read_text().splitlines()[0].startswith("time_s,proximity_0_counts,")
    assert len(COLUMNS) == len(rows[0]) == 27


def test_a_log_never_replaces_a_file(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("precious")
    with pytest.raises(kiks.ParameterError, match=r"a log must go to a new file, but .*log.csv' cannot be one"):
        CsvLog(path)
    assert path.read_text() == "precious"


def test_a_log_says_that_its_disk_is_full(robot: kiks.Khepera) -> None:
    log = CsvLog.__new__(CsvLog)
    log._file = open("/dev/full", "w")  # noqa: SIM115  (closed by close)
    with pytest.raises(kiks.ParameterError, match=r"'/dev/full' cannot any more \(No space left on device\)"):
        log.add(next(samples(robot)))
    log.close()


def test_the_picture_shows_each_reading_at_its_place(robot: kiks.Khepera) -> None:
    sample = next(samples(robot))
    sample = sample._replace(proximity=[11, 122, 233, 344, 455, 566, 677, 788])
    console = Console(file=io.StringIO(), width=100)
    console.print(command.picture(sample, 6.5, "a port"))
    assert isinstance(console.file, io.StringIO)
    lines = console.file.getvalue().splitlines()
    assert "6.5 samples per second" in console.file.getvalue()
    for number in sample.proximity + sample.ambient:
        assert str(number) in console.file.getvalue()

    def line_of(number: int) -> int:
        return next(index for index, line in enumerate(lines) if f" {number}" in line)

    assert line_of(233) == line_of(344) < line_of(122) == line_of(455) < line_of(566) < line_of(677) == line_of(788)
    narrow = Console(file=io.StringIO(), width=60)
    narrow.print(command.picture(sample, 6.5, "a port", 60))
    assert isinstance(narrow.file, io.StringIO)
    assert all(f" {number} " in narrow.file.getvalue() for number in sample.proximity + sample.ambient)
    assert "…" not in narrow.file.getvalue()
    assert command.bar(0).strip() == "0"
    assert command.bar(2000) == "██████████ 2000"


def test_the_command_prints_lines_and_logs_where_there_is_no_terminal(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    sim = kiks.Simulation(seed=1)
    arguments = ["--port", sim.url(1), "--rate", "5", "--seconds", "0.6", "--csv", str(path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    assert "BIOS 5.02" in lines[0]
    assert len(lines) == 5
    assert "N 8 0 0 0 5 0 6 7" in lines[1]
    assert lines[-1].startswith("3 samples, 5.0 per second at the end, in ")
    assert len(path.read_text().splitlines()) == 4
    again = CliRunner().invoke(app, arguments)
    assert isinstance(again.exception, kiks.ParameterError)


def test_ctrl_c_ends_cleanly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log.csv"
    sim = kiks.Simulation(seed=1)
    seen: list[Sample] = []

    def line(sample: Sample, rate_hz: float) -> str:
        seen.append(sample)
        if len(seen) == 2:
            raise KeyboardInterrupt
        return ""

    monkeypatch.setattr(command, "line", line)
    result = CliRunner().invoke(app, ["--port", sim.url(1), "--csv", str(path)])
    assert result.exit_code == 0
    assert "2 samples" in result.output
    assert len(path.read_text().splitlines()) == 3
    sim.port(1).claim("the next one")


def test_a_robot_that_is_not_there_is_named() -> None:
    result = CliRunner().invoke(app, ["--port", "/dev/ttyNOWHERE"])
    assert isinstance(result.exception, kiks.LinkError)
