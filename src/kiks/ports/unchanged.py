"""A whole Python program, unchanged, with simulated robots behind its serial ports and simulated time in its `time`."""

from __future__ import annotations

import runpy
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kiks.clock.virtual import virtual_time
from kiks.errors import KiksError

if TYPE_CHECKING:
    from kiks.ports.port import VirtualPort
    from kiks.sim.simulation import Simulation


@contextmanager
def simulated_ports(open_port: Callable[[str], VirtualPort]) -> Iterator[None]:
    """Let `serial.Serial` and `serial.serial_for_url` open simulated ports, whatever name they are given.

    Args:
        open_port: Returns the port behind a name.
    """
    import serial

    from kiks.ports import url as urls
    from kiks.ports.pyserial import protocol_kiks

    class Serial(protocol_kiks.Serial):
        """What a program gets that asks for a serial port."""

        def find(self, name: str) -> VirtualPort:
            return open_port(name)

    def serial_for_url(url: str, *args: Any, do_not_open: bool = False, **settings: Any) -> Serial:
        port = Serial(None, *args, **settings)
        port.port = url
        if not do_not_open:
            port.open()
        return port

    originals = serial.Serial, serial.serial_for_url, urls.find_port
    serial.Serial, serial.serial_for_url = Serial, serial_for_url  # type: ignore[misc, assignment]
    # `kiks.Khepera` and `kiks.kopen` find their ports by this one.
    urls.find_port = open_port  # type: ignore[assignment]
    try:
        yield
    finally:
        serial.Serial, serial.serial_for_url, urls.find_port = originals  # type: ignore[misc]


def run_here(sim: Simulation, program: Path, arguments: list[str], told: dict[str, int]) -> int:
    """Run a program in this process to its end; return its exit code.

    Args:
        sim: The simulation behind its ports.
        program: The Python file.
        arguments: What it finds in `sys.argv` after its name.
        told: Robots by port name.

    Raises:
        ParameterError: If `told` names a robot that is not there.
    """
    from kiks.ports.memory import SimPort
    from kiks.ports.names import Names
    from kiks.ports.url import find_port

    names = Names(sim, told)

    def open_port(name: str) -> VirtualPort:
        return find_port(name) if name.startswith("kiks:") else SimPort(sim, names.robot(name))

    return run_program(program, arguments, open_port, sim.port(1))


def run_program(
    program: Path, arguments: list[str], open_port: Callable[[str], VirtualPort], clock: VirtualPort
) -> int:
    """Run a program to its end with simulated ports and simulated time; return its exit code.

    Args:
        program: The Python file.
        arguments: What it finds in `sys.argv` after its name.
        open_port: Returns the port behind a name.
        clock: A port of its own, for the time.
    """
    argv_before, path_before = sys.argv, sys.path[:]
    sys.argv = [str(program), *arguments]
    sys.path.insert(0, str(program.resolve().parent))
    try:
        with simulated_ports(open_port), virtual_time(clock.ask_ns, clock.sleep):
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
