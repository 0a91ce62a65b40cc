"""A program's process: its start, its output, its end, and the permission to start."""

from __future__ import annotations

import contextlib
import json
import os
import select
import selectors
import signal
import socket
import subprocess
import sys
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from typing import IO, Any, NamedTuple

from kiks.errors import KiksError, ParameterError, shown
from kiks.meant import nearest_file
from kiks.model.atomic_files import program_in
from kiks.model.program_files import ProgramFiles
from kiks.model.program_kinds import A_PROGRAM, ENDINGS, ProgramKind, program_kind
from kiks.model.project import Project
from kiks.ports.environment_marks import HASH_SEED
from kiks.ports.messages import Start
from kiks.sim.ring_buffer import RingBuffer

OUTPUT_LIMIT = 1000
"""Number of lines of a program's output that a handle keeps."""

LINE_LIMIT = 2000
"""Longest line of output [bytes]; a longer one is cut."""

END_WAIT_S = 10.0
"""Longest wait for the end of a killed process [s of real time]."""

OUTPUT_WAIT_S = 1.0
"""Longest wait for the last output of an ended process [s of real time]: other processes may hold its pipes."""

PROMPT_S = 0.2
"""Pause after which a terminal shows an unfinished line [s of real time]: it may be a prompt."""

_READ_SIZE = 1 << 16
_STREAMS = {False: 1, True: 2}
_COLOURS = (36, 33, 35, 32, 34, 31)


def python_line(*words: str) -> list[str]:
    """Return the command line of a process of this Python, which imports nothing from the current folder (-P).

    -I would leave out what users have set, too, such as PYTHONPATH.
    """
    # Without "..", as in ../.venv/bin/python: a sandbox has only the folders that Python needs.
    return [os.path.abspath(sys.executable), "-P", *words]


def chance_seed(world_seed: int, robot: int) -> str:
    """Return what all chance in the program of a robot follows from."""
    return f"{world_seed} {robot}"


@dataclass(frozen=True)
class Command:
    """A program and its arguments in `sys.argv`.

    Attributes:
        program: Its file, or a folder or an archive with a `__main__.py`.
        arguments: The arguments.
        module: Name of the module or package whose file that is, to be run as `python -m` does; empty for none.
    """

    program: Path
    arguments: list[str] = field(default_factory=list)
    module: str = ""

    @property
    def name(self) -> str:
        """Its name for people."""
        return self.module or self.program.name

    @property
    def title(self) -> str:
        """The same without the ending of its file."""
        return self.program.stem if self.name.endswith(tuple(ENDINGS)) else self.name

    @property
    def runs_here(self) -> bool:
        """Whether it can run in this process: Octave has one of its own."""
        return program_kind(self.program) is not ProgramKind.OCTAVE

    @property
    def file(self) -> Path:
        """The file that Python reads first."""
        return self.program / "__main__.py" if self.program.is_dir() else self.program

    def files(self) -> ProgramFiles:
        """Return all files that belong to it, as they are now."""
        return ProgramFiles(self.program, self.module, self.arguments)

    def check_file(self) -> None:
        """Check that the program's file exists."""
        if not self.file.is_file():
            raise ParameterError(
                f"a program must be {A_PROGRAM}, but there is none at {str(self.program)!r}. Save it first."
                f"{nearest_file(self.file)}"
            )


def commands_of(project: Project, folder: Path) -> list[Command | None]:
    """Return the program of each robot of a project in a folder; None for a robot without one."""
    return [
        None if robot.program is None else Command(program_in(folder, robot.program), list(robot.arguments))
        for robot in project.robots
    ]


def supervisor_of(project: Project, folder: Path) -> Path | None:
    """Return the file of the supervisor of a project in a folder; None if it has none."""
    name = project.supervisor
    return None if name is None else program_in(folder, name, "supervisor", [ProgramKind.PYTHON])


def module_command(module: str, arguments: Sequence[str]) -> Command:
    """Return the program that `python -m` would run; nothing is imported to find its file."""
    path: Sequence[str] | None = [os.getcwd(), *sys.path]
    for part in module.split("."):
        spec = None if path is None else _find_spec(part, path)
        if spec is None:
            raise ParameterError(
                f"a program after -m must be a module that Python finds from {os.getcwd()}, but there is no "
                f"{shown(module)}. Give its name without .py, such as package.program."
            )
        path = spec.submodule_search_locations
    main = spec if path is None else _find_spec("__main__", path)
    if main is None or main.origin is None:
        raise ParameterError(
            f"a package after -m must have a file __main__.py, but {shown(module)} has none. Name a module in it."
        )
    return Command(Path(main.origin), list(arguments), module)


def _find_spec(name: str, path: Sequence[str]) -> ModuleSpec | None:
    # Other finders, such as those of packages that are installed editable, do not heed the path: they come last.
    finders: list[Any] = [PathFinder, *sys.meta_path]
    return next(filter(None, (finder.find_spec(name, path) for finder in finders)), None)


class OutputLine(NamedTuple):
    """A line of output, and whether it came from standard error."""

    text: str
    is_error: bool


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
        on_end: Called by that thread after the end.
        hear: Called with each line of its output, unless the program writes that itself.
        launch: Starts it elsewhere, such as in a sandbox; None: in a process with the rights of this one.

    Attributes:
        output: Its output; None if it is not kept.
    """

    def __init__(
        self,
        name: str,
        start: Start,
        connection: socket.socket,
        *,
        keeps_output: bool,
        writer: OutputWriter | None = None,
        on_end: Callable[[], None] = lambda: None,
        hear: Callable[[str], None] = lambda line: None,
        launch: Launch | None = None,
    ) -> None:
        self.output: RingBuffer[OutputLine] | None = RingBuffer(OUTPUT_LIMIT) if keeps_output else None
        self._writer = _OutputKeeper(self.output, writer) if self.output is not None else writer
        self._on_end, self._hear = on_end, hear
        self._child: Child | None = None
        self._is_over = threading.Event()
        has_started = threading.Event()
        failures: list[OSError | KiksError] = []
        if launch is None:
            launch = partial(OwnChild, start, connection, is_apart=keeps_output and writer is None)

        def run() -> None:
            # The process inherits it, and so hears Ctrl-C only when it has loaded (`child_main.py`): Python's own start
            # would end in a traceback.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                pipes = self._begin(launch)
            except (OSError, KiksError) as error:
                failures.append(error)
                self._is_over.set()
                return
            finally:
                has_started.set()
            assert self._child is not None
            self._wait_for_end(self._child, pipes)

        threading.Thread(target=run, name=f"kiks: {name}", daemon=True).start()
        has_started.wait()
        for failure in failures:
            if isinstance(failure, KiksError):
                raise failure
            raise KiksError(f"Cannot start {name}: {failure}. End other programs.")

    @property
    def code(self) -> int | None:
        """Its exit code, or minus the number of the signal that ended it; None while it runs."""
        return self._child.code if self._child is not None and self._is_over.is_set() else None

    @property
    def reason(self) -> str:
        """Which limit of its sandbox it has broken, such as 'used more than 512 MB of memory'; empty if none."""
        return "" if self._child is None else self._child.reason

    def interrupt(self) -> None:
        """Interrupt it, as Ctrl-C does."""
        if self._child is not None:
            self._child.signal(signal.SIGINT)

    def kill(self) -> None:
        """Kill it."""
        if self._child is not None:
            self._child.signal(signal.SIGKILL)

    def wait(self) -> None:
        """Wait until it has ended and its output has been read, at most `END_WAIT_S`."""
        self._is_over.wait(END_WAIT_S)

    # ---- inside ----

    def _begin(self, launch: Launch) -> list[IO[bytes]]:
        """Start the program; return the pipes with its output and its errors, if anything reads them here."""
        if self._writer is None:
            self._child = launch(None)
            return []
        pipes = [os.pipe(), os.pipe()]
        readers: list[IO[bytes]] = [os.fdopen(reader, "rb", buffering=0) for reader, _ in pipes]
        try:
            self._child = launch((pipes[0][1], pipes[1][1]))
        except BaseException:
            for each in readers:
                each.close()
            raise
        finally:
            for _, writer in pipes:
                os.close(writer)
        return readers

    def _wait_for_end(self, child: Child, pipes: list[IO[bytes]]) -> None:
        if self._writer is None:
            child.wait()
        else:
            hear = self._hear
            streams = dict(zip(pipes, _STREAMS, strict=True))
            arguments = (streams, self._writer, hear, child.note_output)
            reader = threading.Thread(target=_read_output, args=arguments, daemon=True)
            reader.start()
            child.wait()
            if self.output is not None:
                child.end_others()
            reader.join(OUTPUT_WAIT_S)
        self._is_over.set()
        self._on_end()


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

    def end_others(self) -> None:
        """Kill the child processes that it has left in its group."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._popen.pid, signal.SIGKILL)


class OutputWriter:
    """Takes the output of a program, line by line.

    Attributes:
        longest: Longest line [bytes]; a longer one is split.
        pause_s: Pause after which `show_unfinished` is called [s of real time]; None for never.
    """

    longest = 1 << 16
    pause_s: float | None = None

    @abstractmethod
    def take(self, lines: list[bytes], is_error: bool) -> None:
        """Take lines.

        Raises:
            OSError: If the reader has gone.
        """

    def show_unfinished(self, text: bytes, is_error: bool) -> bool:
        """Take an unfinished line after a pause, such as a prompt; return whether it was taken."""
        return False


class _OutputKeeper(OutputWriter):
    """Keeps the newest lines; it never waits for readers. If there is another writer, that takes them, too."""

    def __init__(self, output: RingBuffer[OutputLine], other: OutputWriter | None) -> None:
        self._output, self._other = output, other
        self.longest, self.pause_s = (LINE_LIMIT, None) if other is None else (other.longest, other.pause_s)

    def take(self, lines: list[bytes], is_error: bool) -> None:
        skipped = max(len(lines) - OUTPUT_LIMIT, 0)
        self._output.add([_output_line(each, is_error) for each in lines[skipped:]], skipped=skipped)
        if self._other is not None:
            self._other.take(lines, is_error)

    def show_unfinished(self, text: bytes, is_error: bool) -> bool:
        if self._other is None or not self._other.show_unfinished(text, is_error):
            return False
        self._output.add([_output_line(text, is_error)])
        return True


class Labels:
    """Prints the output of several programs, line by line, each line with the label of its program.

    Labels are coloured on a terminal, unless NO_COLOR is set. A terminal also shows an unfinished line, such as a
    prompt, after a pause; elsewhere only complete lines are printed.

    Args:
        names: Names of the programs in their order; all labels have the same width. A single one needs none.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._lock = threading.Lock()
        self._has_unfinished, self._has_several = False, len(names) > 1
        self._width = max(len(f"{number} {name}") for number, name in enumerate(names, 1))
        self.are_terminals = {is_error: os.isatty(stream) for is_error, stream in _STREAMS.items()}

    def writer(self, number: int, name: str) -> OutputWriter:
        """Return the writer for a program's output."""
        return _LabelledWriter(self, number, f"{number} {name}".ljust(self._width) if self._has_several else "")

    def say(self, text: str) -> None:
        """Print a line of KiKS between those of the programs."""
        with contextlib.suppress(OSError):
            self.write(f"kiks: {text}\n".encode(errors="replace"), is_error=True)

    def write(self, data: bytes, *, is_error: bool, is_unfinished: bool = False) -> None:
        """Write lines, or the beginning of one.

        Raises:
            OSError: If the reader has gone.
        """
        with self._lock:
            data = b"\n" * self._has_unfinished + data
            self._has_unfinished = is_unfinished
            stream = _STREAMS[is_error]
            while data:
                try:
                    data = data[os.write(stream, data) :]
                except BlockingIOError:
                    select.select([], [stream], [])


class _LabelledWriter(OutputWriter):
    """Writes the output of one program."""

    def __init__(self, labels: Labels, number: int, label: str) -> None:
        self._labels = labels
        self.pause_s = PROMPT_S if any(labels.are_terminals.values()) else None
        plain, colour = f"{label} |".encode(errors="replace") if label else b"", _COLOURS[(number - 1) % len(_COLOURS)]
        has_colours = not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
        coloured = b"\033[%dm%b\033[0m" % (colour, plain)
        self._heads = {
            is_error: (coloured if has_colours and is_terminal else plain) + b" " if plain else b""
            for is_error, is_terminal in labels.are_terminals.items()
        }

    def take(self, lines: list[bytes], is_error: bool) -> None:
        head = self._heads[is_error]
        self._labels.write(b"".join(head + line + b"\n" for line in lines), is_error=is_error)

    def show_unfinished(self, text: bytes, is_error: bool) -> bool:
        if self._labels.are_terminals[is_error]:
            self._labels.write(self._heads[is_error] + text, is_error=is_error, is_unfinished=True)
        return self._labels.are_terminals[is_error]


def _read_output(
    pipes: dict[IO[bytes], bool], writer: OutputWriter, hear: Callable[[str], None], note: Callable[[int], None]
) -> None:
    """Read the output of a process until its end; `note` is told of the number of bytes that have come."""
    with selectors.DefaultSelector() as selector:
        unfinished = {}
        for pipe, is_error in pipes.items():
            selector.register(pipe, selectors.EVENT_READ, is_error)
            unfinished[is_error] = b""
        while selector.get_map():
            ready = selector.select(writer.pause_s if any(unfinished.values()) else None)
            if not ready:
                for is_error, rest in unfinished.items():
                    if rest and writer.show_unfinished(rest, is_error):
                        unfinished[is_error] = b""
            for key, _ in ready:
                is_error = key.data
                piece = os.read(key.fd, _READ_SIZE)
                note(len(piece))
                *lines, rest = (unfinished[is_error] + piece).split(b"\n")
                if not piece or len(rest) > writer.longest:
                    lines += [rest] if rest else []
                    rest = b""
                unfinished[is_error] = rest
                for line in lines:
                    hear(_output_line(line, is_error).text)
                try:
                    writer.take(lines, is_error)
                except OSError:
                    # The reader has gone. Closing the pipe reports that to the program.
                    piece = b""
                if not piece:
                    selector.unregister(key.fileobj)
                    key.fileobj.close()  # type: ignore[union-attr]


def _output_line(line: bytes, is_error: bool) -> OutputLine:
    return OutputLine(line[:LINE_LIMIT].decode(errors="replace").rstrip("\r"), is_error)


class Permission:
    """Decides which programs may start.

    The person at the terminal may start anything. A program that a browser or a file names must be a Python program in
    one of the folders, and starts only if that is allowed.

    Args:
        granted: Programs that the person at the terminal has named; None for any.
        folders: Folders of other programs, with all below.
        may_start_others: Whether other programs may start.
    """

    def __init__(
        self,
        granted: Iterable[Command | None] | None = (),
        *,
        folders: Sequence[Path] = (),
        may_start_others: bool = False,
    ) -> None:
        self._granted = None if granted is None else list(granted)
        self._folders = [folder.resolve() for folder in folders]
        self.may_start_others = may_start_others

    def check(self, command: Command) -> None:
        """Check that a program may start."""
        if self._granted is None or command in self._granted:
            return
        name = command.name[:80]
        if not self.may_start_others:
            raise ParameterError(
                f"{name!r} must be started at the terminal of this desk, but a page or a file asked for it. kiks desk "
                "--run-programs allows that: then every user of the page can run anything on that computer."
            )
        path = command.program.resolve()
        for folder in self._folders:
            if path.is_relative_to(folder):
                program_in(folder, path.relative_to(folder).as_posix())
                return
        raise ParameterError(f"{name!r} must lie in the desk's folder, but it is elsewhere. Copy it there.")
