"""Programs in the style of those for the Matlab KiKS (kiks-behaviour.md 4.3) run unchanged."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.matlab.octave import needs_octave, run

pytestmark = [needs_octave, pytest.mark.slow]

LOOPS = """
clear all
close all
% A wanderer that backs off when both wheels lag behind.
spd = [10; 10];
backed = 0;
loops = 0;
ref = kiks_kopen([-1, 9600, 1]);
kSetEncoders(ref, 0, 0);
real = builtin('tic');
while (kiks_ktime(-1) < 20)
    prox = kProximity(ref);
    light = kAmbient(ref);
    stat = kGetStatus(ref);
    err = [stat(3); stat(6)];
    if err > spd * 0.8
        kSetEncoders(ref, 0, 0);
        kMoveTo(ref, -200, -200);
        status = kGetStatus(ref);
        while status(1) + status(4) < 2
            status = kGetStatus(ref);
            kiks_pause(0.1);
        end;
        kMoveTo(ref, -700, 300);
        status = kGetStatus(ref);
        while status(1) + status(4) < 2
            status = kGetStatus(ref);
            kiks_pause(0.1);
        end;
        backed = backed + 1;
    end;
    kSetSpeed(ref, spd(1), spd(2));
    kiks_pause(0.05);
    loops = loops + 1;
end;
builtin('toc', real) < 20  %= 1
% It has met a wall and felt it, and took no real second for each simulated one.
backed >= 1  %= 1
loops > 50  %= 1
kiks_ktime(-1)  %= 22.5 +- 2.5
% Closed without being stopped: it drives on as soon as time passes again.
kSetSpeed(ref, 3, -3);
kiks_kclose(ref);
say('closed_at', kiks_siminfo_robotpos())
ref = kiks_kopen([-1, 9600, 1]);
kiks_ktime(-1)  %= 0 +- 0.1
kiks_pause(1)
say('drove_on', kiks_siminfo_robotpos())
all(kGetEncoders(ref) ~= 0)  %= 1
% Endless, but for a count; waiting by a vector of times; a program that forgets everything.
i = 0;
t = Inf;
while kiks_ktime(-1) < t
    kSetSpeed(ref, 5, 5);
    i = i + 1;
    if i == 20, t = 0; end;
end;
start = kiks_ktime(ref);
while kiks_ktime(ref) - start < 2
end;
kiks_ktime(ref) - start  %= [[2, 2, 2, 2]] +- 0.1
clear all
kiks_kclose([]);
ref = kiks_kopen([-1, 9600, 1]);
size(kProximity(ref))  %= [[8, 1]]
% "Reset the connection", with the reference itself.
kiks_kclose(ref); kiks_kopen(ref);
picture = kLinVis(ref);
kiks_kclose(ref); kiks_kopen(ref);
size([picture kLinVis(ref)])  %= [[64, 2]]
% The lines that follow in many programs: replies taken to pieces.
reply = kiks_ksend(['H' 10], ref);
[value, count, errmsg] = sscanf(reply, 'h,%d,%d');
[numel(value) count isempty(errmsg)]  %= [[2, 2, 1]]
strcmp(reply(1), 'h')  %= 1
% The first of many lines is read only; kMatlab's own kcmd, copied beside a program, does so.
kiks_ksend(['list' 10], ref);
size(kGetEncoders(ref))  %= [[2, 1]]
kiks_kclose(ref);
"""


def test_loops_end_by_the_clock_and_compare_vectors(tmp_path: Path) -> None:
    (tmp_path / "kiks_preferences.m").write_text("KIKS_THINKING = 'none';\n")  # also after `clear all`
    said = run(LOOPS, tmp_path).said
    assert said["drove_on"][0, 2] - said["closed_at"][0, 2] < -0.5
    assert said["drove_on"][0, :2] == pytest.approx(said["closed_at"][0, :2], abs=5)


PRINTING = """
ref = kiks_kopen([-1 9600 1])
kiks_ksend(['D,10,10' 10], ref)
kiks_ksend(['N' 10], ref)
kProximity(ref)
for i = 1:10
    kiks_ksend(['D,' num2str(i) ',' num2str(i) 10], ref);
end
t = kiks_ktime(-1)
kiks_ksend([68 44 48 44 48 10], ref)
kiks_kclose(ref)
[bios, protocol] = kBios(kiks_kopen)
kiks_kopen([-1 9600 1])
"""


def test_scripts_without_semicolons_print_replies_and_opening_twice_ends_them(tmp_path: Path) -> None:
    (tmp_path / "straight.m").write_text(PRINTING)
    done = run("say('why', caught(@straight))\nkiks_kclose([])\nsay('opens', kiks_kopen)\n", tmp_path)
    text = "\n".join(line for line in done.lines if line)
    begin = r"^ref =\n +-1 +-1 +-1 +-1\nans = d\nans = n(,\d+){8}\nans =\n( +\d+\n){8}t = 0\.\d+\nans = d\n"
    assert re.search(begin, text)
    assert re.search(r"bios = \d+(\.\d+)?\nprotocol = \d+(\.\d+)?$", text)
    assert "warning" not in text
    assert re.match(r"kiks:\w+\|port -1 must be closed before it is opened.*kiks_kclose\(\[\]\)", done.said["why"])
    assert done.said["opens"].tolist() == [[-1, -1, -1, -1]]


PICTURES = r"""
ARENA = imread('corridors.tif');
ARENA = double(ARENA > 128);
ARENA(60, 60) = -360;
kiks(ARENA);
ref = kiks_kopen([-1 9600 1]);
% Depth first: always on, else to the left, else back; what was seen is put on a stack.
stack = [];
for i = 1:200
    a = kBattle_sensors(ref);
    p = kProximity(ref);
    l = kAmbient(ref);
    if min(l) < 100, break; end
    if max(p(2:5)) > 300
        kiks_ksend(['D,5,-5' 10], ref);
    else
        kiks_ksend(['D,8,8' 10], ref);
        stack(:, end + 1) = a(1:2);
    end
end
say('stack', stack)
kiks_kclose(ref);
left = kiks_siminfo_robotpos();
kiks('corridors.tif');
isequal(kiks_siminfo_robotpos(), left)  %= 1
kiks_quit
kiks_quit
size(kiks_ktime(-1))  %= [[0, 0]]
caught(@() kProximity(ref))  %~ kiks:session\|A port must be open for that, but none is\..*
caught(@() kiks('robot_wars.tif'))  %~ kiks:argument\|The arena's file must exist, but 'robot_wars.tif' is neither in .*
kiks('robot_wars')
kiks_siminfo_robotpos()(1:2)  %= [[250.5, 325.5]] +- 1e-4
kiks_quit
kiks_kiksnet('knockknock');

kiks('corridors.tif');
size(kiks_siminfo_robotpos())  %= [[1, 3]]
kiks_arena(imread('corridors.tif') > 128);
size(kiks_siminfo_robotpos())  %= [[1, 3]]

% A controller made for the real robot, with the reference exchanged.
ref = kopen([-1, 9600, 100]);
inputs = [];
for i = 1:20
    inputs(i, :) = [kAmbient(ref)' kProximity(ref)'];
    kSetSpeed(ref, 4, 4);
end
kSetSpeed(ref, 0, 0);
kclose(ref);
size(inputs)  %= [[20, 16]]
"""


def test_pictures_are_arenas_and_sessions_follow_each_other(tmp_path: Path) -> None:
    picture = np.zeros((400, 520), np.uint8)
    picture[:10] = picture[-10:] = 255
    picture[:, :10] = picture[:, -10:] = 255
    picture[130:140, :380] = 200
    picture[260:270, 140:] = 255
    Image.fromarray(picture).save(tmp_path / "corridors.tif")
    done = run(PICTURES, tmp_path)
    said = done.said
    assert said["stack"].shape[0] == 2
    assert said["stack"][:, 0] == pytest.approx([60, 60], abs=2)
    assert said["stack"][0].max() > 300, "it has gone along the first corridor"
    there = r"corridors\. Those of KiKS: .*, track\. The default arena is taken instead\."
    assert re.search(rf"warning: The arena's file must exist, but 'robot_wars' with one of the .*: {there}", done.text)


SPELLINGS = r"""
clear all
ref = kiks_kopen([-1 9600 1]);
before = KGetEncoders(ref);
ksetspeed(ref, 3, -3)
while KGetEncoders(ref)(1) < before(1) + 200
end
kSetspeed(ref, 0, 0);
Kproximity(ref)
kstatus(ref)
[major, protocol] = kbios(ref);
[major protocol]  %= [[5.02, 5.01]]
kiks_siminfo_robotpos()(3) < pi / 2 - 0.5  %= 1
kgetspeed(ref)  %= "a function of the program"
caught(@() ksetspeed(ref))  %~ kiks:argument\|kSetSpeed needs the speeds of both wheels\..*
kiks_kclose(ref);
clear all
ref = kiks_kopen([-1 9600 1]);
kgetencoders(ref)(1) >= 200  %= 1
kiks_kclose(ref);
"""


def test_capitals_of_functions_do_not_matter(tmp_path: Path) -> None:
    (tmp_path / "kgetspeed.m").write_text("function speed = kgetspeed(ref)\nspeed = 'a function of the program';\n")
    done = run(SPELLINGS, tmp_path)
    text = "\n".join(line for line in done.lines if line)
    assert re.match(r"ans = 0\nans =\n( +\d+\n){8}left  wheel: speed mode, error", text)


AGAIN = """
clear all; close all
arena = zeros(300, 300);
arena(200, 150) = -90;
kiks(arena)
port = -1; period = 0.05;
ref = kiks_kopen([port 9600 1]);
kSetSpeed(ref, 5, 5);
for i = 1:5
    t = kiks_ktime(port);
    light(:, i) = kAmbient(ref);
    prox(:, i) = kProximity(ref);
    % Both take 62 ms.
    kiks_pause(period - (kiks_ktime(port) - t))
end
time = kiks_ktime(port);
place = kiks_siminfo_robotpos;
"""


def test_programs_that_clear_all_begin_anew(tmp_path: Path) -> None:
    (tmp_path / "again.m").write_text(AGAIN)
    (tmp_path / "kiks_preferences.m").write_text("KIKS_THINKING = 'none';\n")
    program = r"""
again
say('first', [place time])
again
say('second', [place time])
caught(@() kiks_kopen([-1 9600 1]))  %~ kiks:simulator\|port -1 must be closed before it is opened.*
kiks(zeros(400, 400))
clear all
ref = kiks_kopen([-1 9600 1]);
say('same_world', kiks_siminfo_robotpos())
kiks_quit(1)
"""
    done = run(program, tmp_path)
    said = done.said
    assert said["first"].tolist() == said["second"].tolist()
    assert 200 - said["first"][0, 1] > 5
    assert 0.3 < said["first"][0, 3] < 0.5, "pauses below 0 take no time"
    assert sum("A session is active" in line for line in done.lines) == 1, "that of the prompt, without clear all"
    assert said["same_world"][0] == pytest.approx(said["second"][0, :3], abs=2), "while the port opened, it drove on"


WINDOWS = {
    "kiks_preferences": "function kiks_preferences\n% für alle\nglobal KIKS_NOISE\nKIKS_NOISE = 0; % ohne Rauschen ä\n",
    "drive": "% Größe\nref = kiks_kopen;\nsay('x', kProximity(ref))\n",
}


def test_files_may_be_those_of_windows(tmp_path: Path) -> None:
    for name, text in WINDOWS.items():
        (tmp_path / f"{name}.m").write_text(text, encoding="cp1252", newline="\r\n")
    done = run("drive\nkiks_print('done')\n", tmp_path)
    assert (done.said["x"] == done.said["x"][0]).all(), "without noise, in the middle of the arena"
    assert "constants_of" not in done.text, "nothing but what Octave says of any such file"
