"""Every function of the toolbox exists, has help, and does on a simulated robot what its help says."""

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
    kiks_kopen kiks_ksend kiks_kclose kiks_ktime kiks_clock kiks_pause
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
[size(kProximity(ref)) size(kAmbient(ref))]  %= [[8, 1, 8, 1]]
all(kProximity(ref) < 60)  %= 1
kAmbient(ref)'  %= [[460] * 8] +- 59.9
kSetEncoders(ref, 100, -200)  %= 0
kGetEncoders(ref)  %= [[100], [-200]]
kSetEncoders(ref)  %= 0
kGetEncoders(ref)  %= [[0], [0]]
kSetSpeed(ref, 5.4, -5.4)  %= 0
begin = kiks_clock('clock'); kiks_pause(0.5)
(kiks_clock('clock') - begin) / 1e6  %= 0.5 +- 0.001
kGetSpeed(ref)  %= [[5], [-5]] +- 1
kGetStatus(ref)([2 5])  %= [[0], [0]]
kStatus(ref)
kStop(ref)  %= 0
kiks_pause(0.5)
kGetSpeed(ref)  %= [[0], [0]]
kSetProfile(ref, 5, 200, 15, 250)  %= 0
kMoveTo(ref, -5000, 5000)  %= 0
kiks_pause(0.5)
kGetSpeed(ref)  %= [[-5], [15]] +- 1
kStop(ref)  %= 0
kiks_pause(0.5)
kSetProfile(ref)  %= 0
kSetEncoders(ref)  %= 0
kMoveTo(ref, 200.4, 200.4)  %= 0
kGetStatus(ref)([1 2 4 5])  %= [[0], [1], [0], [1]]
kStatus(ref)
kiks_pause(3)
kGetStatus(ref)([1 2 4 5])  %= [[1], [1], [1], [1]]
size(kGetStatus(ref))  %= [[6, 1]]
kGetEncoders(ref)  %= [[200], [200]] +- 5
[kSetSpeedPID(ref) kSetSpeedPID(ref, 3800, 800, 100)]  %= [[0, 0]]
[kSetPositionPID(ref) kSetPositionPID(ref, 3000, 20, 4000)]  %= [[0, 0]]
kSetPWM(ref, 60, 60)  %= 0
kiks_pause(0.5)
all(kGetSpeed(ref) > 5)  %= 1
kStop(ref);
kLED(ref, 0, 1)  %= 1
kLED(ref, [0 1], [0 2])  %= [[0, 2]]
kLED(ref, 7, 1)  %= -1
[bios, protocol] = kBios(ref);
[bios protocol] - kBios(ref)  %= [[0, 0]]
min(bios, protocol) >= 1  %= 1
kGetAnalog(ref, 3)  %= 512 +- 512
kGetAnalog(ref, 17)  %= -1
kReadByte(ref, 32)  %= 128 +- 128
kWriteByte(ref, 170, 32)  %= 0
kList(ref)  %~ .+\n.+
kTeam(ref)  %~ .+
kFlush(ref);
kcmd(ref, 'help', 1)  %~ (.+\n){5}.+
kcmd(ref, 'H')  %~ h(,-?\d+){2}
kcmd(ref, 'D,1')  %~ z,.*
kcmd(ref, 'X')  %~ .+
isequal(kiks_ksend(['H' 10], ref), kiks_ksend(['H' 13], ref, 1), kiks_ksend('H', ref), kcmd(ref, 'H'))  %= 1
kiks_ksend(['N' 10], ref)  %~ n(,\d+){8}
kiks_ksend('', ref)  %= ""
times = kiks_ktime(ref);
times - times(1)  %= [[0, 0, 0, 0]]
time = kiks_ktime(-1);
time - times(1)  %= 0.05 +- 0.05
kBraitenberg(ref, 0.7, 2)
kiks_ktime(-1) - time  %= 2.25 +- 0.25
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

# Calls that KiKS 2.2.0 accepted, besides those in which it and this toolbox agree; and conditions without a warning.
OLD_CALLS = """
kiks
kiks_reset(1);
kiks_reset()  %= 1
kiks_checkpoint()  %= 1
kiks_calibrate(-1, 9600, 1);
kiks_arena([], [], []);
kiks_quit([]);
ref = kiks_kopen;
counts = [0 0];
if kProximity(ref) | kAmbient(ref), counts(1) = 1; end
while counts(2) < 3 & kAmbient(ref), counts(2) = counts(2) + 1; end
kiks_ksend(['N' 10], ref);
kiks_quit
"""

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
size(kLinVis(ref))  %= [[64, 1]]
kLinVis(ref)'  %= [[127.5] * 64] +- 127.5
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
kRadio_read(other)'  %= [[1, 5, *b"Hello", *[0] * 11]]
kRadio_send(ref, 2, zeros(1, 17), 17)  %= ""
kRadio_send(ref, 9, 'nobody', 6)  %= "t,4,s"
kiks_pause(3)
kRadio_status(ref)  %= [[1, 0, 1]]
battle = kBattle_sensors(ref);
battle(1:2)'  %= [[100, 150]] +- 1
battle([3 5 7])'  %= [[0, 100, 0]]
battle(4)  %= 145 +- 14.9
battle(6) > 20  %= 1
kBattle_fire(ref)' - [2 battle(4)]  %= [[0, 0]]
kBattle_sensors(other)(7)  %= 1
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
default = kiks_siminfo_robotpos();
size(default)  %= [[1, 3]]
kiks(zeros(200))
isequal(kiks_siminfo_robotpos(), default)  %= 1
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
kiks_siminfo_robotpos()  %= [[150, 100, 1]] +- 1e-4
kiks_checkpoint
ref = kiks_kopen;
kSetSpeed(ref, 5, 5);
kiks_pause(1)
driven = kiks_siminfo_robotpos(ref) - [150 100 1];  % up is towards small y
driven(3)  %= 0 +- 0.05
norm(driven(1:2))  %= 40 +- 3
driven(2) < 0  %= 1
distances = kiks_siminfo_robotdist(ref);
distances  %= [[40, 0, 40]] +- 3
distances(1) - distances(3)  %= 0 +- 1
distances(2) < 1  %= 1
path = kiks_siminfo_robotpath(ref);
size(path)  %= [[2, 30]] +- 9.9
path(:, 1)'  %= [[150, 100]] +- 1
all(kiks_siminfo_speed() > [0 0])  %= 1
kSetSpeed(ref, -5, -5);
kiks_pause(0.5)
kStop(ref);
kiks_siminfo_robotdist()(2) > 15  %= 1
kiks_reset
kiks_siminfo_robotpos()  %= [[150, 100, 1]] +- 1e-4
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
[size(walls) nnz(walls) double(max(greys(:)))]  %= [[300, 400, 0, 0]]
[walls, greys] = kiks_kad2arena([120 110, 4, 1 120 120 1, 1 1 10 10, 200]);
[size(walls) nnz(walls) double(max(greys(:)))]  %= [[110, 120, 1200, 200]]
size(kiks_generate_maze(2, 3))  %= [[380, 490]]
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
[data.KIKS_KSEND_CONSTANT data.KIKS_CALIBRATE_BAUD data.KIKS_KSEND_VARIATION]  %= [[0, 9600, 0]]
say('calibrated', data.KIKS_COMPUTER_SPEED)
"""


def test_every_function_is_there_with_help_and_is_called_below() -> None:
    assert {path.stem for path in TOOLBOX.glob("*.m")} == set(NAMES)
    programs = ROBOT + TURRETS + WORLD
    assert [name for name in NAMES if not re.search(rf"\b{name}\b", programs)] == []


def test_functions_take_old_calls_and_their_help_names_them_and_gives_an_example(tmp_path: Path) -> None:
    octave = run(OLD_CALLS + HELP, tmp_path)
    assert octave.lines[-1] == "The KiKS session has ended."
    assert "warning" not in octave.text
    said = octave.said
    for name in NAMES:
        assert re.search(rf"^\s*{name}  [A-Z]", said[name]), said[name]
        assert "Example:" in said[name], name
        assert "See also " in said[name], name


def test_functions_of_the_robot_itself_and_of_its_turrets(tmp_path: Path) -> None:
    text = run(ROBOT, tmp_path).text
    assert re.search(r"left  wheel: speed mode, error -?\d+\nright wheel: speed mode, error -?\d+\n", text)
    assert re.search(r"left  wheel: position mode, moving, error -?\d+\nright wheel: position mode, moving", text)
    turrets = r"Turret 2: version \d+, revision \d+\nTurret 17 does not answer\."
    assert re.search(turrets, run(TURRETS, tmp_path).text)


def test_functions_of_worlds(tmp_path: Path) -> None:
    done = run(WORLD, tmp_path)
    said = done.said
    assert "A session is active" in done.text
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
    assert re.search(r"kiks_kiksnet: .*\n.* is on the path", done.text)
    assert 0.001 <= said["index"] < 20
    assert 0.001 <= said["calibrated"] < 20
