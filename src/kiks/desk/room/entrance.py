"""The entrance of a room: a plain page at which students give the room's code and choose their names."""

from __future__ import annotations

import asyncio
import hmac
import re
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from urllib.parse import parse_qs

from jinja2 import Environment
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.types import Receive, Scope, Send

from kiks.desk.server.access import LOOPBACK, TIMER, Visitors
from kiks.desk.server.fair_share import Bucket, Rate
from kiks.desk.server.token import Token
from kiks.errors import ParameterError, shown

LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
"""Of a code that KiKS makes: those that people confuse on a blackboard are missing."""

CODE_LENGTH = 6

FORM_BYTES_MAX = 4096
"""Most bytes of a form: a code and a name."""

ADDRESSES_MAX = 1000
"""Most addresses whose guesses are counted apart."""

_PAGE = Environment(autoescape=True).from_string(
    (Path(__file__).parents[1] / "web" / "entrance.html").read_text(encoding="utf-8")
)


def check_code(code: str) -> str:
    """Return a code that a person has chosen, as it is compared."""
    if not re.fullmatch(r"[A-Za-z0-9 -]{6,40}", code) or len(plain := plain_code(code)) < CODE_LENGTH:
        raise ParameterError(
            f"--code must have at least {CODE_LENGTH} letters and digits, at most 40, but it was {shown(code)}. Leave "
            "it out for one that nobody can guess."
        )
    return plain


def plain_code(code: str) -> str:
    """Return a code as it is compared: in capitals, without the blanks and dashes that people add.

    Example:
        >>> plain_code(" kx7-q2m")
        'KX7Q2M'
    """
    return re.sub(r"[\s-]", "", code).upper()


OF_ONE, OF_ALL = Rate(20, 0.5), Rate(200, 5.0)
"""How many wrong codes have no effect: of one address, which a whole class may share, and of all together. A code that
KiKS makes is one of a thousand million."""

PAUSE_MAX_S = 2.0
"""Longest pause before a code is looked at [s]. Connections without a token are few (`STRANGERS_MAX`), each with a code
at a time: a guesser needs half a year for half of all codes."""


class Guesses:
    """Counts wrong codes, and says for how long a code has to wait: a right one, too, so that a guesser has to stay.

    No address is refused: behind it there may be a school, and one joker.

    Args:
        wall_s: A monotonic clock [s]; tests pass their own.

    Example:
        >>> now = [0.0]
        >>> guesses = Guesses(wall_s=lambda: now[0])
        >>> for _ in range(21):
        ...     guesses.note_wrong("192.0.2.1")
        >>> guesses.pause_s("192.0.2.1"), guesses.pause_s("192.0.2.2")
        (2.0, 0.0)
        >>> now[0] = 1.5
        >>> guesses.pause_s("192.0.2.1")
        0.5
    """

    def __init__(self, *, wall_s: Callable[[], float] = time.monotonic) -> None:
        self._wall_s = wall_s
        self._all = Bucket(OF_ALL, wall_s=wall_s)
        self._each: dict[str, Bucket] = {}  # the newest last

    def pause_s(self, address: str) -> float:
        """Return for how long a code of an address has to wait, be it right or wrong [s]."""
        return min(max(each.add(0) for each in (self._all, self._bucket(address))), PAUSE_MAX_S)

    def note_wrong(self, address: str) -> None:
        """Count a wrong code."""
        for each in (self._all, self._bucket(address)):
            each.add(1)

    def _bucket(self, address: str) -> Bucket:
        bucket = self._each.pop(address, None) or Bucket(OF_ONE, wall_s=self._wall_s)
        self._each[address] = bucket
        while len(self._each) > ADDRESSES_MAX:
            del self._each[next(iter(self._each))]
        return bucket


class Entrance:
    """ASGI application for `/`.

    Args:
        code: The code, as `plain_code` returns it.
        title: What the page is called.
        visitors: Makes cookies.
        names: Returns the names, each with whether it is free.
        take: Gives a name to a browser, and returns its token; raises a `ParameterError` if it is not free.
    """

    def __init__(
        self,
        code: str,
        title: str,
        visitors: Visitors,
        names: Callable[[], dict[str, bool]],
        take: Callable[[str], Awaitable[Token]],
    ) -> None:
        self.guesses = Guesses()
        self._code, self._title, self._visitors = code, title, visitors
        self._names, self._take = names, take

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        await (await self._answer(Request(scope, receive)))(scope, receive, send)

    async def _answer(self, request: Request) -> Response:
        if request.method not in ("GET", "POST"):
            return Response(status_code=405)
        given = dict(request.query_params) if request.method == "GET" else await _form(request)
        if given is None:
            return Response(status_code=413)
        code, name = given.get("code", ""), given.get("name", "")
        if not code:
            return self._page("code")
        address = self._address(request)
        if pause_s := self.guesses.pause_s(address):
            await asyncio.sleep(pause_s)
        if not hmac.compare_digest(plain_code(code).encode(), self._code.encode()):
            self.guesses.note_wrong(address)
            return self._page("code", fault="The code is another one. Look at the blackboard again.", status=403)
        if (timer := request.scope.get("state", {}).get(TIMER)) is not None:
            timer.cancel()  # the code is as good as a token: while a whole class comes in, a desk takes its time
        if request.method == "GET" or not name:
            return self._page("names")
        try:
            key = await self._take(name)
        except ParameterError as error:
            return self._page("names", fault=str(error), status=409)
        return self._page(
            "welcome", home=f"{self._visitors.path}{key.place}/", name=name, cookie=self._visitors.cookie(key)
        )

    def _page(self, step: str, *, fault: str = "", status: int = 200, cookie: str = "", **more: str) -> Response:
        headers = {"cache-control": "no-store"} | ({"set-cookie": cookie} if cookie else {})
        names = self._names() if step == "names" else {}
        texts = {"title": self._title, "code": self._code, "path": self._visitors.path, "fault": fault, **more}
        return HTMLResponse(_PAGE.render(step=step, names=names, **texts), status, headers)

    def _address(self, request: Request) -> str:
        """Return whose guess it is: the connection's other end, or what a proxy of this computer says of its own."""
        address = request.client.host if request.client is not None else ""
        if self._visitors.public is not None and address in LOOPBACK:
            return request.headers.get("x-forwarded-for", address).rpartition(",")[2].strip()[:50]
        return address


async def _form(request: Request) -> dict[str, str] | None:
    """Return the fields of a form; None if it is too large."""
    data = b""
    async for piece in request.stream():
        data += piece
        if len(data) > FORM_BYTES_MAX:
            return None
    fields = parse_qs(data.decode("utf-8", errors="replace"), max_num_fields=10) if data.count(b"&") < 10 else {}
    return {name: values[0] for name, values in fields.items()}
