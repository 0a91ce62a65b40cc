"""Calibration: finds the hidden parameters of a simulated robot over its line alone, and names mistakes."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from benchmarks.calibration_errors import half_distances_mm, hidden_robot
from tests.at_length import at_length
from typer.testing import CliRunner

import kiks
from kiks.cli.calibrate import calibrate as command
from kiks.cli.calibrate import parse_gaps
from kiks.cli.outputs import Command
from kiks.fit.calibrate import calibrate, checked_gaps, default_gaps_mm, one_turn_deg
from kiks.fit.measurements import CalibrationError, Subject, processing_ms, rest
from kiks.fit.placements import SimPlacements
from kiks.fit.robot_fit import DIRECTION, predict
from kiks.fit.samples import Samples
from kiks.model.robot import robot_toml, save_robot
from kiks.sim.simulation import SimPort

app, runner = typer.Typer(), CliRunner(env={"COLUMNS": "200"})
app.command(cls=Command)(command)

BASE = kiks.RobotSpec.load("khepera")
KHEPERA_II = kiks.RobotSpec.load("khepera_ii")


def idle(spec: kiks.RobotSpec) -> tuple[list[float], float]:
    """Return the mean reading of each sensor in the open [counts], and the share of zeros in all readings."""
    sim = kiks.Simulation(robot=spec, seed=5)
    SimPlacements(sim).place("")
    counts = rest(Subject(kiks.Khepera(sim.port(1)), spec), 300)
    return counts.mean(axis=0).tolist(), float((counts == 0).mean())


def check(found: kiks.RobotSpec, hidden: kiks.RobotSpec) -> None:
    """Fail unless the robots agree within the errors that docs/howto/calibration.md promises."""
    assert found.proximity.direction_deg == pytest.approx(hidden.proximity.direction_deg, abs=2.0)
    assert half_distances_mm(found, hidden) == pytest.approx(half_distances_mm(hidden, hidden), abs=1.0)
    assert found.body.pulse_mm == pytest.approx(hidden.body.pulse_mm, rel=0.005)
    assert found.body.wheel_base_mm == pytest.approx(hidden.body.wheel_base_mm, rel=0.005)
    assert found.firmware.processing_ms == pytest.approx(hidden.firmware.processing_ms, abs=0.05)
    assert found.proximity.noise_small == pytest.approx(hidden.proximity.noise_small, rel=0.35)
    mean_counts, zero_share = idle(hidden)
    assert idle(found)[0] == pytest.approx(mean_counts, abs=2.0)
    assert idle(found)[1] == pytest.approx(zero_share, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("base", "seed"), [pytest.param(BASE, 2, marks=at_length), (KHEPERA_II, 3)])
def test_calibration_finds_hidden_parameters(base: kiks.RobotSpec, seed: int) -> None:
    hidden = hidden_robot(seed, base)
    sim = kiks.Simulation(robot=hidden, seed=seed)
    placements = SimPlacements(sim, skew_rad=math.radians(6 * (-1) ** seed))
    found = calibrate(kiks.Khepera(sim.port(1)), placements, base)
    check(found.spec, hidden)
    assert found.fit.deviations[DIRECTION].max() < 2.0
    assert found.pulse_deviation_mm < 0.005 * hidden.body.pulse_mm
    assert found.wheel_base_deviation_mm < 0.005 * hidden.body.wheel_base_mm


def test_steppers_and_counters_of_16_bits_are_calibrated_too() -> None:
    """Counters wrap at 32,767: the robot has driven farther, and its placements begin before that."""
    base = kiks.RobotSpec.load("epuck")
    hidden = hidden_robot(3, base)
    sim = kiks.Simulation(robot=hidden, seed=3)
    robot = kiks.EPuck(sim.port(1), baud=19_200)  # a sixth of the usual speed, and of the exchanges
    robot.set_steps(32_000, -32_000)
    check(calibrate(robot, SimPlacements(sim, skew_rad=math.radians(4)), base, baud=19_200).spec, hidden)


def test_a_robot_that_takes_no_lines_is_not_calibrated() -> None:
    base = kiks.RobotSpec.load("epuck2_wifi")
    placements = SimPlacements(kiks.Simulation(robot=base))
    with pytest.raises(kiks.ParameterError, match="must have robots that take lines of text"):
        calibrate(kiks.EPuck(placements.sim.port(1)), placements, base)


def test_response_with_directions_of_its_own_is_rejected() -> None:
    placements = SimPlacements(kiks.Simulation())
    for response in ("thesis", "fast"):
        words = f"must have the response 'reflection' or 'curve', but 'Khepera' has '{response}'"
        base = BASE.with_changes(proximity__response=response)
        with pytest.raises(kiks.ParameterError, match=words):
            calibrate(kiks.Khepera(placements.sim.port(1)), placements, base)


def test_guide_lists_the_default_gaps() -> None:
    guide = (Path(__file__).parents[2] / "docs" / "howto" / "calibration.md").read_text(encoding="utf-8")
    for spec in (BASE, KHEPERA_II):
        assert ", ".join(f"{gap:g}" for gap in default_gaps_mm(spec)) + " and" in guide


@at_length
def test_command_measures_and_writes_a_robot_file(tmp_path: Path) -> None:
    hidden, out = hidden_robot(11, BASE), tmp_path / "mine.toml"
    sim = kiks.Simulation(robot=hidden)
    # In the open: placed, repeated, placed, accepted. At the nearest gap: a typing error, a negative gap, then 6 mm.
    answers = ["", "y", "", "n", "six", "-1", "6", "n", *["", "n"] * 4]
    result = runner.invoke(app, ["--port", sim.url(1), "--out", str(out)], input="\n".join(answers) + "\n")
    assert result.exit_code == 0, result.output + repr(result.exception)
    assert "1. Put the robot in the open" in result.output
    assert "7. Put the robot before the wall, facing it squarely, its rim at the 500 mm mark." in result.output
    assert "The gap must be above 0" in result.output
    assert f"Written: {out}" in result.output
    found = kiks.RobotSpec.load(out)
    assert found.name == "Khepera (calibrated)"
    check(found, hidden)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]
    assert "wheel base" in out.read_text().splitlines()[1]
    sim.port(1).claim("the next program")


def test_command_checks_its_options_before_it_measures(tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    out.write_text("precious")
    sim = kiks.Simulation()
    for arguments, words in (
        (["--out", str(out)], "--out must be new, but"),
        (["--out", str(tmp_path / "no" / "x.toml")], "a file that can be written"),
        (["--out", str(tmp_path / "x.toml"), "--gaps", "5;15"], "--gaps must be numbers with commas"),
        (["--out", str(tmp_path / "x.toml"), "--gaps", "5"], "at least two different numbers from 2 to"),
        (["--out", str(tmp_path / "x.toml"), "--base", "kephera"], "Did you mean 'khepera'"),
    ):
        result = runner.invoke(app, ["--port", sim.url(1), "--yes", *arguments])
        assert words in str(result.exception)
    assert out.read_text() == "precious"
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def test_failed_calibration_writes_nothing(tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    sim = kiks.Simulation(kiks.Arena.box(500, 650), robot=BASE.with_changes(proximity__range_mm=2.0))
    result = runner.invoke(app, ["--port", sim.url(1), "--out", str(out), "--yes"])
    assert isinstance(result.exception, CalibrationError)
    assert list(tmp_path.iterdir()) == []


class Misplaced(SimPlacements):
    """Puts the robot at wrong gaps; None is the open."""

    def __init__(self, sim: kiks.Simulation, wrong_mm: dict[float | None, float]) -> None:
        super().__init__(sim)
        self.wrong_mm = wrong_mm
        self.findings: list[str] = []

    def place(self, instruction: str, gap_mm: float | None = None) -> float | None:
        super().place(instruction, self.wrong_mm.get(gap_mm, gap_mm))
        return gap_mm

    def wants_repeat(self, finding: str, *, is_good: bool) -> bool:
        self.findings.append(finding)
        return not is_good


def stands_still(sim: kiks.Simulation) -> bool:
    sim.run(0.5)
    before = sim.pose(1)
    sim.run(1.0)
    return sim.pose(1) == pytest.approx(before, abs=0.1)


@pytest.mark.parametrize(
    ("wrong_mm", "words"),
    [
        ({None: 5.0}, "the sensors must read little in the open, but sensor"),
        ({5: 155.0}, "some sensor must see the wall at 5 mm, but none reads more than 0 counts above its baseline"),
        pytest.param({15: 27.0}, "must agree with each other, but those at the .*Check the marks", marks=at_length),
    ],
)
def test_error_for_a_robot_in_a_wrong_place(wrong_mm: dict[float | None, float], words: str) -> None:
    sim = kiks.Simulation(robot=BASE.with_changes(proximity__jitter_counts=(0.0,)))
    placements = Misplaced(sim, wrong_mm)
    with pytest.raises(CalibrationError, match=words) as caught:
        calibrate(kiks.Khepera(sim.port(1)), placements, BASE, gaps_mm=[5, 15, 25])
    assert stands_still(sim)
    if 5 in wrong_mm:  # one finding is good, in the open, two come before the last attempt
        assert placements.findings[1:] == [str(caught.value)] * 2


def test_error_for_a_run_up_without_a_wall() -> None:
    class Backwards(SimPlacements):
        def place(self, instruction: str, gap_mm: float | None = None) -> float | None:
            super().place(instruction, gap_mm)
            if gap_mm == 200:
                self.sim.place(1, 250.0, 500.0, -math.pi / 2)
            return gap_mm

    placements = Backwards(kiks.Simulation())
    with pytest.raises(CalibrationError, match="the wall must come into sight 200 mm ahead, but after 27"):
        calibrate(kiks.Khepera(placements.sim.port(1)), placements, BASE, gaps_mm=[5, 15], run_up_mm=200)
    assert stands_still(placements.sim)


def test_error_for_wheels_that_do_not_turn() -> None:
    class Stuck(SimPort):
        def write(self, data: bytes) -> int:
            return super().write(b"D,0,0\n" if data[:1] == b"D" else data)

    sim = kiks.Simulation()
    with pytest.raises(CalibrationError, match=r"the wheels must turn 5203 pulses in 22 s, but they turned 0"):
        calibrate(kiks.Khepera(Stuck(sim, 1)), SimPlacements(sim), BASE)


class Flaky(SimPort):
    """A port that raises an error at a certain reading, and is silent from then on."""

    def __init__(self, sim: kiks.Simulation, last: int, error: BaseException | None) -> None:
        super().__init__(sim, 1)
        self.last = last
        self.error = error

    def write(self, data: bytes) -> int:
        self.last -= data[:1] == b"N"
        if self.last <= 0 and self.error is not None:
            error, self.error = self.error, None
            super().write(data)  # the reply stays unread
            raise error
        return super().write(data) if self.last > 0 or self.error is not None or data[:1] == b"D" else len(data)


def test_silence_and_ctrl_c_in_the_middle_of_a_spin_stop_the_robot() -> None:
    for last, error, words in (
        (500, kiks.LinkError("the cable fell out"), r"must come before the timeout|the cable fell out"),
        (260, KeyboardInterrupt(), None),
    ):
        sim = kiks.Simulation()
        with pytest.raises(type(error), match=words):
            calibrate(kiks.Khepera(Flaky(sim, last, error)), SimPlacements(sim), BASE)
        assert stands_still(sim)


def test_processing_time_excludes_the_time_on_the_line() -> None:
    for baud in (9600, 38400, 115200):
        port = kiks.Simulation(robot=BASE.with_changes(firmware__processing_ms=3.5)).port(1)
        port.baudrate = baud
        assert processing_ms(Subject(kiks.Khepera(port), BASE), baud) == pytest.approx(3.5, abs=0.01)


def test_the_wheel_base_is_guessed_from_readings_that_repeat() -> None:
    angle_deg = np.linspace(7.0, 900.0, 90)
    empty = Samples("wall", math.inf, np.array([10.0]), angle_deg[None], np.zeros((1, 90, 8), np.int64))
    counts = np.rint(predict(BASE, empty)).astype(np.int64)
    for turn_deg in (330.0, 372.5):
        counted = replace(empty, angle_deg=angle_deg[None] * turn_deg / 360.0, counts=counts)
        assert one_turn_deg(counted) == pytest.approx(turn_deg, abs=1.0)


def test_gaps_are_checked() -> None:
    assert len(checked_gaps(None, 500, BASE)) == 4
    assert checked_gaps([15, 5], 500, BASE) == [5, 15]
    narrow = SimPlacements(kiks.Simulation(kiks.Arena.box(300, 300)))
    for ask, words in (
        (lambda: checked_gaps([5, 500], 500, BASE), "gaps_mm must be at least two different numbers"),
        (lambda: checked_gaps(None, 50, BASE), "run_up_mm must be between"),
        (lambda: parse_gaps("5;6"), "--gaps must be numbers with commas, but it was '5;6'"),
        (lambda: narrow.place("", 500.0), "the arena must have room for a robot 500 mm below"),
    ):
        with pytest.raises(kiks.ParameterError, match=words):
            ask()


def test_robot_file_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    for spec in (BASE, KHEPERA_II):  # the second one over the first
        save_robot(spec, path, comment="first\nsecond")
        assert kiks.RobotSpec.load(path) == spec
        assert path.read_text().startswith("# first\n# second\nname = ")
        assert robot_toml(spec) in path.read_text()
        assert list(tmp_path.iterdir()) == [path]
