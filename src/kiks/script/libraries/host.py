"""What an adapter of a library works with, and the person at the computer."""

from __future__ import annotations

import time
from collections.abc import Mapping

from kiks.script.chance import ProgramChance
from kiks.script.cpython import Undo
from kiks.script.file_waits import Files
from kiks.script.thread_scheduler import STUCK, Scheduler
from kiks.sim.port import VirtualPort

BLINK_S = 0.02
"""How often a window is looked at while only a person can go on [s of real time]."""

_EVENT = "an event of a window"


class Host:
    """The parts that an adapter works with.

    Attributes:
        addresses: The robots' names by their addresses; see `Start`.
        undo: Takes back at the end of the program what adapters have changed.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        clock: VirtualPort,
        chance: ProgramChance,
        files: Files,
        addresses: Mapping[str, str],
    ) -> None:
        self.scheduler, self.clock, self.chance, self.files, self.addresses = scheduler, clock, chance, files, addresses
        self.undo = Undo()

    def wait_for_event(self, until_ns: int) -> None:
        """Wait until something happens in a window, another thread may have caused it, or a time has come [ns]."""
        if self.scheduler.wait(_EVENT, until_ns=until_ns, when_stuck=True) is STUCK:
            # Only a person can go on.
            time.sleep(BLINK_S)

    def note_event(self) -> None:
        """Let the threads go on that wait for events."""
        for task in self.scheduler.waiting_for(_EVENT):
            self.scheduler.wake(task, None)
