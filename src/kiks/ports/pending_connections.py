"""The lobby: connections that have not said yet what lets them in. They are few, and not for long."""

from __future__ import annotations

import contextlib
import hmac
import selectors
import socket
from collections.abc import Callable
from dataclasses import dataclass, field

from kiks.clock.patience import Patience
from kiks.ports.file_descriptors import RESERVE

STRANGERS_MAX = 16
"""Most connections that have not said the token; when one more comes, the one that came first goes."""

PATIENCE_S = 5.0
"""How long each of them may take [s of real time]."""

LOOK_S = 0.25
"""How often it is looked whether one has taken too long [s of real time]."""


@dataclass
class _Stranger:
    connection: socket.socket
    patience: Patience
    said: bytearray = field(default_factory=bytearray)


class PendingConnections:
    """Lets in who knows a token, and parts from all others.

    The first line has to be the token. Whatever else is said first, such as HTTP, ends the connection.

    Args:
        listener: The socket that they come to.
        token: What they have to say: letters, digits, `-` and `_`.
        let_in: Takes the connection of one who has said it, and what came after the token.
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
        self._strangers: dict[int, _Stranger] = {}
        self._selector = selectors.DefaultSelector()
        self._selector.register(listener, selectors.EVENT_READ)
        self._is_closed = False

    def run(self) -> None:
        """Serve until `close`."""
        while not self._is_closed:
            self.round(LOOK_S)
        for number in list(self._strangers):
            self._part(number)
        self._selector.close()
        self._listener.close()

    def close(self) -> None:
        """Let nobody in any more; any thread may say so."""
        self._is_closed = True

    def round(self, wait_s: float) -> None:
        """Hear what is said, waiting for it at most so long [s], and part from those who have taken too long."""
        for key, _ in self._selector.select(wait_s):
            if key.fileobj is self._listener:
                self._meet()
            elif key.fd in self._strangers:
                self._hear(key.fd)
        for number, stranger in list(self._strangers.items()):
            if stranger.patience.left_s() == 0:
                self._part(number)

    def _meet(self) -> None:
        connection = None
        # A newcomer that has gone again is no reason to end.
        with contextlib.suppress(OSError):
            connection = RESERVE.accept(self._listener)
        if connection is None:
            return
        if len(self._strangers) >= STRANGERS_MAX:
            self._part(next(iter(self._strangers)))
        connection.setblocking(False)
        stranger = _Stranger(connection, self._new_patience(PATIENCE_S))
        stranger.patience.left_s()
        self._strangers[connection.fileno()] = stranger
        self._selector.register(connection.fileno(), selectors.EVENT_READ)

    def _hear(self, number: int) -> None:
        stranger = self._strangers[number]
        try:
            piece = stranger.connection.recv(1 + len(self._token))
        except BlockingIOError:
            return
        except OSError:
            piece = b""
        stranger.said += piece
        line, end, rest = bytes(stranger.said).partition(b"\n")
        if end and hmac.compare_digest(line.rstrip(b"\r"), self._token):
            del self._strangers[number]
            self._selector.unregister(number)
            stranger.connection.setblocking(True)
            self._let_in(stranger.connection, rest)
        elif end or not piece or len(line) > len(self._token) + 1 or b" " in line:
            self._part(number)

    def _part(self, number: int) -> None:
        self._selector.unregister(number)
        with contextlib.suppress(OSError):
            self._strangers.pop(number).connection.close()
