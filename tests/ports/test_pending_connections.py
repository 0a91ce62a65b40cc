"""Who comes in by TCP: those who know the token; all others are few, and not for long; no shortage ends a server."""

from __future__ import annotations

import os
import resource
import select
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

import pytest
from tests.served import GUARD_S

from kiks.clock.patience import Patience
from kiks.ports import pending_connections
from kiks.ports.file_descriptors import Reserve
from kiks.ports.pending_connections import PATIENCE_S, PENDING_MAX, PendingConnections

TOKEN = "a-Token_of-32-characters-or-so--"


class Wall:
    """A clock that tests move."""

    def __init__(self) -> None:
        self.now_ns = 0

    def patience(self, seconds: float) -> Patience:
        return Patience(seconds, wall_ns=lambda: self.now_ns)


class Served:
    """A lobby that a test lets go round, and those who have been let in."""

    def __init__(self) -> None:
        listener = socket.create_server(("127.0.0.1", 0), backlog=200)
        self.address = listener.getsockname()
        self.wall = Wall()
        self.lobby = PendingConnections(listener, TOKEN, self._let_in, new_patience=self.wall.patience)
        self.inside: list[tuple[socket.socket, bytes]] = []

    def _let_in(self, connection: socket.socket, said: bytes) -> None:
        self.inside.append((connection, said))

    def come(self, said: bytes = b"") -> socket.socket:
        client = socket.create_connection(self.address)
        client.settimeout(GUARD_S)
        client.sendall(said)
        return client

    def wait_for(self, fact: Callable[[], object]) -> None:
        for _ in range(5000):
            if fact():
                return
            self.lobby.round(0.01)
        pytest.fail("it never was so")


@pytest.fixture
def served() -> Iterator[Served]:
    each = Served()
    yield each
    each.lobby.close()
    each.lobby.run()
    for connection, _ in each.inside:
        connection.close()


def is_over(client: socket.socket) -> bool:
    """Say whether the other end has hung up."""
    if not select.select([client], [], [], 0)[0]:
        return False
    with suppress(ConnectionResetError):
        return client.recv(1) == b""
    return True


@pytest.mark.parametrize(
    "said",
    [b"\n", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"x" * 1000, f"{TOKEN}x\n".encode(), b"\xff\0\n", b"\0 "],
)
def test_what_is_not_the_token_is_hung_up_on(served: Served, said: bytes) -> None:
    with served.come(said) as client:
        served.wait_for(lambda: is_over(client))
    assert served.inside == []


def test_the_token_lets_in_in_pieces_too_and_what_follows_is_kept(served: Served) -> None:
    with served.come(f"{TOKEN}\nversion\n".encode()):
        served.wait_for(lambda: served.inside)
    connection, said = served.inside[0]
    assert (said + connection.recv(100)).startswith(b"version\n"[: len(said) or 8])
    with served.come(TOKEN[:7].encode()) as client:
        served.lobby.round(0.01)
        client.sendall(f"{TOKEN[7:]}\r\n".encode())
        served.wait_for(lambda: len(served.inside) == 2)


def test_who_says_nothing_is_parted_from_after_a_while(served: Served) -> None:
    with served.come(b"a") as silent:
        for _ in range(5):
            served.lobby.round(0.01)
        assert not is_over(silent)
        served.wall.now_ns = round((PATIENCE_S + 0.1) * 1e9)
        served.wait_for(lambda: is_over(silent))


def test_pending_connections_are_limited_and_the_oldest_is_closed(served: Served) -> None:
    clients = [served.come() for _ in range(PENDING_MAX)]
    for _ in range(3 * PENDING_MAX):
        served.lobby.round(0.01)
    assert not any(map(is_over, clients))
    clients.append(served.come())
    served.wait_for(lambda: is_over(clients[0]))
    assert not any(map(is_over, clients[1:]))
    with served.come(f"{TOKEN}\n".encode()):
        served.wait_for(lambda: served.inside)
    for client in clients:
        client.close()


@contextmanager
def no_descriptors() -> Iterator[None]:
    """Take all descriptors that this process may have."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(soft, 400), hard))
    taken: list[int] = []
    try:
        with suppress(OSError):
            while True:
                taken.append(os.open(os.devnull, os.O_RDONLY))
        yield
    finally:
        for descriptor in taken:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_shortage_of_descriptors_ends_nothing_and_is_told_once(
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
            # One may have been let in, where something else has given up a descriptor meanwhile.
            served.wall.now_ns += round(PATIENCE_S * 1e9)
            served.wait_for(lambda: is_over(client))  # noqa: B023
    for client in clients:
        client.close()
    told = [record.getMessage() for record in caplog.records]
    assert len(told) == 1
    assert "a client needs a file descriptor: this process may have" in told[0]
    with served.come(f"{TOKEN}\n".encode()):
        served.wait_for(lambda: served.inside)


def test_a_lobby_serves_in_a_thread_until_it_is_closed() -> None:
    each = Served()
    thread = threading.Thread(target=each.lobby.run)
    thread.start()
    with each.come(b"x y") as client:
        assert client.recv(1) == b""
    each.lobby.close()
    thread.join(GUARD_S)
    assert not thread.is_alive()
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(each.address)
