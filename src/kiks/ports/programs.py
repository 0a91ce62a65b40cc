"""Several unchanged Python programs in one world, each in a process of its own."""

from __future__ import annotations

import contextlib
import logging
import selectors
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from kiks.clock.patience import Patience
from kiks.clock.thinking import parse_thinking
from kiks.ports.guest import Guest
from kiks.ports.names import Names
from kiks.ports.turns import PATIENCE_S, Turns
from kiks.sim.simulation import Simulation

IDLE_S = 0.05
"""Longest sleep [s]: the end of a process is noticed within it."""

ENDING_S = 0.002
"""The same for a process whose connection has ended [s]."""

GRACE_S = 1.0
"""How long the programs may tidy up after Ctrl-C [s of real time]."""

INTERRUPTED = 130
"""Exit code after Ctrl-C."""

_log = logging.getLogger("kiks.run")


@dataclass(frozen=True)
class Command:
    """A program and what it finds in `sys.argv` after its name."""

    program: Path
    arguments: list[str] = field(default_factory=list)


@dataclass(eq=False)
class _Run:
    """A program that runs: its process, its turn in the world, and how it ended."""

    process: subprocess.Popen[bytes]
    guest: Guest
    has_hung_up: bool = False
    code: int | None = None


class Programs:
    """Programs that share a world.

    Args:
        sim: The world.
        commands: The programs; the first one drives robot 1, whatever port it opens, and so on.
        told: Robots by port name, for whichever program opens it.
        thinking: What the computing of each costs: 'none', 'fixed:MS', 'live', 'live:FACTOR', or 'replay:FILE' with
            the number of the program appended: FILE.1.
        record: File for the thinking times of live runs, with the same numbers appended.
        when_silent: What happens to a program that is silent while others wait: 'wait', 'drop' (its process is ended)
            or 'ignore'.
        patience_s: How long it may be [s of real time].
        say: Where a person is told how each program ended.

    Raises:
        ParameterError: If a value is out of range or unknown.
    """

    def __init__(
        self,
        sim: Simulation,
        commands: Sequence[Command],
        *,
        told: dict[str, int] | None = None,
        thinking: str = "none",
        record: Path | None = None,
        when_silent: str = "ignore",
        patience_s: float = PATIENCE_S,
        say: Callable[[str], None] = lambda text: None,
    ) -> None:
        self.sim = sim
        self._say = say
        self._signals = 0
        numbers = range(1, len(commands) + 1)
        policies = [f"{thinking}.{number}" if thinking.startswith("replay:") else thinking for number in numbers]
        for policy in policies:
            parse_thinking(policy)
        self._turns = Turns(
            sim,
            expected=len(commands),
            missing=self._missing,
            log=_log,
            when_silent=when_silent,
            patience_s=patience_s,
        )
        names = Names(sim, told or {}, len(commands))
        self._selector = selectors.DefaultSelector()
        self._runs: list[_Run] = []
        for number, command, policy in zip(numbers, commands, policies, strict=True):
            here, there = socket.socketpair()
            with there:
                process = _start(command, there, policy, f"{record}.{number}" if record is not None else "")
            guest = Guest(f"program {number} ({command.program.name})", number, here, sim, self._turns, names)
            self._turns.join(guest)
            self._runs.append(_Run(process, guest))
            self._selector.register(guest, selectors.EVENT_READ, self._runs[-1])

    @property
    def doubt(self) -> str:
        """Say why the same programs might not do the same again; nothing if they would, but for live thinking."""
        if self._signals:
            return "it was interrupted"
        return "" if self._turns.is_repeatable else "the world did not wait for every program"

    def run(self) -> int:
        """Let them run until the last has ended; return 0 if all went well, else the first exit code that tells."""
        try:
            with self._signals_noted():
                while any(run.code is None for run in self._runs) or self._turns.players:
                    if not self._round():
                        return INTERRUPTED
        finally:
            self.close()
        return INTERRUPTED if self._signals else next((run.code for run in self._runs if run.code), 0)

    def close(self) -> None:
        """End all processes that still run, and close their connections."""
        for run in self._runs:
            if run.process.poll() is None:
                run.process.kill()
                run.process.wait()
            run.guest.close()
        self._selector.close()

    # ---- inside ----

    def _round(self) -> bool:
        """Do what may be done and listen to the programs; return False if that is to be the end."""
        if self._signals and (self._signals > 1 or self._grace.left_s() == 0):
            return False
        with self.sim.lock:
            wait_s = self._turns.advance()
        wait_s = IDLE_S if wait_s is None else min(wait_s, IDLE_S)
        for run in self._runs:
            if run.guest.is_silenced and run.code is None:
                run.process.kill()
            if run.has_hung_up and run.code is None:
                wait_s = min(wait_s, ENDING_S)
                self._notice_end(run)
            elif not run.has_hung_up:
                events = selectors.EVENT_READ | (selectors.EVENT_WRITE if run.guest.has_unsent else 0)
                if self._selector.get_key(run.guest).events != events:
                    self._selector.modify(run.guest, events, run)
        ready = self._selector.select(wait_s)
        for key, events in ready:
            if events & selectors.EVENT_WRITE:
                key.data.guest.flush()
            if events & selectors.EVENT_READ and not key.data.guest.receive():
                self._hang_up(key.data)
        if not ready:
            for run in self._runs:
                # A process that the program has started may still hold the connection.
                if not run.has_hung_up and run.process.poll() is not None:
                    run.guest.leave()
                    self._hang_up(run)
        return True

    def _hang_up(self, run: _Run) -> None:
        self._selector.unregister(run.guest)
        run.has_hung_up = True
        self._notice_end(run)

    def _notice_end(self, run: _Run) -> None:
        """Say how a process has ended, if it has."""
        code = run.process.poll()
        if code is None:
            return
        run.code = code if code >= 0 else 128 - code
        how = f"with exit code {code}" if code >= 0 else f"by signal {-code}"
        self._say(f"{run.guest.name} has ended {how}.")
        left = [other.guest for other in self._runs if other.code is None]
        if left and not any(guest.is_waited_for for guest in left):
            names = ", ".join(guest.name for guest in left)
            _log.warning("%s, which the world does not wait for, still runs. Ctrl-C ends it.", names)

    def _missing(self) -> str:
        """Return who has not taken part yet."""
        return ", ".join(run.guest.name for run in self._runs if not run.guest.is_here)

    @contextlib.contextmanager
    def _signals_noted(self) -> Iterator[None]:
        """Note Ctrl-C and its kind, and go on: the programs have got it, too, and may still stop their robots."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return

        def note(_number: int, _frame: FrameType | None) -> None:
            self._signals += 1

        self._grace = Patience(GRACE_S)
        names = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        before = {name: signal.signal(name, note) for name in names if signal.getsignal(name) is not signal.SIG_IGN}
        try:
            yield
        finally:
            for name, handler in before.items():
                signal.signal(name, handler)


def _start(command: Command, there: socket.socket, thinking: str, record: str) -> subprocess.Popen[bytes]:
    """Start a program with its end of the connection."""
    words = [str(there.fileno()), thinking, record, str(command.program), *command.arguments]
    # -P: the folder in which KiKS was started is none of the program's.
    return subprocess.Popen([sys.executable, "-P", "-m", "kiks.ports.child", *words], pass_fds=[there.fileno()])
