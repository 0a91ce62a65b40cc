"""Files, pipes and sockets of a program: its files are as old as its clock says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from tests.served import fresh

from kiks.script.runner import run_here

Run = Callable[[str], tuple[int, str]]


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run a program in this process, in an empty folder; return its exit code and what it says."""
    monkeypatch.chdir(tmp_path)

    def run(text: str) -> tuple[int, str]:
        program = tmp_path / "program.py"
        program.write_text(text)
        code = run_here(fresh(), program, [], {})
        out, told = capsys.readouterr()
        return code, out + told

    return run


@pytest.mark.parametrize(
    "text",
    [
        "import socket\nhere, there = socket.socketpair()\nhere.recv(1)\n",
        "import os\nout, into = os.pipe()\nos.read(out, 1)\n",
        "import select, socket\nhere, there = socket.socketpair()\nselect.select([here], [], [])\n",
    ],
)
def test_program_that_waits_for_itself_for_ever_ends_with_one_line(run: Run, text: str) -> None:
    code, told = run(text)
    assert code == 1
    assert told.startswith("kiks: some thread of a program must be able to go on, but all wait for ever: MainThread")
    assert told.count("\n") == 1


AGES = """
import os, shutil, time
from pathlib import Path
def age(name): return round(time.time() - os.path.getmtime(name), 3)
print(time.time() >= os.path.getmtime("program.py"))
file = open("log", "w")
time.sleep(2)
print(age("log"))
file.write("line")
file.flush()
print(age("log"))
time.sleep(1)
file.close()
print(age("log"), round(time.time() - Path("log").stat().st_mtime, 3), [round(time.time() - entry.stat().st_mtime, 3)
      for entry in os.scandir(".") if entry.name == "log"])
os.utime("log", (5e8, 1e9))
print(os.path.getmtime("log"), os.path.getatime("log"))
shutil.copy2("log", "copy")
print(os.path.getmtime("copy"))
os.utime("log")
print(age("log"))
os.rename("log", "old")
time.sleep(1)
print(age("old"))
"""


def test_files_are_as_old_as_the_clock_says(run: Run) -> None:
    assert run(AGES) == (0, "True\n2.0\n0.0\n1.0 1.0 [1.0]\n1000000000.0 500000000.0\n1000000000.0\n0.0\n1.0\n")


def test_ports_are_in_their_folder(run: Run) -> None:
    looks = """
import glob, os, stat
from pathlib import Path
print(glob.glob("/dev/ttyUSB0"), list(glob.iglob("/dev/ttyUSB0")), os.access("/dev/ttyUSB0", os.R_OK | os.W_OK))
print(stat.S_ISCHR(os.stat("/dev/ttyUSB0").st_mode), Path("/dev/ttyUSB77").exists())
print(glob.glob("/dev/ttyUSB*"), [str(path) for path in Path("/dev").glob("ttyUSB*")])
print([name for name in os.listdir("/dev") if "ttyUSB" in name], Path("/dev/ttyUSB0").is_char_device())
print([(entry.path, entry.is_file()) for entry in os.scandir("/dev") if "ttyUSB" in entry.name])
"""
    assert run(looks) == (
        0,
        "['/dev/ttyUSB0'] ['/dev/ttyUSB0'] True\nTrue False\n"
        "['/dev/ttyUSB0'] ['/dev/ttyUSB0']\n['ttyUSB0'] True\n[('/dev/ttyUSB0', False)]\n",
    )
