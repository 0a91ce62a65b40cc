"""Clients of a desk's server that are no browsers, with the token and without."""

import http.client
from contextlib import closing
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from tests.guard import GUARD_S
from websockets.sync.client import ClientConnection, connect

from kiks.desk.server.server import SERVER
from kiks.desk.server.show import Shown
from kiks.desk.server.token import COOKIE


@dataclass
class Client:
    """A browser without a person: it keeps one cookie, and its pages have addresses that begin with its home."""

    cookie: str = ""
    home: str = ""

    def ask(
        self, path: str, method: str = "GET", body: str | bytes | None = None, **headers: str
    ) -> tuple[int, str, str]:
        """Return status, headers and page."""
        sent = {"Cookie": self.cookie, **{name.replace("_", "-"): value for name, value in headers.items()}}
        with closing(http.client.HTTPConnection(urlsplit(SERVER.address()).netloc, timeout=GUARD_S)) as asking:
            asking.request(method, path, body, sent)
            answer = asking.getresponse()
            return answer.status, str(answer.headers), answer.read().decode(errors="replace")

    def page(self, path: str = "") -> tuple[int, str]:
        """Return status and text of a page of its own."""
        status, _, page = self.ask(f"{self.home}{path}")
        return status, page

    def socket(self, path: str, **options: Any) -> ClientConnection:
        """Open a WebSocket of its own."""
        url = f"ws://{urlsplit(SERVER.address()).netloc}{self.home}{path}"
        headers = {"Cookie": self.cookie}
        return connect(url, additional_headers=headers, compression=None, open_timeout=GUARD_S, **options)


OWNER = Client(f"{COOKIE}={SERVER.key.token}", f"{SERVER.key.place}/")
"""A client with the token of the server."""


def feed_of(shown: Shown) -> ClientConnection:
    """Open the feed of a desk with the token."""
    return OWNER.socket(f"{urlsplit(shown.url).path[1:]}/feed")
