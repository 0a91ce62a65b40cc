"""Detects calls that leave simulated time, so that no program ends with a wrong result.

Python reports calls that leave the program by audit events (PEP 578). Sockets, Python processes and devices that a
program opens by itself would live in real time: the program ends with one line that names `kiks serve`. Other programs,
such as one that plays a sound, take no simulated time: the program that starts one waits for its end.
"""

from __future__ import annotations

import os
import re
import sys
from _multiprocessing import SemLock  # type: ignore[import-not-found]
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from multiprocessing.process import BaseProcess
from subprocess import Popen
from typing import Any

from kiks.script import socket_waits
from kiks.script.file_system import FileSystem
from kiks.script.patching import for_program
from kiks.script.refusals import refuse, refuse_network
from kiks.script.thread_scheduler import Scheduler

_FORKS = frozenset({"os.fork", "os.forkpty"})
_STARTS = frozenset({"subprocess.Popen", "os.system", "os.posix_spawn", "os.exec", "os.spawn"})
_REFUSED = {
    **dict.fromkeys(("uvloop", "gevent", "eventlet"), ("wait by Python's own event loops", "Use asyncio, or ")),
    "time_machine": ("leave the insides of Python's clocks alone", "Use unittest.mock or freezegun, or "),
}
"""Modules that cannot be there: what a program must do, and what it can use instead."""

_DEVICE = re.compile(r"/dev/(tty(?!$)|cu\.|serial/|rfcomm)")
# A command of Python, at the beginning of a line of a shell or of one of its parts.
_PYTHON = re.compile(r"(^|[;&|(]|/sh -c )\s*((env|nohup|sudo|exec)\s+)*(\S*/)?((python|pypy)[\d.]*|\S+\.py)(\s|$)")

_watching: list[tuple[Scheduler, FileSystem]] = []


def replacements(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of `subprocess` and `multiprocessing`, by module."""

    def start(process: Any) -> None:
        refuse(scheduler, "start no process of Python by itself", "it did, by multiprocessing", "Use threads, or ")

    def wait(popen: Popen[Any], timeout: float | None = None) -> int:
        with scheduler.real_time():
            return real_wait(popen, None)

    def poll(popen: Popen[Any]) -> int | None:
        return wait(popen)

    def communicate(popen: Popen[Any], input: Any = None, timeout: float | None = None) -> Any:
        with scheduler.real_time():
            return real_communicate(popen, input, None)

    def acquire(lock: Any, block: bool = True, timeout: float | None = None) -> bool:
        if is_acquired := real_acquire(lock, False):
            return bool(is_acquired)
        if block:
            refuse(scheduler, "wait by locks of threading", "it waited for one of multiprocessing", "Use those, or ")
        scheduler.poll()
        return False

    real_wait, real_poll, real_communicate = Popen.wait, Popen.poll, Popen.communicate
    real_acquire = SemLock.acquire
    return {
        # `terminate` and the like only look whether there is a process.
        "subprocess.Popen": {"wait": wait, "poll": for_program(scheduler, poll, real_poll), "communicate": communicate},
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
    sys.addaudithook(_hear)


def _hear(event: str, arguments: tuple[Any, ...]) -> None:
    if _watching and (
        event in ("open", "import") or event in socket_waits.EVENTS or event in _FORKS or event in _STARTS
    ):
        scheduler, system = _watching[-1]
        if scheduler.is_here:
            _judge(scheduler, system, event, arguments)


def _judge(scheduler: Scheduler, system: FileSystem, event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open":
        path, _, flags = arguments
        if isinstance(path, str) and _DEVICE.match(path):
            refuse(scheduler, "open a serial port by pyserial", f"it opened {path} by itself")
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
    elif _PYTHON.search(_command(arguments)):
        refuse(
            scheduler,
            "start no process of Python by itself",
            "it did",
            "Name it beside this one: kiks run A.py B.py; or ",
        )


def _command(arguments: tuple[Any, ...]) -> str:
    """Return the command that a process is started with: `os.system` has it alone, all others behind the file."""
    command = arguments[min(1, len(arguments) - 1)]
    words = command if isinstance(command, list | tuple) else [command]
    return " ".join(os.fsdecode(word) for word in words if isinstance(word, str | bytes | os.PathLike))
