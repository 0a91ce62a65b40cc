"""A program tried in all cases from the desk: in the visible ones, until a person stops it, or with a message."""

import asyncio
import json
import re
import threading
from dataclasses import replace
from functools import partial
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import pytest
from tests.guard import wait_until

from kiks.desk.server import tries as module
from kiks.desk.server.desk import Desk
from kiks.desk.server.rights import Rights
from kiks.desk.server.tries import Tries
from kiks.desk.server.turns import Share, Turns
from kiks.errors import ParameterError
from kiks.model.arena import Arena
from kiks.model.exercise import Cases, Exercise
from kiks.model.goal import Goal
from kiks.model.project import Project, ProjectRobot
from kiks.ports.program_command import ProgramCommand
from kiks.run import Run
from kiks.trials.grading import Graded, grade, trials_of
from kiks.trials.hand_in import PAGE, PROGRAM, RECORDING, SCORE
from kiks.trials.runner import run_trials
from kiks.trials.submissions import Submission, submissions_in

CASES = Cases(seed=(1, 2)), Cases("mine", is_hidden=True)
GOAL = Goal(solved="path_mm > 20")
PROJECT = Project(Arena.box(400, 400), seconds=2.0, goal=GOAL, exercise=Exercise("Drive"), cases=CASES)

DRIVE = "import kiks\nkiks.Khepera('/dev/ttyUSB0').set_speed(10, 10)\nimport time\ntime.sleep(1)\nprint('there')\n"


SPEEDS = """
import kiks, speeds
robot = kiks.Khepera("/dev/ttyUSB0")
robot.set_speed(speeds.SPEED, int(open("turn.txt").read()))
print("driving", file=open("log.txt", "w"))
robot.pause(1)
"""


def graded(project: Project, home: Path, found: list[Submission], out: Path) -> Graded:
    return grade(project, found, run_trials(trials_of(project, home, found, is_trusted=True), out))


def program(folder: Path, text: str) -> ProgramCommand:
    (folder / "drive.py").write_text(text)
    return ProgramCommand(folder / "drive.py")


def test_tries_are_those_of_a_program_wait_for_others_and_can_be_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "TRIES", turns := Turns(1))
    tries, drive, is_over = Tries(), program(tmp_path, DRIVE), threading.Event()
    turns.start(is_over.wait, Share())
    tries.begin(PROJECT, tmp_path, drive, has_hidden=False)
    wait_until(lambda: tries.is_waiting)
    is_over.set()
    tries.wait()
    assert (tries.is_waiting, tries.is_whole, tries.error) == (False, True, "")
    assert ([case.seed for case in tries.cases], tries.come_out.points, tries.come_out.solved) == ([1, 2], 1, 2)
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
    assert tries.error == ""
    tries.close()


def test_the_next_turn_is_for_who_has_had_the_least() -> None:
    turns, is_over, done = Turns(1), threading.Event(), []
    busy = turns.start(is_over.wait, Share())
    shares = {"much": Share(60.0), "nothing": Share(), "little": Share(1.0), "nothing, too": Share()}
    ends = []
    for name, share in shares.items():
        ends.append(turns.start(partial(done.append, name), share))
        wait_until(lambda share=share: share.is_waiting)
    left = turns.start(partial(done.append, "left"), Share(), lambda: False)
    assert left.result() is None
    is_over.set()
    assert [end.result() for end in (busy, *ends)] == [True, None, None, None, None]
    assert done == ["nothing", "nothing, too", "little", "much"]


def test_a_program_is_handed_in_at_once_and_then_with_its_run_and_a_long_turn_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files: list[dict[str, bytes]] = []

    def take(data: bytes, name: str = "drive.zip", *, is_again: bool = False) -> None:
        with ZipFile(BytesIO(data)) as archive:
            files.append({each: archive.read(each) for each in archive.namelist()})

    folder = tmp_path / "desk"
    folder.mkdir()
    desk = Desk(Run(PROJECT, folder), Rights.STUDENT, folder=folder)
    desk.hand_in = take
    asyncio.run(desk.give(program(folder, DRIVE), "drive.zip"))
    assert [*files[0]] == [PROGRAM, SCORE]
    desk.tries.wait()
    assert (desk.tries.error, [*files[1]]) == ("", [PROGRAM, SCORE, RECORDING, PAGE])
    assert files[0][PROGRAM] == files[1][PROGRAM] == DRIVE.encode()
    assert json.loads(files[1][SCORE])["solved"] == 2

    monkeypatch.setattr(module, "TURN_S", 0.0)
    asyncio.run(desk.give(program(folder, "while True:\n    pass\n"), "drive.zip"))
    desk.tries.wait()
    assert (len(files), desk.tries.is_handed_in) == (3, True)
    assert re.fullmatch(r"All cases must come out .* after that 2 cases had not\. .*", desk.tries.error)
    desk.close()


def test_what_cannot_be_tried_is_said(tmp_path: Path) -> None:
    tries, drive = Tries(), program(tmp_path, DRIVE)
    with pytest.raises(ParameterError, match="must have a robot"):
        tries.begin(replace(PROJECT, robots=()), tmp_path, drive, has_hidden=False)
    tries.begin(replace(PROJECT, seconds=None), tmp_path, drive, has_hidden=False)
    tries.wait()
    assert re.match(r"'0' cannot begin: a project .* must have a time limit", tries.error)
    tries.close()


def test_what_is_tried_is_what_is_handed_in_with_all_its_files(tmp_path: Path) -> None:
    home, tries = tmp_path / "home", Tries()
    home.mkdir()
    for name, text in {"speeds.py": "SPEED = 10", "turn.txt": "0", "log.txt": "of before", "mine.txt": ""}.items():
        (home / name).write_text(text)
    drive, taken, handed_in = program(home, SPEEDS), [], []
    for speed in (10, 10, 0):
        (home / "speeds.py").write_text(f"SPEED = {speed}")
        assert not tries.is_of(PROJECT, drive) or speed
        tries.begin(PROJECT, home, drive, has_hidden=False, hand_in=None if speed else handed_in.append)
        tries.wait()
        taken.append((tries.taken_count, tries.come_out.solved))
    assert taken == [(0, 2), (2, 2), (0, 0)]
    assert tries.error == ""
    (tmp_path / "ann.zip").write_bytes(handed_in[-1])
    (found,) = submissions_in([tmp_path / "ann.zip"], tmp_path / "copies")
    assert sorted(found.files) == ["program.py", "speeds.py"]
    assert {path.name for path in found.command.program.iterdir()} == {
        "__main__.py",
        "speeds.py",
        "turn.txt",
        "log.txt",
    }
    (own,) = graded(PROJECT, home, [found], tmp_path / "graded").grades
    assert [each.points for each in own.outcomes[:2]] == [each.points for each in tries.come_out]
    (home / "score.json").write_text("")
    program(home, "open('score.json')")
    tries.begin(PROJECT, home, drive, has_hidden=False, hand_in=handed_in.append)
    tries.wait()
    assert "must not be called score.json" in tries.error
    tries.close()


def test_a_program_of_the_exercise_that_fails_is_said(tmp_path: Path) -> None:
    write = {"other.py": "import brain\nprint(brain.NAME)", "brain.py": "NAME = 1", "ann/drive.py": DRIVE}
    (tmp_path / "ann").mkdir()
    for name, text in write.items():
        (tmp_path / name).write_text(text)
    project = replace(PROJECT, robots=(ProjectRobot(), ProjectRobot(program="other.py")), cases=())
    found = submissions_in([tmp_path / "ann" / "drive.py"], tmp_path / "copies")
    assert graded(project, tmp_path, found, tmp_path / "out").faults == []
    (tmp_path / "brain.py").write_text("")
    (fault,) = graded(project, tmp_path, found, tmp_path / "out").faults
    assert fault.startswith("other.py, the exercise's program of robot 2, failed in 1 of 1 runs (crashed: AttributeErr")
