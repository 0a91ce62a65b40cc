"""`kiks run`: a project runs like a program, and a run leaves a recording, a file of it, and a line for each robot."""

import csv
import os
import pty
import re
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests import forked
from tests.at_length import cases
from tests.cli.test_cli import state_of
from tests.served import GUARD_S, PROGRAMS, fresh

from kiks.cli import app
from kiks.cli.record import recorded, tell_run
from kiks.errors import KiksError
from kiks.ports.program_output import Labels
from kiks.sim.simulation import Simulation

pytestmark = pytest.mark.slow

DRIVE = str(PROGRAMS / "drive.py")

ASKS = """
import serial, sys
port = serial.Serial('COM1', timeout=1)
for order in (b'B\\n', b'T,1,B\\n', b'D,5,5\\n'):
    port.write(order)
    print(*sys.argv[1:], port.readline().decode().strip())
import time
time.sleep(1)
"""

PROJECT = """
kiks = 1
seed = 5
thinking = "fixed:1"

[[robot]]
turrets = ["gripper"]

[[robot]]
kind = "khepera_ii"
program = "teacher.py"
arguments = ["teacher"]

[[start]]
at_mm = [100.0, 150.0]
heading_deg = 90.0

[[start]]
at_mm = [300.0, 150.0]

[walls]
size_mm = [400, 300]
wall_mm = 10
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "exercise.kiks").write_text(PROJECT)
    (tmp_path / "teacher.py").write_text(ASKS)
    (tmp_path / "student.py").write_text(ASKS)
    return tmp_path


def test_a_project_starts_its_programs(folder: Path) -> None:
    result = forked.run("run", "exercise.kiks", "--export", "rows.csv", cwd=folder)
    assert result.returncode == 0, result.stderr
    assert result.stdout == "teacher b,6.01,6.01\nteacher z,Turret order not supported\nteacher d\n"
    assert "seed 5, state" in result.stderr
    rows = list(csv.DictReader((folder / "rows.csv").read_text().splitlines()))
    first, second = rows[:2], rows[-2:]
    assert [(row["x_mm"], row["y_mm"]) for row in first] == [("100.0", "150.0"), ("300.0", "150.0")]
    assert [before["y_mm"] == after["y_mm"] for before, after in zip(first, second, strict=True)] == [True, False]


def test_programs_behind_a_project_take_the_place_of_its_own_from_robot_1_on(folder: Path) -> None:
    both = forked.run("run", "exercise.kiks", "--seed", "6", "student.py", "--fast", cwd=folder)
    replies = {
        "1 student.py | --fast": ("b,5.02,5.01", "d", "t,1,b,1,0"),
        "2 teacher.py | teacher": ("b,6.01,6.01", "d", "z,Turret order not supported"),
    }
    lines = [f"{label} {reply}" for label, each in replies.items() for reply in each]
    assert sorted(both.stdout.splitlines()) == lines, both.stderr
    assert "seed 6, state" in both.stderr
    before = forked.run("run", "--seed", "6", "exercise.kiks", "student.py", "--fast", cwd=folder)
    assert state_of(before.stderr) == state_of(both.stderr)
    one = forked.run("run", "exercise.kiks", "--robots", "1", "student.py", cwd=folder)
    assert one.stdout.splitlines() == ["b,5.02,5.01", "t,1,b,1,0", "d"]
    assert "robot 2" not in one.stderr


def test_a_project_as_an_arena_brings_its_robots_and_says_that_its_programs_stay_behind(folder: Path) -> None:
    result = forked.run("run", "--arena", "exercise.kiks", "--turret", "gripper", "student.py", cwd=folder)
    assert result.stdout.splitlines() == ["b,5.02,5.01", "t,1,b,1,0", "d"]
    left_out = "kiks: the programs of exercise.kiks do not start here. kiks run exercise.kiks starts them, too."
    assert left_out in result.stderr
    assert "kiks: robot 2: 0.00 m driven" in result.stderr
    assert "seed 5, state" in result.stderr


def test_an_arena_stands_in_place_of_the_project_s_but_no_robot_without_a_program(folder: Path) -> None:
    (folder / "wide.toml").write_text("size_mm = [900, 900]\nwall_mm = 10\n[[start]]\nat_mm = [800, 800]\n")
    result = forked.run("run", "exercise.kiks", "--arena", "wide.toml", "--export", "rows.csv", cwd=folder)
    assert "teacher b,6.01,6.01" in result.stdout, result.stderr
    assert "\n0.0,1,800.0,800.0," in (folder / "rows.csv").read_text()
    with pytest.raises(KiksError, match="a project must name a program for a robot, but"):
        app(["run", str(folder / "exercise.kiks"), "--robots", "1"], standalone_mode=False)


FOR_EVER = {
    "sleeps": "import time\nwhile True: time.sleep(0.37)\n",
    "long": "import time\ntime.sleep(1e8)\n",
    "polls": "import serial\nport = serial.Serial('COM1', timeout=0)\nwhile not port.in_waiting: pass\n",
    "reads": (
        "import serial\nport = serial.Serial('COM1', timeout=1e8)\nport.write(b'D,4,5\\n')\n"
        "while True:\n    try: port.readline()\n    except BaseException as error: print(error)\n"
    ),
    "talks": (
        "import serial\nport = serial.Serial('COM1', timeout=1)\nwhile True:\n"
        "    for order in (b'N\\n', b'D,6,5\\n'):\n        port.write(order)\n        port.readline()\n"
    ),
    "threads": (
        "import serial, threading, time\nport = serial.Serial('COM1', timeout=1)\ndef talk():\n    while True:\n"
        "        port.write(b'D,5,6\\n')\n        port.readline()\nthreading.Thread(target=talk).start()\n"
        "while True: time.sleep(0.3)\n"
    ),
}
"""Programs that have no end, each waiting in another way."""

ENDED = "kiks: the run has ended after 20.5 s of simulated time."


@pytest.fixture
def endless(tmp_path: Path) -> Path:
    for name, text in {**FOR_EVER, "spins": "import time\ntime.sleep(3)\nwhile True: pass\n"}.items():
        (tmp_path / f"{name}.py").write_text(text)
    robots = "".join(f'[[robot]]\nprogram = "{name}.py"\n' for name in ("talks", "sleeps", "reads"))
    (tmp_path / "three.kiks").write_text(f"kiks = 1\n{robots}[walls]\nsize_mm = [400, 300]\nwall_mm = 10\n")
    return tmp_path


@pytest.mark.parametrize(
    "line", cases([*(f"{name}.py" for name in FOR_EVER), "three.kiks", "talks.py sleeps.py", "long.py reads.py"], 7)
)
def test_seconds_end_programs_at_that_simulated_time_and_the_same_each_time(line: str, endless: Path) -> None:
    results = [forked.run("run", "--seconds", "20.5", *line.split(), cwd=endless) for _ in range(2)]
    for result in results:
        *_, said, last = [line for line in result.stderr.splitlines() if " driven, " not in line]
        assert (result.returncode, said) == (0, ENDED)
        assert last.startswith("kiks: 20.500 s simulated, seed 0, state ")
    assert state_of(results[0].stderr) == state_of(results[1].stderr)
    assert results[0].stdout == results[1].stdout == ""


def test_nothing_is_printed_after_the_end_and_a_program_that_fails_before_it_fails(endless: Path) -> None:
    (endless / "tells.py").write_text("import time\nwhile True:\n    print(time.monotonic())\n    time.sleep(0.5)\n")
    result = forked.run("run", "--seconds", "20.5", "tells.py", cwd=endless)
    assert result.stdout.splitlines() == [str(k / 2) for k in range(42)]
    both = forked.run("run", "--seconds", "20.5", "tells.py", "talks.py", cwd=endless)
    assert both.stdout.splitlines() == [f"1 tells.py | {k / 2}" for k in range(42)]
    (endless / "fails.py").write_text("raise SystemExit(3)")
    assert forked.run("run", "--seconds", "20.5", "fails.py", "sleeps.py", cwd=endless).returncode == 3


def test_seconds_change_nothing_before_and_nothing_for_a_program_that_ends_before(endless: Path) -> None:
    plain = forked.run("run", DRIVE, "COM1", "40", "7", "6")
    bounded = forked.run("run", "--seconds", "1000", DRIVE, "COM1", "40", "7", "6")
    assert bounded.stderr == plain.stderr
    recorded_run = forked.run("run", "--seconds", "20.5", "--record", "run.mcap", "talks.py", cwd=endless)
    again = forked.run("run", "--seconds", "20.5", "talks.py", cwd=endless)
    assert state_of(recorded_run.stderr) == state_of(again.stderr)
    assert forked.run("replay", "--check", "run.mcap", cwd=endless).returncode == 0


@pytest.mark.parametrize(
    "line", cases(["spins.py", "spins.py sleeps.py", "talks.py", "talks.py long.py", "long.py"], 3)
)
def test_max_wall_ends_whatever_runs(line: str, endless: Path) -> None:
    result = forked.run("run", "--max-wall", "0.5", *line.split(), cwd=endless)
    *_, said, last = [line for line in result.stderr.splitlines() if " driven, " not in line]
    assert (result.returncode, said) == (124, "kiks: --max-wall has ended the run after 0.5 s of real time.")
    assert last.endswith("s simulated, seed 0, not repeatable: --max-wall has ended it")


def test_the_last_lines_are_one_for_each_robot_and_that_of_the_state() -> None:
    result = forked.run("run", "--robots", "2", DRIVE, "COM1", "40", "7", "6")
    *_, first, second, last = result.stderr.splitlines()
    assert re.fullmatch(r"kiks: robot 1: 0\.\d\d m driven, 0 contacts, \d+\.\d{3} s", first)
    assert re.fullmatch(r"kiks: robot 2: 0\.00 m driven, 0 contacts, \d+\.\d{3} s", second)
    assert re.fullmatch(r"kiks: \d+\.\d{3} s simulated, seed 0, state [0-9a-f]{16}", last)


def drive_into_a_wall(sim: Simulation, seconds: float = 3.0) -> None:
    port = sim.port(1)
    port.write(b"D,20,20\n")
    sim.run(seconds)


def test_a_contact_is_one_however_long_it_lasts(capsys: pytest.CaptureFixture[str]) -> None:
    sim = fresh()
    sim.place(1, 500, 300, 0.0)
    drive_into_a_wall(sim)
    tell_run(sim, doubt="it was interrupted")
    said = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"kiks: robot 1: 0\.0\d m driven, 1 contact, 3\.000 s", said[0])
    assert said[1].endswith("seed 7, not repeatable: it was interrupted")


def test_what_was_interrupted_is_exported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sims = [fresh(2), fresh(2)]

    def interrupted() -> None:
        with recorded(sims[0], export=Path("run.csv")):
            drive_into_a_wall(sims[0], 2.0)
            os.chdir("/")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    drive_into_a_wall(sims[1], 2.0)
    assert sims[0].state_hash() == sims[1].state_hash()
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]
    last = [row for row in csv.DictReader((tmp_path / "run.csv").read_text().splitlines()) if row["robot"] == "1"][-1]
    assert (float(last["x_mm"]), float(last["y_mm"])) == pytest.approx(sims[0].pose(1)[:2], abs=6e-4)


def test_paths_of_a_long_run_are_thinned_out() -> None:
    sim = fresh()
    sim.record_paths(0.01, points_max=10)
    drive_into_a_wall(sim, 5.0)
    (path,) = sim.paths()
    steps_s = {round(step, 6) for step in path[1:, 0] - path[:-1, 0]}
    assert 5 <= len(path) <= 10
    assert steps_s == {0.64}
    assert path[0, 0] == 0


def test_paths_stay_whole_if_ctrl_c_comes_while_a_point_is_kept() -> None:
    class Interrupted:
        def __getitem__(self, _index: int) -> Any:
            raise KeyboardInterrupt

    sim = fresh()
    sim.record_paths(0.01)
    drive_into_a_wall(sim, 0.1)
    before = sim.paths().tolist()
    state = sim.world.state
    interrupted: Any = SimpleNamespace(tick_count=state.tick_count, robots=state.robots, bodies=Interrupted())
    with pytest.raises(KeyboardInterrupt):
        sim.world.watchers[0].look(interrupted)
    assert sim.paths().tolist() == before


def test_each_line_says_which_program_it_is_from(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("import sys\nprint('one')\nprint('no end', end='')\nsys.stderr.write('wrong\\n')\n")
    (tmp_path / "other.py").write_text("import os\nos.write(1, b'\\xff' * 100_000 + b'\\nlast')\n")
    command = [*forked.kiks_command(), "run", "a.py", "other.py"]
    result = subprocess.run(command, capture_output=True, cwd=tmp_path, check=True)
    lines = result.stdout.splitlines()
    assert [line for line in lines if line.startswith(b"1")] == [b"1 a.py     | one", b"1 a.py     | no end"]
    others = [line.removeprefix(b"2 other.py | ") for line in lines if line.startswith(b"2")]
    assert (b"".join(others), others[-1]) == (b"\xff" * 100_000 + b"last", b"last")
    assert len(lines) == 2 + len(others)
    assert b"1 a.py     | wrong\n" in result.stderr


def at_a_terminal(folder: Path, **environment: str) -> str:
    """Run two programs, one of which asks something, at a terminal; return all that the terminal shows at the end."""
    (folder / "asks.py").write_text("print('got', input('go? '))\n")
    (folder / "b.py").write_text("print('here')\n")
    ours, theirs = pty.openpty()
    command, text = [*forked.kiks_command(), "run", "asks.py", "b.py"], ""
    options: dict[str, Any] = {"cwd": folder, "env": os.environ | environment}
    with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, **options) as process:
        os.close(theirs)
        has_answered = False
        while True:
            try:
                text += os.read(ours, 1 << 16).decode()
            except OSError:  # Linux says so when the other end is closed
                break
            if "go? " in text and not has_answered:
                has_answered = True
                os.write(ours, b"yes\n")
        assert process.wait(GUARD_S) == 0, text
    os.close(ours)
    return text.replace("\r\n", "\n")


def test_at_a_terminal_labels_are_coloured_unless_no_color_is_set_and_questions_are_seen(tmp_path: Path) -> None:
    text = at_a_terminal(tmp_path, NO_COLOR="")
    assert "\033[36m1 asks.py |\033[0m go? yes\n" in text
    assert "\033[36m1 asks.py |\033[0m got yes\n" in text
    assert "\033[33m2 b.py    |\033[0m here\n" in text
    text = at_a_terminal(tmp_path, NO_COLOR="1")
    assert "1 asks.py | got yes\n" in text
    assert "\033" not in text


def test_a_program_gets_an_error_when_its_output_is_closed(tmp_path: Path) -> None:
    (tmp_path / "talks.py").write_text("while True: print('more')\n")
    (tmp_path / "silent.py").write_text("")
    command = [*forked.kiks_command(), "run", "talks.py", "silent.py"]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=tmp_path, text=True, **pipes) as process:
        assert process.stdout.readline() == "1 talks.py  | more\n"
        process.stdout.close()
        said = process.stderr.read()
        assert process.wait(GUARD_S) == 1
    assert "1 talks.py  | BrokenPipeError" in said


def test_what_kiks_says_begins_a_line_of_its_own(capfd: pytest.CaptureFixture[str]) -> None:
    labels = Labels(["a.py", "long.py"])
    writer = labels.writer(1, "a.py")
    assert not writer.show_unfinished(b"unfinished", is_error=False)  # no terminal: it waits until the line is whole
    labels.write(b"go? ", is_error=True, is_unfinished=True)
    labels.say("here I am")
    writer.take([b"one", b"two"], is_error=False)
    out, err = capfd.readouterr()
    assert out == "1 a.py    | one\n1 a.py    | two\n"
    assert err == "go? \nkiks: here I am\n"
