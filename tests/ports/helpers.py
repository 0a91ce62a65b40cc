"""Helpers of several tests of ports."""

from __future__ import annotations

import os
import resource
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import pytest
from tests.served import GUARD_S

from kiks.ports.tcp import TcpEndpoint
from kiks.units import NS_PER_S


class WallClock:
    """A wall clock that a test sets."""

    def __init__(self) -> None:
        self.time_ns = 5 * NS_PER_S

    def __call__(self) -> int:
        return self.time_ns

    def pass_s(self, time_s: float) -> None:
        self.pass_ns(round(time_s * NS_PER_S))

    def pass_ns(self, time_ns: int) -> None:
        self.time_ns += time_ns


def warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]


def connect(endpoint: TcpEndpoint) -> socket.socket:
    return socket.create_connection(("127.0.0.1", endpoint.port), timeout=GUARD_S)


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
