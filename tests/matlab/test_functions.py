"""Every function of the toolbox exists, has help, and does on a simulated robot what its help says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from tests.matlab.octave import TOOLBOX, needs_octave, run

pytestmark = [needs_octave, pytest.mark.slow]

# kiks-behaviour.md: 1.1, 1.2, 1.4, 4.2; and what stands in kMatlab's place for files and real robots.
NAMES = re.findall(
    r"\w+",
    """
    kiks kiks_arena kiks_tif2arena kiks_kad2arena kiks_generate_maze kiks_arena_new_create kiks_quit kiks_setup
    kiks_checkpoint kiks_reset kiks_record kiks_recordmovie kiks_print kiks_status kiks_speedtest kiks_calibrate
    kiks_mm2p kiks_p2mm kiks_demo kiks_kiksnet kiks_preferences kiks_load kiks_save
    kiks_kopen kiks_ksend kiks_kclose kiks_ktime kiks_pause
    kiks_siminfo_robotpos kiks_siminfo_robotpath kiks_siminfo_robotdist kiks_siminfo_objects kiks_siminfo_setobject
    kiks_siminfo_setrobot kiks_siminfo_speed kiks_spawn kiks_delete_object
    kcmd kProximity kAmbient kSetSpeed kGetSpeed kSetEncoders kGetEncoders kMoveTo kGetStatus kStatus kStop kSetProfile
    kLED kBios kGetAnalog kSetPWM kSetSpeedPID kSetPositionPID kReadByte kWriteByte kFlush kList kTeam kTurret
    kTurretBios kLinVis kLinLight kSetArm kSetGripper kRadio_status kRadio_read kRadio_send kBattle_sensors kBattle_fire
    kopen ksend ksends kclose kProximityG kBraitenberg kBraitenbergG
    """,
)

HELP = "".join(f"say('{name}', help('{name}'))\n" for name in NAMES)

ROBOT = r"""
ref = kiks_kopen([-1 9600 1]);
ref  %= [[-1, -1, -1, -1]]
say('proximity', kProximity(ref))
say('ambient', kAmbient(ref))
kSetEncoders(ref, 100, -200)  %= 0
kGetEncoders(ref)  %= [[100], [-200]]
kSetEncoders(ref)  %= 0
kGetEncoders(ref)  %= [[0], [0]]
kSetSpeed(ref, 5.4, -5.4)  %= 0
kiks_pause(0.5)
kGetSpeed(ref)  %= [[5], [-5]] +- 1
say('status', kGetStatus(ref))
kStatus(ref)
kStop(ref)  %= 0
kiks_pause(0.5)
kGetSpeed(ref)  %= [[0], [0]]
kSetProfile(ref, 20, 64, 20, 64)  %= 0
kSetProfile(ref)  %= 0
kSetEncoders(ref)  %= 0
kMoveTo(ref, 200.4, 200.4)  %= 0
say('on_the_way', kGetStatus(ref))
kStatus(ref)
kiks_pause(3)
say('arrived', kGetStatus(ref))
kGetEncoders(ref)  %= [[200], [200]] +- 5
[kSetSpeedPID(ref) kSetSpeedPID(ref, 3800, 800, 100)]  %= [[0, 0]]
[kSetPositionPID(ref) kSetPositionPID(ref, 3000, 20, 4000)]  %= [[0, 0]]
kSetPWM(ref, 60, 60)  %= 0
kiks_pause(0.5)
say('pwm_speed', kGetSpeed(ref))
kStop(ref);
kLED(ref, 0, 1)  %= 1
kLED(ref, [0 1], [0 2])  %= [[0, 2]]
kLED(ref, 7, 1)  %= -1
[bios, protocol] = kBios(ref);
say('bios', [bios protocol])
say('bios_row', kBios(ref))
kGetAnalog(ref, 3)  %= 512 +- 512
kGetAnalog(ref, 17)  %= -1
kReadByte(ref, 32)  %= 128 +- 128
kWriteByte(ref, 170, 32)  %= 0
say('list', kList(ref))
kTeam(ref)  %~ .+
say('flush', kFlush(ref))
say('help', kcmd(ref, 'help', 1))
say('after_flush', kcmd(ref, 'H'))
kcmd(ref, 'D,1')  %~ z,.*
kcmd(ref, 'X')  %~ .+
say('ksend', kiks_ksend(['H' 10], ref))
say('ksend_cr', kiks_ksend(['H' 13], ref, 1))
kiks_ksend('H', ref)  %~ h(,-?\d+){2}
kiks_ksend(['N' 10], ref)  %~ n(,\d+){8}
kiks_ksend('', ref)  %= ""
say('times', kiks_ktime(ref))
say('time', kiks_ktime(-1))
kBraitenberg(ref, 0.7, 2)
say('after_braitenberg', kiks_ktime(-1))
kiks_pause(0.5)
kGetSpeed(ref)  %= [[0], [0]]
caught(@() kProximityG(ref))  %~ kiks:display\|kProximityG must open a window, but there is no display here\..*
caught(@() kBraitenbergG(ref))  %~ kiks:display\|kBraitenbergG must open a window, but there is no display here\..*
kiks_kclose(ref)
size(kiks_ktime(-1))  %= [[0, 0]]
kiks_kclose(ref)
caught(@() kiks_ksend(['N' 10], ref))  %~ kiks:simulator\|port -1 must be open, but it is not\..*
ref = kopen([-1 9600 1]);
ref  %= [[-1, -1, -1, -1]]
ksend(['N' 10], ref)  %~ n(,\d+){8}
ksends(['D,5,5' 10], ref)  %= "d"
kiks_pause(0.3)
kGetSpeed(ref)  %= [[5], [5]] +- 1
kclose(ref)
size(kiks_ktime(-1))  %= [[0, 0]]
kiks_kclose([])
"""

# Calls that KiKS 2.2.0 accepted, besides those in which it and this toolbox agree.
OLD_CALLS = """
kiks
kiks_reset(1);
kiks_reset()  %= 1
kiks_checkpoint()  %= 1
kiks_calibrate(-1, 9600, 1);
kiks_arena([], [], []);
kiks_quit([]);
"""


def test_calls_of_old_programs_are_accepted(tmp_path: Path) -> None:
    run(OLD_CALLS, tmp_path)


OLD_STYLE = """
ref = kiks_kopen;
counts = [0 0];
if kProximity(ref) | kAmbient(ref), counts(1) = 1; end
while counts(2) < 3 & kAmbient(ref), counts(2) = counts(2) + 1; end
kiks_ksend(['N' 10], ref);
kiks_quit
"""


def test_old_style_is_accepted_without_a_warning(tmp_path: Path) -> None:
    octave = run(OLD_STYLE, tmp_path)
    assert octave.lines[-1] == "The KiKS session has ended."
    assert "warning" not in octave.text


TURRETS = r"""
global KIKS_ROBOTS KIKS_TURRETS
KIKS_ROBOTS = 2;
KIKS_TURRETS = 'k213 radio battle gripper';
arena = zeros(300, 500);
arena(150, 100) = -360;
arena(150, 300) = -180;
kiks(arena)
ref = kiks_kopen([-1 19200 1]);
other = kiks_kopen([-2 9600 1]);
other  %= [[-2, -2, -2, -2]]
say('pixels', kLinVis(ref))
size(kLinLight(ref))  %= [[2, 1]]
kTurret(ref, 2, 'L')  %~ l,\d+,\d+
kTurret(ref, 17, 'L')  %= -1
size(kTurretBios(ref, 2))  %= [[2, 1]]
kTurretBios(ref, 17)  %= -1
kRadio_status(ref)  %= [[1, 0, 0]]
any(kRadio_read(other))  %= 0
size(kRadio_read(other))  %= [[18, 1]]
kRadio_send(ref, 2, 'Hello', 5)  %= "t,4,s"
kiks_pause(0.3)
kRadio_status(other)  %= [[1, 1, 0]]
say('message', kRadio_read(other))
kRadio_send(ref, 2, zeros(1, 17), 17)  %= ""
kRadio_send(ref, 9, 'nobody', 6)  %= "t,4,s"
kiks_pause(3)
kRadio_status(ref)  %= [[1, 0, 1]]
say('battle', kBattle_sensors(ref))
say('fired', kBattle_fire(ref))
say('hit', kBattle_sensors(other))
kSetGripper(ref, 1)  %= "t,1,d"
kSetArm(ref, 255)  %= "t,1,e"
kiks_pause(1.5)
kTurret(ref, 1, 'H,1')  %= "h,255"
KIKS_TURRETS = 'gripper';
KIKS_ROBOTS = [];
kiks_arena
ref = kiks_kopen;
kLinVis(ref)  %= -1
kLinLight(ref)  %= -1
size(kRadio_status(ref))  %= [[0, 0]]
kRadio_read(ref)  %= -1
kBattle_sensors(ref)  %= -1
kBattle_fire(ref)  %= -1
KIKS_TURRETS = 'k213';
kiks_arena
ref = kiks_kopen;
kSetArm(ref, 255)  %= "z,Turret order not supported"
"""

WORLD = r"""
size(kiks_siminfo_robotpos())  %= [[0, 0]]
size(kiks_siminfo_robotpath())  %= [[2, 0]]
size(kiks_siminfo_robotdist())  %= [[0, 0]]
size(kiks_siminfo_objects())  %= [[0, 5]]
kiks_siminfo_speed()  %= [[100, 100]]
[kiks_siminfo_setobject(1, 1, 1, 1, 1) kiks_siminfo_setrobot(100, 100, 0)]  %= [[0, 0]]
kiks('--version')  %~ KiKS \d+\.\d+\.\d+.*
kiks
say('default', kiks_siminfo_robotpos())
kiks(zeros(200))
say('still_default', kiks_siminfo_robotpos())
arena = zeros(300, 400);
arena(100, 200) = -90;
arena(50, 60) = 2;
arena(200, 100) = 3;
arena(200, 300) = 4;
kiks_arena(arena)
kiks_siminfo_robotpos()  %= [[200, 100, 1.5708]] +- 1e-4
kiks_siminfo_objects()(:, 1:4)  %= [[1, 60, 50, 0], [2, 100, 200, 0], [3, 300, 200, 0]]
kiks_spawn(1, [10 20])
kiks_spawn(2, [300 60])
kiks_spawn(3)
kiks_siminfo_objects()(1:3, 1:3)  %= [[1, 60, 50], [1, 10, 20], [2, 100, 200]]
kiks_siminfo_objects()(4:6, 1:3)  %= [[3, 300, 200], [2, 300, 60], [3, 200, 150]] +- 1
caught(@() kiks_spawn(3, [1000 20]))  %~ kiks:\w+\|.*must lie in the arena.*
[kiks_siminfo_setobject(3, 105, 200, 50, pi / 2) kiks_siminfo_setobject(3, [], 201)]  %= [[1, 1]]
[kiks_siminfo_setobject(3, -50, 200) kiks_siminfo_setobject(1, 70, 80)]  %= [[0, 1]]
kiks_siminfo_objects()([1 3], :)  %= [[1, 70, 80, 0, 0], [2, 105, 201, 50, 1.5708]] +- 1e-4
before = rows(kiks_siminfo_objects());
kiks_delete_object([1 before])
before - rows(kiks_siminfo_objects())  %= 2
strjoin(kiks_demo()', ' ')  %= "avoid battle camera clean dance follow football maze mv80mm siminfo"
kiks_demo
[kiks_siminfo_setrobot(150, 100, 1) kiks_siminfo_setrobot(5, 5, 1) kiks_siminfo_setrobot(1)]  %= [[1, 0, 0]]
say('pose_set', kiks_siminfo_robotpos())
kiks_checkpoint
ref = kiks_kopen;
kSetSpeed(ref, 5, 5);
kiks_pause(1)
say('driven', kiks_siminfo_robotpos(ref))
say('distances', kiks_siminfo_robotdist(ref))
say('path', kiks_siminfo_robotpath(ref))
say('speed', kiks_siminfo_speed())
kSetSpeed(ref, -5, -5);
kiks_pause(0.5)
kStop(ref);
say('distances_back', kiks_siminfo_robotdist())
kiks_reset
say('pose_reset', kiks_siminfo_robotpos())
kiks_print('a line')
kiks_print([10 'two' 10 10 'lines' 10])
kiks_print('')
kiks_status('quiet')
kiks_status('loud', 1)
kiks_status('instead', 0, 1)
say('log', strjoin(kiks_status(), ';'))
kiks_mm2p([80 0.082])  %= [[975.61, 1]] +- 0.01
kiks_p2mm([976; 1])  %= [[80.032], [0.082]]
kiks_save('mine.kad')
kiks_load('mine.kad')
size(kiks_siminfo_robotpos())  %= [[1, 3]]
kiks_arena_new_create(300, 250, 1, 100)
[walls, greys] = kiks_arena_new_create(300, 250, 1, 100);
say('new', [size(walls) nnz(walls) double(max(greys(:))) walls(10, 125) walls(11, 125) walls(12, 12)])
size(kiks_siminfo_robotpos())  %= [[1, 3]]
[walls, greys] = kiks_tif2arena('mine.kad');
say('read', [size(walls) nnz(walls) double(max(greys(:)))])
[walls, greys] = kiks_kad2arena([120 110, 4, 1 120 120 1, 1 1 10 10, 200]);
say('drawn', [size(walls) nnz(walls) double(max(greys(:)))])
say('maze', size(kiks_generate_maze(2, 3)))
kiks_preferences
KIKS_SEED  %= 0
kiks_kiksnet('knockknock')
kiks_record('run.mcap')
kiks_record('')
kiks_recordmovie('run')
kiks_recordmovie('')
kiks_setup
kiks_quit
size(kiks_siminfo_robotpos())  %= [[0, 0]]
kiks_quit(1)
say('index', kiks_speedtest(1))
kiks_calibrate
data = load('kiks_data.mat');
say('calibrated', [data.KIKS_KSEND_CONSTANT data.KIKS_CALIBRATE_BAUD data.KIKS_KSEND_VARIATION ...
    data.KIKS_COMPUTER_SPEED])
"""


def test_every_function_is_there_with_help_and_is_called_below() -> None:
    assert {path.stem for path in TOOLBOX.glob("*.m")} == set(NAMES)
    programs = ROBOT + TURRETS + WORLD
    assert [name for name in NAMES if not re.search(rf"\b{name}\b", programs)] == []


def test_help_names_its_function_and_gives_an_example(tmp_path: Path) -> None:
    said = run(HELP, tmp_path).said
    for name in NAMES:
        assert re.search(rf"^\s*{name}  [A-Z]", said[name]), said[name]
        assert "Example:" in said[name], name
        assert "See also " in said[name], name


def test_functions_of_the_robot_itself(tmp_path: Path) -> None:
    done = run(ROBOT, tmp_path)
    said = done.said
    assert said["proximity"].shape == said["ambient"].shape == (8, 1)
    assert (said["proximity"] < 60).all(), "nothing is near"
    assert ((said["ambient"] > 400) & (said["ambient"] < 520)).all(), "it is dark"
    assert said["status"].shape == (6, 1)
    assert said["status"][[1, 4], 0].tolist() == [0, 0]
    assert said["on_the_way"][[0, 1, 3, 4], 0].tolist() == [0, 1, 0, 1]
    assert said["arrived"][[0, 1, 3, 4], 0].tolist() == [1, 1, 1, 1]
    assert re.search(r"left  wheel: speed mode, error -?\d+\nright wheel: speed mode, error -?\d+\n", done.text)
    assert re.search(r"left  wheel: position mode, moving, error -?\d+\nright wheel: position mode, moving", done.text)
    assert (said["pwm_speed"] > 5).all()
    assert (said["bios"] >= 1).all()
    assert said["bios"].tolist() == said["bios_row"].tolist()
    assert len(said["list"].splitlines()) > 1
    assert len(said["help"].splitlines()) > 5
    assert re.fullmatch(r"h,-?\d+,-?\d+", said["after_flush"])
    assert said["ksend"] == said["ksend_cr"] == said["after_flush"]
    assert said["times"].shape == (1, 4)
    assert len(set(said["times"][0])) == 1
    assert said["times"][0, 0] <= said["time"] < said["times"][0, 0] + 0.1
    assert said["time"] + 2 <= said["after_braitenberg"] < said["time"] + 2.5


def test_functions_of_turrets(tmp_path: Path) -> None:
    done = run(TURRETS, tmp_path)
    said = done.said
    assert said["pixels"].shape == (64, 1)
    assert ((said["pixels"] >= 0) & (said["pixels"] <= 255)).all()
    assert re.search(r"Turret 2: version \d+, revision \d+\nTurret 17 does not answer\.", done.text)
    assert said["message"][:, 0].tolist() == [1, 5, *b"Hello", *[0] * 11]
    x, y, angle, distance, percent, energy, hits = said["battle"][:, 0]
    assert (x, y) == pytest.approx((100, 150), abs=1)
    assert (angle, percent, hits) == (0, 100, 0)
    assert 130 < distance < 160, "to the rim of the other"
    assert energy > 20
    assert said["fired"][:, 0].tolist() == [2, distance]
    assert said["hit"][6, 0] == 1


def test_functions_of_worlds(tmp_path: Path) -> None:
    done = run(WORLD, tmp_path)
    said = done.said
    assert said["default"].shape == (1, 3)
    assert said["still_default"].tolist() == said["default"].tolist()
    assert "A session is active" in done.text
    assert said["pose_set"][0] == pytest.approx([150, 100, 1])
    x, y, angle = said["driven"][0]
    assert angle == pytest.approx(1, abs=0.05)
    assert np.hypot(x - 150, y - 100) == pytest.approx(40, abs=3)
    assert y < 100, "up is towards small y"
    forwards, backwards, straight = said["distances"][0]
    assert (forwards, straight) == (pytest.approx(40, abs=3), pytest.approx(forwards, abs=1))
    assert backwards < 1
    assert said["path"].shape[0] == 2
    assert 20 < said["path"].shape[1] < 40
    assert said["path"][:, 0] == pytest.approx([150, 100], abs=1)
    assert said["speed"].shape == (1, 2)
    assert (said["speed"] > 0).all()
    assert said["distances_back"][0, 1] > 15
    assert said["pose_reset"] == pytest.approx(said["pose_set"], abs=1e-6)
    assert "  6  follow    follow the wall on the left." in done.lines
    at = done.lines.index("a line")
    assert done.lines[at : at + 4] == ["a line", "two", "lines", "loud"]
    assert "loud" in done.lines
    assert "quiet" not in done.lines
    log = said["log"].split(";")
    assert [line[9:] for line in log[-5:-2]] == ["a line", "two", "lines"]
    assert re.fullmatch(r"\d\d:\d\d:\d\d quiet", log[-2])
    assert log[-1].endswith(" instead")
    rows, columns, count, grey, edge, floor, corner = said["new"][0]
    assert (rows, columns, grey, edge, floor, corner) == (300, 250, 100, 1, 0, 1)
    # 10 mm all around, and the corners outside of quarter circles of 100 mm.
    assert count == pytest.approx(300 * 250 - 280 * 230 + (4 - np.pi) * 100**2, rel=0.01)
    assert said["read"][0].tolist() == [300, 400, 0, 0]
    assert said["drawn"][0].tolist() == [110, 120, 1200, 200]
    assert said["maze"].tolist() == [[3 * 120 + 2 * 10, 4 * 120 + 10]]
    assert re.search(r"kiks_kiksnet: .*\n.* is on the path", done.text)
    assert 0.001 <= said["index"] < 20
    constant, baud, variation, index = said["calibrated"][0]
    assert (constant, baud, variation) == (0, 9600, 0)
    assert 0.001 <= index < 20
