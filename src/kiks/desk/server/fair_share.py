"""Keeps one student from taking a server that a class shares: requests and messages of a token that opens one desk."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import NamedTuple
from weakref import WeakKeyDictionary

from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from kiks.desk.server.access import KEY
from kiks.desk.server.token import LIBRARY_PATHS, Token

OPEN_MAX = 64
"""Most requests and WebSockets of a token at one time: a browser has eight or so for a page."""

PAGE_COST = 30
"""What a page costs when a file costs 1: it is built, and kept until its browser has gone for a while."""


class Rate(NamedTuple):
    """How much may come at once, and then how much a second."""

    at_once: float
    per_s: float


REQUESTS, MESSAGES = Rate(600, 60), Rate(400, 200)
"""Of a token. A page loads sixty files at first; while something is dragged it sends sixty messages a second."""


class Bucket:
    """Counts what has come, and forgets it at a rate.

    Args:
        rate: The rate.
        wall_s: A monotonic clock [s]; tests pass their own.

    Example:
        >>> now = [0.0]
        >>> bucket = Bucket(Rate(2, 1), wall_s=lambda: now[0])
        >>> [bucket.add(1) for _ in range(3)]
        [0.0, 0.0, 1.0]
        >>> now[0] = 5.0
        >>> bucket.add(1)
        0.0
    """

    def __init__(self, rate: Rate, *, wall_s: Callable[[], float] = time.monotonic) -> None:
        self._rate, self._wall_s = rate, wall_s
        self._since_s, self._count = wall_s(), 0.0

    def add(self, count: float) -> float:
        """Count something, and return after how long it is within the rate [s]; 0 if it is."""
        now_s = self._wall_s()
        self._count = max(self._count - self._rate.per_s * (now_s - self._since_s), 0.0) + count
        self._since_s = now_s
        return max(self._count - self._rate.at_once, 0.0) / self._rate.per_s

    def take_back(self, count: float) -> None:
        """Forget something that was counted."""
        self._count -= count


class _Share:
    def __init__(self) -> None:
        self.open_count = 0
        self.requests, self.messages = Bucket(REQUESTS), Bucket(MESSAGES)


class FairShare:
    """ASGI middleware for requests whose tokens `AccessControl` has checked.

    A request that is too much is refused. WebSockets are read more slowly instead: then the browser has to wait.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._shares: WeakKeyDictionary[Token, _Share] = WeakKeyDictionary()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        key: Token | None = scope.get(KEY)
        if key is None or key.desk is None:
            await self._app(scope, receive, send)
            return
        share = self._shares.setdefault(key, _Share())
        path = scope["path"].removeprefix(scope["root_path"])
        is_file = path.startswith(LIBRARY_PATHS) or path.endswith("/engine.wasm")
        cost = 1 if is_file or scope["type"] == "websocket" else PAGE_COST
        if share.requests.add(cost) or share.open_count >= OPEN_MAX:
            share.requests.take_back(cost)
            refusal = PlainTextResponse("Too many requests", 429) if scope["type"] == "http" else WebSocketClose()
            await refusal(scope, receive, send)
            return

        async def receive_slowly() -> Message:
            message = await receive()
            if scope["type"] == "websocket" and (wait_s := share.messages.add(1)):
                await asyncio.sleep(wait_s)
            return message

        share.open_count += 1
        try:
            await self._app(scope, receive_slowly, send)
        finally:
            share.open_count -= 1
