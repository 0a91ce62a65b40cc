"""The demos: each runs with its usual arguments and does what its help says."""

import re
from pathlib import Path

import numpy as np
import pytest
from tests.at_length import at_length, share
from tests.matlab.octave import DEMOS, Octave, need_tcp, needs_octave, run
from tests.served import served

from kiks.ports.tcp import TcpEndpoint

pytestmark = [needs_octave, pytest.mark.slow]

SECONDS = share(20, 60)
"""How long most demos run [s of simulated time]."""

WITH_DEMOS = f"addpath('{DEMOS}')\nseconds = {SECONDS};\n"

NAMES = {"avoid", "battle", "camera", "clean", "dance", "follow", "football", "maze", "mv80mm", "siminfo"}


def test_single_robots_avoid_follow_and_measure(tmp_path: Path) -> None:
    done = run(
        WITH_DEMOS
        + """
avoid(-1, 9600, seconds)
say('avoid_path', kiks_siminfo_robotpath())
kiks_arena
follow
ref = kiks_kopen();
say('beside', kProximity(ref))
say('followed', kiks_siminfo_robotpos())
kiks_kclose(ref)
kiks_arena
kiks_demo(9)
say('went', kiks_siminfo_robotdist())
siminfo(-1, 9600, 20)
say('ball', kiks_siminfo_objects())
ref = kiks_kopen();
kiks_pause(0.5)
say('later', kiks_siminfo_objects())
say('speeds', kGetSpeed(ref))
for name = {'avoid', 'follow', 'clean', 'maze', 'mv80mm', 'siminfo', 'camera', 'battle', 'football', 'dance'}
    say(['help_' name{1}], help(name{1}))
end
""",
        tmp_path,
    )
    # avoid: it cruises at 41 mm/s, and in no ten seconds does it stay within 50 mm.
    way_mm, loops_per_s = map(float, re.findall(r"(\d+) mm .* loops, ([\d.]+) a second", done.line("avoid: "))[0])
    assert SECONDS * 25 < way_mm < SECONDS * 45
    assert 10 < loops_per_s < 16
    path = done.said["avoid_path"]
    assert path.shape[1] > SECONDS * 17
    spans = [np.ptp(path[:, at : at + 250], axis=1).max() for at in range(0, path.shape[1] - 250, 50)]
    assert min(spans) > 50
    # follow: the wall is on the left, so it goes round clockwise.
    assert float(re.findall(r"there for (\d+) %", done.line("follow: "))[0]) > 80
    assert done.said["beside"][:2].max() > 60
    assert done.said["followed"][0, 2] < np.pi / 2 - 2
    # mv80mm
    by_time, by_counters = (float(line) for line in re.findall(r"mv80mm: ([\d.]+) mm", done.text))
    assert by_time == pytest.approx(82, abs=2)
    assert by_counters == pytest.approx(80, abs=2)
    assert done.said["went"][0, 0] == pytest.approx(by_time + by_counters, abs=5)
    # siminfo: the ball rolls on when the demo has gone, the robot stands.
    kind, x, y, speed, _ = done.said["ball"][0]
    assert (kind, speed) == (2, pytest.approx(100, abs=20))
    assert np.hypot(*(done.said["later"][0, 1:3] - (x, y))) > 20
    assert not done.said["speeds"].any()
    # Whatever is there has help, and is tested here.
    assert {path.stem for path in DEMOS.glob("*.m")} == NAMES
    for name in NAMES:
        assert re.search(rf"^\s*{name}  Demo: .*\bExample:.*\bSee also ", done.said[f"help_{name}"], flags=re.DOTALL)


@at_length
def test_cylinders_come_to_the_walls_balls_into_the_goal_and_robots_out_of_mazes(tmp_path: Path) -> None:
    done = run(
        WITH_DEMOS
        + """
clean
say('cylinders', kiks_siminfo_objects())
maze
ref = kiks_kopen();
min(kAmbient(ref)) < 75  %= 1
norm(kiks_siminfo_robotpos()(1:2) - kiks_siminfo_objects()(1, 2:3)) < 50  %= 1
kiks_kclose(ref)
football(-1, 9600, seconds)
size(kiks_ktime(-1))  %= [[0, 0]]
""",
        tmp_path,
    )
    found = re.findall(r"back (\d+) times.*\nclean: (\d+) of 12 .* start it was (\d+)", done.text)[0]
    turns, tidy, tidy_before = map(int, found)
    assert turns > 10
    assert tidy > max(6, tidy_before)
    places = done.said["cylinders"][:, 1:3]
    assert places.shape == (12, 2)
    assert (np.minimum(places, 501 - places).min(axis=1) <= 60).sum() == tidy
    assert int(re.findall(r"at the light after .* reads (\d+)", done.line("maze: "))[0]) <= 55
    assert int(re.findall(r"football: (\d+) goals", done.text)[0]) >= share(1, 3)


def test_cameras_show_bands_and_guns_hit_robots(tmp_path: Path) -> None:
    done = run(f"{WITH_DEMOS}camera(-1, 19200, seconds)\nkiks_quit\nbattle(-1, 9600, seconds)\n", tmp_path)
    pictures = re.findall(r"camera: +[\d.]+ s \[(.{64})\]", done.text)
    assert len(pictures) == SECONDS // 5
    assert all(len(set(picture)) >= 3 for picture in pictures)
    darkest, brightest = map(int, re.findall(r"greys from (\d+) to (\d+)", done.text)[0])
    assert darkest < 60
    assert brightest > 220
    reports = re.findall(r"battle: at \((\d+), (\d+)\) mm, angle (\d+), distance (\d+) mm, energy (\d+)", done.text)
    assert SECONDS - 10 <= len(reports) <= SECONDS + 2
    numbers = np.array(reports, int)
    assert (numbers[:, 2] < 360).all()
    assert (np.ptp(numbers[:, :2], axis=0) > 100).any()
    shots, hits = map(int, re.findall(r"battle: (\d+) shots .*, (\d+) of them hit", done.text)[0])
    assert shots >= hits >= 1


def test_two_programs_dance_in_one_world(tmp_path: Path) -> None:
    program = "dance(-1, 9600, 8)\nsay('pose', kiks_siminfo_robotpos())\n"
    with Octave(WITH_DEMOS + program, tmp_path) as leader:
        leader.wait_for_line("dance: waiting for a partner")
        with Octave(WITH_DEMOS + "kiks('--join')\n" + program, tmp_path, shares=leader) as partner:
            partner.finish()
            leader.finish()
    led = int(re.findall(r"led (\d+) figures", leader.text)[0])
    danced, with_whom = map(int, re.findall(r"danced (\d+) figures with robot (\d+)", partner.text)[0])
    assert led == danced >= 4
    assert with_whom == 1
    assert np.hypot(*(leader.said["pose"][0, :2] - (200, 200))) < 40
    assert np.hypot(*(partner.said["pose"][0, :2] - (400, 200))) < 40


def test_demos_drive_robots_on_real_ports(tmp_path: Path) -> None:
    need_tcp()
    endpoint = TcpEndpoint(0)
    with served([endpoint]) as real:
        demos = f"mv80mm('{endpoint.name}')\nfollow('{endpoint.name}', 9600, 2)\n"
        done = run(f"{WITH_DEMOS}{demos}session_number()  %= 0", tmp_path)  # nothing is simulated here
        real.wait_free()
        assert real.sim.travelled_mm(1) > 100
    by_counters = float(re.findall(r"([\d.]+) mm with kMoveTo", done.text)[0])
    assert by_counters == pytest.approx(80, abs=2)
    assert re.search(r"follow: \d+ mm in 2\.\d s, and no wall\.", done.text)
