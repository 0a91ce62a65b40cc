"""Runs an untrusted program without files, network and other processes, and with limits.

A sandbox has one warm process, the nursery (`script/nursery.py`), which forks for each program that starts: so a start
takes milliseconds. bubblewrap (`bwrap`) starts the nursery in namespaces of its own: without a network, without other
processes, with read-only folders of Python, of KiKS and of the program, and with a small folder in memory for all that
is written. Limits of each process (`setrlimit`) are the first line. A thread outside looks twenty times a second at
what all processes take together; when a limit is broken it kills the whole sandbox, and says which. The next start
makes a new one.
"""

from __future__ import annotations

import contextlib
import json
import logging
import os
import re
import select
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kiks.clock.patience import Patience
from kiks.errors import KiksError
from kiks.model.thinking_policy import split_thinking
from kiks.ports.bubblewrap import WRITABLE, bubblewrap_line, python_folders, start_failure
from kiks.ports.control_group import ControlGroup
from kiks.ports.environment_marks import HASH_SEED
from kiks.ports.messages import Start
from kiks.ports.other_user import OtherUser
from kiks.ports.process_table import ProcessorTime, ProcessTable
from kiks.ports.program_process import Child, python_line
from kiks.ports.system_calls import system_call_filter
from kiks.units import s_from_ns

SAMPLE_S = 0.05
"""Time between two looks at the processes of a sandbox [s of real time], while a program runs."""

TRUSTED_SAMPLE_S = 0.5
"""The same without namespaces, where all processes of the computer have to be looked at [s of real time]."""

START_PATIENCE_S = 30.0
"""Longest wait for the start of a sandbox [s of real time]."""

IDLE = ("without using its robot", "for what is not simulated")
"""Ends of the messages for limits on computing, and on waiting, while no simulated time passes."""

THREADS = 8
"""Threads for each process that there may be."""

STREAMS = {"PYTHONUNBUFFERED": "1", "PYTHONIOENCODING": "utf-8:backslashreplace"}
"""The environment of a program whose output another process reads: each line comes at once."""

_log = logging.getLogger("kiks.run")

_ENVIRONMENT = {"PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", "HOME": "/tmp", "TMPDIR": "/tmp"}
_ADDRESS_SPACE_BYTES = 4 << 30
_DESCRIPTORS_MAX = 256
_SIGNALS_MAX = 1024  # with timers
_MEGABYTE = 1_000_000
_NURSERY_BYTES = 100 * _MEGABYTE
"""What the nursery itself may take beside its programs."""


Progress = Callable[[], tuple[int, bool]]
"""Returns the time of a program [ns], and whether it waits for the world; any thread calls it."""


@dataclass(frozen=True)
class SandboxLimits:
    """What the programs in a sandbox may take, all processes together.

    Attributes:
        memory_mb: Memory, with files in memory, and what the kernel keeps for them [MB].
        processes: Number of processes; each may have eight threads, as the average of all.
        processor_s: Processor time of a run, beyond a second for each simulated second [s].
        computing_s: Processor time in which it lets no simulated time pass [s].
        waiting_s: Real time of a run in which it waits for something that is not simulated, beyond a second for each
            simulated second [s].
        output_mb: What a program prints [MB].
        files_mb: Files that it writes into each of two folders [MB].
        files: Number of these files, and of locks of files.

    Example:
        >>> SandboxLimits(memory_mb=1000).memory_mb
        1000
    """

    memory_mb: float = 512
    processes: int = 32
    processor_s: float = 300.0
    computing_s: float = 10.0
    waiting_s: float = 30.0
    output_mb: float = 5
    files_mb: float = 64
    files: int = 20_000


class Sandbox:
    """A place in which the programs of one submission or one student run.

    Args:
        files: Files and folders that the programs may read, at the same paths: each program, or its folder. In a folder
            they find what is changed later, too.
        limits: What the programs may take, together.
        is_trusted: Whether the programs may do what this user may: then it needs no `bwrap`, and its limits hold as far
            as the system lets them.
        user: Name of another user as whom trusted programs run; empty for this one.

    Example:
        >>> with Sandbox([Path("ann")]) as sandbox:  # doctest: +SKIP
        ...     Programs(sim, [ProgramCommand(Path("ann/program.py"))], sandbox=sandbox).run()
    """

    def __init__(
        self,
        files: Sequence[Path] = (),
        *,
        limits: SandboxLimits | None = None,
        is_trusted: bool = False,
        user: str = "",
    ) -> None:
        self.files = [Path(os.path.abspath(each)) for each in files]
        self.limits = limits or SandboxLimits()
        self.is_trusted = is_trusted
        self.user = OtherUser(user) if user else None
        self._lock = threading.Lock()
        self._processes: _Processes | None = None

    def __enter__(self) -> Sandbox:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def warm(self) -> None:
        """Start the warm process, if it does not run.

        Raises:
            KiksError: If there can be no sandbox on this computer.
        """
        with self._lock:
            self._warm()

    def start(
        self, start: Start, connection: socket.socket, progress: Progress, streams: tuple[int, int] | None
    ) -> Child:
        """Start a program.

        Args:
            start: The program, and what it finds.
            connection: Its end of the socket to the world.
            progress: Tells how far the program is.
            streams: Descriptors for its output and its errors; None: they go where those of this process go.
        """
        start = start._replace(program=os.path.abspath(start.program))
        descriptors = [connection.fileno(), *(streams or (1, 2))]
        replay = split_thinking(start.thinking)[1]
        with ExitStack() as at_the_end, self._lock:
            if isinstance(replay, str):
                descriptors.append(at_the_end.enter_context(open(replay, "rb")).fileno())
            while (program := self._warm().start(start, descriptors, progress)) is None:
                pass  # it has ended meanwhile
            return program

    def close(self) -> None:
        """End all processes in it."""
        with self._lock:
            if self._processes is not None:
                self._processes.close()
                self._processes = None

    def _warm(self) -> _Processes:
        if self._processes is None or self._processes.is_over:
            self._processes = _Processes(self)
        return self._processes


class SandboxedProgram(Child):
    """A program in a sandbox."""

    def __init__(self, processes: _Processes, number: int, progress: Progress) -> None:
        self._processes, self._number, self._progress = processes, number, progress
        self._begin_s = self._mark_s = processes.processor_s
        self._mark_ns = progress()[0]
        self._waited_s = 0.0
        self._printed_count = 0
        self._has_ended = threading.Event()
        self.code: int | None = None
        self.reason = ""

    def signal(self, number: int) -> None:
        """Send a signal to it and its child processes."""
        self._processes.send(["signal", self._number, number])

    def wait(self) -> None:
        """Wait until it has ended."""
        self._has_ended.wait()

    def end_others(self) -> None:
        """Do nothing: the nursery ends its child processes."""

    def note_output(self, count: int) -> None:
        """Note that it has printed some bytes."""
        self._printed_count += count
        if self._printed_count > self._processes.limits.output_mb * _MEGABYTE:
            self._processes.kill(f"printed more than {self._processes.limits.output_mb:g} MB", self)

    def end(self, code: int) -> None:
        """Note that it has ended, with an exit code or minus the number of a signal."""
        if self.code is None:
            self.code = code
            self._has_ended.set()

    def broken_limit(self, idle_s: float) -> str:
        """Return which limit of its own it has broken; empty if none.

        Args:
            idle_s: Real time since the last look in which no process of the sandbox has computed [s].
        """
        limits, now_s = self._processes.limits, self._processes.processor_s
        at_ns, is_held_up = self._progress()
        if now_s - self._begin_s > limits.processor_s + s_from_ns(at_ns):
            return f"computed for {now_s - self._begin_s:.0f} s in all"
        if not is_held_up:
            self._waited_s += idle_s
        if self._waited_s > limits.waiting_s + s_from_ns(at_ns):
            return f"waited for {limits.waiting_s:g} s {IDLE[1]}"
        if at_ns != self._mark_ns:
            self._mark_ns, self._mark_s = at_ns, now_s
        elif now_s - self._mark_s > limits.computing_s:
            return f"computed for {limits.computing_s:g} s {IDLE[0]}"
        return ""


class _Processes:
    """The processes of a sandbox, from the start of the nursery to its end.

    Attributes:
        limits: What they may take.
        is_over: Whether they end or have ended.
        sample_s: Time between two looks [s of real time].
    """

    def __init__(self, sandbox: Sandbox) -> None:
        self.limits = sandbox.limits
        self.is_over = False
        self.sample_s = TRUSTED_SAMPLE_S if sandbox.is_trusted else SAMPLE_S
        self._lock = threading.Lock()
        self._is_trusted, self._user = sandbox.is_trusted, sandbox.user
        self._programs: dict[int, SandboxedProgram] = {}
        self._count = 0
        self._scratch = tempfile.mkdtemp(prefix="kiks-sandbox-") if sandbox.is_trusted else ""
        if self._user is not None:
            self._user.give(self._scratch)
        self._control, there = socket.socketpair()
        self._sending = threading.Lock()
        self._is_ready = threading.Event()
        self._complaint = ""
        self._table: ProcessTable | None = None
        self._time = ProcessorTime()
        self._memory_reason = f"used more than {self.limits.memory_mb:g} MB of memory"
        # A program without a namespace of its own runs as its user, who may join no group.
        self._group, self._namespace = None if sandbox.is_trusted else _group_for(self.limits), -1
        try:
            with there:
                self._begin(sandbox, there)
        except KiksError:
            self._control.close()
            raise
        self._is_ready.wait()
        if self._complaint:
            self._thread.join()
            raise KiksError(self._complaint)

    def start(self, start: Start, descriptors: list[int], progress: Progress) -> SandboxedProgram | None:
        """Start a program and return it; None if the end of all has come.

        Args:
            start: The program.
            descriptors: Those of its connection, its output and its errors, and of the times that it replays, if any.
            progress: Tells how far it is.
        """
        with self._lock:
            if self.is_over:
                return None
            self._count += 1
            program = self._programs[self._count] = SandboxedProgram(self, self._count, progress)
        self.send(["start", self._count, list(start)], descriptors)
        return program

    def send(self, words: list[Any], descriptors: Sequence[int] = ()) -> None:
        """Send a line to the nursery."""
        data = json.dumps(words).encode() + b"\n"
        with self._sending, contextlib.suppress(OSError):
            sent = socket.send_fds(self._control, [data], descriptors)
            self._control.sendall(data[sent:])

    def kill(self, reason: str, culprit: SandboxedProgram | None = None) -> None:
        """Kill all processes, because the programs have broken a limit, or one of them has."""
        with self._lock:
            self.is_over = True
            for program in [culprit] if culprit is not None else self._programs.values():
                program.reason = program.reason or reason
        self._kill()

    def close(self) -> None:
        """End all processes."""
        self._kill()
        self._thread.join()

    @property
    def processor_s(self) -> float:
        """Processor time that the programs have taken, at the last look [s]."""
        return self._time.total_s

    # ---- inside ----

    def _begin(self, sandbox: Sandbox, there: socket.socket) -> None:
        """Start the nursery in a thread that lives as long: Linux ends a child with the thread that started it."""
        folders = [self._scratch] if self._is_trusted else list(WRITABLE)
        seen = [] if self._is_trusted else [str(path) for path in [*python_folders(), *sandbox.files]]
        line = python_line(
            "-m", "kiks.script.nursery", str(there.fileno()), json.dumps([folders, seen, self._process_limits()])
        )
        is_own = self._is_trusted and self._user is None
        environment = HASH_SEED | (os.environ if is_own else _ENVIRONMENT) | STREAMS
        passed, info = [there.fileno()], None
        if not self._is_trusted:
            words = bubblewrap_line(seen, int(self.limits.files_mb * _MEGABYTE))
            info, info_there = os.pipe()
            passed.append(info_there)
            calls, calls_there = os.pipe()
            if rules := system_call_filter():
                os.write(calls_there, rules)
                words += ["--seccomp", str(calls)]
            os.close(calls_there)
            passed.append(calls)
            line = [*words, "--info-fd", str(info_there), "--", *line]
        if self._group is not None:
            line = self._group.line(line)
        errors, errors_there = os.pipe()
        has_started = threading.Event()

        def run() -> None:
            # As in `Process`: the terminal's Ctrl-C is not for the nursery.
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                self._popen = subprocess.Popen(
                    line,
                    pass_fds=passed,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=errors_there,
                    env=environment,
                    start_new_session=True,
                    **({} if self._user is None else self._user.options),
                )
            except OSError as error:
                self._complaint = f"Cannot start a sandbox: {error}. End other programs."
            finally:
                os.close(errors_there)
                if info is not None:
                    os.close(info_there)
                    os.close(calls)
                has_started.set()
            if not self._complaint:
                self._watch(errors, info)
            os.close(errors)
            if info is not None:
                os.close(info)
            if self._group is not None:
                self._group.close()
            self._control.close()
            self._is_ready.set()

        self._thread = threading.Thread(target=run, name="kiks: sandbox", daemon=True)
        self._thread.start()
        has_started.wait()

    def _process_limits(self) -> dict[str, int]:
        """Return the limits that the system holds for each process, by their names in `resource`."""
        limits = {
            "RLIMIT_AS": int(self.limits.memory_mb * _MEGABYTE) + _ADDRESS_SPACE_BYTES,
            "RLIMIT_FSIZE": int(self.limits.files_mb * _MEGABYTE),
            "RLIMIT_NOFILE": _DESCRIPTORS_MAX,
            "RLIMIT_CORE": 0,
            "RLIMIT_SIGPENDING": _SIGNALS_MAX,
        }
        if not self._is_trusted and _counts_by_namespace():
            # With threads. It holds for no superuser: there a control group does.
            limits["RLIMIT_NPROC"] = THREADS * self.limits.processes
        return limits

    def _watch(self, errors: int, info: int | None) -> None:
        """Receive messages of the nursery, and check the processes, until the end."""
        if sys.platform == "linux":
            # Linux limits the number of processes of no superuser: this thread must get a processor among thousands.
            with contextlib.suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), -20)
        try:
            if self._wait_until_ready(info):
                self._is_ready.set()
                self._receive_ends()
            else:
                self._complaint = start_failure(errors, is_trusted=self._is_trusted)
        finally:
            with self._lock:
                self.is_over = True
            self._kill()
            self._popen.wait()
            why = self._memory_reason if self._is_out_of_memory() else "ended its sandbox"
            if self._namespace >= 0:
                # Its first process ends last.
                select.select([self._namespace], [], [], START_PATIENCE_S)
                os.close(self._namespace)
            for program in self._programs.values():
                program.reason = program.reason or why
                program.end(-signal.SIGKILL)
            if self._table is not None:
                self._table.close()
            if self._scratch:
                shutil.rmtree(self._scratch, ignore_errors=True)

    def _wait_until_ready(self, info: int | None) -> bool:
        self._control.settimeout(START_PATIENCE_S)
        try:
            if not self._control.recv(1 << 12):
                return False
        except OSError:
            return False
        self._control.settimeout(None)
        first = self._popen.pid if info is None else json.loads(os.read(info, 1 << 12))["child-pid"]
        if self._group is not None:
            with contextlib.suppress(OSError):
                self._namespace = os.pidfd_open(first)
        self._table = ProcessTable(first, is_namespace=info is not None)
        return True

    def _receive_ends(self) -> None:
        rest, since = b"", Patience(self.sample_s)
        while True:
            is_due = not self._programs or since.left_s() == 0
            ready, _, _ = select.select([self._control], [], [], since.left_s() if self._programs else None)
            if ready:
                try:
                    data = self._control.recv(1 << 16)
                except OSError:
                    return
                if not data:
                    return
                *lines, rest = (rest + data).split(b"\n")
                for what, number, *values in map(json.loads, lines):
                    if what == "ended":
                        code, was_last = values
                        with self._lock:
                            self.is_over = self.is_over or was_last
                            program = self._programs.pop(number)
                        if self._is_out_of_memory():
                            self.kill(self._memory_reason, program)
                        program.end(code)
            if self._programs and is_due:
                passed_s = since.waited_s()
                since.renew()
                reason, culprit = self._broken_limit(passed_s)
                if reason:
                    self.kill(reason, culprit)
                    return

    def _broken_limit(self, passed_s: float) -> tuple[str, SandboxedProgram | None]:
        """Look at all processes; return which limit is broken, empty if none, and by which program if that is known."""
        assert self._table is not None
        if self._table.namespace_count() > self.limits.processes + 1:
            # At once: to look at each of thousands would take seconds.
            return f"started more than {self.limits.processes} processes", None
        if not (samples := self._table.samples()):
            return "", None
        first, *others = samples
        limits, most_memory = self.limits, self.limits.memory_mb * _MEGABYTE
        # More has passed if the thread that looks has itself waited for a processor.
        passed_s = min(passed_s, 2 * self.sample_s)
        grown_s = self._time.add(first, others, passed_s)
        idle_s = 0.0 if any(each.is_running for each in others) else max(passed_s - grown_s, 0.0)
        for count, most, what in (
            (len(others), limits.processes, "started more than {} processes"),
            (sum(each.threads for each in others), THREADS * limits.processes, "started more than {} threads"),
            (self._table.file_count(), limits.files, "made more than {} files or locks of files"),
        ):
            if count > most:
                return what.format(most), None
        besides = self._table.memory_outside() + sum(each.kernel_memory for each in others)
        if besides + sum(each.memory for each in others) > most_memory and (
            besides + sum(self._table.own_memory(each) for each in others) > most_memory
        ):
            return self._memory_reason, None
        for program in list(self._programs.values()):
            reason = program.broken_limit(idle_s)
            if reason:
                return reason, program
        return "", None

    def _is_out_of_memory(self) -> bool:
        return self._group is not None and self._group.is_out_of_memory

    def _kill(self) -> None:
        popen = self._popen
        if self._is_trusted and self._table is not None:
            # Twice: a process may have forked meanwhile. A namespace ends with its first process.
            for _ in range(2):
                for sample in self._table.samples()[1:]:
                    with contextlib.suppress(ProcessLookupError, PermissionError):
                        os.kill(sample.process, signal.SIGKILL)
        popen.kill()
        if self._user is not None:
            self._user.end_all()


def check_sandbox() -> None:
    """Check that programs of others can run in a sandbox, and warn the superuser, who should run none.

    Raises:
        KiksError: If there can be no sandbox on this computer.
    """
    with Sandbox() as sandbox:
        sandbox.warm()
    if os.geteuid() == 0:
        _log.warning(
            "programs of others should run as a user who has no secrets, but this is the superuser: through a hole in "
            "their sandbox they would reach everything. Start KiKS as another user."
        )


def limits_in_force() -> str:
    """Return by what the limits of a sandbox hold on this computer, for a person."""
    group = _group_for(SandboxLimits())
    group.close()
    counted = f"all counted {1 / SAMPLE_S:.0f} times a second"
    if group.folders:
        counted += ", and a control group"
    elif os.geteuid() == 0:
        counted += "; but Linux limits no processes of the superuser outside of a control group, which cannot be made"
    calls = "" if system_call_filter() else f", but no filter of system calls on {os.uname().machine}"
    return f"limits of each process, {counted}{calls}"


def _group_for(limits: SandboxLimits) -> ControlGroup:
    return ControlGroup(THREADS * limits.processes, int(limits.memory_mb * _MEGABYTE) + _NURSERY_BYTES)


def _counts_by_namespace() -> bool:
    """Return whether the system counts the processes of a user in each namespace apart: Linux since 5.14."""
    found = re.match(r"(\d+)\.(\d+)", os.uname().release)
    return found is not None and (int(found[1]), int(found[2])) >= (5, 14)
