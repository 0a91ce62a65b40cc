"""Programs that start and stop in a running world, as on the desk."""

import os
import select
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
from tests.ports.helpers import printed, wheels, write
from tests.served import GUARD_S, PROGRAMS, Rounds, fresh

from kiks import KiksError, ParameterError, Simulation
from kiks.clock.gate import Gate
from kiks.ports import programs as module
from kiks.ports.program_command import ProgramCommand
from kiks.ports.program_output import OUTPUT_LIMIT
from kiks.ports.programs import Programs

pytestmark = pytest.mark.slow

DRIVE = ProgramCommand(PROGRAMS / "drive.py", ["COM1", "40", "3", "7"])
SLEEPER = ProgramCommand(PROGRAMS / "sleeper.py", ["12"])

FOR_EVER = """
import serial
port = serial.Serial('COM1', timeout=1)
port.write(b'D,5,5\\n')
print(port.readline(), flush=True)
while True:
    port.write(b'N\\n')
    port.readline()
"""

STUBBORN = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n" + FOR_EVER


class PausedGate(Gate):
    """A gate that says when a thread waits there."""

    def __init__(self, sim: Simulation) -> None:
        super().__init__(sim.lock, speed=None)
        self.is_waited_at = threading.Event()
        self._sim, sim.loop.gate = sim, self

    def hold(self) -> None:
        """Pause the world, and wait until the thread that moves it has noticed."""
        self.pause(self._sim.now_ns)
        assert self.is_waited_at.wait(GUARD_S)

    def wall_ns(self) -> int:
        return 0

    def _sleep(self, seconds: float) -> None:
        self.is_waited_at.set()
        super()._sleep(seconds)


class Driven(Rounds):
    """Programs whose rounds run in a thread."""

    def __init__(self, programs: Programs) -> None:
        super().__init__(self._drive)
        self.programs = programs
        programs.begin()

    def _drive(self, until: Callable[[], bool]) -> None:
        while not until():
            self.programs.round(0.01)


@contextmanager
def driven(sim: Simulation, commands: Sequence[ProgramCommand] = (), **options: Any) -> Iterator[Driven]:
    run = Driven(Programs(sim, commands, keeps_output=True, **{"patience_s": GUARD_S, **options}))
    with closing(run.programs), run.going_on():
        yield run


def test_programs_that_begin_together_give_the_run_of_kiks_run() -> None:
    alone, watched = fresh(2), fresh(2)
    assert Programs(alone, [DRIVE, SLEEPER]).run() == 0
    with driven(watched, [DRIVE, SLEEPER]) as run:
        run.wait_for(lambda: not run.programs.drive)
        assert watched.state_hash() == alone.state_hash()
        assert not run.programs.doubt


def test_program_joins_at_the_present_time(tmp_path: Path) -> None:
    sim = fresh(2)
    sim.run(5)
    text = "import time\nprint(time.monotonic())\ntime.sleep(3)\nprint(time.monotonic())\n"
    first = write(tmp_path / "program.py", text)
    with driven(sim) as run:
        assert not run.programs.drive
        handle = run.programs.start(first, robot=2)
        assert (handle.name, handle.robot, handle.state) == ("program 1 (program.py)", 2, "running")
        run.wait_for(lambda: not handle.is_running and not run.programs.drive)
        assert (printed(handle), handle.state) == (["5.0", "8.0"], "ended with exit code 0")
        assert sim.time_s == 8
        again = run.programs.start(first, robot=2)
        run.wait_for(lambda: not again.is_running)
        assert printed(again) == ["8.0", "11.0"]
        assert run.programs.handles == [again]
        assert run.programs.doubt


@pytest.mark.parametrize("text", [FOR_EVER, STUBBORN], ids=["friendly", "stubborn"])
@pytest.mark.parametrize("is_paused", [False, True], ids=["running", "paused"])
def test_robot_of_a_stopped_program_stands_still_and_is_free(text, is_paused, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "GRACE_S", 0.1)
    sim = fresh()
    gate = PausedGate(sim)
    with driven(sim) as run:
        handle = run.programs.start(write(tmp_path / "program.py", text))
        run.wait_for(lambda: printed(handle) == ["b'd\\r\\n'"])
        assert wheels(sim) == [5, 5]
        with pytest.raises(ParameterError, match=r"robot 1 must be free .* but program 1 \(program.py\) has it"):
            run.programs.start(handle.command)
        if is_paused:
            gate.hold()
        with sim.lock:
            run.programs.stop(handle)
        assert handle.has_ended.wait(GUARD_S)
        assert sim.wires[0].holder is None
        assert handle.state == "stopped"
        assert not any("Traceback" in line for line in printed(handle))
        following = run.programs.start(handle.command)
        gate.go_on()
        run.wait_for(lambda: len(printed(following)) == 1)
        run.programs.stop(following)
        run.wait_for(lambda: not following.is_running and not run.programs.drive)
        sim.run(0.1)
        assert wheels(sim) == [0, 0]


def test_child_processes_end_with_their_program(tmp_path: Path) -> None:
    text = (
        "import subprocess, time\nchild = subprocess.Popen(['cat'], stdin=-1)\n"
        "print(child.pid)\ntime.sleep(1)\nopen('/dev/stdin').read()\n"
        "while True: pass\n"
    )
    with driven(fresh()) as run:
        handle = run.programs.start(write(tmp_path / "program.py", text))
        run.wait_for(lambda: printed(handle))
        child = os.pidfd_open(int(printed(handle)[0]))
        run.programs.stop(handle)
        run.programs.stop(handle)
        assert select.select([child], [], [], GUARD_S)[0]
        os.close(child)


def test_endless_output_is_limited_and_does_not_delay_others(tmp_path: Path) -> None:
    sim = fresh(2)
    floods = write(tmp_path / "program.py", "number = 0\nwhile True:\n    print('x' * 3000, number)\n    number += 1\n")
    with driven(sim) as run:
        handle = run.programs.start(floods)
        other = run.programs.start(DRIVE, robot=2)
        output: Any = handle.output
        run.wait_for(lambda: not other.is_running and output.count > 3 * OUTPUT_LIMIT)
        first, lines = output.since(0)
        assert first > 0
        assert len(lines) == OUTPUT_LIMIT
        assert max(len(line.text) for line in lines) <= 2000


def test_output_and_errors_are_distinguished(tmp_path: Path) -> None:
    text = "import sys\nprint('grün')\nsys.stdout.write('no end')\n1 / 0\n"
    with driven(fresh()) as run:
        handle = run.programs.start(write(tmp_path / "program.py", text))
        run.wait_for(lambda: not handle.is_running)
        output: Any = handle.output
        lines = output.since(0)[1]
        assert [line.text for line in lines if not line.is_error] == ["grün", "no end"]
        errors = [line.text for line in lines if line.is_error]
        assert errors[0] == "Traceback (most recent call last):"
        assert errors[-1] == "ZeroDivisionError: division by zero"
        assert not any("kiks" in line for line in errors)
        assert (handle.code, handle.state) == (1, "ended with exit code 1")


def test_patience_does_not_run_out_while_the_world_is_paused(tmp_path: Path) -> None:
    sim = fresh(2)
    gate = PausedGate(sim)
    with driven(sim, [DRIVE, SLEEPER], patience_s=1e-3, gate=gate) as run:
        run.wait_for(lambda: sim.now_ns > 0)
        gate.hold()
        gate.go_on()
        run.wait_for(lambda: not run.programs.drive)
        assert not run.programs.doubt


def test_mistakes_raise_before_a_program_starts(tmp_path: Path) -> None:
    with driven(fresh()) as run:
        with pytest.raises(ParameterError, match=r"must be a file of Python \(\.py\), .*, but there is none at"):
            run.programs.start(ProgramCommand(tmp_path / "nothing.py"))
        with pytest.raises(ParameterError, match=r"robot must be the number of an existing robot, but it was 2"):
            run.programs.start(DRIVE, robot=2)
        assert run.programs.handles == []
    with pytest.raises(KiksError, match=r"must have a world, but that of drive.py has ended"):
        run.programs.start(DRIVE)
