"""kiks_preferences.m in the user's folder, a script or a function of KiKS 2.2.0; pulses that follow from the robot."""

from pathlib import Path

import pytest
from tests.at_length import cases
from tests.matlab.octave import needs_octave, run

from kiks.model.project import Project
from kiks.model.robot import RobotSpec, save_robot

pytestmark = [needs_octave, pytest.mark.slow]

FORMS = {
    "script": "KIKS_ROBOTS = {robots}; KIKS_ARENA_DEFAULT_COLOR = [];",
    "script of globals": "global KIKS_ROBOTS\nKIKS_ROBOTS = {robots};",
    "function of 2.2.0": """\
% Preferences.
%{{
function no = this(one)
%}}
function kiks_preferences
global KIKS_ROBOTS KIKS_MOVIE_QUALITY KIKS_MOVIE_COMPRESSION KIKS_SIM_PROX_DIST KIKS_OBJECT_BALL_RADIUS
global KIKS_COLOR_ROBOT KIKS_COLOR_BALL KIKS_COLOR_CYLINDER
KIKS_COLOR_ROBOT = 120; KIKS_COLOR_BALL = 25; KIKS_COLOR_CYLINDER = 70;
KIKS_ROBOTS={robots};      % a comment
KIKS_MOVIE_COMPRESSION='Indeo5';
KIKS_MOVIE_QUALITY=50;
""",
    "function of another name": """\
function settings()
    global KIKS_ROBOTS
    KIKS_ROBOTS = helper({robots});
end

function count = helper(count)
end
""",
}


@pytest.mark.parametrize("form", cases(FORMS))
def test_all_forms_are_read_and_read_anew(form: str, tmp_path: Path) -> None:
    file = tmp_path / "kiks_preferences.m"
    changed = FORMS[form].format(robots=3).replace("\n", "\\n").replace("'", "''").replace("%", "%%")
    file.write_text(FORMS[form].format(robots=2), encoding="utf-8")
    done = run(
        f"""
global KIKS_COLOR_CYLINDER
KIKS_COLOR_CYLINDER = 200;
kiks(zeros(400))
kiks_save('first.kiks')
kiks_spawn(2)
kiks_spawn(3)
kiks_save('things.toml')
file = fopen('kiks_preferences.m', 'w');
fprintf(file, '{changed}');
fclose(file);
kiks_arena(zeros(400))
kiks_save('second.kiks')
global KIKS_ROBOTS
isempty(KIKS_ROBOTS)  %= 1
KIKS_COLOR_CYLINDER  %= 200
KIKS_ROBOTS = 4;
kiks_arena(zeros(400))
kiks_save('third.kiks')
KIKS_ROBOTS  %= 4
kiks_quit(1)
""",
        tmp_path,
    )
    assert [len(Project.load(tmp_path / f"{name}.kiks").robots) for name in ("first", "second", "third")] == [2, 3, 4]
    things = Project.load(tmp_path / "things.toml").arena
    assert [each.brightness for each in (*things.balls, *things.cylinders)] == [255, 200]
    grey = Project.load(tmp_path / "first.kiks").robots[0].brightness
    assert grey is None, "the user did not choose that of 2.2.0"
    assert "warning" not in done.text
    assert "kiks_preferences:" not in done.text


PREFERENCES = """\
file = fopen('readings', 'a');
fprintf(file, 'x');
fclose(file);
"""

READ = """
kiks_kopen([-1 9600 1]);
numel(fileread('readings'))  %= 1
kiks_kopen([-2 9600 1]);  % with a session
numel(fileread('readings'))  %= 2
kiks_quit(1)
cd wrong
before = path();  % its copy leaves it
say('why', caught(@() kiks()))
strcmp(before, path())  %= 1
"""


def test_the_opening_of_a_port_reads_them_once_and_a_function_that_fails_is_named(tmp_path: Path) -> None:
    (tmp_path / "wrong").mkdir()
    for folder, text in ((".", PREFERENCES), ("wrong", "function kiks_preferences\nnothing_like_that(1);\n")):
        (tmp_path / folder / "kiks_preferences.m").write_text(text, encoding="utf-8")
    why = run(READ, tmp_path).said["why"]
    assert why.startswith(f"kiks:argument|kiks_preferences.m in {tmp_path / 'wrong'} must run, but it did not: ")
    assert "'nothing_like_that' undefined" in why


PULSES = """
kiks_mm2p(82)  %= 1000 +- 1e-3
kiks
[kiks_mm2p(82) kiks_p2mm(1000)]  %= [[1000, 82]] +- 1e-3
ref = kiks_kopen;
kSetSpeed(ref, 10, 10);
kiks_pause(0.5)
start = kiks_siminfo_robotpos();
t = kiks_ktime(-1);
kiks_pause(1)
norm(kiks_siminfo_robotpos()(1:2) - start(1:2)) / (kiks_ktime(-1) - t)  %= 82 +- 0.5
kiks_save('mine.kiks')
KIKS_ROBOT = 'mine.toml';
kiks_mm2p(100)  %= 1219.512 +- 1e-3
kiks_arena
kiks_mm2p(100)  %= 1000 +- 1e-3
kiks_load('mine.kiks')
kiks_mm2p(82)  %= 1000 +- 1e-3
kiks_quit(1)
kiks_mm2p(100)  %= 1000 +- 1e-3
"""


def test_pulses_are_those_of_the_robot(tmp_path: Path) -> None:
    save_robot(RobotSpec.load("khepera").with_changes(body__pulse_mm=0.1), tmp_path / "mine.toml")
    run("global KIKS_ROBOT\n" + PULSES, tmp_path)
