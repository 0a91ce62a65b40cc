"""Access control: which requests reach the desk, and how large they may be."""

from __future__ import annotations

import html
import re
from collections.abc import Awaitable, Callable, MutableMapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import parse_qsl, quote, urlencode, urlsplit

from kiks.desk.server.connection_limit import CONNECTION_KEY
from kiks.desk.server.server_log import note
from kiks.desk.server.token import COOKIE, Token
from kiks.model.limits import REQUEST_BYTES_MAX

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
"""Host names of this computer."""

HEADERS = [
    # Only notebooks of this computer may embed the page: other pages could trick people into clicks.
    (b"content-security-policy", b"frame-ancestors 'self' http://localhost:* http://127.0.0.1:* vscode-webview:"),
    (b"referrer-policy", b"same-origin"),
    (b"x-content-type-options", b"nosniff"),
]
"""Headers of every answer."""

TOO_LARGE = f"A request must have at most {REQUEST_BYTES_MAX >> 20} MiB"

REFUSED = (Path(__file__).parents[1] / "web" / "refused.html").read_text(encoding="utf-8")
"""The page of a refusal."""

NO_TOKEN = "The desk must be opened with its token, but the address has none or another one"


class Refusal(NamedTuple):
    """Answer to a request that is refused.

    Attributes:
        status: HTTP status.
        reason: The reason, for a person.
    """

    status: int
    reason: str


class AccessControl:
    """ASGI middleware that checks each request before it reaches the application.

    * Each request needs the token in a cookie, and a path in the token's place; `?token=...` or `?ticket=...` in an
      address sets the cookie and leads there.
    * A request with an `Origin` header must come from the desk's own page.
    * Only pages of this computer may embed the page.
    * A desk for this computer alone accepts only host names of this computer, against DNS rebinding.
    * No request is larger than `REQUEST_BYTES_MAX`.
    * An exception in the application is logged in one line.

    Args:
        app: The application.
        key: The token that browsers must know.
        is_local: Whether the desk is for this computer alone.
    """

    def __init__(self, app: Application, key: Token, *, is_local: bool = True) -> None:
        self._app = app
        self._key = key
        self._is_local = is_local

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Pass a request to the application, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refusal = self._refusal(scope, headers)
        if refusal is None and not self._knows_token(scope["path"], headers):
            query = dict(parse_qsl(scope.get("query_string", b"").decode("latin-1")))
            if scope["type"] == "http" and self._opens(scope, query.pop("token", ""), query.pop("ticket", "")):
                path = scope["path"].removeprefix(self._key.place).lstrip("/")
                await _redirect(send, f"{self._key.place}/{quote(path)}", query, self._cookie(headers))
                return
            refusal = Refusal(403, NO_TOKEN)
        if refusal is not None:
            await _refuse(scope, send, refusal)
            return
        connection = scope.get("state", {}).get(CONNECTION_KEY)
        if connection is not None:
            connection.note_token()
        await self._pass_on({**scope, "root_path": self._key.place}, receive, send)

    def _refusal(self, scope: Message, headers: dict[str, str]) -> Refusal | None:
        """Return a refusal if a request is not from the desk's own page or is too large, else None."""
        host, origin, length = headers.get("host", ""), headers.get("origin"), headers.get("content-length", "0")
        if not scope["path"].isprintable():
            return Refusal(400, "A path must have printable characters only, but this one has others")
        try:
            name = urlsplit(f"//{host}").hostname or ""
            came_from = None if origin is None else urlsplit(origin).netloc
        except ValueError:
            return Refusal(
                400, f"Host and origin must be those of a page, but they were {_short(host)} and {_short(origin)}"
            )
        if came_from is not None and came_from != host:
            return Refusal(403, f"Requests must come from the desk's own page, but this one came from {_short(origin)}")
        if self._is_local and name not in LOOPBACK:
            return Refusal(403, f"The desk's host must be a name of this computer, but it was {_short(host)}")
        if not re.fullmatch("[0-9]{1,18}", length) or int(length) > REQUEST_BYTES_MAX:
            return Refusal(413, f"{TOO_LARGE}, but this one has more")
        return None

    def _knows_token(self, path: str, headers: dict[str, str]) -> bool:
        if not path.startswith(f"{self._key.place}/"):
            return False
        # The library's parser stops at the first cookie that it cannot parse, and other programs set such cookies.
        pairs = (pair.strip().partition("=") for pair in headers.get("cookie", "").split(";"))
        return any(each == COOKIE and self._key.fits(value) for each, _, value in pairs)

    def _opens(self, scope: Message, token: str, ticket: str) -> bool:
        return self._key.fits(token) or self._key.take(ticket, scope.get("client"), scope.get("server"))

    def _cookie(self, headers: dict[str, str]) -> str:
        """Return the cookie with the token; pages of other sites never send it, and other servers never get it.

        A notebook is another site: there the cookie is bound to the page of the notebook.
        """
        is_within = headers.get("sec-fetch-site") == "cross-site" and headers.get("sec-fetch-dest") in (
            "iframe",
            "frame",
        )
        rule = "SameSite=None; Secure; Partitioned" if is_within else "SameSite=Strict"
        return f"{COOKIE}={self._key.token}; Path={self._key.place}; HttpOnly; {rule}"

    async def _pass_on(self, scope: Message, receive: Receive, send: Send) -> None:
        """Call the application; after any failure the client gets an answer, and the log one line."""
        limited, answer = _Limited(receive, REQUEST_BYTES_MAX), _Answer(send, scope)
        try:
            await self._app(scope, limited, answer)
        except Exception as error:
            # A failure after the client has left, or its request was cut off, is no fault of the application.
            if not limited.has_left and not limited.is_too_large:
                note(f"It could not answer {_short(scope['path'].removeprefix(self._key.place))}", error)
        if limited.is_too_large and not answer.has_begun:
            await _refuse(scope, send, Refusal(413, TOO_LARGE))
        elif not answer.has_begun and not limited.has_left:
            await _refuse(scope, answer, Refusal(500, "The desk could not answer this request"))


class _Limited:
    """Receives a request, and cuts it off at the size limit.

    Attributes:
        has_left: Whether the client has closed the connection.
        is_too_large: Whether the request was cut off.
    """

    def __init__(self, receive: Receive, limit: int) -> None:
        self._receive = receive
        self._left = limit
        self.has_left = False
        self.is_too_large = False

    async def __call__(self) -> Message:
        message = await self._receive()
        self.has_left = self.has_left or message["type"].endswith(".disconnect")
        if message["type"] == "http.request":
            self._left -= len(message.get("body", b""))
            if self._left < 0:
                self.is_too_large = True
                return {"type": "http.disconnect"}
        return message


class _Answer:
    """Sends the answer of the application with `HEADERS`.

    Attributes:
        has_begun: Whether a part of the answer was sent.
    """

    def __init__(self, send: Send, scope: Message) -> None:
        self._send = send
        self._is_upload = scope.get("method") == "POST"
        self.has_begun = False

    async def __call__(self, message: Message) -> None:
        self.has_begun = True
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), *HEADERS]}
            if self._is_upload and message["status"] == 500:
                # Only uploads are POST requests: the application fails because the body is malformed.
                message["status"] = 400
        await self._send(message)


def _short(text: str | None) -> str:
    """Return a text of a client, escaped and shortened for display."""
    return ascii(text)[:80]


async def _redirect(send: Send, path: str, query: dict[str, str], cookie: str) -> None:
    """Redirect a browser to a page without the token in its address, and set the cookie."""
    location = path + (f"?{urlencode(query)}" if query else "")
    headers = [(b"location", location.encode()), (b"set-cookie", cookie.encode()), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": 303, "headers": [*headers, *HEADERS]})
    await send({"type": "http.response.body", "body": b""})


async def _refuse(scope: Message, send: Send, refusal: Refusal) -> None:
    if scope["type"] == "websocket":
        with suppress(RuntimeError):
            await send({"type": "websocket.close", "code": 1008, "reason": refusal.reason[:100]})
        return
    headers = [
        (b"content-type", b"text/html; charset=utf-8"),
        (b"cache-control", b"no-store"),
        (b"connection", b"close"),
    ]
    page = REFUSED.replace("REASON", html.escape(refusal.reason))
    await send({"type": "http.response.start", "status": refusal.status, "headers": [*headers, *HEADERS]})
    await send({"type": "http.response.body", "body": page.encode()})
