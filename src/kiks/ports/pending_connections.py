"""Connections that have not shown the token yet. Their number and their time are limited."""

from __future__ import annotations

import contextlib
import hmac
import socket
import threading
from collections.abc import Callable

from kiks.clock.patience import Patience
from kiks.ports.resources import accept

PENDING_MAX = 16
"""Most pending connections; when one more comes, the oldest is closed."""

PATIENCE_S = 5.0
"""Time within which a connection must show the token [s of real time]."""

CHECK_S = 0.25
"""Time within which `run` ends after `close` [s of real time]."""


class PendingConnections:
    """Accepts connections that begin with the token, and closes all others.

    The first line must be the token. Anything else, such as HTTP, ends the connection.

    Args:
        listener: The listening socket.
        token: The token: letters, digits, `-` and `_`.
        let_in: Called in a thread of its own with a connection that has shown the token, and the bytes after it.
        patience_s: Time within which a connection must show the token [s of real time].
    """

    def __init__(
        self,
        listener: socket.socket,
        token: str,
        let_in: Callable[[socket.socket, bytes], None],
        *,
        patience_s: float = PATIENCE_S,
    ) -> None:
        listener.settimeout(CHECK_S)
        self._listener = listener
        self._token = token.encode("ascii")
        self._let_in = let_in
        self._patience_s = patience_s
        self._pending: list[socket.socket] = []
        self._lock = threading.Lock()
        self._is_closed = False

    def run(self) -> None:
        """Serve until `close`."""
        while not self._is_closed:
            connection = None
            # The client may have gone again.
            with contextlib.suppress(OSError):
                connection = accept(self._listener)
            if connection is not None:
                self._limit(PENDING_MAX - 1)
                self._pending.append(connection)
                threading.Thread(target=self._check, args=(connection,), daemon=True).start()
        self._listener.close()
        self._limit(0)

    def close(self) -> None:
        """Stop accepting connections; from any thread."""
        self._is_closed = True

    def _limit(self, count: int) -> None:
        """End the oldest connections until so many are left; the thread of each then closes it."""
        with self._lock:
            while len(self._pending) > count:
                with contextlib.suppress(OSError):
                    self._pending.pop(0).shutdown(socket.SHUT_RDWR)

    def _check(self, connection: socket.socket) -> None:
        """Let a connection in if its first line is the token, and close any other."""
        received, patience = b"", Patience(self._patience_s)
        with contextlib.suppress(OSError):
            while b"\n" not in received and b" " not in received and len(received) <= len(self._token) + 1:
                connection.settimeout(max(patience.left_s(), 1e-3))
                piece = connection.recv(1 + len(self._token))
                if not piece:
                    break
                received += piece
        line, end, rest = received.partition(b"\n")
        with self._lock:
            is_pending = connection in self._pending
            if is_pending:
                self._pending.remove(connection)
        # In constant time: the time that a comparison takes would tell how many characters are right.
        if is_pending and end and hmac.compare_digest(line.rstrip(b"\r"), self._token):
            connection.settimeout(None)
            self._let_in(connection, rest)
        else:
            connection.close()
