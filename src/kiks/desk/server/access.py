"""The guard at the door: who may see the page, open its sockets, and send files, and how much."""

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
from kiks.desk.server.token import Token

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
"""Names of this computer as it calls itself."""

HEADERS = [
    # Whose pages may show this one within theirs: notebooks of this computer. Others could trick people into clicks.
    (b"content-security-policy", b"frame-ancestors 'self' http://localhost:* http://127.0.0.1:* vscode-webview:"),
    (b"referrer-policy", b"same-origin"),
    (b"x-content-type-options", b"nosniff"),
]
"""What goes with each answer."""

BODY_LIMIT = 64 << 20
"""Most bytes of a request: a project of 64 million cells, compressed."""

REFUSED = (Path(__file__).parents[1] / "web" / "refused.html").read_text(encoding="utf-8")
"""The page for a browser that may not come in."""

NO_TOKEN = "The desk must be opened with its token, but it was asked for without, or with another one"


class Refusal(NamedTuple):
    """Why a request is refused.

    Attributes:
        status: As HTTP has it.
        reason: For a person.
    """

    status: int
    reason: str


class AccessControl:
    """Stands before an ASGI application and lets in who may come.

    * Everything needs the token, in a cookie; `?token=...` in an address sets the cookie, and so does a ticket.
    * A page of another site gets nothing: whoever names an `Origin` must come from the page itself.
    * Only pages of this computer may show it within theirs.
    * A desk for this computer alone must be asked for by a name of it, lest a foreign name that was made to mean it
      gets in.
    * No request is larger than `BODY_LIMIT`.
    * What the application fails at is a line in the log.

    Args:
        app: The application.
        key: What a browser must know.
        is_local: Whether the desk is for this computer alone.
    """

    def __init__(self, app: Application, key: Token, *, is_local: bool = True) -> None:
        self._app = app
        self._key = key
        self._is_local = is_local

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Let a request through or answer it with a refusal."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refusal = self._refusal(scope, headers)
        if refusal is None and not self._knows_token(scope, headers):
            query = dict(parse_qsl(scope.get("query_string", b"").decode("latin-1")))
            if scope["type"] == "http" and self._opens(scope, query.pop("token", ""), query.pop("ticket", "")):
                await _redirect(send, scope["path"], query, self._cookie(scope, headers))
                return
            refusal = Refusal(403, NO_TOKEN)
        if refusal is not None:
            await _refuse(scope, send, refusal)
            return
        connection = scope.get("state", {}).get(CONNECTION_KEY)
        if connection is not None:
            connection.note_token()
        await self._pass_on(scope, receive, send)

    def _refusal(self, scope: Message, headers: dict[str, str]) -> Refusal | None:
        """Say why a request is not from the desk's own page, None if it is."""
        host, origin, length = headers.get("host", ""), headers.get("origin"), headers.get("content-length", "0")
        if not scope["path"].isprintable():
            return Refusal(400, "A path must be of printable characters, but this one was not")
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
            return Refusal(403, f"The desk must be asked for by the name of this computer, but it was {_short(host)}")
        if not re.fullmatch("[0-9]{1,18}", length) or int(length) > BODY_LIMIT:
            return Refusal(413, f"A request must have at most {BODY_LIMIT >> 20} MiB, but this one has more")
        return None

    def _knows_token(self, scope: Message, headers: dict[str, str]) -> bool:
        name = self._key.cookie_name(scope.get("server"))
        # By hand: the library's parser gives up at the first cookie of another program that it does not understand.
        pairs = (pair.strip().partition("=") for pair in headers.get("cookie", "").split(";"))
        return any(each == name and self._key.fits(value) for each, _, value in pairs)

    def _opens(self, scope: Message, token: str, ticket: str) -> bool:
        return self._key.fits(token) or self._key.take(ticket, scope.get("client"), scope.get("server"))

    def _cookie(self, scope: Message, headers: dict[str, str]) -> str:
        """Return the cookie with the token. Pages of other sites never send it: but a notebook is another site.

        There it is bound to that notebook's page.
        """
        is_within = headers.get("sec-fetch-site") == "cross-site" and headers.get("sec-fetch-dest") in (
            "iframe",
            "frame",
        )
        rule = "SameSite=None; Secure; Partitioned" if is_within else "SameSite=Strict"
        return f"{self._key.cookie_name(scope.get('server'))}={self._key.token}; Path=/; HttpOnly; {rule}"

    async def _pass_on(self, scope: Message, receive: Receive, send: Send) -> None:
        """Let the application answer; whatever goes wrong there, the client gets an answer and nobody a traceback."""
        limited, answer = _Limited(receive, BODY_LIMIT), _Answer(send, scope)
        try:
            await self._app(scope, limited, answer)
        except Exception as error:
            # When a client has left, or its request was cut off, that is what it fails at.
            if not limited.has_left and not limited.is_too_large:
                note(f"It could not answer {_short(scope['path'])}", error)
        if limited.is_too_large and not answer.has_begun:
            await _refuse(scope, send, Refusal(413, f"A request must have at most {BODY_LIMIT >> 20} MiB"))
        elif not answer.has_begun and not limited.has_left:
            await _refuse(scope, answer, Refusal(500, "The desk could not answer this"))


class _Limited:
    """Passes on what a client sends, and ends a request that is too large.

    Attributes:
        has_left: Whether the client has gone.
        is_too_large: Whether it has sent too much.
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
    """Passes on what an application answers, with what goes with each answer.

    Attributes:
        has_begun: Whether it has answered anything.
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
                # Only files are sent so: what the application stumbles over is a body that is none.
                message["status"] = 400
        await self._send(message)


def _short(text: str | None) -> str:
    """Return a text from outside as it may be shown."""
    return ascii(text)[:80]


async def _redirect(send: Send, path: str, query: dict[str, str], cookie: str) -> None:
    """Send a browser to the same page without the token in its address, and the token in a cookie."""
    # Two strokes would begin the name of another computer.
    location = "/" + quote(path.lstrip("/")) + (f"?{urlencode(query)}" if query else "")
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
