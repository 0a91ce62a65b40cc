"""Four programs in one world for a simulated day, with a browser that looks on: memory stays what it is."""

from __future__ import annotations

import os
import random
import tempfile
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from tools.campaigns.processes import Looker, compile_engine, desk
from tools.campaigns.runner import WAIT_FACTOR, Broken, Campaign, Figure, Play

HOURS = 24.0
"""How long the programs drive [h of simulated time]."""

WARM_SHARE = 0.1
"""After which share of it memory is taken for what it is."""

PROGRAMS = 4

LIMIT_S = 7200.0
"""Longest time for it [s]."""

_PROGRAM = """
import sys, time, serial
def tell(hours):
    with open(sys.argv[1], "w") as file:
        file.write(str(hours))
port = serial.Serial("/dev/ttyS0", 9600, timeout=20)
begin_s, told_s = time.time(), 0.0
while True:
    port.write(b"N\\n")
    near = [int(word) for word in port.readline().split(b",")[1:]]
    left, right = (-3, 3) if max(near[:6]) > 300 else (5, 5)
    port.write(b"D,%d,%d\\n" % (left, right))
    port.readline()
    if time.time() - begin_s > told_s:
        tell(told_s / 3600)
        told_s += 36.0
    time.sleep(0.5)
"""


def _memory_mb(process: int) -> float:
    """Return what a process and those that it has started hold of memory of their own [MB]."""
    total = 0.0
    for each in _family(process):
        try:
            lines = Path(f"/proc/{each}/smaps_rollup").read_text(encoding="ascii").splitlines()
        except OSError:
            continue
        total += sum(int(line.split()[1]) for line in lines if line.startswith(("Private_Dirty:", "Swap:"))) / 1024
    return total


def _family(process: int) -> list[int]:
    found = [process]
    for thread in Path(f"/proc/{process}/task").glob("*/children"):
        for child in thread.read_text(encoding="ascii").split():
            found += _family(int(child))
    return found


def _hours(folder: Path) -> float:
    """Return how far the last of the programs has come [h of simulated time]."""
    told = [path.read_text(encoding="ascii") for path in folder.glob("soak*.txt")]
    return min(float(text or 0.0) for text in told) if len(told) == PROGRAMS else 0.0


def _soak(hours: float, rng: random.Random) -> None:
    """Let the programs drive, and compare the memory after the beginning with that at the end.

    Raises:
        Broken: If they do not come to an end.
        Figure: By how much it has grown.
    """
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as folder:
        home = Path(folder)
        words = []
        for number in range(PROGRAMS):
            (home / f"soak{number}.py").write_text(_PROGRAM, encoding="utf-8")
            words += [f"soak{number}.py", str(home / f"soak{number}.txt")]
        with desk(*words, "--robots", str(PROGRAMS), "--speed", "0", "--thinking", "none", folder=home) as (
            command,
            url,
        ):
            is_over = threading.Event()
            frames: list[int] = []
            looker = Looker(url)
            looking = threading.Thread(target=lambda: frames.append(looker.look(1, hold=is_over)), daemon=True)
            looking.start()
            begin_s, warm_mb = time.monotonic(), 0.0
            while _hours(home) < hours:
                time.sleep(1.0)
                if command.process.poll() is not None:
                    raise Broken("death", command.said[-200:], "soak")
                if not looking.is_alive():
                    raise Broken("foreign", "the browser was parted from", "soak")
                if not warm_mb and _hours(home) >= WARM_SHARE * hours:
                    warm_mb = _memory_mb(command.process.pid)
                if time.monotonic() - begin_s > LIMIT_S - 60:
                    raise Broken("hang", f"{_hours(home):g} h of {hours:g} h after {LIMIT_S:g} s", "soak")
            end_mb = _memory_mb(command.process.pid)
            is_over.set()
            looking.join(30.0)
            command.check()
            print(f"{warm_mb:.1f} MB, then {end_mb:.1f} MB; {frames} frames", flush=True)
            raise Figure("growth_mb", end_mb - warm_mb)


def _prepare(hours: float) -> Play:
    compile_engine()
    return partial(_soak, hours)


def campaigns() -> Iterator[Campaign]:
    """Yield the only one; KIKS_TORTURE_HOURS shortens it."""
    hours = float(os.environ.get("KIKS_TORTURE_HOURS", HOURS))
    yield Campaign("soak.day", 1, partial(_prepare, hours), limit_s=LIMIT_S / WAIT_FACTOR)
