"""Keeps the pages of NiceGUI apart: a connection reaches only pages that were opened with its own token.

All pages of a process share one socket address, and a message names the page that it is for by a random number. So a
number that became known would be enough to act in the page of another person.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from inspect import isawaitable
from typing import Any
from urllib.parse import parse_qs

from nicegui import Client
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from kiks.desk.server.access import KEY

EVENTS = ("handshake", "event", "javascript_response", "ack", "log")
"""NiceGUI's messages that name a page."""

OF_PAGE = re.compile(r"/_nicegui/client/([^/]+)/")
"""Addresses of a page's own, such as those of uploads."""


class PageGuard:
    """ASGI middleware for requests, whose tokens `AccessControl` has checked.

    Args:
        app: The application.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, unless it is for a page that was opened with another token."""
        page = OF_PAGE.search(scope.get("path", ""))
        answer = self._app if page is None or _may(scope, page[1]) else PlainTextResponse("Not Found", 404)
        await answer(scope, receive, send)


def guard_messages(server: Any) -> None:
    """Let a server of NiceGUI drop each message for a page that was opened with another token."""
    for event in ("connect", *EVENTS):
        server.on(event, _guarded(server, event, server.handlers["/"][event]))


def _guarded(server: Any, event: str, handler: Callable[..., Any]) -> Callable[..., Any]:
    async def guarded(socket: str, *given: Any) -> Any:
        environment = given[0] if event == "connect" else server.get_environ(socket)
        if event == "connect":
            page = parse_qs(environment.get("QUERY_STRING", "")).get("client_id", [""])[0]
        else:
            page = given[0].get("client_id") if given and isinstance(given[0], dict) else None
        if not isinstance(page, str) or not _may((environment or {}).get("asgi.scope", {}), page):
            return False
        outcome = handler(socket, *given)
        return await outcome if isawaitable(outcome) else outcome

    return guarded


def _may(scope: Scope, page: str) -> bool:
    """Return whether a connection may reach a page; one that is not there harms nothing."""
    client = Client.instances.get(page)
    return client is None or client.request.scope.get(KEY) is scope.get(KEY)
