"""What grading a class costs: 30 programs in 10 cases of two simulated minutes each, in sandboxes, with the report.

Run: python benchmarks/grading.py [--json] [--submissions 30] [--workers 2] [--trusted]. It grades with `kiks grade`,
and runs trials in this process.

* `grading.class_s`: real time of the command, with tables and report;
* `grading.class_cpu_s`: the time of processors of all its processes;
* `grading.report_mb`: size of the report;
* `grading.overhead_ms`: real time of a run in which the program says one command and ends, in a warm worker and a warm
  sandbox: what a run costs beyond what it simulates; a median;
* `grading.run_ms`: real time of a run of two minutes there; a median;
* `grading.octave_overhead_ms`, `grading.octave_run_ms`: the same with programs of Octave, if `octave-cli` is there;
* `grading.sandbox_ms`: real time of the start of a sandbox, of which each program has one; a median.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import statistics
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from calibration import report
from kiks.model.arena import Arena
from kiks.model.exercise import Cases
from kiks.model.goal import Goal
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.ports.program_process import python_line
from kiks.ports.sandbox import Sandbox
from kiks.trials.one_run import run_trial
from kiks.trials.sandboxes import Sandboxes
from kiks.trials.trial import Trial

PROGRAM = '''
"""Wander about, in the manner of student {number}."""
import serial

port = serial.Serial("/dev/ttyUSB0", 9600, stopbits=2, timeout=2)


def ask(command):
    port.write(command.encode() + b"\\n")
    return [int(word) for word in port.readline().split(b",")[1:]]


while True:
    readings = ask("N")
    if max(readings[1:5]) > {near}:
        ask("D,{turn},-{turn}")
    else:
        ask("D,{speed},{speed}")
    if readings[0] > 900:
        print("close", readings)
'''

ONE_COMMAND = """
import serial
port = serial.Serial("/dev/ttyUSB0", 9600, stopbits=2, timeout=2)
port.write(b"D,5,5\\n")
port.readline()
"""

IN_OCTAVE = {
    "octave_overhead": "ref = kiks_kopen([-1 9600 1]);\nkSetSpeed(ref, 5, 5);\n",
    "octave_run": """
ref = kiks_kopen([-1 9600 1]);
while true
    readings = kProximity(ref);
    if max(readings(2:5)) > 120
        kSetSpeed(ref, 3, -3);
    else
        kSetSpeed(ref, 5, 5);
    end
end
""",
}

GOAL = Goal("Drive far without a contact", points="path_mm / 1000 - contacts")


def exercise(cases: int) -> Project:
    """Return the exercise."""
    return Project(Arena.load("office"), seconds=120.0, goal=GOAL, cases=(Cases(seed=tuple(range(cases))),))


def write_programs(folder: Path, count: int) -> None:
    """Write programs that differ a little."""
    folder.mkdir()
    for number in range(count):
        text = PROGRAM.format(number=number, near=120 + 10 * number, turn=3 + number % 4, speed=5 + number % 6)
        (folder / f"student{number:02}.py").write_text(text)


def single_runs(home: Path, *, is_trusted: bool) -> list[tuple[str, float, str]]:
    """Return the figures of runs in this process."""
    project = replace(exercise(1), cases=())
    (home / "one.py").write_text(ONE_COMMAND)
    figures = []
    sandboxes = Sandboxes()
    runs = [("overhead", home / "one.py", 21), ("run", home / "class" / "student00.py", 5)]
    for (name, text), count in zip(IN_OCTAVE.items(), (21, 3), strict=False):
        if shutil.which("octave-cli"):
            (home / f"{name}.m").write_text(text)
            runs.append((name, home / f"{name}.m", count))
    for name, file, count in runs:
        taken_ms = []
        for number in range(count):
            trial = Trial(f"{name}{number}", replace(project, seed=number), home, (ProgramCommand(file),), is_trusted)
            start_s = time.perf_counter()
            run_trial(trial, home, sandboxes)
            taken_ms.append(1000 * (time.perf_counter() - start_s))
        figures.append((f"grading.{name}_ms", statistics.median(taken_ms[1:]), "ms"))
    sandboxes.close()
    taken_ms = []
    for _ in range(5):
        start_s = time.perf_counter()
        with Sandbox([home / "one.py"], is_trusted=is_trusted) as sandbox:
            sandbox.warm()
            taken_ms.append(1000 * (time.perf_counter() - start_s))
    return [*figures, ("grading.sandbox_ms", statistics.median(taken_ms), "ms")]


def processor_s() -> float:
    """Return the time of processors that child processes have taken that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--submissions", type=int, default=30, help="number of programs")
    arguments.add_argument("--cases", type=int, default=10, help="number of cases")
    arguments.add_argument("--workers", type=int, default=2, help="processes that run worlds")
    arguments.add_argument("--trusted", action="store_true", help="without bubblewrap")
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        write_programs(home / "class", options.submissions)
        figures = single_runs(home, is_trusted=options.trusted)
        exercise(options.cases).save(home / "office.kiks")
        words = ["grade", str(home / "office.kiks"), str(home / "class"), "--out", str(home / "out")]
        words += ["--workers", str(options.workers), *["--trusted"] * options.trusted]
        start_s, before_s = time.perf_counter(), processor_s()
        subprocess.run(python_line("-m", "kiks", *words), check=True, stdout=subprocess.DEVNULL)
        figures.append(("grading.class_s", time.perf_counter() - start_s, "s"))
        figures.append(("grading.class_cpu_s", processor_s() - before_s, "s"))
        figures.append(("grading.report_mb", (home / "out" / "report.html").stat().st_size / 1e6, "MB"))
    report(figures, as_json=options.json)


if __name__ == "__main__":
    main()
