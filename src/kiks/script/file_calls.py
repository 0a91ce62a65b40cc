"""The functions that wait for files: `select`, `poll`, `epoll`, and what reads and writes descriptors and files."""

from __future__ import annotations

import _io
import fcntl
import math
import os
import select
import struct
import termios
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Any

from kiks.script.file_system import FileSystem
from kiks.script.file_waits import Files, real_poll
from kiks.script.patching import Replacements, for_program
from kiks.script.port_file import PortFile
from kiks.script.thread_scheduler import Scheduler

PIPE_CHARACTERS = 1 << 16
"""Most characters that are read from a pipe at once."""

_NOTHING = {"read": b"", "readinto": 0}
"""What a method of files returns at the end of its file, or of a terminal's patience."""

_Poll = type(select.poll())
_file_methods = dict(vars(_io.FileIO))
_real_epoll = select.epoll.poll


def replacements(scheduler: Scheduler, files: Files, system: FileSystem) -> Replacements:
    """Return what stands in for names of `select`, `os`, `io`, `fcntl` and `termios`.

    Args:
        scheduler: The program's threads.
        files: The files that they wait for.
        system: The file system, which notes what the program writes.
    """
    descriptors = _Descriptors(files, system)
    return {
        **_select_functions(scheduler, files),
        **_terminal_functions(files),
        "posix": {
            "read": descriptors.read,
            "readv": descriptors.read_into,
            "write": descriptors.write,
            "writev": lambda descriptor, buffers, /: descriptors.write(descriptor, b"".join(buffers)),
            "pipe": descriptors.pipe,
            "openpty": descriptors.openpty,
        },
        "_io.FileIO": _FileMethods(files, system, descriptors).replacements(scheduler),
    }


def _select_functions(scheduler: Scheduler, files: Files) -> dict[str, dict[str, Any]]:
    """Return the functions and methods of `select`."""

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

        return files.wait(look, timeout, wanted) or empty

    def poll(poll: Any, timeout: float | None = None, /) -> list[tuple[int, int]]:
        timeout_s = None if timeout is None or timeout < 0 else math.ceil(timeout) / 1000
        return files.wait(lambda block_ms: real_poll(poll, block_ms), timeout_s)

    def epoll(epoll: Any, timeout: float | None = None, maxevents: int = -1) -> list[tuple[int, int]]:
        timeout_s = None if timeout is None or timeout < 0 else timeout
        return files.wait(lambda block_ms: _real_epoll(epoll, block_ms / 1000, maxevents), timeout_s)

    return {
        "select": {"select": simulated_select},
        f"{__name__}._Poll": {"poll": for_program(scheduler, poll, real_poll)},
        "select.epoll": {"poll": for_program(scheduler, epoll, _real_epoll)},
    }


class _Descriptors:
    """The functions of `os` that read and write descriptors."""

    def __init__(self, files: Files, system: FileSystem) -> None:
        self._files = files
        self._system = system

    def read(self, descriptor: int, length: int, /) -> bytes:
        if (port := self._files.port_at(descriptor)) is not None:
            return port.read(length, descriptor)
        return bytes(os.read(descriptor, length)) if self._files.wait_to_read(descriptor) else b""

    def read_into(self, descriptor: int, buffers: Any, /) -> int:
        if self._files.port_at(descriptor) is None:
            return os.readv(descriptor, buffers) if self._files.wait_to_read(descriptor) else 0
        views = [memoryview(each).cast("B") for each in buffers]
        data = left = self.read(descriptor, sum(map(len, views)))
        for view in views:
            piece, left = left[: len(view)], left[len(view) :]
            view[: len(piece)] = piece
        return len(data)

    def write(self, descriptor: int, data: Any, /) -> int:
        if (port := self._files.port_at(descriptor)) is not None:
            return int(port.port.write(data))
        return int(self.write_by(lambda piece: os.write(descriptor, piece), descriptor, data))

    def write_by(self, write: Callable[[Any], Any], descriptor: int, data: Any) -> Any:
        """Write by a function: into a pipe as much at once as a pipe that is ready takes."""
        count = self._write_inside(write, descriptor, data)
        self._system.note_write(descriptor)
        return count

    def _write_inside(self, write: Callable[[Any], Any], descriptor: int, data: Any) -> Any:
        files = self._files
        state = files.has_inside(descriptor)
        if state is None:
            return write(data)
        # Looking whether it is ready is a poll, which costs time, so a loop of such writes comes to an end.
        if not os.get_blocking(descriptor):
            files.wait_for(descriptor, select.POLLOUT, 0)
            count = write(data)
            files.terminals.note_write(state)
            return count
        # As much as a pipe takes without a wait: else this write would wait in real time.
        left = memoryview(data).cast("B")
        size = len(left)
        while True:
            files.wait_for(descriptor, select.POLLOUT)
            left = left[write(left[: select.PIPE_BUF]) :]
            files.terminals.note_write(state)
            if not left:
                return size

    def pipe(self) -> tuple[int, int]:
        ends: tuple[int, int] = os.pipe()
        self._files.note_inside(*ends)
        return ends

    def openpty(self) -> tuple[int, int]:
        ends = os.openpty()
        self._files.note_inside(*ends)
        self._files.terminals.add(*ends)
        return ends


class _FileMethods:
    """The methods of files, which `open` returns; such a file may be at a port."""

    def __init__(self, files: Files, system: FileSystem, descriptors: _Descriptors) -> None:
        self._files, self._system, self._descriptors = files, system, descriptors

    def replacements(self, scheduler: Scheduler) -> dict[str, Any]:
        """Return the methods."""
        descriptors = self._descriptors

        def method(name: str, for_port: Callable[..., Any], for_others: Callable[..., Any]) -> Callable[..., Any]:
            def call(file: Any, *args: Any) -> Any:
                is_port = not file.closed and self._files.port_at(file.fileno()) is not None
                if is_port and (file.writable() if name == "write" else file.readable()):
                    with suppress(BlockingIOError):
                        return for_port(file, *args)
                    return None
                return for_others(file, *args)

            return for_program(scheduler, call, _file_methods[name])

        return {
            "read": method("read", self._read_port, self._reading("read")),
            "readinto": method(
                "readinto",
                lambda file, buffer, /: descriptors.read_into(file.fileno(), [buffer]),
                self._reading("readinto"),
            ),
            "readall": method("readall", lambda file, /: self._read_port(file), self._read_all),
            "write": method("write", lambda file, data, /: descriptors.write(file.fileno(), data), self._write),
            "close": for_program(scheduler, self._close, _file_methods["close"]),
        }

    def _reading(self, name: str) -> Callable[..., Any]:
        """Return a method that waits before it reads."""

        def call(file: Any, *args: Any) -> Any:
            is_over = not file.closed and not self._files.wait_to_read(file.fileno())
            return _NOTHING[name] if is_over else _file_methods[name](file, *args)

        return call

    def _read_all(self, file: Any) -> Any:
        # What is not waited for comes in one go, as from Python itself.
        if file.closed or not self._files.waits_to_read(os.fstat(file.fileno())) or not os.get_blocking(file.fileno()):
            return _file_methods["readall"](file)
        return b"".join(iter(lambda: self._reading("read")(file, PIPE_CHARACTERS), b""))

    def _read_port(self, file: Any, size: int | None = -1, /) -> bytes:
        if size is not None and size >= 0:
            return self._descriptors.read(file.fileno(), size)
        data = b"".join(self._pieces(file.fileno()))
        if not data and not os.get_blocking(file.fileno()):
            raise BlockingIOError
        return data

    def _pieces(self, descriptor: int) -> Iterator[bytes]:
        with suppress(BlockingIOError):
            while piece := self._descriptors.read(descriptor, PIPE_CHARACTERS):
                yield piece

    def _write(self, file: Any, data: Any, /) -> Any:
        if file.closed:
            return _file_methods["write"](file, data)
        return self._descriptors.write_by(lambda piece: _file_methods["write"](file, piece), file.fileno(), data)

    def _close(self, file: Any) -> None:
        if not file.closed and file.writable():
            self._system.note_close(file.fileno())
        _file_methods["close"](file)


def _terminal_functions(files: Files) -> dict[str, dict[str, Any]]:
    """Return the functions of `fcntl` and `termios`: some descriptors are ports."""

    def port_at(fd: Any) -> PortFile | None:
        return files.port_at(_descriptor(fd))

    def ioctl(fd: Any, request: int, *rest: Any) -> Any:
        if (port := port_at(fd)) is not None:
            # How many characters have arrived is in the terminal itself only after this.
            port.fill()
            if request == termios.TCFLSH and rest:
                return port.flush(rest[0])
            if request == termios.TIOCOUTQ and rest and isinstance(rest[0], bytes):
                return struct.pack("i", port.port.out_waiting)
        return fcntl.ioctl(fd, request, *rest)

    def drain(fd: Any, /) -> None:
        port = port_at(fd)
        termios.tcdrain(fd) if port is None else port.port.flush()

    def flush(fd: Any, queue: int, /) -> None:
        port = port_at(fd)
        termios.tcflush(fd, queue) if port is None else port.flush(queue)

    def get_attributes(fd: Any, /) -> list[Any]:
        port, attributes = port_at(fd), termios.tcgetattr(fd)
        return attributes if port is None else port.attributes(attributes)

    def set_attributes(fd: Any, when: int, attributes: list[Any], /) -> None:
        port = port_at(fd)
        if port is None:
            termios.tcsetattr(fd, when, attributes)
        else:
            port.set_attributes(_descriptor(fd), when, attributes)

    return {
        "fcntl": {"ioctl": ioctl},
        "termios": {"tcdrain": drain, "tcflush": flush, "tcgetattr": get_attributes, "tcsetattr": set_attributes},
    }


def _descriptor(file: Any) -> int:
    """Return the descriptor of a file, or of what is one."""
    return file if isinstance(file, int) else int(file.fileno())
