"""Access control: which connections and requests reach the desk, and how large they may be."""

from __future__ import annotations

import asyncio
import html
import re
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote, urlencode, urlsplit

from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketClose
from uvicorn.protocols.http.h11_impl import H11Protocol

from kiks.desk.server.public_address import PublicAddress
from kiks.desk.server.token import COOKIE, Token
from kiks.errors import shown
from kiks.model.limits import REQUEST_BYTES_MAX

LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
"""Host names of this computer."""


def is_private(host: str, public: PublicAddress | None) -> bool:
    """Return whether only this computer reaches a server there, so that all who open its pages may start programs."""
    return host in LOOPBACK and public is None


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

ABORT = "kiks_abort"
"""Key of the function that closes a connection at once, in the state of its requests."""

KEY = "kiks_key"
"""Key of the token of a request in its scope."""

ADVICE = """<p>Open the complete address that KiKS printed when it started. It ends in <code>?token=</code> and a long
word. Your browser remembers it until you close the browser. In Python the address is <code>shown.url</code>, where
<code>shown = sim.show()</code>.</p>
<p>The address changes each time KiKS starts.</p>"""
"""What the page of a refusal advises; HTML."""

GONE = 1008
"""Code with which a WebSocket closes whose token has become invalid (RFC 6455, 7.4.1: it violates a policy)."""


@dataclass
class Visitors:
    """The tokens that open a server beside its owner's, and by which addresses.

    Attributes:
        keys: The tokens of others by their places.
        bearers: The tokens of programs, which send them in the header `Authorization`, by the paths that they open.
        entrance: Answers requests for `/` without a token; None: they are refused.
        advice: What the page of a refusal advises; HTML.
        public: The address that people open, if a proxy stands before the server.
        max_age_s: How long browsers keep cookies of others [s].
    """

    keys: dict[str, Token] = field(default_factory=dict)
    bearers: dict[str, list[Token]] = field(default_factory=dict)
    entrance: ASGIApp | None = None
    advice: str = ADVICE
    public: PublicAddress | None = None
    max_age_s: int = 30 * 24 * 3600
    _sockets: dict[str, set[Callable[[], Awaitable[None]]]] = field(default_factory=dict)

    @property
    def path(self) -> str:
        """The path that a proxy has put before those of this server."""
        return "" if self.public is None else self.public.path

    def add(self, key: Token) -> None:
        """Let a token in."""
        self.keys[key.place] = key

    async def remove(self, key: Token) -> None:
        """Refuse a token from now on, and close the WebSockets that it has opened; called in the server's thread."""
        self.keys.pop(key.place, None)
        for close in tuple(self._sockets.get(key.place, ())):
            await close()

    @contextmanager
    def noting(self, scope: Scope, close: Callable[[], Awaitable[None]]) -> Iterator[None]:
        """Note how a connection is closed, if it is a WebSocket, until it has ended."""
        sockets = self._sockets.setdefault(scope[KEY].place, set()) if scope["type"] == "websocket" else set()
        sockets.add(close)
        try:
            yield
        finally:
            sockets.discard(close)

    def cookie(self, key: Token) -> str:
        """Return the cookie with the token of a visitor who has come in by the entrance."""
        return f"{self.short_cookie(key)}; Max-Age={self.max_age_s}"

    def short_cookie(self, key: Token, rule: str = "SameSite=Strict") -> str:
        """Return a cookie with a token, until the browser is closed; only the key's own place gets it."""
        is_secure = self.public is not None and self.public.is_secure
        cookie = f"{COOKIE}={key.token}; Path={self.path}{key.place}; HttpOnly; {rule}"
        return f"{cookie}; Secure" if is_secure and "Secure" not in rule else cookie


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
        self.app_state = {**self.app_state, TIMER: self.timer, ABORT: transport.abort}
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

    * Each request needs a token in a cookie, and a path in its place that it opens; `?token=...` or `?ticket=...` in an
      address sets the owner's cookie and leads there. Programs send a token in the header `Authorization`.
    * A request with an `Origin` header must come from the desk's own page.
    * A desk for this computer alone accepts only host names of this computer, against DNS rebinding.
    * A request declares its length, which is at most `REQUEST_BYTES_MAX`.

    Args:
        app: The application.
        key: The token of the owner, which opens everything.
        is_local: Whether the desk is for this computer alone.
        visitors: The tokens that open it beside the owner's.
    """

    def __init__(self, app: ASGIApp, key: Token, *, is_local: bool = True, visitors: Visitors | None = None) -> None:
        self._app = app
        self._key = key
        self._is_local = is_local
        self._visitors = Visitors() if visitors is None else visitors

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request to the application, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        answer: ASGIApp
        try:
            answer = self._checked(HTTPConnection(scope))
        except HTTPException as refusal:
            page = REFUSED.replace("REASON", html.escape(refusal.detail)).replace("ADVICE", self._visitors.advice)
            headers = {"cache-control": "no-store", "connection": "close"}
            answer = HTMLResponse(page, refusal.status_code, headers) if scope["type"] == "http" else WebSocketClose()
        await answer(scope, receive, send)

    def _checked(self, request: HTTPConnection) -> ASGIApp:
        """Return what answers a request: the application, or a way to it; else raise the refusal."""
        self._check(request)
        scope, is_page, before = request.scope, request.scope["type"] == "http", self._visitors.path
        scope["path"] = scope["path"].removeprefix(before) if scope["path"].startswith(f"{before}/") else scope["path"]
        if (key := self._known_key(request)) is not None and not key.opens(scope["path"].removeprefix(key.place)):
            raise HTTPException(403, "A page must belong to your own desk, but this one does not")
        if scope["type"] == "websocket":
            key = key or self._bearer(request)
        if key is not None:
            if (timer := scope.get("state", {}).get(TIMER)) is not None:
                timer.cancel()
            # NiceGUI would put the path of this header before the paths of its files, where it is already.
            kept = [each for each in scope["headers"] if each[0] != b"x-forwarded-prefix"]
            place, path = before + key.place, before + scope["path"]
            scope.update({"root_path": place, "path": path, "headers": kept, KEY: key})
            return self._pass_on
        query = dict(request.query_params)
        token, ticket = query.pop("token", ""), query.pop("ticket", "")
        key = self._key
        if is_page and (key.fits(token) or key.take(ticket, scope.get("client"), scope.get("server"))):
            path = scope["path"].removeprefix(key.place).lstrip("/")
            # Relative, as some proxies put their own path before one that begins with a slash.
            address = f"{'../' * (scope['path'].count('/') - 1) or './'}{key.place[1:]}/{quote(path)}" + (
                f"?{urlencode(query)}" if query else ""
            )
            headers = {"set-cookie": self._own_cookie(request.headers), "cache-control": "no-store"}
            return RedirectResponse(address, 303, headers)
        if is_page and self._visitors.entrance is not None and scope["path"] == "/":
            return self._visitors.entrance
        raise HTTPException(403, "The desk must be opened with its token, but the address has none or another one")

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
        public = self._visitors.public
        if self._is_local and name not in LOOPBACK and (public is None or not public.admits(name)):
            raise HTTPException(403, f"The desk's host must be a name of this computer, but it was {shown(host)}")
        is_open_ended = "transfer-encoding" in headers or not re.fullmatch("[0-9]{1,18}", length)
        if is_open_ended or int(length) > REQUEST_BYTES_MAX:
            raise HTTPException(
                413, f"A request must declare a length of at most {REQUEST_BYTES_MAX >> 20} MiB, but this one has not"
            )

    def _known_key(self, request: HTTPConnection) -> Token | None:
        """Return the token at whose place a request is, if one of its cookies holds it."""
        place = "/" + request.scope["path"].split("/", 2)[1] if request.scope["path"].count("/") > 1 else ""
        key = self._key if place == self._key.place else self._visitors.keys.get(place)
        if key is None:
            return None
        # Other servers of this computer may set cookies of the same name: a dictionary would hold one of them.
        pairs = (pair.strip().partition("=") for pair in request.headers.get("cookie", "").split(";"))
        return key if any(each == COOKIE and key.fits(value) for each, _, value in pairs) else None

    def _bearer(self, request: HTTPConnection) -> Token | None:
        """Return the token that a program has sent, if it opens the path; all of them are compared."""
        given = request.headers.get("authorization", "").removeprefix("Bearer ")
        fitting = [key for key in self._visitors.bearers.get(request.scope["path"], ()) if key.fits(given)]
        return fitting[0] if fitting else None

    def _own_cookie(self, headers: Headers) -> str:
        """Return the cookie with the owner's token; pages of other sites never send it, and other servers never get it.

        A notebook is another site: there the cookie is bound to the page of the notebook.
        """
        is_within = headers.get("sec-fetch-site") == "cross-site" and headers.get("sec-fetch-dest") in (
            "iframe",
            "frame",
        )
        if is_within:
            return self._visitors.short_cookie(self._key, "SameSite=None; Secure; Partitioned")
        return self._visitors.short_cookie(self._key)

    async def _pass_on(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Call the application; a failure of it after the client has left is none."""
        has_left = False

        async def receive_noting() -> Message:
            nonlocal has_left
            message = await receive()
            has_left = has_left or message["type"].endswith(".disconnect")
            return message

        async def send_noting(message: Message) -> None:
            if not has_left:
                await send(message)

        async def close() -> None:
            nonlocal has_left
            if not has_left:
                has_left = True
                await send({"type": "websocket.close", "code": GONE})

        with self._visitors.noting(scope, close):
            try:
                await self._app(scope, receive_noting, send_noting)
            except Exception:
                if not has_left:
                    raise
