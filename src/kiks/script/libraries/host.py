"""What an adapter of a library works with, and the person at the computer."""

from __future__ import annotations

import builtins
import sys
import time
from typing import Any

from kiks.script.chance import Chance
from kiks.script.file_waits import is_readable
from kiks.script.refusals import refuse
from kiks.script.thread_scheduler import STUCK, Scheduler
from kiks.sim.port import VirtualPort

BLINK_S = 0.02
"""How often a window is looked at while only a person can go on [s of real time]."""

_EVENT = "an event of a window"


class Host:
    """The parts that an adapter works with."""

    def __init__(self, scheduler: Scheduler, clock: VirtualPort, chance: Chance) -> None:
        self.scheduler, self.clock, self.chance = scheduler, clock, chance

    def wait_for_event(self, until_ns: int) -> None:
        """Wait until something happens in a window, another thread may have caused it, or a time has come [ns]."""
        if self.scheduler.wait(_EVENT, until_ns=until_ns, when_stuck=True) is STUCK:
            # Only a person can go on.
            time.sleep(BLINK_S)

    def note_event(self) -> None:
        """Let the threads go on that wait for events."""
        for task in self.scheduler.waiting_for(_EVENT):
            self.scheduler.wake(task, None)


def keyboard(host: Host) -> dict[str, dict[str, Any]]:
    """Return what stands in for `input`."""

    def read_line(prompt: object = "", /) -> str:
        if sys.stdin is not None and sys.stdin.isatty():
            refuse_keyboard(host.scheduler, sys.stdin.fileno())
        return str(builtins.input(prompt))

    return {"builtins": {"input": read_line}}


def refuse_keyboard(scheduler: Scheduler, descriptor: int) -> None:
    """End the program if it waits for a key while other threads could go on: no simulated time waits for a person."""
    if not is_readable(descriptor, 0) and not scheduler.is_alone:
        refuse(scheduler, "not wait for the keyboard while other threads drive a robot", "it did")
