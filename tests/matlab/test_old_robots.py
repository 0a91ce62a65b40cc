"""Robot definition files of KiKS 2.2.0, its constants of noise, light and camera, and striped robots, in Octave."""

import re
from pathlib import Path

import pytest
from tests.matlab.octave import needs_octave, run

from kiks.model.project import Project
from kiks.model.robot import RobotSpec
from kiks.sim.from_project import spec_of

pytestmark = [needs_octave, pytest.mark.slow]

PLACES, DIRECTIONS = [68, 43, 13, -13, -43, -68, -158, 158], [90, 45, 10, -10, -45, -90, -180, 180]

SCRIPT = """\
% A robot.
KIKS_ROBOT_DIAMETER = 58;
KIKS_ROBOT_DISTANCE_BETWEEN_WHEELS = 53;
KIKS_PROXIMITY_SENSORS_RANGE = 50;
KIKS_PROXIMITY_POSITIONS = {places};
KIKS_PROXIMITY_DIRECTIONS = {directions};
"""

NAMES = """\
global KIKS_ROBOT_DIAMETER KIKS_ROBOT_DISTANCE_BETWEEN_WHEELS KIKS_PROXIMITY_SENSORS_RANGE
global KIKS_PROXIMITY_POSITIONS KIKS_PROXIMITY_DIRECTIONS
"""


def write(file: Path, *, turn_deg: int = 0, function: str = "", after: str = "") -> None:
    file.parent.mkdir(exist_ok=True)
    text = SCRIPT.format(places=[a + turn_deg for a in PLACES], directions=[a + turn_deg for a in DIRECTIONS])
    file.write_text((f"function {function}\n{NAMES}" if function else "") + text + after, encoding="utf-8")


FORMS = """
global KIKS_ROBOT KIKS_RESPONSE
name = 'a variable of mine';
kiks
for robot = {'mine.m', 'mine', 'quarter'}
    KIKS_ROBOT = robot{1};
    kiks_arena
    kiks_save([robot{1} '.kiks'])
end
name  %= "a variable of mine"
KIKS_ROBOT = 'mine'; KIKS_RESPONSE = 'thesis'; kiks_arena, kiks_arena
"""


def test_scripts_and_functions_describe_robots(tmp_path: Path) -> None:
    write(tmp_path / "mine.m", after="name = 1;\nKIKS_SPDC = 8.2;\n")
    write(tmp_path / "robots" / "quarter.m", turn_deg=90, function="quarter")
    octave = run(FORMS, tmp_path)
    told = "mine.m: KIKS_SPDC has no effect on a robot of this KiKS."
    assert told in octave.lines
    for name, turn_deg in (("mine.m", 0), ("mine", 0), ("quarter", 90)):
        project = Project.load(tmp_path / f"{name}.kiks")
        spec = spec_of(project.robots[0], project, tmp_path)
        assert (spec.body.diameter_mm, spec.body.pulse_mm) == (58, 0.082)
        assert spec.proximity.mount_angle_deg == tuple(place + turn_deg for place in PLACES)
        assert spec.proximity.direction_deg == tuple(direction + turn_deg for direction in DIRECTIONS)
        assert spec.proximity.range_mm == RobotSpec.load("khepera").proximity.range_mm
    told = "has places, directions and a range of its own for the sensors: those of the robot's file have no effect."
    assert [line for line in octave.lines if "KIKS_RESPONSE" in line] == [f"KIKS_RESPONSE = 'thesis' {told}"]


WRONG = {
    "KIKS_ROBOT_DIAMETER = 50;": "KIKS_ROBOT_DISTANCE_BETWEEN_WHEELS in mine.m must be a distance .* 50, but it was 53",
    "KIKS_ROBOT_DIAMETER = 5;": "KIKS_ROBOT_DIAMETER in mine.m must be a diameter .* from 10 to 500, but it was 5",
    "KIKS_PROXIMITY_SENSORS_RANGE = NaN;": "KIKS_PROXIMITY_SENSORS_RANGE in mine.m must be a range .* but it was NaN",
    "KIKS_PROXIMITY_SENSORS_RANGE = 'far';": "KIKS_PROXIMITY_SENSORS_RANGE in mine.m must be .* was 'far'",
    "KIKS_PROXIMITY_POSITIONS = [1 2 3];": "KIKS_PROXIMITY_POSITIONS in mine.m must be eight angles .* was .1 2 3.",
    "KIKS_PROXIMITY_DIRECTIONS(3) = Inf;": "KIKS_PROXIMITY_DIRECTIONS in mine.m must be eight angles",
    "KIKS_PROXIMITY_POSITIONS = [];": "mine.m must set KIKS_PROXIMITY_POS",
    "error('not today')": "mine.m must run, but it did not: not today. ",
}


def test_a_wrong_file_is_an_error_that_names_it(tmp_path: Path) -> None:
    program = "global KIKS_ROBOT\nKIKS_ROBOT = 'mine';\n"
    for number, line in enumerate(WRONG):
        program += f"write_it({number})\nsay('wrong_{number}', caught(@() kiks()))\n"
        write(tmp_path / f"wrong_{number}.txt", after=line + "\n")
    program += "KIKS_ROBOT = 'absent.m'; say('absent', caught(@() kiks()))\n"
    program = "function write_it(k)\n  copyfile(sprintf('wrong_%d.txt', k), 'mine.m');\nend\n" + program
    said = run(program, tmp_path).said
    for number, expected in enumerate(WRONG.values()):
        identifier, _, message = said[f"wrong_{number}"].partition("|")
        assert identifier == "kiks:argument"
        assert re.search(expected, message), message
    assert "'absent.m' is neither in" in said["absent"]


CONSTANTS = """
global KIKS_SIM_PROX_NOISE KIKS_SIM_PROX_EEXP KIKS_SIM_LIGHT_FEXP KIKS_K213_NOISE KIKS_K213_NONORMALIZE KIKS_COLOR_ROBOT
kiks
say('usual', kiks('--state'))
kiks_save('usual.kiks')
KIKS_SIM_PROX_NOISE = 2; KIKS_SIM_PROX_EEXP = Inf; KIKS_SIM_LIGHT_FEXP = 1; KIKS_K213_NOISE = 0;
KIKS_K213_NONORMALIZE = 1; KIKS_COLOR_ROBOT = -16;
kiks_arena
kiks_save('changed.kiks')
KIKS_K213_NOISE = 101;
say('noise', caught(@() kiks_arena()))
KIKS_K213_NOISE = 10; KIKS_COLOR_ROBOT = -101;
say('stripes', caught(@() kiks_arena()))
"""


def test_constants_of_the_old_simulator_change_robots(tmp_path: Path) -> None:
    octave = run(CONSTANTS, tmp_path)
    wheels = {"body": {"pulse_mm": 0.082}, "motor": {"dead_band_pwm": 0.0}}
    assert Project.load(tmp_path / "usual.kiks").robots[0].changes == wheels
    changes = Project.load(tmp_path / "changed.kiks").robots[0].changes
    assert changes["body"] == {"pulse_mm": 0.082, "stripe_count": 16}
    assert changes["camera"] == {"noise_share": 0.0, "adapts_exposure": False}
    assert changes["proximity"]["noise_exponent"] == 20
    assert changes["proximity"]["jitter_counts"][-1] == 2 * 9.7
    assert changes["ambient"]["angle_exponent"] > 4
    assert "KIKS_K213_NOISE must be a share [%] from 0 to 100, but it was 101." in octave.said["noise"]
    assert "a number of stripes from -1 to -100, or [], but it was -101." in octave.said["stripes"]
    assert not [line for line in octave.lines if "effect" in line]
