"""The file system as a program finds it: with the serial ports of its robots, and with times on its own calendar.

What the program has written just now is as old as its clock says. The operating system stamps files in real time. A
file from before the program keeps its age at the program's start. Later stamps get the simulated time at which the
program has written the file.
"""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import cached_property
from typing import Any

from kiks.clock.program_clock import calendar_ns
from kiks.script.patching import for_program
from kiks.script.thread_scheduler import Scheduler
from kiks.units import NS_PER_S

COARSE_NS = 20_000_000
"""Longest time by which the operating system's stamps may lag behind its clock [ns]: one tick of its timer."""

_FIELDS = ("atime", "mtime", "ctime")
_real_entry_stat = os.DirEntry.stat


class _PortEntry:
    """A port in its folder; see `os.DirEntry`."""

    def __init__(self, folder: str, name: str) -> None:
        self.name = name
        self.path = os.path.join(folder, name)

    def __fspath__(self) -> str:
        return self.path

    def inode(self) -> int:
        """See `os.DirEntry.inode`."""
        return int(os.stat(os.devnull).st_ino)

    def is_dir(self, *, follow_symlinks: bool = True) -> bool:
        """See `os.DirEntry.is_dir`."""
        return False

    is_file = is_dir

    def is_symlink(self) -> bool:
        """See `os.DirEntry.is_symlink`."""
        return False

    def stat(self, *, follow_symlinks: bool = True) -> os.stat_result:
        """See `os.DirEntry.stat`."""
        return os.stat(self.path)


class _Entries:
    """The entries of a folder, with ports; see `os.scandir`."""

    def __init__(self, real: Any, more: Sequence[_PortEntry]) -> None:
        self._real = real
        self._more = iter(more)

    def __iter__(self) -> Iterator[Any]:
        return self

    def __next__(self) -> Any:
        try:
            return next(self._real)
        except StopIteration:
            return next(self._more)

    def __enter__(self) -> _Entries:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the folder."""
        self._real.close()


class FileSystem:
    """The file system of a program, with the names of the ports that it finds."""

    def __init__(self, scheduler: Scheduler, ports: Sequence[str]) -> None:
        self._scheduler = scheduler
        self._ports = ports
        self._start_ns = time.time_ns()
        # By device, inode and field: the stamp of the operating system, and what it is to the program.
        self._known: dict[tuple[int, int, str], tuple[int, int]] = {}
        # When the program has opened files to write them anew, by path.
        self._opened: dict[str, int] = {}

    def _now_ns(self) -> int:
        # A file needs no world: a program that only looks at one must not wait for a world that has been stopped.
        return calendar_ns(self._scheduler.world.known_ns)

    @cached_property
    def _shift_ns(self) -> int:
        """Difference between the two calendars [ns]."""
        return time.time_ns() - self._now_ns()

    def note_open(self, path: str | bytes) -> None:
        """Note that the program opens a file now to write it anew."""
        self._opened[os.path.abspath(os.fsdecode(path))] = self._now_ns()

    def note_write(self, descriptor: int) -> None:
        """Note that the program has written into a file now."""
        real = os.fstat(descriptor)
        if stat.S_ISREG(real.st_mode):
            self._note(real, self._now_ns())

    def note_close(self, descriptor: int) -> None:
        """Note the last change of a file that is closed now, by code in C."""
        real = os.fstat(descriptor)
        if stat.S_ISREG(real.st_mode):
            self.translated(real)

    def _note(self, real: os.stat_result, now_ns: int) -> None:
        for field in ("mtime", "ctime"):
            self._known[real.st_dev, real.st_ino, field] = getattr(real, f"st_{field}_ns"), now_ns

    def translated(self, real: os.stat_result) -> os.stat_result:
        """Return the status of a file with times on the program's calendar."""
        while self._opened:
            path, opened_ns = self._opened.popitem()
            try:
                status = os.stat(path)
            except OSError:
                continue
            if (status.st_dev, status.st_ino, "mtime") not in self._known and self._is_new(status.st_mtime_ns):
                self._note(status, opened_ns)
        times_ns = [self._translated_ns(real, field) for field in _FIELDS]
        plain: tuple[Any, ...]
        more: dict[str, Any]
        plain, more = real.__reduce__()[1]  # type: ignore[str-unpack, assignment]
        plain = (*plain[:7], *(each // NS_PER_S for each in times_ns), *plain[10:])
        for field, time_ns in zip(_FIELDS, times_ns, strict=True):
            more[f"st_{field}"], more[f"st_{field}_ns"] = time_ns / NS_PER_S, time_ns
        return os.stat_result(plain, more)

    def _is_new(self, stamp_ns: int) -> bool:
        return stamp_ns >= self._start_ns - COARSE_NS

    def _translated_ns(self, real: os.stat_result, field: str) -> int:
        stamp_ns = getattr(real, f"st_{field}_ns")
        key = real.st_dev, real.st_ino, field
        known = self._known.get(key)
        if known is not None and known[0] == stamp_ns:
            return known[1]
        if not self._is_new(stamp_ns):
            return int(stamp_ns - self._shift_ns)
        # Code in C has changed it since the program has looked last.
        self._known[key] = stamp_ns, self._now_ns()
        return self._known[key][1]

    def replacements(self) -> dict[str, dict[str, Any]]:
        """Return the replacements for names of `os`."""

        def entry_stat(entry: Any, *, follow_symlinks: bool = True) -> os.stat_result:
            return self.translated(_real_entry_stat(entry, follow_symlinks=follow_symlinks))

        def utime(path: Any, times: Any = None, *, ns: Any = None, **where: Any) -> None:
            if times is not None and ns is None:
                ns, times = tuple(round(each * NS_PER_S) for each in times), None
            if ns is None:
                ns = (self._now_ns(), self._now_ns())
            accessed_ns, changed_ns = ns
            os.utime(path, times, ns=(accessed_ns + self._shift_ns, changed_ns + self._shift_ns), **where)
            real = os.stat(path, **where)
            for field, time_ns in (("atime", accessed_ns), ("mtime", changed_ns), ("ctime", self._now_ns())):
                self._known[real.st_dev, real.st_ino, field] = getattr(real, f"st_{field}_ns"), time_ns

        def noting(name: str, place: int) -> Any:
            """Return a function that changes a file, and notes when it has done so."""

            def call(*args: Any, **kwargs: Any) -> Any:
                done = getattr(os, name)(*args, **kwargs)
                with suppress(OSError, IndexError):
                    self.translated(os.lstat(args[place]))
                return done

            return call

        def is_port(path: Any) -> bool:
            return isinstance(path, str | bytes | os.PathLike) and os.fsdecode(path) in self._ports

        def status(real: Any) -> Any:
            """Return the function for a status; a port is a device, as any terminal is."""
            return lambda path, *args, **kwargs: self.translated(
                real(os.devnull if is_port(path) else path, *args, **kwargs)
            )

        def access(path: Any, *args: Any, **kwargs: Any) -> bool:
            return is_port(path) or os.access(path, *args, **kwargs)

        def ports_in(folder: Any, there: Sequence[str]) -> list[str]:
            if not isinstance(folder, str | os.PathLike):
                return []
            split = (os.path.split(each) for each in self._ports)
            # `pathlib` lists "/dev/" from 3.14 on.
            listed = os.path.normpath(folder)
            return [name for parent, name in split if parent == listed and name not in there]

        def listdir(path: Any = ".") -> list[Any]:
            there = os.listdir(path)
            return [*there, *ports_in(path, there)]

        def scandir(path: Any = ".") -> Any:
            if names := ports_in(path, ()):
                there = os.listdir(path)
                return _Entries(os.scandir(path), [_PortEntry(path, each) for each in names if each not in there])
            return os.scandir(path)

        return {
            "posix": {
                "stat": status(os.stat),
                "lstat": status(os.lstat),
                "fstat": lambda fd: self.translated(os.fstat(fd)),
                "utime": utime,
                **{name: noting(name, 0) for name in ("chmod", "mkdir", "mkfifo", "truncate")},
                "symlink": noting("symlink", 1),
                "access": access,
                "listdir": listdir,
                "scandir": scandir,
            },
            "posix.DirEntry": {"stat": for_program(self._scheduler, entry_stat, _real_entry_stat)},
        }
