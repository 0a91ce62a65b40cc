"""Pending connections: only the token gives access, and their number and time are limited."""

import queue
import select
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress

import pytest
from tests.served import GUARD_S

from kiks.ports.pending_connections import PATIENCE_S, PENDING_MAX, PendingConnections

TOKEN = "a-Token_of-32-characters-or-so--"


class Served:
    """Pending connections in a thread, and the admitted ones."""

    def __init__(self, patience_s: float = PATIENCE_S) -> None:
        listener = socket.create_server(("127.0.0.1", 0), backlog=200)
        self.address = listener.getsockname()
        self.admitted: queue.Queue[tuple[socket.socket, bytes]] = queue.Queue()
        self.pending = PendingConnections(
            listener, TOKEN, lambda *connection: self.admitted.put(connection), patience_s=patience_s
        )
        self.thread = threading.Thread(target=self.pending.run)
        self.thread.start()

    def connect(self, received: bytes = b"") -> socket.socket:
        client = socket.create_connection(self.address, timeout=GUARD_S)
        client.sendall(received)
        return client

    def close(self) -> None:
        self.pending.close()
        self.thread.join(GUARD_S)
        assert not self.thread.is_alive()


@pytest.fixture
def served() -> Iterator[Served]:
    with closing(Served()) as each:
        yield each


def wait_for_end(client: socket.socket) -> None:
    with suppress(ConnectionResetError):
        assert client.recv(1) == b""


@pytest.mark.parametrize(
    "received",
    [b"\n", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"x" * 1000, f"{TOKEN}x\n".encode(), b"\xff\0\n", b"\0 "],
)
def test_connection_without_the_token_is_closed(served: Served, received: bytes) -> None:
    with served.connect(received) as client:
        wait_for_end(client)
    assert served.admitted.empty()


def test_token_may_come_in_pieces_and_the_bytes_after_it_are_kept(served: Served) -> None:
    for pieces in ([f"{TOKEN}\nversion\n"], [TOKEN[:7], f"{TOKEN[7:]}\r\n"]):
        with served.connect() as client:
            for piece in pieces:
                client.sendall(piece.encode())
            connection, received = served.admitted.get(timeout=GUARD_S)
            client.shutdown(socket.SHUT_WR)
            with connection, connection.makefile("rb") as file:
                assert received + file.read() == pieces[0].encode()[len(TOKEN) + 1 :]


def test_silent_connection_is_closed_after_its_patience() -> None:
    with closing(Served(patience_s=0.05)) as served, served.connect(b"a") as silent:
        wait_for_end(silent)


def test_pending_connections_are_limited_and_the_oldest_is_closed(served: Served) -> None:
    with ExitStack() as stack:
        clients = [stack.enter_context(served.connect()) for _ in range(PENDING_MAX + 1)]
        wait_for_end(clients[0])
        assert select.select(clients[1:], [], [], 0)[0] == [], "the others are open"
        stack.enter_context(served.connect(f"{TOKEN}\n".encode()))
        served.admitted.get(timeout=GUARD_S)[0].close()


def test_end_closes_the_port_and_all_that_wait(served: Served) -> None:
    with served.connect() as client:
        served.close()
        wait_for_end(client)
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(served.address)
