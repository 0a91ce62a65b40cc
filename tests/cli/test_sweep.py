"""`kiks sweep`: a program in its cases, its folder and its last line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests import forked

from kiks import Recording

pytestmark = pytest.mark.slow

SLOW = """
import sys
import kiks

robot = kiks.Khepera("kiks://1", baud=9600)
robot.set_speed(10, 10)
while max(robot.proximity()[2:4]) < 300:
    pass
robot.stop()
print("stopped", *sys.argv[1:])
"""

WALL = """
kiks = 1
seconds = 8.0
[goal]
text = "Stop before the wall"
solved = "is_over and time_s < 7"
failed = "contacts > 0"
points = "wall_mm * is_solved"
[[start]]
at_mm = [100.0, 200.0]
[walls]
size_mm = [400, 400]
"""


def test_a_sweep_says_up_to_where_a_program_holds_and_goes_on(tmp_path: Path) -> None:
    (tmp_path / "brake.py").write_text(SLOW)
    (tmp_path / "wall.kiks").write_text(WALL)
    words = ["sweep", "brake.py", "--arena", "wall.kiks", "--baud", "1200,9600", "--think", "0,100,600"]
    words += ["--family", "2", "--seeds", "1"]
    result = forked.run(*words, "--json", "--picture", "brake.svg", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["goal"]["text"] == "Stop before the wall"
    assert [each["baud"] for each in found["holds_up_to_ms"]] == [1200, 9600]
    slow, usual = (each["ms"] for each in found["holds_up_to_ms"])
    assert (slow or 0) <= usual < 600
    assert len(found["rows"]) == 6
    assert all(row["runs"] == 2 for row in found["rows"])
    assert (tmp_path / "brake.svg").read_bytes().startswith(b"<?xml")
    worst = next(row["worst"] for row in found["rows"] if row["solved"] < 2)
    recording = Recording(tmp_path / found["folder"] / worst["recording"])
    assert recording.is_whole
    times = (tmp_path / found["folder"] / worst["recording"]).stat().st_mtime_ns
    again = forked.run(*words, cwd=tmp_path)
    assert again.stdout.splitlines()[-1].startswith(
        f"brake.py {found['verdict']}; see it with kiks replay kiks-sweep-brake/"
    )
    assert (tmp_path / found["folder"] / worst["recording"]).stat().st_mtime_ns == times


def test_formulas_and_limits_of_the_command_line_replace_those_of_the_project(tmp_path: Path) -> None:
    (tmp_path / "brake.py").write_text(SLOW)
    (tmp_path / "wall.kiks").write_text(WALL)
    words = ["sweep", "brake.py", "--arena", "wall.kiks", "--think", "0", "--family", "0", "--seeds", "1", "--json"]
    result = forked.run(*words, "--solved", "path_mm > 50", "--seconds", "3", "--out", "out", cwd=tmp_path)
    found = json.loads(result.stdout)
    assert found["goal"] == {"text": "", "solved": "path_mm > 50", "failed": "False", "points": "is_solved"}
    assert found["rows"][0]["worst"]["robot"] == 0
    assert found["verdict"].startswith(
        "holds up to 0 ms of thinking, the most that was tried; worst: seed 0, the exact"
    )
    wrong = forked.run(*words, "--solved", "path_mm >", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "the goal: solved must be a formula, but 'path_mm >' is none" in wrong.stderr
    unknown = forked.run(*words, "--solved", "paths_mm > 5", cwd=tmp_path)
    assert unknown.returncode == 2
    assert "must name measures, but 'paths_mm' is none" in unknown.stderr
    assert "Traceback" not in unknown.stderr
