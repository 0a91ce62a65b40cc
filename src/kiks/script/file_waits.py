"""Waiting for files, simulated ports among them; `file_calls.py` has the functions that wait.

A call that would wait is made again and again with no wait, and simulated time passes in between. So all event loops
work. Ports have descriptors, too (`port_file.py`).
"""

from __future__ import annotations

import os
import select
import stat
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any, TypeVar

from kiks.script.port_file import PortFile
from kiks.script.shared_line import SharedLine
from kiks.script.terminals import Identity, OwnTerminals, identity, patience, status
from kiks.script.thread_scheduler import LOOKED_FOR_KEYS, Scheduler, timeout_ns
from kiks.sim.read_completion import NEVER_NS, Read

TASKS = "/proc/self/task"
"""Where Linux lists the threads of this process, each with its child processes (man 5 proc)."""

real_poll = type(select.poll()).poll

Found = TypeVar("Found")
AnyPort = TypeVar("AnyPort", bound=PortFile)


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

    Attributes:
        terminals: The pseudo-terminals of the program.
    """

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self.terminals = OwnTerminals()
        # By what all copies of its descriptor share.
        self._ports: dict[Identity, PortFile] = {}
        # What the program has opened to talk to itself.
        self._inside: set[Identity] = set()
        # Where a person, or another program, writes to this one.
        self._input = None if (state := status(0)) is None else identity(state)
        # Processes that were there before the program, such as the one that multiprocessing keeps, know nothing of it.
        self._earlier_children = _children()

    # ---- ports ----

    def add(self, line: SharedLine, port: Any, kind: Callable[..., AnyPort]) -> AnyPort:
        """Return a file for a port, of a kind of `PortFile`."""
        file = kind(self._scheduler, line, port)
        self._ports[file.identity] = file
        self._scheduler.before_time.append(file.settle)
        return file

    def remove(self, descriptor: int) -> None:
        """Close the descriptor of a port."""
        (file,) = (each for each in self._ports.values() if each.descriptor == descriptor)
        file.settle()
        del self._ports[file.identity]
        self._scheduler.before_time.remove(file.settle)
        file.close()

    def port_at(self, descriptor: int) -> PortFile | None:
        """Return the port behind a descriptor, which may be a copy of the port's own."""
        state = status(descriptor) if self._ports else None
        return None if state is None else self._ports.get(identity(state))

    # ---- what ends only by the program itself ----

    def note_inside(self, *descriptors: int) -> None:
        """Note descriptors whose other ends the program has."""
        for each in descriptors:
            self._inside.add(identity(os.fstat(each)))

    def has_inside(self, descriptor: int) -> os.stat_result | None:
        """Return the status of a descriptor whose other end the program has; None for any other."""
        state = status(descriptor) if self._inside else None
        return state if state is not None and identity(state) in self._inside else None

    def are_inside(self, descriptors: Iterable[int]) -> bool:
        """Return whether only the program can do something at the other ends of descriptors."""
        if _children() - self._earlier_children:
            return False  # a child may have got the other end
        for each in descriptors:
            if self.port_at(each) is None:
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
        states = {each: status(each) for each in descriptors or () if self.port_at(each) is None}
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
        looked_at = None if descriptors is None else set(map(self.port_at, descriptors))
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
            ports = [each for each in ports if each.identity in self._ports]
            reads = _fill(ports)
            if files.is_over(0) or scheduler.world.now_ns >= deadline_ns:
                break
            files.is_for_person = self._waits_for_person(descriptors, timeout_s)
            scheduler.wait("files", until_ns=deadline_ns, reads=reads, files=files)
            scheduler.program.thread.act()
            if files.found:
                break
        return files.found  # type: ignore[no-any-return]

    def wait_for(self, descriptor: int, events: int, timeout_s: float | None = None) -> bool:
        """Wait until a file is ready; return whether it is."""
        poll = select.poll()
        poll.register(descriptor, events)
        return bool(self.wait(lambda block_ms: real_poll(poll, block_ms), timeout_s, (descriptor,)))

    def waits_to_read(self, state: os.stat_result) -> bool:
        """Return whether a read of a file waits for other threads of the program, or for a person."""
        return identity(state) in self._inside or self._is_outside(state)

    def wait_to_read(self, descriptor: int) -> bool:
        """Wait until a file can be read, if another one than the operating system can make it wait.

        If it does not block, looking at it is a poll.

        Returns:
            False if a terminal's patience is over, and the read is to return nothing.
        """
        state = status(descriptor)
        if state is None or not self.waits_to_read(state):
            return True
        if not os.get_blocking(descriptor):
            self.wait_for(descriptor, select.POLLIN, 0)
            return True
        has_patience = os.isatty(descriptor) and not self.terminals.is_master(state)
        return self.wait_for(descriptor, select.POLLIN, patience(descriptor)[1] if has_patience else None)


def _fill(ports: Iterable[PortFile]) -> list[Read]:
    return [each.fill() for each in ports]
