"""Turrets that are functions of Octave in the folder `turrets`."""

from pathlib import Path

import pytest
from tests.at_length import at_length
from tests.matlab.octave import Octave, needs_octave, run, transport_variables

from kiks import Recording
from kiks.recording.replay import check_recording

pytestmark = [needs_octave, pytest.mark.slow]

COMPASS = """\
function reply = compass(letter, args)
if nargin < 2
    reply = 24;
    return
end
switch letter
    case 'B'
        reply = 't,24,b,1,0';
    case 'C'
        pose = kiks_siminfo_robotpos();
        reply = sprintf('t,24,c,%d', round(pose(3) * 180 / pi));
    case 'S'
        reply = sprintf('t,24,s,%g', sum(args));
    case 'N'
        kSetSpeed([-1 -1 -1 -1], 5, -5);
        reply = sprintf('t,24,n,%d', numel(kProximity([-1 -1 -1 -1])));
    case 'X'
        error('no order X');
    case 'Y'
        reply = 5;
    otherwise
        reply = 'z,Protocol error';
end
"""

EYE = """\
function reply = my_eye(letter, args)
reply = 2;
if nargin == 2
    reply = ['what I see by ' letter];
end
"""

PROGRAM = """
kiks_arena(zeros(300, 400))
kiks_record('run.mcap')
ref = kiks_kopen([-1 9600 1]);
orders = {'C', 'S,1,2.5', 'S,-3', 'B', 'N', 'X', 'X', 'Y', 'Z'};
for k = 1:numel(orders)
    before = kiks_ktime(-1);
    say(sprintf('reply_%d', k), kiks_ksend(['T,24,' orders{k} 10], ref))
    say(sprintf('took_%d', k), kiks_ktime(-1) - before)
end
kTurret(ref, 24, 'S,1')  %= "s,1"
kTurretBios(ref, 24)  %= [[1], [0]]
kcmd(ref, 'T,2,N')  %= "what I see by N"
kcmd(ref, 'T,4,F')  %= "t,4,f,1"
kcmd(ref, 'T,30,F')  %= "z,Turret order not supported"
kcmd(ref, 'net', 1)  %~ .*compass, ID 24.*
kiks_ksend(['T,24,S,7' 10 'H' 10], ref)  %= "z,Protocol error"
kSetSpeed(ref, 5, 5);
kiks_pause(2)
kiks_record('')
kiks_kclose(ref)
"""


@pytest.mark.parametrize("transport", ["pipes", "tcp"])
def test_functions_carry_out_the_orders_for_their_turrets(tmp_path: Path, transport: str) -> None:
    folder = tmp_path / "turrets"
    folder.mkdir()
    (folder / "compass.m").write_text(COMPASS)
    (folder / "my_eye.m").write_text(EYE)
    (folder / "broken.m").write_text("function reply = broken(letter, args)\nreply = 'no number';\n")
    octave = run(PROGRAM, tmp_path, transport_variables(transport))
    said = octave.said
    unknown, refused = "z,Turret order not supported", "z,Protocol error"
    expected = ["t,24,s,3.5", "t,24,s,-3", "t,24,b,1,0", "t,24,n,8", unknown, unknown, unknown, refused]
    assert [said[f"reply_{k}"] for k in range(2, 10)] == expected
    assert said["reply_1"].startswith("t,24,c,")
    # Characters of order and reply with their line ends, 11 bits each, and a millisecond of the robot.
    for k, order in ((2, "S,1,2.5"), (4, "B"), (6, "X")):
        characters = len(f"T,24,{order}\n") + len(said[f"reply_{k}"]) + 2
        assert said[f"took_{k}"] == pytest.approx(characters * 11 / 9600 + 1e-3, abs=1e-4)
    assert octave.line("A turret of the folder turrets has the number of ") == "k213 and takes its place."
    assert octave.line("turrets/compass.m could not carry out order X: ") == "no order X"
    assert "it must return a row of characters" in octave.line("turrets/compass.m could not carry out order Y: ")
    assert "left out" in octave.line("turrets/broken.m ")
    assert check_recording(Recording(tmp_path / "run.mcap").log).differs_ns is None


@at_length
def test_a_second_octave_has_turrets_of_its_own(tmp_path: Path) -> None:
    """The first has no folder of turrets, and its robot does not answer the same order."""
    (tmp_path / "second" / "turrets").mkdir(parents=True)
    (tmp_path / "second" / "turrets" / "compass.m").write_text(COMPASS)
    first = """
    kiks(zeros(300, 400))
    ref = kiks_kopen;
    say('ready', 1)
    fread(stdin, 1);
    say('reply', kcmd(ref, 'T,24,S,1'))
    kiks_kclose(ref);
    """
    second = "kiks('--join'); ref = kiks_kopen; say('reply', kcmd(ref, 'T,24,S,1')); kiks_kclose(ref);"
    with Octave(first, tmp_path) as one:
        one.wait_for("ready")
        with Octave(second, tmp_path / "second", shares=one) as other:
            other.finish()
        assert other.said["reply"] == "t,24,s,1"
        one.tell()
        one.finish()
    assert one.said["reply"] == "z,Turret order not supported"
