"""Clients of a desk's server that are no browsers, with the token and without."""

from __future__ import annotations

import http.client
import socket
from typing import Any
from urllib.parse import urlsplit

from tests.guard import GUARD_S
from websockets.sync.client import ClientConnection, connect

from kiks.desk.server.server import SERVER
from kiks.desk.server.show import Shown
from kiks.desk.server.token import COOKIE

WITH_TOKEN = {"Cookie": f"{COOKIE}={SERVER.key.token}"}
"""The header of a client with the token."""


def connected(shown: Shown) -> socket.socket:
    """Return a new connection to the server."""
    url = urlsplit(shown.url)
    return socket.create_connection((url.hostname, url.port), timeout=GUARD_S)


def open_socket(shown: Shown, path: str | None = None, **options: Any) -> ClientConnection:
    """Open a WebSocket with the token: the feed of the desk if no path is given."""
    url = urlsplit(shown.url)
    address = f"ws://{url.netloc}{SERVER.key.place}{path or f'{url.path}/feed'}"
    options = {"additional_headers": WITH_TOKEN, **options}
    return connect(address, compression=None, open_timeout=GUARD_S, **options)


def ask(shown: Shown, method: str, path: str, body: bytes | None = None, **headers: str) -> tuple[int, str, bytes]:
    """Return status, headers and page that a client with the token gets."""
    url = urlsplit(shown.url)
    asking = http.client.HTTPConnection(url.netloc, timeout=GUARD_S)
    asking.request(method, f"{SERVER.key.place}{path}", body, {**WITH_TOKEN, **headers})
    answer = asking.getresponse()
    page = answer.read()
    asking.close()
    return answer.status, str(answer.headers), page
