"""The process of a program: its start and its end."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial

from kiks.errors import KiksError
from kiks.ports.environment_marks import HASH_SEED
from kiks.ports.messages import Start
from kiks.ports.program_output import OUTPUT_LIMIT, LabelledWriter, OutputLine, OutputReader
from kiks.sim.ring_buffer import RingBuffer

with contextlib.suppress(ImportError):  # not every system has it
    import termios

END_WAIT_S = 10.0
"""Longest wait for the end of a killed process [s of real time]."""

OUTPUT_WAIT_S = 1.0
"""Longest wait for the last output of an ended process [s of real time]: other processes may hold its pipes."""


def python_line(*words: str) -> list[str]:
    """Return the command line of a process of this Python, which imports nothing from the current folder (-P).

    -I would leave out what users have set, too, such as PYTHONPATH.
    """
    # Without "..", as in ../.venv/bin/python: a sandbox has only the folders that Python needs.
    return [os.path.abspath(sys.executable), "-P", *words]


def chance_seed(world_seed: int, robot: int) -> str:
    """Return what all chance in the program of a robot follows from."""
    return f"{world_seed} {robot}"


class Process:
    """The process of a program, at the other end of a socket.

    A thread of its own starts it and waits for its end: Linux ends a child with the thread that started it
    (`child_main.py`), so that thread must live as long.

    Args:
        name: Name of the program for people.
        start: What `kiks.script.child_main` gets.
        connection: Its end of the socket.
        keeps_output: Whether to keep its output.
        writer: Writes its output to the terminal. Without one, a program whose output is kept has no keyboard, and a
            process group of its own: its child processes end with it. Another one has the terminal itself.
        on_end: Called by that thread with the process after its end, which may be before the constructor returns.
        on_line: Called with each line of its output, unless the program writes that itself.
        launch: Starts it elsewhere, such as in a sandbox; None: in a process with the rights of this one.

    Attributes:
        output: Its output; None if it is not kept.
    """

    _child: Child

    def __init__(
        self,
        name: str,
        start: Start,
        connection: socket.socket,
        *,
        keeps_output: bool,
        writer: LabelledWriter | None = None,
        on_end: Callable[[Process], None] = lambda process: None,
        on_line: Callable[[str], None] = lambda line: None,
        launch: Launch | None = None,
    ) -> None:
        self.output: RingBuffer[OutputLine] | None = RingBuffer(OUTPUT_LIMIT) if keeps_output else None
        self._reader = OutputReader(self.output, writer, on_line) if keeps_output or writer is not None else None
        self._on_end = on_end
        self._is_over = threading.Event()
        started: Future[None] = Future()
        if launch is None:
            launch = partial(OwnChild, start, connection, is_apart=keeps_output and writer is None)

        def run() -> None:
            # The process inherits it, and so hears Ctrl-C only when it has loaded (`child_main.py`): Python's own start
            # would end in a traceback.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                pipes = self._begin(launch)
            except BaseException as error:
                started.set_exception(error)
                return
            started.set_result(None)
            self._wait_for_end(pipes)

        threading.Thread(target=run, name=f"kiks: {name}", daemon=True).start()
        try:
            started.result()
        except KiksError:
            raise
        except OSError as error:
            raise KiksError(f"Cannot start {name}: {error}. End other programs.") from None

    @property
    def code(self) -> int | None:
        """Its exit code, or minus the number of the signal that ended it; None while it runs."""
        return self._child.code if self._is_over.is_set() else None

    @property
    def reason(self) -> str:
        """Which limit of its sandbox it has broken, such as 'used more than 512 MB of memory'; empty if none."""
        return self._child.reason

    def interrupt(self) -> None:
        """Interrupt it, as Ctrl-C does."""
        self._child.signal(signal.SIGINT)

    def kill(self) -> None:
        """Kill it."""
        self._child.signal(signal.SIGKILL)

    def wait(self) -> None:
        """Wait until it has ended and its output has been read, at most `END_WAIT_S`."""
        self._is_over.wait(END_WAIT_S)

    # ---- inside ----

    def _begin(self, launch: Launch) -> dict[int, bool]:
        """Start the program; return the pipes to be read here, and whether they are its standard error."""
        if self._reader is None:
            self._child = launch(None)
            return {}
        (output, output_end), (errors, errors_end) = os.pipe(), os.pipe()
        try:
            self._child = launch((output_end, errors_end))
        except BaseException:
            os.close(output)
            os.close(errors)
            raise
        finally:
            # The program alone shall have them, so that they end with it.
            os.close(output_end)
            os.close(errors_end)
        return {output: False, errors: True}

    def _wait_for_end(self, pipes: dict[int, bool]) -> None:
        child = self._child
        if self._reader is None:
            child.wait()
        else:
            reader = threading.Thread(target=self._reader.read, args=(pipes, child.note_output), daemon=True)
            reader.start()
            child.wait()
            # With its output kept, it has a group of its own, and nothing in it shall outlive it.
            if self.output is not None:
                child.end_others()
            reader.join(OUTPUT_WAIT_S)
        self._is_over.set()
        self._on_end(self)


Launch = Callable[[tuple[int, int] | None], "Child"]
"""Starts a program with descriptors for its output and its errors; None: they go where those of this process go."""


class Child(ABC):
    """A running program as a child of this process: here (`OwnChild`), or in a sandbox.

    Attributes:
        code: Its exit code, or minus the number of the signal that ended it; None until `wait` has returned.
        reason: Which limit it has broken, such as 'used more than 512 MB of memory'; empty if none.
    """

    code: int | None = None
    reason = ""

    @abstractmethod
    def signal(self, number: int) -> None:
        """Send it a signal, if it still runs, and its child processes if their group is its own."""

    @abstractmethod
    def wait(self) -> None:
        """Wait until it has ended."""

    @abstractmethod
    def end_others(self) -> None:
        """Kill the child processes that it has left in its group."""

    def note_output(self, count: int) -> None:
        """Note that it has printed some bytes."""
        _ = count


class OwnChild(Child):
    """A program in a process that has the rights of this one.

    Args:
        start: What it gets.
        connection: Its end of the socket to the world.
        streams: See `Launch`.
        is_apart: Whether it has no keyboard, and a process group of its own.
    """

    def __init__(
        self, start: Start, connection: socket.socket, streams: tuple[int, int] | None, *, is_apart: bool
    ) -> None:
        self._is_apart = is_apart
        # A program that is killed while a person edits a line at its prompt leaves a terminal without an echo.
        self._terminal = termios.tcgetattr(0) if not is_apart and os.isatty(0) else None
        environment = HASH_SEED | os.environ
        if streams is not None:
            # Unbuffered: each line of output comes at once.
            environment["PYTHONUNBUFFERED"] = "1"
        if is_apart:
            environment["PYTHONIOENCODING"] = "utf-8:backslashreplace"
        self._popen = subprocess.Popen(
            python_line("-m", "kiks.script.child_main", str(connection.fileno()), json.dumps(start)),
            pass_fds=[connection.fileno()],
            stdin=subprocess.DEVNULL if is_apart else None,
            stdout=None if streams is None else streams[0],
            stderr=None if streams is None else streams[1],
            env=environment,
            start_new_session=is_apart,
        )

    def signal(self, number: int) -> None:
        """Send it a signal, if it still runs, and its child processes if their group is its own."""
        if self._popen.poll() is None:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                if self._is_apart:
                    os.killpg(self._popen.pid, number)
                else:
                    self._popen.send_signal(number)

    def wait(self) -> None:
        """Wait until it has ended."""
        self.code = self._popen.wait()
        if self._terminal is not None and self.code < 0:
            with contextlib.suppress(OSError):  # the terminal may be another session's
                if os.tcgetpgrp(0) == os.getpgrp():
                    termios.tcsetattr(0, termios.TCSADRAIN, self._terminal)

    def end_others(self) -> None:
        """Kill the child processes that it has left in its group."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._popen.pid, signal.SIGKILL)
