"""Programs in `examples/programs` run as they stand, on the way that each is for, and scripts of the gallery do."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from PIL import Image
from tests import forked
from tests.at_length import cases
from tests.served import GUARD_S, served

import kiks
from kiks.ports.pty import PtyEndpoint
from kiks.ports.tcp import TcpEndpoint

ROOT = Path(__file__).parents[2]
PROGRAMS, GALLERY = ROOT / "examples" / "programs", ROOT / "examples" / "gallery"
ALONE = sorted({path.name for path in PROGRAMS.glob("*.py")} - {"follower.py", "two_robots.py"})

pytestmark = pytest.mark.slow


def drive(*words: str, cwd: Path, robots: int = 1) -> None:
    """Run programs; check that each robot has driven, and touched next to nothing."""
    result = forked.run("run", "--seconds", "30", *words, cwd=cwd)
    assert result.returncode == 0, result.stderr
    found = re.findall(r"robot \d+: (\S+) m driven, (\d+) contact", result.stderr)
    assert len(found) == robots, result.stderr
    assert all(float(way_m) > 0.015 and int(contacts) < 3 for way_m, contacts in found), result.stderr


@pytest.mark.parametrize("name", ALONE)
def test_a_program_drives_alone(name: str, tmp_path: Path) -> None:
    drive("--arena", "office", str(PROGRAMS / name), cwd=tmp_path)


def test_one_program_drives_two_robots_a_program_follows_another_or_takes_an_exercise(tmp_path: Path) -> None:
    drive("--robots", "2", str(PROGRAMS / "two_robots.py"), cwd=tmp_path, robots=2)
    drive(str(PROGRAMS / "leader.py"), str(PROGRAMS / "follower.py"), cwd=tmp_path, robots=2)
    drive(str(ROOT / "examples" / "exercises" / "lamp"), str(PROGRAMS / "to_the_light.py"), cwd=tmp_path)


def maze() -> kiks.Simulation:
    return kiks.Simulation(kiks.Arena.load("maze"), seed=1)


def turns(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=GUARD_S, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_programs_in_c_and_java_drive_as_one_in_python(tmp_path: Path) -> None:
    sim, expected = maze(), 0
    robot = kiks.Khepera(sim.port(1))
    for _ in range(200):
        is_near = max(robot.proximity()[1:5]) > 200
        robot.set_speed(*((4, -4) if is_near else (6, 6)))
        expected += is_near
    robot.set_speed(0, 0)
    assert expected > 0
    if compiler := shutil.which("gcc"):
        program = str(tmp_path / "wander")
        subprocess.run([compiler, "-Wall", "-Werror", "-o", program, PROGRAMS / "wander.c"], check=True, timeout=60)
        with served([PtyEndpoint(str(tmp_path / "link"))], sim=maze()) as run:
            assert turns(program, str(tmp_path / "link"), "200") == f"turned {expected} times\n"
            assert run.sim.state_hash() == sim.state_hash()
    if java := shutil.which("java"):
        endpoint = TcpEndpoint(0)
        with served([endpoint], sim=maze()) as run:
            words = "localhost", str(endpoint.port), "200"
            assert turns(java, str(PROGRAMS / "Wander.java"), *words) == f"turned {expected} times\n"
            assert run.sim.state_hash() == sim.state_hash()


@pytest.mark.parametrize("name", cases(sorted(path.stem for path in GALLERY.glob("*.py"))))
def test_a_script_leaves_a_picture(name: str, tmp_path: Path) -> None:
    """`make docs` runs all of them for the site and ends with the first that fails, so that `make test` has one."""
    code = (GALLERY / f"{name}.py").read_text(encoding="utf-8")
    result = forked.run(code=code, cwd=tmp_path, env={"MPLBACKEND": "agg"})
    assert result.returncode == 0, result.stderr
    assert result.stdout
    pictures = [path for path in tmp_path.iterdir() if path.suffix in (".png", ".webp")]
    assert pictures
    for path in pictures:
        assert path.stem.startswith(name)
        with Image.open(path) as picture:
            assert min(picture.size) > 200
