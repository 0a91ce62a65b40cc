"""Threads that wait for a key let the others go on, and every program ends that is told to end."""

import sys
from pathlib import Path

import pytest
from tests import forked
from tests.at_length import cases
from tests.guard import GUARD_S
from tests.served import PROGRAMS, called
from tools import stuck_programs

DRIVES = """
import curses, os, serial, sys, termios, threading, time, tty
keys = []
def wait():
    {}
threading.Thread(target=wait, daemon=True).start()
port = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)
count = 0
while not keys:
    port.write(b"N\\n")
    port.readline()
    count += 1
    if count == 20:
        print("ready", flush=True)
print(repr(keys[0]).lstrip("b"), count >= 20)
"""

UNTIL_A_KEY = """settings = termios.tcgetattr(0)
    settings[3] &= ~termios.ICANON
    settings[6][termios.VMIN], settings[6][termios.VTIME] = 0, 1
    termios.tcsetattr(0, termios.TCSANOW, settings)
    while not (key := os.read(0, 1)): pass
    keys.append(key)"""

WAITS = {
    "for line in sys.stdin: keys.append(line)": "'q\\n'",
    "tty.setcbreak(0); keys.append(sys.stdin.read(1))": "'q'",
    "keys.append(input())": "'q'",
    "keys.append(os.read(0, 100))": "'q\\n'",
    "keys.append(sys.stdin.buffer.raw.read(1))": "'q'",
    "keys.append(open(os.ttyname(0)).readline())": "'q\\n'",
    "curses.initscr(); keys.append(curses.newwin(1, 1).getkey()); curses.endwin()": "'q'",
    UNTIL_A_KEY: "'q'",
}


@pytest.mark.parametrize(("wait", "key"), cases(WAITS.items(), 2))
def test_threads_go_on_while_one_waits_for_a_key(wait: str, key: str, tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(DRIVES.format(wait))
    words = [*forked.kiks_command(), "run", str(tmp_path / "program.py")]
    if wait == UNTIL_A_KEY:
        (tmp_path / "beside.py").touch()
        words.append(str(tmp_path / "beside.py"))
    done = called(sys.executable, PROGRAMS / "on_terminal.py", *words)
    assert done.returncode == 0, done.stdout
    assert f"{key} True\n" in done.stdout
    assert done.stdout.endswith("not repeatable: it looked for keys\n")


@pytest.mark.parametrize(
    ("name", "number"), cases([(name, number) for name in stuck_programs.PROGRAMS for number in (2, 15)], 2)
)
def test_a_program_ends_whatever_it_waits_for(name: str, number: int) -> None:
    _, amiss = stuck_programs.end(stuck_programs.PROGRAMS[name], number, most_s=GUARD_S)
    assert not amiss
