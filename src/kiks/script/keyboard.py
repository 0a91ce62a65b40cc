"""`input`: a thread that asks a person lets the others go on.

Whatever reads the keyboard waits in `file_waits.py`. Python's own `input` reads a terminal in C, where no other thread
can go on, but lets a person edit the line: it stays for a program that waits for nothing else.
"""

from __future__ import annotations

import builtins
import sys

from kiks.script.cpython import unchanged
from kiks.script.patching import Replacements
from kiks.script.thread_scheduler import Scheduler


def replacements(scheduler: Scheduler) -> Replacements:
    """Return what stands in for `input`."""
    real_input = unchanged(builtins.input)

    def read_line(prompt: object = "", /) -> str:
        scheduler.program.has_asked_person = True
        if scheduler.is_alone or None in (sys.stdin, sys.stdout):
            return str(real_input(prompt))
        sys.stdout.write(str(prompt))
        sys.stdout.flush()
        line = sys.stdin.readline()
        if not line:
            raise EOFError("EOF when reading a line")
        return line.removesuffix("\n")

    return {"builtins": {"input": read_line}}
