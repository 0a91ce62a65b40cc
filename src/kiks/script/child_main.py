"""The process of a program; `ports/program_process.py` starts it by `python -m kiks.script.child_main`."""

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
from kiks.ports.messages import LATE, Kind
from kiks.ports.remote_link import RemoteLine, SocketConnection
from kiks.script.runner import run_program

DIE_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux (linux/prctl.h)."""


def main(
    descriptor: int,
    is_late: bool,
    end_ns: int,
    thinking: str,
    record: str,
    offered: list[str],
    seed: str,
    module: str,
    program: Path,
    arguments: list[str],
) -> int:
    """Run the program to its end; return its exit code.

    Args:
        descriptor: The socket at whose other end the world is.
        is_late: Whether the world may have begun already.
        end_ns: Where its time ends [ns].
        thinking: The thinking policy.
        record: File for the measured thinking times; empty for none.
        offered: The port names that the program finds when it lists ports.
        seed: What all its random numbers follow from.
        module: Name of a module to run in place of the file, as `python -m` does; empty for none.
        program: Its file, or a folder or an archive with a `__main__.py`.
        arguments: What it finds in `sys.argv` after its name.
    """
    if sys.platform == "linux":
        # A program that never sends a request would not notice that the world has gone.
        ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGKILL)
    if os.getpgrp() == os.getpid():
        # KiKS may have been started with Ctrl-C ignored, but the desk interrupts programs with it.
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Processes that the program starts must not inherit the socket.
    os.set_inheritable(descriptor, False)
    connection = SocketConnection(socket.socket(fileno=descriptor), is_late=is_late, end_ns=end_ns)
    policy = ProgramClock(thinking)

    try:
        # Blocked since the start of the process; what came meanwhile acts here.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        return run_program(
            program,
            arguments,
            lambda robot: RemoteLine(connection, robot),
            lambda name: connection.ask(Kind.FIND, data=name.encode()).number,
            policy,
            offered,
            seed,
            module=module,
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
    descriptor, lateness, end_ns, thinking, record, offered, seed, module, program, *arguments = sys.argv[1:]
    sys.exit(
        main(
            int(descriptor),
            lateness == LATE,
            int(end_ns),
            thinking,
            record,
            offered.split(),
            seed,
            module,
            Path(program),
            arguments,
        )
    )
