"""The current folder may be an unpacked hand-in: KiKS runs no file of it, and takes no settings from it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.at_length import at_length, cases
from tests.guard import GUARD_S
from tests.served import PROGRAMS
from tools.campaigns.processes import hand_in

import kiks

pytestmark = pytest.mark.slow

KIKS = str(Path(sys.executable).with_name("kiks"))
WANDER = str(PROGRAMS / "wander.py")

EVOLVE = ("evolve", "--generations", "1", "--population", "4", "--out", "OUT/evolved")

COMMANDS = {
    "run": ("run", "--record", "OUT/run.mcap", WANDER, WANDER),
    "desk": ("desk", "--port", "0", "--no-browser"),
    "figures": ("export", "OUT/sound.mcap", "OUT/plot.png", "--kind", "figures"),
    "replay": ("replay", "--check", "OUT/sound.mcap"),
    "page": ("export", "OUT/sound.mcap", "OUT/page.html"),
    "film": ("export", "OUT/sound.mcap", "OUT/film.gif"),
    "table": ("export", "OUT/sound.mcap", "OUT/poses.csv"),
    "demo": ("demo", "clean", "--seconds", "1", "--export", "OUT/clean.png"),
    "evolve": EVOLVE,
    "evolve on Ray": (*EVOLVE, "--cluster", "local"),
    "arena": ("arena", "maze", "OUT/maze.toml"),
    "warmup": ("warmup",),
    "schema": ("schema", "robot"),
    "serve": ("serve", "--no-pty", "--tcp", "0"),
    "session": ("session",),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return hand_in(tmp_path)


def ran(folder: Path) -> str:
    trace = folder.parent / "ran"
    return trace.read_text() if trace.exists() else ""


@pytest.mark.parametrize("name", cases(COMMANDS, 2))
def test_no_command_runs_what_lies_in_the_current_folder(name: str, folder: Path) -> None:
    if name == "evolve on Ray":
        pytest.importorskip("ray")
    sim = kiks.Simulation(kiks.Arena.box(300, 300), seed=1)
    with sim.record(folder.parent / "sound.mcap"):
        sim.run(1.1)
    words = [word.replace("OUT", str(folder.parent)) for word in COMMANDS[name]]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    said = []
    with subprocess.Popen([KIKS, *words], cwd=folder, env=environment, text=True, **pipes) as process:
        for line in process.stdout:
            said.append(line)
            if "http://" in line or "socket://" in line:
                process.send_signal(signal.SIGINT)
        assert process.wait(GUARD_S) in (0, 130), said
    assert ran(folder) == ""


def test_no_helper_that_compiles_runs_it_but_python_does(folder: Path) -> None:
    program = (
        "import os\nfrom kiks.cli import engine_start\n"
        "os.sched_getaffinity = lambda _: {0, 1}\n"
        "def _read_light(): pass\n"  # here; its helper calls the piece of this name
        "engine_start._compile_together([_read_light] * 2)\n"
    )
    subprocess.run([sys.executable, "-P", "-c", program], cwd=folder, check=True)
    assert ran(folder) == ""
    subprocess.run([sys.executable, "-c", "import random"], cwd=folder, check=False)
    assert ran(folder)  # random.py, or under Python 3.13 first linecache.py, which -c needs


@at_length
def test_what_libraries_start_runs_it_neither(folder: Path) -> None:
    program = (
        "import multiprocessing\nfrom kiks import __main__\n"
        "import kiks.cli\nkiks.cli.main = lambda: None\n__main__.main()\n"
        "with multiprocessing.get_context('spawn').Pool(1) as pool:\n    print(pool.apply(len, ('four',)))\n"
    )
    # Its own main module is no file, which multiprocessing would run again.
    done = subprocess.run([sys.executable, "-P", "-c", program], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stdout == "4\n"
    assert ran(folder) == ""


def test_a_program_starts_processes_as_without_kiks(tmp_path: Path) -> None:
    program = tmp_path / "starts.py"
    program.write_text("import os\nprint(os.environ.get('PYTHONSAFEPATH'))\n")
    done = subprocess.run([KIKS, "run", program], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("None\n")
