"""Who may come to the desk."""

from __future__ import annotations

import asyncio
from contextlib import nullcontext
from typing import Any

import pytest

from kiks.desk.guard import BODY_LIMIT, Guard

TOKEN = "a-secret"


async def app(scope: Any, receive: Any, send: Any) -> None:
    while (message := await receive())["type"] == "http.request" and message.get("more_body"):
        pass
    if message["type"] == "http.disconnect":
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"welcome"})


def come(
    token: str | None = None,
    *,
    kind: str = "http",
    query: bytes = b"",
    body: list[bytes] | None = None,
    **headers: str,
) -> list[dict[str, Any]]:
    """Return what somebody is answered who comes with these headers."""
    pieces = list(body or [b""])
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        if kind == "websocket":
            return {"type": "websocket.connect"}
        piece = pieces.pop(0)
        return {"type": "http.request", "body": piece, "more_body": bool(pieces)}

    async def send(message: Any) -> None:
        sent.append(message)

    scope = {
        "type": kind,
        "path": "/desk/1",
        "query_string": query,
        "headers": [(name.encode(), value.encode()) for name, value in {"host": "127.0.0.1:8123", **headers}.items()],
    }
    asyncio.run(Guard(app, token)(scope, receive, send))
    return sent


def status(answers: list[dict[str, Any]]) -> int:
    first = answers[0]
    return 403 if first["type"] == "websocket.close" else first.get("status", 101)


@pytest.mark.parametrize("host", ["127.0.0.1:8123", "localhost:8123", "[::1]:8123", "localhost"])
def test_this_computer_may_come(host: str) -> None:
    assert status(come(host=host)) == 200
    assert status(come(host=host, origin=f"http://{host}")) == 200


def test_only_pages_of_this_computer_may_show_it_within_theirs() -> None:
    policy = dict(come()[0]["headers"])[b"content-security-policy"]
    assert policy.startswith(b"frame-ancestors 'self' http://localhost:*")
    assert b" *" not in policy.replace(b":*", b"")


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1:9999"},
        {"host": "evil.example:8123"},
        {"host": "evil.example:8123", "origin": "http://evil.example:8123"},
        {"host": ""},
    ],
)
def test_nobody_else_may(kind: str, headers: dict[str, str]) -> None:
    assert status(come(kind=kind, **headers)) == 403


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "cookie", ["", "kiks_token=", "kiks_token=wrong", "other=a-secret", "kiks_token=a-secre", "\x80"]
)
def test_without_the_token_nobody_may(kind: str, cookie: str) -> None:
    headers = {"cookie": cookie} if cookie else {}
    assert status(come(TOKEN, kind=kind, host="robots.example:8123", **headers)) == 403
    assert status(come(TOKEN, kind="websocket", query=b"token=a-secret", host="robots.example:8123", **headers)) == 403


def test_token_becomes_a_cookie_and_leaves_the_address() -> None:
    answers = come(TOKEN, query=b"token=a-secret&x=1", host="robots.example:8123")
    headers = dict(answers[0]["headers"])
    assert answers[0]["status"] == 303
    assert headers[b"location"] == b"/desk/1?x=1"
    assert headers[b"set-cookie"] == b"kiks_token=a-secret; Path=/; HttpOnly; SameSite=Strict"
    assert status(come(TOKEN, query=b"token=wrong")) == 403
    assert status(come(TOKEN, host="robots.example:8123", cookie="a=b; kiks_token=a-secret")) == 200
    assert status(come(TOKEN, host="r:1", origin="http://evil", cookie="kiks_token=a-secret")) == 403


def test_what_is_too_large_is_cut_off() -> None:
    piece = b"x" * (1 << 20)
    assert status(come(body=[piece] * (BODY_LIMIT >> 20))) == 200
    assert come(body=[piece] * ((BODY_LIMIT >> 20) + 1)) == []


@pytest.mark.parametrize("has_left", [True, False])
def test_only_who_is_still_there_can_be_failed(has_left: bool) -> None:
    async def fails(scope: Any, receive: Any, send: Any) -> None:
        await receive()
        raise RuntimeError("No response returned.")

    async def receive() -> dict[str, Any]:
        return {"type": "http.disconnect"} if has_left else {"type": "http.request", "body": b""}

    async def send(message: Any) -> None:
        raise AssertionError(message)

    coming = Guard(fails, None)({"type": "http", "headers": [(b"host", b"localhost")]}, receive, send)
    with nullcontext() if has_left else pytest.raises(RuntimeError):
        asyncio.run(coming)
