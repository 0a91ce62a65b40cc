"""Connections that have not shown the token yet. Their number and their time are limited."""

from __future__ import annotations

import contextlib
import hmac
import selectors
import socket
from collections.abc import Callable
from dataclasses import dataclass, field

from kiks.clock.patience import Patience
from kiks.ports.file_descriptors import RESERVE

PENDING_MAX = 16
"""Most pending connections; when one more comes, the oldest is closed."""

PATIENCE_S = 5.0
"""Time within which a connection must show the token [s of real time]."""

CHECK_S = 0.25
"""Longest time between two checks of these times [s of real time]."""


@dataclass
class _Pending:
    connection: socket.socket
    patience: Patience
    received: bytearray = field(default_factory=bytearray)


class PendingConnections:
    """Accepts connections that begin with the token, and closes all others.

    The first line must be the token. Anything else, such as HTTP, ends the connection.

    Args:
        listener: The listening socket.
        token: The token: letters, digits, `-` and `_`.
        let_in: Called with a connection that has shown the token, and the bytes after it.
        new_patience: For tests: makes patiences with their own wall clock.
    """

    def __init__(
        self,
        listener: socket.socket,
        token: str,
        let_in: Callable[[socket.socket, bytes], None],
        *,
        new_patience: Callable[[float], Patience] = Patience,
    ) -> None:
        listener.setblocking(False)
        RESERVE.hold()
        self._listener = listener
        self._token = token.encode("ascii")
        self._let_in = let_in
        self._new_patience = new_patience
        self._pending: dict[int, _Pending] = {}
        self._selector = selectors.DefaultSelector()
        self._selector.register(listener, selectors.EVENT_READ)
        self._is_closed = False

    def run(self) -> None:
        """Serve until `close`."""
        while not self._is_closed:
            self.round(CHECK_S)
        for number in list(self._pending):
            self._close(number)
        self._selector.close()
        self._listener.close()

    def close(self) -> None:
        """Stop accepting connections; from any thread."""
        self._is_closed = True

    def round(self, wait_s: float) -> None:
        """Accept and read, for at most `wait_s` [s], and close connections that have taken too long."""
        for key, _ in self._selector.select(wait_s):
            if key.fileobj is self._listener:
                self._accept()
            elif key.fd in self._pending:
                self._read(key.fd)
        for number, pending in list(self._pending.items()):
            if pending.patience.left_s() == 0:
                self._close(number)

    def _accept(self) -> None:
        connection = None
        # The client may have gone again.
        with contextlib.suppress(OSError):
            connection = RESERVE.accept(self._listener)
        if connection is None:
            return
        if len(self._pending) >= PENDING_MAX:
            self._close(next(iter(self._pending)))
        connection.setblocking(False)
        pending = _Pending(connection, self._new_patience(PATIENCE_S))
        pending.patience.left_s()
        self._pending[connection.fileno()] = pending
        self._selector.register(connection.fileno(), selectors.EVENT_READ)

    def _read(self, number: int) -> None:
        pending = self._pending[number]
        try:
            piece = pending.connection.recv(1 + len(self._token))
        except BlockingIOError:
            return
        except OSError:
            piece = b""
        pending.received += piece
        line, end, rest = bytes(pending.received).partition(b"\n")
        if end and hmac.compare_digest(line.rstrip(b"\r"), self._token):
            del self._pending[number]
            self._selector.unregister(number)
            pending.connection.setblocking(True)
            self._let_in(pending.connection, rest)
        elif end or not piece or len(line) > len(self._token) + 1 or b" " in line:
            self._close(number)

    def _close(self, number: int) -> None:
        self._selector.unregister(number)
        with contextlib.suppress(OSError):
            self._pending.pop(number).connection.close()
