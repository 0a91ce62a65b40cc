"""Terminals that a program reads: those of a person, and pseudo-terminals of which it has both ends.

A thread that plays the robot on a pseudo-terminal is the usual test of a driver.
"""

from __future__ import annotations

import os
import stat
import termios
from collections.abc import Callable, Iterable
from contextlib import suppress

from kiks.script.cpython import unchanged

SETTLED_MS = 100
"""Longest time that the operating system may need to carry characters through a terminal [ms of real time]."""

_fstat: Callable[[int], os.stat_result] = unchanged(os.fstat)

Identity = tuple[int, int]
"""Device and inode of a file."""


def status(descriptor: int) -> os.stat_result | None:
    """Return the status of a descriptor; None if it is closed."""
    try:
        return _fstat(descriptor)
    except OSError:
        return None


def identity(state: os.stat_result) -> Identity:
    """Return what tells a file from all others."""
    return state.st_dev, state.st_ino


def patience(terminal: int) -> tuple[int, float | None]:
    """Return how many characters a read of a terminal waits for, and how long [s]; None for ever."""
    _, _, _, local, _, _, characters = termios.tcgetattr(terminal)
    if local & termios.ICANON:
        return 1, None
    least, tenths = characters[termios.VMIN], characters[termios.VTIME]
    return least, None if least else tenths / 10


class OwnTerminals:
    """The pseudo-terminals that a program has opened.

    What is written into one end takes the operating system some real time to reach the other one. Simulated time stands
    still meanwhile, so that the run is the same each time.
    """

    def __init__(self) -> None:
        # All masters are one file.
        self._slaves: set[Identity] = set()
        self._masters: set[Identity] = set()
        # The ends to which characters may be under way.
        self._expecting: set[Identity] = set()

    def add(self, master: int, slave: int) -> None:
        """Note the two ends of a pseudo-terminal."""
        self._masters.add(identity(os.fstat(master)))
        self._slaves.add(identity(os.fstat(slave)))

    def has(self, path: str) -> bool:
        """Return whether a path leads to one."""
        with suppress(OSError):
            return bool(self._slaves) and identity(os.stat(path)) in self._slaves
        return False

    def is_master(self, state: os.stat_result) -> bool:
        """Return whether a file is the end at which the program plays a device."""
        return identity(state) in self._masters

    def note_write(self, state: os.stat_result) -> None:
        """Note that the program has written into a file."""
        if stat.S_ISCHR(state.st_mode) and self._slaves:
            if identity(state) in self._masters:
                self._expecting |= self._slaves
            elif identity(state) in self._slaves:
                self._expecting |= self._masters

    def settle_ms(self, descriptors: Iterable[int]) -> int:
        """Return how long characters may be under way to descriptors that are looked at now [ms of real time]."""
        if not self._expecting:
            return 0
        looked_at = {identity(state) for each in descriptors if (state := status(each)) is not None}
        expected = looked_at & self._expecting
        self._expecting -= expected
        return SETTLED_MS if expected else 0
