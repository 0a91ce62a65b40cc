"""The descriptor of a port: the end of a terminal, whose other end KiKS has.

Before each look at it, as many zeros are put into it as characters have arrived at the port, so `select`, `poll`
and `ioctl` of the operating system are right. Python's functions that read or write it, or a copy of it, use the port.
What comes out of the other end was written past them, by a child process or by code in C: it goes to the robot before
time passes. Zeros that are missing were read past them.
"""

from __future__ import annotations

import errno
import fcntl
import os
import select
import struct
import termios
import tty
from typing import Any

from kiks.clock.serial_timing import BACKLOG_LIMIT
from kiks.script.refusals import refuse
from kiks.script.shared_line import SharedLine
from kiks.script.terminals import SETTLED_MS, identity, patience
from kiks.script.thread_scheduler import Scheduler
from kiks.sim.read_completion import Read

_CODES = {int(name[1:]): code for name, code in vars(termios).items() if name[:1] == "B" and name[1:].isdigit()}
"""The codes of a terminal's speeds, by the speed [bit/s]."""

_OTHER = 0x1000
"""The code of every other speed (BOTHER of Linux)."""

_BAUDS = {code: baud for baud, code in _CODES.items() if baud}


class PortFile:
    """The descriptor of a port.

    Args:
        scheduler: The program's threads.
        line: The line of its robot.
        port: The object of pyserial.

    Attributes:
        identity: What all copies of the descriptor share.
    """

    most_characters = 4000
    """Most characters in the descriptor; a terminal takes a few more."""

    def __init__(self, scheduler: Scheduler, line: SharedLine, port: Any) -> None:
        self.line = line
        self.port = port
        self._scheduler = scheduler
        self._other, self._end = self._open()
        for end in (self._other, self._end):
            os.set_blocking(end, False)
        # The program may close this one.
        self.descriptor = os.dup(self._end)
        self.identity = identity(os.fstat(self._end))
        # Zeros that are in the terminal.
        self._put_count = 0

    def _open(self) -> tuple[int, int]:
        """Return KiKS's end and the program's."""
        ends = os.openpty()
        tty.setraw(ends[1])
        return ends

    def close(self) -> None:
        """Close both ends; copies of the descriptor fail from now on, as those of an adapter that was pulled out."""
        os.close(self._other)
        os.close(self._end)
        os.close(self.descriptor)

    def fill(self) -> Read:
        """Put as many characters into the terminal as can be read at the port; return the read that changes that."""
        self.settle()
        readable, read = self._readable(self.line.arrived_count())
        wanted, there = min(readable, self.most_characters), self._put_count
        if wanted < there:
            os.read(self._end, there - wanted)
        elif wanted > there:
            os.write(self._other, bytes(wanted - there))
            while self._count() < wanted and is_readable(self._end, SETTLED_MS):
                pass
        self._put_count = wanted
        return read

    def _readable(self, arrived: int) -> tuple[int, Read]:
        """Return how many characters can be read, and the read that changes that, when it is complete.

        Args:
            arrived: How many have arrived at the port.
        """
        return arrived, Read(self.line.robot, arrived + 1)

    def settle(self) -> None:
        """Send what was written past Python, as much as the line has room for; refuse what was read past it."""
        if self._count() < self._put_count:
            refuse(self._scheduler, "read a port by Python itself", "a process or code in C read its descriptor")
        line = self.line
        # A look by `poll` waits until the operating system has carried everything to this end.
        while is_readable(self._other, 0):
            with line.lock:
                room = next((size for size in (BACKLOG_LIMIT, 64, 1) if line.room_ns(size) <= line.now_ns), 0)
                if not room:
                    return
                line.send(os.read(self._other, room), 0)

    def _count(self) -> int:
        return int(struct.unpack("i", fcntl.ioctl(self._end, termios.FIONREAD, bytes(4)))[0])

    def read(self, length: int, descriptor: int) -> bytes:
        """Read what has arrived, as a terminal would: wait as its settings say unless the descriptor does not block.

        Raises:
            BlockingIOError: If nothing has arrived, and the descriptor does not block.
        """
        is_blocking = os.get_blocking(descriptor)
        least, timeout_s = patience(descriptor) if is_blocking else (1, 0.0)
        port = self.port.sim_port  # a class of pyserial may read by the descriptor
        before, port.timeout = port.timeout, timeout_s
        try:
            data: bytes = port.read(min(max(least, 1), length))
            if data:
                port.timeout = 0
                data += port.read(length - len(data))
        finally:
            port.timeout = before
        if not data and not is_blocking:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        return data

    # ---- settings ----

    def attributes(self, real: list[Any]) -> list[Any]:
        """Return the attributes of the terminal with the speed of the line."""
        speed = _CODES.get(self.line.baud, _OTHER)
        return [*real[:4], speed, speed, real[6]]

    def set_attributes(self, descriptor: int, when: int, attributes: list[Any]) -> None:
        """Set the attributes of the terminal, and the speed of the line."""
        if attributes[3] & termios.ICANON:
            refuse(self._scheduler, "read a port without ICANON", "it set that flag", "Use readline, or ")
        if when == termios.TCSAFLUSH:
            self.port.reset_input_buffer()
        # An echo of the zeros would go to the robot.
        local = attributes[3] & ~(termios.ECHO | termios.ECHONL)
        termios.tcsetattr(descriptor, termios.TCSANOW, [*attributes[:3], local, *attributes[4:]])
        baud = _BAUDS.get(attributes[5], self.line.baud)
        if baud != self.line.baud:
            # pyserial does not know of it: it sets its own speed when it sets anything.
            self.port.sim_port.baudrate = self.port._line_baudrate = baud

    def flush(self, queue: int) -> None:
        """Drop what `termios.tcflush` drops."""
        if queue in (termios.TCIFLUSH, termios.TCIOFLUSH):
            self.port.reset_input_buffer()
        if queue in (termios.TCOFLUSH, termios.TCIOFLUSH):
            self.port.reset_output_buffer()


def is_readable(descriptor: int, timeout_ms: int) -> bool:
    """Wait in real time until a file can be read; return whether it can."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(timeout_ms))
