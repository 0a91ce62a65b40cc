"""Programs on other computers that drive robots of a desk: `kiks host`, `kiks run --join` and `kiks://HOST:PORT/1`."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from tests import forked
from tests.at_length import cases
from tests.guard import GUARD_S, wait_until
from tests.served import PROGRAMS, fresh

from kiks.clock.gate import Gate
from kiks.desk.server.desk import Desk
from kiks.desk.server.players import Players
from kiks.desk.server.server import SERVER
from kiks.desk.server.show import Driver, Shown
from kiks.ports.program_process import Command
from kiks.ports.programs import Programs
from kiks.sim.simulation import Simulation

pytestmark = pytest.mark.slow


class Host:
    """A world whose robots programs elsewhere drive."""

    def __init__(self, robots: int, thinking: str) -> None:
        self.sim = fresh(robots)
        self.said: list[str] = []
        numbers = range(1, robots + 1)

        def new_programs(sim: Simulation, commands: Sequence[Command | None], gate: Gate) -> Programs:
            options: dict[str, Any] = {"patience_s": GUARD_S, "say": self.said.append}
            return Programs(sim, commands, thinking=thinking, players=numbers, gate=gate, **options)

        self.desk = Desk(self.sim, speed=None, new_programs=new_programs)
        self.shown = Shown(self.desk, port=0)
        self.players = Players(self.desk, numbers, self.said.append)
        SERVER.let_in(self.players)
        self.tokens = {robot: key.token for key, robot in self.players.robots.items()}
        self.ends: list[tuple[int, str]] = []
        self.driver = Driver(self.desk, self._end)
        self._thread = threading.Thread(target=self.driver.run, daemon=True)
        self._thread.start()

    def _end(self, sim: Simulation) -> None:
        self.players.pause()
        self.ends.append((sim.now_ns, sim.state_hash()))

    def close(self) -> None:
        self.driver.stop()
        self._thread.join(GUARD_S)
        self.shown.close()

    def url(self, robot: int = 1, token: str | None = None) -> str:
        return f"kiks://{SERVER.place()}/{robot}?token={self.tokens[robot] if token is None else token}"

    def wait_said(self, text: str) -> None:
        wait_until(lambda: any(text in line for line in self.said))


@contextmanager
def hosted(robots: int = 1, thinking: str = "none") -> Iterator[Host]:
    host = Host(robots, thinking)
    try:
        yield host
    finally:
        host.close()


def at_once(*acts: Any) -> list[Any]:
    """Call functions in threads; return what they return."""
    results: list[Any] = [None] * len(acts)

    def call(index: int) -> None:
        try:
            results[index] = acts[index]()
        except Exception as error:
            results[index] = error

    threads = [threading.Thread(target=call, args=(index,), daemon=True) for index in range(len(acts))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(GUARD_S)
    return results


DRIVE = str(PROGRAMS / "drive.py")


def joined(url: str, *words: str) -> str:
    """Run a program in simulated time; return what it prints."""
    done = forked.run("run", "--join", url, DRIVE, "COM1", *words)
    assert done.returncode == 0, done.stderr
    return done.stdout


def opened(url: str, *words: str) -> str:
    """Run a program that opens the address as a port; return what it prints."""
    done = forked.run(code=f"import sys; sys.argv = {['drive.py', url, *words]}\n{Path(DRIVE).read_text()}")
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("thinking", cases(["fixed:2.5", "none"]))
def test_robots_of_a_host_run_as_those_of_kiks_run(thinking: str, tmp_path: Path) -> None:
    words = [("20", "5", "3"), ("15", "-4", "7")]
    with hosted(2, thinking) as host:
        heard = at_once(lambda: joined(host.url(1), *words[0]), lambda: opened(host.url(2), *words[1]))
        there = wait_until(lambda: host.ends)[0]
        assert not host.desk.programs.doubt
    files = [tmp_path / "1", tmp_path / "2"]
    here = fresh(2)
    commands = [
        Command(PROGRAMS / "into_file.py", [str(file), DRIVE, "COM1", *each])
        for file, each in zip(files, words, strict=True)
    ]
    assert Programs(here, commands, thinking=thinking, patience_s=GUARD_S).run() == 0
    assert heard == [file.read_text() for file in files]
    assert there == (here.now_ns, here.state_hash())
