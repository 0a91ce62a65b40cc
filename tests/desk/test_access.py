"""Access control of the desk."""

import asyncio
import os
import re
import socket
from contextlib import nullcontext
from typing import Any
from urllib.parse import quote, urljoin

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.stranger import STRANGER, as_stranger, needs_root

from kiks.desk.server.access import AccessControl
from kiks.desk.server.token import Token, connection_user
from kiks.model.limits import REQUEST_BYTES_MAX

TOKEN = "a-secret"
KEY = Token(TOKEN)
PAGE = f"{KEY.place}/desk/1"
COOKIE = "kiks_token=a-secret"


async def app(scope: Any, receive: Any, send: Any) -> None:
    await receive()
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"welcome"})


def come(
    *,
    kind: str = "http",
    method: str = "GET",
    path: str = PAGE,
    query: bytes = b"",
    is_local: bool = True,
    application: Any = app,
    key: Token = KEY,
    ends: tuple[Any, Any] = (None, None),
    headers: list[tuple[bytes, bytes]] | None = None,
    received: str = "http.request",
    **named: str,
) -> list[dict[str, Any]]:
    """Return the answer to a request with these headers."""
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        return {"type": "websocket.connect" if kind == "websocket" else received}

    async def send(message: Any) -> None:
        sent.append(message)

    given = {"host": "127.0.0.1:8123", **{name.replace("_", "-"): value for name, value in named.items()}}
    headers = headers or [(name.encode(), value.encode("utf-8")) for name, value in given.items()]
    scope = {"type": kind, "method": method, "path": path, "query_string": query, "headers": headers}
    scope |= {"client": ends[0], "server": ends[1]}
    asyncio.run(AccessControl(application, key, is_local=is_local)(scope, receive, send))
    return sent


def status(answers: list[dict[str, Any]]) -> int:
    first = answers[0]
    return 403 if first["type"] == "websocket.close" else first.get("status", 101)


def headers_of(answers: list[dict[str, Any]]) -> dict[str, str]:
    return {name.decode(): value.decode() for name, value in answers[0]["headers"]}


@pytest.mark.parametrize(("kind", "welcome"), [("http", 200), ("websocket", 101)])
def test_a_browser_with_the_token_is_accepted(kind: str, welcome: int) -> None:
    for host in ("127.0.0.1:8123", "localhost:8123", "[::1]:8123", "localhost"):
        # Other programs of this computer have cookies in the same jar, of any form.
        for more in ({}, {"origin": f"http://{host}"}, {"cookie": f'a={{"b": [1; 2]}}; x; =; {COOKIE}; c="'}):
            assert status(come(kind=kind, host=host, **{"cookie": COOKIE, **more})) == welcome, (host, more)


@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_a_page_of_another_site_is_refused_even_with_the_token(kind: str) -> None:
    origins = ("http://evil.example", "null", "", "http://127.0.0.1:9999")
    hosts = {"host": "evil.example:8123"}, {"host": "evil.example:8123", "origin": "http://evil.example:8123"}
    for headers in (*({"origin": origin} for origin in origins), *hosts, {"host": ""}):
        assert status(come(kind=kind, cookie=COOKIE, **headers)) == 403, headers
        assert status(come(kind=kind, query=b"token=a-secret", **headers)) == 403, headers


@pytest.mark.parametrize("is_local", [True, False])
@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "cookie", ["", *(f"kiks_token={text}" for text in ("", "wrong", "a-secre", "\u20ac")), "other=a-secret", "\x80"]
)
def test_requests_without_the_token_are_refused(kind: str, cookie: str, is_local: bool) -> None:
    headers = {"cookie": cookie} if cookie else {}
    assert status(come(kind=kind, path="/desk/1", is_local=is_local, cookie=COOKIE)) == 403
    for query in (b"", b"token=", b"token=wrong", b"token=%E2%82%AC", b"ticket=", b"ticket=a-secret"):
        answers = come(kind=kind, query=query, is_local=is_local, **headers)
        assert (status(answers), TOKEN in str(answers)) == (403, False)
    assert status(come(kind="websocket", query=b"token=a-secret", is_local=is_local, **headers)) == 403


def test_refusal_tells_how_to_open_the_desk() -> None:
    page = come()[1]["body"].decode()
    assert "must be opened with its token" in page
    assert "Open the complete address that KiKS printed" in page
    assert b"<script" not in come(path="/<script>alert(1)</script>\x01", host="<script>")[1]["body"]


def test_token_becomes_a_cookie_and_leaves_the_address_also_within_a_notebook() -> None:
    for path in ("/desk/1", PAGE):
        answers = come(path=path, query=b"token=a-secret&x=1", host="robots.example:8123", is_local=False)
        headers = headers_of(answers)
        assert (status(answers), urljoin(path, headers["location"])) == (303, f"{PAGE}?x=1")
        assert headers["set-cookie"] == f"kiks_token=a-secret; Path={KEY.place}; HttpOnly; SameSite=Strict"
    assert status(come(host="robots.example:8123", cookie="a=b; kiks_token=a-secret", is_local=False)) == 200
    # A notebook of another site gets a partitioned one.
    within = {"sec_fetch_site": "cross-site", "sec_fetch_dest": "iframe"}
    cookie = headers_of(come(query=b"token=a-secret", **within))["set-cookie"]
    assert cookie.endswith("HttpOnly; SameSite=None; Secure; Partitioned")
    assert status(come(**within)) == 403


@pytest.mark.slow
@given(path=st.text(max_size=30).map(lambda text: f"/{text}"), query=st.binary(max_size=30))
def test_redirect_with_the_cookie_leads_to_the_desk(path: str, query: bytes) -> None:
    answers = come(path=path, query=b"token=a-secret&" + query)
    if status(answers) == 303:
        given = headers_of(answers)["location"]
        assert re.fullmatch(r"\.[!-~]+", given)
        location = urljoin(quote(path), given)
        assert location.startswith(f"{KEY.place}/")
        assert TOKEN not in location or b"token" in query or "secret" in path
    else:
        assert status(answers) in (400, 403)


RAW = st.binary(max_size=40) | st.sampled_from(
    [*b"http://[ http://[::1 // http://a]b http://127.0.0.1:99999999".split(), b"\r\nx: y", b"kiks_token=\xff"]
)
NAMES = st.sampled_from([b"host", b"origin", b"cookie", b"content-length", b"sec-fetch-site", b"x"])


@given(
    kind=st.sampled_from(["http", "websocket"]),
    path=st.text(max_size=20).map(lambda text: f"/{text}"),
    query=st.binary(max_size=20),
    headers=st.lists(st.tuples(NAMES, RAW), min_size=1, max_size=6),
    is_local=st.booleans(),
)
def test_random_requests_without_the_token_are_refused(**parts: Any) -> None:
    async def inside(scope: Any, receive: Any, send: Any) -> None:
        raise AssertionError("a stranger is in")

    assert status(come(application=inside, **parts)) in (400, 403, 413)


def test_malformed_and_too_large_requests_are_refused() -> None:
    for parts, refused in (
        *(({"origin": origin}, 400) for origin in ("http://[", "http://[::1", "http://a]b")),
        ({"path": f"{PAGE}\r\nset-cookie: a=b"}, 400),
        *(({"content_length": length}, 413) for length in (str(REQUEST_BYTES_MAX + 1), "9" * 30, "-1", "x")),
        ({"transfer_encoding": "chunked"}, 413),
        ({"content_length": str(REQUEST_BYTES_MAX)}, 200),
    ):
        assert status(come(method="POST", cookie=COOKIE, **parts)) == refused, parts


def test_a_failure_after_the_client_has_left_is_none() -> None:
    async def fails(scope: Any, receive: Any, send: Any) -> None:
        await receive()
        raise RuntimeError("No response returned.")

    assert come(application=fails, cookie=COOKIE, received="http.disconnect") == []


@pytest.fixture(params=["127.0.0.1", "::1"])
def ends(request: pytest.FixtureRequest) -> Any:
    """Two ends of a connection on this computer: the browser's address, and the desk's."""
    family = socket.AF_INET6 if ":" in request.param else socket.AF_INET
    try:
        listener = socket.create_server((request.param, 0), family=family)
    except OSError:
        pytest.skip(f"this computer has no {request.param}")
    with listener, socket.create_connection(listener.getsockname()[:2]) as client, listener.accept()[0]:
        yield client.getsockname()[:2], listener.getsockname()[:2]


def test_a_ticket_is_valid_once_and_for_this_user_only(ends: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    key = Token(TOKEN)
    shown = {"path": "/desk/1", "query": f"ticket={key.new_ticket()}".encode(), "key": key}
    for others in ((None, None), ((ends[0][0], 1), ends[1])):
        assert status(come(**shown, ends=others)) == 403
    mine = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: mine + 1)
    monkeypatch.setattr("kiks.desk.server.token.connection_user", lambda client, server: mine + 2)
    assert status(come(**shown, ends=ends)) == 403
    monkeypatch.undo()
    answers, page = come(**shown, ends=ends), f"{key.place}/desk/1"
    headers = headers_of(answers)
    assert (status(answers), urljoin("/desk/1", headers["location"])) == (303, page)
    assert headers["set-cookie"].startswith("kiks_token=a-secret;")
    assert status(come(**shown, ends=ends)) == 403
    assert status(come(path=page, key=key, ends=ends, cookie=COOKIE)) == 200


@needs_root
def test_a_ticket_is_nothing_to_another_user() -> None:
    check_ticket((STRANGER, as_stranger, False), (0, nullcontext, False))


def test_a_connection_that_was_closed_belongs_to_nobody() -> None:
    # The system lists what is left of it as the superuser's, who may open every desk.
    check_ticket((None, nullcontext, True), (os.getuid(), nullcontext, False))


def check_ticket(*clients: tuple[int | None, Any, bool]) -> None:
    """Check that of clients with a ticket the last one alone comes in.

    Args:
        *clients: For each its user, the rights with which it connects, and whether it has closed the connection.
    """
    key = Token(TOKEN)
    query = f"ticket={key.new_ticket()}".encode()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        for user, rights, is_closed in clients:
            with rights():
                client = socket.create_connection(listener.getsockname())
            ends = client.getsockname(), listener.getsockname()
            with client, listener.accept()[0]:
                if is_closed:
                    client.close()
                assert connection_user(*ends) == user
                is_last = user == clients[-1][0]
                assert status(come(path="/desk/1", query=query, key=key, ends=ends)) == (303 if is_last else 403)


def test_user_of_finds_the_owner_of_a_connection(ends: Any) -> None:
    client, server = ends
    assert connection_user(client, server) == os.getuid()
    assert connection_user(server, client) is not None
    for nobody in ((client[0], 1), ("192.0.2.1", client[1]), ("no address", 1)):
        assert connection_user(nobody, server) is None
