"""Waiting for files, simulated ports among them: `select`, `poll`, `epoll`, pipes, sockets and keyboards.

A call that would wait is made again and again with no wait, and simulated time passes in between. So all event loops
work. Ports have descriptors, too (`port_file.py`).
"""

from __future__ import annotations

import _io
import fcntl
import math
import os
import select
import stat
import struct
import termios
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Any, TypeVar

from kiks.script.file_system import FileSystem
from kiks.script.patching import for_program
from kiks.script.port_file import PortFile
from kiks.script.shared_line import SharedLine
from kiks.script.terminals import Identity, OwnTerminals, identity, patience, status
from kiks.script.thread_scheduler import LOOKED_FOR_KEYS, Scheduler, timeout_ns
from kiks.sim.read_completion import NEVER_NS, Read

PIPE_CHARACTERS = 1 << 16
"""Most characters that are read from a pipe at once."""

TASKS = "/proc/self/task"
"""Where Linux lists the threads of this process, each with its child processes (man 5 proc)."""

_NOTHING = {"read": b"", "readinto": 0}
"""What a method of files returns at the end of its file, or of a terminal's patience."""

_Poll = type(select.poll())
_file_methods = dict(vars(_io.FileIO))
_real_poll, _real_epoll = _Poll.poll, select.epoll.poll

Found = TypeVar("Found")


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

    is_for_person = False

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
        settle_ms = self._files.terminals.settle_ms(self._descriptors or ())
        self.found = self.found or self._look(max(block_ms, settle_ms))
        return bool(self.found)


class Files:
    """The files of a program that its threads wait for.

    Args:
        scheduler: The program's threads.
        system: The file system, which is told what the program writes.

    Attributes:
        terminals: The pseudo-terminals of the program.
    """

    def __init__(self, scheduler: Scheduler, system: FileSystem) -> None:
        self._scheduler = scheduler
        self._system = system
        self.terminals = OwnTerminals()
        # By the number of its terminal, which all copies of its descriptor share.
        self._ports: dict[int, PortFile] = {}
        # What the program has opened to talk to itself.
        self._inside: set[Identity] = set()
        # Where a person, or another program, writes to this one.
        self._input = None if (state := status(0)) is None else identity(state)
        # Processes that were there before the program, such as the one that multiprocessing keeps, know nothing of it.
        self._elders = _children()

    # ---- ports ----

    def add(self, line: SharedLine, port: Any) -> int:
        """Return a file descriptor for a port."""
        file = PortFile(self._scheduler, line, port)
        self._ports[file.number] = file
        self._scheduler.before_time.append(file.settle)
        return file.descriptor

    def remove(self, descriptor: int) -> None:
        """Close the descriptor of a port."""
        (file,) = (each for each in self._ports.values() if each.descriptor == descriptor)
        file.settle()
        del self._ports[file.number]
        self._scheduler.before_time.remove(file.settle)
        file.close()

    def port_of(self, descriptor: int) -> PortFile | None:
        """Return the port behind a descriptor, which may be a copy of the port's own."""
        state = status(descriptor) if self._ports else None
        return None if state is None else self._ports.get(state.st_rdev)

    # ---- what ends only by the program itself ----

    def note_inside(self, *descriptors: int) -> None:
        """Note descriptors whose other ends the program has."""
        for each in descriptors:
            self._inside.add(identity(os.fstat(each)))

    def are_inside(self, descriptors: Iterable[int]) -> bool:
        """Return whether only the program can do something at the other ends of descriptors."""
        if _children() - self._elders:
            return False  # a child may have got the other end
        for each in descriptors:
            if self.port_of(each) is None:
                state = status(each)
                if state is not None and identity(state) not in self._inside:
                    return False
        return True

    def _is_outside(self, state: os.stat_result) -> bool:
        """Return whether a file is a device, such as a person's keyboard, or the input of this process."""
        if stat.S_ISREG(state.st_mode) or identity(state) in self._inside:
            return False
        return stat.S_ISCHR(state.st_mode) or identity(state) == self._input

    def _waits_for_person(self, descriptors: Iterable[int] | None, timeout_s: float | None) -> bool:
        """Return whether a wait lasts until a person acts; note a look, too, as the run depends on what it finds."""
        states = {each: status(each) for each in descriptors or () if self.port_of(each) is None}
        outside = [each for each, state in states.items() if state is not None and self._is_outside(state)]
        if timeout_s is not None and any(map(os.isatty, outside)):
            self._scheduler.program.doubt = LOOKED_FOR_KEYS
        return timeout_s is None and bool(outside)

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
        looked_at = None if descriptors is None else set(map(self.port_of, descriptors))
        ports = [each for each in self._ports.values() if looked_at is None or each in looked_at]
        deadline_ns = NEVER_NS if timeout_s is None else scheduler.world.now_ns + timeout_ns(timeout_s)
        if timeout_s is not None and timeout_s <= 0:
            _fill(ports)
            if not (found := look(0)):
                self._waits_for_person(descriptors, timeout_s)
                scheduler.poll()
                _fill(ports)
                found = look(0)
            return found
        files = _Wait(self, look, descriptors)
        while True:
            ports = [each for each in ports if each.number in self._ports]
            arrived = _fill(ports)
            if files.is_over(0) or scheduler.world.now_ns >= deadline_ns:
                break
            files.is_for_person = self._waits_for_person(descriptors, timeout_s)
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
        scheduler = self._scheduler

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
            if (port := self.port_of(descriptor)) is not None:
                return port.read(length, descriptor)
            return bytes(os.read(descriptor, length)) if self.wait_to_read(descriptor) else b""

        def put(descriptor: int, data: Any, write: Callable[[Any], Any]) -> Any:
            """Write by a function: into a pipe as much at once as a pipe that is ready takes."""
            state = status(descriptor) if self._inside else None
            if state is None or identity(state) not in self._inside:
                return write(data)
            if not os.get_blocking(descriptor):
                self.wait_for(descriptor, select.POLLOUT, 0)
                count = write(data)
                self.terminals.note_write(state)
                return count
            left = memoryview(data).cast("B")
            size = len(left)
            while True:
                self.wait_for(descriptor, select.POLLOUT)
                left = left[write(left[: select.PIPE_BUF]) :]
                self.terminals.note_write(state)
                if not left:
                    return size

        def write(descriptor: int, data: Any, /) -> int:
            if (port := self.port_of(descriptor)) is not None:
                return int(port.port.write(data))
            count: int = put(descriptor, data, lambda piece: os.write(descriptor, piece))
            self._system.note_write(descriptor)
            return count

        def read_into(descriptor: int, buffers: Any, /) -> int:
            if self.port_of(descriptor) is None:
                return os.readv(descriptor, buffers) if self.wait_to_read(descriptor) else 0
            views = [memoryview(each).cast("B") for each in buffers]
            data = left = read(descriptor, sum(map(len, views)))
            for view in views:
                piece, left = left[: len(view)], left[len(view) :]
                view[: len(piece)] = piece
            return len(data)

        def write_from(descriptor: int, buffers: Any, /) -> int:
            return write(descriptor, b"".join(buffers))

        def pipe() -> tuple[int, int]:
            ends: tuple[int, int] = os.pipe()
            self.note_inside(*ends)
            return ends

        def openpty() -> tuple[int, int]:
            ends = os.openpty()
            self.note_inside(*ends)
            self.terminals.add(*ends)
            return ends

        def ioctl(fd: Any, request: int, *rest: Any) -> Any:
            file = self.port_of(_descriptor(fd))
            if file is not None:
                file.fill()
                if request == termios.TCFLSH and rest:
                    return file.flush(rest[0])
                if request == termios.TIOCOUTQ and rest and isinstance(rest[0], bytes):
                    return struct.pack("i", file.port.out_waiting)
            return fcntl.ioctl(fd, request, *rest)

        def drain(fd: Any, /) -> None:
            file = self.port_of(_descriptor(fd))
            termios.tcdrain(fd) if file is None else file.port.flush()

        def flush(fd: Any, queue: int, /) -> None:
            file = self.port_of(_descriptor(fd))
            termios.tcflush(fd, queue) if file is None else file.flush(queue)

        def get_attributes(fd: Any, /) -> list[Any]:
            file, attributes = self.port_of(_descriptor(fd)), termios.tcgetattr(fd)
            return attributes if file is None else file.attributes(attributes)

        def set_attributes(fd: Any, when: int, attributes: list[Any], /) -> None:
            file = self.port_of(_descriptor(fd))
            if file is None:
                termios.tcsetattr(fd, when, attributes)
            else:
                file.set_attributes(_descriptor(fd), when, attributes)

        def reading(name: str) -> Callable[..., Any]:
            """Return a method of files that waits before it reads."""

            def call(file: Any, *args: Any) -> Any:
                is_over = not file.closed and not self.wait_to_read(file.fileno())
                return _NOTHING[name] if is_over else _file_methods[name](file, *args)

            return call

        def write_file(file: Any, data: Any, /) -> Any:
            if file.closed:
                return _file_methods["write"](file, data)
            count = put(file.fileno(), data, lambda piece: _file_methods["write"](file, piece))
            self._system.note_write(file.fileno())
            return count

        def read_all(file: Any) -> Any:
            if file.closed or not self._waits(os.fstat(file.fileno())) or not os.get_blocking(file.fileno()):
                return _file_methods["readall"](file)
            return b"".join(iter(lambda: reading("read")(file, PIPE_CHARACTERS), b""))

        def close_file(file: Any) -> None:
            if not file.closed and file.writable():
                self._system.note_close(file.fileno())
            _file_methods["close"](file)

        def pieces_of(descriptor: int) -> Iterator[bytes]:
            with suppress(BlockingIOError):
                while piece := read(descriptor, PIPE_CHARACTERS):
                    yield piece

        def read_port(file: Any, size: int | None = -1, /) -> bytes:
            if size is not None and size >= 0:
                return read(file.fileno(), size)
            if not (data := b"".join(pieces_of(file.fileno()))) and not os.get_blocking(file.fileno()):
                raise BlockingIOError
            return data

        def method(name: str, for_port: Callable[..., Any], for_others: Callable[..., Any]) -> Callable[..., Any]:
            """Return a method of files; a file may be at a port."""

            def call(file: Any, *args: Any) -> Any:
                is_port = not file.closed and self.port_of(file.fileno()) is not None
                if is_port and (file.writable() if name == "write" else file.readable()):
                    with suppress(BlockingIOError):
                        return for_port(file, *args)
                    return None
                return for_others(file, *args)

            return for_program(scheduler, call, _file_methods[name])

        methods = {
            "read": method("read", read_port, reading("read")),
            "readinto": method(
                "readinto", lambda file, buffer, /: read_into(file.fileno(), [buffer]), reading("readinto")
            ),
            "readall": method("readall", lambda file, /: read_port(file), read_all),
            "write": method("write", lambda file, data, /: write(file.fileno(), data), write_file),
            "close": for_program(scheduler, close_file, _file_methods["close"]),
        }
        return {
            "_io.FileIO": methods,
            "select": {"select": simulated_select},
            f"{__name__}._Poll": {"poll": for_program(scheduler, poll, _real_poll)},
            "select.epoll": {"poll": for_program(scheduler, epoll, _real_epoll)},
            "posix": {
                "read": read,
                "readv": read_into,
                "write": write,
                "writev": write_from,
                "pipe": pipe,
                "openpty": openpty,
            },
            "fcntl": {"ioctl": ioctl},
            "termios": {
                "tcdrain": drain,
                "tcflush": flush,
                "tcgetattr": get_attributes,
                "tcsetattr": set_attributes,
            },
        }

    def _waits(self, state: os.stat_result) -> bool:
        """Return whether a read of a file waits for other threads of the program, or for a person."""
        return identity(state) in self._inside or self._is_outside(state)

    def wait_to_read(self, descriptor: int) -> bool:
        """Wait until a file can be read, if another one than the operating system can make it wait.

        If it does not block, looking at it is a poll.

        Returns:
            False if a terminal's patience is over, and the read is to return nothing.
        """
        state = status(descriptor)
        if state is None or not self._waits(state):
            return True
        if not os.get_blocking(descriptor):
            self.wait_for(descriptor, select.POLLIN, 0)
            return True
        has_patience = os.isatty(descriptor) and not self.terminals.is_master(state)
        return self.wait_for(descriptor, select.POLLIN, patience(descriptor)[1] if has_patience else None)


def _descriptor(file: Any) -> int:
    """Return the descriptor of a file, or of what is one."""
    return file if isinstance(file, int) else int(file.fileno())


def _fill(ports: Iterable[PortFile]) -> list[int]:
    return [each.fill() for each in ports]
