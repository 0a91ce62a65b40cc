"""A server in a thread, for tests that are clients: nothing sleeps; waiting ends with an event, or a guard fails."""

import os
import select
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from tests.guard import GUARD_S

from kiks.model.arena import Arena
from kiks.ports.endpoint import Endpoint
from kiks.ports.server import Server
from kiks.sim.simulation import Simulation

BOX = Arena.box(600, 600)
PROGRAMS = Path(__file__).parent / "programs"


class Rounds:
    """Rounds in a thread, and a way to wait for what they do."""

    def __init__(self, work: Callable[[Callable[[], bool]], object]) -> None:
        self.rounds = 0
        self._is_over = False
        self._round = threading.Condition()
        self._thread = threading.Thread(target=work, args=(self._until,), daemon=True)

    def _until(self) -> bool:
        with self._round:
            self.rounds += 1
            self._round.notify_all()
        return self._is_over

    @contextmanager
    def going_on(self) -> Iterator[None]:
        """Let the rounds go on until the block ends."""
        self._thread.start()
        try:
            yield
        finally:
            self._is_over = True
            self._thread.join(GUARD_S)
            assert not self._thread.is_alive()

    def wait_for(self, fact: Callable[[], object]) -> None:
        """Wait until a condition holds, checked after each round."""
        with self._round:
            assert self._round.wait_for(fact, GUARD_S), "it did not happen in time"


class Served(Rounds):
    """A server that runs, and a way to wait for what it does."""

    def __init__(self, server: Server) -> None:
        super().__init__(server.serve)
        self.server = server
        self.sim = server.sim

    def wait_rounds(self, count: int) -> None:
        """Wait until the server has looked at everything a few times more."""
        last = self.rounds + count
        self.wait_for(lambda: self.rounds >= last)

    def wait_free(self, robot: int = 1) -> None:
        """Wait until the server has noticed that the client has gone."""
        self.wait_for(lambda: self.sim.wires[robot - 1].holder is None)

    def wait_held(self, robot: int = 1) -> None:
        """Wait until the server has let a client in."""
        self.wait_for(lambda: self.sim.wires[robot - 1].holder is not None)


@contextmanager
def served(
    endpoints: Sequence[Endpoint] | Mapping[int, Sequence[Endpoint]],
    *,
    sim: Simulation | None = None,
    thinking: str = "none",
    **options: Any,
) -> Iterator[Served]:
    """Serve endpoints, of robot 1 if nothing else is said, until the block ends."""
    ways = endpoints if isinstance(endpoints, Mapping) else {1: endpoints}
    run = Served(Server(fresh(len(ways)) if sim is None else sim, ways, thinking=thinking, **options))
    with closing(run.server), run.going_on():
        yield run


def fresh(robots: int = 1, *, thinking: str = "none") -> Simulation:
    """Return a world that is always the same."""
    return Simulation(BOX, robots=robots, seed=7, thinking=thinking)


@contextmanager
def opened(path: str) -> Iterator[int]:
    """Open a port as a program does that leaves the terminal's settings as they are."""
    port = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        yield port
    finally:
        os.close(port)


def read_line(port: int) -> bytes:
    """Return a line that a port says."""
    line = b""
    while not line.endswith(b"\n"):
        assert select.select([port], [], [], GUARD_S)[0], f"no more than {line!r} came"
        line += os.read(port, 1)
    return line


def ask(port: int, command: bytes) -> bytes:
    """Send a command and return the reply."""
    os.write(port, command)
    return read_line(port)


def called(*words: str | Path, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, and keep what it says."""
    pipes = {"capture_output": True, "text": True, "timeout": GUARD_S, "check": False}
    return subprocess.run(words, **{**pipes, **options})


def run_python(program: str | Path, *arguments: str) -> str:
    """Run a client in its own process; return what it prints."""
    done = called(sys.executable, *(["-c", program] if isinstance(program, str) else [program]), *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout
