"""The door of the desk's server: connections that have not shown the token are few, and do not stay.

Need: whoever reaches the port may open connections and say nothing, until the process has no descriptors left.
Method: a connection is a stranger until `AccessControl` has accepted a request of it. Strangers have some seconds for
their request. When there are too many, the server closes the oldest one, so the next one always gets in.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

STRANGERS_MAX = 64
"""Most connections that have not shown the token."""

STRANGER_S = 10.0
"""How long one may take for that [s]."""

DOOR = "kiks_door"
"""What a request's state calls the door that it came by."""


class Door(H11Protocol):
    """One connection. h11 bounds what comes before a request's body to 64 KiB, which httptools does not."""

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, Any],
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, {**app_state, DOOR: self}, _loop)
        self._is_known = False
        self._came_s = self.loop.time()
        self._timer: asyncio.TimerHandle | None = None

    def let_in(self) -> None:
        """Note that it has shown the token."""
        self._is_known = True
        self._stop_timer()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin."""
        super().connection_made(transport)
        self._timer = self.loop.call_later(STRANGER_S, transport.abort)
        strangers = [each for each in self.connections if isinstance(each, Door) and each._is_stranger]
        if len(strangers) > STRANGERS_MAX:
            min(strangers, key=lambda each: each._came_s).transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._stop_timer()
        super().connection_lost(exc)

    @property
    def _is_stranger(self) -> bool:
        return not self._is_known and not self.transport.is_closing()

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
