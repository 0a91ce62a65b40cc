"""A limit on unauthenticated connections: without it, silent clients could use up all file descriptors.

A connection is unauthenticated until `AccessControl` has accepted a request of it. The server closes it after some
seconds, and closes the oldest one when there are too many, so a new connection always gets in.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

UNAUTHENTICATED_MAX = 64
"""Most connections that have not shown the token."""

AUTHENTICATION_S = 10.0
"""Time that a connection has to show the token [s]."""

CONNECTION_KEY = "kiks_connection"
"""Key of the connection in a request's state."""


class LimitedConnection(H11Protocol):
    """One connection. h11 bounds what comes before a request's body to 64 KiB, which httptools does not."""

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, {**app_state, CONNECTION_KEY: self}, _loop)
        self._is_known = False
        self._came_s = self.loop.time()
        self._timer: asyncio.TimerHandle | None = None

    def note_token(self) -> None:
        """Note that the client has shown the token."""
        self._is_known = True
        self._stop_timer()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the timer of a new connection and enforce the limit."""
        super().connection_made(transport)
        self._timer = self.loop.call_later(AUTHENTICATION_S, transport.abort)
        unauthenticated = [
            each for each in self.connections if isinstance(each, LimitedConnection) and each._is_unauthenticated
        ]
        if len(unauthenticated) > UNAUTHENTICATED_MAX:
            min(unauthenticated, key=lambda each: each._came_s).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Cancel the timer."""
        self._stop_timer()
        super().connection_lost(exc)

    @property
    def _is_unauthenticated(self) -> bool:
        return not self._is_known and not self.transport.is_closing()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
