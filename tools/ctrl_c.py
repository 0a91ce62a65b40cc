"""Send Ctrl-C to commands of KiKS at random moments: each must end within a second and leave no process.

It also says what it has done. This is timed, so it needs a computer with nothing else to do, and is no test. On a busy
one, the processor time from Ctrl-C to the end tells what it would be. Exit code 1: something was amiss.

    python tools/ctrl_c.py
    python tools/ctrl_c.py --moments 24 --only several
"""

from __future__ import annotations

import argparse
import os
import random
import re
import resource
import signal
import statistics
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tools.campaigns.processes import compile_engine, started
from tools.campaigns.runner import Broken

MOST_S = 1.0
"""Longest time from Ctrl-C to the end [s]."""

FIRST_S, LAST_S = 0.3, 6.0
"""When Ctrl-C comes [s after the start]: while a command loads, and when it has run for a while."""

PROGRAMS = {
    "sleeps": "import time\nwhile True: time.sleep(1)\n",
    "long_sleep": "import time\ntime.sleep(1e8)\n",
    "long_read": (
        "import serial\nport = serial.Serial('/dev/ttyUSB0', 9600, timeout=1e8)\n"
        "port.write(b'D,4,4\\n')\nport.readline()\nport.readline()\n"
    ),
    "endless": "is_ready = False\nwhile not is_ready:\n    pass\n",
    "threads": (
        "import serial, threading, time\nport = serial.Serial('/dev/ttyUSB0', 9600, timeout=1)\n"
        "def talk():\n    while True:\n        port.write(b'N\\n')\n        port.readline()\n"
        "threading.Thread(target=talk).start()\nwhile True: time.sleep(0.3)\n"
    ),
    "talks": (
        "import serial\nport = serial.Serial('/dev/ttyUSB0', 9600, timeout=1)\n"
        "while True:\n    port.write(b'N\\n')\n    port.readline()\n"
    ),
}
"""Programs that never end."""


@dataclass(frozen=True)
class Kind:
    """Commands of one kind.

    Args:
        words: The command; OUT stands for a new folder.
        summary: What it says when it ends, unless it still loads.
    """

    words: str
    summary: str


RUN, STOPPED = "simulated, seed 0, not repeatable: it was interrupted", "Stopped after"
KINDS = {
    "sleeps": Kind("run sleeps.py", RUN),
    "long_sleep": Kind("run long_sleep.py", RUN),
    "long_read": Kind("run long_read.py", RUN),
    "endless": Kind("run endless.py", RUN),
    "threads": Kind("run threads.py", RUN),
    "recorded": Kind("run --record OUT/run.mcap sleeps.py", RUN),
    "several": Kind("run talks.py sleeps.py", RUN),
    "several_long": Kind("run long_sleep.py long_read.py", RUN),
    "desk": Kind("desk --no-browser --port 0 --no-wait --speed 0 long_sleep.py talks.py", STOPPED),
    "serve": Kind("serve --no-pty --tcp 0 --thinking live --speed 100", STOPPED),
    "evolve": Kind("evolve avoid --out OUT", "the same command continues"),
    "demo": Kind("demo avoid --seconds 86400 --export OUT/picture.png", "it was interrupted"),
    "film": Kind("export --force long.mcap OUT/film.mp4", "kiks: stopped."),
}


def offspring(parent: int) -> set[int]:
    """Return the processes that a process has started, and that these have started."""
    parents: dict[int, int] = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, above = path.read_text().rpartition(")")[2].split()[:2]
        except OSError:
            continue
        if state != "Z":
            parents[int(path.parent.name)] = int(above)
    found: set[int] = set()
    while more := {pid for pid, above in parents.items() if above in found | {parent}} - found:
        found |= more
    return found


def lives(pid: int) -> bool:
    """Return whether a process has not ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def cpu_s(pid: int) -> float:
    """Return the processor time of a process and of the children that it has waited for [s]; 0 if it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def cpu_of_children_s() -> float:
    """Return the processor time of all that has been started here and has ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def interrupt(kind: Kind, moment_s: float, folder: Path) -> tuple[float, float, str]:
    """Interrupt a command after a time; return how long it took to end [s], at what processor time, and what was amiss.

    Raises:
        Broken: If it does not end, dies, shows a traceback, or has no summary.
    """
    with tempfile.TemporaryDirectory(dir=folder) as out:
        before_s = cpu_of_children_s()
        words = [word.replace("OUT", out) for word in kind.words.split()]
        with started(*words, folder=folder, start_new_session=True) as command:
            time.sleep(moment_s)
            children = offspring(command.process.pid)
            before_s += sum(map(cpu_s, {command.process.pid, *children}))
            begin_s = time.monotonic()
            os.killpg(command.process.pid, signal.SIGINT)
            command.end()
            took_s, worked_s = time.monotonic() - begin_s, cpu_of_children_s() - before_s
            left = [pid for pid in children if lives(pid)]
            command.find(f"({re.escape(kind.summary)}|kiks: stopped[.])")
    if left:
        return took_s, worked_s, f"processes are left: {left}"
    return took_s, worked_s, f"{took_s:.2f} s, {worked_s:.2f} s of processor time" if took_s > MOST_S else ""


def main() -> int:
    """Interrupt commands; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, default=200, help="how many, in turns of all kinds")
    parser.add_argument("--only", action="append", choices=KINDS, help="a kind; may be given again")
    parser.add_argument("--seed", type=int, default=0, help="the same seed makes the same moments")
    given = parser.parse_args()
    names, chance = given.only or list(KINDS), random.Random(given.seed)
    compile_engine()
    took: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    amiss: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        for name, text in PROGRAMS.items():
            (home / f"{name}.py").write_text(text)
        with started("run", "--seconds", "3600", "--record", "long.mcap", "talks.py", folder=home) as command:
            command.end()
        for number in range(given.moments):
            name, moment_s = names[number % len(names)], chance.uniform(FIRST_S, LAST_S)
            try:
                took_s, worked_s, found = interrupt(KINDS[name], moment_s, home)
                took[name].append((took_s, worked_s))
            except Broken as broken:
                found = str(broken)
            if found:
                amiss.append(f"{name} after {moment_s:.2f} s: {found}")
                print(amiss[-1], file=sys.stderr, flush=True)
    print(f"{'kind':<16}{'moments':>9}{'median s':>10}{'worst s':>9}{'processor s':>13}{'worst s':>9}")
    for name, each in took.items():
        if each:
            cells = [figure(times) for times in zip(*each, strict=True) for figure in (statistics.median, max)]
            print(f"{name:<16}{len(each):>9}{cells[0]:>10.2f}{cells[1]:>9.2f}{cells[2]:>13.2f}{cells[3]:>9.2f}")
    print(f"{given.moments} moments, {len(amiss)} amiss")
    return 1 if amiss else 0


if __name__ == "__main__":
    sys.exit(main())
