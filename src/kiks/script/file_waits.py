"""Waiting for several files at once, simulated ports among them: `select`, `selectors`, and so asyncio's event loops.

A port is readable when a character has arrived, and always writable. Real files, such as a pipe between two threads,
are polled in real time, and simulated time passes only while none of them is ready.
"""

from __future__ import annotations

import math
import os
import select
import selectors
from collections.abc import Iterable, Mapping
from typing import Any

from kiks.script.shared_line import SharedLine
from kiks.script.thread_scheduler import Scheduler, timeout_ns
from kiks.sim.read_completion import NEVER_NS, Read

BLOCK_MS = 50
"""Longest wait in real time between two checks for signals [ms]."""

READ, WRITE = select.POLLIN, select.POLLOUT

_real_poll, _real_read, _real_write = select.poll, os.read, os.write


class RealFiles:
    """The real files that threads wait for."""

    def ready(self, wanted: Mapping[int, int], *, block: bool) -> set[int]:
        """Return the descriptors with an event; see `thread_scheduler.Files`."""
        return set(poll_files(wanted, None if block else 0))


def poll_files(wanted: Mapping[int, int], timeout_ms: int | None) -> dict[int, int]:
    """Return the events of real files by descriptor; wait in real time up to a timeout [ms]."""
    poll = _real_poll()
    for descriptor, events in wanted.items():
        poll.register(descriptor, events)
    while True:
        found = poll.poll(BLOCK_MS if timeout_ms is None else timeout_ms)
        if found or timeout_ms is not None:
            return dict(found)


class OpenPorts:
    """The simulated ports that have a file descriptor.

    Args:
        scheduler: The program's threads.
    """

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        # By descriptor: the line, and its port of `serial`.
        self._ports: dict[int, tuple[SharedLine, Any]] = {}

    def add(self, line: SharedLine, port: Any) -> int:
        """Return a file descriptor for a port: the end of a terminal, which answers all requests to one."""
        other, descriptor = os.openpty()
        os.close(other)
        self._ports[descriptor] = line, port
        return descriptor

    def remove(self, descriptor: int) -> None:
        """Close a descriptor."""
        del self._ports[descriptor]
        os.close(descriptor)

    def wait(self, wanted: Mapping[int, int], timeout_s: float | None) -> dict[int, int]:
        """Return events by descriptor; wait for one.

        Args:
            wanted: The events of interest, as in `select.poll`, by descriptor.
            timeout_s: Timeout [s]; None for ever.
        """
        scheduler = self._scheduler
        deadline_ns = NEVER_NS if timeout_s is None else scheduler.world.now_ns + timeout_ns(timeout_s)
        found = self._look(wanted)
        if not found and timeout_s is not None and timeout_s <= 0:
            scheduler.poll()
            return self._look(wanted)
        while not found and scheduler.world.now_ns < deadline_ns:
            reads = [
                Read(self._ports[descriptor][0].robot, 1)
                for descriptor, events in wanted.items()
                if descriptor in self._ports and events & READ
            ]
            files = {descriptor: events for descriptor, events in wanted.items() if descriptor not in self._ports}
            scheduler.wait("files", until_ns=deadline_ns, reads=reads, files=files)
            scheduler.program.waiting.act()
            wanted = {descriptor: events for descriptor, events in wanted.items() if _is_open(descriptor)}
            found = self._look(wanted)
        return found

    def _look(self, wanted: Mapping[int, int]) -> dict[int, int]:
        found = {}
        files = {}
        for descriptor, events in wanted.items():
            if descriptor not in self._ports:
                files[descriptor] = events
                continue
            line = self._ports[descriptor][0]
            happened = events & WRITE | (READ if events & READ and line.arrived_count() else 0)
            if happened:
                found[descriptor] = happened
        if files:
            found |= poll_files(files, 0)
        return found

    # ---- replacements for names of `select`, `selectors` and `os` ----

    def replacements(self) -> dict[str, dict[str, Any]]:
        """Return the replacements, by module."""
        ports = self

        class Poll:
            """See `select.poll`."""

            def __init__(self) -> None:
                self._wanted: dict[int, int] = {}

            def register(self, file: Any, eventmask: int = READ | WRITE | select.POLLPRI, /) -> None:
                self._wanted[_descriptor(file)] = eventmask

            def modify(self, file: Any, eventmask: int, /) -> None:
                if _descriptor(file) not in self._wanted:
                    raise FileNotFoundError(2, "No such file or directory")
                self._wanted[_descriptor(file)] = eventmask

            def unregister(self, file: Any, /) -> None:
                del self._wanted[_descriptor(file)]

            def poll(self, timeout: float | None = None, /) -> list[tuple[int, int]]:
                timeout_s = None if timeout is None or timeout < 0 else timeout / 1000
                return list(ports.wait(self._wanted, timeout_s).items())

        class Epoll(Poll):
            """See `select.epoll`: the same numbers stand for the same events."""

            closed = False

            def __init__(self, sizehint: int = -1, flags: int = 0) -> None:
                super().__init__()

            def poll(self, timeout: float | None = None, maxevents: int = -1) -> list[tuple[int, int]]:
                found = list(ports.wait(self._wanted, None if timeout is None or timeout < 0 else timeout).items())
                return found if maxevents < 0 else found[:maxevents]

            def close(self) -> None:
                self.closed = True

            def __enter__(self) -> Epoll:
                return self

            def __exit__(self, *_: object) -> None:
                self.close()

        class Selector(selectors._BaseSelectorImpl):
            """See `selectors.DefaultSelector`."""

            def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
                wanted = {
                    key.fd: (READ if key.events & selectors.EVENT_READ else 0)
                    | (WRITE if key.events & selectors.EVENT_WRITE else 0)
                    for key in self.get_map().values()
                }
                ready = []
                for descriptor, happened in ports.wait(wanted, timeout).items():
                    key = self.get_map().get(descriptor)
                    if key is not None:
                        events = (selectors.EVENT_READ if happened & ~WRITE else 0) | (
                            selectors.EVENT_WRITE if happened & ~READ else 0
                        )
                        if events & key.events:
                            ready.append((key, events & key.events))
                return ready

        def simulated_select(
            rlist: Iterable[Any], wlist: Iterable[Any], xlist: Iterable[Any], timeout: float | None = None, /
        ) -> tuple[list[Any], list[Any], list[Any]]:
            if timeout is not None and (timeout < 0 or math.isnan(timeout)):
                raise ValueError("timeout must be non-negative")
            reading, writing, special = (
                [(each, _descriptor(each)) for each in files] for files in (rlist, wlist, xlist)
            )
            wanted: dict[int, int] = {}
            for files, events in ((reading, READ), (writing, WRITE), (special, select.POLLPRI)):
                for _, descriptor in files:
                    wanted[descriptor] = wanted.get(descriptor, 0) | events
            found = ports.wait(wanted, timeout)
            return (
                [each for each, descriptor in reading if found.get(descriptor, 0) & ~(WRITE | select.POLLPRI)],
                [each for each, descriptor in writing if found.get(descriptor, 0) & ~(READ | select.POLLPRI)],
                [each for each, descriptor in special if found.get(descriptor, 0) & select.POLLPRI],
            )

        def read(descriptor: int, length: int, /) -> bytes:
            port = ports._ports.get(descriptor)
            if port is not None:
                return _read_port(port[1], length)
            if ports._scheduler.is_here and ports._scheduler.tasks and os.get_blocking(descriptor):
                # Another thread of the program may write there.
                ports.wait({descriptor: READ}, None)
            return _real_read(descriptor, length)

        def write(descriptor: int, data: bytes, /) -> int:
            port = ports._ports.get(descriptor)
            return _real_write(descriptor, data) if port is None else port[1].write(data)

        return {
            "select": {"select": simulated_select, "poll": Poll, "epoll": Epoll},
            "selectors": {
                name: Selector
                for name in ("DefaultSelector", "EpollSelector", "PollSelector", "SelectSelector")
                if hasattr(selectors, name)
            },
            "os": {"read": read, "write": write},
        }


def _read_port(port: Any, length: int) -> bytes:
    """Read like a descriptor of a terminal: wait for at least one character, and return all that have arrived."""
    timeout, port.timeout = port.timeout, None
    try:
        first: bytes = port.read(1)
        rest: bytes = port.read(min(length - 1, port.in_waiting))
        return first + rest
    finally:
        port.timeout = timeout


def _descriptor(file: Any) -> int:
    """Return a file's descriptor, like `select`.

    Raises:
        ValueError: If it is negative.
        TypeError: If the object is no file.
    """
    descriptor = file if isinstance(file, int) else getattr(file, "fileno", lambda: None)()
    if not isinstance(descriptor, int):
        raise TypeError("argument must be an int, or have a fileno() method.")
    if descriptor < 0:
        raise ValueError(f"file descriptor cannot be a negative integer ({descriptor})")
    return descriptor


def _is_open(descriptor: int) -> bool:
    try:
        os.fstat(descriptor)
    except OSError:
        return False
    return True
