"""Send Ctrl-C and SIGTERM to programs that wait in a thread or in C, at a terminal: each must end within two seconds.

Each program prints `ready` when it is about to wait; the signal comes some moment later. Exit code 1: one did not end
in time, or without a line of KiKS.

    python tools/stuck_programs.py
    python tools/stuck_programs.py --times 2 --only keys
"""

from __future__ import annotations

import argparse
import os
import pty
import random
import signal
import statistics
import sys
import tempfile
import time
from pathlib import Path

MOST_S = 2.0
"""Longest time from the signal to the end [s]."""

GUARD_S = 60.0
"""Longest wait for a program that has not begun, or does not end [s]."""

CTRL_C = b"\x03"

DRIVES = """
port = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)
print("ready", flush=True)
while True:
    port.write(b"N\\n")
    port.readline()
"""

LOCKED = """
lock = ctypes.create_string_buffer(100)
ctypes.CDLL(None).pthread_mutex_lock(lock)
print("ready", flush=True)
ctypes.{}(None).pthread_mutex_lock(lock)
"""

PROGRAMS = {
    "lines in a thread": "def wait():\n    for line in sys.stdin: pass\nthreading.Thread(target=wait).start()" + DRIVES,
    "keys in a thread": "tty.setcbreak(0)\n"
    "def wait():\n    while sys.stdin.read(1): pass\nthreading.Thread(target=wait, daemon=True).start()" + DRIVES,
    "input in a thread": "threading.Thread(target=input).start()" + DRIVES,
    "a terminal of its own": 'ends = pty.openpty()\nprint("ready", flush=True)\nos.read(ends[0], 1)',
    "curses": 'def main(screen):\n    screen.addstr("ready")\n    screen.getch()\ncurses.wrapper(main)',
    "a lock in C": LOCKED.format("CDLL"),
    "a lock in C, with Python's": LOCKED.format("PyDLL"),
    "computes in C": 'print("ready", flush=True)\n0 in itertools.repeat(1)',
    "a query": 'print("ready", flush=True)\nsqlite3.connect(":memory:").execute(\n'
    '    "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c) SELECT max(x) FROM c").fetchall()',
    "a pipe without a writer": 'os.mkfifo("pipe")\nprint("ready", flush=True)\n'
    'threading.Thread(target=open, args=("pipe",)).start()\ntime.sleep(1)',
    "catches everything": 'print("ready", flush=True)\nwhile True:\n    try: time.sleep(1)\n    except: pass',
    "ignores signals": "for each in (signal.SIGINT, signal.SIGTERM): signal.signal(each, signal.SIG_IGN)" + DRIVES,
    "waits for a child": 'print("ready", flush=True)\nsubprocess.run(["sleep", "60"])',
    "a loop": 'print("ready", flush=True)\nwhile True: pass',
}
"""Programs that never end."""

IMPORTS = (
    "import ctypes, curses, itertools, os, pty, serial, signal, sqlite3, subprocess, sys, threading, time, tty\n"
    'assert os.get_terminal_size() and sys.stdin.isatty()\nos.environ.setdefault("TERM", "xterm")\n'
)


def read_to(terminal: int, word: bytes) -> bytes:
    """Return what comes from a terminal up to a word, or up to its end."""
    shown = b""
    while word not in shown:
        try:
            piece = os.read(terminal, 1 << 16)
        except OSError:  # the other end is closed
            break
        shown += piece
    return shown


def end(program: str, number: int, pause_s: float = 0.0, most_s: float = MOST_S) -> tuple[float, str]:
    """Run a program, send it a signal after a pause; return the time to its end [s], and what was amiss."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "program.py").write_text(IMPORTS + program)
        process, terminal = pty.fork()
        if process == 0:
            os.chdir(folder)
            os.execv(sys.executable, [sys.executable, "-P", "-m", "kiks", "run", "program.py"])
        signal.signal(signal.SIGALRM, lambda *_: os.kill(process, signal.SIGKILL))
        signal.setitimer(signal.ITIMER_REAL, GUARD_S)
        shown = read_to(terminal, b"ready")
        time.sleep(pause_s)
        begin_s = time.monotonic()
        if number == signal.SIGINT:
            os.write(terminal, CTRL_C)
        else:
            os.kill(process, number)
        shown += read_to(terminal, b"never")
        _, status = os.waitpid(process, 0)
        took_s = time.monotonic() - begin_s
        signal.setitimer(signal.ITIMER_REAL, 0)
        os.close(terminal)
    said = shown.decode(errors="replace").replace("\r\n", "\n")
    if took_s > most_s or "ready" not in said:
        return took_s, f"{took_s:.2f} s: {said}"
    has_line = "kiks: " in said and "Traceback" not in said.partition("kiks: ")[2]
    return took_s, "" if has_line and status else f"no line of KiKS, or exit code 0: {said}"


def main() -> int:
    """End programs; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=10, help="how often each; Ctrl-C and SIGTERM take turns")
    parser.add_argument("--only", action="append", help="programs whose name has this word; may be given again")
    parser.add_argument("--seed", type=int, default=0, help="the same seed makes the same pauses")
    given = parser.parse_args()
    chance, count, amiss = random.Random(given.seed), 0, 0
    print(f"{'the program':<28}{'times':>7}{'median s':>10}{'worst s':>9}")
    for name, program in PROGRAMS.items():
        if given.only and not any(word in name for word in given.only):
            continue
        times_s = []
        for turn in range(given.times):
            number = (signal.SIGINT, signal.SIGTERM)[turn % 2]
            took_s, found = end(program, number, chance.uniform(0, 0.5))
            times_s.append(took_s)
            if found:
                amiss += 1
                print(f"{name}, {number.name}: {found}", file=sys.stderr, flush=True)
        count += len(times_s)
        print(f"{name:<28}{len(times_s):>7}{statistics.median(times_s):>10.2f}{max(times_s):>9.2f}", flush=True)
    print(f"{count} ends, {amiss} amiss")
    return 1 if amiss else 0


if __name__ == "__main__":
    sys.exit(main())
