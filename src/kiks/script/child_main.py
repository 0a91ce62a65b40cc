"""The process of a program; `ports/program_process.py` starts it by `python -m kiks.script.child_main`."""

from __future__ import annotations

import gc
import json
import os
import signal
import socket
import sys
from pathlib import Path

from kiks import upwards
from kiks.clock.program_clock import ProgramClock
from kiks.clock.thinking import save_thinking
from kiks.ending import end_with_parent
from kiks.errors import KiksError
from kiks.model.program_kinds import ProgramKind, program_kind
from kiks.ports.link import RemoteLine, SocketLink
from kiks.ports.messages import Start, Verb
from kiks.script.runner import ProgramRun


def main(descriptor: int, start: Start) -> int:
    """Run the program to its end; return its exit code.

    Args:
        descriptor: The socket at whose other end the world is.
        start: The program, and what it finds.
    """
    # A program that never sends a request would not notice that the world has gone.
    end_with_parent()
    if os.getpgrp() == os.getpid():
        # KiKS may have been started with Ctrl-C ignored, but the desk interrupts programs with it.
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Processes that the program starts must not inherit the socket.
    os.set_inheritable(descriptor, False)
    link = SocketLink(socket.socket(fileno=descriptor), is_late=start.is_late, end_ns=start.end_ns)
    policy = ProgramClock(start.thinking)
    # What is loaded by now stays to the end: no collection looks at it again.
    gc.freeze()

    try:
        # Blocked since the start of the process; what came meanwhile acts here.
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        if program_kind(Path(start.program)) is ProgramKind.OCTAVE:
            return upwards.run_octave(link, start, policy)
        program = ProgramRun(
            start,
            lambda robot: RemoteLine(link, robot),
            lambda name: int(link.ask(Verb.FIND, 0, name).result),
            policy,
            link.consult if start.is_debugged else None,
        )
        return program.run()
    except KiksError as error:
        print(f"kiks: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    finally:
        if policy.doubt:
            link.send(Verb.DOUBT, 0, policy.doubt)
        link.send(Verb.REACHED)
        if start.record:
            try:
                save_thinking(policy.measured_ns, start.record)
            except KiksError as error:
                print(f"kiks: {error}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), Start(*json.loads(sys.argv[2]))))
