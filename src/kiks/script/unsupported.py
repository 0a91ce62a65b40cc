"""Detects calls that leave simulated time, so that no program ends with a wrong result.

Python reports calls that leave the program by audit events (PEP 578). Sockets, Python processes and devices that a
program opens by itself would live in real time: the program ends with one line that names `kiks serve`. Other programs,
such as one that plays a sound, take no simulated time: the program that starts one waits for its end.
"""

from __future__ import annotations

import os
import re
import selectors
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import FrameType
from typing import Any

from kiks.script.thread_scheduler import Scheduler

ADVICE = "run it on kiks serve, where time is real."
"""Advice for a program that cannot run in simulated time."""

OURS = (str(Path(__file__).parent.parent), os.path.dirname(os.__file__))
"""Folders of foreign code: KiKS, and Python's own library without installed packages."""

_SOCKETS = frozenset(f"socket.{name}" for name in ("connect", "bind", "sendto", "sendmsg", "getaddrinfo"))
_FORKS = frozenset({"os.fork", "os.forkpty"})
_STARTS = frozenset({"subprocess.Popen", "os.system", "os.posix_spawn", "os.exec", "os.spawn"})
_OTHER_LOOPS = frozenset({"uvloop", "gevent", "eventlet"})
_DEVICE = re.compile(r"/dev/(tty(?!$)|cu\.|serial/|rfcomm)")
# A command of Python, at the beginning of a line of a shell or of one of its parts.
_PYTHON = re.compile(r"(^|[;&|(]|/sh -c )\s*((env|nohup|sudo|exec)\s+)*(\S*/)?((python|pypy)[\d.]*|\S+\.py)(\s|$)")

_watching: list[Scheduler] = []


def replacements(scheduler: Scheduler) -> dict[str, dict[str, Any]]:
    """Return the replacements for names of `subprocess` and `multiprocessing`, by module."""
    real_poll = subprocess.Popen.poll

    def start(process: Any) -> None:
        refuse(scheduler, "start no process of Python by itself", "it did, by multiprocessing", "Use threads, or ")

    def wait(popen: subprocess.Popen[Any], timeout: float | None = None) -> int:
        return real_wait(popen, None)

    def poll(popen: subprocess.Popen[Any]) -> int | None:
        code = real_poll(popen)
        return real_wait(popen, None) if code is None else code

    def communicate(popen: subprocess.Popen[Any], input: Any = None, timeout: float | None = None) -> Any:
        return real_communicate(popen, input, None)

    real_wait, real_communicate = subprocess.Popen.wait, subprocess.Popen.communicate
    return {
        "subprocess.Popen": {"wait": wait, "poll": poll, "communicate": communicate},
        # What `subprocess` waits for is real.
        "subprocess": {"_PopenSelector": selectors.PollSelector, "_time": time.monotonic},
        f"{BaseProcess.__module__}.BaseProcess": {"start": start},
    }


@contextmanager
def watched(scheduler: Scheduler) -> Iterator[None]:
    """End the program where it leaves simulated time."""
    _hook.install()
    _watching.append(scheduler)
    try:
        yield
    finally:
        _watching.remove(scheduler)


class _Hook:
    """The audit hook; Python cannot remove one."""

    is_installed = False

    def install(self) -> None:
        if not self.is_installed:
            self.is_installed = True
            sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if _watching and (event in ("open", "import") or event in _SOCKETS or event in _FORKS or event in _STARTS):
            scheduler = _watching[-1]
            if scheduler.is_here:
                _judge(scheduler, event, arguments)


_hook = _Hook()


def _judge(scheduler: Scheduler, event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open":
        if isinstance(arguments[0], str) and _DEVICE.match(arguments[0]):
            refuse(scheduler, "open a serial port by pyserial", f"it opened {arguments[0]} by itself")
    elif event == "import":
        if arguments[0] in _OTHER_LOOPS:
            refuse(scheduler, "wait by Python's own event loops", f"it imported {arguments[0]}", "Use asyncio, or ")
    elif event in _SOCKETS:
        refuse(scheduler, "talk to its robots alone", "it used the network")
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


def refuse(scheduler: Scheduler, must: str, given: str, way: str = "") -> None:
    """End the program with one line: what it must do, what it did, and what to do instead."""
    advice = way + ADVICE
    scheduler.end(
        1,
        f"a program in simulated time must {must}, but {given}{where(sys._getframe())}. "
        f"{advice[0].upper()}{advice[1:]}",
    )


def where(frame: FrameType | None) -> str:
    """Say where in the program a frame is: the innermost line that is neither ours nor Python's; nothing if nowhere."""
    while frame is not None:
        name = frame.f_code.co_filename
        if not name.startswith(("<", *OURS)) or "site-packages" in name:
            return f" ({os.path.basename(name)}, line {frame.f_lineno})"
        frame = frame.f_back
    return ""
