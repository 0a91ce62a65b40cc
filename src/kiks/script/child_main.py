"""A program in a process of its own; `programs.py` starts it by `python -m kiks.script.child_main`."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import sys
from pathlib import Path

from kiks.clock.program_clock import ProgramClock
from kiks.clock.thinking import save_thinking
from kiks.errors import KiksError
from kiks.ports.messages import Kind
from kiks.ports.program_process import LATE
from kiks.ports.remote_link import FarLine, SocketConnection
from kiks.script.runner import run_program

DIE_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux (linux/prctl.h)."""


def main(
    descriptor: int, is_late: bool, thinking: str, record: str, offered: list[str], program: Path, arguments: list[str]
) -> int:
    """Run the program to its end; return its exit code.

    Args:
        descriptor: The socket at whose other end the world is.
        is_late: Whether the world may have begun already.
        thinking: What the program's computing costs.
        record: File for the thinking times that were measured; none if empty.
        offered: The port names that the program finds when it looks for ports.
        program: The Python file.
        arguments: What it finds in `sys.argv` after its name.
    """
    if sys.platform == "linux":
        # A program that never talks to the world would not notice that it has gone.
        ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL)
    if os.getpgrp() == os.getpid():
        # Whoever started KiKS may have had Ctrl-C ignored; the desk interrupts a program by it.
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # A process that the program starts has no business with the world.
    os.set_inheritable(descriptor, False)
    connection = SocketConnection(socket.socket(fileno=descriptor), is_late=is_late)
    policy = ProgramClock(thinking)

    try:
        return run_program(
            program,
            arguments,
            lambda robot: FarLine(connection, robot),
            lambda name: connection.ask(Kind.FIND, data=name.encode()).number,
            policy,
            offered,
        )
    except KeyboardInterrupt:
        return 130
    finally:
        connection.tell(Kind.REACHED)
        if record:
            _save(policy.measured_ns, record)


def _save(measured_ns: list[int], record: str) -> None:
    try:
        save_thinking(measured_ns, record)
    except KiksError as error:
        print(f"kiks: {error}", file=sys.stderr)


if __name__ == "__main__":
    descriptor, lateness, thinking, record, offered, program, *arguments = sys.argv[1:]
    sys.exit(main(int(descriptor), lateness == LATE, thinking, record, offered.split(), Path(program), arguments))
