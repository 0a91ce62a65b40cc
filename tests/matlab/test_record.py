"""kiks_record keeps the world of a session, with all its programs, and the run can be made again."""

from pathlib import Path

import pytest
from tests.matlab.octave import Octave, needs_octave, run

from kiks import Recording
from kiks.recording.replay import check_recording

pytestmark = [needs_octave, pytest.mark.slow]

ONE = """
kiks(zeros(300, 400))
kiks_record('run.mcap')
ref = kiks_kopen([-1 9600 1]);
kSetSpeed(ref, 8, 6);
for step = 1:20
    say('reading', max(kProximity(ref)))
end
kiks_siminfo_setrobot(100, 100, 0)
kiks_pause(2)
kiks_record('')
kSetSpeed(ref, 0, 0);
caught(@() kiks_record('run.mp4'))  %~ .*name must end in .mcap.*
caught(@() kiks_record(5))  %~ .*name must end in .mcap.*
kiks_quit
caught(@() kiks_record('run.mcap'))  %~ .*kiks_record needs a session.*
"""


def test_a_session_is_recorded_until_it_is_told_to_stop(tmp_path: Path) -> None:
    octave = run(ONE, tmp_path)
    recording = Recording(tmp_path / "run.mcap")
    assert recording.is_whole
    assert [int(row["counts"].max()) for row in recording.table("readings")][-1] == octave.said["reading"]
    assert len(recording.table("readings")) == 20
    assert any(row["kind"] == "change" for row in recording.table("events"))
    assert check_recording(recording.log).equal_count == 1 + int(recording.duration_s)


FIRST = """
global KIKS_PROGRAMS
KIKS_PROGRAMS = 2;
arena = zeros(300, 600);
arena(150, 150) = -360; arena(150, 400) = -360;
kiks(arena)
kiks_record('both.mcap')
say('session', session_number())
ref = kiks_kopen([-1 9600 1]);
for step = 1:30
    values = kProximity(ref);
    kSetSpeed(ref, 6 - floor(values(4) / 80), 6);
end
kiks_kclose(ref)
kiks_quit
"""

SECOND = """
kiks('--join')
ref = kiks_kopen([-1 9600 1]);
for step = 1:30
    values = kProximity(ref);
    kSetSpeed(ref, 5, 5 - floor(values(3) / 80));
    kiks_pause(0.05)
end
kiks_kclose(ref)
kiks_quit
"""


def test_the_world_of_two_octaves_is_made_again(tmp_path: Path) -> None:
    with Octave(FIRST, tmp_path) as first:
        first.wait_for("session")
        with Octave(SECOND, tmp_path, shares=first) as second:
            second.finish()
        first.finish()
    recording = Recording(tmp_path / "both.mcap")
    assert [len(recording.table("readings", robot)) for robot in (1, 2)] == [30, 30]
    checked = check_recording(recording.log)
    assert checked.differs_ns is None
    assert checked.equal_count >= 2
