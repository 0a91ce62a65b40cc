"""A program's process: how it is started, what it prints, and how it ends."""

from __future__ import annotations

import contextlib
import os
import selectors
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, NamedTuple

from kiks.errors import KiksError, ParameterError
from kiks.sim.tail import Tail

LATE, PUNCTUAL = "late", "punctual"
"""When a program was started: after the world had begun, or before."""

OUTPUT_LIMIT = 1000
"""Lines of a program's output that are kept."""

LINE_LIMIT = 2000
"""Longest line of it [bytes]; a longer one is cut."""

ENDING_S = 10.0
"""How long the end of a process that was killed is waited for [s of real time]."""

LAST_WORDS_S = 1.0
"""How long the last output of a process that has ended is waited for [s of real time]: others may hold its pipes."""

_PIECE = 1 << 16


@dataclass(frozen=True)
class Command:
    """A program and what it finds in `sys.argv` after its name."""

    program: Path
    arguments: list[str] = field(default_factory=list)

    def check_file(self) -> None:
        """Check that the program is there.

        Raises:
            ParameterError: If it is not.
        """
        if not self.program.is_file():
            raise ParameterError(
                f"a program must be a Python file, but there is none at {str(self.program)!r}. Save it first."
            )


class OutputLine(NamedTuple):
    """A line that a program has printed, and whether it was one of its errors."""

    text: str
    is_error: bool


class Process:
    """A program that runs by itself, at the other end of a socket.

    A thread of its own starts it and waits for its end: Linux ends a child with the thread that started it
    (`child.py`), so it must be one that lives as long.

    Args:
        words: What `kiks.script.child` is told before the program.
        command: The program.
        there: Its end of the socket.
        is_heard: Whether its output is kept. Such a program has nobody at its keyboard, and a group of its own: what
            it starts ends with it. Otherwise it has the terminal.
        ended: Called when it has ended, by that thread.

    Attributes:
        output: What it has printed; None if it is not heard.

    Raises:
        KiksError: If the computer does not let it start.
    """

    def __init__(
        self, words: Sequence[str], command: Command, there: socket.socket, *, is_heard: bool, ended: Callable[[], None]
    ) -> None:
        self.output: Tail[OutputLine] | None = Tail(OUTPUT_LIMIT) if is_heard else None
        self._ended = ended
        self._popen: subprocess.Popen[bytes] | None = None
        self._is_over = threading.Event()
        has_started = threading.Event()
        failures: list[OSError] = []
        # -P: the folder in which KiKS was started is none of the program's.
        line = [sys.executable, "-P", "-m", "kiks.script.child", str(there.fileno()), *words]
        line += [str(command.program), *command.arguments]

        def attend() -> None:
            try:
                self._popen = self._start(line, there)
            except OSError as error:
                failures.append(error)
                self._is_over.set()
                return
            finally:
                has_started.set()
            self._attend(self._popen)

        threading.Thread(target=attend, name=f"kiks: {command.program.name}", daemon=True).start()
        has_started.wait()
        if failures:
            raise KiksError(
                f"a program must be able to start, but {command.program} was not: {failures[0]}. End other programs."
            )

    @property
    def code(self) -> int | None:
        """How it has ended: its exit code, or minus the number of the signal that ended it; None while it runs."""
        return self._popen.returncode if self._popen is not None and self._is_over.is_set() else None

    def interrupt(self) -> None:
        """Do what Ctrl-C does."""
        self._signal(signal.SIGINT)

    def kill(self) -> None:
        """End it at once."""
        self._signal(signal.SIGKILL)

    def wait(self) -> None:
        """Wait until it has ended and has been heard to its last word; no longer than a killed one takes for that."""
        self._is_over.wait(ENDING_S)

    # ---- inside ----

    def _start(self, line: list[str], there: socket.socket) -> subprocess.Popen[bytes]:
        if self.output is None:
            return subprocess.Popen(line, pass_fds=[there.fileno()])
        return subprocess.Popen(
            line,
            pass_fds=[there.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, "PYTHONUNBUFFERED": "1", "PYTHONIOENCODING": "utf-8:backslashreplace"},
            start_new_session=True,
        )

    def _attend(self, popen: subprocess.Popen[bytes]) -> None:
        if self.output is None:
            popen.wait()
        else:
            assert popen.stdout is not None
            assert popen.stderr is not None
            pipes = {popen.stdout: False, popen.stderr: True}
            listener = threading.Thread(target=_listen, args=(pipes, self.output), daemon=True)
            listener.start()
            popen.wait()
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(popen.pid, signal.SIGKILL)
            listener.join(LAST_WORDS_S)
        self._is_over.set()
        self._ended()

    def _signal(self, number: int) -> None:
        popen = self._popen
        if popen is None or popen.poll() is not None:
            return
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if self.output is None:
                popen.send_signal(number)
            else:
                os.killpg(popen.pid, number)


def _listen(pipes: dict[IO[bytes], bool], output: Tail[OutputLine]) -> None:
    """Take what a process prints until it has said everything; it never waits for anybody who reads it."""
    with selectors.DefaultSelector() as selector:
        rests = {}
        for pipe, is_error in pipes.items():
            selector.register(pipe, selectors.EVENT_READ, is_error)
            rests[is_error] = b""
        while selector.get_map():
            for key, _ in selector.select():
                is_error = key.data
                piece = os.read(key.fd, _PIECE)
                *lines, rest = (rests[is_error] + piece).split(b"\n")
                if not piece or len(rest) > LINE_LIMIT:
                    lines += [rest] if rest else []
                    rest = b""
                rests[is_error] = rest
                skipped = max(len(lines) - OUTPUT_LIMIT, 0)
                output.add([_line(each, is_error) for each in lines[skipped:]], skipped=skipped)
                if not piece:
                    selector.unregister(key.fileobj)
                    key.fileobj.close()  # type: ignore[union-attr]


def _line(line: bytes, is_error: bool) -> OutputLine:
    return OutputLine(line[:LINE_LIMIT].decode(errors="replace").rstrip("\r"), is_error)
