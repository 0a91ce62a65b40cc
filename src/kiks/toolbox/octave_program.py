"""A program of Octave in a world that is there already: `kiks run ann.m`, and what a class hands in.

The process that KiKS starts for each program (`script/child_main.py`) is the session here. It starts Octave, with a
pipe in each direction, and answers the requests of the toolbox. They reach the world by the link that a program
of Python has, so the world treats both alike. Its clock is the world's from the start, and its thinking time is that of
the world, so a run repeats.
"""

from __future__ import annotations

import hashlib
import os
import platform
import struct
import subprocess
from pathlib import Path

from kiks.clock.program_clock import ProgramClock
from kiks.ending import end_with_parent
from kiks.errors import KiksError
from kiks.model.package import shipped
from kiks.model.program_kinds import octave, why_not
from kiks.ports.link import Link
from kiks.ports.messages import Start, Verb
from kiks.toolbox.framing import Exchange
from kiks.toolbox.given_robot import GivenRobot
from kiks.toolbox.requests import answer
from kiks.toolbox.session import Session
from kiks.toolbox.session_client import SessionClient

OPTIONS = ("--no-gui", "--no-history", "--no-window-system", "-qf")


def run_octave(link: Link, start: Start, program: ProgramClock) -> int:
    """Run a program of Octave to its end; return its exit code.

    Args:
        link: The link to its world.
        start: The program, and what it finds.
        program: The cost of its thinking.

    Raises:
        KiksError: If there is no Octave.
    """
    if why := why_not(Path(start.program)):
        raise KiksError(
            f"a program must have what runs it, but {why}. Install it (Debian: sudo apt-get install octave)."
        )
    session = Session()
    session.given = GivenRobot(link, start, program)
    requests, to_session = os.pipe()
    from_session, answers = os.pipe()
    # Only with line editing Octave calls the hook that tells when a person is at the prompt of its debugger. It also
    # prints what it reads from a pipe: where neither a person nor measured thinking needs the hook, it stays away.
    editing = ["--line-editing"] if program.measures or os.isatty(0) else []
    process = subprocess.Popen(
        [str(octave()), *OPTIONS, *editing, str(shipped("matlab/private/run_program.m")), *start.arguments],
        pass_fds=[from_session, to_session],
        env=os.environ | _environment(start, from_session, to_session),
        preexec_fn=end_with_parent,
    )
    os.close(from_session)
    os.close(to_session)
    exchange = Exchange(requests, answers)
    client = SessionClient(session, 1, exchange)
    try:
        for line in exchange.lines():
            if not link.known_ns:
                link.send(Verb.REACHED)  # the toolbox is there: the world may begin
            exchange.reply(answer(client, line))
    except BrokenPipeError:
        pass  # Octave has ended
    code = process.wait()
    return code if code >= 0 else 128 - code


def _environment(start: Start, *pipes: int) -> dict[str, str]:
    numbers = struct.unpack("8I", hashlib.sha256(start.seed.encode()).digest())
    # One thread, and instructions that each processor has: so sums in matrices are the same to the last bit everywhere.
    same = {"OPENBLAS_NUM_THREADS": "1"} | ({"OPENBLAS_CORETYPE": "Nehalem"} if platform.machine() == "x86_64" else {})
    return same | {
        "KIKS_PROGRAM": os.path.abspath(start.program),
        "KIKS_PIPES": " ".join(map(str, pipes)),
        "KIKS_CHANCE": " ".join(map(str, numbers)),
    }
