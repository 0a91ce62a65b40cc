"""How fast a program on the wire runs: the follow-wall demo at 9600 baud in memory and through a pseudo-terminal.

Run: python benchmarks/wire.py [--json]. Each figure is a median; 'x real time' compares with a real robot, and
`wire.exchange_over_calibration` with a fixed piece of plain Python in the same run.
"""

from __future__ import annotations

import argparse
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from behaviours import Follow

import kiks
from calibration import calibration_loops_per_s, median_of, report
from kiks.cli.doctor import driven_s

ARENA = Path(__file__).parent.parent / "examples" / "arenas" / "office.toml"


@contextmanager
def server(link: Path) -> Iterator[None]:
    """Serve the same robot to other processes, time standing still between commands."""
    command = [sys.executable, "-m", "kiks", "serve", "--thinking", "none", "--arena", str(ARENA), "--seed", "1"]
    with subprocess.Popen([*command, "--link", str(link)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            if re.search(re.escape(str(link)), line):
                break
        try:
            yield
        finally:
            process.terminate()


def pty_run(link: Path, loops: int) -> float:
    """Return the real time [s] of some loops through the pseudo-terminal, client and simulator in two processes."""
    follow = Follow()
    with kiks.Khepera(str(link)) as robot:
        for _ in range(50):
            follow.step(robot)
        start_s = time.perf_counter()
        for _ in range(loops):
            follow.step(robot)
        return time.perf_counter() - start_s


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--loops", type=int, default=4000, help="loops of the demo in memory")
    options = arguments.parse_args()

    calibration = calibration_loops_per_s()
    runs = [driven_s(Follow().step, options.loops) for _ in range(7)]
    memory_speedup = statistics.median(simulated / real for simulated, real in runs)
    exchanges_per_s = statistics.median(2 * options.loops / real for _, real in runs)
    loop_s = runs[0][0] / options.loops
    link = Path("/tmp") / f"kiks-benchmark-{time.time_ns()}"
    pty_loops = options.loops // 2
    with server(link):
        pty_s = median_of(5, lambda: pty_run(link, pty_loops))
    report(
        [
            ("wire.follow_memory_speedup", memory_speedup, "x real time"),
            ("wire.follow_pty_speedup", loop_s * pty_loops / pty_s, "x real time"),
            ("wire.exchanges_per_s", exchanges_per_s, "1/s"),
            ("wire.pty_exchanges_per_s", 2 * pty_loops / pty_s, "1/s"),
            ("wire.exchange_over_calibration", exchanges_per_s / calibration, "exchanges a calibration loop"),
        ],
        as_json=options.json,
    )


if __name__ == "__main__":
    main()
