"""The check of an exercise: what programs that do nothing, the template and a solution say about a goal."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from tests import forked
from tests.at_length import cases

from kiks.model.arena import Arena, Pose
from kiks.model.exercise import Cases, Exercise
from kiks.model.goal import Goal
from kiks.model.project import Project, ProjectRobot

AHEAD = """
import time
import kiks
robot = kiks.Khepera("/dev/ttyUSB0")
robot.set_speed(10, 10)
time.sleep(60)
"""

SLOW = AHEAD.replace("10, 10", "2, 2")

REFEREE = """
def supervise(sim):
    yield 0.5
    sim.set_score("lap", 1)
    yield 60
"""

FOUND: dict[str, tuple[dict[str, str], dict[str, object], str, list[str]]] = {
    "nothing": ({"solved": "path_mm > 200"}, {}, AHEAD, []),
    "a line of the manual": ({"solved": "reached_s(450, 250) < 30"}, {}, AHEAD, []),
    "true at once": (
        {"solved": "contacts == 0", "points": "10 * is_solved"},
        {},
        AHEAD,
        ["The goal is solved before anything has moved, with 10 points."],
    ),
    "failed at once": (
        {"failed": "wall_mm > 9"},
        {},
        "",
        ["The goal has failed before anything has moved, with 0 points."],
    ),
    "solved by waiting": (
        {"solved": "is_over and contacts == 0", "points": "3 * is_solved"},
        {},
        "",
        ["A program that does nothing solves it, with 3 points."],
    ),
    "points for ending at once": (
        {"solved": "path_mm > 200", "points": "5 - time_s"},
        {},
        AHEAD,
        ["A program that does nothing gets 5 points."],
    ),
    "one case of two": (
        {"solved": "final_x_mm > 300"},
        {"cases": (Cases("home"), Cases("away", arena=("long.toml",)))},
        AHEAD,
        ["'away': The goal is solved before anything has moved, with 1 point."],
    ),
    "no time": (
        {"solved": "path_mm > 200"},
        {},
        SLOW,
        ["The solution does not solve it in 4 s: out of time."],
    ),
    "template": (
        {"solved": "path_mm > 200"},
        {"exercise": Exercise(template=AHEAD)},
        AHEAD,
        ["The template solves it."],
    ),
    "broken template": (
        {"solved": "path_mm > 200"},
        {"exercise": Exercise(template="import nothing_of_that_name")},
        AHEAD,
        ["The template fails: crashed: ModuleNotFoundError: No module named 'nothing_of_that_name'."],
    ),
    "not counted": (
        {"solved": "path_mm > 200 or score('laps') > 3"},
        {"supervisor": "referee.py"},
        AHEAD,
        ["score('laps') was counted in none of these runs, so it is 0: does the supervisor call it so?"],
    ),
    "another robot": (
        {"solved": "path_mm > 200"},
        {"robots": (ProjectRobot(), ProjectRobot(program="other.py"))},
        AHEAD,
        ["The program of robot 2, other.py, fails: crashed: ValueError: of the other."],
    ),
}


@pytest.mark.parametrize("name", cases(FOUND, 5))
def test_a_check_finds_what_a_class_would_find(name: str, tmp_path: Path) -> None:
    goal, changes, solution, found = FOUND[name]
    arena = replace(Arena.box(500, 500), starts=(Pose(100, 250, 0.0), Pose(100, 100, 0.0)))
    Project(arena, seconds=4.0, goal=Goal(**goal), **changes).save(tmp_path / "it.kiks")
    (tmp_path / "long.toml").write_text("size_mm = [900, 500]\n[[start]]\nat_mm = [350, 250]\n")
    (tmp_path / "referee.py").write_text(REFEREE)
    (tmp_path / "other.py").write_text("raise ValueError('of the other')")
    (tmp_path / "solution.py").write_text(solution)
    words = ("--solution", "solution.py") if solution else ()
    done = forked.run("exercise", "check", "it.kiks", *words, "--trusted", "--json", cwd=tmp_path)
    assert json.loads(done.stdout)["findings"] == found, done.stderr
    assert (done.returncode, done.stderr) == (bool(found), "")
    assert not (tmp_path / "grades-it").exists()


def test_a_check_prints_a_table_and_refuses_what_no_run_can_begin_with(tmp_path: Path) -> None:
    for solved, code, words in (
        ("path_mm > 200", 0, ["does nothing       0     0/1", "0 findings in 1 case.", "--solution PROGRAM"]),
        ("contacts == 0", 1, ["ends at once       1     1/1", "The goal is solved before", "1 finding in 1 case."]),
        (
            "neighbour_mm < 100",
            2,
            ["the goal's solved must ask for what is there, but 'neighbour_mm' is about another"],
        ),
        ("score('laps') > 2", 2, ["score('laps') is counted by none"]),
    ):
        Project(Arena.box(500, 500), seconds=1.0, goal=Goal(solved=solved)).save(tmp_path / "it.kiks")
        done = forked.run("exercise", "check", "it.kiks", "--trusted", cwd=tmp_path)
        assert done.returncode == code
        assert [each for each in words if each not in done.stdout + done.stderr] == []
        assert done.stderr.count("\n") == (code == 2)
