"""A program tried in all cases from the desk: in the visible ones, until a person stops it, or with a message."""

from dataclasses import replace
from pathlib import Path

import pytest
from tests.guard import wait_until

from kiks.desk.server.tries import _TURNS, Tries
from kiks.errors import ParameterError
from kiks.model.arena import Arena
from kiks.model.exercise import Cases, Exercise
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.ports.program_process import Command

CASES = Cases(seed=(1, 2)), Cases("mine", is_hidden=True)
GOAL = Goal(solved="path_mm > 20")
PROJECT = Project(Arena.box(400, 400), seconds=2.0, goal=GOAL, exercise=Exercise("Drive"), cases=CASES)

DRIVE = "import kiks\nkiks.Khepera('/dev/ttyUSB0').set_speed(10, 10)\nimport time\ntime.sleep(1)\nprint('there')\n"


def program(folder: Path, text: str) -> Command:
    (folder / "drive.py").write_text(text)
    return Command(folder / "drive.py")


def test_tries_are_those_of_a_program_wait_for_others_and_can_be_stopped(tmp_path: Path) -> None:
    tries, drive, turns = Tries(), program(tmp_path, DRIVE), 0
    while _TURNS.acquire(blocking=False):
        turns += 1
    tries.begin(PROJECT, tmp_path, drive, has_hidden=False)
    wait_until(lambda: tries.is_waiting)
    _TURNS.release(turns)
    tries.wait()
    assert (tries.is_waiting, tries.is_whole, tries.error) == (False, True, "")
    assert ([case.seed for case in tries.cases], tries.grade.points, tries.grade.solved) == ([1, 2], 1, 2)
    assert tries.is_of(PROJECT, drive)
    assert tries.recording(1).is_file()

    endless = program(tmp_path, "while True:\n    pass\n")
    assert not tries.is_of(PROJECT, drive)
    tries.begin(PROJECT, tmp_path, endless, has_hidden=True)
    with pytest.raises(ParameterError, match="must end first"):
        tries.begin(PROJECT, tmp_path, endless, has_hidden=True)
    tries.stop()
    wait_until(lambda: not tries.is_running)
    assert (len(tries.cases), tries.outcomes, tries.is_whole) == (3, {}, False)
    with pytest.raises(ParameterError, match="All cases must have come out"):
        tries.packed()
    tries.close()


def test_what_cannot_be_tried_is_said(tmp_path: Path) -> None:
    tries, drive = Tries(), program(tmp_path, DRIVE)
    with pytest.raises(ParameterError, match="must have a robot"):
        tries.begin(replace(PROJECT, robots=()), tmp_path, drive, has_hidden=False)
    tries.begin(replace(PROJECT, seconds=None), tmp_path, drive, has_hidden=False)
    tries.wait()
    with pytest.raises(ParameterError, match=r"'0' cannot begin: a project .* must have a time limit"):
        tries.packed()
    tries.close()
