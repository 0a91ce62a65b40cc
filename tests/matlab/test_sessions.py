"""Sessions: nothing gets lost or is left behind, programs share one, runs are repeatable, errors have reasons."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from tests.at_length import at_length, cases
from tests.matlab.octave import A_PROCESS, Octave, has_ended, needs_octave, run, transport_variables
from tests.matlab.test_functions import NAMES

pytestmark = [needs_octave, pytest.mark.slow]

KILLED = """
ref = kiks_kopen([-1 9600 1]);
why = '';
try
    for i = 1:200
        kProximity(ref);
        if i == 50
            system(sprintf('kill -9 %d', session_number()));
        end
    end
catch failure
    why = [failure.identifier '|' failure.message];
end
say('why', why)
say('after', i)
say('gone', kiks_siminfo_robotpos())
"""

GOING_ON = """
ref = kiks_kopen([-1 9600 1]);
say('readings', kProximity(ref))
"""


@at_length
@pytest.mark.parametrize(("transport", "tidied"), [("pipes", ""), ("tcp", "kiks_kclose(ref)\nkiks_quit\nkiks\n")])
def test_a_program_survives_the_simulators_death(transport: str, tidied: str, tmp_path: Path) -> None:
    said = run(KILLED + tidied + GOING_ON, tmp_path, A_PROCESS | transport_variables(transport)).said
    assert re.match(r"kiks:session\|The simulator must answer, but its process has ended\. ", said["why"])
    assert 50 <= said["after"] <= 52
    assert said["gone"].size == 0
    assert said["readings"].shape == (8, 1)


@at_length
def test_a_killed_octave_leaves_nothing_behind(tmp_path: Path) -> None:
    program = """
ref = kiks_kopen([-1 9600 1]);
kSetSpeed(ref, 5, 5);
say('session', session_number())
while true
    kProximity(ref);
end
"""
    with Octave(program, tmp_path, A_PROCESS) as octave:
        session = os.pidfd_open(int(octave.wait_for("session")))
        octave.kill()
        octave.finish(-9)
        assert has_ended(session)
        assert list(octave.doors.glob("kiks/session-*")) == []


@at_length
def test_kiks_quit_and_the_end_of_a_program_end_the_session(tmp_path: Path) -> None:
    program = """
ref = kiks_kopen([-1 9600 1]);
say('session', session_number())
fread(stdin, 1);
kiks_quit
say('quit', session_number())
fread(stdin, 1);
ref = kiks_kopen([-1 9600 1]);
say('another', session_number())
fread(stdin, 1);
"""
    with Octave(program, tmp_path, A_PROCESS) as octave:
        session = os.pidfd_open(int(octave.wait_for("session")))
        octave.tell()
        assert octave.wait_for("quit") == 0
        assert has_ended(session), "it is gone when kiks_quit returns"
        assert octave.children() == []
        octave.tell()
        another = os.pidfd_open(int(octave.wait_for("another")))
        octave.tell()
        octave.finish()
        assert has_ended(another)


def test_two_programs_share_a_world_and_see_each_other(tmp_path: Path) -> None:
    first_program = """
arena = zeros(300, 600);
arena(150, 150) = -360;
arena(150, 450) = -180;
kiks(arena)
say('session', session_number())
fread(stdin, 1);
ref = kiks_kopen([-1 9600 1]);
kSetSpeed(ref, 4, 4);
kiks_pause(1)
kStop(ref);
say('here', kiks_siminfo_robotpos())
readings = kProximity(ref);
while max(readings(3:4)) < 300 && kiks_ktime(-1) < 300
    readings = kProximity(ref);
end
say('saw', readings)
kiks_kclose(ref)
kiks_quit
"""
    second_program = """
kiks('--join', {number})
say('taken', caught(@() kiks('--join', {number})))
% A program that forgets all does not take the world away from others.
clear all
kiks(zeros(200, 200));
ref = kiks_kopen([-1 9600 1]);
say('begins', kiks_siminfo_robotpos())
say('opened', 1)
readings = kProximity(ref);
while max(readings(3:4)) < 300 && kiks_ktime(-1) < 300
    kSetSpeed(ref, 5, 5);
    readings = kProximity(ref);
end
kStop(ref);
kiks_pause(1)
say('saw', readings)
say('here', kiks_siminfo_robotpos())
kiks_kclose(ref)
kiks_quit
say('left', kiks_siminfo_robotpos())
say('again', caught(@() kiks('--join', {number} + 1)))
"""
    with Octave(first_program, tmp_path) as first:
        number = int(first.wait_for("session"))
        with Octave(second_program.format(number=number), tmp_path, shares=first) as second:
            second.wait_for("opened")
            first.tell()
            second.finish()
            first.finish()
    assert second.said["begins"][0] == pytest.approx([450, 150, np.pi], abs=1)
    assert second.said["taken"].startswith("kiks:session|A session must be left before another is joined.")
    assert first.said["saw"][2:4].max() >= 300
    assert second.said["saw"][2:4].max() >= 300
    gap_mm = second.said["here"][0, 0] - first.said["here"][0, 0] - 55
    assert 0 < gap_mm < 40
    assert first.said["here"][0, 0] == pytest.approx(150 + 32, abs=4)
    assert second.said["left"].size == 0
    assert re.match(r"kiks:session\|.*session \d+ must run before it is joined", second.said["again"])


@pytest.mark.parametrize("transport", cases(["pipes", "tcp"]))
def test_leaving_a_session_says_whether_it_goes_on(transport: str, tmp_path: Path) -> None:
    first_program = "kiks\nsay('session', session_number())\nfread(stdin, 1);\nkiks_quit\n"
    with Octave(first_program, tmp_path) as first:
        number = int(first.wait_for("session"))
        second_program = f"kiks('--join', {number})\nkiks_quit\n"
        with Octave(second_program, tmp_path, transport_variables(transport), shares=first) as second:
            second.finish()
        first.tell()
        first.finish()
    assert second.lines[-1] == "This program has left the KiKS session. The session goes on for the other programs."
    assert first.lines[-1] == "The KiKS session has ended."


SAME = """
global KIKS_THINKING KIKS_SEED
KIKS_THINKING = '%s';
KIKS_SEED = %d;
arena = zeros(400);
arena(200, 200) = -17;
kiks(arena)
kiks_spawn(2)
kiks_spawn(3)
kiks_spawn(1)
ref = kiks_kopen([-1 9600 1]);
for i = 1:60
    t = kiks_ktime(-1);
    readings = kProximity(ref);
    kSetSpeed(ref, 8 + readings(1) / 50, 8 - readings(4) / 50);
    printf('%%s\\n', sprintf('%%d ', readings, kAmbient(ref), kLinVis(ref)));
    printf('%%s\\n', sprintf('%%.17g ', t, kiks_siminfo_robotpos(), kiks_siminfo_objects()));
    kSetSpeed(ref, 8, 8);
    if i == 40
        kiks_pause(1)
    end
end
printf('%%s\\n', sprintf('%%.17g ', kiks_siminfo_robotpath()));
disp(kiks('--state'))
kiks_kclose(ref)
kiks_quit
"""


@at_length
def test_the_same_seed_gives_the_same_run_by_tcp(tmp_path: Path) -> None:
    by_tcp = run(SAME % ("fixed:3", 7), tmp_path, transport_variables("tcp"))
    assert len(by_tcp.lines) > 120
    assert by_tcp.lines == run(SAME % ("fixed:3", 7), tmp_path).lines


SLOW = """
for seconds = [0 0.01]
    kiks_arena(zeros(300));
    ref = kiks_kopen;
    for i = 1:20
        kSetSpeed(ref, 5, 4);
        kiks_siminfo_robotpos();
        kiks_siminfo_objects();
        builtin('pause', seconds)
        t = kiks_ktime(-1);
    end
    kiks_pause(1)
    printf('%.17g %.17g %.17g %.17g %s\\n', t, kiks_siminfo_robotpos(), kiks('--state'));
end
"""


def test_the_speed_of_octave_changes_nothing(tmp_path: Path) -> None:
    quick, slow = (line for line in run(SLOW, tmp_path).lines if re.match(r"[\d.]+ ", line))
    assert quick == slow


TAKES_ANYTHING = """
    kiks_setup kiks_quit kiks_kiksnet kiks_preferences kiks_siminfo_objects kiks_siminfo_speed kiks_tif2arena kiks_mm2p
    kiks_p2mm kclose
"""

ONLY_REF = """
    kProximity kAmbient kGetSpeed kGetEncoders kGetStatus kStatus kStop kBios kFlush kList kTeam kLinVis kLinLight
    kRadio_status kRadio_read kBattle_sensors kBattle_fire kSetEncoders kSetProfile kSetSpeedPID kSetPositionPID
"""


def calls(text: str) -> list[str]:
    """Return calls that are separated by two blanks or the end of a line."""
    return re.split(r"\s{2,}", text.strip())


WRONG_REFS = ["[]", "5", "'xxxx'", "[-7 -7 -7 -7]", "[-1 -1]", "[-1.5 -1.5 -1.5 -1.5]", "nan(1, 4)", "[7 9600 1 1]"]

WRONG = [f"{name}({ref})" for name in ONLY_REF.split() for ref in WRONG_REFS] + calls(
    """
    kiks_record(5)  kiks_record('run.mp4')
    kiks_recordmovie(5)  kiks_recordmovie({})  kiks_recordmovie(['ab'; 'cd'])
    kSetSpeed(ref, NaN, 1)  kSetSpeed(ref, 'a', 'b')  kSetSpeed(ref, 1)  kSetSpeed()
    kMoveTo(ref)  kMoveTo(ref, NaN, 1)
    kSetEncoders(ref, 'a', 1)
    kSetProfile(ref, NaN)
    kSetSpeedPID(ref, NaN)
    kSetPositionPID(ref, NaN)
    kLED(ref)  kLED(ref, 0, NaN)  kLED(ref, [0 1], [1 1 1])
    kGetAnalog(ref)  kGetAnalog(ref, NaN)
    kSetPWM(ref, 1)  kSetPWM(ref, NaN, 1)
    kReadByte(ref)  kReadByte(ref, NaN)
    kWriteByte(ref, 1)  kWriteByte(ref, NaN, 1)
    kTurret(ref)  kTurret(ref, NaN, 'B')  kTurret(ref, 2, 5)
    kTurretBios(ref)  kTurretBios(ref, NaN)
    kSetArm(ref)  kSetArm(ref, NaN)
    kSetGripper(ref)  kSetGripper(ref, NaN)
    kRadio_send(ref)  kRadio_send(ref, NaN, 'a', 1)  kRadio_send(ref, 1, 1:3, NaN)  kRadio_send(ref, 1, 300, 1)
    kcmd(ref, {})  kcmd([-7 -7 -7 -7], 'N')
    kiks_ksend()  kiks_ksend(['N' 10])  kiks_ksend(['N' 10], -1)  kiks_ksend(['a'; 'b'], ref)
    kiks_ksend(['N' 10], [-7 -7 -7 -7])
    ksend()  ksend('N', -1)
    ksends()  ksends('N', -1)
    kopen()  kopen({})  kopen(NaN)  kopen([0 9600 -1])  kopen('nowhere')  kopen('/dev/nowhere', 9600, 1)
    kopen([99 9600 1])  kopen([-1 9600 1])
    kiks_kopen()  kiks_kopen(-1)  kiks_kopen([-1 0])  kiks_kopen([-1 9600 -1])  kiks_kopen(-1.5)  kiks_kopen([-2 1e9])
    kiks_kclose('a')  kiks_kclose(NaN)
    kiks_ktime('x')  kiks_ktime(-1.5)
    kiks_pause()  kiks_pause(NaN)  kiks_pause([1 2])
    kiks_print(5)
    kiks_status({})
    kiks_demo(0)  kiks_demo('tennis')
    kiks_delete_object()  kiks_delete_object(0)  kiks_delete_object(99)
    kiks_spawn()  kiks_spawn(7)  kiks_spawn(2, [NaN 1])  kiks_spawn(2, [1e6 5])
    kiks_siminfo_setobject()  kiks_siminfo_setobject(99)  kiks_siminfo_setobject(1, 'ab')
    kiks_siminfo_setobject(1, 1, 1, Inf)  kiks_siminfo_setobject(1, 1, 1, 1, 180)
    kiks_siminfo_setrobot(NaN, 1)  kiks_siminfo_setrobot(1, 1, Inf)  kiks_siminfo_setrobot(1, 1, 90)
    kiks_siminfo_setrobot(1, 1, 1, 0)
    kiks_siminfo_robotpos(0)
    kiks_siminfo_robotpath('a')
    kiks_siminfo_robotdist(1)
    kiks_load()  kiks_load(5)  kiks_load('nowhere.kad')  kiks_load('nowhere')
    kiks_save()  kiks_save(5)  kiks_save('x.png')  kiks_save('/nowhere/x.kad')
    kiks_arena('x.tif')  kiks_arena(zeros(200, 200, 2))  kiks_arena(0.5 * ones(200))
    kiks_arena(zeros(200), ones(3))  kiks_arena(zeros(200), 300 * ones(200))  kiks_arena(@sin)
    kiks('--what')  kiks('--join', 'x')  kiks('--join')
    kiks_kad2arena()  kiks_kad2arena([100 100 4 1])
    kiks_generate_maze(0)  kiks_generate_maze(2, 2, 10)
    kiks_arena_new_create()  kiks_arena_new_create(50, 50)  kiks_arena_new_create(200, 200, 0, 300)
    kiks_speedtest(0)  kiks_clock('date')
    kiks_calibrate(-5)  kiks_calibrate(-1, 5)
    kBraitenberg(ref, NaN)  kBraitenberg(ref, 1, -1)
    kBraitenbergG(ref, NaN)
    kProximityG(ref, 5)
    """
)

WITHOUT_SESSION = calls(
    "kiks_spawn(2)  kiks_save('x.kad')  kiks_checkpoint()  kiks_reset()  kProximity(-ones(1, 4))  kiks_arena(ones(200))"
)

PREFERENCES = re.findall(
    r"(\S+) (\S+)",
    """
    KIKS_SEED -1  KIKS_THINKING 'slowly'  KIKS_EMULATED_CPU 'abacus'  KIKS_ROBOT 'Roomba'  KIKS_RESPONSE 'guess'
    KIKS_NOISE 2  KIKS_MOVIENAME 5  KIKS_TURRETS 'laser'  KIKS_ROBOTS 0.5  KIKS_ARENA_CODING 'other'
    KIKS_COLOR_BALL 300  KIKS_ARENA_DEFAULT_COLOR 0
    """,
)

# Missing arguments and arguments of a wrong kind.
FORGOTTEN = [f"{name}{arguments}" for name in ONLY_REF.split() for arguments in ("()", "({1, 2, 3, 4})")] + calls(
    """
    kiks_recordmovie()  kcmd()  kcmd(ref)  kcmd(ref, ['a'; 'b'])  kiks_ksend(NaN, ref)
    kSetSpeed(ref, 1 + 2i, 3)  kRadio_send(ref, 1, {1}, 1)  kBraitenberg()  kclose('/dev/ttyUSB0')
    kiks_mm2p()  kiks_mm2p({})  kiks_p2mm()  kiks_p2mm({})
    """
)


def test_wrong_arguments_get_messages_of_kiks(tmp_path: Path) -> None:
    missing = [name for name in NAMES if not any(call.startswith(f"{name}(") for call in WRONG + WITHOUT_SESSION)]
    assert sorted(set(missing) - set(TAKES_ANYTHING.split())) == []
    tried = [*WITHOUT_SESSION, *WRONG, *FORGOTTEN]
    lines = [f"say('w{number}', caught(@() {call}))" for number, call in enumerate(tried)]
    lines.insert(len(WITHOUT_SESSION), "ref = kiks_kopen([-1 9600 1]);")
    lines.append("size(kProximity(ref))  %= [[8, 1]]\nkiks_quit(1)")
    for name, value in PREFERENCES:
        lines += [f"global {name}", f"before = {name};", f"{name} = {value};"]
        lines += [f"say('{name}', caught(@() kiks_arena()))", f"{name} = before;"]
    said = run("\n".join([*lines, "kiks_arena\nsize(kiks_siminfo_robotpos())  %= [[1, 3]]"]), tmp_path).said
    answers = {call: said[f"w{number}"] for number, call in enumerate(tried)}
    answers |= {name: said[name] for name, _ in PREFERENCES}
    clear = re.compile(r"\b(must|needs)\b.*\.$")
    vague = {call: words for call, words in answers.items() if not clear.search(words) and call not in FORGOTTEN}
    foreign = {call: words for call, words in answers.items() if not re.match(r"kiks:\w+\|", words)}
    assert foreign == vague == {}
