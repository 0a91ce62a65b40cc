"""Processes that a program starts. They take no simulated time: the program waits for the end of each.

A process of Python would live in real time, and open real ports. One that the program starts itself is refused at the
call. One that a shell or another program starts finds a folder in its environment where Python looks for what to do at
its start: there it tells this program, and ends.
"""

from __future__ import annotations

import os
import posix  # a debugger changes names of os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from inspect import signature
from pathlib import Path
from subprocess import Popen
from typing import Any

from kiks.script.cpython import unchanged
from kiks.script.devices import serial_in
from kiks.script.file_waits import Files
from kiks.script.patching import for_program
from kiks.script.port_file import is_readable
from kiks.script.refusals import refuse
from kiks.script.thread_scheduler import Scheduler

STARTS = frozenset({"subprocess.Popen", "os.system", "os.posix_spawn", "os.spawn"})
"""Audit events of the start of a process."""

_HOOK = Path(__file__).parent / "python_children"
# A command of Python, at the beginning of a line of a shell or of one of its parts.
_BEFORE = r"(^|[;&|(]|sh -c )\s*((\S*/)?(env|nohup|sudo|exec)\s+(-\S+\s+|\w+=\S*\s+)*)*"
_PYTHON = re.compile(_BEFORE + r"(\S*/)?((python|pypy)[\d.]*|\S+\.py)(\s|$)", re.M)


def refuse_start(scheduler: Scheduler, event: str, arguments: tuple[Any, ...]) -> None:
    """End a program that starts a process which would leave the simulation; see `STARTS` for the event."""
    command = _command(arguments)
    if device := serial_in(command):
        refuse(scheduler, "open a serial port by pyserial", f"it gave {device} to another program")
    if any(map(_PYTHON.search, (command, *_about_file(event, arguments)))):
        refuse_python(scheduler)


def refuse_python(scheduler: Scheduler, how: str = "") -> None:
    """End a program that has started a process of Python."""
    way = "Name it beside this one: kiks run A.py B.py; or "
    refuse(scheduler, "start no process of Python by itself", f"it did{how}", way)


def _command(arguments: tuple[Any, ...]) -> str:
    """Return the command that a process is started with: `os.system` has it alone, all others behind the file."""
    command = arguments[min(1, len(arguments) - 1)]
    words = command if isinstance(command, list | tuple) else [command]
    return " ".join(os.fsdecode(word) for word in words if isinstance(word, str | bytes | os.PathLike))


def _about_file(event: str, arguments: tuple[Any, ...]) -> Iterator[str]:
    """Yield what tells how a file is run: where it lies, and the interpreter that its first line names."""
    if event == "os.system":
        return
    name, folder = os.fsdecode(arguments[0]), arguments[2] if event == "subprocess.Popen" else None
    path = os.path.join(os.fsdecode(folder or ""), name) if os.path.dirname(name) else shutil.which(name) or name
    yield os.path.realpath(path)
    with suppress(OSError), open(path, "rb") as file:
        if file.read(2) == b"#!":
            yield file.readline(256).decode(errors="replace")


class Children:
    """The processes of a program.

    Args:
        scheduler: The program's threads.
        files: Its files: a process may get one.
    """

    def __init__(self, scheduler: Scheduler, files: Files) -> None:
        self._scheduler = scheduler
        self._files = files
        # Where a process of Python tells that it is there: the ends of a pipe.
        self._pipe: tuple[int, ...] = ()

    def close(self) -> None:
        """Let no process tell any more."""
        for end in self._pipe:
            os.close(end)
        self._pipe = ()

    def check(self) -> None:
        """End the program if a process of Python has told that it is there."""
        if self._pipe and is_readable(self._pipe[0], 0):
            refuse_python(self._scheduler, ", by another program")

    def _environment(self, given: Mapping[Any, Any] | None) -> dict[bytes, bytes]:
        """Return the environment of a child process."""
        if not self._pipe:
            self._pipe = os.pipe()
            self._scheduler.before_time.append(self.check)
        given = os.environ if given is None else given
        environment = {os.fsencode(name): os.fsencode(value) for name, value in given.items()}
        folders = os.fsencode(_HOOK), environment.get(b"PYTHONPATH")
        environment[b"PYTHONPATH"] = os.fsencode(os.pathsep).join(filter(None, folders))
        environment[b"KIKS_PROGRAM"] = b"/proc/%d/fd/%d" % (os.getpid(), self._pipe[1])
        return environment

    def replacements(self) -> dict[str, dict[str, Any]]:
        """Return the replacements for names of `subprocess` and `os`, by module."""
        scheduler = self._scheduler
        real_start: Any = Popen._execute_child  # type: ignore[attr-defined]
        real_wait, real_poll, real_communicate = Popen.wait, Popen.poll, Popen.communicate
        names = signature(real_start)
        spawns = {name: unchanged(getattr(posix, name)) for name in ("posix_spawn", "posix_spawnp")}

        def start(*arguments: Any) -> None:
            # A debugger has processes of its own, too.
            if not scheduler.is_here:
                real_start(*arguments)
                return
            given = names.bind(*arguments)
            if self._files.port_at(given.arguments["p2cread"]) is not None:
                refuse(scheduler, "read a port by Python itself", "a process that it started was to read it")
            given.arguments["env"] = self._environment(given.arguments["env"])
            real_start(*given.args)

        def wait(popen: Popen[Any], timeout: float | None = None) -> int:
            if not scheduler.is_here:
                return real_wait(popen, timeout)
            with scheduler.real_time():
                code = real_wait(popen, None)
            self.check()
            return code

        def communicate(popen: Popen[Any], input: Any = None, timeout: float | None = None) -> Any:
            if not scheduler.is_here:
                return real_communicate(popen, input, timeout)
            with scheduler.real_time():
                output = real_communicate(popen, input, None)
            self.check()
            return output

        def system(command: Any) -> int:
            with Popen(command, shell=True, close_fds=False) as popen:
                code = wait(popen)
            return code << 8 if code >= 0 else -code

        def spawning(real: Callable[..., int]) -> Callable[..., int]:
            return lambda path, argv, env, /, **how: real(path, argv, self._environment(env), **how)

        return {
            "subprocess.Popen": {
                "_execute_child": start,
                "wait": wait,
                # `terminate` and the like only look whether there is a process.
                "poll": for_program(scheduler, wait, real_poll),
                "communicate": communicate,
            },
            "posix": {"system": system, **{name: spawning(real) for name, real in spawns.items()}},
        }
