"""The guard at the door: who may see the page, open its sockets, and send files, and how much."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

COOKIE = "kiks_token"

LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
"""Names of this computer as it calls itself."""

FRAMES = (b"content-security-policy", b"frame-ancestors 'self' http://localhost:* http://127.0.0.1:* vscode-webview:")
"""Whose pages may show this one within theirs: notebooks of this computer. Others could trick people into clicks."""

BODY_LIMIT = 64 << 20
"""Most bytes of a request: a project of 64 million cells, compressed."""


class Guard:
    """Stands before an ASGI application and lets in who may come.

    * A page of another site gets nothing: whoever names an `Origin` must come from the page itself.
    * Only pages of this computer may show it within theirs.
    * Without a token, the page must have been asked for by a name of this computer, lest a foreign name that was made
      to mean it gets in.
    * With one, everything needs it, in a cookie; `?token=...` in an address sets the cookie.
    * No request is larger than `BODY_LIMIT`.

    Args:
        app: The application.
        token: What a browser must know; None to let every browser of this computer in.
    """

    def __init__(self, app: Application, token: str | None) -> None:
        self._app = app
        self._token = token

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Let a request through or answer it with a refusal."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refusal = self._refusal(headers)
        if refusal is None and self._token is not None and not self._knows_token(headers):
            query = dict(parse_qsl(scope.get("query_string", b"").decode("latin-1")))
            given = query.pop("token", "")
            if scope["type"] == "http" and self._is_token(given):
                await _redirect(send, scope["path"], query, given)
                return
            refusal = "the desk must be opened with its token: use the whole address that KiKS printed"
        if refusal is not None:
            await _refuse(scope, send, 403, refusal)
        else:
            limited = _Limited(receive, BODY_LIMIT)
            try:
                await self._app(scope, limited, _Framed(send))
            except RuntimeError:
                # Starlette says so, at length, when a browser leaves before it was answered: nobody is to read that.
                if not limited.has_left:
                    raise

    def _refusal(self, headers: dict[str, str]) -> str | None:
        """Say why a request is not from the desk's own page, None if it is."""
        host = headers.get("host", "")
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return f"requests must come from the desk's own page, but this one came from {origin!r}"
        if self._token is None and _name(host) not in LOOPBACK:
            return f"the desk must be asked for by the name of this computer, but it was {host!r}. Use 127.0.0.1"
        return None

    def _knows_token(self, headers: dict[str, str]) -> bool:
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            return False
        return cookie is not None and self._is_token(cookie.value)

    def _is_token(self, given: str) -> bool:
        return self._token is not None and hmac.compare_digest(given.encode(), self._token.encode())


class _Limited:
    """Passes on what a client sends, and ends a request that is too large.

    Attributes:
        has_left: Whether the client has gone.
    """

    def __init__(self, receive: Receive, limit: int) -> None:
        self._receive = receive
        self._left = limit
        self.has_left = False

    async def __call__(self) -> Message:
        message = await self._receive()
        self.has_left = self.has_left or message["type"] == "http.disconnect"
        if message["type"] == "http.request":
            self._left -= len(message.get("body", b""))
            if self._left < 0:
                return {"type": "http.disconnect"}
        return message


class _Framed:
    """Passes on what an application answers, with a word on who may show it within a page."""

    def __init__(self, send: Send) -> None:
        self._send = send

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), FRAMES]}
        await self._send(message)


def _name(host: str) -> str:
    """Return the name in 'name:port'."""
    return urlsplit(f"//{host}").hostname or "" if host else ""


async def _redirect(send: Send, path: str, query: dict[str, str], token: str) -> None:
    """Send a browser to the same page without the token in its address, and the token in a cookie."""
    location = path + (f"?{urlencode(query)}" if query else "")
    cookie = f"{COOKIE}={token}; Path=/; HttpOnly; SameSite=Strict"
    headers = [(b"location", location.encode()), (b"set-cookie", cookie.encode()), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": 303, "headers": headers})
    await send({"type": "http.response.body", "body": b""})


async def _refuse(scope: Message, send: Send, status: int, reason: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008, "reason": reason[:100]})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"KiKS: {reason}.\n".encode()})
