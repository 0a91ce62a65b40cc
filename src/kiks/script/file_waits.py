"""Waiting for files, simulated ports among them: `select`, `poll`, `epoll`, pipes and sockets, and so all event loops.

A port's descriptor is a real one, the end of a terminal. Before anybody looks at it, as many characters are put into it
as have arrived at the port, so that whatever Python or the operating system can do with a descriptor is right. A call
that would wait is made again and again with no wait, and simulated time passes in between.
"""

from __future__ import annotations

import _io
import errno
import fcntl
import math
import os
import select
import struct
import termios
import tty
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, TypeVar

from kiks.script.file_system import FileSystem
from kiks.script.patching import for_program
from kiks.script.shared_line import SharedLine
from kiks.script.thread_scheduler import Scheduler, timeout_ns
from kiks.sim.read_completion import NEVER_NS, Read

TERMINAL_CHARACTERS = 4000
"""Most characters in a port's descriptor; the operating system takes a few more."""

PIPE_CHARACTERS = 1 << 16
"""Most characters that are read from a pipe at once."""

SETTLED_MS = 100
"""Longest time that the operating system may need to carry characters through a terminal [ms of real time]."""

TASKS = "/proc/self/task"
"""Where Linux lists the threads of this process, each with its child processes (man 5 proc)."""

_Poll = type(select.poll())
_file_methods = dict(vars(_io.FileIO))
_real_poll, _real_epoll = _Poll.poll, select.epoll.poll

Found = TypeVar("Found")


def is_readable(descriptor: int, timeout_ms: int) -> bool:
    """Wait in real time until a file can be read; return whether it can."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(_real_poll(poll, timeout_ms))


class _PortFile:
    """The descriptor of a port: the end of a terminal, whose other end has sent what has arrived at the port."""

    def __init__(self, line: SharedLine, port: Any) -> None:
        self.line = line
        self.port = port
        self._other, self.descriptor = os.openpty()
        tty.setraw(self.descriptor)
        for end in (self._other, self.descriptor):
            os.set_blocking(end, False)

    def close(self) -> None:
        os.close(self.descriptor)
        os.close(self._other)

    def fill(self) -> int:
        """Put as many characters into the terminal as have arrived at the port; return their number."""
        arrived = self.line.arrived_count()
        wanted, there = min(arrived, TERMINAL_CHARACTERS), self._count()
        if wanted < there:
            os.read(self.descriptor, there - wanted)
        elif wanted > there:
            os.write(self._other, bytes(wanted - there))
            while self._count() < wanted and is_readable(self.descriptor, SETTLED_MS):
                pass
        return arrived

    def _count(self) -> int:
        return int(struct.unpack("i", fcntl.ioctl(self.descriptor, termios.FIONREAD, bytes(4)))[0])

    def read(self, length: int) -> bytes:
        """Read what has arrived, as a terminal would: wait as its settings say unless it does not block.

        Raises:
            BlockingIOError: If nothing has arrived, and the descriptor does not block.
        """
        timeout_s: float | None = 0.0
        least = 1
        if is_blocking := os.get_blocking(self.descriptor):
            characters = termios.tcgetattr(self.descriptor)[-1]
            least, tenths = characters[termios.VMIN], characters[termios.VTIME]
            timeout_s = None if least else tenths / 10
        port = self.port
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


def _children() -> set[str]:
    """Return the numbers of all child processes of this one, those that have ended and were not waited for included."""
    found: set[str] = set()
    for thread in os.listdir(TASKS):
        # The thread may have ended.
        with suppress(OSError), open(f"{TASKS}/{thread}/children", encoding="ascii") as children:
            found.update(children.read().split())
    return found


class _Wait:
    """A wait for files; see `thread_scheduler.FileWait`."""

    def __init__(self, files: Files, look: Callable[[int], Any], descriptors: Iterable[int] | None) -> None:
        self._files = files
        self._look = look
        self._descriptors = descriptors
        # What is ready. It is kept, because the system may report an event only once (EPOLLONESHOT, EPOLLET).
        self.found: Any = None

    @property
    def is_inside(self) -> bool:
        return self._descriptors is not None and self._files.are_inside(self._descriptors)

    def is_over(self, block_ms: int) -> bool:
        self.found = self.found or self._look(block_ms)
        return bool(self.found)


class Files:
    """The files of a program that its threads wait for.

    Args:
        scheduler: The program's threads.
        system: The file system, which is told what the program writes.
    """

    def __init__(self, scheduler: Scheduler, system: FileSystem) -> None:
        self._scheduler = scheduler
        self._system = system
        self._ports: dict[int, _PortFile] = {}
        # What the program has opened to talk to itself, by device and inode.
        self._inside: set[tuple[int, int]] = set()
        # Processes that were there before the program, such as the one that multiprocessing keeps, know nothing of it.
        self._elders = _children()

    # ---- ports ----

    def add(self, line: SharedLine, port: Any) -> int:
        """Return a file descriptor for a port."""
        file = _PortFile(line, port)
        self._ports[file.descriptor] = file
        return file.descriptor

    def remove(self, descriptor: int) -> None:
        """Close a descriptor."""
        self._ports.pop(descriptor).close()

    # ---- what ends only by the program itself ----

    def note_inside(self, *descriptors: int) -> None:
        """Note descriptors whose other ends the program has."""
        for each in descriptors:
            state = os.fstat(each)
            self._inside.add((state.st_dev, state.st_ino))

    def are_inside(self, descriptors: Iterable[int]) -> bool:
        """Return whether only the program can do something at the other ends of descriptors."""
        if _children() - self._elders:
            return False  # a child may have got the other end
        for each in descriptors:
            if each not in self._ports:
                state = _status(each)
                if state is not None and (state.st_dev, state.st_ino) not in self._inside:
                    return False
        return True

    # ---- waiting ----

    def wait(
        self, look: Callable[[int], Found], timeout_s: float | None, descriptors: Iterable[int] | None = None
    ) -> Found:
        """Return what is ready; wait for it.

        Args:
            look: Waits for some real time [ms], and returns what is ready; what is false if nothing is.
            timeout_s: Longest wait [s]; None for ever.
            descriptors: What is looked at; None if that is not known.
        """
        scheduler = self._scheduler
        ports = [each for each in self._ports.values() if descriptors is None or each.descriptor in descriptors]
        deadline_ns = NEVER_NS if timeout_s is None else scheduler.world.now_ns + timeout_ns(timeout_s)
        if timeout_s is not None and timeout_s <= 0:
            _fill(ports)
            if not (found := look(0)):
                scheduler.poll()
                _fill(ports)
                found = look(0)
            return found
        files = _Wait(self, look, descriptors)
        while True:
            ports = [each for each in ports if each.descriptor in self._ports]
            arrived = _fill(ports)
            if files.is_over(0) or scheduler.world.now_ns >= deadline_ns:
                break
            # One more character at any of the ports can end the wait.
            reads = [Read(each.line.robot, count + 1) for each, count in zip(ports, arrived, strict=True)]
            scheduler.wait("files", until_ns=deadline_ns, reads=reads, files=files)
            scheduler.program.thread.act()
            if files.found:
                break
        return files.found  # type: ignore[no-any-return]

    def wait_for(self, descriptor: int, events: int, timeout_s: float | None = None) -> bool:
        """Wait until a file is ready; return whether it is."""
        poll = select.poll()
        poll.register(descriptor, events)
        return bool(self.wait(lambda block_ms: _real_poll(poll, block_ms), timeout_s, (descriptor,)))

    # ---- replacements for names of `select`, `os` and others ----

    def replacements(self) -> dict[str, dict[str, Any]]:
        """Return the replacements, by module."""
        ports, scheduler = self._ports, self._scheduler

        def simulated_select(
            rlist: Iterable[Any], wlist: Iterable[Any], xlist: Iterable[Any], timeout: float | None = None, /
        ) -> tuple[list[Any], list[Any], list[Any]]:
            lists = list(rlist), list(wlist), list(xlist)
            if timeout is not None and timeout < 0:
                raise ValueError("timeout must be non-negative")
            select.select(*lists, 0)  # says what is wrong with the arguments
            wanted = {_descriptor(each) for each in (*lists[0], *lists[1], *lists[2])}
            empty: tuple[list[Any], list[Any], list[Any]] = [], [], []

            def look(block_ms: int) -> Any:
                found = select.select(*lists, block_ms / 1000)
                return found if any(found) else None

            return self.wait(look, timeout, wanted) or empty

        def poll(poll: Any, timeout: float | None = None, /) -> list[tuple[int, int]]:
            timeout_s = None if timeout is None or timeout < 0 else math.ceil(timeout) / 1000
            return self.wait(lambda block_ms: _real_poll(poll, block_ms), timeout_s)

        def epoll(epoll: Any, timeout: float | None = None, maxevents: int = -1) -> list[tuple[int, int]]:
            timeout_s = None if timeout is None or timeout < 0 else timeout
            return self.wait(lambda block_ms: _real_epoll(epoll, block_ms / 1000, maxevents), timeout_s)

        def read(descriptor: int, length: int, /) -> bytes:
            if descriptor in ports:
                return ports[descriptor].read(length)
            self.wait_for_pipe(descriptor, select.POLLIN)
            return bytes(os.read(descriptor, length))

        def put(descriptor: int, data: Any, write: Callable[[Any], Any]) -> Any:
            """Write by a function: into a pipe as much at once as a pipe that is ready takes."""
            if not self._is_pipe(descriptor):
                self.wait_for_pipe(descriptor, select.POLLOUT)
                return write(data)
            left = memoryview(data).cast("B")
            size = len(left)
            while True:
                self.wait_for_pipe(descriptor, select.POLLOUT)
                left = left[write(left[: select.PIPE_BUF]) :]
                if not left:
                    return size

        def write(descriptor: int, data: Any, /) -> int:
            if descriptor in ports:
                return int(ports[descriptor].port.write(data))
            count: int = put(descriptor, data, lambda piece: os.write(descriptor, piece))
            self._system.note_write(descriptor)
            return count

        def pipe() -> tuple[int, int]:
            ends: tuple[int, int] = os.pipe()
            self.note_inside(*ends)
            return ends

        def ioctl(fd: Any, request: int, *rest: Any) -> Any:
            file = ports.get(_descriptor(fd))
            if file is not None:
                file.fill()
                if request == termios.TIOCOUTQ and rest and isinstance(rest[0], bytes):
                    return struct.pack("i", file.port.out_waiting)
            return fcntl.ioctl(fd, request, *rest)

        def drain(fd: Any, /) -> None:
            file = ports.get(_descriptor(fd))
            termios.tcdrain(fd) if file is None else file.port.flush()

        def flush(fd: Any, queue: int, /) -> None:
            file = ports.get(_descriptor(fd))
            termios.tcflush(fd, queue)
            if file is not None and queue in (termios.TCIFLUSH, termios.TCIOFLUSH):
                file.port.reset_input_buffer()
            if file is not None and queue in (termios.TCOFLUSH, termios.TCIOFLUSH):
                file.port.reset_output_buffer()

        def reading(name: str) -> Callable[..., Any]:
            """Return a method of files that waits before it reads."""

            def call(file: Any, *args: Any) -> Any:
                if not file.closed:
                    self.wait_for_pipe(file.fileno(), select.POLLIN)
                return _file_methods[name](file, *args)

            return call

        def write_file(file: Any, data: Any, /) -> Any:
            if file.closed:
                return _file_methods["write"](file, data)
            count = put(file.fileno(), data, lambda piece: _file_methods["write"](file, piece))
            self._system.note_write(file.fileno())
            return count

        def read_all(file: Any) -> Any:
            if file.closed or not self._is_pipe(file.fileno()):
                return _file_methods["readall"](file)

            def read_piece() -> Any:
                self.wait_for_pipe(file.fileno(), select.POLLIN)
                return _file_methods["read"](file, PIPE_CHARACTERS)

            return b"".join(iter(read_piece, b""))

        def close_file(file: Any) -> None:
            if not file.closed and file.writable():
                self._system.note_close(file.fileno())
            _file_methods["close"](file)

        reads = {name: reading(name) for name in ("read", "readinto")}
        of_file: dict[str, Callable[..., Any]] = {
            **reads,
            "readall": read_all,
            "write": write_file,
            "close": close_file,
        }
        return {
            "_io.FileIO": {
                name: for_program(scheduler, method, _file_methods[name]) for name, method in of_file.items()
            },
            "select": {"select": simulated_select},
            f"{__name__}._Poll": {"poll": for_program(scheduler, poll, _real_poll)},
            "select.epoll": {"poll": for_program(scheduler, epoll, _real_epoll)},
            "posix": {"read": read, "write": write, "pipe": pipe},
            "fcntl": {"ioctl": ioctl},
            "termios": {"tcdrain": drain, "tcflush": flush},
        }

    def _is_pipe(self, descriptor: int) -> bool:
        """Return whether a descriptor leads to the program itself, and reading it waits."""
        return self._is_inside(descriptor) and os.get_blocking(descriptor)

    def _is_inside(self, descriptor: int) -> bool:
        state = _status(descriptor) if self._inside else None
        return state is not None and (state.st_dev, state.st_ino) in self._inside

    def wait_for_pipe(self, descriptor: int, event: int) -> None:
        """Wait until a pipe or socket to which other threads of the program have the other end can be used.

        If it does not block, looking at it is a poll.
        """
        if self._is_inside(descriptor):
            self.wait_for(descriptor, event, None if os.get_blocking(descriptor) else 0)


def _descriptor(file: Any) -> int:
    """Return the descriptor of a file, or of what is one."""
    return file if isinstance(file, int) else int(file.fileno())


def _fill(ports: Iterable[_PortFile]) -> list[int]:
    return [each.fill() for each in ports]


def _status(descriptor: int) -> os.stat_result | None:
    """Return the status of a descriptor; None if it is closed."""
    try:
        return os.fstat(descriptor)
    except OSError:
        return None
