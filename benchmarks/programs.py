"""How fast programs run: several in one world, each in its own process, and one with threads beside a plain one.

Each sends D and N in a loop at 9600 baud. Run: python benchmarks/programs.py [--json]. Each figure is a median, from
the first command to the last end.

`programs.sandbox_start_ms` and `programs.sandbox_run_ms` are of a program in a warm sandbox (`bwrap`): from its start
to its first command, and to the end of a run in which it sends no other.

The programs of `programs.match_*` play soccer (`kiks demo soccer`):

* `programs.match_start_s`: real time from the start of their processes to the first command;
* `programs.match_s`: real time of a simulated minute, without the start;
* `programs.match_cpu_s`: the time of processors of all processes in it;
* `programs.match_over_calibration`: that time in repetitions of a fixed piece of plain Python, of the same run.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import logging
import resource
import shutil
import statistics
import tempfile
import time
from pathlib import Path

import kiks
from calibration import calibration_loops_per_s, report
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand, project_commands
from kiks.ports.programs import Programs
from kiks.ports.sandbox import Sandbox
from kiks.script.runner import run_here
from kiks.sim.from_project import simulation_of
from kiks.sim.supervision import Supervision
from kiks.units import ns_from_s

SOCCER = Path(__file__).parent.parent / "examples" / "soccer"

SOURCE = """
import sys, serial
port = serial.Serial("/dev/ttyUSB0", 9600, stopbits=2, timeout=2)
for loop in range(int(sys.argv[1])):
    port.write(b"D,5,%d\\n" % (loop % 9)); port.readline()
    port.write(b"N\\n"); port.readline()
"""

THREADED = """
import queue, sys, threading, serial
port = serial.Serial("/dev/ttyUSB0", 9600, stopbits=2, timeout=2)
lines, is_running = queue.Queue(), True

def read():
    while is_running:
        line = port.readline()
        if line:
            lines.put(line)

reader = threading.Thread(target=read)
reader.start()
for loop in range(int(sys.argv[1])):
    port.write(b"D,5,%d\\n" % (loop % 9)); lines.get()
    port.write(b"N\\n"); lines.get()
is_running = False
reader.join()
"""


def run_alone(program: Path, loops: int) -> float:
    """Return how many times faster than real time a program runs that is alone in this process."""
    sim = kiks.Simulation(seed=1)
    start_s = time.perf_counter()
    if run_here(sim, program, [str(loops)], {}):
        raise SystemExit("the program has failed")
    return sim.time_s / (time.perf_counter() - start_s)


def run(program: Path, count: int, loops: int) -> tuple[float, float]:
    """Return simulated and real time [s] of some programs, their start left out."""
    sim = kiks.Simulation(robots=count, seed=1)
    programs = Programs(sim, [ProgramCommand(program, [str(loops)])] * count)
    programs.begin()
    while sim.now_ns == 0:
        programs.round(0.05)
    start_s = time.perf_counter()
    programs.run()
    return sim.time_s, time.perf_counter() - start_s


def match(seconds: float) -> tuple[float, float, float]:
    """Return the real time [s] of a match and that of its start, and the time of processors in both."""
    project = Project.load(SOCCER / "soccer.kiks")
    sim = simulation_of(project, SOCCER)
    programs = Programs(sim, project_commands(project, SOCCER), when_silent="wait")
    sim.loop.end_at(ns_from_s(seconds), lambda: programs.end(0, ""))
    referee = Supervision(sim, SOCCER / "referee.py")
    start_s, cpu_s = time.perf_counter(), processor_s()
    programs.begin()
    while programs.sim.now_ns == 0:
        programs.round(0.05)
    begin_s = time.perf_counter()
    with contextlib.redirect_stdout(io.StringIO()):
        programs.run()
        referee.close()
    return time.perf_counter() - begin_s, begin_s - start_s, processor_s() - cpu_s


def processor_s() -> float:
    """Return the time of processors that this process and its children that have ended have taken [s]."""
    used = [resource.getrusage(each) for each in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


ONE_COMMAND = """
import serial
port = serial.Serial("/dev/ttyUSB0", 9600, stopbits=2, timeout=2)
port.write(b"N\\n"); port.readline()
"""


def sandbox_figures(folder: Path) -> list[tuple[str, float, str]]:
    """Return the figures of starts in a warm sandbox."""
    program = folder / "one_command.py"
    program.write_text(ONE_COMMAND)
    starts, runs = [], []
    with Sandbox([program]) as sandbox:
        sandbox.warm()
        for _ in range(30):
            programs = Programs(kiks.Simulation(seed=1), [ProgramCommand(program)], keeps_output=True, sandbox=sandbox)
            start_s = time.perf_counter()
            programs.begin()
            while not programs.handles[0].is_here:
                programs.round(0.05)
            starts.append(time.perf_counter() - start_s)
            programs.run()
            runs.append(time.perf_counter() - start_s)
    return [
        ("programs.sandbox_start_ms", 1e3 * statistics.median(starts), "ms"),
        ("programs.sandbox_run_ms", 1e3 * statistics.median(runs), "ms"),
    ]


def match_figures() -> list[tuple[str, float, str]]:
    """Return the figures of soccer matches; the difference of two lengths leaves out the start."""
    pairs, costs, ratios = [], [], []
    for _ in range(5):
        short, long = match(10.0), match(70.0)
        pairs.append((short, long))
        costs.append(long[2] - short[2])
        ratios.append(costs[-1] * calibration_loops_per_s(time.process_time))
    return [
        ("programs.match_start_s", statistics.median(each[1] for pair in pairs for each in pair), "s"),
        ("programs.match_s", statistics.median(long[0] - short[0] for short, long in pairs), "s a minute"),
        ("programs.match_cpu_s", statistics.median(costs), "s a minute"),
        ("programs.match_over_calibration", statistics.median(ratios), "repetitions a minute"),
    ]


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--loops", type=int, default=5000, help="loops of each program")
    options = arguments.parse_args()
    logging.getLogger("kiks.run").setLevel(logging.ERROR)
    figures = []
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "program.py"
        program.write_text(SOURCE)
        threaded = Path(folder) / "threaded.py"
        threaded.write_text(THREADED)
        pairs = [(run_alone(threaded, options.loops), run_alone(program, options.loops)) for _ in range(7)][1:]
        figures.append(("programs.threaded_speedup", statistics.median(pair[0] for pair in pairs), "x real time"))
        figures.append(("programs.threaded_over_plain", statistics.median(a / b for a, b in pairs), "times as fast"))
        for count in (2, 4):
            runs = [run(program, count, options.loops) for _ in range(5)]
            speedup = statistics.median(simulated / real for simulated, real in runs)
            exchanges = statistics.median(2 * count * options.loops / real for _, real in runs)
            figures.append((f"programs.{count}_speedup", speedup, "x real time"))
            figures.append((f"programs.{count}_exchanges_per_s", exchanges, "1/s"))
        figures += sandbox_figures(Path(folder)) if shutil.which("bwrap") else []
    figures += match_figures()
    report(figures, as_json=options.json)


if __name__ == "__main__":
    main()
