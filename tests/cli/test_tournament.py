"""`kiks tournament`: the same table with any number of workers and after a stop, and pages for people."""

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from tests import forked
from tests.at_length import at_length

pytestmark = pytest.mark.slow

MATCH = """
kiks = 1
seconds = 3.0
supervisor = "referee.py"
[[robot]]
arguments = ["kiks://1"]
[[robot]]
arguments = ["kiks://2"]
[[start]]
at_mm = [100.0, 100.0]
heading_deg = 0.0
[[start]]
at_mm = [100.0, 300.0]
heading_deg = 0.0
[walls]
size_mm = [800, 400]
"""

REFEREE = """
def supervise(sim):
    while True:
        yield 0.5
        for robot in (1, 2):
            sim.set_score(robot, round(sim.travelled_mm(robot)))
"""

DRIVE = """
import sys
import kiks

robot = kiks.Khepera(sys.argv[1])
robot.set_speed({0}, {0})
robot.pause(5)
"""


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "race.kiks").write_text(MATCH)
    (tmp_path / "referee.py").write_text(REFEREE)
    players = tmp_path / "players"
    players.mkdir()
    for name, speed in {"ann": 5, "bob": 9}.items():
        (players / f"{name}.py").write_text(DRIVE.format(speed))
    (players / "=eve.py").write_text("raise ValueError('no <b>wall</b>')")
    return tmp_path


def tournament(place: Path, *words: str) -> dict[str, Any]:
    result = forked.run("tournament", "race.kiks", "players", *words, "--json", cwd=place)
    assert result.returncode == 0, result.stderr
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def test_one_player_is_an_error_and_the_table_is_the_same_with_any_workers_and_after_a_stop(place: Path) -> None:
    alone = forked.run("tournament", "race.kiks", "players/ann.py", "--trusted", cwd=place)
    assert alone.returncode == 2
    assert "PLAYERS must be at least 2, for so many meet, but there are 1. Add another one." in alone.stderr
    found = tournament(place, "--trusted", "--seeds", "1", "--workers", "1", "--out", "one")
    assert [each["name"] for each in found["table"]] == ["bob", "ann", "=eve"]
    assert len(found["games"]) == 6
    lost = [each["failed"] for each in found["games"] if "=eve" in each["players"]]
    assert all("=eve crashed: ValueError: no <b>wall</b>" in each for each in lost)
    assert found["table"][2]["failed"] == found["table"][2]["lost"] == 4
    assert {("ann", "bob"), ("bob", "ann")} <= {tuple(each["players"]) for each in found["games"]}
    # As a kill leaves it: half of the games, the last line cut short.
    shutil.copytree(place / "one", place / "two")
    lines = (place / "one/outcomes.jsonl").read_bytes().splitlines(keepends=True)
    (place / "two/outcomes.jsonl").write_bytes(b"".join(lines[:3])[:-10])
    again = tournament(place, "--trusted", "--seeds", "1", "--workers", "2", "--out", "two")
    assert again["table"] == found["table"]
    assert [each["state"] for each in again["games"]] == [each["state"] for each in found["games"]]
    rows = list(csv.DictReader((place / "one/tournament.csv").read_text().splitlines()))
    assert [row["name"] for row in rows] == ["bob", "ann", "'=eve"]
    page = (place / "one/tournament.html").read_text()
    assert "no &lt;b&gt;wall&lt;/b&gt;" in page
    assert "<b>wall" not in page


@at_length
def test_in_the_swiss_system_one_rests_in_each_round_of_three(place: Path) -> None:
    found = tournament(place, "--trusted", "--seeds", "1", "--rounds", "3")
    assert [each["round"] for each in found["games"]] == [1, 1, 2, 2, 3, 3]
    assert {each["played"] for each in found["table"]} == {4}
    assert Path(place / "tournament-race/tournament.html").exists()
