"""A whole Python program, unchanged, with simulated robots behind its serial ports and simulated time in its `time`."""

from __future__ import annotations

import runpy
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kiks.clock.virtual import virtual_time
from kiks.errors import KiksError, LinkError
from kiks.ports.memory import SimPort
from kiks.sim.simulation import Simulation


class Assignment:
    """Which robot answers on which port name: as told, and otherwise in the order in which new names are opened."""

    def __init__(self, sim: Simulation, told: dict[str, int]) -> None:
        for robot in told.values():
            sim.port(robot)
        self.sim = sim
        self._robots = dict(told)

    def port(self, name: str) -> SimPort:
        """Return the port behind a name.

        Raises:
            LinkError: If every robot has a name already.
        """
        if name.startswith("kiks:"):
            from kiks.ports.url import find_port

            return find_port(name)
        if name not in self._robots:
            taken = set(self._robots.values())
            free = [robot for robot in range(1, self.sim.robot_count + 1) if robot not in taken]
            if not free:
                raise LinkError(
                    f"a port must belong to a robot, but {name!r} is one more than there are: {self._robots}. "
                    f"Run it with --robots {self.sim.robot_count + 1}, or map two names to one robot with --map."
                )
            self._robots[name] = free[0]
        return SimPort(self.sim, self._robots[name])


@contextmanager
def simulated_ports(assignment: Assignment) -> Iterator[None]:
    """Let `serial.Serial` and `serial.serial_for_url` open simulated ports, whatever name they are given."""
    import serial

    from kiks.ports.pyserial import protocol_kiks

    class Serial(protocol_kiks.Serial):
        """What a program gets that asks for a serial port."""

        def find(self, name: str) -> SimPort:
            return assignment.port(name)

    def serial_for_url(url: str, *args: Any, do_not_open: bool = False, **settings: Any) -> Serial:
        port = Serial(None, *args, **settings)
        port.port = url
        if not do_not_open:
            port.open()
        return port

    originals = serial.Serial, serial.serial_for_url
    serial.Serial, serial.serial_for_url = Serial, serial_for_url  # type: ignore[misc, assignment]
    try:
        yield
    finally:
        serial.Serial, serial.serial_for_url = originals  # type: ignore[misc]


def run_program(sim: Simulation, program: Path, arguments: list[str], told: dict[str, int]) -> int:
    """Run a program to its end; return its exit code.

    Args:
        sim: The simulation behind its ports.
        program: The Python file.
        arguments: What it finds in `sys.argv` after its name.
        told: Robots by port name.

    Raises:
        ParameterError: If `told` names a robot that is not there.
    """
    assignment = Assignment(sim, told)
    clock = sim.port(1)
    argv_before, path_before = sys.argv, sys.path[:]
    sys.argv = [str(program), *arguments]
    sys.path.insert(0, str(program.resolve().parent))
    try:
        with simulated_ports(assignment), virtual_time(clock.ask_ns, clock.sleep):
            runpy.run_path(str(program), run_name="__main__")
    except SystemExit as leaving:
        return (
            leaving.code
            if isinstance(leaving.code, int)
            else (0 if leaving.code is None else _complain(str(leaving.code)))
        )
    except KiksError as error:
        return _complain(f"kiks: {error}")
    except Exception as error:
        _print_program_trace(error)
        return 1
    finally:
        sys.argv = argv_before
        sys.path[:] = path_before
    return 0


def _complain(text: str) -> int:
    print(text, file=sys.stderr)
    return 1


def _print_program_trace(error: Exception) -> None:
    """Show the program's own error as Python would, without the frames of KiKS and runpy above and below it."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [
        frame
        for frame in frames
        if "runpy" not in frame.filename and str(Path(__file__).parent.parent) not in frame.filename
    ]
    print("Traceback (most recent call last):", file=sys.stderr)
    print("".join(traceback.format_list(own)), end="", file=sys.stderr)
    print("".join(traceback.format_exception_only(error)), end="", file=sys.stderr)
