"""Helpers of several tests of ports."""

import os
import resource
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from tests.served import GUARD_S, Served, served

from kiks.clock.pace import Pace
from kiks.ports.endpoint import Endpoint
from kiks.ports.program_command import ProgramCommand
from kiks.ports.programs import Handle
from kiks.ports.tcp import TcpEndpoint
from kiks.sim.simulation import Simulation
from kiks.units import NS_PER_S


class WallClock:
    """A wall clock that a test sets."""

    def __init__(self) -> None:
        self.time_ns = 5 * NS_PER_S

    def __call__(self) -> int:
        return self.time_ns

    def pass_ns(self, time_ns: int) -> None:
        self.time_ns += time_ns


def warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]


def printed(handle: Handle) -> list[str]:
    """Return what a program has printed."""
    assert handle.output is not None
    return [line.text for line in handle.output.since(0)[1]]


def wheels(sim: Simulation, robot: int = 1) -> list[int]:
    """Return the speeds that a robot has been told."""
    return sim.world.state.robots["speed_setpoint"][0, robot - 1].tolist()


def write(path: Path, text: str, *arguments: str) -> ProgramCommand:
    """Write a program, in a folder that need not be there; return its command."""
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_text(text)
    return ProgramCommand(path, list(arguments))


def connect(endpoint: TcpEndpoint) -> socket.socket:
    return socket.create_connection(("127.0.0.1", endpoint.port), timeout=GUARD_S)


@contextmanager
def live(endpoint: Endpoint | None = None, speed: float = 1.0) -> Iterator[tuple[Served, Any, WallClock]]:
    """Serve robot 1, over TCP if nothing else is said, to the pace of a wall clock that a test sets."""
    wall, endpoint = WallClock(), TcpEndpoint(0) if endpoint is None else endpoint
    with served([endpoint], thinking="live", pace=Pace(speed, wall_ns=wall)) as run:
        yield run, endpoint, wall


def ask_socket(client: socket.socket, command: bytes) -> bytes:
    client.sendall(command)
    line = b""
    while not line.endswith(b"\n"):
        line += client.recv(1)
    return line


@contextmanager
def no_descriptors() -> Iterator[list[int]]:
    """Take all descriptors that this process may have; yield them."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(soft, 400), hard))
    taken: list[int] = []
    try:
        with suppress(OSError):
            while True:
                taken.append(os.open(os.devnull, os.O_RDONLY))
        yield taken
    finally:
        for descriptor in taken:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
