"""Detects calls that leave simulated time, so that no program ends with a wrong result.

Python reports calls that leave the program by audit events (PEP 578). Sockets, Python processes and devices that a
program opens by itself would live in real time: the program ends with one line that names `kiks serve`.
"""

from __future__ import annotations

import os
import sys
from _multiprocessing import SemLock  # type: ignore[import-not-found]
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from multiprocessing.process import BaseProcess
from typing import Any

from kiks.script import socket_waits
from kiks.script.children import STARTS, refuse_start
from kiks.script.devices import is_serial
from kiks.script.file_system import FileSystem
from kiks.script.refusals import refuse, refuse_network
from kiks.script.thread_scheduler import Scheduler

_FORKS = frozenset({"os.fork", "os.forkpty"})
_OF_C = frozenset(f"{name}{size}" for name in ("creat", "fopen", "open", "openat") for size in ("", "64")) | {
    *("execv", "execve", "execvp", "fork", "popen", "posix_spawn", "system", "vfork")
}
"""Functions of the C library that open files or start processes, where no event tells what."""

_HEARD = {"open", "import", "os.exec", "ctypes.dlsym", *_FORKS, *STARTS, *socket_waits.EVENTS}
_REFUSED = {
    **dict.fromkeys(("uvloop", "gevent", "eventlet"), ("wait by Python's own event loops", "Use asyncio, or ")),
    "time_machine": ("leave the insides of Python's clocks alone", "Use unittest.mock or freezegun, or "),
}
"""Modules that cannot be there: what a program must do, and what it can use instead."""

_watching: list[tuple[Scheduler, FileSystem]] = []


def replacements(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of `os` and `multiprocessing`, by module."""

    def open_file(path: Any, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        if dir_fd is not None:
            # The event tells nothing of the folder.
            _check_device(scheduler, os.path.join(f"/proc/self/fd/{dir_fd}", os.fsdecode(path)))
        return os.open(path, flags, mode, dir_fd=dir_fd)

    def start(process: Any) -> None:
        refuse(scheduler, "start no process of Python by itself", "it did, by multiprocessing", "Use threads, or ")

    def acquire(lock: Any, block: bool = True, timeout: float | None = None) -> bool:
        if is_acquired := real_acquire(lock, False):
            return bool(is_acquired)
        if block:
            refuse(scheduler, "wait by locks of threading", "it waited for one of multiprocessing", "Use those, or ")
        scheduler.poll()
        return False

    real_acquire = SemLock.acquire
    return {
        "posix": {"open": open_file},
        "_multiprocessing.SemLock": dict.fromkeys(("acquire", "__enter__"), acquire),
        f"{BaseProcess.__module__}.BaseProcess": {"start": start},
    }


@contextmanager
def watched(scheduler: Scheduler, system: FileSystem) -> Iterator[None]:
    """End the program where it leaves simulated time."""
    _install()
    _watching.append((scheduler, system))
    try:
        yield
    finally:
        _watching.pop()


@cache
def _install() -> None:
    """Install the audit hook, once: Python cannot remove one."""
    sys.addaudithook(_audit)


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if event in _HEARD and _watching:
        scheduler, system = _watching[-1]
        if scheduler.is_here:
            _judge(scheduler, system, event, arguments)


def _judge(scheduler: Scheduler, system: FileSystem, event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open":
        path, _, flags = arguments
        _check_device(scheduler, path)
        # Code in C writes it past Python, and the system would stamp it in real time.
        if isinstance(path, str | bytes) and flags & os.O_CREAT and flags & (os.O_TRUNC | os.O_EXCL):
            system.note_open(path)
    elif event == "import":
        if arguments[0] in _REFUSED:
            must, way = _REFUSED[arguments[0]]
            refuse(scheduler, must, f"it imported {arguments[0]}", way)
    elif event in socket_waits.EVENTS:
        if not socket_waits.is_inside(event, arguments):
            refuse_network(scheduler, "it used the network")
    elif event in _FORKS:
        refuse(scheduler, "be one process", "it started one more by fork", "Use threads, or ")
    elif event == "os.exec":
        name = os.path.basename(os.fsdecode(arguments[0]))
        refuse(scheduler, "stay in its process", f"it replaced itself by {name}", "Start that by subprocess, or ")
    elif event == "ctypes.dlsym":
        if arguments[1] in _OF_C:
            must = "open files and start processes by Python itself"
            refuse(scheduler, must, f"it asked for {arguments[1]} of C", "Use os, or ")
    else:
        refuse_start(scheduler, event, arguments)


def _check_device(scheduler: Scheduler, path: Any) -> None:
    if is_serial(path):
        refuse(scheduler, "open a serial port by pyserial", f"it opened {os.fsdecode(path)} by itself")
