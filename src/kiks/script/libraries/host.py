"""What an adapter of a library works with, and the keyboard."""

from __future__ import annotations

import builtins
import sys
from typing import Any, NamedTuple

from kiks.script.chance import Chance
from kiks.script.file_waits import is_readable
from kiks.script.refusals import refuse
from kiks.script.thread_scheduler import Scheduler
from kiks.sim.port import VirtualPort

BLINK_S = 0.02
"""How often a window or a keyboard is looked at while only a person can go on [s of real time]."""


class Host(NamedTuple):
    """The parts that an adapter works with: the program's threads, a port of its world for the time, and chance."""

    scheduler: Scheduler
    clock: VirtualPort
    chance: Chance


def keyboard(host: Host) -> dict[str, dict[str, Any]]:
    """Return what stands in for `input`."""

    def read_line(prompt: object = "", /) -> str:
        if sys.stdin is not None and sys.stdin.isatty() and not is_readable(sys.stdin.fileno(), 0):
            refuse_keyboard(host.scheduler)
        return str(builtins.input(prompt))

    return {"builtins": {"input": read_line}}


def refuse_keyboard(scheduler: Scheduler) -> None:
    """End the program if it waits for a key while other threads could go on: no simulated time waits for a person."""
    if not scheduler.is_alone:
        refuse(scheduler, "not wait for the keyboard while other threads drive a robot", "it did")
