"""The entrance of a room: a plain page at which students give the room's code and choose their names."""

from __future__ import annotations

import asyncio
import hmac
import re
from collections.abc import Awaitable, Callable
from pathlib import Path
from urllib.parse import parse_qsl

from jinja2 import Environment
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.types import Receive, Scope, Send

from kiks.desk.server.access import TIMER, Visitors
from kiks.desk.server.fair_share import Bucket, Rate
from kiks.desk.server.token import Token
from kiks.errors import ParameterError, shown

LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
"""Of a code that KiKS makes: those that people confuse on a blackboard are missing."""

CODE_LENGTH = 6

FORM_BYTES_MAX = 4096
"""Most bytes of a form: a code and a name."""

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
    """Return a code as it is compared: in capitals, without the blanks and dashes that people add."""
    return re.sub(r"[\s-]", "", code).upper()


WRONG_CODES = Rate(20, 5.0)
"""How many wrong codes have no effect. A code that KiKS makes is one of a thousand million."""

PAUSE_MAX_S = 2.0
"""Longest pause before a code is looked at [s], be it right or wrong, so that a guesser has to stay. Connections
without a token are few (`STRANGERS_MAX`), each with a code at a time: a guesser needs half a year for half of all
codes. No address is refused: behind it there may be a school, and one joker."""


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
        self._wrong_codes = Bucket(WRONG_CODES)
        self._code, self._title, self._visitors = code, title, visitors
        self._names, self._take = names, take

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        await (await self._answer(Request(scope, receive)))(scope, receive, send)

    async def _answer(self, request: Request) -> Response:
        if request.method not in ("GET", "POST"):
            return Response(status_code=405)
        if int(request.headers.get("content-length", "0")) > FORM_BYTES_MAX:
            return Response(status_code=413)
        form = (await request.body()).decode(errors="replace")
        given = dict(request.query_params) if request.method == "GET" else dict(parse_qsl(form))
        code, name = given.get("code", ""), given.get("name", "")
        if not code:
            return self._page("code")
        await asyncio.sleep(min(self._wrong_codes.add(0), PAUSE_MAX_S))
        if not hmac.compare_digest(plain_code(code).encode(), self._code.encode()):
            self._wrong_codes.add(1)
            return self._page("code", fault="The code is another one. Look at the blackboard again.", status=403)
        # The code is as good as a token: while a whole class comes in, a desk takes its time.
        request.scope["state"][TIMER].cancel()
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
