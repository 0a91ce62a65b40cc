"""The debugger: how fast a followed program runs, and how long it takes to go back in a run of a minute.

The program reads its sensors and drives, 9600 baud, until it meets a wall near the end. Run:
python benchmarks/debugging.py [--json]. Each figure is a median.

* `debugging.times_real`: simulated time over real time of the run, followed, without a breakpoint;
* `debugging.over_plain`: its real time over that of the same run in a process of its own that nothing follows;
* `debugging.back_s`: real time to go back one line from the end, and `debugging.back_over_plain`, over that run;
* `debugging.contact_s`: real time to go back from the end to the line before the contact (`when contacts == 1`);
* `debugging.equal_count`: of a hundred places in the run, chosen by chance, and a step back from each: how many showed
  the line and the variables that the first run had there. All must.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import random
import statistics
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from calibration import report
from kiks.debug.session import DebugSession, Stop
from kiks.model.arena import Arena
from kiks.model.project import Project
from kiks.ports.program_command import ProgramCommand
from kiks.run import Run

SOURCE = """
import serial
port = serial.Serial("/dev/ttyUSB0", 9600, stopbits=2, timeout=2)
trace = []

def ask(command):
    port.write(command)
    return port.readline()

for loop in range(1000):
    values = [int(each) for each in ask(b"N\\n").split(b",")[1:]]
    speeds = (8, 8) if loop > 920 else (loop % 7 - 3, 3 - loop % 7)
    place = ask(b"H\\n")
    ask(b"D,%d,%d\\n" % speeds)
end = loop
"""
LAST = 15
"""Its last line."""


class Followed:
    """A run with a debugger, whose thread lives until `end`."""

    def __init__(self, program: Path, line: int = LAST) -> None:
        self._program, self._stopped, self._stop = program, threading.Condition(), []
        self.session = DebugSession(self._tell, self._make_again)
        self.session.has_editor = True
        self.session.set_breakpoints(str(program), [{"line": line}])
        self._goes_again, self._programs = True, None
        self._thread = threading.Thread(target=self._live)
        self._thread.start()

    def _live(self) -> None:
        while self._goes_again:
            self._goes_again = False
            with Run.of(Project(arena=Arena.default()), Path(), [ProgramCommand(self._program)]) as run:
                run.supervise()
                self._programs = run.take_programs(consult=self.session.consult)
                self.session.begin(run)
                self._programs.run()

    def _make_again(self) -> None:
        self._goes_again = True
        self._programs.end_soon(0, "")

    def _tell(self, event: str, body: dict[str, Any]) -> None:
        with self._stopped:
            if event == "stopped":
                self._stop.append(body)
            self._stopped.notify_all()

    def stop(self) -> dict[str, Any]:
        """Wait until the program stands; return where."""
        with self._stopped:
            self._stopped.wait_for(lambda: self._stop)
            return self._stop.pop()

    def look(self) -> tuple[int, str]:
        """Return the line at which it stands, its variables and its robot."""
        stop: Stop = self.session.stop
        names = "[globals().get(name) for name in ('loop', 'values', 'speeds', 'place')], repr(kiks.here)"
        frame = self.session.ask("stackTrace", {"threadId": stop.thread}).result()["stackFrames"][0]
        shown = self.session.ask("evaluate", {"expression": names, "frameId": frame["id"]}).result()
        return stop.line, shown["result"]

    def go(self, how: str, **given: Any) -> float:
        """Go back, or on; return the real time that it takes [s]."""
        begin_s = time.perf_counter()
        self.session.back(**given).result() if how == "back" else self.session.go_on(how)
        self.stop()
        return time.perf_counter() - begin_s

    def end(self) -> None:
        """Let the program end."""
        self.session.set_breakpoints(str(self._program), [])
        self.session.go_on()
        self._thread.join()


def equal_count(program: Path) -> int:
    """Return how many of a hundred places, and steps back from them, show what was there in the first run."""
    run, chance = Followed(program, line=3), random.Random(7)
    run.stop()
    trace = {}
    for _ in range(1500):
        trace[run.session.stop.count] = run.look()
        last_ns = run.session.stop.time_ns
        run.go("stepIn")
    equal = 0
    for _ in range(50):
        run.go("back", time_ns=chance.randrange(1, last_ns))
        equal += run.look() == trace[run.session.stop.count]
        run.go("back")
        equal += run.look() == trace[run.session.stop.count]
        # The next place may be later, and one goes back alone.
        while run.session.stop.count < 1490:
            run.session.set_breakpoints(str(program), [{"line": 14, "hitCondition": "130"}])
            run.go("continue")
    run.end()
    return equal


def measure(rounds: int) -> dict[str, float]:
    """Return the figures."""
    found: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "program.py")
        program.write_text(SOURCE)
        for _ in range(rounds):
            plain = Run.of(Project(arena=Arena.default()), Path(), [ProgramCommand(program)])
            with plain:
                programs = plain.take_programs()
                begin_s = time.perf_counter()
                programs.run()
                plain_s, time_s = time.perf_counter() - begin_s, plain.sim.time_s
            begin_s = time.perf_counter()
            run = Followed(program)
            run.stop()
            followed_s = time.perf_counter() - begin_s
            back_s = run.go("back")
            contact_s = run.go("back", when="contacts == 1")
            run.end()
            for name, value in {
                "times_real": time_s / followed_s,
                "over_plain": followed_s / plain_s,
                "back_s": back_s,
                "back_over_plain": back_s / plain_s,
                "contact_s": contact_s,
            }.items():
                found.setdefault(name, []).append(value)
        return {name: statistics.median(values) for name, values in found.items()} | {
            "equal_count": equal_count(program)
        }


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--rounds", type=int, default=5, help="number of runs of each kind")
    given = parser.parse_args()
    with contextlib.redirect_stdout(io.StringIO()):
        figures = measure(given.rounds)
    units = {"times_real": "x real time", "back_s": "s", "contact_s": "s", "equal_count": "of 100"}
    report([(f"debugging.{name}", each, units.get(name, "")) for name, each in figures.items()], as_json=given.json)


if __name__ == "__main__":
    main()
