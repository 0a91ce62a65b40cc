"""The clocks of Octave tell the time in which the robot lives while a port is open, else the computer's."""

from pathlib import Path

import pytest
from tests.matlab.octave import needs_octave, run

pytestmark = [needs_octave, pytest.mark.slow]

LOOPS = {
    "toc": "tic; while toc < 2, @; end",
    "toc of a number": "id = tic; tic; while toc(id) < 2, @; end",
    "time": "t = time; while time - t < 2, @; end",
    "clock": "t = clock; while etime(clock, t) < 2, @; end",
    "now": "t = now; while (now - t) * 86400 < 2, @; end",
    "cputime": "t = cputime; while cputime - t < 2, @; end",
    "pause": "for k = 1:79, t = kiks_ktime(-1); pause(2 / 79 - 0.0252); @; end",
    "only the clock": "tic; while toc < 2, end",
}
"""Loops of 2 s, in which @ stands for a question to the robot: 25 ms at 9600 baud."""

PROGRAM = """
global KIKS_THINKING
KIKS_THINKING = '{thinking}';
real = builtin('tic'); tic;
ref = kiks_kopen([-1 9600 1]);
say('before', toc - builtin('toc', real));
told = @() toc;
for loop = {{{loops}}}
    begin = kiks_ktime(-1); count = 0;
    eval(strrep(loop{{1}}, '@', 'kProximity(ref); count++'));
    printf('%g %d\\n', kiks_ktime(-1) - begin, count);
end
tic; id = tic; kiks_pause(100); kiks_kclose(ref);
after = [toc, toc(id), told()];
say('after', after > 100 & after < 110)
kiks_kopen([-1 9600 1]); pause(0.5);
say('again', toc > 100.5 && toc < 120)
say('wrong', caught(@() toc({{}})))
kiks_quit
real = builtin('tic'); tic;
say('end', abs(toc - builtin('toc', real)) < 0.1 && isempty(strfind(path, 'clocks')))
"""


@pytest.mark.parametrize("thinking", ["none", "fixed:2", "live", "live:3"])
def test_a_loop_by_each_clock_lasts_as_long_as_the_robot_lives(thinking: str, tmp_path: Path) -> None:
    loops = ", ".join(f"'{loop}'" for loop in LOOPS.values())
    octave = run(PROGRAM.format(thinking=thinking, loops=loops), tmp_path)
    for name, line in zip(LOOPS, octave.lines, strict=False):
        lived_s, count = map(float, line.split())
        # Measured thinking depends on the computer, and comes on top of pauses.
        is_measured = thinking.startswith("live")
        assert 1.95 <= lived_s < (60 if is_measured and name == "pause" else 4 if is_measured else 2.2), (name, line)
        assert thinking != "none" or name == "only the clock" or 79 <= count <= 80, (name, line)
    assert octave.said["before"] == pytest.approx(0, abs=0.2)
    assert octave.said["after"].all()
    assert octave.said["again"] == octave.said["end"] == 1
    assert octave.said["wrong"] == "|toc: invalid ID"
