"""Programs of Octave that KiKS starts: in a world that is there already, like programs of Python."""

from pathlib import Path

import pytest
from tests import forked
from tests.matlab.octave import needs_octave
from tests.namespaces import needs_sandbox

from kiks.model.arena import Arena
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.trials.runner import run_trials
from kiks.trials.trial import Trial

pytestmark = [needs_octave, pytest.mark.slow]

WHOLE = """
clear all; close all;
kiks(zeros(500, 500));               % there is a world already
tic; pause(2); printf('%.2f ', toc); % its clock runs before the port is open
ref = kiks_kopen([-1 9600 1]);
kSetSpeed(ref, 5, 5);
while kiks_ktime(ref(1)) < 1, s = kProximity(ref); end
printf('%.3f %d %s %d\\n', toc, kGetEncoders(ref)(1), datestr(now, 29), round(rand() * 1e6));
disp(argv()');
kiks_kclose(ref);
kiks_quit
ref = kiks_kopen();                  % again
printf('%.1f\\n', [1 1 1] * [0.1; 0.2; 0.3]);
"""

ENDS = [
    # program, how it ends, the detail
    ("x = 1;\nx(3)", "crashed", "error: x(3): out of bound 1 (dimensions are 1x1)"),
    ("y = (2\nz = 3", "crashed", "error: parse error near line 2 of file"),
    ("% GO starts\n\nfunction go(speed)\n  disp(1); error('called')\nend", "crashed", "error: called"),
    ("function go()\n  disp(1)\nend\ngo(); exit(4)", "crashed", "with exit code 4"),
    ("kiks_siminfo_robotpos", "crashed", "error: this program must have begun the world for that, but the world was"),
    ("keyboard", "crashed", "error: keyboard must have a keyboard to read from, but this program has none."),
    ("dbstop in sum at 3", "crashed", "error: dbstop must have a keyboard to read from, but this program has none."),
    ("exit(3)", "crashed", "with exit code 3"),
    ("kopen(1:7)", "crashed", "error: port must be [number baud timeout] or a name, but it was"),
]

REACHES = """
[~, seen] = system('cat /etc/passwd; cat /proc/1/environ; echo x > /usr/x; echo > /dev/tcp/127.0.0.1/22');
assert(isempty(strfind(seen, 'root:x:')));
ref = kiks_kopen();
kSetSpeed(ref, 10, 10);
while true, kiks_pause(0.1); end
"""


def test_a_program_runs_in_the_world_that_is_there_and_repeats_to_the_bit(tmp_path: Path) -> None:
    (tmp_path / "ann.m").write_text(WHOLE)
    done = [forked.run("run", "--thinking", "fixed:5", *words, cwd=tmp_path) for words in (["ann.m", "a"], ["ann.m a"])]
    assert done[0].returncode == 0, done[0].stderr
    assert done[0].stdout == done[1].stdout
    first, arguments, *_, last = done[0].stdout.splitlines()
    assert first.startswith("2.00 3.")
    assert "2000-01-01" in first
    assert (arguments.strip(), last) in [("{", "0.6")]
    states = [each.stderr.split("state ")[1] for each in done]
    assert states[0] == states[1]
    assert "The arena has no effect" in done[0].stderr


def trials(folder: Path, programs: dict[str, str], *, is_trusted: bool = False) -> list[Trial]:
    goal = Goal("Drive 10 cm", solved="path_mm > 100", points="10 if is_solved else 0")
    project = Project(Arena.box(900, 900), seconds=4.0, goal=goal, thinking="fixed:5")
    for name, text in programs.items():
        (folder / f"{name}.m").write_text(text)
    commands = {name: (ProgramCommand(folder / f"{name}.m"),) for name in programs}
    return [Trial(name, project, folder, command, is_trusted) for name, command in commands.items()]


def test_ends_and_errors_are_told_as_those_of_python(tmp_path: Path) -> None:
    programs = {f"p{number}": text for number, (text, *_) in enumerate(ENDS)}
    outcomes = run_trials(trials(tmp_path, programs, is_trusted=True), tmp_path / "out", workers=1)
    for outcome, (text, how, detail) in zip(outcomes, ENDS, strict=True):
        end = outcome.end_of()
        assert (end.how, end.detail[: len(detail)]) == (how, detail), (text, end)


@needs_sandbox
def test_a_program_in_the_sandbox_is_judged_and_reaches_nothing(tmp_path: Path) -> None:
    (found,) = run_trials(trials(tmp_path, {"ann": REACHES}), tmp_path / "one", workers=1)
    assert (found.is_solved, found.points, found.doubt) == (True, 10, ""), found
    (again,) = run_trials(trials(tmp_path, {"ann": REACHES}), tmp_path / "two", workers=1)
    assert again == found
