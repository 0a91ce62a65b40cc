"""`kiks sweep`: a program in its cases, its folder and its last line."""

import json
from pathlib import Path

import pytest
from tests import forked
from tests.cli.test_cli import kiks

from kiks import Recording
from kiks.errors import KiksError

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

SWEEP = "sweep brake.py --arena wall.kiks --seeds 1"


@pytest.fixture(autouse=True)
def _files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("brake.py").write_text(SLOW)
    Path("wall.kiks").write_text(WALL)


def test_a_sweep_says_up_to_where_a_program_holds_and_goes_on() -> None:
    words = f"{SWEEP} --baud 1200,9600 --think 0,100,600 --family 2".split()
    result = forked.run(*words, "--json", "--picture", "brake.svg")
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["goal"]["text"] == "Stop before the wall"
    assert [each["baud"] for each in found["holds_up_to_ms"]] == [1200, 9600]
    slow, usual = (each["ms"] for each in found["holds_up_to_ms"])
    assert (slow or 0) <= usual < 600
    assert len(found["rows"]) == 6
    assert all(row["runs"] == 2 for row in found["rows"])
    assert Path("brake.svg").read_bytes().startswith(b"<?xml")
    worst = next(row["worst"] for row in found["rows"] if row["solved"] < 2)
    file = Path(found["folder"]) / worst["recording"]
    assert Recording(file).is_whole
    times = file.stat().st_mtime_ns
    quiet = forked.run(*words, "--quiet")
    taken = "12 of 12 runs taken from kiks-sweep-brake: nothing on which they depend has changed."
    assert (quiet.stderr, "runs of 8 s at most" in result.stderr) == (f"kiks: {taken}\n", True)
    last = quiet.stdout.splitlines()[-1]
    assert last.startswith(f"brake.py {found['verdict']}; see it with kiks replay kiks-sweep-brake/")
    assert file.stat().st_mtime_ns == times


def test_a_sweep_says_up_to_which_latency_a_program_holds() -> None:
    words = f"{SWEEP} --latency 0..120:40 --family 2".split()
    result = forked.run(*words, "--json")
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)
    assert [(row["latency_ms"], row["thinking_ms"]) for row in found["rows"]] == [(ms, 0) for ms in (0, 40, 80, 120)]
    assert [row["solved"] for row in found["rows"]][::3] == [2, 0]
    points = [row["points"]["median"] for row in found["rows"]]
    assert points == sorted(points, reverse=True)
    (held,) = found["holds_up_to_ms"]
    assert 40 <= held["ms"] < 120
    assert found["verdict"].startswith(f"holds up to {held['ms']:g} ms of latency; worst: seed 0, robot ")
    worst = Path(found["folder"]) / found["rows"][3]["worst"]["recording"]
    assert (Recording(worst).world_at(1.0).link, worst.parent.name) == ("latency_ms=120.0", "120-ms-of-latency")
    taken = forked.run(*words, "--quiet").stderr
    assert "8 of 8 runs taken from kiks-sweep-brake" in taken
    lost = json.loads(forked.run(*words, "--link", "loss=0.9,retry_ms=500", "--out", "lost", "--json").stdout)
    assert lost["holds_up_to_ms"][0]["ms"] is None
    with pytest.raises(KiksError, match="--think must be one number with --latency, but it was '0,5'"):
        kiks(*words, "--think", "0,5")


def test_formulas_and_limits_of_the_command_line_replace_those_of_the_project() -> None:
    words = f"{SWEEP} --think 0 --family 0 --json".split()
    result = forked.run(*words, "--solved", "path_mm > 50", "--seconds", "3", "--out", "out")
    found = json.loads(result.stdout)
    assert found["goal"] == {"text": "", "solved": "path_mm > 50", "failed": "False", "points": "is_solved"}
    assert found["rows"][0]["worst"]["robot"] == 0
    told = "holds up to 0 ms of thinking, the most that was tried; worst: seed 0, the exact"
    assert found["verdict"].startswith(told)
    for formula, message in (
        ("path_mm >", "the goal: solved must be a formula, but 'path_mm >' is none"),
        ("paths_mm > 5", "must name measures, but 'paths_mm' is none"),
    ):
        with pytest.raises(KiksError, match=message):
            kiks(*words, "--solved", formula)
