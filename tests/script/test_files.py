"""Files, pipes and sockets of a program: its files are as old as its clock says."""

from __future__ import annotations

from tests.script.conftest import Run

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
    ran = run(AGES)
    assert ran.code == 0
    assert ran.out == "True\n2.0\n0.0\n1.0 1.0 [1.0]\n1000000000.0 500000000.0\n1000000000.0\n0.0\n1.0\n"


def test_ports_are_in_their_folder(run: Run) -> None:
    ran = run("""
import glob, os, stat
from pathlib import Path
print(glob.glob("/dev/ttyUSB0"), list(glob.iglob("/dev/ttyUSB0")), os.access("/dev/ttyUSB0", os.R_OK | os.W_OK))
print(stat.S_ISCHR(os.stat("/dev/ttyUSB0").st_mode), Path("/dev/ttyUSB77").exists())
print(glob.glob("/dev/ttyUSB*"), [str(path) for path in Path("/dev").glob("ttyUSB*")])
print([name for name in os.listdir("/dev") if "ttyUSB" in name], Path("/dev/ttyUSB0").is_char_device())
print([(entry.path, entry.is_file()) for entry in os.scandir("/dev") if "ttyUSB" in entry.name])
""")
    assert ran.out == (
        "['/dev/ttyUSB0'] ['/dev/ttyUSB0'] True\nTrue False\n"
        "['/dev/ttyUSB0'] ['/dev/ttyUSB0']\n['ttyUSB0'] True\n[('/dev/ttyUSB0', False)]\n"
    )
