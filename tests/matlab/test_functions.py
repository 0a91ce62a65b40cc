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

ROBOT = """
ref = kiks_kopen([-1 9600 1]);
say('ref', ref)
say('proximity', kProximity(ref))
say('ambient', kAmbient(ref))
say('set_encoders', kSetEncoders(ref, 100, -200))
say('encoders', kGetEncoders(ref))
say('set_zero', kSetEncoders(ref))
say('zero', kGetEncoders(ref))
say('set_speed', kSetSpeed(ref, 5.4, -5.4))
kiks_pause(0.5)
say('speed', kGetSpeed(ref))
say('status', kGetStatus(ref))
kStatus(ref)
say('stop', kStop(ref))
kiks_pause(0.5)
say('stopped', kGetSpeed(ref))
say('profile', kSetProfile(ref, 20, 64, 20, 64))
say('profile_of_old', kSetProfile(ref))
say('encoders_before', kSetEncoders(ref))
say('move', kMoveTo(ref, 200.4, 200.4))
say('on_the_way', kGetStatus(ref))
kStatus(ref)
kiks_pause(3)
say('arrived', kGetStatus(ref))
say('moved', kGetEncoders(ref))
say('speed_pid', [kSetSpeedPID(ref) kSetSpeedPID(ref, 3800, 800, 100)])
say('position_pid', [kSetPositionPID(ref) kSetPositionPID(ref, 3000, 20, 4000)])
say('pwm', kSetPWM(ref, 60, 60))
kiks_pause(0.5)
say('pwm_speed', kGetSpeed(ref))
kStop(ref);
say('led', kLED(ref, 0, 1))
say('leds', kLED(ref, [0 1], [0 2]))
say('no_led', kLED(ref, 7, 1))
[bios, protocol] = kBios(ref);
say('bios', [bios protocol])
say('bios_row', kBios(ref))
say('analog', kGetAnalog(ref, 3))
say('no_analog', kGetAnalog(ref, 17))
say('byte', kReadByte(ref, 32))
say('write_byte', kWriteByte(ref, 170, 32))
say('list', kList(ref))
say('team', kTeam(ref))
say('flush', kFlush(ref))
say('help', kcmd(ref, 'help', 1))
say('after_flush', kcmd(ref, 'H'))
say('wrong', kcmd(ref, 'D,1'))
say('unknown', kcmd(ref, 'X'))
say('ksend', kiks_ksend(['H' 10], ref))
say('ksend_cr', kiks_ksend(['H' 13], ref, 1))
say('without_end', kiks_ksend('H', ref))
say('after_without_end', kiks_ksend(['N' 10], ref))
say('only_time', kiks_ksend('', ref))
say('times', kiks_ktime(ref))
say('time', kiks_ktime(-1))
kBraitenberg(ref, 0.7, 2)
say('after_braitenberg', kiks_ktime(-1))
kiks_pause(0.5)
say('at_rest', kGetSpeed(ref))
say('proximity_g', caught(@() kProximityG(ref)))
say('braitenberg_g', caught(@() kBraitenbergG(ref)))
kiks_kclose(ref)
say('closed', kiks_ktime(-1))
kiks_kclose(ref)
say('send_closed', caught(@() kiks_ksend(['N' 10], ref)))
ref = kopen([-1 9600 1]);
say('kopen', ref)
say('ksend_real', ksend(['N' 10], ref))
say('ksends', ksends(['D,5,5' 10], ref))
kiks_pause(0.3)
say('after_ksends', kGetSpeed(ref))
kclose(ref)
say('kclose', kiks_ktime(-1))
kiks_kclose([])
"""

# Calls that KiKS 2.2.0 accepted, besides those in which it and this toolbox agree.
OLD_CALLS = {
    "kiks_reset(1)": None,
    "kiks_reset()": 1,
    "kiks_checkpoint()": 1,
    "kiks_calibrate(-1, 9600, 1)": None,
    "kiks_arena([], [], [])": None,
    "kiks_quit([])": None,
}


def test_calls_of_old_programs_are_accepted(tmp_path: Path) -> None:
    lines = ["kiks"]
    for number, (call, result) in enumerate(OLD_CALLS.items()):
        lines.append(f"{call};" if result is None else f"r = {call};\nsay('r{number}', r)")
    said = run("\n".join(lines), tmp_path).said
    for number, (call, result) in enumerate(OLD_CALLS.items()):
        assert result is None or said[f"r{number}"] == result, call


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


TURRETS = """
global KIKS_ROBOTS KIKS_TURRETS
KIKS_ROBOTS = 2;
KIKS_TURRETS = 'k213 radio battle gripper';
arena = zeros(300, 500);
arena(150, 100) = -360;
arena(150, 300) = -180;
kiks(arena)
ref = kiks_kopen([-1 19200 1]);
other = kiks_kopen([-2 9600 1]);
say('other', other)
say('pixels', kLinVis(ref))
say('level', kLinLight(ref))
say('order', kTurret(ref, 2, 'L'))
say('no_turret', kTurret(ref, 17, 'L'))
say('camera_bios', kTurretBios(ref, 2))
say('no_bios', kTurretBios(ref, 17))
say('ready', kRadio_status(ref))
say('nothing', kRadio_read(other))
say('sent', kRadio_send(ref, 2, 'Hello', 5))
kiks_pause(0.3)
say('there', kRadio_status(other))
say('message', kRadio_read(other))
say('too_long', kRadio_send(ref, 2, zeros(1, 17), 17))
say('lost', kRadio_send(ref, 9, 'nobody', 6))
kiks_pause(3)
say('failed', kRadio_status(ref))
say('battle', kBattle_sensors(ref))
say('fired', kBattle_fire(ref))
say('hit', kBattle_sensors(other))
say('gripper', kSetGripper(ref, 1))
say('arm', kSetArm(ref, 255))
kiks_pause(1.5)
say('arm_is', kTurret(ref, 1, 'H,1'))
KIKS_TURRETS = 'gripper';
KIKS_ROBOTS = [];
kiks_arena
ref = kiks_kopen;
say('no_pixels', kLinVis(ref))
say('no_level', kLinLight(ref))
say('no_radio', kRadio_status(ref))
say('no_message', kRadio_read(ref))
say('no_battle', kBattle_sensors(ref))
say('no_shot', kBattle_fire(ref))
KIKS_TURRETS = 'k213';
kiks_arena
ref = kiks_kopen;
say('no_arm', kSetArm(ref, 255))
"""

WORLD = """
say('pose_before', kiks_siminfo_robotpos())
say('path_before', kiks_siminfo_robotpath())
say('distances_before', kiks_siminfo_robotdist())
say('objects_before', kiks_siminfo_objects())
say('speed_before', kiks_siminfo_speed())
say('set_before', [kiks_siminfo_setobject(1, 1, 1, 1, 1) kiks_siminfo_setrobot(100, 100, 0)])
say('version', kiks('--version'))
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
say('pose', kiks_siminfo_robotpos())
say('objects', kiks_siminfo_objects())
kiks_spawn(1, [10 20])
kiks_spawn(2, [300 60])
kiks_spawn(3)
say('spawned', kiks_siminfo_objects())
say('outside', caught(@() kiks_spawn(3, [1000 20])))
say('set_object', [kiks_siminfo_setobject(3, 105, 200, 50, pi / 2) kiks_siminfo_setobject(3, [], 201) ...
    kiks_siminfo_setobject(3, -50, 200) kiks_siminfo_setobject(1, 70, 80)])
say('objects_set', kiks_siminfo_objects())
before = rows(kiks_siminfo_objects());
kiks_delete_object([1 before])
say('deleted', before - rows(kiks_siminfo_objects()))
say('demos', strjoin(kiks_demo()', ' '))
kiks_demo
say('set_robot', [kiks_siminfo_setrobot(150, 100, 1) kiks_siminfo_setrobot(5, 5, 1) kiks_siminfo_setrobot(1)])
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
say('pulses', kiks_mm2p([80 0.082]))
say('mm', kiks_p2mm([976; 1]))
kiks_save('mine.kad')
kiks_load('mine.kad')
say('loaded', kiks_siminfo_robotpos())
kiks_arena_new_create(300, 250, 1, 100)
[walls, greys] = kiks_arena_new_create(300, 250, 1, 100);
say('new', [size(walls) nnz(walls) double(max(greys(:))) walls(10, 125) walls(11, 125) walls(12, 12)])
say('new_pose', kiks_siminfo_robotpos())
[walls, greys] = kiks_tif2arena('mine.kad');
say('read', [size(walls) nnz(walls) double(max(greys(:)))])
[walls, greys] = kiks_kad2arena([120 110, 4, 1 120 120 1, 1 1 10 10, 200]);
say('drawn', [size(walls) nnz(walls) double(max(greys(:)))])
say('maze', size(kiks_generate_maze(2, 3)))
kiks_preferences
say('seed', KIKS_SEED)
kiks_kiksnet('knockknock')
kiks_record('run.mcap')
kiks_record('')
kiks_recordmovie('run')
kiks_recordmovie('')
kiks_setup
kiks_quit
say('quit', kiks_siminfo_robotpos())
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
    assert said["ref"].tolist() == [[-1, -1, -1, -1]]
    assert said["kopen"].tolist() == [[-1, -1, -1, -1]]
    assert said["proximity"].shape == said["ambient"].shape == (8, 1)
    assert (said["proximity"] < 60).all(), "nothing is near"
    assert ((said["ambient"] > 400) & (said["ambient"] < 520)).all(), "it is dark"
    for name in ("set_encoders", "set_zero", "set_speed", "stop", "profile", "profile_of_old", "move", "pwm"):
        assert said[name] == 0, name
    assert said["encoders"].tolist() == [[100], [-200]]
    assert said["zero"].tolist() == [[0], [0]]
    assert said["speed"].T.tolist() == pytest.approx(np.array([[5, -5]]), abs=1)
    assert said["status"].shape == (6, 1)
    assert said["status"][[1, 4], 0].tolist() == [0, 0]
    assert not said["stopped"].any()
    assert said["on_the_way"][[0, 1, 3, 4], 0].tolist() == [0, 1, 0, 1]
    assert said["arrived"][[0, 1, 3, 4], 0].tolist() == [1, 1, 1, 1]
    assert said["moved"] == pytest.approx(np.full((2, 1), 200), abs=5)
    assert re.search(r"left  wheel: speed mode, error -?\d+\nright wheel: speed mode, error -?\d+\n", done.text)
    assert re.search(r"left  wheel: position mode, moving, error -?\d+\nright wheel: position mode, moving", done.text)
    assert said["speed_pid"].tolist() == said["position_pid"].tolist() == [[0, 0]]
    assert (said["pwm_speed"] > 5).all()
    assert said["led"] == 1
    assert said["leds"].tolist() == [[0, 2]]
    assert said["no_led"] == -1
    assert (said["bios"] >= 1).all()
    assert said["bios"].tolist() == said["bios_row"].tolist()
    assert 0 <= said["analog"] <= 1023
    assert said["no_analog"] == -1
    assert 0 <= said["byte"] <= 255
    assert said["write_byte"] == 0
    assert len(said["list"].splitlines()) > 1
    assert said["team"]
    assert len(said["help"].splitlines()) > 5
    assert re.fullmatch(r"h,-?\d+,-?\d+", said["after_flush"])
    assert said["wrong"].startswith("z,")
    assert said["unknown"]
    assert said["ksend"] == said["ksend_cr"] == said["after_flush"]
    assert said["only_time"] == ""
    assert re.fullmatch(r"h(,-?\d+){2}", said["without_end"])
    assert re.fullmatch(r"n(,\d+){8}", said["after_without_end"])
    assert said["times"].shape == (1, 4)
    assert len(set(said["times"][0])) == 1
    assert said["times"][0, 0] <= said["time"] < said["times"][0, 0] + 0.1
    assert said["time"] + 2 <= said["after_braitenberg"] < said["time"] + 2.5
    assert not said["at_rest"].any()
    for name, function in {"proximity_g": "kProximityG", "braitenberg_g": "kBraitenbergG"}.items():
        assert said[name].startswith(f"kiks:display|{function} must open a window, but there is no display here.")
    assert said["closed"].size == said["kclose"].size == 0
    assert said["send_closed"].startswith("kiks:simulator|port -1 must be open, but it is not.")
    assert re.fullmatch(r"n(,\d+){8}", said["ksend_real"])
    assert said["ksends"] == "d"
    assert said["after_ksends"] == pytest.approx(np.full((2, 1), 5), abs=1)


def test_functions_of_turrets(tmp_path: Path) -> None:
    done = run(TURRETS, tmp_path)
    said = done.said
    assert said["other"].tolist() == [[-2, -2, -2, -2]]
    assert said["pixels"].shape == (64, 1)
    assert ((said["pixels"] >= 0) & (said["pixels"] <= 255)).all()
    assert said["level"].shape == (2, 1)
    assert re.fullmatch(r"l,\d+,\d+", said["order"])
    assert said["no_turret"] == said["no_bios"] == -1
    assert said["camera_bios"].shape == (2, 1)
    assert re.search(r"Turret 2: version \d+, revision \d+\nTurret 17 does not answer\.", done.text)
    assert said["ready"].tolist() == [[1, 0, 0]]
    assert said["nothing"].shape == (18, 1)
    assert not said["nothing"].any()
    assert said["sent"] == "t,4,s"
    assert said["there"].tolist() == [[1, 1, 0]]
    assert said["message"][:, 0].tolist() == [1, 5, *b"Hello", *[0] * 11]
    assert said["too_long"] == ""
    assert said["lost"] == "t,4,s"
    assert said["failed"].tolist() == [[1, 0, 1]]
    x, y, angle, distance, percent, energy, hits = said["battle"][:, 0]
    assert (x, y) == pytest.approx((100, 150), abs=1)
    assert (angle, percent, hits) == (0, 100, 0)
    assert 130 < distance < 160, "to the rim of the other"
    assert energy > 20
    assert said["fired"][:, 0].tolist() == [2, distance]
    assert said["hit"][6, 0] == 1
    assert said["gripper"] == "t,1,d"
    assert said["arm"] == "t,1,e"
    assert said["arm_is"] == "h,255"
    for name in ("no_pixels", "no_level", "no_message", "no_battle", "no_shot"):
        assert said[name] == -1, name
    assert said["no_radio"].size == 0
    assert said["no_arm"] == "z,Turret order not supported"


def test_functions_of_worlds(tmp_path: Path) -> None:
    done = run(WORLD, tmp_path)
    said = done.said
    assert said["pose_before"].size == said["distances_before"].size == said["quit"].size == 0
    assert said["path_before"].shape == (2, 0)
    assert said["objects_before"].shape == (0, 5)
    assert said["speed_before"].tolist() == [[100, 100]]
    assert said["set_before"].tolist() == [[0, 0]]
    assert re.fullmatch(r"KiKS \d+\.\d+\.\d+.*", said["version"])
    assert said["default"].shape == (1, 3)
    assert said["still_default"].tolist() == said["default"].tolist()
    assert "A session is active" in done.text
    assert said["pose"][0] == pytest.approx([200, 100, np.pi / 2])
    assert said["objects"][:, :4] == pytest.approx(
        np.array([[1, 60, 50, 0], [2, 100, 200, 0], [3, 300, 200, 0]], float)
    )
    assert said["spawned"][:, 0].tolist() == [1, 1, 2, 3, 2, 3]
    assert said["spawned"][1, 1:3].tolist() == [10, 20]
    assert said["spawned"][4, 1:3].tolist() == [300, 60]
    assert said["spawned"][5, 1:3] == pytest.approx([200, 150], abs=1)
    assert re.match(r"kiks:\w+\|.*must lie in the arena", said["outside"])
    assert said["set_object"].tolist() == [[1, 1, 0, 1]]
    assert said["objects_set"][2] == pytest.approx([2, 105, 201, 50, np.pi / 2])
    assert said["objects_set"][0, 1:3].tolist() == [70, 80]
    assert said["set_robot"].tolist() == [[1, 0, 0]]
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
    assert said["deleted"] == 2
    assert said["demos"] == "avoid battle camera clean dance follow football maze mv80mm siminfo"
    assert "  6  follow    follow the wall on the left." in done.lines
    at = done.lines.index("a line")
    assert done.lines[at : at + 4] == ["a line", "two", "lines", "loud"]
    assert "loud" in done.lines
    assert "quiet" not in done.lines
    log = said["log"].split(";")
    assert [line[9:] for line in log[-5:-2]] == ["a line", "two", "lines"]
    assert re.fullmatch(r"\d\d:\d\d:\d\d quiet", log[-2])
    assert log[-1].endswith(" instead")
    assert said["pulses"][0] == pytest.approx([80 / 0.082, 1])
    assert said["mm"][:, 0] == pytest.approx([80.032, 0.082])
    assert said["loaded"].shape == (1, 3)
    rows, columns, count, grey, edge, floor, corner = said["new"][0]
    assert (rows, columns, grey, edge, floor, corner) == (300, 250, 100, 1, 0, 1)
    # 10 mm all around, and the corners outside of quarter circles of 100 mm.
    assert count == pytest.approx(300 * 250 - 280 * 230 + (4 - np.pi) * 100**2, rel=0.01)
    assert said["new_pose"].shape == (1, 3)
    assert said["read"][0].tolist() == [300, 400, 0, 0]
    assert said["drawn"][0].tolist() == [110, 120, 1200, 200]
    assert said["maze"].tolist() == [[3 * 120 + 2 * 10, 4 * 120 + 10]]
    assert said["seed"] == 0
    assert re.search(r"kiks_kiksnet: .*\n.* is on the path", done.text)
    assert 0.001 <= said["index"] < 20
    constant, baud, variation, index = said["calibrated"][0]
    assert (constant, baud, variation) == (0, 9600, 0)
    assert 0.001 <= index < 20
