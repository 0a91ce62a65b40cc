"""Access control: which connections and requests reach the desk, and how large they may be."""

from __future__ import annotations

import asyncio
import html
import re
from pathlib import Path
from urllib.parse import quote, urlencode, urlsplit

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketClose
from uvicorn.protocols.http.h11_impl import H11Protocol

from kiks.desk.server.token import COOKIE, Token
from kiks.errors import shown
from kiks.model.limits import REQUEST_BYTES_MAX

LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
"""Host names of this computer."""

HEADERS = [
    # Only notebooks of this computer may embed the page: other pages could trick people into clicks.
    ("content-security-policy", "frame-ancestors 'self' http://localhost:* http://127.0.0.1:* vscode-webview:"),
    ("referrer-policy", "same-origin"),
    ("x-content-type-options", "nosniff"),
]
"""Headers of every answer."""

REFUSED = (Path(__file__).parents[1] / "web" / "refused.html").read_text(encoding="utf-8")
"""The page of a refusal."""

STRANGERS_MAX = 64
"""Most connections that have not shown the token: silent clients could use up all file descriptors."""

STRANGER_S = 10.0
"""Time that a connection has to show the token [s]."""

TIMER = "kiks_timer"
"""Key of a connection's timer in the state of its requests."""


class LimitedConnection(H11Protocol):
    """One connection, a stranger until `AccessControl` has accepted a request of it and cancelled its timer.

    The timer closes it. If there are too many strangers, the oldest one is closed, so a new connection always gets in.
    h11 bounds what comes before a request's body to 64 KiB, and the body to its declared length.
    """

    timer: asyncio.TimerHandle

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the timer of a new connection and enforce the limit."""
        super().connection_made(transport)
        self.timer = self.loop.call_later(STRANGER_S, transport.abort)
        self.app_state = {**self.app_state, TIMER: self.timer}
        connections = [each for each in self.connections if isinstance(each, LimitedConnection)]
        strangers = [each for each in connections if not each.timer.cancelled()]
        if len(strangers) > STRANGERS_MAX:
            oldest = min(strangers, key=lambda each: each.timer.when())
            oldest.timer.cancel()
            oldest.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Cancel the timer."""
        self.timer.cancel()
        super().connection_lost(exc)


class AccessControl:
    """ASGI middleware that checks each request before it reaches the application.

    * Each request needs the token in a cookie, and a path in the token's place; `?token=...` or `?ticket=...` in an
      address sets the cookie and leads there.
    * A request with an `Origin` header must come from the desk's own page.
    * A desk for this computer alone accepts only host names of this computer, against DNS rebinding.
    * A request declares its length, which is at most `REQUEST_BYTES_MAX`.

    Args:
        app: The application.
        key: The token that browsers must know.
        is_local: Whether the desk is for this computer alone.
    """

    def __init__(self, app: ASGIApp, key: Token, *, is_local: bool = True) -> None:
        self._app = app
        self._key = key
        self._is_local = is_local

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request to the application, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        answer: ASGIApp
        try:
            answer = self._checked(HTTPConnection(scope))
        except HTTPException as refusal:
            page = REFUSED.replace("REASON", html.escape(refusal.detail))
            headers = {"cache-control": "no-store", "connection": "close"}
            answer = HTMLResponse(page, refusal.status_code, headers) if scope["type"] == "http" else WebSocketClose()
        await answer({**scope, "root_path": self._key.place}, receive, send)

    def _checked(self, request: HTTPConnection) -> ASGIApp:
        """Return what answers a request: the application, or a way to it; else raise the refusal."""
        self._check(request)
        if not self._knows_token(request):
            query = dict(request.query_params)
            token, ticket = query.pop("token", ""), query.pop("ticket", "")
            key, scope = self._key, request.scope
            is_page = scope["type"] == "http"
            if not is_page or not (key.fits(token) or key.take(ticket, scope.get("client"), scope.get("server"))):
                raise HTTPException(
                    403, "The desk must be opened with its token, but the address has none or another one"
                )
            path = scope["path"].removeprefix(key.place).lstrip("/")
            address = f"{key.place}/{quote(path)}" + (f"?{urlencode(query)}" if query else "")
            headers = {"set-cookie": self._cookie(request.headers), "cache-control": "no-store"}
            return RedirectResponse(address, 303, headers)
        if (timer := request.scope.get("state", {}).get(TIMER)) is not None:
            timer.cancel()
        return self._pass_on

    def _check(self, request: HTTPConnection) -> None:
        """Refuse a request that is not from the desk's own page, or is too large."""
        headers = request.headers
        host, origin, length = headers.get("host", ""), headers.get("origin"), headers.get("content-length", "0")
        if not request.scope["path"].isprintable():
            raise HTTPException(400, "A path must have printable characters only, but this one has others")
        try:
            name = urlsplit(f"//{host}").hostname or ""
            came_from = host if origin is None else urlsplit(origin).netloc
        except ValueError:
            raise HTTPException(
                400, f"Host and origin must be those of a page, but they were {shown(host)} and {shown(origin)}"
            ) from None
        if came_from != host:
            raise HTTPException(
                403, f"Requests must come from the desk's own page, but this one came from {shown(origin)}"
            )
        if self._is_local and name not in LOOPBACK:
            raise HTTPException(403, f"The desk's host must be a name of this computer, but it was {shown(host)}")
        is_open_ended = "transfer-encoding" in headers or not re.fullmatch("[0-9]{1,18}", length)
        if is_open_ended or int(length) > REQUEST_BYTES_MAX:
            raise HTTPException(
                413, f"A request must declare a length of at most {REQUEST_BYTES_MAX >> 20} MiB, but this one has not"
            )

    def _knows_token(self, request: HTTPConnection) -> bool:
        if not request.scope["path"].startswith(f"{self._key.place}/"):
            return False
        # Other servers of this computer may set cookies of the same name: a dictionary would hold one of them.
        pairs = (pair.strip().partition("=") for pair in request.headers.get("cookie", "").split(";"))
        return any(each == COOKIE and self._key.fits(value) for each, _, value in pairs)

    def _cookie(self, headers: Headers) -> str:
        """Return the cookie with the token; pages of other sites never send it, and other servers never get it.

        A notebook is another site: there the cookie is bound to the page of the notebook.
        """
        is_within = headers.get("sec-fetch-site") == "cross-site" and headers.get("sec-fetch-dest") in (
            "iframe",
            "frame",
        )
        rule = "SameSite=None; Secure; Partitioned" if is_within else "SameSite=Strict"
        return f"{COOKIE}={self._key.token}; Path={self._key.place}; HttpOnly; {rule}"

    async def _pass_on(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Call the application; a failure of it after the client has left is none."""
        has_left = False

        async def receive_noting() -> Message:
            nonlocal has_left
            message = await receive()
            has_left = has_left or message["type"].endswith(".disconnect")
            return message

        try:
            await self._app(scope, receive_noting, send)
        except Exception:
            if not has_left:
                raise
