"""A warm process in a sandbox: it has imported what a program needs, and forks for each start of one.

`ports/sandbox.py` starts it by `python -m kiks.script.nursery`, sends it lines over a socket, and is told of ends. In a
forked process, `main` goes on as in a process of `child_main.py` of its own. The program in it is a stranger's: it gets
none of the nursery's descriptors, and in a namespace of its own may neither look into the nursery nor end it.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import gc
import json
import os
import resource
import selectors
import shutil
import signal
import socket
import sys
from collections import deque
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from kiks.model.program_kinds import ProgramKind, program_kind
from kiks.ports.messages import Start
from kiks.script import child_main
from kiks.script.main_module import clear_names

DUMPABLE, CHILD_SUBREAPER = 4, 36
"""PR_SET_DUMPABLE and PR_SET_CHILD_SUBREAPER of Linux (linux/prctl.h)."""

WARM = (
    "encodings.ascii",
    "serial.rfc2217",
    "serial.tools.list_ports",
    "serial.urlhandler.protocol_socket",
    "kiks.ports.pyserial.protocol_kiks",
)
"""What every start of a program imports."""

WARM_FOR = {b"numpy": "numpy", b"kiks": "kiks.client"}
"""What a program imports, perhaps, whose text has a word in it."""

OCTAVE = "kiks.toolbox.octave_program"
"""What the process of a program of Octave imports."""

TEXT_MAX = 1 << 20
"""Most bytes that are read of a program's text."""

LINKS_MAX = 1000
"""Most files of a program to which its working folder has links."""

COPIED_BYTES_MAX = 4 << 20
"""Most bytes of its data of which the working folder has copies: it may write `log.csv` where it has one already."""


class Nursery:
    """Forks for each program.

    Args:
        control: The socket at whose other end the sandbox is.
        folders: Folders into which programs may write; the first one holds the working folders.
        kept: Files and folders of others, some perhaps below those.
        limits: Limits of each process, by the name of a constant of `resource`.
    """

    def __init__(
        self, control: socket.socket, folders: Sequence[str], kept: Sequence[str], limits: dict[str, int]
    ) -> None:
        self._control, self._folders, self._limits = control, folders, limits
        self._kept = set(kept)
        self._above = {str(folder) for path in kept for folder in Path(path).parents}
        self._descriptors: deque[int] = deque()
        self._programs: dict[int, tuple[int, str]] = {}
        self._rest = b""
        self._wake, waker = socket.socketpair()
        for each in (self._wake, waker):
            each.setblocking(False)
        # Its handler does nothing, but with one the signal is heard.
        signal.signal(signal.SIGCHLD, lambda _number, _frame: None)
        signal.set_wakeup_fd(waker.fileno(), warn_on_full_buffer=False)
        self._waker = waker

    def serve(self) -> Callable[[], int] | None:
        """Serve until the sandbox has gone; in a forked process, return the function that runs the program."""
        with selectors.DefaultSelector() as selector:
            selector.register(self._control, selectors.EVENT_READ)
            selector.register(self._wake, selectors.EVENT_READ)
            self._send("ready")
            while True:
                for key, _ in selector.select():
                    if key.fileobj is self._wake:
                        self._wake.recv(1 << 12)
                        if self._take_ends():
                            return None
                        continue
                    data, descriptors, _, _ = socket.recv_fds(self._control, 1 << 16, 16)
                    self._descriptors += descriptors
                    if not data:
                        self._close()
                        return None
                    *lines, self._rest = (self._rest + data).split(b"\n")
                    for line in lines:
                        what, number, *rest = json.loads(line)
                        if what == "signal":
                            self._signal(number, *rest)
                        elif (run := self._start(number, *rest)) is not None:
                            return run

    # ---- inside ----

    def _send(self, *words: Any) -> None:
        self._control.sendall(json.dumps(words).encode() + b"\n")

    def _start(self, number: int, fields: list[Any]) -> Callable[[], int] | None:
        start = Start(*fields)
        is_replay = start.thinking.startswith("replay:")
        descriptors = [self._descriptors.popleft() for _ in range(3 + is_replay)]
        connection, *streams = descriptors[:3]
        if is_replay:
            start = start._replace(thinking=f"replay:/dev/fd/{descriptors[3]}")
        folder = self._working_folder(start)
        _warm_for(start)
        if process := os.fork():
            for each in descriptors:
                os.close(each)
            self._programs[process] = number, folder
            self._send("started", number)
            return None
        os.setsid()
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for each_socket in (self._control, self._wake, self._waker):
            each_socket.close()
        os.chdir(folder)
        # Its input is the sandbox's: by the one outside, a program of the superuser could change the computer's device.
        for target, each in enumerate((os.open(os.devnull, os.O_RDONLY), *streams)):
            os.dup2(each, target)
            os.close(each)
        _control_process(DUMPABLE, 1)
        for name, most in self._limits.items():
            kind = getattr(resource, name)
            allowed = resource.getrlimit(kind)[1]
            most = most if allowed == resource.RLIM_INFINITY else min(most, allowed)
            resource.setrlimit(kind, (most, most))
        return lambda: child_main.main(connection, start)

    def _working_folder(self, start: Start) -> str:
        """Make a working folder, with copies of the data beside the program and links to all else; return its path."""
        count = 1
        while os.path.lexists(folder := os.path.join(self._folders[0], f"work{count}")):
            count += 1
        os.mkdir(folder)
        program = Path(start.program)
        beside = program if program.is_dir() else program.parent
        left = COPIED_BYTES_MAX
        with contextlib.suppress(OSError):
            for entry in sorted(os.listdir(beside))[:LINKS_MAX]:
                source, target = beside / entry, os.path.join(folder, entry)
                is_data = source.is_file() and source.suffix != ".py"
                if is_data and (size := source.stat().st_size) <= left:
                    shutil.copy(source, target)
                    left -= size
                else:
                    os.symlink(source, target)
        return folder

    def _signal(self, number: int, signal_number: int) -> None:
        for process, (each, _) in self._programs.items():
            if each == number:
                _kill_group(process, signal_number)

    def _take_ends(self) -> bool:
        """Tell of the programs that have ended, and end what they have left; return whether they were the last ones.

        No program follows those that have left files which cannot be removed, such as in folders without rights.
        """
        ends = []
        while True:
            try:
                process, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                break
            if not process:
                break
            if process in self._programs:
                ends.append((self._programs.pop(process)[0], os.waitstatus_to_exitcode(status)))
                _kill_group(process, signal.SIGKILL)
        are_last = bool(ends) and not self._programs and not self._clean()
        for number, code in ends:
            self._send("ended", number, code, are_last)
        return are_last

    def _close(self) -> None:
        """End all programs and remove what they have written: what has started the nursery may have been killed."""
        for process in self._programs:
            _kill_group(process, signal.SIGKILL)
        if os.getpid() != 1:
            for folder in self._folders:
                shutil.rmtree(folder, ignore_errors=True)

    def _clean(self) -> bool:
        """Remove all that earlier programs have written, as a run depends on no other; return whether that went."""
        if os.getpid() == 1:
            _kill_all()
            with contextlib.suppress(ChildProcessError):
                while True:
                    os.waitpid(-1, 0)
        try:
            for folder in self._folders:
                self._empty(folder)
        except (OSError, RecursionError):
            return False
        return True

    def _empty(self, folder: str) -> None:
        for entry in os.scandir(folder):
            if entry.path in self._kept:
                continue
            if entry.path in self._above:
                self._empty(entry.path)
            elif entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry)
            else:
                os.unlink(entry)


def _warm_for(start: Start) -> None:
    """Import what a program will import, as far as its text tells: forked processes have it then."""
    program = Path(start.program)
    if program_kind(program) is ProgramKind.OCTAVE:
        import_module(OCTAVE)
        gc.freeze()
        return
    with contextlib.suppress(OSError), open(program / "__main__.py" if program.is_dir() else program, "rb") as file:
        text = file.read(TEXT_MAX)
        for word, module in WARM_FOR.items():
            if word in text:
                import_module(module)
                gc.freeze()


def _kill_group(process: int, signal_number: int) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(process, signal_number)


def _kill_all() -> None:
    """Kill all other processes of the namespace, if this one is its first; else -1 would mean the user's processes."""
    if os.getpid() == 1:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(-1, signal.SIGKILL)


def _end(code: int, warm: set[str]) -> NoReturn:
    """End a forked process as Python does, but for the modules of the nursery: to take those down takes 10 ms.

    Args:
        code: The exit code.
        warm: Names of the modules that the nursery has.
    """
    atexit._run_exitfuncs()
    for name in [name for name in sys.modules if name not in warm]:
        clear_names(vars(sys.modules[name]))
    gc.collect()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        code = 120  # as of Python
    os._exit(code & 0xFF)


def _control_process(option: int, value: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(option, value, 0, 0, 0)


def main(descriptor: int, folders: list[str], kept: list[str], limits: dict[str, int]) -> int:
    """Serve the sandbox at a socket, and in each forked process run the program; return the process's exit code."""
    # Programs are forked with it blocked, as they are started elsewhere (`child_main.py`).
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    # No program may look into this process, or take its descriptors.
    _control_process(DUMPABLE, 0)
    _control_process(CHILD_SUBREAPER, 1)
    os.set_inheritable(descriptor, False)
    for module in WARM:
        import_module(module)
    gc.freeze()
    run = Nursery(socket.socket(fileno=descriptor), folders, kept, limits).serve()
    if run is not None:
        warm = set(sys.modules)
        _end(run(), warm)
    return 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), *json.loads(sys.argv[2])))
