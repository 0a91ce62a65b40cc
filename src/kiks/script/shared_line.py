"""A robot's line for the threads of a program: a thread that waits there lets the others go on."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from kiks.errors import LinkError
from kiks.script.thread_scheduler import ALONE, COMPLETE, SIGNALLED, Scheduler, ThreadTask
from kiks.sim.port import Line
from kiks.sim.read_completion import NEVER_NS, Read, is_ended


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
        self._waiting: list[ThreadTask] = []
        self._claim_count = 0
        self._what = f"robot {robot}"
        # Methods of the line without a wait.
        self.think = line.think
        self.send = line.send
        self.arrived_count = line.arrived_count
        self.sent_ns = line.sent_ns
        self.room_ns = line.room_ns
        self.drop_arrived = line.drop_arrived
        self.set_baud = line.set_baud
        self.wait_for = line.wait_for
        self.stand, self.look = line.stand, line.look

    @property
    def now_ns(self) -> int:
        """The program's time [ns]."""
        return self._line.now_ns

    @property
    def known_ns(self) -> int:
        """The same as far as it is known [ns]; see `Line`."""
        return self._line.known_ns

    @property
    def baud(self) -> int:
        """Speed of the line [bit/s]."""
        return self._line.baud

    def pass_to(self, time_ns: int) -> None:
        """Let time pass up to a time [ns]; other threads go on meanwhile."""
        self._scheduler.sleep_until(time_ns)

    @property
    def taken_ns(self) -> int:
        """When the last character arrived that was read [ns]."""
        return self._line.taken_ns

    def wait_for_room(self, until_ns: int) -> None:
        """Let time pass up to a time [ns], or until `wake`; other threads go on meanwhile."""
        task = self._scheduler.current
        self._waiting.append(task)
        try:
            self._scheduler.wait(f"room on the line to {self._what}", until_ns=until_ns)
        finally:
            self._waiting.remove(task)

    def read(self, size: int | None, terminator: bytes | None, timeout_ns: int | None, poll_ns: int) -> bytes:
        """Wait for `size` characters or a terminator; see `Line.read`."""
        line, scheduler = self._line, self._scheduler
        scheduler.settle()
        # No other thread can go on meanwhile, so the line itself may wait, which costs less.
        if scheduler.is_alone:
            return line.read(size, terminator, timeout_ns, poll_ns)
        if timeout_ns == 0:
            data = line.read(size, terminator, 0, 0)
            if poll_ns and not data:
                scheduler.sleep_until(line.now_ns + poll_ns)
            return data
        # What is there needs no wait, and so no other thread's turn.
        if line.arrived_count() and line.wait_for([Read(self.robot, size, terminator)], line.now_ns)[0]:
            return line.read(size, terminator, 0, 0)
        return self._wait(size, terminator, NEVER_NS if timeout_ns is None else line.now_ns + timeout_ns)

    def _wait(self, size: int | None, terminator: bytes | None, deadline_ns: int) -> bytes:
        """Let other threads go on until a read is complete, or up to a time [ns]; return the characters."""
        line, scheduler, task = self._line, self._scheduler, self._scheduler.current
        self._waiting.append(task)
        try:
            data = b""
            while True:
                read = Read(self.robot, None if size is None else size - len(data), terminator)
                cause = scheduler.wait(self._what, until_ns=deadline_ns, reads=(read,), may_go_alone=True)
                if cause is ALONE:
                    left_ns = None if deadline_ns == NEVER_NS else max(deadline_ns - line.now_ns, 0)
                    try:
                        return data + line.read(*read[1:], left_ns, 0)
                    except LinkError:
                        scheduler.end_stuck()
                # Its handler has run, and the read goes on, as in Python.
                if cause is SIGNALLED:
                    continue
                data += line.read(*read[1:], 0, 0)
                # If another thread has taken characters first, the wait goes on.
                if cause is not COMPLETE or len(data) == size or is_ended(data, terminator):
                    return data
        finally:
            self._waiting.remove(task)

    def wake(self) -> None:
        """Let threads that read or wait for room see whether they still must; they return what has arrived."""
        for task in self._waiting:
            self._scheduler.wake(task, self)

    def claim(self, holder: str) -> None:
        """Reserve the line for this program, which may open it several times, as on a real computer."""
        if not self._claim_count:
            self._line.claim(holder)
        self._claim_count += 1

    def hang_up(self) -> None:
        """Release the line and drop unread characters, unless the program has it open a second time."""
        self._claim_count = max(self._claim_count - 1, 0)
        if not self._claim_count:
            self._line.hang_up()
        self.wake()
