"""Pending connections: only the token gives access, and their number and time are limited."""

from __future__ import annotations

import select
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress

import pytest
from tests.ports.helpers import no_descriptors, warnings
from tests.served import GUARD_S

from kiks.clock.patience import Patience
from kiks.ports import pending_connections
from kiks.ports.file_descriptors import Reserve
from kiks.ports.pending_connections import PATIENCE_S, PENDING_MAX, PendingConnections

TOKEN = "a-Token_of-32-characters-or-so--"


class Wall:
    """A wall clock that a test sets."""

    def __init__(self) -> None:
        self.now_ns = 0

    def patience(self, seconds: float) -> Patience:
        return Patience(seconds, wall_ns=lambda: self.now_ns)


class Served:
    """Pending connections whose rounds a test runs, and the admitted connections."""

    def __init__(self) -> None:
        listener = socket.create_server(("127.0.0.1", 0), backlog=200)
        self.address = listener.getsockname()
        self.wall = Wall()
        self.pending = PendingConnections(listener, TOKEN, self._admit, new_patience=self.wall.patience)
        self.admitted: list[tuple[socket.socket, bytes]] = []

    def _admit(self, connection: socket.socket, received: bytes) -> None:
        self.admitted.append((connection, received))

    def connect(self, received: bytes = b"") -> socket.socket:
        client = socket.create_connection(self.address)
        client.settimeout(GUARD_S)
        client.sendall(received)
        return client

    def wait_for(self, fact: Callable[[], object]) -> None:
        for _ in range(5000):
            if fact():
                return
            self.pending.round(0.01)
        pytest.fail("the condition did not become true")


@pytest.fixture
def served() -> Iterator[Served]:
    each = Served()
    yield each
    each.pending.close()
    each.pending.run()
    for connection, _ in each.admitted:
        connection.close()


def is_over(client: socket.socket) -> bool:
    """Return whether the other end has closed the connection."""
    if not select.select([client], [], [], 0)[0]:
        return False
    with suppress(ConnectionResetError):
        return client.recv(1) == b""
    return True


@pytest.mark.parametrize(
    "received",
    [b"\n", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"x" * 1000, f"{TOKEN}x\n".encode(), b"\xff\0\n", b"\0 "],
)
def test_connection_without_the_token_is_closed(served: Served, received: bytes) -> None:
    with served.connect(received) as client:
        served.wait_for(lambda: is_over(client))
    assert served.admitted == []


def test_token_may_come_in_pieces_and_the_bytes_after_it_are_kept(served: Served) -> None:
    with served.connect(f"{TOKEN}\nversion\n".encode()):
        served.wait_for(lambda: served.admitted)
    connection, received = served.admitted[0]
    assert (received + connection.recv(100)).startswith(b"version\n"[: len(received) or 8])
    with served.connect(TOKEN[:7].encode()) as client:
        served.pending.round(0.01)
        client.sendall(f"{TOKEN[7:]}\r\n".encode())
        served.wait_for(lambda: len(served.admitted) == 2)


def test_silent_connection_is_closed_after_its_patience(served: Served) -> None:
    with served.connect(b"a") as silent:
        for _ in range(5):
            served.pending.round(0.01)
        assert not is_over(silent)
        served.wall.now_ns = round((PATIENCE_S + 0.1) * 1e9)
        served.wait_for(lambda: is_over(silent))


def test_pending_connections_are_limited_and_the_oldest_is_closed(served: Served) -> None:
    clients = [served.connect() for _ in range(PENDING_MAX)]
    for _ in range(3 * PENDING_MAX):
        served.pending.round(0.01)
    assert not any(map(is_over, clients))
    clients.append(served.connect())
    served.wait_for(lambda: is_over(clients[0]))
    assert not any(map(is_over, clients[1:]))
    with served.connect(f"{TOKEN}\n".encode()):
        served.wait_for(lambda: served.admitted)
    for client in clients:
        client.close()


def test_shortage_of_descriptors_is_logged_once_and_the_server_goes_on(
    served: Served, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pending_connections, "RESERVE", Reserve())
    pending_connections.RESERVE.hold()
    clients = [socket.socket() for _ in range(20)]
    with no_descriptors():
        for client in clients:
            client.settimeout(GUARD_S)
            client.connect(served.address)
        for client in clients:
            # One may have been accepted if another thread has closed a descriptor meanwhile.
            served.wall.now_ns += round(PATIENCE_S * 1e9)
            served.wait_for(lambda: is_over(client))  # noqa: B023
    for client in clients:
        client.close()
    (warning,) = warnings(caplog)
    assert "a client needs a file descriptor: this process may have" in warning
    with served.connect(f"{TOKEN}\n".encode()):
        served.wait_for(lambda: served.admitted)


def test_run_serves_until_close() -> None:
    each = Served()
    thread = threading.Thread(target=each.pending.run)
    thread.start()
    with each.connect(b"x y") as client:
        assert client.recv(1) == b""
    each.pending.close()
    thread.join(GUARD_S)
    assert not thread.is_alive()
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(each.address)
