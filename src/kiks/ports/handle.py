"""A program that was started: what becomes of it."""

from __future__ import annotations

import threading

from kiks.ports.guest import SocketGuest
from kiks.ports.process import Command, OutputLine, Process
from kiks.sim.tail import Tail


class Handle:
    """A program that was started.

    Attributes:
        command: What was started.
        number: Its number, from 1 in the order in which they were started.
        robot: Number of the robot that is its own.
        name: Who it is, for a person.
    """

    def __init__(self, command: Command, guest: SocketGuest) -> None:
        self.command = command
        self.number = guest.rank
        self.robot = guest.robot
        self.name = guest.name
        self.has_been_noticed = False
        self.has_ended = threading.Event()
        self.guest = guest
        self.process: Process

    @property
    def is_running(self) -> bool:
        """Whether it still runs; when not, its output is complete, and its robots are free if it was stopped."""
        return not self.has_ended.is_set()

    @property
    def code(self) -> int | None:
        """The exit code with which it has ended, 128 and its number after a signal; None while it runs."""
        code = None if self.is_running else self.process.code
        return code if code is None or code >= 0 else 128 - code

    @property
    def output(self) -> Tail[OutputLine] | None:
        """What it has printed; None if the terminal has it."""
        return self.process.output

    @property
    def state(self) -> str:
        """What it does, in a word or two: 'running', 'stopping', 'stopped', 'silenced', or how it has ended."""
        if self.is_running:
            return "stopping" if self.guest.is_stopped else "running"
        if self.guest.is_stopped:
            return "stopped"
        return "silenced" if self.guest.is_silenced else f"ended {self.how}"

    @property
    def how(self) -> str:
        """How it has ended, in words; nothing while it runs."""
        code = self.process.code
        if code is None:
            return ""
        return f"with exit code {code}" if code >= 0 else f"by signal {-code}"
