"""A robot's line as the threads of a program use it: one that waits there lets the others go on."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from kiks.clock.line import BACKLOG_LIMIT
from kiks.ports.port import Line
from kiks.ports.reading import NEVER_NS, Read
from kiks.script.scheduler import SIGNALLED, Scheduler


class SharedLine:
    """A line that several threads may use; see `Line`.

    Args:
        line: The line.
        robot: Number of the robot, from 1.
        scheduler: The program's threads.
    """

    def __init__(self, line: Line, robot: int, scheduler: Scheduler) -> None:
        self.lock: AbstractContextManager[Any] = line.lock
        self.robot = robot
        self._line = line
        self._scheduler = scheduler
        self._readers: list[Any] = []
        # What passes through as it is.
        self.think = line.think
        self.arrived_count = line.arrived_count
        self.sent_ns = line.sent_ns
        self.room_ns = line.room_ns
        self.drop_arrived = line.drop_arrived
        self.set_baud = line.set_baud
        self.claim = line.claim
        self.wait_for = line.wait_for

    @property
    def now_ns(self) -> int:
        """The program's time [ns]."""
        return self._line.now_ns

    @property
    def baud(self) -> int:
        """Speed of the line [bit/s]."""
        return self._line.baud

    def pass_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]; other threads go on meanwhile."""
        self._scheduler.sleep_until(time_ns)

    def send(self, data: bytes) -> None:
        """Put characters on the line; wait while it is full."""
        while data:
            while (room_ns := self._line.room_ns()) > self._line.now_ns:
                self._scheduler.sleep_until(room_ns)
            self._line.send(data[:BACKLOG_LIMIT])
            data = data[BACKLOG_LIMIT:]

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator; see `Line.read`.

        Raises:
            LinkError: If it could wait for ever.
        """
        line, scheduler = self._line, self._scheduler
        if scheduler.is_alone:
            return line.read(size, terminator, timeout_ns, poll_ns)
        if timeout_ns == 0:
            data = line.read(size, terminator, 0, 0)
            if poll_ns and not data:
                scheduler.sleep_until(line.now_ns + poll_ns)
            return data
        deadline_ns = NEVER_NS if timeout_ns is None else line.now_ns + timeout_ns
        read, cause = Read(self.robot, size, terminator), None
        # Another thread may take the characters first: then the wait goes on.
        while cause in (None, SIGNALLED) and line.now_ns < deadline_ns and not line.wait_for([read], line.now_ns)[0]:
            task = scheduler.current
            self._readers.append(task)
            try:
                cause = scheduler.wait(f"robot {self.robot}", until_ns=deadline_ns, reads=[read])
            finally:
                self._readers.remove(task)
        return line.read(size, terminator, 0, 0)

    def cancel_read(self) -> None:
        """Let the threads go on that wait for characters; they get what has arrived."""
        for task in self._readers:
            self._scheduler.wake(task, self)

    def hang_up(self) -> None:
        """Give the line back and forget what nobody read."""
        self.cancel_read()
        self._line.hang_up()
